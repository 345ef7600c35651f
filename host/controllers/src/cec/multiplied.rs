//! Checks the products of a file.

use super::raw::Raw;
use super::reading::{LengthUnit, ReadOptions};
use super::variable::KnownVariable;
use super::{CecTable, FactorTables};
use trueaxis_model::source::FileError;

/// Checks that products follow the rules.
pub(crate) fn check_products(
    tables: &[CecTable],
    raw: &[&Raw<'_>],
    reading: &ReadOptions<'_>,
    units: Option<LengthUnit>,
) -> Result<(), FileError> {
    for (index, table) in tables.iter().enumerate() {
        let Some(named) = table.times else {
            continue;
        };
        let at = |known: KnownVariable, index: usize| {
            let set = raw[index].settings.get(&known);
            set.map_or(raw[index].span.clone(), |(_, span)| span.clone())
        };
        let error = |message: &str, remedy: &str| {
            FileError::at(
                at(KnownVariable::Times, index),
                message,
                "multiplied here",
                remedy,
            )
        };
        let factor = &tables[named];
        if factor.output != table.output {
            return Err(error(
                "the tables of a product correct different axes",
                "a product is of tables with one OUTPUT_AXIS: copy the factor",
            ));
        }
        if named == index && reading.factor_tables == FactorTables::Added {
            return Err(error(
                "a table is multiplied by itself, where factor tables are added",
                "whether it is then added too is not documented: multiply by a copy of it",
            ));
        }
        if named != index && factor.times.is_some() {
            return Err(error(
                "the factor is itself multiplied by a table",
                "whether that is a product of three is not documented: copy the factor, with MULT_BY_TABLE=0",
            ));
        }
        if let Some(weighted) = [index, named]
            .into_iter()
            .find(|i| tables[*i].weight != 1.0)
        {
            return Err(FileError::at(
                at(KnownVariable::Weight, weighted),
                "a table of a product has a weight",
                "here",
                "whether weights enter products is not documented: multiply the values by it, and leave it out",
            ));
        }
        if units == Some(LengthUnit::Inch) && !reading.axes.is_rotary(table.output) {
            return Err(error(
                "a product of tables in inches",
                "the unit in which the controller multiplies is not documented: write the file in METRIC",
            ));
        }
    }
    Ok(())
}
