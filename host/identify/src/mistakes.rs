//! Detects common mistakes in a whole file of probings by trying alternatives.

use crate::descent::setup_alone;
use crate::rows::by_row;
use crate::rows::{EquationWeights, ProbingRow, Problem};
use crate::units::UNITS;
use crate::{IdentifyError, root_mean_square};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};
use trueaxis_model::numbers::by;

/// A change with which the file would fit the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Mistake {
    /// What is wrong, as a clause.
    pub what: String,
    /// What to do about it.
    pub remedy: String,
}

/// Mistakes are searched if balls and stylus alone, fitted to the nominal machine, leave more than this (mm, root
/// mean square distance). No errors of a working machine do as much.
pub(crate) const GROSS: f64 = 0.3;
/// An interpretation explains a file if it leaves no more than this fraction.
pub(crate) const EXPLAINS: f64 = 0.2;
/// Interpretations that leave up to this many times as much as the best one are equally plausible.
const ALIKE: f64 = 2.0;
/// A stated coordinate is wrong if it is off by more than this many times its standard uncertainty, and by more (mm)
/// than a stylus may be that is found on a machine with errors.
const WRONG: f64 = 10.0;
const FOUND: f64 = 0.05;
/// If linear axes stay within this (mm) while rotary ones turn by this (rad), their positions are not those of the
/// machine.
const STAYS: f64 = 1.0;
const TURNS: f64 = 0.3;
/// Number of angles tried as the zero of a rotary axis, and number of refinements.
const ANGLES: usize = 72;
const NEARER: usize = 25;

/// Refuses a file that fits the machine only if it is interpreted differently.
pub(crate) fn refuse(problem: &Problem<'_>) -> Result<(), IdentifyError> {
    // Observations have set-ups that would take in part of a mistake.
    match found(&problem.of_probings()) {
        Some(mistake) => Err(IdentifyError::Mistake(mistake)),
        None => Ok(()),
    }
}

fn found(problem: &Problem<'_>) -> Option<Mistake> {
    if problem.places.is_empty() {
        return None;
    }
    let at_first = left(problem)?;
    if at_first < GROSS {
        return None;
    }
    if stays(problem) {
        return Some(Mistake {
            what: "the linear axes hardly move while rotary axes turn: these are positions of the tool against the workpiece (tool centre point control was on)".to_owned(),
            remedy: "write the positions of the machine's axes".to_owned(),
        });
    }
    let mut tried: Vec<(Mistake, Problem<'_>, f64)> = (readings(problem).into_iter())
        .filter_map(|(mistake, other)| {
            let left = left(&other)?;
            Some((mistake, other, left))
        })
        .collect();
    let zeros = rotary(problem).into_iter();
    tried.extend(zeros.map(|axis| other_zero(problem, axis)));
    let least = (tried.iter())
        .map(|(_, _, left)| *left)
        .fold(f64::INFINITY, f64::min);
    if least > EXPLAINS * at_first {
        return None;
    }
    // A mirrored machine can be mirrored in several ways: choose the one that puts the balls where they are stated.
    tried.retain(|(_, _, left)| *left < ALIKE * least);
    let place = |other: &Problem<'_>| setup(other).and_then(|balls| off(other, &balls));
    let nearest =
        |(_, other, left): &(Mistake, Problem<'_>, f64)| (place(other).unwrap_or(0.0), *left);
    let order = |a: &(f64, f64), b: &(f64, f64)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1));
    let best = tried.iter().min_by(|a, b| order(&nearest(a), &nearest(b)));
    best.map(|(mistake, _, _)| mistake.clone())
}

/// The zero of a rotary axis with which the rows fit best.
fn other_zero<'a>(problem: &Problem<'a>, axis: usize) -> (Mistake, Problem<'a>, f64) {
    let (angle, rest) = zero(problem, axis);
    let letter = problem.machine.axes[axis].letter;
    let mistake = Mistake {
        what: format!(
            "the rows fit if zero of {letter} is {:.2}° from where the machine file has it",
            angle.to_degrees()
        ),
        remedy: format!(
            "correct the origin of the column {letter}, or orientation_deg of {letter} in the machine file"
        ),
    };
    (mistake, turned(problem, axis, angle), rest)
}

/// Alternative interpretations of the file.
fn readings<'a>(problem: &Problem<'a>) -> Vec<(Mistake, Problem<'a>)> {
    let axes = &problem.machine.axes;
    let mut all: Vec<_> = (0..axes.len())
        .flat_map(|i| readings_of_axis(problem, i))
        .collect();
    for (unit, mm) in UNITS {
        all.push(reading(
            problem,
            format!("the rows fit if linear positions are in {unit}"),
            "write them in mm".to_owned(),
            &|place| {
                for (q, axis) in place.q.iter_mut().zip(axes) {
                    *q *= if axis.letter.is_rotary() { 1.0 } else { mm };
                }
            },
        ));
    }
    all.push(of_other_rows(problem, "before"));
    all.push(of_other_rows(problem, "after"));
    all
}

/// The rows as they would have to be read, given a mistake in the file.
fn reading<'a>(
    problem: &Problem<'a>,
    what: String,
    remedy: String,
    change: &dyn Fn(&mut ProbingRow),
) -> (Mistake, Problem<'a>) {
    let mut other = problem.clone();
    other.places.iter_mut().for_each(change);
    (Mistake { what, remedy }, other)
}

/// The positions of one axis with another sign, in another unit, or exchanged with those of a later axis.
fn readings_of_axis<'a>(problem: &Problem<'a>, i: usize) -> Vec<(Mistake, Problem<'a>)> {
    let axes = &problem.machine.axes;
    let letter = axes[i].letter;
    let mut all = Vec::new();
    let mut add = |what: String, remedy: String, change: &dyn Fn(&mut ProbingRow)| {
        all.push(reading(problem, what, remedy, change));
    };
    add(
        format!("the rows fit if {letter} counts the other way"),
        format!(
            "correct the sign of the column {letter}, or `reversed` of {letter} in the machine file (trueaxis pose shows which way it goes)"
        ),
        &|place| place.q[i] = -place.q[i],
    );
    if letter.is_rotary() {
        add(
            format!("the rows fit if {letter} is in radians"),
            format!("write {letter} in degrees"),
            &|place| place.q[i] = place.q[i].to_degrees(),
        );
    } else {
        for (unit, mm) in UNITS {
            add(
                format!("the rows fit if {letter} is in {unit}"),
                format!("write {letter} in mm"),
                &|place| place.q[i] *= mm,
            );
        }
    }
    let later = axes.iter().enumerate().skip(i + 1);
    for (j, other) in later.filter(|(_, a)| a.letter.is_rotary() == letter.is_rotary()) {
        let other = other.letter;
        add(
            format!("the rows fit if the columns {letter} and {other} are exchanged"),
            "correct the header".to_owned(),
            &|place| place.q.swap(i, j),
        );
    }
    all
}

/// Rotary positions of the row before or after each.
fn of_other_rows<'a>(problem: &Problem<'a>, word: &str) -> (Mistake, Problem<'a>) {
    let of_row = by_row(&problem.places);
    let mut other = problem.clone();
    for pair in of_row.windows(2) {
        let (to, from) = match word {
            "before" => (pair[1], pair[0]),
            _ => (pair[0], pair[1]),
        };
        for axis in rotary(problem) {
            other.places[to].q[axis] = problem.places[from].q[axis];
        }
    }
    let mistake = Mistake {
        what: format!("the rows fit if each has the rotary positions of the row {word} it"),
        remedy: "write the positions of all axes at the moment of the probing into its row"
            .to_owned(),
    };
    (mistake, without_ends(other))
}

/// Removes the first and the last row, which have no neighbour on one side.
fn without_ends(mut problem: Problem<'_>) -> Problem<'_> {
    let last = problem.places.iter().map(|place| place.row).max();
    problem
        .places
        .retain(|place| place.row != 0 && Some(place.row) != last);
    problem
}

fn rotary(problem: &Problem<'_>) -> Vec<usize> {
    let axes = &problem.machine.axes;
    (0..axes.len())
        .filter(|i| axes[*i].letter.is_rotary())
        .collect()
}

/// Residual with only balls and stylus fitted (mm); `None` if they cannot be fitted.
fn left(problem: &Problem<'_>) -> Option<f64> {
    let weights = EquationWeights {
        rows: vec![1.0; problem.places.len()],
        least: f64::INFINITY,
    };
    let alone = problem.of_setup();
    if alone.can_be_solved().is_err() {
        return None;
    }
    let setup = setup_alone(&alone, &weights).ok()?;
    let left = root_mean_square(problem.misses(&setup).iter().map(Vector3::norm));
    left.is_finite().then_some(left)
}

/// Adds an angle (rad) to a rotary axis.
fn turned<'a>(problem: &Problem<'a>, axis: usize, angle: f64) -> Problem<'a> {
    let mut other = problem.clone();
    for place in &mut other.places {
        place.q[axis] += angle;
    }
    other
}

/// The zero (rad) of a rotary axis with the smallest residual, and that residual.
fn zero(problem: &Problem<'_>, axis: usize) -> (f64, f64) {
    let at = |angle: f64| {
        let left = left(&turned(problem, axis, angle));
        (angle, left.unwrap_or(f64::INFINITY))
    };
    let step = TAU / ANGLES as f64;
    let all = (0..ANGLES).map(|k| at(k as f64 * step - PI));
    let mut best = all
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((0.0, f64::INFINITY));
    let mut step = step / 2.0;
    for _ in 0..NEARER {
        let beside = [at(best.0 - step), at(best.0 + step)];
        let nearer = beside.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
        best = nearer.filter(|nearer| nearer.1 < best.1).unwrap_or(best);
        step /= 2.0;
    }
    best
}

/// True if linear axes do not move while rotary ones turn, at every ball.
fn stays(problem: &Problem<'_>) -> bool {
    let spread = |axis: usize, ball: usize| {
        let of_ball = problem.places.iter().filter(|place| place.ball == ball);
        let (low, high) = of_ball.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| {
            (low.min(place.q[axis]), high.max(place.q[axis]))
        });
        high - low
    };
    let axes = &problem.machine.axes;
    let turning = rotary(problem);
    (0..problem.balls.len()).all(|ball| {
        let linear = (0..axes.len()).filter(|i| !axes[*i].letter.is_rotary());
        linear.map(|i| spread(i, ball)).fold(0.0, f64::max) < STAYS
    }) && (turning.iter()).any(|i| (0..problem.balls.len()).any(|ball| spread(*i, ball) > TURNS))
}

/// Checks a stated stylus that does not fit the rows, coordinate by coordinate, against a fit without it.
pub(crate) fn stylus(problem: &Problem<'_>, found: &Vector3<f64>) -> Option<IdentifyError> {
    let stated = problem.stated_stylus();
    let wrong = problem.known_coordinates().find(|(i, sigma)| {
        let off = (found[*i] - stated[*i]).abs();
        off > (WRONG * sigma).max(FOUND)
    })?;
    let (i, sigma) = wrong;
    Some(IdentifyError::Mistake(Mistake {
        what: format!(
            "the rows fit without the stated stylus, which is {:.3} ± {sigma:.3} mm in {} but {:.3} in the probings",
            stated[i],
            ['x', 'y', 'z'][i],
            found[i]
        ),
        remedy: "correct [stylus] in the artefact, or leave its uncertainty out".to_owned(),
    }))
}

/// What would put the balls at their stated places: exchanged names, or axes with reversed direction, which the rows
/// alone cannot show.
pub(crate) fn places(problem: &Problem<'_>) -> Option<Mistake> {
    let problem = &problem.of_probings();
    let places = setup(problem)?;
    let at_first = off(problem, &places)?;
    for a in 0..places.len() {
        for b in 0..a {
            let mut exchanged = places.clone();
            exchanged.swap(a, b);
            if off(problem, &exchanged)? < EXPLAINS * at_first {
                let mut names = [a, b].map(|ball| &problem.balls[ball]);
                names.sort();
                let [a, b] = names;
                return Some(Mistake {
                    what: format!("the places fit if balls {a} and {b} are exchanged"),
                    remedy: "correct the names in the probings or in the artefact".to_owned(),
                });
            }
        }
    }
    let fits = |set: u32| -> Option<f64> {
        let other = mirrored(problem, set);
        if left(&other)? > GROSS {
            return None;
        }
        off(problem, &setup(&other)?)
    };
    let set = sets(problem)
        .into_iter()
        .find(|set| fits(*set).is_some_and(|off| off < EXPLAINS * at_first))?;
    let letters = letters(problem, set);
    Some(Mistake {
        what: format!("the places fit if {letters} count the other way"),
        remedy: format!(
            "correct the signs of the columns {letters}, or `reversed` of these axes in the machine file"
        ),
    })
}

/// All sets of axes, as bits, few axes before many.
fn sets(problem: &Problem<'_>) -> Vec<u32> {
    let sets = (1..1 << problem.machine.axes.len()).collect();
    by(sets, |set: &u32| f64::from(set.count_ones()))
}

/// The problem with axes that count the other way.
fn mirrored<'a>(problem: &Problem<'a>, set: u32) -> Problem<'a> {
    let mut other = problem.clone();
    for place in &mut other.places {
        for (i, q) in place.q.iter_mut().enumerate() {
            *q = if set >> i & 1 == 1 { -*q } else { *q };
        }
    }
    other
}

/// The letters of a set of axes.
fn letters(problem: &Problem<'_>, set: u32) -> String {
    let axes = problem.machine.axes.iter().enumerate();
    let letters = axes.filter(|(i, _)| set >> i & 1 == 1);
    let letters: Vec<String> = letters.map(|(_, axis)| axis.letter.to_string()).collect();
    letters.join(" and ")
}

/// The fewest axes that may all count the other way for all that probings show, if no place of a ball is stated.
#[must_use]
pub fn unseen_senses(problem: &Problem<'_>) -> Option<String> {
    let problem = &problem.of_probings();
    if problem.places.is_empty() || problem.stated_balls().iter().any(Option::is_some) {
        return None;
    }
    let at_first = left(problem)?;
    let fits =
        |set: &u32| left(&mirrored(problem, *set)).is_some_and(|left| left < ALIKE * at_first);
    let set = sets(problem).into_iter().find(fits)?;
    Some(letters(problem, set))
}

/// Positions of the balls on the nominal machine (mm).
fn setup(problem: &Problem<'_>) -> Option<Vec<Vector3<f64>>> {
    let weights = EquationWeights {
        rows: vec![1.0; problem.places.len()],
        least: f64::INFINITY,
    };
    Some(setup_alone(&problem.of_setup(), &weights).ok()?.balls)
}

/// Distance of balls from their stated places (mm, root mean square); `None` if none is stated.
fn off(problem: &Problem<'_>, balls: &[Vector3<f64>]) -> Option<f64> {
    let both = balls.iter().zip(problem.stated_balls());
    let off: Vec<f64> = both
        .filter_map(|(ball, stated)| Some((ball - (*stated)?).norm()))
        .collect();
    (!off.is_empty()).then(|| root_mean_square(off.iter().copied()))
}
