//! How far off a model is where it was not measured: in zones of the travel that it has not seen, and over all of it.

use crate::candidates::holds;
use crate::estimate::Estimate;
use crate::formats::artefact::Artefact;
use crate::formats::probings::{Probing, Probings};
use crate::gram::{Gram, Split};
use crate::rows::EquationWeights;
use crate::{Problem, Unknown};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::numbers::ascending;

/// Each axis has this many zones with about as many rows; the two at its ends are predicted by extrapolation.
const ZONES: usize = 5;
/// Positions (mm, rad) that differ by less are one.
const SAME: f64 = 1e-6;
/// Number of positions in the travel.
const POSITIONS: usize = 60;

/// What models with some of these unknowns predict, linear at an estimate of the machine.
pub(crate) struct Elsewhere {
    /// The equations, split into the zones of each axis.
    grams: Vec<Gram>,
    /// The effects of the unknowns on the tip (mm) at positions in the travel, less their mean, which is the zero of the
    /// workpiece.
    tips: DMatrix<f64>,
    /// Number of equations of rows, and the sum of the squared weights of the rows.
    equations: f64,
    weight: f64,
}

impl Elsewhere {
    /// For rows with these weights. `None` if no axis has two zones.
    pub fn new(
        problem: &Problem<'_>,
        estimate: &Estimate,
        weights: &EquationWeights,
        unknowns: &[Unknown],
    ) -> Option<Self> {
        let jacobian = problem.derivatives(unknowns, estimate, weights);
        let residuals = problem.residuals(estimate, weights);
        // What a zone does not show is zero, not what all rows together have found.
        let found = |unknown: &Unknown| match unknown {
            Unknown::Parameter(parameter) => {
                let value =
                    |errors: &ErrorModel| errors.parameters.get(parameter).copied().unwrap_or(0.0);
                value(&estimate.errors) - value(&problem.base)
            }
            _ => 0.0,
        };
        let found = DVector::from_iterator(unknowns.len(), unknowns.iter().map(found));
        let residuals = residuals - &jacobian * found;
        let zones = (0..problem.machine.axes.len()).map(|axis| zones(problem, axis));
        let has_two = |zones: &Vec<Option<usize>>| zones.iter().flatten().any(|zone| *zone > 0);
        let grams: Vec<Gram> = (zones.filter(has_two))
            .map(|zones| Gram::new(&jacobian, &residuals, &Split::new(&zones)))
            .collect();
        (!grams.is_empty()).then(|| Self {
            grams,
            tips: over_travel(problem, estimate, unknowns),
            equations: problem.measured() as f64,
            weight: weights.rows.iter().map(|w| w * w).sum(),
        })
    }

    /// How much of what the model with some unknowns leaves each group of others explains, per unknown.
    pub fn gains(&self, numbers: &[usize], groups: &[Vec<usize>]) -> Vec<f64> {
        self.grams[0].gains(numbers, groups)
    }

    /// The variance of equations that a model with some unknowns leaves.
    pub fn variance(&self, numbers: &[usize]) -> f64 {
        self.grams[0].of(numbers).variance()
    }

    /// What the model with the unknowns with these numbers predicts.
    pub fn predicted(&self, numbers: &[usize]) -> Predicted {
        let grams: Vec<Gram> = self.grams.iter().map(|gram| gram.of(numbers)).collect();
        let variance = grams[0].variance();
        let zones: Vec<f64> = grams.iter().flat_map(Gram::by_part_of_expected).collect();
        let worse = (zones.iter().sum::<f64>() / zones.len() as f64 / variance).max(1.0);
        let tips = self.tips.select_columns(numbers);
        let travel = (&tips * grams[0].covariance()).component_mul(&tips).sum();
        Predicted {
            worse,
            rows: worse * variance * self.equations / self.weight,
            travel: worse * travel / POSITIONS as f64,
            tips: tips * grams[0].solution(),
        }
    }
}

/// What a model predicts elsewhere.
#[derive(Clone, Debug)]
pub(crate) struct Predicted {
    /// How many times worse zones are predicted by the other zones (mean square) than chance would have it: 1 for a model
    /// that has all errors of the machine.
    worse: f64,
    /// What it leaves of the rows (mm², mean square distance), and the uncertainty that this gives the tip over the
    /// travel; both as many times larger.
    rows: f64,
    travel: f64,
    /// How far it moves the tip (mm) at each position in the travel.
    tips: DVector<f64>,
}

/// A further model must be off by no more than this fraction; a smaller gain is chance.
const WORTH: f64 = 0.9;
/// A model is as good as another if it leaves no more than this many times as much (mean square).
const AS_GOOD: f64 = 1.05;
/// What is wrong of what it changes over the travel must be no more than this part (mean square) of what it improves at the
/// rows. On machines with motions outside every model, the tip over the travel is then not worse by more than a tenth
/// (`tests/tests/desktop/claims.rs`), and the coefficients published for two machines are still found.
const WRONG: f64 = 0.5;

impl Predicted {
    /// How far off it is (mm, root mean square distance), if it has all errors of the machine.
    pub fn off(&self) -> f64 {
        (self.rows + self.travel).sqrt()
    }

    /// How far off it is at rows of zones that it has not seen (mm, root mean square distance).
    pub fn at_rows(&self) -> f64 {
        self.rows.sqrt()
    }

    /// True if it is worth taking in place of a simpler one, and of the one with the fewest parameters.
    ///
    /// Where two models put the tip over the travel differs by more than what is uncertain. Part of that is wrong
    /// ([`Self::wrong`]). The rest is right, and the simpler one lacks it.
    pub fn is_better(&self, simpler: &Self, fewest: &Self) -> bool {
        let (change, wrong) = (self.change(simpler), self.wrong(simpler));
        let own = self.rows + self.travel + wrong * change;
        let others = simpler.rows + simpler.travel + (1.0 - wrong) * change;
        let risk = self.wrong(fewest) * self.change(fewest);
        let gain = fewest.rows - self.rows;
        // Neither is true of what is no number.
        own < WORTH * WORTH * others && risk < WRONG * gain
    }

    /// True if it explains the rows as well as another model, and puts the tip over the travel elsewhere by more than both claim
    /// to be off (95 %).
    pub fn contradicts(&self, other: &Self) -> bool {
        let change = (&self.tips - &other.tips).norm_squared() / POSITIONS as f64;
        let claimed = other.rows + other.travel + self.travel;
        self.rows <= AS_GOOD * other.rows && change > 4.0 * claimed
    }

    /// How far it moves the tip from where another model puts it (mm², mean square over the travel), beyond what is
    /// uncertain.
    fn change(&self, other: &Self) -> f64 {
        let change = (&self.tips - &other.tips).norm_squared() / POSITIONS as f64;
        (change - self.travel).max(0.0)
    }

    /// The part of that which is wrong: as much as it leaves of the rows beside the simpler one, or twice the part of its
    /// error in zones that is not chance, because most of the travel is further from the rows than a zone.
    fn wrong(&self, simpler: &Self) -> f64 {
        let misfit = 2.0 * (1.0 - self.worse.recip());
        (self.rows / simpler.rows).max(misfit).min(1.0)
    }
}

/// The zone of each equation on the travel of an axis; `None` for those that are no rows.
fn zones(problem: &Problem<'_>, axis: usize) -> Vec<Option<usize>> {
    let at: Vec<f64> = problem.commands().map(|(q, _)| q[axis]).collect();
    let mut sorted = at.clone();
    ascending(&mut sorted);
    // Equal positions are in one zone: that of the first of them.
    let zone = |q: &f64| sorted.partition_point(|other| *other < q - SAME) * ZONES / at.len();
    let blocks = problem.blocks().zip(&at);
    let rows = blocks.flat_map(|(block, q)| block.map(move |_| Some(zone(q))));
    let mut all: Vec<Option<usize>> = rows.collect();
    all.resize(problem.equations(), None);
    all
}

/// The effects of unknowns on the tip at random positions in the travel, less their means: three rows for each
/// position. A stylus and set-ups have none.
pub(crate) fn over_travel(
    problem: &Problem<'_>,
    estimate: &Estimate,
    unknowns: &[Unknown],
) -> DMatrix<f64> {
    let machine = problem.machine;
    let probings = positions(machine);
    let all = Problem::new(machine, &probings, &Artefact::default(), &[], &problem.base);
    let is_parameter = |i: &usize| matches!(unknowns[*i], Unknown::Parameter(_));
    let numbers: Vec<usize> = (0..unknowns.len()).filter(is_parameter).collect();
    let parameters: Vec<Unknown> = numbers.iter().map(|i| unknowns[*i]).collect();
    let estimate = Estimate {
        balls: vec![Vector3::zeros()],
        ..estimate.clone()
    };
    let mut found = all.derivatives(&parameters, &estimate, &all.unweighted(0.0));
    hold(problem, &all, &parameters, &mut found);
    let mut tips = DMatrix::zeros(3 * POSITIONS, unknowns.len());
    for (number, column) in numbers.iter().zip(found.column_iter()) {
        for k in 0..3 {
            let own = || column.iter().take(3 * POSITIONS).skip(k).step_by(3);
            let mean = own().sum::<f64>() / POSITIONS as f64;
            for (i, value) in own().enumerate() {
                tips[(3 * i + k, *number)] = value - mean;
            }
        }
    }
    tips
}

/// Error motions of degree 2 and more, and harmonics of axes that are not endless, hold their value at the end of the
/// range that was measured.
fn hold(
    measured: &Problem<'_>,
    all: &Problem<'_>,
    parameters: &[Unknown],
    tips: &mut DMatrix<f64>,
) {
    let machine = measured.machine;
    for (unknown, mut column) in parameters.iter().zip(tips.column_iter_mut()) {
        let parameter = unknown.parameter().map(|(parameter, _)| parameter);
        let Some(parameter) = parameter.filter(|parameter| holds(machine, parameter)) else {
            continue;
        };
        let (kind, index) = (parameter.kind, machine.index(parameter.axis).unwrap_or(0));
        let [low, high] = measured.range(index);
        for (i, (q, _)) in all.commands().enumerate() {
            let q = q[index];
            let ratio = kind.basis(q.clamp(low, high)) / kind.basis(q);
            for k in 0..3 {
                column[3 * i + k] *= ratio;
            }
        }
    }
}

fn positions(machine: &Machine) -> Probings {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let row = |line| {
        let mut row = Probing {
            line,
            ..Probing::default()
        };
        for (i, axis) in machine.axes.iter().enumerate() {
            let [low, high] = axis.travel;
            row.position[i] = random.random_range(low..=high);
            row.direction[i] = if random.random() { 1.0 } else { -1.0 };
        }
        row
    };
    Probings {
        balls: vec![String::new()],
        rows: (0..POSITIONS).map(row).collect(),
    }
}
