//! A file that shows whether a controller adds factor tables.

use super::print::{begin, one};
use super::spacing::Spacing;
use super::{CecTable, TravelDirection};

/// Constant value of the first table (mm, deg): the factor.
pub const FACTOR: f32 = 0.005;
/// Range of the tables (mm, deg); they are constant inside and outside.
const END: f32 = 1000.0;

/// Two constant tables, 0.005 and 1, starting at number `first`, for the axis with this name. The second is
/// multiplied by the first. Their displayed sum is 0.005 if factor tables are not added, and 0.010 if they are.
#[must_use]
pub fn probe(axis: &str, first: usize) -> String {
    let table = |value: f32, times: Option<usize>| CecTable {
        input: 0,
        output: 0,
        spacing: Spacing {
            start: -END,
            step: 2.0 * END,
            points: 2,
            modulo: false,
        },
        values: vec![value; 2],
        travel: TravelDirection::Both,
        weight: 1.0,
        times,
    };
    let comments = [
        "trueaxis: are factor tables added by themselves?".to_owned(),
        format!("The compensation that is shown for {axis}, in mm or degrees:"),
        "  0.005  they are not:  --factor-tables not-added".to_owned(),
        "  0.010  they are:      --factor-tables added".to_owned(),
        "  anything else: export no products for this controller, and read the manual".to_owned(),
        "The axis may move by 1.01: stand clear.".to_owned(),
    ];
    let mut text = begin(&comments);
    let names = [axis.to_owned(), axis.to_owned()];
    let tables = [table(FACTOR, None), table(1.0, Some(0))];
    for (index, table) in tables.iter().enumerate() {
        one(&mut text, table, first + index, &names, first);
    }
    text + "M17\n"
}
