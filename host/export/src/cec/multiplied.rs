//! Checks the products of a file.

use super::raw::Raw;
use super::reading::{LengthUnit, ReadOptions};
use super::variable::Setting;
use super::{CecTable, FactorTables, TravelDirection, named};
use trueaxis_model::source::FileError;

const WEIGHT: (&str, &str) = (
    "a table of a product has a weight",
    "whether weights enter products is not documented: multiply the values by it, and leave it out",
);

/// Checks that products follow the rules.
pub(crate) fn check_products(
    tables: &[CecTable],
    raw: &[&Raw<'_>],
    reading: &ReadOptions<'_>,
    units: Option<LengthUnit>,
) -> Result<(), FileError> {
    for (own, table) in tables.iter().enumerate() {
        let Some(named) = table.times else { continue };
        let factor = &tables[named];
        let is_square = named == own;
        let is_added = reading.factor_tables == FactorTables::Added;
        let is_inch = units == Some(LengthUnit::Inch) && !reading.axes.is_rotary(table.output);
        let (at, (message, remedy)) = if factor.output != table.output {
            let remedy = "a product is of tables with one OUTPUT_AXIS: copy the factor";
            (
                own,
                ("the tables of a product correct different axes", remedy),
            )
        } else if is_square && is_added {
            let remedy = "whether it is then added too is not documented: multiply by a copy of it";
            let message = "a table is multiplied by itself, where factor tables are added";
            (own, (message, remedy))
        } else if !is_square && factor.times.is_some() {
            let remedy = "whether that is a product of three is not documented: copy the factor, with MULT_BY_TABLE=0";
            (own, ("the factor is itself multiplied by a table", remedy))
        } else if table.weight != 1.0 {
            (own, WEIGHT)
        } else if factor.weight != 1.0 {
            (named, WEIGHT)
        } else if is_inch {
            let remedy = "the unit in which the controller multiplies is not documented: write the file in METRIC";
            (own, ("a product of tables in inches", remedy))
        } else {
            continue;
        };
        let setting = match message == WEIGHT.0 {
            true => Setting::Weight,
            false => Setting::Times,
        };
        let written = raw[at].settings.get(&setting);
        let span = written.map_or(&raw[at].span, |(_, span)| span).clone();
        return Err(FileError::here(span, message, remedy));
    }
    Ok(())
}

/// Warns of factors with a direction of their own.
pub(crate) fn doubts(tables: &[CecTable], raw: &[&Raw<'_>], doubts: &mut Vec<FileError>) {
    let named = named(tables);
    let one_way = |index: &usize| tables[*index].travel != TravelDirection::Both;
    for index in (0..tables.len()).filter(|i| named[*i]).filter(one_way) {
        let direction = raw[index].settings.get(&Setting::Direction);
        let span = direction.map_or(&raw[index].span, |(_, span)| span).clone();
        doubts.push(FileError::here(
            span,
            "the factor of a product has a DIRECTION",
            "whether it counts in the other direction is not documented, and here it does not: give the direction to the table \
             that it multiplies",
        ));
    }
}
