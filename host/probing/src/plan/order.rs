//! The order in which a plan is probed.

use trueaxis_identify::formats::probings::Probing;
use trueaxis_model::machine::Machine;

/// Travel of a linear axis (mm) in the time of a degree of a rotary one, at the runtime's default maximum speeds,
/// 500 mm/s and 180 °/s.
const MM_PER_DEGREE: f64 = 500.0 / 180.0;
/// Number of passes over all places where a section can be reversed.
const ROUNDS: usize = 50;

/// Distance from one probing to the next (deg).
fn distance(machine: &Machine, a: &Probing, b: &Probing) -> f64 {
    let turned = (a.spindle - b.spindle).abs();
    let moved = machine.axes.iter().zip(a.position.iter().zip(b.position));
    let moved = moved.map(|(axis, (a, b))| {
        let scale = if axis.letter.is_rotary() {
            1.0
        } else {
            MM_PER_DEGREE
        };
        (a - b).abs() / scale
    });
    moved.sum::<f64>() + turned
}

/// The rows in an order with short moves: starting near zero, always to the nearest next row; then sections are
/// reversed as long as that shortens the path.
pub(super) fn ordered(machine: &Machine, mut rows: Vec<Probing>) -> Vec<Probing> {
    let to = |a: &Probing, b: &Probing| distance(machine, a, b);
    let turned = |row: &Probing| {
        let axes = machine.axes.iter().zip(row.position);
        let rotary = axes.filter(|(axis, _)| axis.letter.is_rotary());
        rotary.map(|(_, p)| p.abs()).sum::<f64>() + row.spindle.abs()
    };
    for place in 0..rows.len() {
        let rest = place..rows.len();
        let next = match place.checked_sub(1) {
            None => rest.min_by(|a, b| turned(&rows[*a]).total_cmp(&turned(&rows[*b]))),
            Some(last) => rest.min_by(|a, b| {
                let [a, b] = [a, b].map(|i| to(&rows[last], &rows[*i]));
                a.total_cmp(&b)
            }),
        };
        if let Some(next) = next {
            rows.swap(place, next);
        }
    }
    for _ in 0..ROUNDS {
        let mut shorter = false;
        for i in 1..rows.len() {
            for j in i + 1..rows.len() {
                let before = to(&rows[i - 1], &rows[i]);
                let after = to(&rows[i - 1], &rows[j]);
                let (before, after) = match rows.get(j + 1) {
                    Some(next) => (before + to(&rows[j], next), after + to(&rows[i], next)),
                    None => (before, after),
                };
                if after < before - 1e-9 {
                    rows[i..=j].reverse();
                    shorter = true;
                }
            }
        }
        if !shorter {
            break;
        }
    }
    rows
}

/// Repeats the first row `count` times, evenly distributed and the last time at the end, and numbers the runs.
pub(super) fn repeated(rows: Vec<Probing>, count: usize) -> Vec<Probing> {
    let Some(first) = rows.first().cloned().filter(|_| count > 0) else {
        return rows;
    };
    let total = rows.len();
    let mut all = Vec::new();
    let mut run = 1;
    for (i, mut row) in rows.into_iter().enumerate() {
        row.run = Some(1.0);
        all.push(row);
        if (i + 1) * count / total >= run {
            run += 1;
            all.push(Probing {
                run: Some(run as f64),
                ..first.clone()
            });
        }
    }
    all
}
