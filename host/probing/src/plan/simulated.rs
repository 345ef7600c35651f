//! Simulates touches on a machine with known errors.

use super::touch::Probe;
use super::touches::touching;
use crate::probe_file::Spherical;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::instrument::turned;
use trueaxis_identify::simulate::{Disturbances, SimulateError, drifted, three_linear};
use trueaxis_model::errors::Situation;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::normal;

/// Number of bisections of a touch: 30 mm become 30 fm.
const HALVINGS: usize = 50;

/// Axis positions (mm, deg) at which the stylus touches the balls of an artefact along each touch of a plan,
/// which was planned for balls at their `planned` positions; [`Probe::per_ball`] for each row. `lobing` is how the
/// effective radius of the tip depends on the direction. Of the disturbances, noise (of each
/// touch along each linear axis) and drift are applied.
///
/// # Errors
/// [`SimulateError`]: a ball without a position, or one that is not touched.
pub fn simulated_touches(
    kinematics: &Kinematics<'_>,
    planned: &Artefact,
    artefact: &Artefact,
    plan: &Probings,
    probe: &Probe,
    lobing: &Spherical,
    disturbances: &Disturbances,
) -> Result<Vec<PerAxis>, SimulateError> {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(disturbances.seed);
    let tip = artefact.stylus.place(machine);
    let last = (plan.rows.len().max(2) - 1) as f64;
    let mut touched = Vec::new();
    for (number, row) in plan.rows.iter().enumerate() {
        let name = &plan.balls[row.ball];
        let place = |artefact: &Artefact| {
            let ball = artefact.balls.iter().find(|b| b.name == *name)?;
            Some((ball.clone(), ball.nominal?))
        };
        let missing = || SimulateError::NoPlace { ball: name.clone() };
        let (ball, _) = place(planned).ok_or_else(missing)?;
        let (_, centre) = place(artefact).ok_or_else(missing)?;
        let part = number as f64 / last;
        let centre = centre + drifted(disturbances.drift, disturbances.drift_lag, part);
        let not_reached = || SimulateError::NotReached {
            line: row.line,
            ball: name.clone(),
        };
        let way = touching(machine, planned, &ball, row, probe).map_err(|_| not_reached())?;
        let turn = turned(machine.tool_axis, row.spindle);
        let tip = turn * tip;
        let situation = Situation {
            sign: row.direction,
            ..Situation::default()
        };
        let is_free = |position: &PerAxis| {
            let q = machine.to_kinematic(position);
            let found = kinematics.sensitivity(&q, &situation, &tip);
            let way = found.point - centre;
            let own = (kinematics.nominal(&q, None).r * turn).transpose() * way.normalize();
            let [around, height] = Spherical::direction(machine, &tip, &own);
            way.norm() > probe.radius + lobing.deviation(around, height)
        };
        for touch in &way.touches {
            let mut position =
                between(&touch.begin, &touch.end, is_free).ok_or_else(not_reached)?;
            disturb(machine, &mut position, disturbances.noise, &mut random);
            touched.push(position);
        }
    }
    assert_eq!(touched.len(), probe.per_ball() * plan.rows.len());
    Ok(touched)
}

/// The first position along a path that is not free.
fn between(begin: &PerAxis, end: &PerAxis, is_free: impl Fn(&PerAxis) -> bool) -> Option<PerAxis> {
    if !is_free(begin) || is_free(end) {
        return None;
    }
    let at = |part: f64| std::array::from_fn(|i| begin[i] + part * (end[i] - begin[i]));
    let (mut free, mut blocked) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (free + blocked);
        if is_free(&at(middle)) {
            free = middle;
        } else {
            blocked = middle;
        }
    }
    Some(at(blocked))
}

fn disturb(machine: &Machine, position: &mut PerAxis, noise: f64, random: &mut Pcg64Mcg) {
    for i in three_linear(machine).into_iter().flatten() {
        position[i] += noise * normal(random);
    }
}

/// The log of touches as LinuxCNC writes it: X Y Z A B C U V W, with six decimals.
#[must_use]
pub fn touch_log(machine: &Machine, touches: &[PerAxis]) -> String {
    let line = |position: &PerAxis| {
        let of = |letter| machine.index(letter).map_or(0.0, |i| position[i]);
        let words: Vec<String> = "XYZABCUVW"
            .chars()
            .map(|l| format!("{:.6}", of(l)))
            .collect();
        words.join(" ") + "\n"
    };
    touches.iter().map(line).collect()
}
