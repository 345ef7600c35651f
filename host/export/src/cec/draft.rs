//! From tables to a compensation.

use super::axes::NamedAxes;
use super::{CecTable, FactorTables, TravelDirection, named};
use trueaxis::{Auxiliary, Direction, Draft, DraftBank, Interpolation, Policy, SampleFormat, Term};

/// A compensation with the effect of a controller with these tables. Its bounds are those of `axes`.
///
/// Terms are in the order of the tables, except that factors come before the tables that they multiply. The factors
/// of a product are the table named by `MULT_BY_TABLE`, then the one that names it.
#[must_use]
pub fn draft(
    machine: &str,
    policy: Policy,
    axes: &NamedAxes,
    auxiliaries: Vec<Auxiliary>,
    tables: &[CecTable],
    factor_tables: FactorTables,
) -> Draft {
    let banks = banks(tables);
    let mut numbers = vec![0_u8; tables.len()];
    let members = banks.iter().flat_map(|(_, members)| members);
    for (number, member) in members.enumerate() {
        // More than 255 are rejected when a file is read, and when a plan is made.
        numbers[*member] = number as u8;
    }
    Draft {
        terms: terms(tables, &numbers, factor_tables),
        machine: machine.to_owned(),
        policy,
        axes: axes.axes.clone(),
        auxiliaries,
        banks: banks.into_iter().map(|(bank, _)| bank).collect(),
        grids: Vec::new(),
        notes: trueaxis::Notes::default(),
    }
}

/// Banks of tables with the same points, and which tables they have.
fn banks(tables: &[CecTable]) -> Vec<(DraftBank, Vec<usize>)> {
    let mut banks: Vec<(DraftBank, Vec<usize>)> = Vec::new();
    for (index, table) in tables.iter().enumerate() {
        let bank = bank(table);
        let is_same = |known: &DraftBank| {
            let empty = DraftBank {
                columns: Vec::new(),
                ..known.clone()
            };
            empty == bank && known.columns[0].len() == table.values.len()
        };
        match banks.iter_mut().find(|(known, _)| is_same(known)) {
            Some((known, members)) => {
                known.columns.push(table.values.clone());
                members.push(index);
            }
            None => banks.push((
                DraftBank {
                    columns: vec![table.values.clone()],
                    ..bank
                },
                vec![index],
            )),
        }
    }
    banks
}

/// The terms of tables with these numbers; the own term of a factor comes before its products.
fn terms(tables: &[CecTable], numbers: &[u8], factor_tables: FactorTables) -> Vec<Term> {
    let is_factor = named(tables);
    let mut terms = Vec::new();
    let mut done = vec![false; tables.len()];
    let mut put = |index: usize, terms: &mut Vec<Term>| {
        let table = &tables[index];
        let is_there = std::mem::replace(&mut done[index], true);
        let is_only_factor =
            table.times.is_none() && is_factor[index] && factor_tables == FactorTables::NotAdded;
        if is_there || is_only_factor {
            return;
        }
        let factors: &[u8] = match table.times {
            Some(named) => &[numbers[named], numbers[index]],
            None => &[numbers[index]],
        };
        terms.push(Term {
            output: table.output as u8,
            weight: table.weight,
            limits: None,
            factors: factors.iter().copied().collect(),
        });
    };
    for (index, table) in tables.iter().enumerate() {
        if let Some(named) = table.times {
            put(named, &mut terms);
        }
        put(index, &mut terms);
    }
    terms
}

/// The bank of a table, without its column.
fn bank(table: &CecTable) -> DraftBank {
    DraftBank {
        input: table.input as u8,
        start: table.spacing.start,
        step: table.spacing.step,
        modulo: table.spacing.modulo,
        direction: match table.travel {
            TravelDirection::Both => Direction::Both,
            TravelDirection::Positive => Direction::Positive,
            TravelDirection::Negative => Direction::Negative,
        },
        interpolation: Interpolation::Linear,
        format: SampleFormat::F32,
        columns: Vec::new(),
    }
}
