//! Recognizes compensations that already follow the rules, such as imported ones; they are written as they are, with their weights in
//! their values.

use super::spacing::Spacing;
use super::{CecTable, FactorTables, TravelDirection};
use trueaxis::{Bank, Direction, Interpolation, Largest};

/// Tables in the order of its terms, if it is what [`draft`](super::draft()) makes from tables.
pub fn literal(compensation: &Largest<'_>, factor_tables: FactorTables) -> Option<Vec<CecTable>> {
    let banks: Vec<&Bank> = compensation
        .banks()
        .iter()
        .flat_map(|bank| std::iter::repeat_n(bank, usize::from(bank.tables)))
        .collect();
    let mut places: Vec<Option<usize>> = vec![None; banks.len()];
    let mut tables: Vec<CecTable> = Vec::new();
    let mut factors: Vec<usize> = Vec::new();
    let mut put = |number: u8, output: u8, tables: &mut Vec<CecTable>| {
        let number = usize::from(number);
        if places[number].is_none() {
            places[number] = Some(tables.len());
            tables.push(table(compensation, banks[number], number, output)?);
            return Some((tables.len() - 1, true));
        }
        Some((places[number]?, false))
    };
    let axes = compensation.axes().len();
    if banks.iter().any(|bank| usize::from(bank.input) >= axes) || !compensation.grids().is_empty()
    {
        return None;
    }
    for term in compensation.terms() {
        if term.limits.is_some() {
            return None;
        }
        match *term.factors {
            [only] => {
                let (place, is_new) = put(only, term.output, &mut tables)?;
                if !is_new {
                    return None;
                }
                tables[place].weight = term.weight;
            }
            [named, own] if term.weight == 1.0 => {
                let (place, is_new) = put(named, term.output, &mut tables)?;
                let is_known = factors.contains(&place);
                let fits = match factor_tables {
                    FactorTables::Added => !is_new,
                    FactorTables::NotAdded => is_new || is_known,
                };
                let factor = &tables[place];
                let is_free = factor.times.is_none() && factor.weight == 1.0;
                if !fits || !is_free || factor.output != usize::from(term.output) {
                    return None;
                }
                factors.push(place);
                if named == own {
                    // Other tables must not be multiplied by a table that is itself multiplied.
                    if !is_new {
                        return None;
                    }
                    tables[place].times = Some(place);
                    continue;
                }
                let (own, is_new) = put(own, term.output, &mut tables)?;
                if !is_new {
                    return None;
                }
                tables[own].times = Some(place);
            }
            _ => return None,
        }
    }
    // A controller that loses a weight must not add larger values.
    for table in &mut tables {
        let weight = std::mem::replace(&mut table.weight, 1.0);
        table.values.iter_mut().for_each(|v| *v *= weight);
    }
    (tables.len() == banks.len() && !tables.is_empty()).then_some(tables)
}

/// A table as stored; `None` if a controller cannot use it unchanged.
fn table(compensation: &Largest<'_>, bank: &Bank, number: usize, output: u8) -> Option<CecTable> {
    let travel = match bank.direction {
        Direction::Both => TravelDirection::Both,
        Direction::Positive => TravelDirection::Positive,
        Direction::Negative => TravelDirection::Negative,
        Direction::Signed => return None,
    };
    let samples = (0..bank.points as usize).map(|k| compensation.sample(number, k));
    (bank.interpolation == Interpolation::Linear).then_some(())?;
    Some(CecTable {
        input: usize::from(bank.input),
        output: usize::from(output),
        spacing: Spacing::of(bank),
        values: samples.collect::<Option<_>>()?,
        travel,
        weight: 1.0,
        times: None,
    })
}
