//! A simulated machine is calibrated: its errors are known here, and nowhere in the calibration.

use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_study::calibration::{CalibrationEnd, CalibrationPlan, CalibrationRefusal, Unchanged};
use trueaxis_study::validation::Validation;
use trueaxis_tests::machine;
use trueaxis_tests::simulated_machine::{Failure, Mishap, SimulatedMachine, calibration_plan};

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

/// The machine, its artefact, and the plan.
struct Calibrated {
    machine: Machine,
    artefact: Artefact,
    plan: CalibrationPlan,
}

impl Calibrated {
    fn new() -> Self {
        let machine = machine("examples/linuxcnc-xyzac-trt/machine.toml");
        let artefact = Artefact::from_toml(ARTEFACT, machine.tool_axis).unwrap();
        let indexings = Some("A=-60:60:20,C=-180:150:30");
        Self {
            plan: calibration_plan(&machine, &artefact, indexings, [40, 12]),
            machine,
            artefact,
        }
    }

    fn ended(&self, errors: &str, mishap: Mishap) -> Ended {
        let (machine, artefact) = (&self.machine, &self.artefact);
        let real = ErrorModel::from_toml(errors, machine).unwrap();
        let simulated = SimulatedMachine::new(machine, &self.plan, artefact, &real, NOISE);
        let mut simulated = simulated.with(mishap);
        Ended {
            end: simulated.calibrate(),
            is_loaded: simulated.is_loaded,
            is_kept: simulated.is_kept,
            validation: simulated.validation,
        }
    }
}

#[test]
fn a_healthy_machine_is_better_afterwards_and_as_good_as_predicted() {
    let ended = Calibrated::new().ended(ERRORS, Mishap::None);
    let end = ended.end;
    assert!(matches!(end, Ok(CalibrationEnd::InUse)), "{end:?}");
    assert!(ended.is_loaded && ended.is_kept);
    let validation = ended.validation.unwrap();
    assert!(validation.is_kept);
    assert!(validation.after.rms_um < 0.2 * validation.before.rms_um);
    // Three coordinates of probing noise are left.
    assert!(validation.after.rms_um < validation.expected_um);
}

#[test]
fn after_a_mishap_nothing_is_loaded_and_it_says_why() {
    type IsIt = fn(&Result<CalibrationEnd, Failure>) -> bool;
    use CalibrationEnd::Unchanged as Left;
    let calibrated = Calibrated::new();
    let not_better: IsIt = |end| matches!(end, Ok(Left(Unchanged::NotBetter)));
    let perfect = "machine = \"xyzac-trt\"\n";
    let cases: [(&str, Mishap, IsIt); 11] = [
        (ERRORS, Mishap::Ball, |end| {
            matches!(end, Ok(Left(Unchanged::Doubtful)))
        }),
        // What is found of another stylus is as uncertain as probing.
        (
            ERRORS,
            Mishap::Stylus(0.3),
            |end| matches!(end, Ok(Left(Unchanged::OtherStylus(by))) if (by.z + 0.3).abs() < 0.02),
        ),
        // Millimetres are another tool.
        (ERRORS, Mishap::Stylus(7.0), |end| {
            matches!(end, Err(Failure::Refused(CalibrationRefusal::Study(_))))
        }),
        // A compensation with the wrong sign, none at all, and half of it: better, but not as predicted.
        (ERRORS, Mishap::Corrections(-1.0), not_better),
        (ERRORS, Mishap::Corrections(0.0), not_better),
        (ERRORS, Mishap::Corrections(0.5), not_better),
        (perfect, Mishap::None, |end| {
            matches!(end, Ok(Left(Unchanged::MightHarm(_))))
        }),
        (ERRORS, Mishap::Stops, |end| {
            matches!(end, Err(Failure::Stopped))
        }),
        // Backlash of linear axes is hidden from balls that are touched from both sides.
        (
            ERRORS,
            Mishap::Declined(0),
            |end| matches!(end, Ok(Left(Unchanged::Unmeasured(all))) if !all.is_empty()),
        ),
        (ERRORS, Mishap::Declined(1), |end| {
            matches!(end, Ok(Left(Unchanged::NotWanted)))
        }),
        (ERRORS, Mishap::Declined(2), |end| {
            matches!(end, Ok(Left(Unchanged::NotValidated)))
        }),
    ];
    for (errors, mishap, is_it) in cases {
        let ended = calibrated.ended(errors, mishap);
        assert!(is_it(&ended.end), "{mishap:?}: {:?}", ended.end);
        assert!(!ended.is_loaded && !ended.is_kept, "{mishap:?}");
    }
}
