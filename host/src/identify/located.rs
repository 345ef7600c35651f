//! Which location errors a machine of any chain has, as far as probings can tell them from each other.

use super::Unknown;
use super::model::direction;
use super::rows::{Problem, Weights};
use crate::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use crate::formats::artefact::{Artefact, Ball};
use crate::formats::probings::{Probing, Probings};
use crate::kinematics::Kinematics;
use crate::machine::{Branch, MAX_AXES, Machine};
use crate::simulate::on_ball;
use nalgebra::{DMatrix, DVector, Vector3};

/// Balls that are looked at, and rotary positions of each: with fewer, what is seen could depend on where they are.
const BALLS: usize = 4;
const POSITIONS: usize = 24;
/// How far balls are from each other (mm).
const APART: f64 = 80.0;
/// What others make up for but for this part, they make up for: columns have a length of 1.
const NEW: f64 = 1e-6;

/// The location errors of a machine, so many that all others do nothing that these, balls and stylus do not do.
///
/// Those of rotary axes come first, from the frame of the machine towards the workpiece, then towards the tool: where an
/// axis lies across its direction, then its tilts. (Zero of an axis is where it is set.) Of linear axes, whose squareness
/// is between two of them, those are taken that are farther from the workpiece, as a part is aligned to the others.
pub(super) fn located(machine: &Machine) -> Vec<Parameter> {
    let (rotary, linear) = axes(machine);
    let across = |axis: char| (0..3).filter(move |k| *k != direction(axis));
    let mut wanted = Vec::new();
    for axis in &rotary {
        wanted.extend(across(*axis).map(|k| inter(k, *axis)));
        wanted.extend(across(*axis).map(|k| inter(3 + k, *axis)));
    }
    for axis in linear.iter().rev() {
        wanted.extend(across(*axis).map(|k| inter(3 + k, *axis)));
    }
    let mut found = independent(machine, &wanted, &[]);
    // Linear axes from the workpiece on.
    let place = |p: &Parameter| {
        linear
            .iter()
            .position(|axis| *axis == p.axis)
            .map_or(0, |i| i + 1)
    };
    found.sort_by_key(place);
    found
}

/// What a list of parameters lacks to do all that location errors do at probings.
#[must_use]
pub fn lacking(machine: &Machine, parameters: &[Parameter]) -> Vec<Parameter> {
    independent(machine, &located(machine), parameters)
}

/// Rotary axes from the frame of the machine towards the workpiece, then towards the tool; linear ones from the
/// workpiece to the tool.
fn axes(machine: &Machine) -> (Vec<char>, Vec<char>) {
    let of = |branch| {
        let axes = machine
            .axes
            .iter()
            .filter(move |axis| axis.branch == branch);
        axes.map(|axis| axis.letter)
    };
    // Both branches are listed from the frame on.
    let all: Vec<_> = of(Branch::Workpiece).chain(of(Branch::Tool)).collect();
    let rotary = all.iter().filter(|letter| letter.is_rotary());
    let mut chain: Vec<_> = of(Branch::Workpiece).collect();
    chain.reverse();
    chain.extend(of(Branch::Tool));
    let linear = chain.iter().filter(|letter| !letter.is_rotary());
    (
        rotary.map(|letter| letter.char()).collect(),
        linear.map(|letter| letter.char()).collect(),
    )
}

/// Those of the wanted parameters, in their order, that do something at probings which balls, stylus, the given ones and
/// those before do not.
fn independent(machine: &Machine, wanted: &[Parameter], given: &[Parameter]) -> Vec<Parameter> {
    let (artefact, strategy) = strategy(machine);
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let tip = Vector3::from(machine.tip);
    let on_ball = |mut row: Probing| {
        let ball = artefact.balls[row.ball].nominal?;
        let q = machine.to_kinematic(&row.position);
        let q = on_ball(&kinematics, &q, &Situation::default(), &tip, &ball)?;
        row.position = machine.to_command(&q);
        Some(row)
    };
    let probed = Probings {
        rows: strategy.rows.into_iter().filter_map(on_ball).collect(),
        balls: strategy.balls,
    };
    let problem = Problem::new(machine, &probed, &artefact, &[], &perfect);
    if problem.places.is_empty() {
        return Vec::new();
    }
    let weights = Weights {
        rows: vec![1.0; problem.places.len()],
        least: 1.0,
    };
    let columns = |unknowns: &[Unknown]| problem.derivatives(unknowns, &problem.start(), &weights);
    let parameters = |list: &[Parameter]| -> Vec<Unknown> {
        list.iter().map(|p| Unknown::Parameter(*p)).collect()
    };
    let mut basis: Vec<DVector<f64>> = Vec::new();
    let mut is_new = |column: DVector<f64>| {
        let length = column.norm();
        let mut rest = if length > 0.0 {
            column / length
        } else {
            column
        };
        // Twice is enough: what the first time leaves is rounding.
        for _ in 0..2 {
            for one in &basis {
                rest -= one * one.dot(&rest);
            }
        }
        let left = rest.norm();
        if left > NEW {
            basis.push(rest / left);
        }
        left > NEW
    };
    let each = |matrix: DMatrix<f64>| -> Vec<DVector<f64>> {
        matrix
            .column_iter()
            .map(|column| column.into_owned())
            .collect()
    };
    for column in each(columns(&problem.unknowns))
        .into_iter()
        .chain(each(columns(&parameters(given))))
    {
        is_new(column);
    }
    let tried = wanted.iter().zip(each(columns(&parameters(wanted))));
    tried
        .filter_map(|(parameter, column)| is_new(column).then_some(*parameter))
        .collect()
}

/// Balls in the middle of the travel, and rotary positions all over it.
fn strategy(machine: &Machine) -> (Artefact, Probings) {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
    let mut at_middle = [0.0; MAX_AXES];
    for (position, axis) in at_middle.iter_mut().zip(&machine.axes) {
        *position = middle(axis.travel);
    }
    let tip = kinematics
        .nominal(&machine.to_kinematic(&at_middle), None)
        .t;
    let apart = [
        Vector3::new(APART, 0.3 * APART, 0.0),
        Vector3::new(-0.2 * APART, APART, 0.1 * APART),
        Vector3::new(-APART, -0.4 * APART, -0.2 * APART),
        Vector3::new(0.3 * APART, -APART, 0.4 * APART),
    ];
    let balls = (1..=BALLS).map(|ball| Ball {
        name: ball.to_string(),
        nominal: Some(tip + apart[ball - 1]),
        away: Vector3::z(),
    });
    let artefact = Artefact {
        balls: balls.collect(),
        ..Artefact::default()
    };
    let mut rows = Vec::new();
    for number in 0..BALLS * POSITIONS {
        let mut position = at_middle;
        let rotary = (0..machine.axes.len()).filter(|i| machine.axes[*i].letter.is_rotary());
        for (i, step) in rotary.zip(STEPS) {
            let [low, high] = machine.axes[i].travel;
            position[i] = low + (high - low) * (number as f64 * step + 0.5).fract();
        }
        rows.push(Probing {
            ball: number % BALLS,
            position,
            direction: [0.0; MAX_AXES],
            spindle: 0.0,
            run: None,
            time: None,
            sigma: None,
            temperature: None,
            line: number + 2,
        });
    }
    let names = artefact.balls.iter().map(|ball| ball.name.clone());
    let balls = names.collect();
    (artefact, Probings { balls, rows })
}

/// Parts of the travel from one position to the next that repeat nowhere, nor together (roots of x⁴ = x + 1: Roberts).
const STEPS: [f64; 3] = [0.819_172_513_396, 0.671_043_606_704, 0.549_700_477_901];

fn inter(component: usize, axis: char) -> Parameter {
    Parameter {
        component,
        axis,
        kind: ParameterKind::Inter,
    }
}
