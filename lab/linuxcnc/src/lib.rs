//! The component in the real LinuxCNC, without a screen: in `halrun`, under its motion
//! controller, with simulated machines, with a probing program, and as a package.

mod bench;
mod calibrate;
mod contour;
mod events;
mod faults;
mod gantry;
mod halrun;
mod imported;
mod machine_ini;
mod motion;
mod oracle;
mod package;
mod panel;
mod probing;
mod rows;
mod run;
mod samples;
mod simulated;
mod surface;
mod three_axes;
mod times;
mod touches;

use bench::LinuxCncBench;
pub use package::{corrects as package_corrects, execute as package, for_arm};
use std::thread::{self, ScopedJoinHandle};

/// Fails with the violated condition.
type ConditionCheck = fn(&LinuxCncBench) -> Result<(), String>;

/// The parts, by name.
const PARTS: &[(&str, ConditionCheck)] = &[
    ("halrun", halrun::check),
    ("faults", faults::check),
    ("motion", motion::check),
    ("events", events::check),
    ("simulated", simulated::check),
    ("imported", imported::check),
    ("gantry", gantry::check),
    ("contour", contour::check),
    ("surface", surface::check),
    ("samples-few", samples::few),
    ("samples", samples::check),
    ("panel", panel::check),
    ("touches", touches::check),
    ("calibrate", calibrate::check),
    ("calibrate-twenty", calibrate::twenty),
    ("calibrate-outside", calibrate::outside),
    ("calibrate-drifting", calibrate::drifting),
    ("times", times::check),
    ("package", package::check),
];

/// Run beside the others, up to the one that measures times: they mostly wait for machines that move.
const BESIDE: [&str; 2] = ["panel", "calibrate"];

/// Run only if named. All samples, some 300 starts, and the twenty machines take 20 minutes or more. And on busy
/// processors LinuxCNC 2.9 may end a program of probing moves before its last one with "Queue is not empty after
/// probing" (github.com/LinuxCNC/linuxcnc/issues/3650), or without a message.
const ONLY_NAMED: [&str; 5] = [
    "samples",
    "touches",
    "calibrate-twenty",
    "calibrate-outside",
    "calibrate-drifting",
];

/// Names of all parts.
pub fn parts() -> Vec<&'static str> {
    PARTS.iter().map(|(name, _)| *name).collect()
}

/// Runs the parts that are `chosen`, or the usual ones.
///
/// # Errors
/// If something cannot be installed or built, or fails.
pub fn check(chosen: &[&str]) -> Result<(), String> {
    let bench = LinuxCncBench::provide()?;
    let wants =
        |name: &str| chosen.contains(&name) || (chosen.is_empty() && !ONLY_NAMED.contains(&name));
    let told = |name: &str, done: Result<(), String>| done.map_err(|e| format!("{name}: {e}"));
    thread::scope(|scope| {
        let beside = PARTS
            .iter()
            .filter(|(name, _)| BESIDE.contains(name) && wants(name));
        let bench = &bench;
        let start = |(name, check): &(&'static str, ConditionCheck)| {
            let (name, check) = (*name, *check);
            (name, scope.spawn(move || check(bench)))
        };
        let mut beside: Vec<(&str, ScopedJoinHandle<'_, _>)> = beside.map(start).collect();
        let mut ended = || {
            beside.drain(..).try_for_each(|(name, run)| {
                let done = run.join().unwrap_or_else(|_| Err("it panics".to_owned()));
                told(name, done)
            })
        };
        for (name, check) in PARTS {
            if *name == "times" {
                ended()?;
            }
            if !BESIDE.contains(name) && wants(name) {
                told(name, check(bench))?;
            }
        }
        ended()
    })
}
