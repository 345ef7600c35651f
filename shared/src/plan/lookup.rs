//! Banks and grids in the form that evaluation needs.

use super::span::Span;
use crate::description::{Bank, Direction, GRID_INPUTS, GRID_OUTPUTS, Interpolation, SampleFormat};

/// One bank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BankLookup {
    /// Points. They are read directly if the tables are linear, apply to both directions and have f32 samples.
    pub span: Span,
    /// Whether the bank is read directly and has one table of two points: then only `line` is read.
    pub straight: bool,
    /// The first sample, and the difference between the second and the first.
    pub line: [f32; 2],
    /// Index of the first sample in its section.
    pub first: u32,
    /// Index of the first table.
    pub table: u16,
    /// Tables per row, at least 1.
    pub tables: u16,
    pub direction: Direction,
    pub cubic: bool,
    pub integer: bool,
}

impl BankLookup {
    /// Does not set its place among the tables yet.
    pub(super) fn new(bank: &Bank, mut span: Span) -> Self {
        let cubic = bank.interpolation == Interpolation::Cubic;
        let integer = bank.format == SampleFormat::I16;
        if cubic || integer || bank.direction != Direction::Both {
            span.direct = 0.0;
        }
        Self {
            straight: span.direct == 1.0 && bank.tables == 1,
            line: [0.0; 2],
            span,
            first: bank.first,
            table: 0,
            tables: bank.tables,
            direction: bank.direction,
            cubic,
            integer,
        }
    }
}

/// One grid. Missing inputs are spans with one node, so that every grid has three.
///
/// The most common kind is *plain*: three inputs and [`PLAIN_WIDTH`] outputs of f32 samples. Only plain grids are read
/// directly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridLookup {
    pub spans: [Span; GRID_INPUTS],
    /// Number of samples between neighbouring nodes along each input.
    pub strides: [u32; GRID_INPUTS],
    pub first: u32,
    pub scales: [f32; GRID_OUTPUTS],
    pub outputs: [u8; GRID_OUTPUTS],
    pub width: u8,
    pub integer: bool,
}

impl GridLookup {
    /// No inputs or outputs: all zeros.
    pub(super) const EMPTY: Self = Self {
        spans: [Span::EMPTY; GRID_INPUTS],
        strides: [0; GRID_INPUTS],
        first: 0,
        scales: [0.0; GRID_OUTPUTS],
        outputs: [0; GRID_OUTPUTS],
        width: 0,
        integer: false,
    };
}

/// Number of outputs of a plain grid.
pub(crate) const PLAIN_WIDTH: usize = 3;
