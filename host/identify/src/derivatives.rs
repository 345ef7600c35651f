//! The derivatives of the equations.

use crate::Unknown;
use crate::estimate::Estimate;
use crate::factor::{Alone, ScaledFactor};
use crate::instrument::{LEVER, Seen};
use crate::observed::ObservedRow;
use crate::rows::{EquationWeights, LARGEST_LENGTH, ProbingRow, Problem};
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::collections::BTreeMap;
use trueaxis_kinematics::Sensitivity;
use trueaxis_model::errors::{Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::parallel;

/// Upper limit for the errors of any machine (rad).
const LARGEST_ANGLE: f64 = 0.01;

/// Upper limit for an error parameter on any machine (mm or rad).
pub(crate) fn largest(parameter: Parameter) -> f64 {
    match parameter.is_angular() {
        true => LARGEST_ANGLE,
        false => LARGEST_LENGTH,
    }
}

/// Effect of errors on the tip in a probing, in units of its standard uncertainty.
struct Effects {
    /// Of each component of the location of each axis and of the spindle, followed by each component of the error
    /// motions of each axis.
    errors: [[f64; 3]; ERRORS],
    /// Of each coordinate of the stylus.
    stylus: [[f64; 3]; 3],
}

const ERRORS: usize = 6 * (2 * MAX_AXES + 1);

impl Effects {
    fn new(found: Sensitivity, weight: f64, place: &ProbingRow) -> Self {
        let Sensitivity {
            by_inter,
            by_intra,
            by_tool,
            ..
        } = found;
        let axes = by_inter.iter().chain(&by_intra);
        let mut errors = [[0.0; 3]; ERRORS];
        for (error, column) in errors.iter_mut().zip(axes.flat_map(|m| m.column_iter())) {
            *error = (column * weight).into();
        }
        let by_stylus = by_tool * place.turned * weight;
        Self {
            errors,
            stylus: by_stylus.into(),
        }
    }
}

/// Effect of errors on an observation, in units of its standard uncertainty, and what its other derivatives need.
struct ObservedEffects {
    errors: [[f64; 3]; ERRORS],
    seen: Seen,
    by_tool: Matrix3<f64>,
}

impl ObservedEffects {
    fn new(
        kinematics: &Kinematics<'_>,
        estimate: &Estimate,
        row: &ObservedRow,
        weight: f64,
    ) -> Self {
        let tip = row.tip(estimate);
        let found = kinematics.sensitivity(&row.q, &row.situation, &tip);
        let by_tool = found.by_tool;
        let seen = row.commanded.seen_at(found.point, &by_tool);
        let seen = row.drifted(seen, estimate);
        let setting = &estimate.settings[row.setup];
        let by_point = row.instrument().by_point(&row.commanded, setting, &seen) * weight;
        let axes = |found: &Sensitivity| {
            let axes = found.by_inter.iter().chain(&found.by_intra);
            let columns = axes.flat_map(|m| m.column_iter().map(|c| c.into_owned()));
            columns.collect::<Vec<Vector3<f64>>>()
        };
        let moves = axes(&found);
        let mut errors = [[0.0; 3]; ERRORS];
        for (error, column) in errors.iter_mut().zip(&moves) {
            *error = (by_point * column).into();
        }
        // A rotation ω about m moves the end of an arm u across m by ω × u, along m × u by ω·m.
        if let Some(m) = row.instrument().about(&row.commanded) {
            let u = across(&m);
            let end = tip + by_tool.tr_mul(&(u * LEVER));
            let at_end = axes(&kinematics.sensitivity(&row.q, &row.situation, &end));
            let along = m.cross(&u) * weight;
            for ((error, end), start) in errors.iter_mut().zip(&at_end).zip(&moves) {
                error[0] += along.dot(&(end - start));
            }
        }
        Self {
            errors,
            seen,
            by_tool,
        }
    }
}

/// A unit vector across another one.
fn across(vector: &Vector3<f64>) -> Vector3<f64> {
    let least = vector.iamin();
    vector.cross(&Vector3::ith(least, 1.0)).normalize()
}

impl Problem<'_> {
    /// The derivatives of [`Self::residuals`]: equations × unknowns.
    pub(crate) fn jacobian(&self, estimate: &Estimate, weights: &EquationWeights) -> DMatrix<f64> {
        self.derivatives(&self.unknowns, estimate, weights)
    }

    /// Like `jacobian`, for given unknowns.
    pub(crate) fn derivatives(
        &self,
        unknowns: &[Unknown],
        estimate: &Estimate,
        weights: &EquationWeights,
    ) -> DMatrix<f64> {
        let kinematics = Kinematics::new(self.machine, &estimate.errors);
        let mut jacobian = DMatrix::zeros(self.equations(), unknowns.len());
        let weighted: Vec<_> = self.places.iter().zip(&weights.rows).collect();
        let probed = parallel::map(&weighted, |(place, weight)| {
            let tip = place.turned * estimate.stylus;
            let found = kinematics.sensitivity(&place.q, &place.situation, &tip);
            Effects::new(found, **weight, place)
        });
        let weighted: Vec<_> = (self.observed.rows.iter())
            .zip(&weights.rows[self.places.len()..])
            .collect();
        let observed = parallel::map(&weighted, |(row, weight)| {
            ObservedEffects::new(&kinematics, estimate, row, **weight)
        });
        let columns = DerivativeColumns {
            problem: self,
            estimate,
            weights,
            probed: &probed,
            observed: &observed,
            bases: self.bases(unknowns),
        };
        let equations = jacobian.nrows();
        // Columns are stored one after the other.
        let each = jacobian.as_mut_slice().chunks_mut(equations);
        each.zip(unknowns).for_each(|(column, unknown)| {
            let (probed, rest) = column.split_at_mut(3 * self.places.len());
            let (observed, others) = rest.split_at_mut(self.observed.equations());
            columns.of_probings(*unknown, probed.as_chunks_mut::<3>().0);
            columns.of_observations(*unknown, observed);
            others.copy_from_slice(&self.others_by(*unknown, estimate, weights));
        });
        jacobian
    }

    /// Coordinates of balls without bars: their derivatives are zero except in the probings of the ball.
    pub(crate) fn alone(&self) -> Vec<Alone> {
        let of = |(unknown, what): (usize, &Unknown)| {
            let Unknown::Ball(ball, k) = *what else {
                return None;
            };
            // Places are sorted by ball.
            let first = self.places.iter().position(|p| p.ball == ball)?;
            let count = (self.places[first..].iter()).take_while(|p| p.ball == ball);
            let end = first + count.count();
            let is_in_bar = self.bars.iter().any(|bar| bar.balls.contains(&ball));
            (!is_in_bar).then(|| Alone {
                unknown,
                rows: (3 * first + k..3 * end).step_by(3),
            })
        };
        self.unknowns.iter().enumerate().filter_map(of).collect()
    }

    /// Derivatives of the remaining equations by one unknown.
    fn others_by(
        &self,
        unknown: Unknown,
        estimate: &Estimate,
        weights: &EquationWeights,
    ) -> Vec<f64> {
        let bars = self.bars.iter().map(|bar| {
            let [a, b] = bar.balls.map(|ball| estimate.balls[ball]);
            let along = along(a - b) / bar.sigma.max(weights.least);
            match unknown {
                Unknown::Ball(ball, k) if ball == bar.balls[0] => along[k],
                Unknown::Ball(ball, k) if ball == bar.balls[1] => -along[k],
                _ => 0.0,
            }
        });
        let known = self.known_coordinates().map(|(k, sigma)| match unknown {
            Unknown::Stylus(i) if i == k => 1.0 / sigma.max(weights.least),
            _ => 0.0,
        });
        let setups = self.observed.known.iter();
        let setups = setups.map(|(of, _, sigma)| match *of == unknown {
            true => self.observed.value(unknown, estimate).1 / sigma.max(weights.least),
            false => 0.0,
        });
        bars.chain(known).chain(setups).collect()
    }

    /// Parameters without any effect on the rows, even at the upper limit for any machine.
    pub(crate) fn idle(&self, factor: &ScaledFactor, weights: &EquationWeights) -> Vec<usize> {
        let all = weights.rows.iter().map(|w| w * w).sum::<f64>().sqrt();
        let whole = |basis: &Vec<f64>| {
            let bases = basis.iter().zip(&weights.rows);
            bases.map(|(b, w)| (b * w).powi(2)).sum::<f64>().sqrt()
        };
        let bases = self.bases(&self.unknowns);
        let wholes: BTreeMap<_, f64> = bases.iter().map(|(of, b)| (*of, whole(b))).collect();
        let columns = factor.unknowns().iter().zip(factor.lengths());
        let idle = columns.filter(|(i, length)| {
            let Unknown::Parameter(parameter) = self.unknowns[**i] else {
                return false;
            };
            let largest = largest(parameter);
            // For an error motion, all of it, not a single coefficient.
            let whole = match wholes.get(&(parameter.axis, parameter.kind)) {
                Some(whole) => *whole,
                None => all,
            };
            let largest_coefficient = largest * all / whole;
            whole == 0.0 || **length * largest_coefficient < (self.measured() as f64).sqrt()
        });
        idle.map(|(i, _)| *i).collect()
    }

    /// The index in [`Effects::errors`] of a parameter's error.
    fn effect(&self, parameter: Parameter) -> usize {
        let spindle = self.machine.axes.len();
        let axis = self.machine.index(parameter.axis).unwrap_or(spindle);
        let intra = usize::from(parameter.kind != ParameterKind::Inter);
        6 * (axis + intra * (MAX_AXES + 1)) + parameter.component
    }

    /// For each kind of parameter, the error of its axis in every probing and observation at a parameter value of
    /// 1; omits those that are 1 in all of them.
    fn bases(&self, unknowns: &[Unknown]) -> BTreeMap<(char, ParameterKind), Vec<f64>> {
        let mut bases = BTreeMap::new();
        for unknown in unknowns {
            let Some((Parameter { axis, kind, .. }, _)) = unknown.parameter() else {
                continue;
            };
            let i = self.machine.index(axis).unwrap_or(0);
            let basis = |(q, situation): (&PerAxis, &Situation)| match kind {
                ParameterKind::Backlash => situation.sign[i],
                kind => kind.basis(q[i]),
            };
            if kind != ParameterKind::Inter {
                let all = || self.commands().map(basis).collect();
                bases.entry((axis, kind)).or_insert_with(all);
            }
        }
        bases
    }
}

/// What the columns of a Jacobian are made of.
struct DerivativeColumns<'a> {
    problem: &'a Problem<'a>,
    estimate: &'a Estimate,
    weights: &'a EquationWeights,
    probed: &'a [Effects],
    observed: &'a [ObservedEffects],
    /// See [`Problem::bases`].
    bases: BTreeMap<(char, ParameterKind), Vec<f64>>,
}

impl DerivativeColumns<'_> {
    fn basis(&self, parameter: Parameter) -> Option<&Vec<f64>> {
        self.bases.get(&(parameter.axis, parameter.kind))
    }

    fn of_observations(&self, unknown: Unknown, mut column: &mut [f64]) {
        let places = self.problem.places.len();
        let rows = (self.problem.observed.rows.iter()).zip(&self.weights.rows[places..]);
        let of = unknown.parameter();
        let basis = of.and_then(|(parameter, _)| self.basis(parameter));
        for (i, ((row, weight), found)) in rows.zip(self.observed).enumerate() {
            let (own, next) = column.split_at_mut(row.kind.dimension());
            let effect: [f64; 3] = match of {
                Some((parameter, input)) => {
                    let basis = basis.map_or(1.0, |basis| basis[places + i]);
                    let basis = basis * input.map_or(1.0, |s| row.situation.kelvin[s]);
                    found.errors[self.problem.effect(parameter)].map(|v| v * basis)
                }
                None => {
                    let by = row.by_unknown(unknown, self.estimate, &found.seen, &found.by_tool);
                    (by * *weight).into()
                }
            };
            own.copy_from_slice(&effect[..own.len()]);
            column = next;
        }
    }

    fn of_probings(&self, unknown: Unknown, rows: &mut [[f64; 3]]) {
        let places = &self.problem.places;
        let rows = rows.iter_mut().zip(self.probed);
        let each = rows.zip(places).zip(&self.weights.rows);
        if let Some((parameter, input)) = unknown.parameter() {
            let (effect, basis) = (self.problem.effect(parameter), self.basis(parameter));
            each.enumerate()
                .for_each(|(i, (((row, found), place), _))| {
                    let basis = basis.map_or(1.0, |basis| basis[i]);
                    let basis = basis * input.map_or(1.0, |s| place.situation.kelvin[s]);
                    *row = found.errors[effect].map(|v| v * basis);
                });
            return;
        }
        match unknown {
            Unknown::Stylus(k) => each.for_each(|(((row, found), _), _)| *row = found.stylus[k]),
            Unknown::Ball(ball, k) => {
                let of_ball = each.filter(|((_, place), _)| place.ball == ball);
                of_ball.for_each(|(((row, _), _), weight)| row[k] = -weight);
            }
            Unknown::Drift(None, k) => each.for_each(|(((row, _), place), weight)| {
                let unit = Vector3::ith(k % 3, 1.0);
                let moved = match k {
                    0..3 => unit,
                    _ => unit.cross(&self.estimate.balls[place.ball]),
                };
                *row = (moved * (-place.hours[k] * weight)).into();
            }),
            _ => {}
        }
    }
}

/// The direction of a bar, or zero if its balls are at the same place.
fn along(bar: Vector3<f64>) -> Vector3<f64> {
    bar.try_normalize(0.0).unwrap_or_default()
}
