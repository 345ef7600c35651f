//! The 23 tables and their combination (Eq. 45).

use super::basis::{Basis, FUNCTIONS, functions};
use crate::schemes::moments::Moments;
use crate::schemes::points::Points;
use nalgebra::DVector;
use trueaxis::{DraftBank, SampleFormat, Term};
use trueaxis_model::machine::{Machine, PerAxis};

/// The fit for one machine.
pub struct Fitted<'a> {
    pub machine: &'a Machine,
    pub basis: &'a Basis,
    pub moments: &'a Moments,
    /// The rotary axis in use, 0 or 1.
    pub rotary: usize,
    pub zero: PerAxis,
}

impl Fitted<'_> {
    /// The tables and their sums of products, Eq. 45. Order of the banks: the coordinates, the tables of the rotary
    /// axis, the constants.
    pub fn tables(
        &self,
        points: &Points,
        free: Option<&[PerAxis]>,
        format: SampleFormat,
    ) -> (Vec<DraftBank>, Vec<Term>) {
        let (machine, linear) = (self.machine, &self.basis.linear);
        let mut banks: Vec<DraftBank> = (linear.iter())
            .map(|axis| {
                let ends = Points::over(machine, *axis, 2);
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
                // Σ (q − middle)·f is Σ q·f minus the middles times f.
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
            let ends = Points::over(machine, self.basis.rotary[self.rotary], 2);
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

/// Indices of the first table of the rotary axis, and of the first table without a factor: LUT₁, LUT₈, LUT₁₅.
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
    /// The factor of a linear position (0, 1, 2) at an angle (rad).
    fn factor(&self, times: usize, at: f64) -> f64 {
        let weights = self.weights.iter().skip(times * FUNCTIONS);
        let sum: f64 = weights.zip(functions(at)).map(|(w, f)| w * f).sum();
        sum / self.basis.half[self.basis.linear[times]]
    }
}
