//! Finds probings that identify what the others cannot.

use super::candidates::{Allowed, Setup};
use super::touch::Probe;
use nalgebra::{DVector, Vector3};
use trueaxis_identify::formats::artefact::{Artefact, Ball};
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::{Foreseen, Identified, Unknown};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// A probing that identifies an unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Remedy {
    /// The unknown that cannot be identified without it.
    pub unseen: Unknown,
    /// The probing; its ball is one of the plan's.
    pub add: Option<Probing>,
}

/// Largest number of parameters for which a position is searched.
const REMEDIES: usize = 12;
/// Angles of the spindle (deg), if one is added.
const SPINDLE: [f64; 4] = [0.0, 90.0, 180.0, 270.0];

/// For each parameter that was looked for but cannot be identified, a probing of the same balls that would identify
/// it. It is computed for the identified machine, with `base` known before and balls and stylus where they were
/// found. The stylus stays at least as close to the direction in which a ball stands off the table as in the
/// probings.
#[must_use]
pub fn would_show(
    machine: &Machine,
    probings: &Probings,
    artefact: &Artefact,
    observations: &Observations,
    base: &ErrorModel,
    identified: &Identified,
) -> Vec<Remedy> {
    let is_unseen = |u: &Unknown| identified.unseen.iter().any(|unseen| unseen.unknown == *u);
    let is_parameter = |u: &Unknown| matches!(u, Unknown::Parameter(_));
    let mut unseen = identified.unseen.iter().map(|u| u.unknown);
    if !unseen.any(|u| is_parameter(&u)) || probings.rows.is_empty() {
        return Vec::new();
    }
    let ball = |(name, place): (&String, &Vector3<f64>)| Ball {
        name: name.clone(),
        nominal: Some(*place),
        away: (artefact.balls.iter())
            .find(|b| b.name == *name)
            .map_or(Vector3::z(), |b| b.away),
        post: None,
    };
    let mut found = artefact.clone();
    found.balls = (probings.balls.iter().zip(&identified.balls))
        .map(ball)
        .collect();
    found.stylus.tip = <[f64; 3]>::from(identified.stylus).map(Some);
    let mut plan = probings.clone();
    if plan.rows.iter().any(|row| row.sigma.is_none()) {
        for row in &mut plan.rows {
            row.sigma = Some(identified.noise);
        }
    }
    let usual = Probe::default();
    let setup = Setup {
        machine,
        artefact: &found,
        balls: probings.balls.clone(),
        probe: Probe {
            cone: usual.cone.max(widest(machine, probings, &found)),
            ..usual
        },
        sigma: identified.noise,
        observations: Some(observations),
    };
    let assumed = &identified.errors;
    let parameters = &identified.looked_for;
    let Ok(foreseen) = setup.problem(&plan, parameters, base).foresee(assumed) else {
        return Vec::new();
    };
    let mut remedies = remedies(&setup, parameters, base, &plan, assumed, &foreseen);
    remedies.retain(|remedy| is_unseen(&remedy.unseen));
    remedies
}

/// The largest angle (rad) between the stylus and the direction in which a ball stands off the table.
fn widest(machine: &Machine, probings: &Probings, artefact: &Artefact) -> f64 {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let angle = |row: &Probing| {
        let pose = kinematics.nominal(&machine.to_kinematic(&row.position), None);
        let to_spindle = Vector3::from(machine.direction(&pose));
        // Allow for rounding in the comparison with touches.
        let angle = to_spindle
            .dot(&artefact.balls[row.ball].away)
            .clamp(-1.0, 1.0);
        libm::acos(angle) + 1e-9
    };
    probings.rows.iter().map(angle).fold(0.0, f64::max)
}

/// For each unidentifiable parameter, the single probing with the largest effect of it, if that makes it
/// identifiable.
pub(super) fn remedies(
    setup: &Setup<'_>,
    parameters: &[Parameter],
    base: &ErrorModel,
    plan: &Probings,
    assumed: &ErrorModel,
    foreseen: &Foreseen,
) -> Vec<Remedy> {
    let is_parameter = |u: &Unknown| matches!(u, Unknown::Parameter(_));
    let unseen = foreseen.unseen.iter().zip(&foreseen.hidden);
    let unseen: Vec<_> = (unseen.filter(|(u, _)| is_parameter(&u.unknown)))
        .take(REMEDIES)
        .collect();
    if unseen.is_empty() {
        return Vec::new();
    }
    let backlash = |letter: char| {
        let of = |p: &&Parameter| p.kind == ParameterKind::Backlash && p.axis == letter;
        parameters.iter().find(of).is_some()
    };
    let machine = setup.machine;
    let directions: Vec<bool> = (machine.axes.iter())
        .map(|a| backlash(a.letter.char()))
        .collect();
    let mut allowed = Allowed::of(machine, &directions);
    allowed.spindle = SPINDLE.to_vec();
    let (candidates, _) = setup.candidates(&allowed);
    if candidates.rows.is_empty() {
        return Vec::new();
    }
    let problem = setup.problem(&candidates, parameters, base);
    let (equations, _) = problem.equations_at(assumed);
    let shown = |i: usize, hidden: &DVector<f64>| (&equations[i] * hidden).norm();
    let remedy = |unknown: Unknown, hidden: &DVector<f64>, indexed: bool| {
        let rows = (0..equations.len()).filter(|i| indexed || candidates.rows[*i].spindle == 0.0);
        let most = rows.max_by(|a, b| {
            let [a, b] = [a, b].map(|i| shown(*i, hidden));
            a.total_cmp(&b)
        })?;
        let mut with = plan.clone();
        let row = candidates.rows[most].clone();
        with.rows.push(row.clone());
        let then = setup
            .problem(&with, parameters, base)
            .foresee(assumed)
            .ok()?;
        let is_seen = then.unseen.iter().all(|u| u.unknown != unknown)
            && then.unseen.len() < foreseen.unseen.len();
        is_seen.then_some(row)
    };
    let each = unseen.into_iter().map(|(unseen, hidden)| Remedy {
        unseen: unseen.unknown,
        // Try without the spindle first, because not every spindle can be indexed.
        add: remedy(unseen.unknown, hidden, false).or_else(|| remedy(unseen.unknown, hidden, true)),
    });
    each.collect()
}

/// The probing that would identify a parameter, as text.
#[must_use]
pub fn added(
    machine: &Machine,
    balls: &[String],
    unseen: Unknown,
    remedies: &[Remedy],
) -> Option<String> {
    let remedy = remedies.iter().find(|r| r.unseen == unseen)?;
    let row = remedy.add.as_ref()?;
    let mut at = Vec::new();
    for (i, axis) in machine.axes.iter().enumerate() {
        if axis.letter.is_rotary() {
            let came = match row.direction[i] {
                d if d > 0.0 => " from below",
                d if d < 0.0 => " from above",
                _ => "",
            };
            at.push(format!("{} = {}{came}", axis.letter, row.position[i]));
        }
    }
    if row.spindle != 0.0 {
        at.push(format!("S = {}", row.spindle));
    }
    Some(format!("ball {} at {}", balls[row.ball], at.join(", ")))
}
