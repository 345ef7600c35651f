//! Terms as products of tables of one input each; every table serves one output.

use super::points::Points;
use std::collections::BTreeMap;
use trueaxis::{Direction, DraftBank, SampleFormat, Term};
use trueaxis_model::machine::{Machine, PerAxis};

/// A function of one input at its points.
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Index of the input.
    pub input: usize,
    /// True if its sign changes with the direction of travel.
    pub signed: bool,
    /// Values at the points of the input.
    pub values: Vec<f64>,
}

/// A factor of a product: a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// The content of the table.
    pub function: Function,
    /// True for a coordinate, which products of one output share.
    pub is_coordinate: bool,
}

/// A product of tables.
#[derive(Clone, Debug, PartialEq)]
pub struct Product {
    /// Index of the output axis.
    pub output: usize,
    /// Constant factor of the product of tables.
    pub weight: f64,
    /// The limits of an adjustable weight; `None` if the weight is fixed.
    pub limits: Option<[f32; 2]>,
    /// Tables, each of another input; a constant if empty.
    pub factors: Vec<Factor>,
    /// A number by which the scheme recognizes it.
    pub tag: usize,
}

/// A term with its tag.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The term.
    pub term: Term,
    /// The tag of its product.
    pub tag: usize,
}

/// A function is a straight line if it deviates by less than this fraction of its largest value.
const STRAIGHT: f64 = 1e-12;

/// Tables of one bank: the same input, points and use of the direction of travel. Straight tables have two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Bank {
    input: usize,
    signed: bool,
    bent: bool,
}

/// A table with its output.
struct Table<'a> {
    output: usize,
    factor: &'a Factor,
    bank: Bank,
}

/// The banks and terms of products; bent tables are stored in `format`. There may be more tables than a blob can
/// number.
pub fn layout(
    products: &[Product],
    points: &[Points],
    format: SampleFormat,
) -> (Vec<DraftBank>, Vec<Placed>) {
    let mut tables: Vec<Table<'_>> = Vec::new();
    let mut places: Vec<Vec<usize>> = Vec::new();
    for product in products {
        let output = product.output;
        let mut place = |factor| {
            let shared = |t: &Table<'_>| t.output == output && is_shared(factor, t.factor);
            tables.iter().position(shared).unwrap_or_else(|| {
                tables.push(Table {
                    output,
                    factor,
                    bank: bank(factor, &points[factor.function.input]),
                });
                tables.len() - 1
            })
        };
        places.push(product.factors.iter().map(&mut place).collect());
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
        let factors = columns.iter().map(|c| tables[*c].factor);
        drafted(*bank, points, factors, format)
    });
    let placed = products.iter().zip(&places).map(|(product, places)| {
        let mut factors: Vec<u8> = places.iter().map(|p| numbers[*p]).collect();
        factors.sort_unstable();
        Placed {
            term: Term {
                output: product.output as u8,
                weight: product.weight as f32,
                limits: product.limits,
                factors: factors.into_iter().collect(),
            },
            tag: product.tag,
        }
    });
    let mut placed: Vec<Placed> = placed.collect();
    sort(&mut placed);
    (banks.collect(), placed)
}

/// Products that subtract the correction (mm, rad) at the zero position everywhere.
pub fn subtracted(machine: &Machine, zero: &PerAxis) -> Vec<Product> {
    let zero = machine.to_command(zero);
    let some = zero.iter().enumerate().filter(|(_, zero)| **zero != 0.0);
    some.map(|(output, zero)| Product {
        output,
        weight: -zero,
        limits: None,
        factors: Vec::new(),
        tag: usize::MAX,
    })
    .collect()
}

/// Groups terms by output and length, those with a fixed weight first, which makes them fastest.
fn sort(terms: &mut [Placed]) {
    terms.sort_by(|a, b| {
        let key = |p: &Placed| (p.term.output, p.term.limits.is_some(), p.term.factors.len());
        let tables = a.term.factors[..].cmp(&b.term.factors[..]);
        key(a).cmp(&key(b)).then(tables)
    });
}

/// Whether two coordinates of one output are the same table.
fn is_shared(a: &Factor, b: &Factor) -> bool {
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
    // A straight line that wraps would jump back within its last interval.
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
            true => values.clone(),
            false => vec![values[first], values[last]],
        }
    };
    DraftBank {
        step: match bank.bent {
            true => points.step,
            false => points.step * last as f32,
        },
        modulo: points.modulo && bank.bent,
        direction: match bank.signed {
            true => Direction::Signed,
            false => Direction::Both,
        },
        ..points.bank(format, factors.map(column).collect())
    }
}
