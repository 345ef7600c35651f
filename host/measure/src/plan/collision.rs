//! Whether the stylus meets a ball on its way from one touch to the next.

use super::candidates::Setup;
use super::steps::{Step, Target};
use super::touches::{KEPT, apart};
use crate::formats::probings::Probings;
use nalgebra::Vector3;
use trueaxis_kinematics::Nominal;
use trueaxis_model::machine::{Machine, PerAxis};

/// A move on which the stylus would come too close to a ball.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error(
    "on the way to ball {towards} (line {line} of the strategy) the stylus would pass ball {ball} at {apart:.1} mm from its surface, at {at}"
)]
pub struct Collision {
    /// Line of the row that the move leads to or from.
    pub line: usize,
    /// The ball of that row.
    pub towards: String,
    /// The ball that it would meet.
    pub ball: String,
    /// Distance of the surfaces (mm); less than 0 in each other.
    pub apart: f64,
    /// Axis positions.
    pub at: String,
}

/// Distance of two looks at a move (mm, degrees).
const STEP: f64 = 2.0;

/// The first move of `steps`, which are those of `strategy`, on which the stylus, from its tip to the spindle as thick as
/// its tip, comes closer to a ball than the clearance. Near the ball that is touched, it only must not touch it. Posts,
/// table and fixtures are not known, nor is where the machine starts.
#[must_use]
pub fn collision(setup: &Setup<'_>, strategy: &Probings, steps: &[Step]) -> Option<Collision> {
    let machine = setup.machine;
    let nominal = Nominal::new(machine);
    let length = Vector3::from(machine.tip).norm();
    let mut at: Vec<Option<f64>> = vec![None; machine.axes.len()];
    let mut row = 0;
    for step in steps {
        let (to, is_near) = match step {
            Step::Row(number) => {
                row = *number;
                continue;
            }
            Step::Orient(_) => continue,
            Step::Rapid(to) => (to, false),
            Step::Near(to) => (to, true),
            Step::Touch { begin, .. } => (begin, true),
        };
        let row = &strategy.rows[row];
        let own = &strategy.balls[row.ball];
        for position in way(&at, to) {
            let q = machine.to_kinematic(&position);
            let pose = nominal.pose(&q, None);
            let tip: Vector3<f64> = pose.t;
            let up = Vector3::from(machine.direction(&pose));
            for ball in &setup.artefact.balls {
                let Some(centre) = ball.nominal else { continue };
                let apart = apart(&(centre - tip), &up, length) - setup.probe.radius;
                let wanted = match is_near && ball.name == *own {
                    true => 0.0,
                    false => KEPT * setup.probe.clearance,
                };
                if apart < wanted {
                    return Some(Collision {
                        line: row.line,
                        towards: own.clone(),
                        ball: ball.name.clone(),
                        apart,
                        at: named(machine, &position),
                    });
                }
            }
        }
        for (axis, position) in to {
            at[*axis] = Some(*position);
        }
    }
    None
}

/// Positions along a move, without its start; none while the place of an axis is unknown.
fn way(from: &[Option<f64>], to: &Target) -> Vec<PerAxis> {
    let Some(start) = from.iter().copied().collect::<Option<Vec<f64>>>() else {
        return Vec::new();
    };
    let longest = (to.iter())
        .map(|(axis, end)| (end - start[*axis]).abs())
        .fold(0.0, f64::max);
    let count = (longest / STEP).ceil().max(1.0);
    let look = |k: usize| {
        let mut position = PerAxis::default();
        position[..start.len()].copy_from_slice(&start);
        for (axis, end) in to {
            position[*axis] += (end - start[*axis]) * (k as f64 / count);
        }
        position
    };
    (1..=count as usize).map(look).collect()
}

fn named(machine: &Machine, position: &PerAxis) -> String {
    let axes = machine.axes.iter().zip(position);
    let words: Vec<String> = axes
        .map(|(axis, at)| format!("{} = {at:.1}", axis.letter))
        .collect();
    words.join(", ")
}
