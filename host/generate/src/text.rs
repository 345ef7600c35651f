//! What both languages write alike.

use crate::program::{Array, Samples};

/// The shortest decimal number that is read as this f32, with a point or an exponent.
pub fn number(value: f32) -> String {
    format!("{value:?}")
}

/// The samples in nested brackets, a row to a line; `suffix` follows each f32.
pub fn rows(array: &Array, brackets: [char; 2], suffix: &str) -> String {
    let [open, close] = brackets;
    let mut text = String::new();
    let last = array.points.last().copied().unwrap_or(1);
    let count: usize = array.points.iter().product();
    let sample = |index: usize| match &array.samples {
        Samples::Floats(values) => format!("{}{suffix}", number(values[index])),
        Samples::Shorts(values) => values[index].to_string(),
    };
    // How many levels of brackets begin or end at a row: those whose inner counts it is a multiple of.
    let levels = |row: usize| {
        let mut size = 1;
        let mut count = 0;
        for points in array.points.iter().rev() {
            size *= points;
            count += usize::from(row.is_multiple_of(size));
        }
        count
    };
    for row in 0..count {
        let begins = levels(row);
        let ends = levels(row + 1);
        text.extend(std::iter::repeat_n(open, begins));
        if begins > 0 && last > 1 {
            text.push('\n');
        }
        let samples: Vec<String> = (0..array.columns)
            .map(|k| sample(row * array.columns + k))
            .collect();
        text += &format!("    {open}{}{close},\n", samples.join(", "));
        text.extend(std::iter::repeat_n(close, ends));
        if ends > 0 && row + 1 < count {
            text.push_str(",\n");
        }
    }
    text
}
