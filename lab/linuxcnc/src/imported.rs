//! What `trueaxis linuxcnc setup` imports: LinuxCNC once with `COMP_FILE` and `BACKLASH`, and once with the imported
//! errors, compiled, under the component. Every drive gets the same commands, approached from both sides.

use super::bench::LinuxCncBench;
use super::machine_ini::{MachineIni, connections};
use programs::csv::numbers;
use programs::files;

/// A joint: its axis, type, travel, and the lines of what LinuxCNC compensates.
pub(super) type Described = (&'static str, &'static str, [f64; 2], &'static str);

const JOINTS: [Described; 4] = [
    (
        "X",
        "LINEAR",
        [0.0, 200.0],
        "COMP_FILE = x.comp\nCOMP_FILE_TYPE = 0\n",
    ),
    // A file takes the place of the backlash.
    (
        "Y",
        "LINEAR",
        [0.0, 150.0],
        "COMP_FILE = y.comp\nCOMP_FILE_TYPE = 1\nBACKLASH = 0.5\n",
    ),
    ("Z", "LINEAR", [-150.0, 0.0], "BACKLASH = 0.024\n"),
    (
        "A",
        "ANGULAR",
        [-90.0, 90.0],
        "COMP_FILE = a.comp\nCOMP_FILE_TYPE = 1\n",
    ),
];

/// Positions that are reached, mm: not as far as the travel, so that end values are held.
const X: &str = "20 20.004 20.001\n60 60.012 60.006\n100 99.991 99.985\n160 159.98 159.97\n";
/// Corrections, mm.
const Y: &str = "10 0.003 -0.001\n70 -0.011 -0.016\n140 0.014 0.009\n";
/// Corrections, degrees.
const A: &str = "-80 0.004 0.001\n-10 -0.006 -0.010\n75 0.011 0.008\n";

/// Permitted difference, mm: the tolerance of `compile`, and that an error belongs to the corrected position: a slope
/// of up to 8e-4 times a correction of up to 0.03 mm.
const MILLIMETRES: f64 = 0.05e-3 + 8e-4 * 0.03;
/// Like `MILLIMETRES`, in degrees: 0.05 µrad, and a slope of 2e-4 times 0.012 degrees.
const DEGREES: f64 = 2.9e-6 + 2e-4 * 0.012;
/// Every axis meets the tolerance by itself: under `direction`, the linear axes would make up at the tip for up to
/// 1 µrad of A.
const POLICY: &str = "orientation";

const FOLDER: &str = "imported";

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    let ini = "imported/machine.ini";
    prepare(bench, FOLDER, &JOINTS)?;
    for (name, text) in [("x.comp", X), ("y.comp", Y), ("a.comp", A)] {
        bench.write(&format!("{FOLDER}/{name}"), text)?;
    }
    let before = recorded(bench, FOLDER)?;

    let trax = "new/machine.trax";
    let setup = [
        "linuxcnc",
        "setup",
        ini,
        "-o",
        "imported/new",
        "--file",
        trax,
    ];
    let answer = bench.trueaxis(&setup)?;
    let [machine, errors, trax] =
        ["machine.toml", "errors.toml", "machine.trax"].map(|name| format!("{FOLDER}/new/{name}"));
    bench.compile(&machine, &errors, &trax, &["--policy", POLICY])?;
    bench.write(ini, without_findings(&answer)?)?;
    bench.trueaxis(&["linuxcnc", "check", ini, &trax, "--machine", &machine])?;
    let after = recorded(bench, FOLDER)?;
    compare(&before, &after)
}

/// Writes a configuration whose drives follow their commands: `FOLDER/machine.ini` and its HAL file.
pub(super) fn prepare(
    bench: &LinuxCncBench,
    folder: &str,
    joints: &[Described],
) -> Result<(), String> {
    files::folder(bench.file(folder))?;
    bench.copy("firmware/linuxcnc/tests/imported.py", "imported.py")?;
    bench.copy("firmware/linuxcnc/tests/tool.tbl", "tool.tbl")?;
    let hal = connections(joints.len());
    bench.write(&format!("{folder}/machine.hal"), hal)?;
    let ini = configuration(folder, joints);
    bench.write(&format!("{folder}/machine.ini"), ini)
}

fn configuration(name: &str, joints: &[Described]) -> String {
    let axes: String = joints.iter().map(|(letter, ..)| *letter).collect();
    let mut text = MachineIni {
        name,
        script: "imported",
        halfiles: "machine.hal",
        axes: &axes,
        velocity: 100,
    }
    .text();
    for (joint, (axis, kind, [low, high], compensated)) in joints.iter().enumerate() {
        let limits = format!(
            "MIN_LIMIT = {low}\nMAX_LIMIT = {high}\nMAX_VELOCITY = 100\nMAX_ACCELERATION = 1000\n"
        );
        // LinuxCNC takes no value of an axis twice.
        let is_first = axes.find(axis) == Some(joint);
        let of_axis = match is_first {
            true => format!("[AXIS_{axis}]\n{limits}"),
            false => String::new(),
        };
        let home = low.midpoint(*high);
        text += &format!(
            "{of_axis}[JOINT_{joint}]\nTYPE = {kind}\n{limits}{compensated}\
             FERROR = 1\nMIN_FERROR = 1\nHOME = {home}\nHOME_OFFSET = 3.25\nHOME_SEARCH_VEL = 0\nHOME_SEQUENCE = 0\n"
        );
    }
    text
}

/// The configuration with the component, without what `setup` asks to take out.
fn without_findings(answer: &str) -> Result<String, String> {
    let text = configuration(FOLDER, &JOINTS);
    let mut lines: Vec<&str> = text.lines().collect();
    let findings = findings(answer);
    for (line, write) in &findings {
        lines[line - 1] = write;
    }
    if findings.len() != 5 {
        let count = findings.len();
        return Err(format!("{count} findings instead of 5: {answer}"));
    }
    let with_component = "HALFILE = machine.hal\nHALFILE = new/trueaxis.hal";
    Ok((lines.join("\n") + "\n").replace("HALFILE = machine.hal", with_component))
}

/// Lines of the INI file, counted from 1, and what to write there: `refused: FILE, line N: REASON`, `  write: LINE`.
fn findings(answer: &str) -> Vec<(usize, &str)> {
    let lines: Vec<&str> = answer.lines().collect();
    let pairs = lines.windows(2).filter_map(|pair| {
        let write = pair[1].strip_prefix("  write: ")?;
        let (_, line) = pair[0].split_once(", line ")?;
        let (number, _) = line.split_once(':')?;
        Some((number.parse().ok()?, write))
    });
    pairs.collect()
}

/// Joint, position, side, correction; of the configuration `FOLDER/machine.ini`.
pub(super) fn recorded(bench: &LinuxCncBench, folder: &str) -> Result<Vec<Vec<f64>>, String> {
    let record = bench.file(&format!("{folder}/record.csv"));
    // The results of an earlier run must not be used instead.
    let _ = std::fs::remove_file(&record);
    bench.open_to_all(folder)?;
    let ini = format!("/tmp/{folder}/machine.ini");
    let start = || bench.inside(&["linuxcnc", &ini]);
    let mut said = start()?;
    // Seen once beside other work, without a message: LinuxCNC ended before it recorded anything. Once more, and said.
    if !record.exists() {
        eprintln!("LinuxCNC ended without a record; once more\n{said}");
        said += &start()?;
    }
    let text = files::read_text(&record).map_err(|e| format!("{e}\n{said}"))?;
    numbers(&text)
}

fn compare(before: &[Vec<f64>], after: &[Vec<f64>]) -> Result<(), String> {
    let mut worst = [0.0_f64; JOINTS.len()];
    let mut largest = [0.0_f64; JOINTS.len()];
    if before.len() != after.len() || before.is_empty() {
        return Err(format!("{} and {} rows", before.len(), after.len()));
    }
    for (before, after) in before.iter().zip(after) {
        let ([joint, position, side, old], [_, _, _, new]) = (&before[..], &after[..]) else {
            return Err(format!("{before:?} {after:?}"));
        };
        let joint = *joint as usize;
        let (axis, kind, ..) = JOINTS[joint];
        let most = if kind == "LINEAR" {
            MILLIMETRES
        } else {
            DEGREES
        };
        if (old - new).abs() > most {
            return Err(format!(
                "{axis} at {position} from {}: LinuxCNC adds {old}, the component {new}",
                if *side < 0.0 { "below" } else { "above" },
            ));
        }
        worst[joint] = worst[joint].max((old - new).abs());
        largest[joint] = largest[joint].max(old.abs());
    }
    if let Some(joint) = largest.iter().position(|c| *c < 5e-3) {
        return Err(format!(
            "joint {joint} is not compensated by LinuxCNC: {largest:?}"
        ));
    }
    println!(
        "imported: COMP_FILE of both types and BACKLASH, {} positions from both sides: at most {:.2} of up to {:.0} \
         µm, {:.3} of up to {:.0} millidegrees different",
        before.len() / 2,
        1e3 * worst[..3].iter().copied().fold(0.0, f64::max),
        1e3 * largest[..3].iter().copied().fold(0.0, f64::max),
        1e3 * worst[3],
        1e3 * largest[3],
    );
    Ok(())
}
