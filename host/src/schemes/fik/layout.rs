//! Tables and terms of chains.

use super::chains::{Chain, Factor};
use super::groups::Group;
use super::points::Points;
use std::collections::BTreeMap;
use trueaxis::{Direction, DraftBank, Interpolation, SampleFormat, Term};

/// A function is a straight line if it is off by this part of its largest value.
const STRAIGHT: f64 = 1e-12;

/// Tables that go into one bank: those of one input with the same points and the same use of the direction.
/// Straight ones have two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Bank {
    input: usize,
    signed: bool,
    bent: bool,
}

/// A table, and the output it is for.
struct Table<'a> {
    output: usize,
    factor: &'a Factor,
    bank: Bank,
}

/// What a term is for.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The term.
    pub term: Term,
    /// Its group; `None` for what is subtracted everywhere.
    pub group: Option<usize>,
}

/// The tables of chains as banks, and their terms; `limits` of the weight of each group that is adjustable.
pub fn layout(
    chains: &[Chain],
    groups: &[Group],
    limits: &[Option<[f32; 2]>],
    points: &[Points],
    format: SampleFormat,
) -> (Vec<DraftBank>, Vec<Placed>) {
    let mut tables: Vec<Table<'_>> = Vec::new();
    let mut places: Vec<Vec<usize>> = Vec::new();
    for chain in chains {
        let output = groups[chain.group].output;
        let mut place = |factor| {
            let shared = |t: &Table<'_>| {
                factor_is_shared(factor, t.factor) && t.output == output
            };
            tables.iter().position(shared).unwrap_or_else(|| {
                tables.push(Table {
                    output,
                    factor,
                    bank: bank(factor, &points[factor.function.input]),
                });
                tables.len() - 1
            })
        };
        places.push(chain.factors.iter().map(&mut place).collect());
    }
    let mut banks: BTreeMap<Bank, Vec<usize>> = BTreeMap::new();
    for (number, table) in tables.iter().enumerate() {
        banks.entry(table.bank).or_default().push(number);
    }
    let mut numbers = vec![0_u8; tables.len()];
    for (number, table) in banks.values().flatten().enumerate() {
        numbers[*table] = number as u8;
    }
    let banks = banks.iter().map(|(bank, columns)| {
        let points = &points[bank.input];
        let format = if bank.bent { format } else { SampleFormat::F32 };
        drafted(*bank, points, columns.iter().map(|c| tables[*c].factor), format)
    });
    let mut terms: Vec<Placed> = chains
        .iter()
        .zip(&places)
        .map(|(chain, places)| {
            let group = &groups[chain.group];
            let mut factors: Vec<u8> = places.iter().map(|p| numbers[*p]).collect();
            factors.sort_unstable();
            Placed {
                term: Term {
                    output: group.output as u8,
                    weight: group.weight as f32,
                    limits: limits[chain.group],
                    factors: factors.into_iter().collect(),
                },
                group: Some(chain.group),
            }
        })
        .collect();
    sort(&mut terms);
    (banks.collect(), terms)
}

/// Terms of one output and one length together, those with a fixed weight first: so they are fastest.
pub fn sort(terms: &mut [Placed]) {
    terms.sort_by(|a, b| {
        let key = |p: &Placed| (p.term.output, p.term.limits.is_some(), p.term.factors.len());
        let tables = a.term.factors[..].cmp(&b.term.factors[..]);
        key(a).cmp(&key(b)).then(tables)
    });
}

/// Whether two coordinates of one output are the same table.
fn factor_is_shared(a: &Factor, b: &Factor) -> bool {
    let (f, g) = (&a.function, &b.function);
    let off = f.values.iter().zip(&g.values).map(|(x, y)| (x - y).abs());
    let largest = f.values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    a.is_coordinate
        && b.is_coordinate
        && f.input == g.input
        && off.fold(0.0, f64::max) <= 1e-9 * largest
}

fn bank(factor: &Factor, points: &Points) -> Bank {
    let function = &factor.function;
    let values = &function.values;
    let [first, last] = points.ends();
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    let step = (values[last] - values[first]) / last as f64;
    let off = |(i, v): (usize, &f64)| (v - values[first] - step * i as f64).abs();
    let straight = values.iter().enumerate().map(off).fold(0.0, f64::max) <= STRAIGHT * largest;
    // A line that wraps would fall back within its last interval.
    let straight = straight && (!points.modulo || step == 0.0);
    Bank {
        input: function.input,
        signed: function.signed,
        bent: !straight,
    }
}

fn drafted<'a>(
    bank: Bank,
    points: &Points,
    factors: impl Iterator<Item = &'a Factor>,
    format: SampleFormat,
) -> DraftBank {
    let [first, last] = points.ends();
    let column = |factor: &Factor| {
        let values = &factor.function.values;
        match bank.bent {
            true => values.iter().map(|v| *v as f32).collect(),
            false => [values[first], values[last]].map(|v| v as f32).to_vec(),
        }
    };
    DraftBank {
        input: bank.input as u8,
        start: points.start,
        step: match bank.bent {
            true => points.step,
            false => points.step * last as f32,
        },
        modulo: points.modulo && bank.bent,
        direction: match bank.signed {
            true => Direction::Signed,
            false => Direction::Both,
        },
        interpolation: Interpolation::Linear,
        format,
        columns: factors.map(column).collect(),
    }
}
