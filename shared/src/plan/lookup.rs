//! What evaluation needs of banks and grids.

use super::span::Span;
use crate::description::{Bank, Direction, GRID_INPUTS, GRID_OUTPUTS, Interpolation, SampleFormat};

/// One bank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BankLookup {
    /// Its points. They are read directly if the tables are linear, hold for both directions and have f32
    /// samples.
    pub span: Span,
    /// Whether it is read directly and has one table of two points: then `line` is all that is read.
    pub straight: bool,
    /// The first sample, and the difference of the second from it.
    pub line: [f32; 2],
    /// First sample in its section.
    pub first: u32,
    /// Number of the first table.
    pub table: u16,
    /// Tables per row, at least 1.
    pub tables: u16,
    pub direction: Direction,
    pub cubic: bool,
    pub integer: bool,
}

impl BankLookup {
    /// Without its place among the tables.
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

/// One grid. Inputs that are missing are spans of one node, so that every grid has three.
///
/// The common kind is *plain*: three inputs and [`PLAIN_WIDTH`] outputs of f32 samples. Only the points of
/// such a grid are read directly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GridLookup {
    pub spans: [Span; GRID_INPUTS],
    /// Samples from one node to the next along each input.
    pub strides: [u32; GRID_INPUTS],
    pub first: u32,
    pub scales: [f32; GRID_OUTPUTS],
    pub outputs: [u8; GRID_OUTPUTS],
    pub width: u8,
    pub integer: bool,
}

impl GridLookup {
    /// Without inputs and outputs: all zeros.
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

/// Outputs of a plain grid.
pub(crate) const PLAIN_WIDTH: usize = 3;
