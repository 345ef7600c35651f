//! The claims from probings to the compensated machine: tables, what the verdict says that they leave, and the calibration
//! report. On a part of the machines `plan` chooses what is probed; a part has a bar of known length; on a part the direction
//! of the tool is measured, too.

use super::{Displaced, Outside, Place, ROWS, WAYS, from_both_sides, identification, written};
use nalgebra::{Matrix3, Vector3};
use serde_json::json;
use trueaxis_identify::Identified;
use trueaxis_identify::formats::observations::{
    InstrumentSetup as OfInstrument, Observation, Observations, PlacePrior, ToolPoint,
};
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::instrument::{Kind, SetupPriors};
use trueaxis_identify::simulate::{self, OfObservations};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::Sense;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::uncertainty::{over_travel, probed_zone};
use trueaxis_model::validate::{Quality, Region, Runtime, Statistics, random_commands};
use trueaxis_probing::plan::{Allowed, Probe, Setup, WantedDesign, design};
use trueaxis_report::certificate::{CalibrationRecord, Decision, Judged, Quantity, certificate};
use trueaxis_report::{Document, Identification, ReportedCompensation, report, verdict};
use trueaxis_tables::compile::{self, Options};
use trueaxis_tests::probed::Case;
use trueaxis_tests::{Fixed, usual_or_all};

/// What the calibration report is asked about.
const LIMITED: [&str; 12] = [
    "tip mean",
    "tip p95",
    "G XY",
    "G YZ",
    "F XY",
    "H XY",
    "E X",
    "B X",
    "M Z",
    "E +X+Y+Z",
    "direction mean",
    "direction p95",
];
/// A limit that is never reached: what passes is what has grounds to. A report has room for 20 limits, so the first eight
/// quantities get another one, at one of these parts of the true value, by turns.
const NEVER: f64 = 9999.0;
const PARTS: [f64; 4] = [1.1, 3.0, 0.3, 0.9];
const FURTHER: usize = 8;
/// A true value (µm, µrad) below this gets no other limit.
const NOTHING: f64 = 0.01;

/// Which of sixteen machines get a calibration report, which takes most of the time.
const CERTIFIED: [usize; 4] = [0, 3, 5, 13];
/// Those of them whose report is about the machine without tables, on which limits can be verified to be exceeded.
const WITHOUT_TABLES: [usize; 2] = [5, 13];
/// Standard uncertainty (mm) of the length of a bar. Machines with odd numbers have one, and files that say from which side
/// their axes came: neither scales nor backlash are unseen.
const BAR: f64 = 5e-4;

/// The positions of the verdict: where a rotary axis cannot turn the tool, few of many have most of the error.
const POSITIONS: usize = 5000;

/// The first so many of eleven machines have their direction measured, with this standard uncertainty (mm over the lever:
/// 1 µrad). Eleven has no factor in common with the numbers of layouts, kinds and ways.
const WITH_ANGLES: usize = 2;
const ANGLE: f64 = 1e-3;

/// Readings of the direction of the tool about all axes of the workpiece where balls are probed.
fn angles(case: &Case, measured: &Probings, seed: u64) -> Observations {
    let machine = &case.machine;
    let linear = (0..machine.axes.len()).filter(|i| !machine.axes[*i].letter.is_rotary());
    let linear: Vec<usize> = linear.collect();
    let point = ToolPoint {
        name: "mirror".to_owned(),
        place: None,
        known: PlacePrior::Exactly,
    };
    let setup = |k: usize| OfInstrument {
        name: format!("autocollimator {k}"),
        kind: Kind::Angle,
        given: SetupPriors::default(),
        tool: 0,
    };
    let row = |setup: usize, row: &Probing| Observation {
        setup,
        position: row.position,
        direction: row.direction,
        spindle: row.spindle,
        reads: Some((
            Sense::From(linear[(setup + 1) % 3], linear[(setup + 2) % 3]),
            1.0,
        )),
        normal: None,
        value: Vector3::zeros(),
        sigma: Some(ANGLE),
        time: None,
        temperature: None,
        file: 0,
        line: row.line,
    };
    let plan = Observations {
        files: vec!["angles.csv".to_owned()],
        setups: (0..3).map(setup).collect(),
        tools: vec![point],
        rows: (0..3)
            .flat_map(|setup| measured.rows.iter().map(move |one| row(setup, one)))
            .collect(),
        ..Observations::default()
    };
    let disturbances = OfObservations {
        noise: 1.0,
        seed,
        ..OfObservations::default()
    };
    simulate::observations(
        &Kinematics::new(machine, &case.errors),
        &plan,
        &disturbances,
    )
}

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
        balls: case.plan.balls.clone(),
        probe,
        sigma: 1e-3,
        observations: None,
    };
    let rotary = machine.axes.iter().map(|axis| axis.letter.is_rotary());
    let allowed = Allowed::of(&machine, &rotary.collect::<Vec<bool>>());
    let perfect = ErrorModel::perfect(&machine);
    let wanted = |enough| WantedDesign {
        probings: enough,
        criterion: Default::default(),
    };
    let parameters = case.parameters("12");
    case.plan = design(&setup, &allowed, &parameters, &perfect, wanted).expect("a plan");
}

/// The error of the true machine in the probed zone of its errors, with or without a compensation. The place of the workpiece
/// is that of the machine that was found: balls do not show another one.
fn left(case: &Case, errors: &ErrorModel, runtime: Option<&Runtime<'_>>, seed: u64) -> Quality {
    let machine = &case.machine;
    let both = [&case.errors, errors].map(|errors| match runtime {
        Some(runtime) => runtime.kinematics(machine, errors),
        None => Kinematics::new(machine, errors),
    });
    let axis = Vector3::ith(machine.tool_axis, 1.0);
    let zone = probed_zone(machine, errors);
    let zone = Kinematics::new(&zone, errors);
    let commands = random_commands(&zone, Region::Travel, POSITIONS, seed).expect("positions");
    // Displacement and rotation of the true tool, by how much they differ from those of the tool that was found, and its axis.
    type Off = (Displaced, Displaced, [Vector3<f64>; 3]);
    let off: Vec<Off> = (commands.iter())
        .map(|command| {
            let (q, situation) = command.kinematic(machine);
            let corrections = runtime.map(|runtime| runtime.evaluate(command).map(f64::from));
            let dq = machine.to_kinematic(&corrections.unwrap_or_default());
            let nominal = both[0].nominal(&q, situation.length);
            let [truth, found] = [&both[0], &both[1]].map(|one| {
                let error = one.volumetric_error(&q, &dq, &situation);
                [nominal.r * error.t, nominal.r * error.r]
            });
            let displaced = |by| Displaced { at: nominal.t, by };
            (
                displaced(truth[0]),
                displaced(truth[0] - found[0]),
                [truth[1], truth[1] - found[1], nominal.r * axis],
            )
        })
        .collect();
    let place = Place::of(off.iter().map(|(_, apart, _)| apart));
    let tip = |one: &Displaced| (one.by - place.displaces(&one.at)).norm() * 1e3;
    // Rotations are small: a direction turns by the part across it. That of the workpiece is set on the part, too.
    let across = |tool: &Vector3<f64>| Matrix3::identity() - tool * tool.transpose();
    let turns = off.iter().map(|(_, _, turns)| turns);
    let square: Matrix3<f64> = turns.clone().map(|[_, _, tool]| across(tool)).sum();
    let side: Vector3<f64> = turns.map(|[_, apart, tool]| across(tool) * apart).sum();
    let whole = square.lu().solve(&side).unwrap_or_default();
    let direction = |[turn, _, tool]: &[Vector3<f64>; 3]| (turn - whole).cross(tool).norm() * 1e6;
    Quality {
        translation_um: Statistics::of(off.iter().map(|(displaced, ..)| tip(displaced))),
        direction_urad: Statistics::of(off.iter().map(|(.., turned)| direction(turned))),
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
        "left_um": [0.0, 0.0, 0.0], "checks": [], "outliers": [], "rows": [],
    });
    serde_json::from_value(all).expect("an identification")
}

/// A calibration that states what a verification of conformity needs, with limits at parts of the true values as far as these are
/// given.
fn calibration(case: &Case, truth: &[f64], seed: u64) -> CalibrationRecord {
    let mut text = "date = 2026-11-27\n[[instrument]]\nname = \"probe\"\n".to_owned();
    for (number, name) in LIMITED.into_iter().enumerate() {
        let unit = if name.starts_with('d') { "urad" } else { "um" };
        let zone = match name.split(' ').next() {
            Some("tip" | "direction") => "zone = \"probed\"\n",
            _ => "",
        };
        let part = PARTS[(seed as usize + number) % PARTS.len()];
        let is = truth.iter().take(FURTHER).nth(number);
        let further = is.filter(|is| **is > NOTHING).map(|is| part * is);
        for limit in further.into_iter().chain([NEVER]) {
            text += &format!("[[limit]]\nquantity = \"{name}\"\n{unit} = {limit:?}\n{zone}");
        }
    }
    CalibrationRecord::from_toml(&text, &case.machine).expect("a calibration")
}

/// A figure: what it is, its true value as a part of the upper end that is stated for it, and whether a limit there passes:
/// the worst limit for a pass to be wrong.
struct Figure {
    name: String,
    of_upper: f64,
    passes: bool,
}

impl Figure {
    fn judged(judged: &Judged, is: f64) -> Option<Self> {
        let [_, high] = judged.interval?;
        Some(Self {
            name: judged.limit.quantity.name(),
            of_upper: is / high,
            passes: judged.decision == Decision::Pass,
        })
    }
}

/// What is said about a machine.
struct Said {
    figures: Vec<Figure>,
    /// What a calibration report decides about limits, and whether the true value is within each.
    decisions: Vec<(Decision, bool)>,
}

/// All that is said of a machine, by a calibration report only if its `number` says so; `None` if there are no tables for it.
fn all_said(case: &Case, measured: Probings, way: (&str, bool), number: usize) -> Option<Said> {
    let seed = number as u64 + 1;
    let machine = &case.machine;
    let observed = match number % 11 < WITH_ANGLES {
        true => angles(case, &measured, seed),
        false => Observations::default(),
    };
    let (measured, found) = identification(case, measured, &observed, way);
    let errors = written(case, &measured, &observed, &found);
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
    if !compiled
        .verification
        .refusals(document.tolerance_um)
        .is_empty()
    {
        return None;
    }
    let runtime = Runtime::load(&compiled.built.blob).expect("tables");
    let uncertainty = over_travel(&runtime.kinematics(machine, &errors), seed).expect("positions");
    let compensation = ReportedCompensation {
        runtime: &runtime,
        verification: &compiled.verification,
        uncertainty: uncertainty.as_ref(),
        zero_at: None,
        tolerance_um: document.tolerance_um,
    };
    let told = verdict(machine, &errors, Some(compensation), seed).expect("a verdict");
    let known = told.volumetric.known.expect("an uncertainty");
    let most = known.with_tables(&told.volumetric.after.expect("tables"));
    let is = left(case, &errors, Some(&runtime), seed);
    let mut all = Said {
        figures: Vec::new(),
        decisions: Vec::new(),
    };
    // Balls do not show directions, and the verdict says so; with it, they are not a claim.
    let is_measured = errors.is_direction_measured();
    assert_eq!(is_measured, !observed.rows.is_empty());
    let first = &told.sentences[0];
    let is_said = first.contains("direction was not measured");
    assert_ne!(is_said, is_measured, "{first}");
    let direction = match is_measured {
        true => "direction",
        false => "direction, of parameters alone,",
    };
    for (of, is, most) in [
        ("tip", is.translation_um, most.translation_um),
        (direction, is.direction_urad, most.direction_urad),
    ] {
        for (what, is, most) in [
            ("mean", is.mean, most.mean),
            ("p95", is.p95, most.p95),
            ("largest", is.max, most.max),
        ] {
            all.figures.push(Figure {
                name: format!("verdict {of} {what}"),
                of_upper: is / most,
                passes: of == "tip" || is_measured,
            });
        }
    }
    if !CERTIFIED.contains(&(number % 16)) {
        return Some(all);
    }
    let (compensation, is) = match WITHOUT_TABLES.contains(&(number % 16)) {
        true => (None, left(case, &errors, None, seed)),
        false => (Some(compensation), is),
    };
    let identification = said(case, &measured, &found);
    let told = report(
        machine,
        &errors,
        compensation,
        Some(identification),
        document,
    );
    let told = told.expect("a report");
    let judge = |errors: &ErrorModel, calibration: CalibrationRecord| {
        let all = certificate(machine, errors, compensation, &told, calibration);
        all.expect("a calibration report").judged
    };
    let truth = judge(&case.errors, calibration(case, &[], seed));
    let truth = truth.iter().map(|judged| match judged.limit.quantity {
        Quantity::Volumetric {
            at_tip, is_mean, ..
        } => {
            let of = match at_tip {
                true => is.translation_um,
                false => is.direction_urad,
            };
            if is_mean { of.mean } else { of.p95 }
        }
        // A plane that the machine has no room for.
        _ => judged.value.unwrap_or(0.0),
    });
    let truth: Vec<f64> = truth.collect();
    for judged in judge(&errors, calibration(case, &truth, seed)) {
        let name = judged.limit.quantity.name();
        let own = LIMITED.iter().position(|of| name.starts_with(of));
        let is = truth[own.expect("a quantity")];
        let limit = judged.limit.at_most;
        all.decisions.push((judged.decision, is <= limit));
        if limit == NEVER {
            all.figures.extend(Figure::judged(&judged, is));
        }
    }
    Some(all)
}

#[test]
fn what_is_said_of_the_compensated_machine_is_true() {
    // Six machines: one may be beyond chance.
    let (count, least) = usual_or_all((6, 0.8), (200, 0.93));
    let mut random = Fixed::new(94);
    let mut all: Vec<Figure> = Vec::new();
    let mut decisions: Vec<(Decision, bool)> = Vec::new();
    let (mut machines, mut planned, mut refused) = (0, 0, 0);
    for number in 0.. {
        let outside = Outside::ALL[number % Outside::ALL.len()];
        let way = WAYS[number % WAYS.len()];
        let is_planned = number % 4 == 3;
        let Some(mut case) = Case::of_model_12(number, ROWS, &mut random) else {
            continue;
        };
        if number % 2 == 1 {
            case.add_bar(BAR, &mut random);
        }
        if is_planned {
            plan(&mut case);
        }
        if number % 2 == 1 {
            from_both_sides(&mut case, &mut random);
        }
        outside.add(&mut case, &mut random);
        if case.reached().is_none() {
            continue;
        }
        let seed = number as u64 + 1;
        let measured = case.measured(&outside.disturbances(seed));
        let Some(said) = all_said(&case, measured, way, number) else {
            refused += 1;
            continue;
        };
        machines += 1;
        planned += usize::from(is_planned);
        let shown = (said.figures.iter()).map(|one| format!("{} {:.2}", one.name, one.of_upper));
        let shown: Vec<String> = shown.collect();
        let name = &case.machine.name;
        eprintln!(
            "{number} {name} {outside:?} {way:?} {is_planned}: {}",
            shown.join(", ")
        );
        all.extend(said.figures);
        decisions.extend(said.decisions);
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
        let below = own.iter().filter(|one| one.of_upper <= 1.0).count();
        let below = below as f64 / own.len() as f64;
        let passed = own.iter().filter(|one| one.passes);
        let failed = passed.clone().filter(|one| one.of_upper > 1.0).count();
        eprintln!("{name}: {below:.3} of {} below", own.len());
        (passes, wrong) = (passes + passed.count(), wrong + failed);
        // Directions are not measured: the verdict says so, and the calibration report has no interval.
        assert!(
            name.contains("of parameters alone") || below >= least,
            "{name}: {below}"
        );
    }
    // The share of a claim with 95 % is below 93 % of 200 independent ones once in 13 draws; of six, two are wrong once in 33.
    // The limits of one machine are not independent.
    assert!(
        passes > 0 && wrong as f64 <= (1.0 - least) * passes as f64,
        "{wrong} of {passes}"
    );
    let [pass, fail, open] =
        [Decision::Pass, Decision::Fail, Decision::NotDecided].map(|decision| {
            let own = decisions.iter().filter(|(of, _)| *of == decision);
            let kept = own.clone().filter(|(_, is_kept)| *is_kept).count();
            eprintln!(
                "{decision:?}: {} limits, {kept} of them kept",
                own.clone().count()
            );
            [own.count(), kept].map(|count| count as f64)
        });
    // All three occur, and what is decided is true.
    assert!(
        pass[0] * fail[0] * open[0] > 0.0,
        "{pass:?} {fail:?} {open:?}"
    );
    assert!(pass[1] >= least * pass[0], "{pass:?}");
    assert!(fail[1] <= (1.0 - least) * fail[0], "{fail:?}");
}
