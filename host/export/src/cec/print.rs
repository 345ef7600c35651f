//! Writes tables in the language of the controller.

use super::axes::NamedAxes;
use super::{CecTable, TravelDirection};
use std::fmt::Write;

/// The text of a file, whose tables are numbered from `first`, with `comments` at the start.
///
/// Numbers have the fewest digits that read back as the same number.
#[must_use]
pub fn print(tables: &[CecTable], axes: &NamedAxes, first: usize, comments: &[String]) -> String {
    let names = |table: &CecTable| [table.input, table.output].map(|axis| axes.name(axis));
    let letters = |table: &CecTable| [table.input, table.output].map(|axis| axes.letter(axis));
    let mut text = begin(comments);
    for (index, table) in tables.iter().enumerate() {
        let [input, output] = letters(table);
        let number = first + index;
        let times = match table.times {
            Some(times) => format!(", times table {}", first + times),
            None => String::new(),
        };
        let count = table.stored();
        let _ = writeln!(
            text,
            "; table {number}: d{output} by {input}{times}, {count} values"
        );
        one(&mut text, table, number, &names(table), first);
    }
    text + "M17\n"
}

/// Everything before the first table.
pub fn begin(comments: &[String]) -> String {
    let mut text = "%_N_NC_CEC_INI\n".to_owned();
    for comment in comments {
        let is_plain = |c: char| {
            if c.is_ascii() && !c.is_control() {
                c
            } else {
                '?'
            }
        };
        let comment: String = comment.chars().map(is_plain).collect();
        let _ = writeln!(text, "; {comment}");
    }
    text + "METRIC\nCHANDATA(1)\n"
}

/// A table with the names of its axes.
pub fn one(
    text: &mut String,
    table: &CecTable,
    number: usize,
    [input, output]: &[String; 2],
    first: usize,
) {
    let modulo = table.spacing.modulo;
    let again = table.values.first().filter(|_| modulo);
    for (k, value) in table.values.iter().chain(again).enumerate() {
        let _ = writeln!(text, "$AN_CEC[{number},{k}]={}", value + 0.0);
    }
    let written = table.spacing.written();
    let direction = match table.travel {
        TravelDirection::Both => 0,
        TravelDirection::Positive => 1,
        TravelDirection::Negative => -1,
    };
    let mut set = |name: &str, value: &dyn std::fmt::Display| {
        let _ = writeln!(text, "${name}[{number}]={value}");
    };
    set("AN_CEC_INPUT_AXIS", input);
    set("AN_CEC_OUTPUT_AXIS", output);
    set("AN_CEC_STEP", &written.step);
    set("AN_CEC_MIN", &written.min);
    set("AN_CEC_MAX", &written.max);
    set("AN_CEC_IS_MODULO", &u8::from(modulo));
    set("AN_CEC_DIRECTION", &direction);
    // The number of a table is its index + 1.
    let times = table.times.map_or(0, |times| first + times + 1);
    set("AN_CEC_MULT_BY_TABLE", &times);
    set("SN_CEC_TABLE_WEIGHT", &table.weight);
}
