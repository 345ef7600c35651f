//! A simulated machine is calibrated: its errors are known here, and nowhere in the calibration.

use super::simulated::{Failure, Mishap, SimulatedMachine};
use super::*;
use crate::plan::{Criterion, PlannedRows, Probe, Setup, Task};
use trueaxis_model::errors::ErrorModel;

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
    let simulated = SimulatedMachine::new(&machine, &plan, &artefact, &real, NOISE);
    let mut simulated = simulated.with(mishap);
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
