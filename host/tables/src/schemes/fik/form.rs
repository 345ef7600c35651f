//! The closed form of the first-order correction for each error: Δq = −J⁺ · (effect of one unit on the tool).
//!
//! It is affine in the linear positions and in the tool length, which only appear in the levers of rotations, and of
//! degree two in sine and cosine of the rotary axis next to the workpiece. The dependence on the second rotary axis
//! is the same under `orientation` and `position`. Under `direction` there is a division by a function of that axis
//! alone, so its function is sampled at the points of its tables. A polynomial that is sampled at as many places as
//! it has coefficients is known exactly.
//!
//! Of three rotary axes, the one next to the tool is like the one next to the workpiece: the angles between the three
//! directions, and so the normal matrix of the rotary corrections, depend on the middle axis alone. Under `direction` the
//! tool axis takes part in that matrix, so it also depends on the axis next to the tool: there is no finite sum.

use super::sources::Source;
use crate::schemes::points::Points;
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use trueaxis_model::errors::Situation;
use trueaxis_model::kinematics::{Kinematics, Linearised};
use trueaxis_model::machine::{Branch, Machine, PerAxis};
use trueaxis_model::parallel;

/// Functions of the rotary axis next to the workpiece: 1, cos, sin, cos 2, sin 2.
pub const TURNS: usize = 5;
/// Lever (mm) used to find the slope of an affine function, starting from 0; any value would do.
const LEVER: f64 = 512.0;
/// Closed forms agree with the correction to this fraction of the largest value: rounding of a few dozen operations.
const AGREES: f64 = 1e-9;

/// The inputs of the closed forms.
#[derive(Clone, Debug, PartialEq)]
pub struct Variables {
    /// The rotary axis next to the workpiece; of three, also the one next to the tool.
    pub outer: Vec<usize>,
    /// The second rotary axis from the workpiece.
    pub middle: usize,
    /// Linear axes in order, followed by the tool length if it is an input.
    pub levers: Vec<usize>,
}

impl Variables {
    /// For a machine with two or three rotary axes; `None` for any other.
    pub fn new(machine: &Machine) -> Option<Self> {
        let of = |branch: Branch| {
            let axes = machine.axes.iter().enumerate();
            axes.filter(move |(_, a)| a.branch == branch && a.letter.is_rotary())
        };
        let from_workpiece = of(Branch::Workpiece).collect::<Vec<_>>().into_iter().rev();
        let rotary: Vec<usize> = from_workpiece
            .chain(of(Branch::Tool))
            .map(|(i, _)| i)
            .collect();
        let levers = (0..machine.axes.len()).filter(|i| !machine.axes[*i].letter.is_rotary());
        let length = machine.length_range.map(|_| machine.axes.len());
        let [first, middle, ref last @ ..] = rotary[..] else {
            return None;
        };
        if last.len() > 1 {
            return None;
        }
        Some(Self {
            outer: std::iter::once(first).chain(last.iter().copied()).collect(),
            middle,
            levers: levers.chain(length).collect(),
        })
    }

    /// Number of products of functions of the outer axes.
    fn turns(&self) -> usize {
        TURNS.pow(self.outer.len() as u32)
    }

    /// As many angles of each outer axis as it has functions, those of the last axis fastest.
    fn angles(&self, turn: usize) -> Vec<f64> {
        let each = (0..self.outer.len() as u32).rev();
        let turns = each.map(|k| turn / TURNS.pow(k) % TURNS);
        turns.map(|turn| TAU * turn as f64 / TURNS as f64).collect()
    }

    /// Position and tool length, for the angles of the outer axes, that of the middle one and levers.
    fn place(
        &self,
        machine: &Machine,
        angles: &[f64],
        at: f64,
        levers: &[f64],
    ) -> (PerAxis, Option<f64>) {
        let mut q = PerAxis::default();
        let mut length = None;
        q[self.middle] = at;
        for (axis, angle) in self.outer.iter().zip(angles) {
            q[*axis] = *angle;
        }
        for (input, lever) in self.levers.iter().zip(levers) {
            match q[..machine.axes.len()].get_mut(*input) {
                Some(q) => *q = *lever,
                None => length = Some(*lever),
            }
        }
        (q, length)
    }
}

/// Correction of one output for one unit of one error. A matrix for 1 and for each lever: [`products_of_turns`] of the
/// outer rotary axes × points of the middle one (mm or rad per mm or rad, and per mm of lever).
#[derive(Clone, Debug, PartialEq)]
pub struct Form(pub Vec<DMatrix<f64>>);

impl Form {
    /// All numbers as one vector.
    pub fn flat(&self) -> DVector<f64> {
        let numbers: Vec<f64> = self.0.iter().flat_map(|m| m.iter().copied()).collect();
        DVector::from_vec(numbers)
    }

    fn largest(&self, reach: &[f64]) -> f64 {
        let sizes = self.0.iter().zip(reach).map(|(m, r)| m.amax() * r);
        sizes.fold(0.0, f64::max)
    }
}

/// The products of the functions of each outer rotary axis at its angle (rad), those of the last one fastest.
fn products_of_turns(angles: &[f64]) -> Vec<f64> {
    angles.iter().fold(vec![1.0], |products, angle| {
        let turns = turns(*angle);
        let all = products.iter().flat_map(|p| turns.map(|t| p * t));
        all.collect()
    })
}

/// The functions of an outer rotary axis at an angle (rad).
pub fn turns(angle: f64) -> [f64; TURNS] {
    let (s, c) = libm::sincos(angle);
    let (s2, c2) = libm::sincos(2.0 * angle);
    [1.0, c, s, c2, s2]
}

/// The correction of every axis at a position, for one unit of each source.
fn corrections(
    kinematics: &Kinematics<'_>,
    sources: &[Source],
    q: &PerAxis,
    length: Option<f64>,
) -> Option<Vec<PerAxis>> {
    let situation = Situation {
        length,
        ..Situation::default()
    };
    let linearised = Linearised::new(kinematics, q, &situation);
    let solver = kinematics.jacobian(q, length).solver(kinematics.policy)?;
    let unit = |source: &Source| Some(solver.correct(&linearised.column(source.unit)?));
    sources.iter().map(unit).collect()
}

/// Largest magnitude of 1 and of each lever (mm).
fn reach(variables: &Variables, points: &[Points]) -> Vec<f64> {
    let ends = |input: &usize| {
        let [first, last] = points[*input].ends();
        let at = &points[*input].at;
        at[first].abs().max(at[last].abs())
    };
    let levers = variables.levers.iter().map(ends);
    std::iter::once(1.0).chain(levers).collect()
}

/// The closed forms of every source (first index) for every output. `None` if one has no closed form, because the
/// directions of linear axes are not fixed relative to each other.
pub fn forms(
    kinematics: &Kinematics<'_>,
    variables: &Variables,
    points: &[Points],
    sources: &[Source],
) -> Option<Vec<Vec<Form>>> {
    let axes = kinematics.machine.axes.len();
    let at = &points[variables.middle].at;
    let sampled = SampledCorrections::new(kinematics, variables, at, sources)?;
    let mut forms: Vec<Vec<Form>> = (0..sources.len())
        .map(|source| {
            (0..axes)
                .map(|output| sampled.form(source, output))
                .collect()
        })
        .collect();
    let reach = reach(variables, points);
    if !agree(kinematics, sources, &forms, at, &reach, variables) {
        return None;
    }
    for of_source in &mut forms {
        clean(kinematics.machine, of_source, &reach);
    }
    Some(forms)
}

/// The corrections where closed forms are sampled.
struct SampledCorrections<'v> {
    variables: &'v Variables,
    /// Indices: point, lever, turn, source.
    found: Vec<Vec<Vec<Vec<PerAxis>>>>,
}

impl<'v> SampledCorrections<'v> {
    /// At these points of the middle axis; `None` if there is no correction at one of them.
    fn new(
        kinematics: &Kinematics<'_>,
        variables: &'v Variables,
        at: &[f64],
        sources: &[Source],
    ) -> Option<Self> {
        let count = variables.levers.len();
        let unit = |lever: usize| -> Vec<f64> {
            let one = |k: usize| if k + 1 == lever { LEVER } else { 0.0 };
            (0..count).map(one).collect()
        };
        let found = parallel::map(at, |at| {
            let levers = (0..=count).map(|lever| {
                let turns = (0..variables.turns()).map(|turn| {
                    let angles = variables.angles(turn);
                    let (q, length) =
                        variables.place(kinematics.machine, &angles, *at, &unit(lever));
                    corrections(kinematics, sources, &q, length)
                });
                turns.collect::<Option<Vec<_>>>()
            });
            levers.collect::<Option<Vec<_>>>()
        });
        let found = found.into_iter().collect::<Option<Vec<_>>>()?;
        Some(Self { variables, found })
    }

    /// The closed form of a source for an output.
    fn form(&self, source: usize, output: usize) -> Form {
        let (variables, sampled) = (self.variables, &self.found);
        let all = variables.turns();
        let matrix = |lever: usize| {
            DMatrix::from_fn(all, sampled.len(), |row, point| {
                let sum = |(turn, found): (usize, &Vec<PerAxis>)| {
                    let value = match lever {
                        0 => found[source][output],
                        _ => {
                            let zero = &sampled[point][0][turn];
                            (found[source][output] - zero[source][output]) / LEVER
                        }
                    };
                    value * products_of_turns(&variables.angles(turn))[row]
                };
                let sum: f64 = sampled[point][lever].iter().enumerate().map(sum).sum();
                // The mean square of a sine or cosine is a half.
                let of_axis = |k: u32| match row / TURNS.pow(k) % TURNS {
                    0 => 1.0,
                    _ => 2.0,
                };
                let outer = 0..variables.outer.len() as u32;
                sum * outer.map(of_axis).product::<f64>() / all as f64
            })
        };
        Form((0..=variables.levers.len()).map(matrix).collect())
    }
}

/// Whether the forms give the correct corrections at places where they were not sampled.
fn agree(
    kinematics: &Kinematics<'_>,
    sources: &[Source],
    forms: &[Vec<Form>],
    at: &[f64],
    reach: &[f64],
    variables: &Variables,
) -> bool {
    (0..24).all(|k| {
        // Places unrelated to the pattern of the samples.
        let part = |n: usize| (0.618_033_988_749_895 * (7 * k + n) as f64).fract();
        let point = (part(0) * at.len() as f64) as usize % at.len();
        let outer = 0..variables.outer.len();
        let angles: Vec<f64> = outer.map(|n| TAU * part(n + 1)).collect();
        let levers = reach[1..].iter().enumerate();
        let levers: Vec<f64> = levers.map(|(n, r)| r * (2.0 * part(n + 3) - 1.0)).collect();
        let (q, length) = variables.place(kinematics.machine, &angles, at[point], &levers);
        let Some(right) = corrections(kinematics, sources, &q, length) else {
            return false;
        };
        let turns = products_of_turns(&angles);
        forms.iter().zip(&right).all(|(forms, right)| {
            forms.iter().zip(right).all(|(form, right)| {
                let levers = std::iter::once(&1.0).chain(&levers);
                let parts = form.0.iter().zip(levers).flat_map(|(m, lever)| {
                    let column = m.column(point);
                    let parts = turns.iter().zip(column.iter());
                    parts.map(|(t, c)| t * c * lever).collect::<Vec<_>>()
                });
                (parts.sum::<f64>() - right).abs() <= AGREES * form.largest(reach).max(1.0)
            })
        })
    })
}

/// Sets rounding errors to zero.
fn clean(machine: &Machine, forms: &mut [Form], reach: &[f64]) {
    let largest = |rotary: bool, forms: &[Form]| {
        let of_kind = machine.axes.iter().zip(forms);
        let of_kind = of_kind.filter(|(axis, _)| axis.letter.is_rotary() == rotary);
        of_kind.map(|(_, f)| f.largest(reach)).fold(0.0, f64::max)
    };
    let most = [largest(false, forms), largest(true, forms)];
    for (axis, form) in machine.axes.iter().zip(forms) {
        let least = 1e-11 * most[usize::from(axis.letter.is_rotary())].max(1.0);
        for (matrix, reach) in form.0.iter_mut().zip(reach) {
            // A whole row at a time: a small value of a nonzero function is not a rounding error.
            for mut row in matrix.row_iter_mut() {
                if row.amax() * reach < least {
                    row.fill(0.0);
                }
            }
        }
    }
}
