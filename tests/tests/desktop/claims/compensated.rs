//! The same from probings to the compensated machine: tables, what the verdict says that they leave, and the calibration
//! report. On a part of the machines `plan` chooses what is probed.

use super::{Displaced, Outside, POSITIONS, Place, ROWS, WAYS, either, identification, written};
use nalgebra::{Matrix3, Vector3};
use serde_json::json;
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::Identified;
use trueaxis_measure::plan::{Allowed, Probe, Setup, Wanted, design};
use trueaxis_model::errors::ErrorModel;
use trueaxis_report::certificate::{Calibration, Decision, Judged, Quantity, certificate};
use trueaxis_report::{Compensation, Document, Identification, report, verdict};
use trueaxis_tables::compile::{self, Options};
use trueaxis_tables::uncertainty::over_travel;
use trueaxis_tables::validate::{Command, Quality, Runtime, Statistics};
use trueaxis_tests::probed::Case;
use trueaxis_tests::{Fixed, usual_or_all};

/// What the calibration report is asked about. No limit is ever reached: what passes is what has grounds to, and the worst
/// limit for a pass to be wrong is the upper end of its interval.
const LIMITED: [&str; 12] = [
    "tip mean",
    "tip p95",
    "direction mean",
    "direction p95",
    "G XY",
    "G YZ",
    "F XY",
    "H XY",
    "E X",
    "B X",
    "M Z",
    "E +X+Y+Z",
];

/// Which of sixteen machines get a calibration report, which takes most of the time.
const CERTIFIED: [usize; 2] = [0, 3];

/// `plan`'s proposal for a machine, with touches from any side.
fn plan(case: &mut Case) {
    let machine = case.machine.clone();
    let probe = Probe {
        cone: std::f64::consts::PI,
        ..Probe::default()
    };
    let setup = Setup {
        machine: &machine,
        artefact: &case.artefact,
        balls: case.strategy.balls.clone(),
        probe,
        sigma: 1e-3,
        observations: None,
    };
    let rotary = machine.axes.iter().map(|axis| axis.letter.is_rotary());
    let allowed = Allowed::of(&machine, &rotary.collect::<Vec<bool>>());
    let perfect = ErrorModel::perfect(&machine);
    let wanted = |enough| Wanted {
        probings: enough,
        criterion: Default::default(),
    };
    let parameters = case.parameters("12");
    case.strategy = design(&setup, &allowed, &parameters, &perfect, wanted).expect("a plan");
}

/// What a compensation leaves of the true machine in the probed zone of its errors, with the place of the workpiece set.
fn left(case: &Case, errors: &ErrorModel, runtime: &Runtime<'_>, seed: u64) -> Quality {
    let machine = &case.machine;
    let truth = runtime.kinematics(machine, &case.errors);
    let axis = Vector3::ith(machine.tool_axis, 1.0);
    let mut random = Fixed::new(seed);
    let off: Vec<(Displaced, [Vector3<f64>; 2])> = (0..POSITIONS)
        .map(|_| {
            let mut position = [0.0; trueaxis_model::machine::MAX_AXES];
            for (q, [low, high]) in position.iter_mut().zip(errors.calibrated) {
                *q = random.within(low.min(high), low.max(high));
            }
            let signs = position.map(|_| either(&mut random));
            let command = Command::coming(machine, &machine.to_command(&position), &signs);
            let (q, situation) = command.kinematic(machine);
            let corrections = runtime.evaluate(&command).map(f64::from);
            let dq = machine.to_kinematic(&corrections);
            let error = truth.volumetric_error(&q, &dq, &situation);
            let nominal = truth.nominal(&q, situation.length);
            let displaced = Displaced {
                at: nominal.t,
                by: nominal.r * error.t,
            };
            (displaced, [nominal.r * error.r, nominal.r * axis])
        })
        .collect();
    let place = Place::of(off.iter().map(|(displaced, _)| displaced));
    let tip = |one: &Displaced| (one.by - place.displaces(&one.at)).norm() * 1e3;
    // Rotations are small: a direction turns by the part across it. That of the workpiece is set on the part, too.
    let across = |tool: &Vector3<f64>| Matrix3::identity() - tool * tool.transpose();
    let turns = off.iter().map(|(_, both)| both);
    let square: Matrix3<f64> = turns.clone().map(|[_, tool]| across(tool)).sum();
    let side: Vector3<f64> = turns.map(|[turn, tool]| across(tool) * turn).sum();
    let whole = square.lu().solve(&side).unwrap_or_default();
    let direction = |[turn, tool]: &[Vector3<f64>; 2]| (turn - whole).cross(tool).norm() * 1e6;
    Quality {
        translation_um: Statistics::of(off.iter().map(|(displaced, _)| tip(displaced))),
        direction_urad: Statistics::of(off.iter().map(|(_, turned)| direction(turned))),
    }
}

/// What `identify --json` says about an identification, as far as a calibration report depends on it.
fn said(case: &Case, measured: &Probings, found: &Identified) -> Identification {
    let refuted = found.components.iter().filter(|one| one.is_refuted);
    let refuted: Vec<&str> = refuted.map(|one| one.source.name()).collect();
    let all = json!({
        "machine": case.machine.name, "probings": measured.rows.len(), "probed": [], "balls": [],
        "parameters": [], "correlations": [], "unseen": [],
        "noise_um": found.noise * 1e3, "noise_of_stated": found.of_stated, "refuted": refuted,
        "degrees_of_freedom": found.freedom, "condition": found.condition, "held_out": null,
        "left_um": [0.0, 0.0, 0.0], "checks": [], "suspected": [], "rows": [],
    });
    serde_json::from_value(all).expect("an identification")
}

/// A calibration that states what a proof of conformity needs.
fn calibration(case: &Case) -> Calibration {
    let mut text = "date = 2026-11-27\n[[instrument]]\nname = \"probe\"\n".to_owned();
    for name in LIMITED {
        let unit = if name.starts_with('d') { "urad" } else { "um" };
        let zone = match name.split(' ').next() {
            Some("tip" | "direction") => "zone = \"probed\"\n",
            _ => "",
        };
        text += &format!("[[limit]]\nquantity = \"{name}\"\n{unit} = 9999.0\n{zone}");
    }
    Calibration::from_toml(&text, &case.machine).expect("a calibration")
}

/// A figure: what it is, its true value as a part of the upper end that is stated for it, of its lower end, and whether a
/// limit there passes.
struct Figure {
    name: String,
    of_upper: f64,
    of_lower: f64,
    passes: bool,
}

impl Figure {
    fn judged(judged: &Judged, is: f64) -> Option<Self> {
        let [low, high] = judged.interval?;
        Some(Self {
            name: judged.limit.quantity.name(),
            of_upper: is / high,
            of_lower: if low == 0.0 { f64::INFINITY } else { is / low },
            passes: judged.decision == Decision::Pass,
        })
    }
}

/// All figures of a machine, of the calibration report only if it is `certified`; `None` if there are no tables for it.
fn figures(
    case: &Case,
    measured: Probings,
    way: (&str, bool),
    is_certified: bool,
    seed: u64,
) -> Option<Vec<Figure>> {
    let machine = &case.machine;
    let (measured, found) = identification(case, measured, way);
    let errors = written(case, &measured, &found);
    let options = Options {
        random: 2000,
        seed,
        ..Options::default()
    };
    let compiled = compile::compile(machine, &errors, &options, &()).expect("tables");
    let document = Document {
        seed,
        ..Document::of(machine)
    };
    if !compiled.proof.refusals(document.tolerance_um).is_empty() {
        return None;
    }
    let runtime = Runtime::load(&compiled.built.blob).expect("tables");
    let uncertainty = over_travel(&runtime.kinematics(machine, &errors), seed).expect("positions");
    let compensation = Compensation {
        runtime: &runtime,
        proof: &compiled.proof,
        uncertainty: uncertainty.as_ref(),
        zero_at: None,
        tolerance_um: document.tolerance_um,
    };
    let told = verdict(machine, &errors, Some(compensation), seed).expect("a verdict");
    let known = told.volumetric.known.expect("an uncertainty");
    let most = known.with_tables(&told.volumetric.after.expect("tables"));
    let is = left(case, &errors, &runtime, seed);
    let mut all: Vec<Figure> = Vec::new();
    for (of, is, most) in [
        ("tip", is.translation_um, most.translation_um),
        ("direction", is.direction_urad, most.direction_urad),
    ] {
        for (what, is, most) in [
            ("mean", is.mean, most.mean),
            ("p95", is.p95, most.p95),
            ("largest", is.max, most.max),
        ] {
            all.push(Figure {
                name: format!("verdict {of} {what}"),
                of_upper: is / most,
                of_lower: f64::INFINITY,
                passes: of == "tip",
            });
        }
    }
    if !is_certified {
        return Some(all);
    }
    let identification = said(case, &measured, &found);
    let told = report(
        machine,
        &errors,
        Some(compensation),
        Some(identification),
        document,
    );
    let told = told.expect("a report");
    let judge = |errors: &ErrorModel| {
        let all = certificate(
            machine,
            errors,
            Some(compensation),
            &told,
            calibration(case),
        );
        all.expect("a calibration report").judged
    };
    let truth = judge(&case.errors);
    for (judged, truth) in judge(&errors).iter().zip(&truth) {
        let is = match judged.limit.quantity {
            Quantity::Volumetric {
                at_tip, is_mean, ..
            } => {
                let of = match at_tip {
                    true => is.translation_um,
                    false => is.direction_urad,
                };
                if is_mean { of.mean } else { of.p95 }
            }
            _ => match truth.value {
                Some(value) => value,
                None => continue,
            },
        };
        all.extend(Figure::judged(judged, is));
    }
    Some(all)
}

#[test]
fn what_is_said_of_the_compensated_machine_is_true() {
    // Six machines: one may be beyond chance.
    let (count, least) = usual_or_all((6, 0.8), (200, 0.93));
    let mut random = Fixed::new(94);
    let mut all: Vec<Figure> = Vec::new();
    let (mut machines, mut planned, mut refused) = (0, 0, 0);
    for number in 0.. {
        let outside = Outside::ALL[number % Outside::ALL.len()];
        let way = WAYS[number % WAYS.len()];
        let is_planned = number % 4 == 3;
        let Some(mut case) = Case::of_model_12(number, ROWS, &mut random) else {
            continue;
        };
        if is_planned {
            plan(&mut case);
        }
        outside.add(&mut case, &mut random);
        if case.reached().is_none() {
            continue;
        }
        let seed = number as u64 + 1;
        let measured = case.measured(&outside.disturbances(seed));
        let is_certified = CERTIFIED.contains(&(number % 16));
        let Some(figures) = figures(&case, measured, way, is_certified, seed) else {
            refused += 1;
            continue;
        };
        machines += 1;
        planned += usize::from(is_planned);
        let shown = figures
            .iter()
            .map(|one| format!("{} {:.2}", one.name, one.of_upper));
        let shown: Vec<String> = shown.collect();
        let name = &case.machine.name;
        eprintln!(
            "{number} {name} {outside:?} {way:?} {is_planned}: {}",
            shown.join(", ")
        );
        all.extend(figures);
        if machines == count {
            break;
        }
    }
    eprintln!("{machines} machines, {planned} of them planned; no tables for {refused} more");
    assert!(
        planned > 0 && 10 * refused <= machines,
        "{planned} {refused}"
    );
    let mut names: Vec<&String> = all.iter().map(|one| &one.name).collect();
    names.sort();
    names.dedup();
    let (mut passes, mut wrong) = (0, 0);
    for name in names {
        let own: Vec<&Figure> = all.iter().filter(|one| one.name == *name).collect();
        let share = |of: &dyn Fn(&&&Figure) -> bool| {
            own.iter().filter(of).count() as f64 / own.len() as f64
        };
        let below = share(&|one| one.of_upper <= 1.0);
        let above = share(&|one| one.of_lower >= 1.0);
        let passed = own.iter().filter(|one| one.passes);
        let failed = passed.clone().filter(|one| one.of_upper > 1.0).count();
        eprintln!(
            "{name}: {} machines: {below:.3} below, {above:.3} above; {} pass, {failed} wrong",
            own.len(),
            passed.clone().count()
        );
        (passes, wrong) = (passes + passed.count(), wrong + failed);
        // Directions are not measured, which is said.
        assert!(
            name.contains("direction") || below >= least,
            "{name}: {below}"
        );
    }
    assert!(
        wrong as f64 <= (1.0 - least) * passes as f64,
        "{wrong} of {passes}"
    );
}
