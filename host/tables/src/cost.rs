//! Cost of an evaluation on the reference target, a Cortex-M4F, in estimated instructions.

use trueaxis::Interpolation;
use trueaxis_model::validate::Runtime;

// Counted by `cargo xtask bench-target`: a bank of nine cubic tables with its terms takes 210 instructions more than
// a bank of one, a bank of nine linear tables 136 more: 9 per table. A bank of one cubic table takes 109 more than a
// bank of one linear table. The constants below come from an earlier kernel and are within 20 instructions per bank.
// They are kept because they decide which tables a scheme chooses.

/// Per term.
pub(crate) const TERM: f64 = 10.0;
/// Per table of a product beyond the second: its number, address, value and the multiplication.
pub const FACTOR: f64 = 4.0;
/// Per table with linear interpolation.
pub(crate) const LINEAR_TABLE: f64 = 7.0;
/// Per table with cubic interpolation.
pub(crate) const CUBIC_TABLE: f64 = 19.0;
/// Per bank of cubic tables, in addition to the cost of a bank of linear tables.
pub(crate) const CUBIC_BANK: f64 = 119.0;
/// Per bank: locating the input among its points. The layout of 40 tables of the source document takes 700 in total
/// (`cargo xtask bench-target`).
pub(crate) const BANK: f64 = 40.0;
/// Per grid with three inputs; [`GRID_OUTPUT`] is added for each output. A grid with three outputs takes 200.
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

/// Cycles per instruction of an evaluation without wait states: 1.55 to 1.62 for the five compensations counted by
/// `cargo xtask bench-target`.
pub const CYCLES_PER_INSTRUCTION: f64 = 1.6;
