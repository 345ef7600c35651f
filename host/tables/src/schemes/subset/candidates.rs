//! The terms from which a subset is chosen, and the functions that make up their tables.

use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::{Machine, PerAxis};

/// A term that may be chosen: a table of one axis for another, or such a table times the coordinate of a linear
/// axis. The coordinate is a table too, shared by all terms of its output.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Candidate {
    /// Index of the output axis.
    pub output: usize,
    /// The linear axis whose coordinate it is multiplied by.
    pub lever: Option<usize>,
    /// The axis that the table depends on.
    pub input: usize,
}

/// All candidates: every table of one axis for another, and products with coordinates of linear axes. Products of
/// two linear axes are included only if an error motion rotates with one of them.
pub fn candidates(kinematics: &Kinematics<'_>) -> Vec<Candidate> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let axes = || 0..machine.axes.len();
    let rotary = |i: usize| machine.axes[i].letter.is_rotary();
    let turns = |i: usize| errors.motions[i][3..].iter().any(|motion| motion.varies());
    let corrected = |i: &usize| !(rotary(*i) && kinematics.policy == Policy::Position);
    let mut candidates = Vec::new();
    for output in axes().filter(corrected) {
        for input in axes() {
            let one = Candidate {
                output,
                lever: None,
                input,
            };
            candidates.push(one);
            let levers = axes().filter(|lever| !rotary(*lever) && *lever != input);
            let levers = levers.filter(|_| !rotary(output) && (rotary(input) || turns(input)));
            candidates.extend(levers.map(|lever| Candidate {
                lever: Some(lever),
                ..one
            }));
        }
    }
    candidates
}

/// Number of tables of a set of terms: one each, and one for each coordinate of an output.
pub fn tables(chosen: &[Candidate]) -> usize {
    let mut levers: Vec<(usize, usize)> = chosen
        .iter()
        .filter_map(|c| Some((c.output, c.lever?)))
        .collect();
    levers.sort_unstable();
    levers.dedup();
    chosen.len() + levers.len()
}

/// Highest power of a position, as in the document's polynomials.
const DEGREE: i32 = 3;

/// The functions that make up the tables of each axis.
pub struct Functions {
    /// Middle and half width of each range (mm, rad).
    ranges: Vec<[f64; 2]>,
    /// True for a rotary axis.
    turns: Vec<bool>,
    /// True for an axis whose functions are polynomials of its position.
    powers: Vec<bool>,
}

impl Functions {
    /// For a linear axis, the powers of its position up to the third. For a rotary axis, sines and cosines of its
    /// angle and of twice its angle, and also these powers if it has varying error motions.
    pub fn new(kinematics: &Kinematics<'_>) -> Self {
        let machine: &Machine = kinematics.machine;
        let numbered = || machine.axes.iter().enumerate();
        let turns: Vec<bool> = numbered().map(|(_, a)| a.letter.is_rotary()).collect();
        let varies = |i: usize| {
            kinematics.errors.motions[i]
                .iter()
                .any(|motion| motion.varies())
        };
        Self {
            ranges: numbered()
                .map(|(_, axis)| {
                    let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
                    [0.5 * (low + high), 0.5 * (high - low)]
                })
                .collect(),
            powers: numbered()
                .map(|(i, axis)| !turns[i] || (varies(i) && !axis.modulo))
                .collect(),
            turns,
        }
    }

    /// The position of an axis (mm, rad) scaled to −1…1.
    pub fn coordinate(&self, axis: usize, at: f64) -> f64 {
        let [middle, half] = self.ranges[axis];
        (at - middle) / half
    }

    /// The functions of an axis at a position (mm, rad); their number is the same at all positions.
    pub fn of(&self, axis: usize, at: f64) -> Vec<f64> {
        let mut values = vec![1.0];
        if self.turns[axis] {
            for turns in [1.0, 2.0] {
                let (s, c) = libm::sincos(turns * at);
                values.extend([c, s]);
            }
        }
        if self.powers[axis] {
            let x = self.coordinate(axis, at);
            values.extend((1..=DEGREE).map(|k| x.powi(k)));
        }
        values
    }

    /// The functions of a term at a position (mm, rad), times its lever.
    pub fn term(&self, candidate: &Candidate, q: &PerAxis) -> Vec<f64> {
        let mut values = self.of(candidate.input, q[candidate.input]);
        if let Some(lever) = candidate.lever {
            let times = self.coordinate(lever, q[lever]);
            for value in &mut values {
                *value *= times;
            }
        }
        values
    }
}
