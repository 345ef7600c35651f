//! Probings that show what a compensation does where nothing was identified.

use super::candidates::{Allowed, Setup};
use super::collision::obstructed;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_model::numbers::extremes;

/// Random positions of each rotary axis from which rows are taken.
const POSITIONS: usize = 12;

/// Up to `count` reachable rows at random positions of the rotary axes, between those of a plan, evenly over its
/// balls, ordered by position; none on a machine without rotary axes, where a ball is only ever at one place.
#[must_use]
pub fn validation(setup: &Setup<'_>, plan: &Probings, count: usize, seed: u64) -> Probings {
    let setup = &setup.of_plan(plan);
    let machine = setup.machine;
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let none = vec![false; machine.axes.len()];
    let mut allowed = Allowed::of(machine, &none);
    for (i, axis) in machine.axes.iter().enumerate() {
        if axis.letter.is_rotary() {
            let [low, high] = extremes(plan.rows.iter().map(|row| row.position[i]));
            allowed.axes[i] = match low < high {
                true => (0..POSITIONS)
                    .map(|_| drawn(&mut random, [low, high]))
                    .collect(),
                false => vec![low],
            };
        }
    }
    allowed.spindle = vec![0.0];
    let (mut found, _) = setup.candidates(&allowed);
    if !machine.axes.iter().any(|axis| axis.letter.is_rotary()) {
        found.rows.clear();
    }
    let mut taken = Vec::new();
    let mut rows = found.rows;
    for ball in (0..setup.balls.len()).cycle().take(count) {
        if let Some(row) = rows.iter().position(|row| row.ball == ball) {
            taken.push(rows.remove(row));
        }
    }
    let order = |a: &Probing, b: &Probing| a.position.partial_cmp(&b.position);
    taken.sort_by(|a, b| order(a, b).unwrap_or(std::cmp::Ordering::Equal));
    found.rows = taken;
    while let Some(row) = obstructed(setup, &found) {
        found.rows.remove(row);
    }
    found
}

/// In tenths of a degree; nothing was planned beyond these ends, where fixtures may stand.
fn drawn(random: &mut Pcg64Mcg, [low, high]: [f64; 2]) -> f64 {
    let part: f64 = random.random();
    ((low + part * (high - low)) * 10.0).trunc() / 10.0
}
