//! What evaluation needs of banks, grids and terms, divided and checked once at load.

use crate::description::{Bank, Direction, FACTORS, GRID_INPUTS, GRID_OUTPUTS, Interpolation};
use crate::load_error::{LoadError, Part};
use crate::room::{List, Room};
use crate::work;

/// Evenly spaced points along one input.
// `repr(C)`: the kernel reads the first two together with the line of a bank.
#[repr(C)]
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
    pub(crate) fn new(bank: &Bank, span: Span, integer: bool, table: u16) -> Self {
        let cubic = bank.interpolation == Interpolation::Cubic;
        let plain = !cubic && !integer && !bank.modulo && bank.direction == Direction::Both;
        Self {
            span,
            first: bank.first,
            table,
            tables: bank.tables,
            kind: match (plain, bank.points * u32::from(bank.tables)) {
                (true, 2) => Kind::Straight,
                (true, _) => Kind::Linear,
                _ => Kind::Other,
            },
            line: [0.0; 2],
            direction: bank.direction,
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
    /// Three inputs without modulo, f32, [`PLAIN_WIDTH`] outputs: the common kind.
    pub plain: bool,
}

/// Outputs of a plain grid.
pub(crate) const PLAIN_WIDTH: usize = 3;

/// [`PackedTerm::most`] of a term that is added with the pairs.
pub(crate) const PAIRED: u8 = u8::MAX;

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
    /// In the first term of a run: most factors of its terms, or [`PAIRED`].
    pub most: u8,
    /// Place among the adjustable weights, or [`FIXED`].
    pub place: u8,
}

/// What the kernel begins one output with; every output has one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head {
    /// Where the first value lies among those of all tables, bytes.
    pub first: u16,
    pub output: u8,
    /// How many pairs follow.
    pub pairs: u8,
    /// If no pairs do, how many single values.
    pub singles: u8,
}

/// Puts aside the terms that the kernel adds first: those of each output, from its first one on,
/// that have the weight 1 and up to two factors. That keeps the order of addition, and costs
/// less than the general way.
///
/// If the very first has one factor only, it becomes part of the head of its output. All others
/// are pairs: where the values of both factors lie among those of all tables, in bytes, the first
/// factor in the lower half. Behind the tables stand 1 for a missing factor, which changes no bit
/// of the product, and 0 for a missing first value. If all have one factor, no pairs are needed.
pub(crate) fn pair_up<C: Room>(
    outputs: usize,
    terms: &mut [PackedTerm],
    heads: &mut C::AxisList<Head>,
    pairs: &mut C::TermList<u32>,
) {
    for output in 0..outputs as u8 {
        work::count(2 * terms.len());
        let mut head = Head {
            first: 4 * (C::TABLES as u16 + 1),
            output,
            pairs: 0,
            singles: 0,
        };
        let leading = terms
            .iter()
            .filter(|t| t.output == output)
            .take_while(|t| t.weight == 1.0 && t.place == FIXED && t.count <= 2)
            .take(usize::from(u8::MAX));
        let (count, single) = leading.fold((0, true), |(count, single), term| {
            (count + 1, single && term.count == 1)
        });
        let leading = terms.iter_mut().filter(|t| t.output == output);
        let mut found = false;
        for term in leading.take(count) {
            let [a, b, ..] = term.factors.map(|factor| 4 * u32::from(factor));
            if !found && term.count == 1 {
                head.first = a as u16;
            } else if single {
                // As many fit as terms do.
                pairs.append(a);
                head.singles += 1;
            } else {
                pairs.append(a | b << 16);
                head.pairs += 1;
            }
            found = true;
            term.most = PAIRED;
        }
        heads.append(head);
    }
}

/// Groups neighbouring terms of the same output, so that the kernel's inner loop has no branch.
///
/// Up to two factors are one kind, the missing ones read as 1; otherwise the factor count must be
/// equal. Fixed and adjustable terms do not mix, nor those that are paired up with others.
pub(crate) fn group(terms: &mut [PackedTerm]) {
    let kind = |t: &PackedTerm| {
        let paired = t.most == PAIRED;
        (t.output, t.place == FIXED, paired, t.count.max(2))
    };
    let mut start = 0;
    while start < terms.len() {
        work::count(1);
        let first = kind(&terms[start]);
        let length = terms[start..]
            .iter()
            .take(usize::from(u16::MAX))
            .take_while(|t| kind(t) == first)
            .count();
        work::count(2 * length);
        let run = &mut terms[start..start + length];
        let most = run.iter().map(|t| t.count).max().unwrap_or(0);
        run[0].run = length as u16;
        if run[0].most != PAIRED {
            run[0].most = most;
        }
        start += length;
    }
}
