//! The tables of a compensation, with all data for their evaluation (`docs/src/format.md`).

use serde::Serialize;
use trueaxis::{Bank, Direction, Grid, Interpolation, Largest};
use trueaxis_model::policy::PolicyName;

/// Tables, terms and grids. Samples include their scale: sums of tables stored as integers are the same up to f32
/// rounding, those of others to the bit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageTables {
    /// What the rotary axes correct.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// The banks; tables are numbered through all of them.
    pub banks: Vec<PageBank>,
    /// The terms, in stored order.
    pub terms: Vec<PageTerm>,
    /// The grids, in stored order.
    pub grids: Vec<PageGrid>,
}

/// Tables over the same points of one input.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageBank {
    /// Number of the input: the axes in order, then tool length and sensors.
    pub input: u8,
    /// Position of the first point.
    pub start: f32,
    /// Spacing of the points.
    pub step: f32,
    /// True if the input wraps after as many steps as there are points.
    pub modulo: bool,
    /// `both`, `positive`, `negative` or `signed`: see [`Direction`].
    pub direction: &'static str,
    /// True for uniform cubic B-splines, false for linear interpolation.
    pub cubic: bool,
    /// The samples of each table.
    pub tables: Vec<Vec<f32>>,
}

/// Weight × product of tables → one axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageTerm {
    /// Index of the axis.
    pub output: u8,
    /// Weight.
    pub weight: f32,
    /// Numbers of the tables, in the order of multiplication.
    pub factors: Vec<u8>,
}

/// Corrections of several axes at the nodes of a rectangular grid.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PageGrid {
    /// One to three inputs, the first varies slowest.
    pub inputs: Vec<GridInput>,
    /// Indices of the axes.
    pub outputs: Vec<u8>,
    /// Values of all outputs, node by node.
    pub samples: Vec<f32>,
}

/// One input of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct GridInput {
    /// Number of the input, as in a bank.
    pub input: u8,
    /// Position of the first node.
    pub start: f32,
    /// Spacing of the nodes.
    pub step: f32,
    /// Number of nodes.
    pub points: u32,
    /// True if the input wraps after as many steps as there are nodes.
    pub modulo: bool,
}

impl PageTables {
    /// All of a compensation, with its weights as stored.
    #[must_use]
    pub fn of(compensation: &Largest<'_>) -> Self {
        let mut next = 0;
        let banks = compensation.banks().iter().map(|bank| {
            let first = next;
            next += usize::from(bank.tables);
            PageBank::of(compensation, bank, first)
        });
        let terms = compensation.terms().map(|term| PageTerm {
            output: term.output,
            weight: term.weight,
            factors: term.factors.to_vec(),
        });
        let grids = compensation.grids().iter().enumerate();
        let grids = grids.map(|(number, grid)| PageGrid::of(compensation, grid, number));
        Self {
            policy: compensation.policy().into(),
            banks: banks.collect(),
            terms: terms.collect(),
            grids: grids.collect(),
        }
    }
}

impl PageBank {
    /// A bank whose first table has the number `first`.
    fn of(compensation: &Largest<'_>, bank: &Bank, first: usize) -> Self {
        let table = |number: usize| {
            let points = 0..bank.points as usize;
            let samples = points.map(|point| compensation.sample(number, point));
            samples.flatten().collect()
        };
        let numbers = first..first + usize::from(bank.tables);
        Self {
            input: bank.input,
            start: bank.start,
            step: bank.step,
            modulo: bank.modulo,
            direction: match bank.direction {
                Direction::Both => "both",
                Direction::Positive => "positive",
                Direction::Negative => "negative",
                Direction::Signed => "signed",
            },
            cubic: bank.interpolation == Interpolation::Cubic,
            tables: numbers.map(table).collect(),
        }
    }
}

impl PageGrid {
    fn of(compensation: &Largest<'_>, grid: &Grid, number: usize) -> Self {
        let nodes = 0..grid.nodes() as usize;
        let samples = nodes.flat_map(|node| {
            let outputs = 0..grid.outputs.len();
            outputs.filter_map(move |output| compensation.grid_sample(number, node, output))
        });
        let inputs = grid.axes.iter().map(|axis| GridInput {
            input: axis.input,
            start: axis.start,
            step: axis.step,
            points: axis.points,
            modulo: axis.modulo,
        });
        Self {
            inputs: inputs.collect(),
            outputs: grid.outputs.to_vec(),
            samples: samples.collect(),
        }
    }
}
