//! What evaluation needs of banks, grids and terms, divided and checked once at load.

use crate::description::{Bank, Direction, FACTORS, GRID_INPUTS, GRID_OUTPUTS, Interpolation};
use crate::load_error::{LoadError, Part};

/// Evenly spaced points along one input.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    /// Position of the first point.
    pub start: f32,
    /// 1 / step.
    pub inverse_step: f32,
    /// Below this many steps from the start the position is used as it is …
    pub limit: f32,
    /// … otherwise this one is: the last point, or the first with modulo.
    pub beyond: f32,
    /// points · step, or 0 without modulo.
    pub period: f32,
    /// 1 / period, or 0 without modulo.
    pub inverse_period: f32,
    /// Index of the last point.
    pub last: u32,
    /// Index of the point after the last: the last itself, or the first with modulo.
    pub after: u32,
    /// Index of the input within `Inputs`, read as one array.
    pub slot: u8,
}

impl Span {
    pub(crate) const EMPTY: Self = Self {
        start: 0.0,
        inverse_step: 0.0,
        limit: 0.0,
        beyond: 0.0,
        period: 0.0,
        inverse_period: 0.0,
        last: 0,
        after: 0,
        slot: 0,
    };

    /// Checks the points and divides what evaluation multiplies.
    pub(crate) fn new(
        part: Part,
        slot: u8,
        start: f32,
        step: f32,
        points: u32,
        modulo: bool,
    ) -> Result<Self, LoadError> {
        let inverse_step = 1.0 / step;
        if !(step > 0.0 && step.is_finite() && inverse_step.is_finite()) {
            return Err(LoadError::Step { part });
        }
        // Beyond 2²⁴ not every index is an f32.
        if !(2..=1 << 24).contains(&points) {
            return Err(LoadError::Points { part, points });
        }
        let last = points - 1;
        if !(start.is_finite() && (start + last as f32 * step).is_finite()) {
            return Err(LoadError::Start { part });
        }
        if modulo {
            let period = points as f32 * step;
            let inverse_period = 1.0 / period;
            if !(period.is_finite() && inverse_period.is_finite()) {
                return Err(LoadError::Period { part });
            }
            Ok(Self {
                start,
                inverse_step,
                limit: points as f32,
                beyond: 0.0,
                period,
                inverse_period,
                last,
                after: 0,
                slot,
            })
        } else {
            Ok(Self {
                start,
                inverse_step,
                limit: last as f32,
                beyond: last as f32,
                period: 0.0,
                inverse_period: 0.0,
                last,
                after: last,
                slot,
            })
        }
    }

    pub(crate) fn is_modulo(&self) -> bool {
        self.period > 0.0
    }
}

/// One bank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BankLookup {
    pub span: Span,
    /// First sample in its section.
    pub first: u32,
    /// Tables per row, at least 1.
    pub tables: u16,
    pub direction: Direction,
    /// Two points, linear, without modulo: no search.
    pub straight: bool,
    pub cubic: bool,
    pub integer: bool,
}

impl BankLookup {
    pub(crate) fn new(bank: &Bank, span: Span, integer: bool) -> Self {
        let cubic = bank.interpolation == Interpolation::Cubic;
        Self {
            span,
            first: bank.first,
            tables: bank.tables,
            direction: bank.direction,
            straight: !cubic && !bank.modulo && bank.points == 2,
            cubic,
            integer,
        }
    }
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
}

/// Marks a term with a fixed weight.
pub(crate) const FIXED: u8 = u8::MAX;

/// One term as the kernel reads it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PackedTerm {
    pub weight: f32,
    /// Table numbers; from `count` on the number of the scratch place that holds 1.
    pub factors: [u8; FACTORS],
    /// In the first term of a run: how many terms the run has. Otherwise not read.
    pub run: u16,
    pub output: u8,
    pub count: u8,
    /// In the first term of a run: most factors of its terms, with [`UNIT`] if all weights are 1.
    pub shape: u8,
    /// Place among the adjustable weights, or [`FIXED`].
    pub place: u8,
}

/// Bit of [`PackedTerm::shape`]: every weight of the run is 1.
pub(crate) const UNIT: u8 = 0x80;

/// Groups neighbouring terms of the same output, so that the kernel's inner loop has no branch.
///
/// Up to two factors are one kind, the missing ones read as 1 (which changes no bit of the
/// product); otherwise the factor count must be equal. Fixed and adjustable terms do not mix.
pub(crate) fn group(terms: &mut [PackedTerm]) {
    let mut start = 0;
    while start < terms.len() {
        let kind = |t: &PackedTerm| (t.output, t.place == FIXED, t.count.max(2));
        let first = kind(&terms[start]);
        let length = terms[start..]
            .iter()
            .take(usize::from(u16::MAX))
            .take_while(|t| kind(t) == first)
            .count();
        let run = &terms[start..start + length];
        let most = run.iter().map(|t| t.count).max().unwrap_or(0);
        let unit = run.iter().all(|t| t.weight == 1.0 && t.place == FIXED);
        terms[start].run = length as u16;
        terms[start].shape = most | if unit { UNIT } else { 0 };
        start += length;
    }
}
