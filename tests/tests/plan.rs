//! Plans against what is identified in the end.

use trueaxis_host::errors::{ErrorModel, Parameter};
use trueaxis_host::formats::artefact::Artefact;
use trueaxis_host::formats::probings::{self, Probings};
use trueaxis_host::identify::{Assumed, Identified, Model, Options, Problem, identify};
use trueaxis_host::kinematics::Kinematics;
use trueaxis_host::machine::Machine;
use trueaxis_host::plan::{
    Allowed, Criterion, Probe, Ratios, Setup, Wanted, as_good_as, design, judge,
};
use trueaxis_host::simulate::{self, Disturbances};
use trueaxis_host::spheres::{read_log, to_probings};
use trueaxis_tests::read;

/// A machine, its errors, and how it is probed.
struct Case {
    machine: Machine,
    errors: ErrorModel,
    artefact: Artefact,
    strategy: Probings,
    parameters: Vec<Parameter>,
}

const PROBE: Probe = Probe {
    radius: 13.0,
    clearance: 5.0,
    search: 3.0,
    cone: std::f64::consts::FRAC_PI_2,
};
/// Standard uncertainty of a coordinate (mm).
const SIGMA: f64 = 1e-3;

impl Case {
    fn new(folder: &str, errors: &str, model: &str) -> Self {
        let file = |name: &str| read(&format!("examples/{folder}/{name}"));
        let machine = Machine::from_toml(&file("machine.toml")).unwrap();
        let mut errors = ErrorModel::from_toml(&file(errors), &machine).unwrap();
        // Polynomials that go on to the ends, as those that are looked for do.
        for (range, axis) in errors.calibrated.iter_mut().zip(&machine.axes) {
            *range = axis.travel.map(|t| axis.to_kinematic(t));
        }
        let model: Model = model.parse().unwrap();
        Self {
            artefact: Artefact::from_toml(&file("artefact.toml"), machine.tool_axis).unwrap(),
            strategy: probings::read(&file("strategy.csv"), &machine, false).unwrap(),
            parameters: model.parameters(&machine, 0, &[]).unwrap(),
            machine,
            errors,
        }
    }

    fn setup(&self) -> Setup<'_> {
        Setup {
            machine: &self.machine,
            artefact: &self.artefact,
            balls: self.artefact.balls.iter().map(|b| b.name.clone()).collect(),
            probe: PROBE,
            sigma: SIGMA,
        }
    }

    fn assumed(&self) -> Assumed<'_> {
        Assumed {
            errors: &self.errors,
            size: 0.0,
        }
    }

    fn identified(&self, measured: &Probings) -> Identified {
        let perfect = ErrorModel::perfect(&self.machine);
        let problem = Problem::new(
            &self.machine,
            measured,
            &self.artefact,
            &self.parameters,
            &perfect,
        );
        identify(&problem, Options::default()).unwrap()
    }
}

fn names(parameters: impl Iterator<Item = Parameter>) -> Vec<String> {
    parameters.map(|p| p.to_string()).collect()
}

#[test]
fn what_is_foreseen_is_what_identify_states() {
    for (folder, errors, model) in [
        ("kolibri", "errors-10.toml", "10"),
        ("kolibri", "errors-12.toml", "12"),
        ("hu40", "errors-13.toml", "13"),
        ("kolibri", "errors-81.toml", "81"),
        ("hu40", "errors-84.toml", "84"),
    ] {
        let case = Case::new(folder, errors, model);
        let judged = judge(&case.setup(), &case.parameters, &case.strategy, case.assumed());
        let foreseen = judged.unwrap().foreseen;
        let kinematics = Kinematics::new(&case.machine, &case.errors);
        for (noise, most) in [
            // Without noise the machine that is identified is the one that is assumed, to some nm: the
            // Jacobian changes by that part of its lever, and the condition of up to 7000 multiplies it.
            (0.0, 1e-5),
            // With noise it is off by a few µm of some 100 mm, and the condition multiplies that.
            (SIGMA, 0.02),
        ] {
            let disturbances = Disturbances {
                noise,
                ..Disturbances::default()
            };
            let measured =
                simulate::probings(&kinematics, &case.artefact, &case.strategy, &disturbances);
            let mut measured = measured.unwrap();
            for row in &mut measured.rows {
                row.sigma = Some(SIGMA);
            }
            let identified = case.identified(&measured);
            assert_eq!(
                names(foreseen.parameters.iter().copied()),
                names(identified.parameters.iter().map(|e| e.parameter)),
                "{folder} {model}"
            );
            let unseen = |all: &[trueaxis_host::identify::Unseen]| {
                all.iter().map(|u| u.sentence()).collect::<Vec<_>>()
            };
            assert_eq!(unseen(&foreseen.unseen), unseen(&identified.unseen));
            let pairs = foreseen.uncertainties().into_iter().zip(&identified.parameters);
            for (planned, stated) in pairs {
                let ratio = planned / stated.uncertainty;
                assert!((ratio - 1.0).abs() < most, "{folder} {model} {}: {ratio}", stated.parameter);
            }
            let ratio = foreseen.condition / identified.condition;
            assert!((ratio - 1.0).abs() < most, "{folder} {model}: {ratio}");
        }
    }
}

/// The whole way, with balls that stand up to 2 mm from where they should.
#[test]
fn from_a_plan_by_touches_to_the_errors_of_the_machine() {
    for (folder, errors, model, indexings) in [
        ("kolibri", "errors-10.toml", "10", "A=-55:55:11,C=0:330:30"),
        ("kolibri", "errors-12.toml", "12", "A=-55:55:11,C=0:330:30"),
        ("hu40", "errors-13.toml", "13", "B=-60:60:15,C=-180:180:30,S=0:300:60"),
    ] {
        let case = Case::new(folder, errors, model);
        let backlash = |l: char| case.parameters.iter().any(|p| p.axis == l && p.to_string().ends_with('b'));
        let directions: Vec<bool> =
            case.machine.axes.iter().map(|a| backlash(a.letter.char())).collect();
        let mut allowed = Allowed::of(&case.machine, false, &directions);
        allowed.restrict(&case.machine, indexings).unwrap();
        let perfect = ErrorModel::perfect(&case.machine);
        let assumed = Assumed {
            errors: &perfect,
            size: 0.05,
        };
        let wanted = |_| Wanted {
            probings: 50,
            criterion: Criterion::Volume,
        };
        let strategy = design(&case.setup(), &allowed, &case.parameters, assumed, wanted).unwrap();
        assert_eq!(strategy.rows.len(), 50);
        // As it is written and read again.
        let text = probings::write_strategy(&strategy, &case.machine);
        let strategy = probings::read(&text, &case.machine, false).unwrap();
        let mut real = case.artefact.clone();
        for (i, ball) in real.balls.iter_mut().enumerate() {
            let place = ball.nominal.as_mut().unwrap();
            place[i % 3] += 1.2;
            place[(i + 1) % 3] -= 1.6;
        }
        let kinematics = Kinematics::new(&case.machine, &case.errors);
        for noise in [0.0, 1e-3] {
            let disturbances = Disturbances {
                noise,
                ..Disturbances::default()
            };
            let touched = simulate::touches(
                &kinematics,
                &case.artefact,
                &real,
                &strategy,
                &PROBE,
                &disturbances,
            );
            let log = simulate::log(&case.machine, &touched.unwrap());
            let log = read_log(&log, &case.machine).unwrap();
            let found = to_probings(&case.machine, &strategy, &log, None).unwrap();
            assert!(found.fitted.doubtful.is_empty());
            let identified = case.identified(&found.probings);
            assert_eq!(identified.parameters.len(), case.parameters.len(), "{folder} {model}");
            for e in &identified.parameters {
                let truth = case.errors.parameters.get(&e.parameter).copied().unwrap_or(0.0);
                let off = (e.value - truth).abs();
                // Of 21 to 25 values one of 7000 is farther off than this.
                assert!(noise == 0.0 || off < 4.5 * e.uncertainty, "{}: {off}", e.parameter);
                // Scales of 0.6 mm/m and squarenesses of 1 mrad make the balls no spheres, by 1e-3 of a radius
                // of 13 mm: along the tool that is the stylus' length, and hardly anything is left across it.
                let most = if e.parameter.is_angular() || e.parameter.to_string().ends_with('1') {
                    2e-6
                } else {
                    2e-4
                };
                assert!(noise > 0.0 || off < most, "{folder} {}: {off}", e.parameter);
            }
        }
    }
}

#[test]
fn a_plan_for_the_document_s_machines_takes_fewer_probings() {
    for (folder, errors, model, indexings, most) in [
        ("kolibri", "errors-10.toml", "10", "A=-55:55:5,C=-360:360:30", 168),
        ("hu40", "errors-13.toml", "13", "B=-90:90:15,C=-360:360:30,S=0:300:60", 109),
    ] {
        let case = Case::new(folder, errors, model);
        let setup = case.setup();
        let mut allowed = Allowed::of(&case.machine, false, &vec![false; case.machine.axes.len()]);
        allowed.restrict(&case.machine, indexings).unwrap();
        let assumed = case.assumed();
        let published = judge(&setup, &case.parameters, &case.strategy, assumed).unwrap();
        assert_eq!(published.strategy.rows.len(), most);
        let found = as_good_as(&setup, &allowed, &case.parameters, assumed, &published);
        let planned = judge(&setup, &case.parameters, &found.unwrap().unwrap(), assumed).unwrap();
        let ratios = Ratios::of(&planned, &published);
        assert!(ratios.is_no_worse(), "{ratios:?}");
        println!("{folder}: {} of {most}", planned.strategy.rows.len());
        assert!(planned.strategy.rows.len() < most);
    }
}
