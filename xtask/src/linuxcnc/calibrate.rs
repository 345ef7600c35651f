//! The loop in LinuxCNC: a probe that trips on balls of simulated machines, whose errors the loop does not know.

use super::bench::LinuxCncBench;
use super::motion::example;
use crate::files;
use crate::process::{self, root, run};
use std::fs;
use std::process::Command;
use std::thread;
use std::time::Instant;

/// The simulated machine whose kinematics are switched; other machines are drawn.
const CONFIGS: &str = "firmware/linuxcnc/configs";
const SWITCHED: &str = "configs/xyzac-trt";
/// How the tests probe: as fast as servo periods permit; 1 µm in each of the touches that count.
const PROBING: &str = "--ball-diameter 20 --stylus-diameter 6 --clearance 2 --search 1.5 --first 1500 --feed 60 \
                       --retreat 0.05 --approach 20000 --home --yes --accept-missing";
/// What its owner can identify with a stylus that runs true: model 12, a length, and where the trunnion stands.
const LOCATIONS: &str = "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z,EXX1,EYY1,EZZ1,ECCb,EX0C,EY0A";
/// What may be left of a healthy machine, as a part of the coverage interval that was predicted (the goal of the loop).
const OF_BAND: f64 = 1.2;
/// Without a compensation LinuxCNC's component has no file.
const NO_FILE: &str = "halcmd getp trueaxis.loads | grep -q '^0'";

/// Drift of the balls (µm/h). The tests probe about ten times as fast as a machine: it is 5 µm/h of one.
const DRIFT: f64 = 50.0;

/// Exit codes of a program that a signal ended: SIGTERM, and SIGINT.
const TERMINATED: i32 = 143;
const INTERRUPTED: i32 = 130;

/// Machines that are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum DrawnKind {
    /// Their errors are in the model.
    Plain,
    /// Straightness, backlash and run-out are not.
    Outside,
    /// Their balls drift.
    Drifting,
}

/// What is wrong with a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MachineFault {
    None,
    /// A ball is pushed aside while it is being probed.
    Ball,
    /// The stylus is 3 mm longer than the machine file says.
    Stylus,
    /// A rotary axis counts the other way in the machine file.
    Sign,
}

impl MachineFault {
    /// What must be said of it.
    fn words(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Ball => "ball one has moved",
            Self::Stylus => "check the length of the stylus",
            Self::Sign => "counts the other way in the machine file",
        }
    }
}

/// Runs lines inside, in a folder, while LinuxCNC runs a configuration; returns what they printed and their codes.
fn operate(
    bench: &LinuxCncBench,
    folder: &str,
    ini: &str,
    lines: &[String],
) -> Result<(String, Vec<i32>), String> {
    bench.copy("firmware/linuxcnc/tests/unattended.py", "unattended.py")?;
    let text: String = (lines.iter())
        .map(|line| format!("cd /tmp/{folder} && {line}\n"))
        .collect();
    bench.write("commands", text)?;
    for name in ["printed", "codes"] {
        let _ = fs::remove_file(bench.file(name));
    }
    run(Command::new("chmod")
        .args(["-R", "a+rwX"])
        .arg(bench.file(folder)))?;
    let said = bench.inside(&["linuxcnc", &format!("/tmp/{folder}/{ini}")])?;
    let read = |name: &str| fs::read_to_string(bench.file(name)).unwrap_or_default();
    let codes: Vec<i32> = read("codes").lines().flat_map(str::parse).collect();
    let printed = read("printed");
    if codes.len() != lines.len() {
        return Err(format!(
            "{said}\n{printed}\n{} of {} lines have run",
            codes.len(),
            lines.len()
        ));
    }
    Ok((printed, codes))
}

/// A number of a file that is JSON with one entry in each line.
fn number(text: &str, name: &str) -> Result<f64, String> {
    let (_, rest) = text
        .split_once(&format!("\"{name}\":"))
        .ok_or_else(|| format!("no `{name}` in\n{text}"))?;
    let end = rest.find([',', '}', '\n']).unwrap_or(rest.len());
    let value = rest[..end].trim().parse();
    value.map_err(|e| format!("{name}: {e}\n{text}"))
}

/// The mean error of the tip (µm) that a compensation leaves of a machine with known errors, over the whole travel.
fn left(bench: &LinuxCncBench, folder: &str) -> Result<[f64; 2], String> {
    let file = |name: &str| format!("{folder}/{name}");
    let (machine, errors, blob) = (
        file("machine.toml"),
        file("errors.toml"),
        file("run/machine.trax"),
    );
    let words = ["verify", &machine, &errors, &blob, "--random", "1000"];
    // It judges whether the tables are those of these errors, which they are not quite.
    let said = bench.trueaxis_said(&words)?;
    let mean = |row: &str| {
        let line = said
            .lines()
            .find(|l| l.trim_start().starts_with(row))
            .ok_or_else(|| format!("`verify` says\n{said}"))?;
        let cell = line
            .trim_start()
            .strip_prefix(row)
            .and_then(|l| l.split_whitespace().next());
        cell.and_then(|c| c.parse::<f64>().ok())
            .ok_or_else(|| format!("`verify` says\n{said}"))
    };
    Ok([mean("before")?, mean("tables")?])
}

/// Calibrates one random machine, or checks that its fault is reported and nothing is loaded. Returns a line of the
/// table.
fn drawn(
    bench: &LinuxCncBench,
    seed: u64,
    fault: MachineFault,
    kind: DrawnKind,
) -> Result<String, String> {
    let bench = bench.apart(&format!("machine-{seed}"))?;
    let trueaxis = bench.program()?;
    let folder = bench.file("m");
    let outside = (kind == DrawnKind::Outside).then_some("outside");
    let about = process::output(
        process::example("calibration-machine")
            .arg(seed.to_string())
            .arg(&folder)
            .args(outside),
    )?;
    let about = about.trim().to_owned();
    bench.trueaxis(&[
        "linuxcnc",
        "model",
        "m/machine.toml",
        "m/errors.toml",
        "-o",
        "m/machine.model",
    ])?;
    let qualifies = seed == QUALIFIED;
    let drift = if kind == DrawnKind::Drifting {
        DRIFT
    } else {
        0.0
    };
    let mut before = format!("halcmd setp trueaxis-model.drift {drift}; ");
    match fault {
        MachineFault::None => {}
        MachineFault::Ball => {
            before += &format!(
                "({}; halcmd setp trueaxis-model.moved 0.1) & ",
                until("touches.csv", 60)
            );
        }
        MachineFault::Stylus => before += "halcmd setp trueaxis-model.tool-length TOOL; ",
        MachineFault::Sign => {
            let text = files::read_text(&bench.file("m/machine.toml"))?;
            bench.write("m/machine.toml", other_sign(&text))?;
        }
    }
    if fault == MachineFault::Stylus {
        let text = files::read_text(&bench.file("m/machine.toml"))?;
        before = before.replace("TOOL", &(tool_length(&text)? + 3.0).to_string());
    }
    let calibrate = format!(
        "{before}{trueaxis} linuxcnc calibrate machine.toml --artefact artefact.toml {PROBING} --probings 32 \
         --validate 6 --folder run{}",
        if qualifies { " --qualify one" } else { "" }
    );
    let unloaded = format!("{NO_FILE} && test ! -e machine.trax");
    let began = Instant::now();
    let (printed, codes) = operate(&bench, "m", "machine.ini", &[calibrate, unloaded])?;
    let seconds = began.elapsed().as_secs();
    let about = format!("{seed:>3}  {about:<60} {seconds:>4} s  ");
    // The reason comes last: a summary of many steps shows the last lines.
    let bad = |why: &str| format!("{printed}\n{about}: {why}");
    if fault != MachineFault::None {
        let named = printed
            .lines()
            .find(|l| l.starts_with("error:") || l.starts_with("warning:"))
            .unwrap_or("");
        return match codes[..] {
            [1 | 2, 0] if printed.contains(fault.words()) => {
                Ok(format!("{about}{fault:?}: {named}"))
            }
            _ => Err(bad(&format!(
                "{fault:?} was not told, or something was loaded: {codes:?}"
            ))),
        };
    }
    if qualifies {
        let probe = fs::read_to_string(bench.file("m/run/probe.toml"))
            .map_err(|e| bad(&format!("probe.toml: {e}")))?;
        let (_, radius) = probe
            .split_once("tip_radius_mm = ")
            .ok_or_else(|| bad(&probe))?;
        let radius = radius.lines().next().and_then(|r| r.parse::<f64>().ok());
        // Half of 6 mm less a pre-travel of 5 µm; scales and lobes that do not turn with the stylus are 2 µm.
        if radius.is_none_or(|radius| (radius - 2.995).abs() > 3e-3) {
            return Err(bad(&probe));
        }
    }
    let is_unsure = printed.contains("nothing is loaded: the compensation might do more harm");
    if is_unsure && codes == [1, 0] {
        let [untreated, treated] = left(&bench, "m")?;
        return Ok(format!(
            "{about}tip {untreated:>6.2}, would be {treated:.2} µm: too little is known, nothing is loaded"
        ));
    }
    let validation = fs::read_to_string(bench.file("m/run/validation.json"))
        .map_err(|e| bad(&format!("validation.json: {e}")))?;
    let band = number(&validation, "coverage_um")?;
    let [untreated, treated] = left(&bench, "m")?;
    let measured = (
        number(&validation, "before\": {\n    \"rms_um")?,
        number(&validation, "after\": {\n    \"rms_um")?,
    );
    let line = format!(
        "{about}tip {untreated:>6.2} → {treated:>5.2} µm, band {band:>5.2}; measured {:>6.2} → {:>5.2}; {}",
        measured.0,
        measured.1,
        if codes[0] == 0 {
            "in use"
        } else {
            "old one kept"
        }
    );
    let is_loaded = codes == [0, 1];
    let is_kept = codes == [1, 0];
    if treated > OF_BAND * band || !(is_loaded || is_kept) {
        return Err(bad(&line));
    }
    // Whatever is in use is no worse than before.
    if is_loaded && treated > untreated {
        return Err(bad(&line));
    }
    Ok(line)
}

/// A script of the shell: holds the machine by the feed override, lets it go on, and stops it as an operator does.
///
/// A touch under way when it is held, and one whose row is being written, are still logged; then the log stands still.
/// Whatever fails, the calibration is ended: left running, it would keep the later ones out.
fn hold(calibrate: &str) -> String {
    let python = |what: &str| format!("python3 -c 'import linuxcnc; linuxcnc.command().{what}'");
    let (hold, go, stop) = (
        python("feedrate(0)"),
        python("feedrate(1)"),
        python("abort()"),
    );
    let rows = "$(wc -l < run/before.csv)";
    format!(
        "{calibrate} > held 2>&1 &\ntrap 'kill $! 2>/dev/null; wait $!' EXIT\n\
         fail() {{ echo \"$1\"; cat held; exit 1; }}\n{}\n{hold}\nheld={rows}\n\
         for k in 1 2 3; do now={rows}; sleep 4; [ $now = {rows} ] && break; done\n\
         [ $now = {rows} ] && [ $now -le $((held + 2)) ] || fail \"held at $held rows, there are {rows}\"\n{go}\n{}\n\
         for k in $(seq 100); do kill -0 $! 2>/dev/null || break; {stop}; sleep 0.1; done\n\
         wait $!\ncode=$?\n[ $code = 2 ] && grep -q 'somebody stopped it' held || fail \"exit code $code\"\n",
        until("before.csv", 6),
        until("before.csv", 11)
    )
}

/// Shell words that wait until a log has more lines than this, or for 400 s: what fills it may have failed.
fn until(log: &str, lines: usize) -> String {
    format!(
        "for k in $(seq 2000); do [ $(cat run/{log} 2>/dev/null | wc -l) -gt {lines} ] && break; sleep 0.2; done"
    )
}

/// The length of the tool in a machine file (mm).
fn tool_length(machine: &str) -> Result<f64, String> {
    let (_, tip) = machine
        .rsplit_once("tip_mm = [")
        .ok_or("no tip_mm in the machine file")?;
    let numbers = tip.split(']').next().unwrap_or("").split(',');
    let numbers: Result<Vec<f64>, _> = numbers.map(|n| n.trim().parse::<f64>()).collect();
    let numbers = numbers.map_err(|e| e.to_string())?;
    Ok(numbers.iter().map(|n| n * n).sum::<f64>().sqrt())
}

/// A machine file whose axis C counts the other way.
fn other_sign(machine: &str) -> String {
    machine.replace("name = \"C\"\n", "name = \"C\"\nreversed = true\n")
}

/// The machine with switched kinematics: interrupted, continued, loaded.
fn switched(bench: &LinuxCncBench) -> Result<String, String> {
    let bench = bench.apart("switched")?;
    let trueaxis = bench.program()?;
    run(Command::new("cp")
        .args(["-r", "-T"])
        .arg(root().join(CONFIGS))
        .arg(bench.file("configs")))?;
    let ini = format!("{SWITCHED}/xyzac-trt.ini");
    let text = files::read_text(&bench.file(&ini))?;
    let without = |line: &&str| !line.starts_with("PYVCP") && !line.starts_with("POSTGUI");
    let lines: Vec<&str> = text.lines().filter(without).collect();
    let text = (lines.join("\n") + "\n")
        .replace("DISPLAY = axis", "DISPLAY = /tmp/unattended.py")
        .replace("CYCLE_TIME = 0.010", "CYCLE_TIME = 0.001")
        .replace("_VELOCITY = 100", "_VELOCITY = 400")
        .replace("_VELOCITY = 60", "_VELOCITY = 200")
        .replace("_ACCELERATION = 1000", "_ACCELERATION = 8000")
        .replace("_ACCELERATION = 600", "_ACCELERATION = 4000");
    bench.write(&ini, text)?;
    files::copy(
        example("machine.toml").as_ref(),
        &bench.file(&format!("{SWITCHED}/machine.toml")),
    )?;
    // Without the backlash of X: balls are touched from both sides, which hides it from every model.
    let errors = files::read_text(example("errors-11.toml").as_ref())?;
    let lines: Vec<&str> = errors.lines().filter(|l| !l.starts_with("EXXb")).collect();
    bench.write(&format!("{SWITCHED}/errors.toml"), lines.join("\n") + "\n")?;
    bench.trueaxis(&[
        "linuxcnc",
        "model",
        &format!("{SWITCHED}/machine.toml"),
        &format!("{SWITCHED}/errors.toml"),
        "-o",
        &format!("{SWITCHED}/xyzac-trt.model"),
    ])?;
    let calibrate = format!(
        "{trueaxis} linuxcnc calibrate machine.toml --artefact artefact.toml {PROBING} --probings 32 --validate 6 \
         --indexings A=-60:60:20,C=-180:150:30 --model {LOCATIONS} --folder run"
    );
    bench.write("hold", hold(&calibrate))?;
    let is_one = |pin: &str| format!("halcmd getp {pin} | grep -qE '^(1|TRUE)$'");
    let lines = [
        "halcmd setp trueaxis.enable 1".to_owned(),
        // Feed override 0 holds it for as long as it lasts; an operator who stops the machine ends the command.
        "sh /tmp/hold".to_owned(),
        // Ended in the middle of probing without corrections, as by a terminal that is closed.
        format!(
            "{calibrate} --from probe & {}; kill $!; wait $!",
            until("touches.csv", 20)
        ),
        // When the command has ended, the machine stands still; its kinematics and the component are as they were.
        format!(
            "{} && {} && {}",
            is_one("kinstype.is-0"),
            is_one("motion.in-position"),
            is_one("trueaxis.enable")
        ),
        format!("{NO_FILE} && test ! -e xyzac-trt.trax"),
        "cp run/touches.csv interrupted.csv".to_owned(),
        format!("{calibrate} --from probe"),
        format!(
            "{} && {}",
            is_one("trueaxis.factor"),
            is_one("kinstype.is-0")
        ),
        // Another compensation, interrupted in the middle of its validation, by a shell that ignores Ctrl-C: the first
        // one is in use again.
        format!(
            "cp xyzac-trt.trax first.trax; halcmd getp trueaxis.checksum > first; rm run/after.csv; \
             {trueaxis} compile machine.toml run/errors.toml --tolerance 5 -o run/machine.trax"
        ),
        format!(
            "! cmp -s first.trax run/machine.trax && \
             ({calibrate} --from load & {}; ! cmp -s first.trax xyzac-trt.trax || exit 1; kill -INT $!; wait $!)",
            until("after.csv", 8)
        ),
        format!(
            "cmp first.trax xyzac-trt.trax && halcmd getp trueaxis.checksum | cmp first - && {} && sleep 2 && {}",
            is_one("trueaxis.enable"),
            is_one("trueaxis.factor")
        ),
    ];
    let (printed, codes) = operate(&bench, SWITCHED, "xyzac-trt.ini", &lines)?;
    if codes != [0, 0, TERMINATED, 0, 0, 0, 0, 0, 0, INTERRUPTED, 0] {
        return Err(format!("{printed}\n{codes:?}"));
    }
    if printed.matches("stopped: the machine stands").count() != 2 {
        return Err(format!("{printed}\nit does not say that it stops"));
    }
    let read = |name: &str| files::read_text(&bench.file(&format!("{SWITCHED}/{name}")));
    let (interrupted, whole) = (read("interrupted.csv")?, read("run/touches.csv")?);
    let rows = interrupted.lines().count().saturating_sub(1) / 5;
    let first: Vec<&str> = whole.lines().take(1 + 5 * rows).collect();
    if !interrupted.starts_with(&first.join("\n")) || whole.lines().count() != 161 {
        return Err(format!(
            "the log was not continued:\n{interrupted}\n{whole}"
        ));
    }
    let band = number(&read("run/validation.json")?, "coverage_um")?;
    let [untreated, treated] = left(&bench, SWITCHED)?;
    if treated > OF_BAND * band {
        return Err(format!(
            "{printed}\n{treated} µm are left, {band} were predicted"
        ));
    }
    Ok(format!(
        "interrupted, continued, and calibrated: tip {untreated:.2} → {treated:.2} µm, band {band:.2}"
    ))
}

/// Runs machines beside each other; prints a line for each.
fn all(
    bench: &LinuxCncBench,
    machines: &[(u64, MachineFault)],
    kind: DrawnKind,
    beside: usize,
) -> Result<(), String> {
    let mut failed = Vec::new();
    for some in machines.chunks(beside) {
        let results: Vec<Result<String, String>> = thread::scope(|scope| {
            let runs: Vec<_> = (some.iter())
                .map(|(seed, fault)| scope.spawn(|| drawn(bench, *seed, *fault, kind)))
                .collect();
            let joined = runs.into_iter().map(thread::ScopedJoinHandle::join);
            joined
                .map(|one| one.unwrap_or_else(|_| Err("the test panics".to_owned())))
                .collect()
        });
        for result in results {
            match result {
                Ok(line) => println!("{line}"),
                Err(why) => failed.push(why),
            }
        }
    }
    match failed.is_empty() {
        true => Ok(()),
        false => Err(failed.join("\n")),
    }
}

/// Machines that run beside each other: each takes a tenth of a processor.
const BESIDE: usize = 4;

/// One machine whose kinematics are switched, interrupted and continued; two others, and three with faults.
///
/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    thread::scope(|scope| {
        let first = scope.spawn(|| switched(bench));
        let healthy = [(1, MachineFault::None), (3, MachineFault::None)];
        let others = [&healthy[..], &FAULTS].concat();
        let others = all(bench, &others, DrawnKind::Plain, others.len());
        let first = first.join().map_err(|_| "the test panics".to_owned())?;
        println!("{}", first?);
        others
    })
}

/// The machine on which the probe is qualified first.
const QUALIFIED: u64 = 3;

/// Machines with a fault.
const FAULTS: [(u64, MachineFault); 3] = [
    (17, MachineFault::Ball),
    (18, MachineFault::Stylus),
    (19, MachineFault::Sign),
];

/// Twenty machines, three of them with faults.
///
/// # Errors
/// The violated condition.
pub fn twenty(bench: &LinuxCncBench) -> Result<(), String> {
    let healthy = (0..17).map(|seed| (seed, MachineFault::None));
    let machines: Vec<(u64, MachineFault)> = healthy.chain(FAULTS).collect();
    all(bench, &machines, DrawnKind::Plain, BESIDE)
}

/// Twenty machines with errors that no model of the loop has.
///
/// # Errors
/// The violated condition.
pub fn outside(bench: &LinuxCncBench) -> Result<(), String> {
    let machines: Vec<(u64, MachineFault)> =
        (20..40).map(|seed| (seed, MachineFault::None)).collect();
    all(bench, &machines, DrawnKind::Outside, 2 * BESIDE)
}

/// The healthy ones, on tables that drift.
///
/// # Errors
/// The violated condition.
pub fn drifting(bench: &LinuxCncBench) -> Result<(), String> {
    let machines: Vec<(u64, MachineFault)> =
        (0..17).map(|seed| (seed, MachineFault::None)).collect();
    all(bench, &machines, DrawnKind::Drifting, BESIDE)
}
