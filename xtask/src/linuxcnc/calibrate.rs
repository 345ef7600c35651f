//! The loop in LinuxCNC: a probe that trips on balls of the simulated machine, whose errors the loop does not know.

use super::bench::Bench;
use super::motion::example;
use crate::files;
use crate::process::{root, run};
use std::fs;
use std::process::Command;

const CONFIG: &str = "firmware/linuxcnc/configs";
const FOLDER: &str = "configs/xyzac-trt";

/// The simulated machine with a probe, and `trueaxis` inside.
fn machine(bench: &Bench, errors: &str) -> Result<(), String> {
    let configs = bench.file("configs");
    let _ = fs::remove_dir_all(&configs);
    run(Command::new("cp")
        .args(["-r", "-T"])
        .arg(root().join(CONFIG))
        .arg(&configs))?;
    let ini = format!("{FOLDER}/xyzac-trt.ini");
    let text = files::read_text(&bench.file(&ini))?;
    let without = |line: &&str| !line.starts_with("PYVCP") && !line.starts_with("POSTGUI");
    let lines: Vec<&str> = text.lines().filter(without).collect();
    let text = lines.join("\n") + "\n";
    // As fast as a test needs it: the machine waits for the program, not the other way round.
    let text = text
        .replace("DISPLAY = axis", "DISPLAY = /tmp/unattended.py")
        .replace("CYCLE_TIME = 0.010", "CYCLE_TIME = 0.001")
        .replace("_VELOCITY = 100", "_VELOCITY = 400")
        .replace("_VELOCITY = 60", "_VELOCITY = 200")
        .replace("_ACCELERATION = 1000", "_ACCELERATION = 8000")
        .replace("_ACCELERATION = 600", "_ACCELERATION = 4000");
    bench.write(&ini, text)?;
    bench.copy("firmware/linuxcnc/tests/unattended.py", "unattended.py")?;
    bench.write("errors.toml", errors)?;
    let machine = example("machine.toml");
    bench.write(
        &format!("{FOLDER}/machine.toml"),
        files::read_text(machine.as_ref())?,
    )?;
    let model = format!("{FOLDER}/xyzac-trt.model");
    bench.trueaxis(&["linuxcnc", "model", &machine, "errors.toml", "-o", &model])?;
    run(Command::new("chmod").args(["-R", "a+rwX"]).arg(&configs))
}

/// Runs lines inside, in the folder of the machine; returns what they printed and their codes.
fn operate(bench: &Bench, lines: &[String]) -> Result<(String, Vec<i32>), String> {
    let text: String = (lines.iter())
        .map(|line| format!("cd /tmp/{FOLDER} && {line}\n"))
        .collect();
    bench.write("commands", text)?;
    for name in ["printed", "codes"] {
        let _ = fs::remove_file(bench.file(name));
    }
    let said = bench.inside(&["linuxcnc", &format!("/tmp/{FOLDER}/xyzac-trt.ini")])?;
    let read = |name: &str| fs::read_to_string(bench.file(name)).unwrap_or_default();
    let codes: Vec<i32> = read("codes").lines().flat_map(str::parse).collect();
    let printed = read("printed");
    if codes.len() != lines.len() {
        return Err(format!("{said}\n{printed}"));
    }
    Ok((printed, codes))
}

/// # Errors
/// The violated condition.
pub fn check(bench: &Bench) -> Result<(), String> {
    let errors = files::read_text(example("errors-11.toml").as_ref())?;
    machine(bench, &errors)?;
    let trueaxis = bench.program()?;
    let calibrate = format!(
        "{trueaxis} linuxcnc calibrate machine.toml --artefact artefact.toml --ball-diameter 20 --stylus-diameter 6 \
         --clearance 2 --search 1.5 --first 1500 --feed 60 --retreat 0.05 --approach 20000 --probings 32 --validate 6 \
         --indexings A=-60:60:20,C=-180:150:30 --folder run --home --yes"
    );
    let began = std::time::Instant::now();
    let (printed, codes) = operate(bench, &[calibrate])?;
    println!(
        "{printed}\n{codes:?} {:.1} s",
        began.elapsed().as_secs_f64()
    );
    Ok(())
}
