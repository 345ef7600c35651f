//! Files or signals that are missing, damaged, for another machine or unconnected: reported, and without effect on the
//! machine.

use super::bench::LinuxCncBench;
use super::motion::{self, example};
use programs::files;
use programs::process::root;

/// Lines of HAL that wait for a pin to have a value.
fn until(pin: &str, value: &str) -> String {
    format!("loadusr -w sh /tmp/until trueaxis.{pin} {value}\n")
}

fn set(pin: &str, value: &str) -> String {
    format!("setp trueaxis.{pin} {value}\n")
}

/// The thread polls once per millisecond, on a busy computer later.
fn pulse(pin: &str) -> String {
    set(pin, "0") + "loadusr -w sleep 0.3\n" + &set(pin, "1")
}

/// Words `PIN=VALUE`, which set a pin, and `PIN?VALUE`, which wait until it has a value.
fn steps(words: &str) -> String {
    let step = |word: &str| match word.split_once('?') {
        Some((pin, value)) => until(pin, value),
        None => word
            .split_once('=')
            .map_or_else(String::new, |(pin, value)| set(pin, value)),
    };
    words.split_whitespace().map(step).collect()
}

fn copy(from: &str, to: &str) -> String {
    format!("loadusr -w cp /tmp/{from} /tmp/{to}\n")
}

/// Loads the component and starts a thread.
fn started(parameters: &str) -> String {
    format!(
        "loadrt threads name1=t period1=1000000\nloadrt trueaxis {parameters}\n\
         addf trueaxis.read t\naddf trueaxis.write t\nstart\n"
    )
}

/// Inputs are read every 20 ms, on a busy computer later.
const READ: &str = "loadusr -w sleep 0.5\n";

/// Positions and references of the joints.
fn referenced(joints: usize) -> String {
    let each =
        |j| set(&format!("joint.{j}.pos-in"), "1.5") + &set(&format!("joint.{j}.homed"), "1");
    (0..joints).map(each).collect()
}

/// Runs lines; checks that everything awaited has occurred, and that these texts were printed.
fn run(bench: &LinuxCncBench, lines: &str, texts: &[&str]) -> Result<(), String> {
    let said = bench.halrun(lines)?;
    if said.contains("until: ") || said.contains("not found") {
        return Err(format!("{said}\nafter\n{lines}"));
    }
    match texts.iter().find(|text| !said.contains(**text)) {
        Some(text) => Err(format!("not said: {text}\n{said}\nafter\n{lines}")),
        None => Ok(()),
    }
}

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    let golden = |name: &str| files::read(&root().join("tests/golden/v1").join(name));
    let huron = golden("huron-13.trax")?;
    let mut damaged = huron.clone();
    damaged[1000] ^= 4;
    for (name, bytes) in [
        ("huron.trax", huron.clone()),
        ("everything.trax", golden("everything.trax")?),
        ("router.trax", golden("router-10.trax")?),
        ("damaged.trax", damaged),
        ("short.trax", huron[..huron.len() - 8].to_vec()),
        ("empty.trax", Vec::new()),
        ("text.trax", b"no compensation at all".to_vec()),
    ] {
        bench.write(name, bytes)?;
    }
    let count = at_start(bench)? + parameters(bench)?;
    not_connected(bench)?;
    not_referenced(bench)?;
    reloading(bench)?;
    commanded(bench)?;
    warming(bench)?;
    println!(
        "faults: {count} bad files and parameters, pins that are not connected, gantry, states, reloading, pins set \
         by `trueaxis control`, a simulated machine that warms up"
    );
    Ok(())
}

/// A bad file does not prevent a start: outputs equal inputs.
fn at_start(bench: &LinuxCncBench) -> Result<usize, String> {
    let cases = [
        ("file=/tmp/none.trax axes=XYZAC", "1", "No such file"),
        ("axes=XYZAC", "1", "no file"),
        ("file=/tmp axes=XYZAC", "1", "/tmp: "),
        ("file=/tmp/empty.trax axes=XYZAC", "2", "refused"),
        ("file=/tmp/text.trax axes=XYZAC", "2", "refused"),
        (
            "file=/tmp/short.trax axes=XYZAC",
            "2",
            "damaged or incomplete",
        ),
        (
            "file=/tmp/damaged.trax axes=XYZAC",
            "2",
            "damaged or incomplete",
        ),
        (
            "file=/tmp/huron.trax axes=XYZA",
            "3",
            "has an axis C, for which axes=XYZA names no joint",
        ),
        ("file=/tmp/huron.trax axes=XYZACB", "3", "has no axis B"),
        (
            "file=/tmp/everything.trax axes=XYZC",
            "4",
            "no pin for the temperature `bed`, number 0: write temperatures=1",
        ),
    ];
    for (parameters, code, text) in cases {
        let lines = started(&format!("units=mm {parameters}"))
            + &referenced(3)
            + &steps("joint.1.motor-cmd-in=12.5 joint.1.motor-fb-in=7.25 enable=1 fault?TRUE")
            + &until("fault-code", code)
            + &steps(
                "state?5 waiting-for?-1 active?FALSE joint.1.motor-cmd-out?12.5 \
 joint.1.motor-fb-out?7.25",
            );
        run(bench, &lines, &[text])?;
    }
    Ok(cases.len())
}

/// Requirements for the line that loads the component.
fn parameters(bench: &LinuxCncBench) -> Result<usize, String> {
    let cases = [
        ("axes=XYZAC", "units=: write units=mm or units=inch"),
        ("axes=XYZAC units=furlong", "units=furlong: write"),
        ("units=mm", "axes=: write the letter"),
        ("units=mm axes=xyz", "axes=xyz: write the letter"),
        (
            "units=mm axes=XYZ temperatures=9",
            "temperatures= is from 0 to 8",
        ),
    ];
    for (parameters, text) in cases {
        let lines = format!("loadrt trueaxis file=/tmp/huron.trax {parameters}\nshow funct\n");
        run(bench, &lines, &[text, "insmod for trueaxis failed"])?;
    }
    // The simulated machine takes the same parameters, and starts without a file.
    for (units, texts) in [
        (
            "imperial",
            ["file=/tmp/none.model: No such file", "trueaxis-model"],
        ),
        (
            "furlong",
            [
                "units=furlong: write units=mm or units=inch",
                "insmod for trueaxis_model failed",
            ],
        ),
    ] {
        let lines = format!(
            "loadrt trueaxis_model file=/tmp/none.model axes=XYZ units={units}\nshow funct\n"
        );
        run(bench, &lines, &texts)?;
    }
    Ok(cases.len())
}

/// An unconnected input on which a correction depends does not count as 0.
fn not_connected(bench: &LinuxCncBench) -> Result<(), String> {
    let lines = started("file=/tmp/everything.trax axes=XYZC units=mm temperatures=1 weights=2")
        + &steps("enable=1 fault-code?6")
        + &referenced(4)
        + &steps("fault-code?7 active?FALSE tool-length=150 fault-code?8 temperature-0=22 \
 fault-code?0 factor?1")
        // Outside of its tables. While corrections are off, it may have become another one.
        + &steps("enable=0 factor?0 temperature-0=60")
        + READ
        + &steps("enable=1 beyond-range?TRUE factor?1 enable=0 factor?0 temperature-0=22")
        + READ
        + &steps("enable=1 beyond-range?FALSE factor?1")
        // No shop is as hot.
        + &steps("temperature-0=1000 fault-code?11 factor?0 temperature-0=22 factor?1 \
 weight-1=0.01 fault-code?9 weight-1=0.00005 fault?FALSE")
        // A failed sensor.
        + &steps("temperature-0=nan fault-code?8 factor?0 temperature-0=22 factor?1");
    run(
        bench,
        &lines,
        &[
            "pos-in of a joint is not connected",
            "tool-length is not connected",
            "temperature that is not connected",
        ],
    )
}

/// A simulated machine follows a temperature with the lag of its error file.
fn warming(bench: &LinuxCncBench) -> Result<(), String> {
    let errors = "machine = \"xyzac-trt\"\n[thermal]\nEZ0S = { per_kelvin = 1e-3, sensor = \"bed\", lag_s = 3.0, \
                  reference_celsius = 20.0 }\n";
    bench.write("warm.toml", errors)?;
    let machine = example("machine.toml");
    let model = [
        "linuxcnc",
        "model",
        &machine,
        "warm.toml",
        "-o",
        "warm.model",
    ];
    let said = bench.trueaxis(&model)?;
    if !said.contains("temperature-0 is bed") {
        return Err(said);
    }
    let joints: String = (0..5)
        .flat_map(|j| ["pos-in", "motor-in"].map(|pin| (j, pin)))
        .map(|(j, pin)| format!("setp trueaxis-model.joint.{j}.{pin} 0\n"))
        .collect();
    let wait = |value: &str| format!("loadusr -w sh /tmp/until wcomp.0.out {value}\n");
    let lines = "loadrt threads name1=t period1=1000000\n\
         loadrt trueaxis_model file=/tmp/warm.model axes=XYZAC units=mm temperatures=1\n\
         loadrt wcomp\naddf trueaxis-model t\naddf wcomp.0 t\n\
         net error trueaxis-model.error wcomp.0.in\n"
        .to_owned()
        + &joints
        // At the reference of 20 °C, and after a time constant at 63 % of 10 µm.
        + "setp wcomp.0.min -1\nsetp wcomp.0.max 0.001\nstart\n"
        + &wait("TRUE")
        + "setp trueaxis-model.temperature-0 20\nloadusr -w sleep 0.2\n"
        + &wait("TRUE")
        + "setp trueaxis-model.temperature-0 30\nsetp wcomp.0.min 6\nsetp wcomp.0.max 6.8\n"
        + &wait("TRUE")
        + "setp wcomp.0.min 8\nsetp wcomp.0.max 10.1\n"
        + &wait("TRUE")
        + "loadusr -w sh /tmp/until trueaxis-model.fault FALSE\n";
    run(bench, &lines, &[])
}

/// Both joints of a gantry must be homed and none homing; uncorrected joints need not be.
fn not_referenced(bench: &LinuxCncBench) -> Result<(), String> {
    let lines = started("file=/tmp/router.trax axes=XYYZ- units=mm")
        // Keeps that the state was 6 for a moment.
        + "loadrt conv_u32_float\nloadrt wcomp\nloadrt flipflop\n\
           net state trueaxis.state conv-u32-float.0.in\nnet number conv-u32-float.0.out wcomp.0.in\n\
           setp wcomp.0.min 5.5\nsetp wcomp.0.max 6.5\nnet fading wcomp.0.out flipflop.0.set\n\
           addf conv-u32-float.0 t\naddf wcomp.0 t\naddf flipflop.0 t\n"
        + &referenced(4)
        + &steps("enable=1 factor?1 state?0 waiting-for?-1 joint.2.homed=0 factor?0 \
 state?3 waiting-for?2 joint.2.homed=1 factor?1 joint.1.homing=1 \
 factor?0 state?4 waiting-for?1 joint.1.homing=0 factor?1 dry-run=1 \
 factor?0 state?2 waiting-for?-1 enable=0 state?1 waiting-for?-1 \
 dry-run=0 enable=1 factor?1")
        + "loadusr -w sh /tmp/until flipflop.0.out TRUE\n"
        + &steps("state?0 waiting-for?-1 joint.3.pos-in=nan state?5 waiting-for?-1 \
 fault-code?6 joint.3.pos-in=1.5 state?0 waiting-for?-1 fault?FALSE");
    run(bench, &lines, &[])?;
    // A squareness: one axis is corrected, and only another one is an input. A growth: no axis is.
    let machine = example("machine.toml");
    for (errors, warm) in [
        ("[parameters]\nEC0X = 100e-6\n", ""),
        (
            "[thermal]\nEZ0S = { per_kelvin = 1e-3, sensor = \"bed\", reference_celsius = 20.0 }\n",
            "temperature-0=35",
        ),
    ] {
        let errors = format!("machine = \"xyzac-trt\"\n{errors}");
        bench.write("few.toml", errors)?;
        bench.trueaxis(&["compile", &machine, "few.toml", "-o", "few.trax"])?;
        let mut lines = started("file=/tmp/few.trax axes=XYZAC units=mm temperatures=1")
            + &referenced(5)
            + &steps(warm)
            + &steps("enable=1 factor?1");
        for joint in 0..5 {
            let pin = |name: &str, value: &str| set(&format!("joint.{joint}.{name}"), value);
            lines += &(pin("homed", "0") + &steps("factor?0"));
            lines += &(pin("homed", "1") + &steps("factor?1"));
            lines += &(pin("homing", "1") + &steps("factor?0 active?FALSE state?4"));
            lines += &(pin("homing", "0") + &steps("factor?1"));
        }
        run(bench, &lines, &[])?;
    }
    Ok(())
}

/// The compensation in use stays in use until a better one is available.
fn reloading(bench: &LinuxCncBench) -> Result<(), String> {
    // The same axes with other travels.
    motion::compile(bench, "EXX1 = -45e-6", "other.trax")?;
    let again = |file: &str| copy(file, "machine.trax") + &pulse("reload");
    let lines = copy("huron.trax", "machine.trax")
        + &started("file=/tmp/machine.trax axes=XYZAC units=mm")
        + &referenced(5)
        + &steps("enable=1 factor?1 loads?1")
        + &again("damaged.trax")
        + &steps("fault-code?2 load-fault?2 reloads?1")
        + &again("router.trax")
        + &steps("fault-code?3")
        + &again("other.trax")
        + &steps("fault-code?5 loads?1 factor?1")
        // The same file again: faded, although nothing changes.
        + &again("huron.trax")
        + &steps("loads?2 fault?FALSE load-fault?0 enable=0 active?FALSE")
        + &again("huron.trax")
        + &steps("loads?3 fading?FALSE fault?FALSE")
        + &again("other.trax")
        + &steps("loads?4 enable=1 factor?1 fault?FALSE")
        // Another fault does not hide what became of a file.
        + &steps("joint.0.pos-in=nan fault-code?6")
        + &again("damaged.trax")
        + &steps("load-fault?2 fault-code?6 joint.0.pos-in=0 fault-code?2 factor?1")
        + "loadusr -w rm /tmp/machine.trax\n"
        + &pulse("reload")
        + &steps("reloads?8 fault-code?1 factor?1");
    run(
        bench,
        &lines,
        &["set enable to 0, wait for active to become false, and reload"],
    )
}

/// `trueaxis control --hal` and `monitor --hal` on the real pins.
fn commanded(bench: &LinuxCncBench) -> Result<(), String> {
    let trueaxis = bench.program()?;
    let control = |what: &str| format!("loadusr -w {trueaxis} control --hal {what}\n");
    let lines = copy("huron.trax", "machine.trax")
        + &started("file=/tmp/machine.trax axes=XYZAC units=mm")
        + &referenced(5)
        + &steps("loads?1")
        + &control("enable")
        + &steps("factor?1")
        + &control("dry-run on")
        + &steps("state?2 waiting-for?-1")
        + &control("dry-run off")
        + &steps("factor?1")
        + &control("reload")
        + &steps("loads?2")
        + &control("disable")
        + &steps("state?1 waiting-for?-1 joint.1.homed=0")
        // On a signal that nothing writes.
        + "net switch trueaxis.enable\n"
        + &control("enable")
        + &steps("state?3 waiting-for?1")
        + &format!("loadusr -w {trueaxis} monitor --hal --count 1\n");
    run(
        bench,
        &lines,
        &[
            "enable is off, factor 0.000",
            "joint 1 is not homed, factor",
            "number 2",
            "% |",
        ],
    )
}
