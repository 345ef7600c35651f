//! Duration of an identification, and the same problem for a rival: `cargo xtask bench identify`.
//!
//! `identify-speed FOLDER` writes each problem into the folder, with the time it took here.

use nalgebra::Vector3;
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::{Identified, IdentifyOptions, Model, Problem, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::machine::{MAX_AXES, Machine};
use trueaxis_tests::observed::{Strategy, observed};
use trueaxis_tests::probed::Case;
use trueaxis_tests::{Fixed, machine};

/// Unknowns, probings, balls, and the highest degree of the candidate parameters.
const PROBLEMS: [(usize, usize, usize, u8); 2] = [(100, 1000, 8, 4), (300, 3000, 12, 12)];
/// Number of runs averaged.
const TIMES: u32 = 5;

/// Processor time (s) of a computation, the mean of several, and time by the clock.
fn timed(compute: impl Fn()) -> [f64; 2] {
    let (start, before) = (Instant::now(), processor());
    for _ in 0..TIMES {
        compute();
    }
    let wall = start.elapsed().as_secs_f64() / f64::from(TIMES);
    match (before, processor()) {
        (Some(before), Some(after)) => [(after - before) / f64::from(TIMES), wall],
        _ => [wall; 2],
    }
}

fn main() -> ExitCode {
    let Some(folder) = std::env::args().nth(1) else {
        eprintln!("usage: identify-speed FOLDER");
        return ExitCode::FAILURE;
    };
    let machine = machine("examples/kolibri/machine.toml");
    for (unknowns, rows, balls, degree) in PROBLEMS {
        let task = Task::new(&machine, unknowns, rows, balls, degree);
        let [seconds, wall] = timed(|| {
            let identified = task.identified();
            assert_eq!(identified.parameters.len(), task.parameters.len());
            assert!(identified.unseen.is_empty(), "the rival fits all");
        });
        let identified = task.identified();
        println!(
            "{unknowns} unknowns from {rows} probings: {seconds:.3} s of processor time ({wall:.3} s), condition {:.0}",
            identified.condition
        );
        let mixed = Task::new(&machine, unknowns - SETUP_UNKNOWNS, rows / 2, balls, degree);
        let observations = mixed.observed(rows / 2);
        let [own, wall] = timed(|| {
            let identified = mixed.identified_with(&observations);
            assert!(identified.unseen.is_empty());
        });
        println!(
            "{unknowns} unknowns from {} probings and {} observations: {own:.3} s of processor time ({wall:.3} s)",
            rows / 2,
            rows / 2
        );
        let path = Path::new(&folder).join(format!("{unknowns}.json"));
        if let Err(error) = std::fs::write(&path, task.json(seconds, &identified)) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

/// Processor time of this process (s), if the system reports it: other programs do not count.
fn processor() -> Option<f64> {
    /// Ticks per second in the figures of Linux.
    const TICKS: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // After the name, which may contain spaces: utime and stime are fields 14 and 15.
    let fields: Vec<&str> = stat.rsplit(')').next()?.split_whitespace().collect();
    let ticks = |field: usize| fields.get(field - 3)?.parse::<f64>().ok();
    Some((ticks(14)? + ticks(15)?) / TICKS)
}

/// A machine, probings of it, and parameters that these can all identify.
struct Task<'a> {
    machine: &'a Machine,
    measured: Probings,
    artefact: Artefact,
    errors: ErrorModel,
    parameters: Vec<Parameter>,
}

/// Two bars and a tracker: their set-ups and tool points, which are not told to the identification.
const SETUPS: &str = "# [setup.bar]\n# place_mm = [21.0, -14.0, 9.0]\n# dead_length_mm = 30.0\n\
# [setup.station]\n# place_mm = [-300.0, 40.0, 60.0]\n# dead_length_mm = 20.0\n\
# [setup.tracker]\n# place_mm = [-400.0, 250.0, 120.0]\n# orientation_deg = [12.0, -31.0, 77.0]\n";
/// The number of these: a place, a dead length and a tool point of each length, a frame and a tool point of the
/// tracker.
const SETUP_UNKNOWNS: usize = 7 + 7 + 9;

impl<'a> Task<'a> {
    fn new(machine: &'a Machine, unknowns: usize, rows: usize, balls: usize, degree: u8) -> Self {
        let wanted = unknowns - 3 - 3 * balls;
        let mut random = Fixed::new(unknowns as u64);
        let mut all = Model::Auto
            .parameters(machine, degree, &[])
            .expect("any machine has it");
        loop {
            let case =
                Case::spread(machine, &all, balls, rows, &mut random).expect("balls in reach");
            let mut task = Self {
                machine,
                measured: case.noisy(1),
                artefact: case.artefact,
                errors: case.errors,
                parameters: all,
            };
            // The requested number of identifiable parameters; then again with nothing else in the machine.
            let seen = task.identified().parameters;
            let seen: Vec<Parameter> = seen.iter().map(|e| e.parameter).take(wanted).collect();
            if task.parameters.len() == wanted && seen.len() == wanted {
                return task;
            }
            assert!(
                seen.len() == wanted,
                "only {} of {wanted} are seen",
                seen.len()
            );
            task.parameters.clear();
            all = seen;
        }
    }

    /// Lengths and points at random positions.
    fn observed(&self, rows: usize) -> Observations {
        let mut random = Fixed::new(7);
        let mut plan = Strategy::new(self.machine, "");
        for row in 0..rows {
            let position = plan.anywhere(0.9, &mut random);
            let (kind, setup) = [
                ("length", "bar"),
                ("length", "station"),
                ("point", "tracker"),
            ][row % 3];
            plan.add(kind, setup, &position, "", 1.0);
        }
        observed(self.machine, &self.errors, &plan, SETUPS, 1.0, 1)
    }

    fn identified(&self) -> Identified {
        self.identified_with(&Observations::default())
    }

    fn identified_with(&self, observations: &Observations) -> Identified {
        let perfect = ErrorModel::perfect(self.machine);
        let (measured, artefact) = (&self.measured, &self.artefact);
        let problem = Problem::new(self.machine, measured, artefact, &self.parameters, &perfect);
        identify(&problem.with(observations), IdentifyOptions::default()).expect("a result")
    }

    /// Everything needed to solve it elsewhere: mm, rad.
    fn json(&self, seconds: f64, identified: &Identified) -> String {
        let kinds = |p: &Parameter| match p.kind {
            ParameterKind::Inter => ("inter", 0),
            ParameterKind::Degree(k) => ("degree", k),
            ParameterKind::Cosine(k) => ("cosine", k),
            ParameterKind::Sine(k) => ("sine", k),
            ParameterKind::Backlash => ("backlash", 0),
        };
        let index = |p: &Parameter| {
            self.machine
                .index(p.axis)
                .unwrap_or(self.machine.axes.len())
        };
        let parameters = self.parameters.iter().map(|p| {
            let (kind, k) = kinds(p);
            json!({"name": p.to_string(), "axis": index(p), "component": p.component, "kind": kind, "k": k})
        });
        let row = |row: &Probing| {
            let q: [f64; MAX_AXES] = self.machine.to_kinematic(&row.position);
            json!({"ball": row.ball, "q": q[..self.machine.axes.len()]})
        };
        let axes = self.machine.axes.iter().map(|axis| {
            let component = "XYZABC".find(axis.letter.char()).unwrap_or(0);
            json!({"branch": format!("{:?}", axis.branch), "component": component})
        });
        let three = |v: &Vector3<f64>| [v.x, v.y, v.z];
        let squares: f64 = identified.rows.iter().map(|r| r.after.norm_squared()).sum();
        json!({
            "seconds": seconds,
            "axes": axes.collect::<Vec<_>>(),
            "tip": self.machine.tip,
            "parameters": parameters.collect::<Vec<_>>(),
            "rows": self.measured.rows.iter().map(row).collect::<Vec<_>>(),
            "balls": identified.balls.len(),
            "found": identified.parameters.iter().map(|e| e.value).collect::<Vec<_>>(),
            "found_balls": identified.balls.iter().map(three).collect::<Vec<_>>(),
            "squares_mm2": squares,
        })
        .to_string()
    }
}
