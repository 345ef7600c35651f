//! A probing program of `trueaxis plan` in LinuxCNC: its interpreter accepts it, and under its motion controller, with
//! simulated balls, its log gives the axis positions with the stylus on the balls.

use super::bench::LinuxCncBench;
use super::motion::example;
use programs::process::{root, said};
use programs::{csv, files};
use std::fs;
use std::process::Command;

const ARTEFACT: &str = "\
[[ball]]
name = \"low\"
nominal_mm = [250.0, 160.0, -250.0]
[[ball]]
name = \"high\"
nominal_mm = [160.0, 190.0, -235.0]
";
/// Distance from the centre of a ball to that of the stylus (mm): half of 20 and 6.
const RADIUS: f64 = 13.0;
const PROBINGS: usize = 8;
const TOUCHES: usize = 5 * PROBINGS;
/// Feed of the touches (mm/min): 2 µm in a servo period.
const FEED: &str = "120";
/// Feed beside the balls (mm/min): at the default of 1000 the program takes four minutes instead of two, and on busy
/// processors more than the time limit of LinuxCNC.
const APPROACH: &str = "6000";
/// Permitted error of a centre (mm): each touch stops in the second period after the surface, one period sooner or
/// later; half of that in the mean of two.
const OFF: f64 = 2e-3;

/// The machine of `firmware/linuxcnc/tests/xyzac.ini` without a compensation, and a probe that trips closer than
/// [`RADIUS`] to a place set by the program.
fn hal() -> String {
    let mut hal = String::from(
        "loadrt [KINS]KINEMATICS\n\
         loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_aio=4\n\
         loadrt sum2 count=3\nloadrt hypot\nloadrt comp names=probe,switch\n\
         addf motion-command-handler servo-thread\naddf motion-controller servo-thread\n",
    );
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        hal += &format!(
            "addf sum2.{axis} servo-thread\nsetp sum2.{axis}.gain1 -1\n\
             net {name}-pos joint.{axis}.pos-fb => sum2.{axis}.in0\n\
             net {name}-ball motion.analog-out-0{axis} => sum2.{axis}.in1\n\
             net {name}-apart sum2.{axis}.out => hypot.0.in{axis}\n"
        );
    }
    for joint in 0..5 {
        hal += &format!(
            "net {joint}-drive joint.{joint}.motor-pos-cmd => joint.{joint}.motor-pos-fb\n"
        );
    }
    hal + &format!(
        "addf hypot.0 servo-thread\naddf probe servo-thread\naddf switch servo-thread\n\
         setp probe.in1 {RADIUS}\nnet apart hypot.0.out => probe.in0\n\
         net tripped probe.out => motion.probe-input\n\
         setp switch.in0 5\nnet 0-drive => switch.in1\nnet at-switch switch.out => joint.0.home-sw-in\n\
         net estop-loop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in\n\
         net tool-prepare-loop iocontrol.0.tool-prepare => iocontrol.0.tool-prepared\n\
         net tool-change-loop iocontrol.0.tool-change => iocontrol.0.tool-changed\n"
    )
}

/// # Errors
/// The violated condition.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    let (machine, errors) = (example("machine.toml"), example("errors-11.toml"));
    plan(bench, &machine)?;
    interpret(bench)?;
    // Axis positions of a machine with errors when its stylus is on the balls.
    let simulate = ["simulate", "probings", &machine, &errors, "-o", "real.csv"];
    let of_plan = ["--artefact", "artefact.toml", "--plan", "plan.csv"];
    bench.trueaxis(&[&simulate[..], &of_plan].concat())?;
    let real = places(bench, "real.csv")?;
    let log = probe(bench, &real)?;
    let words = ["--plan", "plan.csv", "-o", "found.csv"];
    bench.trueaxis(&[&["probings", &machine, "touches.log"][..], &words].concat())?;
    let mut largest = 0.0_f64;
    for (row, (found, real)) in places(bench, "found.csv")?.iter().zip(&real).enumerate() {
        for (found, real) in found.iter().zip(real) {
            let off = (found - real).abs();
            largest = largest.max(off);
            if off > OFF {
                return Err(format!("row {row}: {found} in the place of {real}\n{log}"));
            }
        }
    }
    println!(
        "touches: {TOUCHES} touches, centres of balls within {:.2} µm",
        largest * 1e3
    );
    Ok(())
}

/// Writes the probing program.
fn plan(bench: &LinuxCncBench, machine: &str) -> Result<(), String> {
    bench.write("artefact.toml", ARTEFACT)?;
    let options = format!(
        "--artefact artefact.toml --model EA0C,EB0C,EY0C --probings {PROBINGS} \
         --indexings A=-40:40:20,C=-90:90:45 -o plan.csv --program probe.ngc --log /tmp/touches.log \
         --ball-diameter 20 --stylus-diameter 6 --clearance 2 --search 1.5 --feed {FEED} --approach {APPROACH}"
    );
    let words: Vec<&str> = ["plan", machine]
        .into_iter()
        .chain(options.split(' '))
        .collect();
    bench.trueaxis(&words).map(drop)
}

/// Runs the program in LinuxCNC with the balls at these places; returns the log.
fn probe(bench: &LinuxCncBench, places: &[Vec<f64>]) -> Result<String, String> {
    bench.write("probe.ngc", with_balls(bench, places)?)?;
    let folder = "firmware/linuxcnc/tests";
    for name in ["drive.py", "tool.tbl"] {
        bench.copy(&format!("{folder}/{name}"), name)?;
    }
    let ini = files::read_text(&root().join(folder).join("xyzac.ini"))?;
    let ini = ini.replace("/tmp/xyzac.hal", "/tmp/touches.hal");
    bench.write("touches.ini", ini)?;
    bench.write("touches.hal", hal())?;
    bench.write("scenario", "touches")?;
    for name in ["touches.log", "result"] {
        let _ = fs::remove_file(bench.file(name));
    }
    let mut said = bench.inside(&["linuxcnc", "/tmp/touches.ini"])?;
    said += &fs::read_to_string(bench.file("result")).unwrap_or_default();
    let log = files::read_text(&bench.file("touches.log")).map_err(|e| format!("{e}\n{said}"))?;
    match log.lines().count() {
        TOUCHES => Ok(log),
        count => Err(format!("{count} touches, not {TOUCHES}:\n{log}\n{said}")),
    }
}

/// LinuxCNC's interpreter accepts the program as written, and sees its touches.
fn interpret(bench: &LinuxCncBench) -> Result<(), String> {
    let mut rs274 = Command::new("rs274");
    let done = said(rs274.arg("-g").arg(bench.file("probe.ngc")))?;
    let probed = done
        .output
        .lines()
        .filter(|l| l.contains("STRAIGHT_PROBE"))
        .count();
    if !done.status.success() || probed != TOUCHES {
        return Err(format!(
            "rs274: {}, {probed} touches\n{}",
            done.status, done.errors
        ));
    }
    Ok(())
}

/// X, Y and Z of each row of probings.
fn places(bench: &LinuxCncBench, name: &str) -> Result<Vec<Vec<f64>>, String> {
    let text = files::read_text(&bench.file(name))?;
    let rows = csv::columns(&text, &["X", "Y", "Z"]);
    rows.ok()
        .filter(|rows| rows.len() == PROBINGS)
        .ok_or_else(|| format!("{name}:\n{text}"))
}

/// The program, which sets the balls to these places, row by row.
fn with_balls(bench: &LinuxCncBench, places: &[Vec<f64>]) -> Result<String, String> {
    let text = files::read_text(&bench.file("probe.ngc"))?;
    let mut program = String::new();
    let mut places = places.iter();
    for line in text.lines() {
        program += &format!("{line}\n");
        if line.starts_with("(row ") {
            let place = places.next().ok_or("more rows than places")?;
            for (output, value) in place.iter().enumerate() {
                // Takes effect with the next movement.
                program += &format!("M67 E{output} Q{value}\n");
            }
        }
    }
    Ok(program)
}
