//! What an evaluation costs on the reference target, a Cortex-M4F: estimated instructions.

use crate::validate::Runtime;
use trueaxis::Interpolation;

// Counted by `cargo xtask bench-target`: a bank of nine cubic tables with its terms takes 210 instructions more than
// one of one, a bank of nine linear ones 136 more: 9 a table. The bank of one cubic table takes 109 more than the
// linear one. The constants are those of an earlier kernel, within 20 instructions for each bank, and stay: they decide
// which tables a scheme chooses.

/// Of a term.
pub(crate) const TERM: f64 = 10.0;
/// Of each table of its product beyond two: its number, its address, its value, the product.
pub const FACTOR: f64 = 4.0;
/// Of a table with linear interpolation.
pub(crate) const LINEAR_TABLE: f64 = 7.0;
/// Of a table with cubic interpolation.
pub(crate) const CUBIC_TABLE: f64 = 19.0;
/// Of a bank of cubic tables, beyond one of linear ones.
pub(crate) const CUBIC_BANK: f64 = 119.0;
/// Of a bank: where its input is among its points. The layout of 40 tables of the source document takes 700 in all
/// (`cargo xtask bench-target`).
pub(crate) const BANK: f64 = 40.0;
/// Of a grid of three inputs, and of each output of it: a grid with three outputs takes 200.
pub(crate) const GRID: f64 = 80.0;
/// See [`GRID`].
pub(crate) const GRID_OUTPUT: f64 = 40.0;

/// Estimated instructions of one evaluation.
#[must_use]
pub fn instructions(runtime: &Runtime<'_>) -> f64 {
    let compensation = runtime.compensation();
    let bank = |bank: &trueaxis::Bank| {
        let tables = f64::from(bank.tables);
        match bank.interpolation {
            Interpolation::Linear => BANK + LINEAR_TABLE * tables,
            Interpolation::Cubic => BANK + CUBIC_BANK + CUBIC_TABLE * tables,
        }
    };
    let banks: f64 = compensation.banks().iter().map(bank).sum();
    let term = |factors: usize| TERM + FACTOR * factors.saturating_sub(2) as f64;
    let terms: f64 = compensation.terms().map(|t| term(t.factors.len())).sum();
    let grid = |grid: &trueaxis::Grid| GRID + GRID_OUTPUT * grid.outputs.len() as f64;
    let grids: f64 = compensation.grids().iter().map(grid).sum();
    banks + terms + grids
}

/// Cycles of an instruction of an evaluation without wait states: between 1.55 and 1.62 for the five compensations
/// that `cargo xtask bench-target` counts.
pub const CYCLES_PER_INSTRUCTION: f64 = 1.6;
