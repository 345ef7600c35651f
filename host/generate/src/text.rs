//! What Rust and C write alike: numbers, samples, expressions.

use crate::check::Check;
use crate::program::{Array, Operation, Program, Samples, Statement, Value};
use trueaxis::Travel;

/// How a language writes expressions.
pub struct Syntax {
    /// What follows an f32.
    pub float: &'static str,
    /// What follows the integer that is added to an index.
    pub integer: &'static str,
    /// What stands around a 16-bit integer that becomes an f32.
    pub short: [&'static str; 2],
    /// Brackets around products in a sum, too.
    pub has_every_bracket: bool,
    /// What the names of helping functions begin with.
    pub helper: &'static str,
}

impl Syntax {
    /// An expression.
    pub fn show(&self, program: &Program, value: &Value) -> String {
        self.nested(program, value, false)
    }

    /// An expression; in brackets if it is an operation, or negative, within another operation.
    fn nested(&self, program: &Program, value: &Value, is_inner: bool) -> String {
        let (show, helper) = (|value: &Value| self.show(program, value), self.helper);
        let number = |value: f32| number(value) + self.float;
        match value {
            Value::Input(k) => format!("inputs[{k}]"),
            Value::Weight(k) => format!("weights[{k}]"),
            Value::Number(value) => match is_inner && value.is_sign_negative() {
                true => format!("({})", number(*value)),
                false => number(*value),
            },
            Value::Local(local) => program.name(*local).to_owned(),
            Value::Sample(array, at, column) => {
                let at = at.iter().map(|(index, offset)| {
                    let index = program.name(*index);
                    match offset {
                        0 => format!("[{index}]"),
                        _ => format!("[{index} + {offset}{}]", self.integer),
                    }
                });
                self.sample(&program.arrays[*array], &at.collect::<String>(), *column)
            }
            Value::Binary(operation, a, b) => {
                let text = self.binary(program, *operation, [a, b]);
                if is_inner { format!("({text})") } else { text }
            }
            Value::Negated(value) => format!("-{}", self.nested(program, value, true)),
            Value::Reduced(value, period, inverse) => {
                let [period, inverse] = [*period, *inverse].map(number);
                format!("{helper}reduced({}, {period}, {inverse})", show(value))
            }
            Value::Line(steps, values) => {
                let values = values.map(number).join(", ");
                format!("{helper}line({}, {values})", show(steps))
            }
            Value::ByTravel(axis, positive, negative) => {
                let [positive, negative] = [positive, negative].map(|value| show(value));
                format!("{helper}by_travel(travel[{axis}], {positive}, {negative})")
            }
        }
    }

    /// A sample as a float; `at` is the index of its row, in brackets.
    fn sample(&self, array: &Array, at: &str, column: usize) -> String {
        let sample = format!("{}{at}[{column}]", array.name);
        match array.samples {
            Samples::Floats(_) => sample,
            Samples::Shorts(_) => self.short[0].to_owned() + &sample + self.short[1],
        }
    }

    /// An operation without brackets around it.
    fn binary(&self, program: &Program, operation: Operation, [a, b]: [&Value; 2]) -> String {
        let sign = match operation {
            Operation::Add => '+',
            Operation::Subtract => '-',
            Operation::Multiply => '*',
        };
        let is_product = operation == Operation::Multiply;
        // Operations of one rank are done from left to right, and products before sums.
        let has_brackets = |value: &Value, is_right: bool| match value {
            Value::Binary(inner, ..) => match (*inner == Operation::Multiply) == is_product {
                true => is_right,
                false => is_product || self.has_every_bracket,
            },
            _ => true,
        };
        let left = self.nested(program, a, has_brackets(a, false));
        let right = self.nested(program, b, has_brackets(b, true));
        format!("{left} {sign} {right}")
    }
}

/// Those functions that a program calls: for intervals that are held, circular ones, lines, and directions of travel.
pub fn helpers(program: &Program, [held, circular, line, by_travel]: [&str; 4]) -> String {
    let any = |is: bool| {
        let mut all = program.statements.iter();
        all.any(|s| matches!(s, Statement::Interval { is_circular, .. } if *is_circular == is))
    };
    let used = [
        (any(false), held),
        (any(true), circular),
        (program.has_lines, line),
        (program.is_directional, by_travel),
    ];
    used.iter()
        .filter(|(is, _)| *is)
        .map(|(_, text)| *text)
        .collect()
}

/// A text from a blob or a path as part of a comment: one line that ends no comment and reads as it is stored.
pub fn plain(text: &str) -> String {
    // Marks that turn the direction of writing, join or separate lines would show other code than there is.
    let hidden = |c: char| {
        c.is_control()
            || matches!(c, '\\' | '\u{ad}' | '\u{61c}' | '\u{180e}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}')
            || matches!(c, '\u{2060}'..='\u{206f}' | '\u{feff}' | '\u{fff9}'..='\u{fffb}' | '\u{e0000}'..='\u{e007f}')
    };
    let printable = |c: char| if hidden(c) { ' ' } else { c };
    let text: String = text.chars().map(printable).collect();
    text.replace("*/", "* /").replace("/*", "/ *")
}

/// The shortest decimal number that is read as this f32, with a point or an exponent.
pub fn number(value: f32) -> String {
    format!("{value:?}")
}

/// The calls of a check, a line each: what the code takes, and its corrections; `suffix` follows each f32.
pub fn checks(
    program: &Program,
    checks: &[Check],
    brackets: [char; 2],
    outer: [char; 2],
    suffix: &str,
) -> String {
    let list = |values: Vec<String>| format!("{}{}{}", brackets[0], values.join(", "), brackets[1]);
    let floats = |values: &[f32]| list(values.iter().map(|&v| number(v) + suffix).collect());
    let line = |check: &Check| {
        let mut parts = vec![floats(&check.inputs)];
        if program.is_directional {
            parts.push(list(
                check.travel.iter().map(|&t| sign(t).to_owned()).collect(),
            ));
        }
        if program.weights > 0 {
            parts.push(floats(&check.weights));
        }
        parts.push(floats(&check.corrections));
        format!("    {}{}{},\n", outer[0], parts.join(", "), outer[1])
    };
    checks.iter().map(line).collect()
}

/// Bytes as decimal numbers, 24 to a line.
pub fn lines_of_bytes(bytes: &[u8]) -> String {
    let lines = bytes.chunks(24).map(|line| {
        let line: Vec<String> = line.iter().map(u8::to_string).collect();
        format!("    {},\n", line.join(", "))
    });
    lines.collect()
}

fn sign(travel: Travel) -> &'static str {
    match travel {
        Travel::Positive => "1",
        Travel::Negative => "-1",
        Travel::Unknown => "0",
    }
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
