//! A simulated machine is calibrated: its errors are known here, and nowhere in the calibration.

use super::*;
use crate::plan::{Criterion, PlannedRows, Probe, Setup, Task};
use crate::simulate::{Disturbances, SimulateError, compensated, corrections, probings};
use trueaxis_model::errors::ErrorModel;
use trueaxis_tables::compile::{self, Built, Options};
use trueaxis_tables::target::Target;
use trueaxis_tables::validate::Runtime;

const MACHINE: &str = include_str!("../../../../examples/linuxcnc-xyzac-trt/machine.toml");
/// Balls that stand farther apart than the example's, a bar, and a stylus that runs true.
const ARTEFACT: &str = r#"
[[ball]]
name = "low"
nominal_mm = [250.0, 160.0, -250.0]

[[ball]]
name = "high"
nominal_mm = [160.0, 190.0, -235.0]

[[bar]]
balls = ["low", "high"]
length_mm = 96.0468636
standard_uncertainty_mm = 0.0005

[stylus]
x_mm = 0.0
x_standard_uncertainty_mm = 0.0005
y_mm = 0.0
y_standard_uncertainty_mm = 0.0005
z_mm = -100.0
"#;
/// Errors of every kind that the usual model has.
const ERRORS: &str = r#"
machine = "xyzac-trt"

[parameters]
EX0C = 18e-3
EY0A = -25e-3
EB0A = 60e-6
EC0A = -45e-6
EA0C = 35e-6
EB0C = -50e-6
EC0X = 40e-6
EA0Z = -30e-6
EXX1 = 50e-6
EYY1 = -40e-6
EZZ1 = 30e-6
"#;
/// Standard deviation of a coordinate of a probing (mm).
const NOISE: f64 = 0.5e-3;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mishap {
    None,
    /// The ball moves by 0.1 mm while the plan is probed.
    Ball,
    /// The real stylus is longer (mm).
    Stylus(f64),
    /// The corrections that take effect are multiplied by this.
    Corrections(f64),
    /// The machine stops while it is probed again.
    Stops,
    /// This question is answered by no: 0 unmeasured, 1 load, 2 validate.
    Declined(usize),
}

/// Why the simulated machine does not go on.
#[derive(Debug)]
enum Failure {
    Refused(CalibrationRefusal),
    Stopped,
}

/// A machine with errors, its measurements, and what corrects it.
struct Simulated<'a> {
    machine: &'a Machine,
    artefact: &'a Artefact,
    real: &'a ErrorModel,
    plan: &'a CalibrationPlan,
    mishap: Mishap,
    measured: [Option<Probings>; 3],
    found: Option<ErrorModel>,
    made: Option<Built>,
    is_loaded: bool,
    is_kept: bool,
    validation: Option<Validation>,
}

impl Simulated<'_> {
    /// Probes rows on the real machine, with the compensation that is loaded.
    fn probe_rows(&self, rows: &Probings, seed: u64) -> Probings {
        self.probe_balls(self.artefact.clone(), rows, seed)
    }

    /// Probes rows on balls that are where this artefact has them.
    fn probe_balls(&self, mut artefact: Artefact, rows: &Probings, seed: u64) -> Probings {
        if let Mishap::Stylus(by) = self.mishap {
            artefact.stylus.tip[2] = artefact.stylus.tip[2].map(|z| z - by);
        }
        let disturbances = Disturbances {
            noise: NOISE,
            seed,
            ..Disturbances::default()
        };
        let kinematics = Kinematics::new(self.machine, self.real);
        let Some(made) = self.made.as_ref().filter(|_| self.is_loaded) else {
            let measured = probings(&kinematics, &artefact, rows, &disturbances);
            return measured.expect("balls that can be reached");
        };
        let runtime = Runtime::load(&made.blob).expect("it was compiled");
        let factor = match self.mishap {
            Mishap::Corrections(factor) => factor,
            _ => 1.0,
        };
        let measured = compensated(&kinematics, &artefact, rows, &disturbances, |rows| {
            let all = corrections(self.machine, &runtime, rows);
            let scaled = all.into_iter().map(|one| one.map(|v| factor * v));
            Ok::<_, SimulateError>(scaled.collect())
        });
        measured.expect("balls that can be reached")
    }
}

impl CalibratedMachine for Simulated<'_> {
    type Error = Failure;

    fn refused(&self, refusal: CalibrationRefusal) -> Failure {
        Failure::Refused(refusal)
    }

    fn probe(&mut self) -> Result<bool, Failure> {
        self.measured[1] = Some(self.probe_rows(&self.plan.validation, 1));
        let rows = &self.plan.planned.judgement.plan;
        let mut plan = self.probe_rows(rows, 2);
        if self.mishap == Mishap::Ball {
            let mut artefact = self.artefact.clone();
            artefact.balls[0].nominal = artefact.balls[0].nominal.map(|ball| ball.add_scalar(0.1));
            let later = self.probe_balls(artefact, rows, 2);
            let half = rows.rows.len() / 2;
            plan.rows[half..].clone_from_slice(&later.rows[half..]);
        }
        self.measured[0] = Some(plan);
        Ok(true)
    }

    fn artefact(&mut self) -> Result<Artefact, Failure> {
        Ok(self.artefact.clone())
    }

    fn probed(&mut self, rows: ProbedRows) -> Result<Probings, Failure> {
        let rows = &self.measured[rows as usize];
        Ok(rows.clone().expect("it is asked for after it was probed"))
    }

    fn identified(&mut self, found: &StudyOutcome<'_>) -> Result<(), Failure> {
        self.found = Some(found.errors().expect("it can be read"));
        Ok(())
    }

    fn errors(&mut self) -> Result<ErrorModel, Failure> {
        Ok(self.found.clone().expect("it was identified"))
    }

    fn agrees(&mut self, question: Question<'_>) -> Result<bool, Failure> {
        let number = match question {
            Question::Unmeasured(_) => 0,
            Question::Load => 1,
            Question::Validate => 2,
        };
        Ok(self.mishap != Mishap::Declined(number))
    }

    fn compile(&mut self) -> Result<bool, Failure> {
        let options = Options {
            random: 500,
            ..Options::of(Target::desktop())
        };
        let errors = self.found.as_ref().expect("it was identified");
        let made = compile::compile(self.machine, errors, &options, &());
        self.made = Some(made.expect("tables").built);
        Ok(true)
    }

    fn load(&mut self) -> Result<(), Failure> {
        self.is_loaded = true;
        Ok(())
    }

    fn probe_again(&mut self) -> Result<(), Failure> {
        if self.mishap == Mishap::Stops {
            return Err(Failure::Stopped);
        }
        self.measured[2] = Some(self.probe_rows(&self.plan.validation, 3));
        Ok(())
    }

    fn validated(&mut self, found: &Validated) -> Result<(), Failure> {
        self.validation = Some(found.validation.clone());
        Ok(())
    }

    fn keep(&mut self) -> Result<(), Failure> {
        self.is_kept = true;
        Ok(())
    }

    fn undo(&mut self) -> Result<(), Failure> {
        self.is_loaded = false;
        Ok(())
    }
}

/// What a calibration of a machine with these errors ends with.
struct Ended {
    end: Result<CalibrationEnd, Failure>,
    is_loaded: bool,
    is_kept: bool,
    validation: Option<Validation>,
}

fn calibrated(errors: &str, mishap: Mishap) -> Ended {
    let machine = Machine::from_toml(MACHINE).unwrap();
    let artefact = Artefact::from_toml(ARTEFACT, machine.tool_axis).unwrap();
    let real = ErrorModel::from_toml(errors, &machine).unwrap();
    let model = usual_model(&machine, &artefact).unwrap();
    let setup = Setup {
        machine: &machine,
        artefact: &artefact,
        balls: vec!["low".to_owned(), "high".to_owned()],
        probe: Probe {
            keeps_clear: true,
            ..Probe::default()
        },
        sigma: 1e-3,
        observations: None,
    };
    let task = Task {
        setup: &setup,
        model: &model,
        degree: 1,
        assumed: &ErrorModel::perfect(&machine),
        rows: PlannedRows::Best {
            indexings: Some("A=-60:60:20,C=-180:150:30"),
            probings: Some(40),
            criterion: Criterion::default(),
        },
    };
    let plan = CalibrationPlan::of(&task, 12, None).unwrap();
    let calibration = Calibration {
        machine: &machine,
        model,
        accept_places: false,
    };
    let mut simulated = Simulated {
        machine: &machine,
        artefact: &artefact,
        real: &real,
        plan: &plan,
        mishap,
        measured: [None, None, None],
        found: None,
        made: None,
        is_loaded: false,
        is_kept: false,
        validation: None,
    };
    let end = calibration.run(CalibrationStep::Plan, &mut simulated);
    Ended {
        end,
        is_loaded: simulated.is_loaded,
        is_kept: simulated.is_kept,
        validation: simulated.validation,
    }
}

/// The reason why nothing is loaded, after which nothing is.
fn unchanged(errors: &str, mishap: Mishap) -> Unchanged {
    let ended = calibrated(errors, mishap);
    assert!(!ended.is_loaded && !ended.is_kept, "{mishap:?}");
    match ended.end {
        Ok(CalibrationEnd::Unchanged(why)) => why,
        other => panic!("{mishap:?}: {other:?}"),
    }
}

#[test]
fn a_healthy_machine_is_better_afterwards_and_as_good_as_predicted() {
    let ended = calibrated(ERRORS, Mishap::None);
    assert!(
        matches!(ended.end, Ok(CalibrationEnd::InUse)),
        "{:?}",
        ended.end
    );
    assert!(ended.is_loaded && ended.is_kept);
    let validation = ended.validation.unwrap();
    assert!(validation.is_kept);
    assert!(validation.after.rms_um < 0.2 * validation.before.rms_um);
    // Three coordinates of probing noise are left.
    assert!(validation.after.rms_um < validation.expected_um);
}

#[test]
fn a_ball_that_moves_is_not_loaded() {
    assert_eq!(unchanged(ERRORS, Mishap::Ball), Unchanged::Doubtful);
}

#[test]
fn another_stylus_is_not_loaded() {
    match unchanged(ERRORS, Mishap::Stylus(0.3)) {
        // What is found of it is as uncertain as probing.
        Unchanged::OtherStylus(by) => assert!((by.z + 0.3).abs() < 0.02, "{by}"),
        other => panic!("{other:?}"),
    }
    // Five millimetres are another tool.
    let ended = calibrated(ERRORS, Mishap::Stylus(7.0));
    assert!(matches!(
        ended.end,
        Err(Failure::Refused(CalibrationRefusal::Study(_)))
    ));
    assert!(!ended.is_loaded);
}

#[test]
fn a_compensation_that_does_not_help_is_taken_back() {
    // With the wrong sign, none at all, and half of it: better, but not as predicted.
    for factor in [-1.0, 0.0, 0.5] {
        let mishap = Mishap::Corrections(factor);
        assert_eq!(unchanged(ERRORS, mishap), Unchanged::NotBetter);
    }
}

#[test]
fn a_machine_without_errors_is_left_alone() {
    let why = unchanged("machine = \"xyzac-trt\"\n", Mishap::None);
    assert!(matches!(why, Unchanged::MightHarm(_)), "{why:?}");
}

#[test]
fn a_machine_that_stops_corrects_as_before() {
    let ended = calibrated(ERRORS, Mishap::Stops);
    assert!(matches!(ended.end, Err(Failure::Stopped)));
    assert!(!ended.is_loaded && !ended.is_kept);
}

#[test]
fn somebody_who_declines_changes_nothing() {
    assert_eq!(unchanged(ERRORS, Mishap::Declined(1)), Unchanged::NotWanted);
    assert_eq!(
        unchanged(ERRORS, Mishap::Declined(2)),
        Unchanged::NotValidated
    );
    let why = unchanged(ERRORS, Mishap::Declined(0));
    // Backlash of linear axes is hidden from balls that are touched from both sides.
    assert!(
        matches!(why, Unchanged::Unmeasured(ref all) if !all.is_empty()),
        "{why:?}"
    );
}
