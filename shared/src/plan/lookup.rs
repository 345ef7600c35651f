//! What evaluation needs of banks and grids.

use super::span::Span;
use crate::description::{Bank, Direction, GRID_INPUTS, GRID_OUTPUTS, Interpolation, SampleFormat};

/// What the kernel does with a bank: the common kinds have loops of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// One table of two points, linear, f32, both directions, without modulo: no search.
    Straight,
    /// Linear, f32, both directions, without modulo.
    Linear,
    /// All others.
    Other,
}

/// One bank.
// `repr(C)`: see `Span`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct BankLookup {
    /// If it is [`Kind::Straight`], the first sample and the difference of the second from it.
    pub line: [f32; 2],
    pub span: Span,
    /// First sample in its section.
    pub first: u32,
    /// Number of the first table.
    pub table: u16,
    /// Tables per row, at least 1.
    pub tables: u16,
    pub kind: Kind,
    pub direction: Direction,
    pub cubic: bool,
    pub integer: bool,
}

impl BankLookup {
    /// Without its place among the tables.
    pub(super) fn new(bank: &Bank, span: Span) -> Self {
        let cubic = bank.interpolation == Interpolation::Cubic;
        let integer = bank.format == SampleFormat::I16;
        let plain = !cubic && !integer && !bank.modulo && bank.direction == Direction::Both;
        Self {
            span,
            first: bank.first,
            table: 0,
            tables: bank.tables,
            kind: match (plain, bank.points, bank.tables) {
                (true, 2, 1) => Kind::Straight,
                (true, ..) => Kind::Linear,
                _ => Kind::Other,
            },
            line: [0.0; 2],
            direction: bank.direction,
            cubic,
            integer,
        }
    }
}

/// Puts the straight banks first, with their lines, then the linear ones, and returns where these begin and
/// end. Guarantee 10.
pub(super) fn order(banks: &mut [BankLookup], samples: &[f32]) -> [u16; 2] {
    let mut ends = [0; 2];
    let mut placed = 0;
    for (kind, end) in [Kind::Straight, Kind::Linear].into_iter().zip(&mut ends) {
        let begin = placed;
        for k in begin..banks.len() {
            let (before, bank) = banks.split_at_mut(k);
            let Some(bank) = bank.first_mut().filter(|bank| bank.kind == kind) else {
                continue;
            };
            if kind == Kind::Straight {
                let first = bank.first as usize;
                let (a, b) = (samples[first], samples[first + 1]);
                bank.line = [a, b - a];
            }
            // Not the slice's `swap`: moving what may overlap takes a kilobyte and a half of code.
            if let Some(place) = before.get_mut(placed) {
                core::mem::swap(place, bank);
            }
            placed += 1;
        }
        *end = placed as u16;
    }
    ends
}

/// One grid. Inputs that are missing are spans of one node, so that every grid has three.
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
    /// Three inputs without modulo, f32, [`PLAIN_WIDTH`] outputs: the common kind.
    pub plain: bool,
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
        plain: false,
    };
}

/// Outputs of a plain grid.
pub(crate) const PLAIN_WIDTH: usize = 3;
