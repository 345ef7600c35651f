//! Terms as the kernel reads them, and the order in which it adds them.

use crate::description::FACTORS;
use crate::room::{List, Room};
use crate::work;

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
// `repr(C)`: the kernel reads two words.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Head {
    /// Where the first value lies among those of all tables, bytes.
    pub first: u16,
    /// If no pairs follow, how many single values do.
    pub singles: u16,
    /// Where the output lies among all of them, bytes.
    pub output: u16,
    /// How many pairs follow.
    pub pairs: u16,
}

/// Puts aside the terms that the kernel adds first: those of each output, from its first one on,
/// that have the weight 1 and up to two factors. That keeps the order of addition, and costs
/// less than the general way. Guarantee 8.
///
/// If the very first has one factor only, it becomes part of the head of its output. All others
/// are pairs: where the values of both factors lie among those of all tables, in bytes, the first
/// factor in the lower half. Behind the tables stand 1 for a missing factor, which changes no bit
/// of the product, and 0 for a missing first value. If all have one factor, no pairs are needed.
///
/// Outputs with pairs come first, then those with neither pairs nor single values. Returns where these begin
/// and end.
pub(super) fn pair_up<C: Room>(
    outputs: usize,
    terms: &mut [PackedTerm],
    heads: &mut C::AxisList<Head>,
    pairs: &mut C::TermList<u32>,
) -> [u16; 2] {
    for shape in [Shape::Pairs, Shape::Bare, Shape::Singles] {
        for output in 0..outputs as u8 {
            let count = leading(output, shape, terms);
            if let Some(count) = count {
                let terms = terms.iter_mut().filter(|t| t.output == output);
                heads.append(head::<C>(output, shape, terms.take(count), pairs));
            }
        }
    }
    let ends = |shape| {
        heads
            .iter()
            .take_while(|head| head.shape() <= shape)
            .count() as u16
    };
    [ends(Shape::Pairs), ends(Shape::Bare)]
}

/// How many terms of an output the kernel adds first, if what follows the first value is of this shape.
fn leading(output: u8, shape: Shape, terms: &[PackedTerm]) -> Option<usize> {
    work::count(2 * terms.len());
    let leading = terms
        .iter()
        .filter(|t| t.output == output)
        .take_while(|t| t.weight == 1.0 && t.place == FIXED && t.count <= 2)
        .take(usize::from(u8::MAX));
    let (count, single) = leading.fold((0, true), |(count, single), term| {
        (count + 1, single && term.count == 1)
    });
    let found = match (single, count) {
        (false, _) => Shape::Pairs,
        (true, 0 | 1) => Shape::Bare,
        (true, _) => Shape::Singles,
    };
    (found == shape).then_some(count)
}

/// What follows the first value of an output.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd)]
enum Shape {
    Pairs,
    Bare,
    Singles,
}

impl Head {
    fn shape(&self) -> Shape {
        match (self.pairs, self.singles) {
            (0, 0) => Shape::Bare,
            (0, _) => Shape::Singles,
            _ => Shape::Pairs,
        }
    }
}

/// The head of an output that begins with these terms.
fn head<'t, C: Room>(
    output: u8,
    shape: Shape,
    terms: impl Iterator<Item = &'t mut PackedTerm>,
    pairs: &mut C::TermList<u32>,
) -> Head {
    let mut head = Head {
        first: 4 * (C::TABLES as u16 + 1),
        singles: 0,
        output: 4 * u16::from(output),
        pairs: 0,
    };
    for (k, term) in terms.enumerate() {
        let [a, b, ..] = term.factors.map(|factor| 4 * u32::from(factor));
        if k == 0 && term.count == 1 {
            head.first = a as u16;
        } else if shape == Shape::Pairs {
            // As many fit as terms do.
            pairs.append(a | b << 16);
            head.pairs += 1;
        } else {
            pairs.append(a);
            head.singles += 1;
        }
        term.most = PAIRED;
    }
    head
}

/// What the terms of a group have in common.
fn kind(t: &PackedTerm) -> (u8, bool, bool, u8) {
    let paired = t.most == PAIRED;
    (t.output, t.place == FIXED, paired, t.count.max(2))
}

/// Groups neighbouring terms of the same output, so that the kernel's inner loop has no branch.
///
/// Up to two factors are one kind, the missing ones read as 1; otherwise the factor count must be
/// equal. Fixed and adjustable terms do not mix, nor those that are paired up with others. Guarantee 6.
pub(super) fn group(terms: &mut [PackedTerm]) {
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
