//! The loop in LinuxCNC: a probe that trips on balls of simulated machines, whose errors the loop does not know.

mod drawn;
mod operated;
mod switched;

use super::bench::LinuxCncBench;
use drawn::{DrawnKind, DrawnMachine, MachineFault};
use std::thread;

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
                .map(|&(seed, fault)| DrawnMachine { seed, fault, kind })
                .map(|machine| scope.spawn(move || machine.calibrate(bench)))
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
        let first = scope.spawn(|| switched::calibrate(bench));
        let healthy = [(1, MachineFault::None), (3, MachineFault::None)];
        let others = [&healthy[..], &FAULTS].concat();
        let others = all(bench, &others, DrawnKind::Plain, others.len());
        let first = first.join().map_err(|_| "the test panics".to_owned())?;
        println!("{}", first?);
        others
    })
}

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
