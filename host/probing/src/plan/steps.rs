//! A plan as the moves of a machine, for a program or for a controller that is driven move by move.

use super::candidates::{RUN_UP, Setup};
use super::course::Course;
use super::step::{AxisTargets, ProbingStep};
use super::touch::Touching;
use super::touches::{SPARE, Unreachable};
use std::slice;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_model::machine::{Machine, PerAxis};

/// A row that cannot be touched, with the reason.
pub type NotTouched = Box<(Probing, Unreachable)>;

/// All touches of a plan, row by row.
///
/// # Errors
/// The first row that cannot be touched.
pub(super) fn touchings(setup: &Setup<'_>, plan: &Probings) -> Result<Vec<Touching>, NotTouched> {
    let setup = setup.of_plan(plan);
    let rows = plan.rows.iter();
    rows.map(|row| setup.touching(row).map_err(|e| Box::new((row.clone(), e))))
        .collect()
}

/// Some axes of a position.
pub(super) fn target(
    machine: &Machine,
    position: &PerAxis,
    is_in: impl Fn(usize) -> bool,
) -> AxisTargets {
    let in_order = "XYZABCUVW"
        .chars()
        .filter_map(|letter| machine.index(letter));
    in_order
        .filter(|i| is_in(*i))
        .map(|i| (i, position[i]))
        .collect()
}

/// The moves of a plan: five touches for each row. Axes turn as far from the balls as the travel allows, on the
/// first of a dozen ways on which nothing meets.
///
/// # Errors
/// The first row that cannot be touched.
pub fn steps(setup: &Setup<'_>, plan: &Probings) -> Result<Vec<ProbingStep>, NotTouched> {
    let machine = setup.machine;
    let touchings = touchings(setup, plan)?;
    let is_linear = |i: usize| !machine.axes[i].letter.is_rotary();
    let indexes = plan.rows.iter().any(|r| r.spindle != 0.0);
    let linear = |position: &PerAxis| target(machine, position, is_linear);
    let mut steps = Vec::new();
    let mut course = Course::new(setup);
    let (mut last, mut came, mut turned) = (None, PerAxis::default(), None);
    for (number, (row, touching)) in plan.rows.iter().zip(&touchings).enumerate() {
        let Touching { away, above, .. } = touching;
        let begin = steps.len();
        steps.push(ProbingStep::Row(number));
        if last.is_none() {
            // First move away from the table, wherever the spindle starts.
            let up = |i: usize| is_linear(i) && (away[i] - above[i]).abs() > 1e-6;
            steps.push(ProbingStep::Rapid(target(machine, away, up)));
        }
        let mut turn = turns(machine, row, away, last.as_ref(), &came);
        for i in (0..machine.axes.len()).filter(|i| row.direction[*i] != 0.0) {
            came[i] = row.direction[i];
        }
        let spindle = row.spindle.rem_euclid(360.0);
        if indexes && turned.replace(spindle) != Some(spindle) {
            turn.push(ProbingStep::Orient(spindle));
        }
        course.follow(&steps[begin..]);
        let begin = steps.len();
        let mut ways = ways(machine, &turn, away);
        let ball = &plan.balls[row.ball];
        let way = ways.iter().position(|way| course.is_clear(way, ball));
        // If there is none, `collision` finds what meets on the usual one.
        steps.append(&mut ways.swap_remove(way.unwrap_or(0)));
        steps.extend(touch_moves(touching, linear));
        steps.push(ProbingStep::Rapid(linear(away)));
        last = Some(*away);
        course.follow(&steps[begin..]);
    }
    Ok(steps)
}

/// The turns of rotary axes to a row, each from the direction that the row asks for. Axes were moved last in the directions
/// `came`.
fn turns(
    machine: &Machine,
    row: &Probing,
    away: &PerAxis,
    last: Option<&PerAxis>,
    came: &PerAxis,
) -> Vec<ProbingStep> {
    let is_rotary = |i: usize| machine.axes[i].letter.is_rotary();
    let needs = |i: usize| {
        let stays = last.is_some_and(|last| (last[i] - away[i]).abs() < 1e-6);
        let comes = match last {
            Some(last) if !stays => (away[i] - last[i]).signum(),
            _ => came[i],
        };
        is_rotary(i) && row.direction[i] != 0.0 && comes != row.direction[i]
    };
    let mut turn = Vec::new();
    if (0..machine.axes.len()).any(needs) {
        let first: PerAxis = std::array::from_fn(|i| away[i] - row.direction[i] * RUN_UP);
        turn.push(ProbingStep::Rapid(target(machine, &first, needs)));
    }
    if (0..machine.axes.len()).any(is_rotary) {
        turn.push(ProbingStep::Rapid(target(machine, away, is_rotary)));
    }
    turn
}

/// Down to the ball, each touch, for those beside the ball with the way there and back, and up again.
fn touch_moves(touching: &Touching, linear: impl Fn(&PerAxis) -> AxisTargets) -> Vec<ProbingStep> {
    let above = ProbingStep::Near(linear(&touching.above));
    let mut steps = vec![above.clone()];
    for (number, touch) in touching.touches.iter().enumerate() {
        let [over, begin, end] = [&touch.over, &touch.begin, &touch.end].map(&linear);
        if number > 0 {
            steps.push(ProbingStep::Near(over.clone()));
            steps.push(ProbingStep::Near(begin.clone()));
        }
        steps.push(ProbingStep::Touch {
            number,
            begin: begin.clone(),
            end,
        });
        steps.push(ProbingStep::Near(begin));
        if number > 0 {
            steps.push(ProbingStep::Near(over));
        }
    }
    steps.push(above);
    steps
}

/// Ways from where the last row ended to where the stylus is far from the next ball, the usual one first: turn, then move;
/// move, then turn; turn one axis after the other; turn in a corner of the linear travel.
fn ways(machine: &Machine, turn: &[ProbingStep], away: &PerAxis) -> Vec<Vec<ProbingStep>> {
    let is_linear = |i: usize| !machine.axes[i].letter.is_rotary();
    let to = ProbingStep::Rapid(target(machine, away, is_linear));
    let mut ways = vec![
        [turn, slice::from_ref(&to)].concat(),
        [slice::from_ref(&to), turn].concat(),
    ];
    let single = |order: fn(&mut AxisTargets)| -> Vec<ProbingStep> {
        let each = turn.iter().flat_map(|step| match step {
            ProbingStep::Rapid(target) => {
                let mut target = target.clone();
                order(&mut target);
                (target.into_iter())
                    .map(|one| ProbingStep::Rapid(vec![one]))
                    .collect()
            }
            other => vec![other.clone()],
        });
        each.chain([to.clone()]).collect()
    };
    ways.push(single(|_| ()));
    ways.push(single(|target| target.reverse()));
    let linear: Vec<usize> = (0..machine.axes.len()).filter(|i| is_linear(*i)).collect();
    for corner in 0..1_usize << linear.len() {
        let mut at = *away;
        for (number, axis) in linear.iter().enumerate() {
            let [low, high] = machine.axes[*axis].travel;
            at[*axis] = match corner >> number & 1 {
                1 => (high - SPARE).max(low),
                _ => (low + SPARE).min(high),
            };
        }
        let there = ProbingStep::Rapid(target(machine, &at, is_linear));
        ways.push([slice::from_ref(&there), turn, slice::from_ref(&to)].concat());
    }
    ways
}
