//! The scheme `trigo23`: 23 tables, with trigonometric functions of one rotary axis as factors.
//!
//! Source document, Chapter 6. Eq. 44, in its letters: with `A` the rotary axis and I one of X, Y, Z,
//! Δq_I = a + q_X·f(A) + q_Y·g(A) + q_Z·h(A), and Δq of the rotary axes one such function each, where f, g and h
//! are sums of 1, cos, sin, cos·sin, sin² and cos². Eq. 45 makes 23 tables of it: 7 for each linear axis,
//! LUT₁ + LUT₂·LUT₃ + LUT₄·LUT₅ + LUT₆·LUT₇, and one for each rotary axis.
//!
//! sin² + cos² is 1, so one of the six is left out. In the printed form LUT₁, LUT₈ and LUT₁₅ are constants; they
//! can be any function of A without a table more, which is the free form.

use super::blank::blank;
use super::lattice::Lattice;
use super::moments::{Moments, SAMPLED};
use super::points::Points;
use super::{Found, Options, SchemeError};
use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{MAX_AXES, Machine, PerAxis};
use nalgebra::DVector;
use trueaxis::{Draft, DraftBank, SampleFormat, Term};

/// Points of each table, unless told otherwise (section 6.5.3).
pub const POINTS: usize = 10;
/// Functions of the rotary axis: 1, cos, sin, cos·sin, sin².
const FUNCTIONS: usize = 5;
/// Positions along each linear axis over which the free functions are means: of corrections that are cubic in
/// them, 4 give the same as more.
const MEANS: usize = 4;

/// What this scheme is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// LUT₁, LUT₈ and LUT₁₅ are free functions of the rotary axis, not constants.
    pub free: bool,
    /// Positions along each axis of the grid that it is fitted on.
    pub nodes: usize,
}

/// 1, cos, sin, cos·sin, sin² of an angle (rad).
fn functions(angle: f64) -> [f64; FUNCTIONS] {
    let (s, c) = angle.sin_cos();
    [1.0, c, s, c * s, s * s]
}

/// The functions that are fitted: those of both rotary axes, alone and times each linear position.
struct Basis {
    linear: Vec<usize>,
    rotary: Vec<usize>,
    /// Middle and half of the travel of each linear axis (mm): what counts is the position over the half.
    middle: PerAxis,
    half: PerAxis,
    /// Positions are counted from the middle: their mean is 0 whatever the angle.
    centred: bool,
}

impl Basis {
    fn new(machine: &Machine, centred: bool) -> Self {
        let axes = |rotary: bool| {
            let all = 0..machine.axes.len();
            all.filter(move |i| machine.axes[*i].letter.is_rotary() == rotary)
        };
        let mut basis = Self {
            linear: axes(false).collect(),
            rotary: axes(true).collect(),
            middle: PerAxis::default(),
            half: PerAxis::default(),
            centred,
        };
        // X, Y, Z, as the document counts its tables.
        basis.linear.sort_by_key(|i| machine.axes[*i].letter.char());
        for i in axes(false) {
            let [low, high] = machine.axes[i].travel;
            basis.middle[i] = 0.5 * (low + high);
            basis.half[i] = 0.5 * (high - low);
        }
        basis
    }

    /// Where the position of a linear axis is counted from (mm).
    fn from(&self, axis: usize) -> f64 {
        if self.centred { self.middle[axis] } else { 0.0 }
    }

    fn count(&self) -> usize {
        (1 + self.linear.len()) * self.rotary.len() * FUNCTIONS
    }

    /// Number of a function of a rotary axis (0, 1), alone (0) or times a linear position (1, 2, 3).
    fn number(&self, times: usize, rotary: usize, function: usize) -> usize {
        (times * self.rotary.len() + rotary) * FUNCTIONS + function
    }

    fn values(&self, q: &PerAxis, into: &mut [f64]) {
        let linear = self.linear.iter();
        let linear = linear.map(|i| (q[*i] - self.from(*i)) / self.half[*i]);
        for (times, factor) in std::iter::once(1.0).chain(linear).enumerate() {
            for (rotary, axis) in self.rotary.iter().enumerate() {
                for (f, value) in functions(q[*axis]).into_iter().enumerate() {
                    into[self.number(times, rotary, f)] = factor * value;
                }
            }
        }
    }

    /// All functions of one rotary axis: alone, or times one linear position or another.
    fn of(&self, rotary: usize, times: std::ops::Range<usize>) -> Vec<usize> {
        let all = times.flat_map(|times| (0..FUNCTIONS).map(move |f| (times, f)));
        all.map(|(times, f)| self.number(times, rotary, f))
            .collect()
    }
}

/// Finds the tables of one machine and its errors.
///
/// # Errors
/// [`SchemeError`]: not two rotary and three linear axes, or the kinematic correction fails.
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    wanted: Wanted,
    options: &Options,
) -> Result<Found, SchemeError> {
    SchemeError::unless_five_axes(machine, "trigo23")?;
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let zero = options.zero(machine, errors)?;
    let lattice = Lattice::over(machine, wanted.nodes);
    let basis = Basis::new(machine, wanted.free);
    let moments = Moments::over(&kinematics, &lattice, basis.count(), |q, into| {
        basis.values(q, into);
    })?;
    // The rotary axis with which most can be said, be LUT₁ free or not.
    let left = |rotary: usize| -> f64 {
        let all = basis.of(rotary, 0..4);
        basis.linear.iter().map(|i| moments.left(&all, *i)).sum()
    };
    let rotary = usize::from(left(1) < left(0));
    let points = Points::over(
        machine,
        basis.rotary[rotary],
        options.points.unwrap_or(POINTS),
    );
    let fitted = Fitted {
        machine,
        basis: &basis,
        moments: &moments,
        rotary,
        zero,
    };
    let free = match wanted.free {
        true => Some(means(
            &kinematics,
            wanted.nodes,
            basis.rotary[rotary],
            &points.at,
        )?),
        false => None,
    };
    let (banks, terms) = fitted.tables(&points, free.as_deref(), options.format);
    let letter = machine.axes[basis.rotary[rotary]].letter;
    let mut notes = vec![format!("functions are those of {letter}")];
    notes.extend(super::without_direction(machine, errors));
    Ok(Found {
        draft: Draft {
            banks,
            terms,
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes,
    })
}

/// The mean of the correction of every axis (mm, rad) at these angles (rad) of a rotary axis, over the travel of
/// all others.
fn means(
    kinematics: &Kinematics<'_>,
    nodes: usize,
    axis: usize,
    angles: &[f64],
) -> Result<Vec<PerAxis>, NotConverged> {
    let machine = kinematics.machine;
    let mut lattice = Lattice::over(machine, MEANS).with(axis, angles);
    for i in (0..machine.axes.len()).filter(|i| *i != axis && machine.axes[*i].letter.is_rotary()) {
        lattice = lattice.evenly(machine, i, nodes);
    }
    let situation = Situation::default();
    let mut sums = lattice.sum(
        || vec![[0.0; MAX_AXES]; angles.len()],
        |sums, node, q| {
            let found = kinematics.correction_within(q, &situation, &Switches::ALL, SAMPLED)?;
            for (sum, d) in sums[lattice.place(node, axis)].iter_mut().zip(found.dq) {
                *sum += d;
            }
            Ok::<(), NotConverged>(())
        },
        |totals, sums| {
            for (total, sum) in totals.iter_mut().flatten().zip(sums.iter().flatten()) {
                *total += sum;
            }
        },
    )?;
    let each = (lattice.nodes() / angles.len()) as f64;
    for sum in sums.iter_mut().flatten() {
        *sum /= each;
    }
    Ok(sums)
}

/// What was fitted for one machine.
struct Fitted<'a> {
    machine: &'a Machine,
    basis: &'a Basis,
    moments: &'a Moments,
    /// Which rotary axis, 0 or 1.
    rotary: usize,
    zero: PerAxis,
}

impl Fitted<'_> {
    /// The tables and their sums of products, Eq. 45. In the order of the banks: the coordinates, those of the
    /// rotary axis, and the constants.
    fn tables(
        &self,
        points: &Points,
        free: Option<&[PerAxis]>,
        format: SampleFormat,
    ) -> (Vec<DraftBank>, Vec<Term>) {
        let (machine, linear) = (self.machine, &self.basis.linear);
        let mut banks: Vec<DraftBank> = (linear.iter())
            .map(|axis| {
                let ends = Points::ends(machine, *axis);
                let coordinate = ends.at.clone();
                ends.bank(SampleFormat::F32, vec![coordinate; linear.len()])
            })
            .collect();
        let (mut factors, mut alone, mut terms) = (Vec::new(), Vec::new(), Vec::new());
        let mut term = |output: usize, tables: &[usize]| {
            terms.push(Term {
                output: output as u8,
                weight: 1.0,
                limits: None,
                factors: tables.iter().map(|table| *table as u8).collect(),
            });
        };
        for (number, output) in linear.iter().enumerate() {
            let of = self.of_linear(*output, free.is_some());
            term(*output, &[ALONE + number]);
            for times in 0..3 {
                term(*output, &[3 * times + number, FACTORS + factors.len()]);
                factors.push(points.at.iter().map(|at| of.factor(times, *at)).collect());
            }
            alone.push(match free {
                // Σ (q − middle)·f is Σ q·f less the middles times f.
                Some(means) => (means.iter().zip(&points.at))
                    .map(|(mean, at)| {
                        let middles =
                            (0..3).map(|t| self.basis.from(linear[t]) * of.factor(t, *at));
                        mean[*output] - self.zero[*output] - middles.sum::<f64>()
                    })
                    .collect(),
                None => vec![of.constant - self.zero[*output]; 2],
            });
        }
        for output in &self.basis.rotary {
            let chosen = self.basis.of(self.rotary, 0..1);
            let weights = self.moments.fit(&chosen, *output);
            let value = |at: &f64| {
                let sum = functions(*at).into_iter().zip(weights.iter());
                let sum: f64 = sum.map(|(f, w)| f * w).sum();
                machine.axes[*output].to_command(sum - self.zero[*output])
            };
            term(*output, &[FACTORS + factors.len()]);
            factors.push(points.at.iter().map(value).collect());
        }
        if free.is_some() {
            factors.extend(alone);
            banks.push(points.bank(format, factors));
        } else {
            banks.push(points.bank(format, factors));
            let ends = Points::ends(machine, self.basis.rotary[self.rotary]);
            banks.push(ends.bank(SampleFormat::F32, alone));
        }
        (banks, terms)
    }

    fn of_linear(&self, output: usize, is_free: bool) -> OfLinear<'_> {
        let mut chosen = self.basis.of(self.rotary, 1..4);
        if !is_free {
            chosen.push(self.basis.number(0, self.rotary, 0));
        }
        let weights = self.moments.fit(&chosen, output);
        OfLinear {
            basis: self.basis,
            constant: if is_free { 0.0 } else { weights[3 * FUNCTIONS] },
            weights,
        }
    }
}

/// Numbers of the first table of the rotary axis, and of the first that stands alone: LUT₁, LUT₈, LUT₁₅.
const FACTORS: usize = 9;
const ALONE: usize = FACTORS + 9 + 2;

/// The functions of a linear output.
struct OfLinear<'a> {
    basis: &'a Basis,
    weights: DVector<f64>,
    /// a of Eq. 44 (mm).
    constant: f64,
}

impl OfLinear<'_> {
    /// What a linear position (0, 1, 2) is multiplied by at an angle (rad).
    fn factor(&self, times: usize, at: f64) -> f64 {
        let weights = self.weights.iter().skip(times * FUNCTIONS);
        let sum: f64 = weights.zip(functions(at)).map(|(w, f)| w * f).sum();
        sum / self.basis.half[self.basis.linear[times]]
    }
}
