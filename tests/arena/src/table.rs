//! Scores of many machines, as tables.

use crate::class::Class;
use crate::score::Score;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// The scores of one way of compensation on one machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Scored {
    /// Number of the machine.
    pub machine: usize,
    /// Name of the scores.
    pub name: String,
    /// Scores; those without any correction if it failed.
    pub score: Score,
    /// Why it failed.
    pub failure: Option<String>,
}

/// The columns of a table.
const COLUMNS: [&str; 11] = [
    "",
    "failed",
    "worse than nothing",
    "tip: median / mean / worst",
    "direction: median / mean / worst",
    "parameters left",
    "their interval score",
    "within the band: tip / direction",
    "interval score: tip / direction",
    "instructions",
    "bytes",
];

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    match (values.len(), values.len() % 2) {
        (0, _) => None,
        (_, 1) => Some(values[middle]),
        _ => Some(0.5 * (values[middle - 1] + values[middle])),
    }
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// A number with three digits, or a dash.
fn shown(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(v) if v.abs() >= 100.0 => format!("{v:.0}"),
        Some(v) if v.abs() >= 10.0 => format!("{v:.1}"),
        Some(v) => format!("{v:.2}"),
    }
}

fn percent(value: Option<f64>) -> String {
    value.map_or("–".to_owned(), |v| format!("{:.1} %", 100.0 * v))
}

/// One row: all scores of one way of compensation.
fn row(name: &str, scored: &[&Scored]) -> Vec<String> {
    let all =
        |value: fn(&Score) -> f64| -> Vec<f64> { scored.iter().map(|s| value(&s.score)).collect() };
    let some = |value: &dyn Fn(&Score) -> Option<f64>| -> Vec<f64> {
        scored.iter().filter_map(|s| value(&s.score)).collect()
    };
    let three = |values: Vec<f64>| {
        let worst = values.iter().copied().reduce(f64::max);
        let mean = mean(&values);
        [median(values), mean, worst].map(shown).join(" / ")
    };
    let cost = |of: fn(&crate::Cost) -> f64| {
        let known = some(&|s| s.cost.as_ref().map(of));
        median(known).map_or("–".to_owned(), |v| format!("{v:.0}"))
    };
    let count = |is: fn(&Scored) -> bool| scored.iter().filter(|s| is(s)).count().to_string();
    vec![
        name.to_owned(),
        count(|s| s.failure.is_some()),
        count(|s| s.score.is_worse),
        three(all(|s| s.tip)),
        three(all(|s| s.direction)),
        percent(median(some(&|s| s.parameters))),
        shown(mean(&some(&|s| s.parameter_interval))),
        [all(|s| s.within[0]), all(|s| s.within[1])]
            .map(|w| percent(mean(&w)))
            .join(" / "),
        [all(|s| s.interval[0]), all(|s| s.interval[1])]
            .map(|i| shown(mean(&i)))
            .join(" / "),
        cost(|c| c.instructions),
        cost(|c| c.bytes as f64),
    ]
}

/// A table in Markdown with aligned columns.
fn aligned(header: &[&str], rows: &[Vec<String>]) -> String {
    let width = |column: usize| {
        let cells = rows.iter().map(|row| row[column].chars().count());
        cells
            .chain([header[column].chars().count(), 2])
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..header.len()).map(width).collect();
    let mut text = String::new();
    let mut line = |cells: &mut dyn Iterator<Item = &str>| {
        for (column, (cell, width)) in cells.zip(&widths).enumerate() {
            let _ = match column {
                0 => write!(text, "| {cell:width$} |"),
                _ => write!(text, " {cell:>width$} |"),
            };
        }
        text.push('\n');
    };
    line(&mut header.iter().copied());
    let rule = |column: usize| match column {
        0 => "-".repeat(widths[0]),
        _ => format!("{}:", "-".repeat(widths[column] - 1)),
    };
    let rules: Vec<String> = (0..header.len()).map(rule).collect();
    line(&mut rules.iter().map(String::as_str));
    for row in rows {
        line(&mut row.iter().map(String::as_str));
    }
    text
}

/// A table over some machines, with a row for each name in the order in which names first occur.
#[must_use]
pub fn table(scored: &[&Scored]) -> String {
    let mut names: Vec<&str> = Vec::new();
    for one in scored {
        if !names.contains(&one.name.as_str()) {
            names.push(&one.name);
        }
    }
    let rows: Vec<Vec<String>> = names
        .into_iter()
        .map(|name| {
            let own: Vec<&Scored> = scored.iter().copied().filter(|s| s.name == name).collect();
            row(name, &own)
        })
        .collect();
    aligned(&COLUMNS, &rows)
}

/// Number of different machines.
fn machines(scored: &[&Scored]) -> usize {
    let numbers: BTreeSet<usize> = scored.iter().map(|s| s.machine).collect();
    numbers.len()
}

/// The tables of all machines and of each class, and the failures.
#[must_use]
pub fn tables(scored: &[Scored]) -> String {
    let all: Vec<&Scored> = scored.iter().collect();
    let mut text = format!("## All {} machines\n\n{}", machines(&all), table(&all));
    for class in Class::ALL {
        let own: Vec<&Scored> = (scored.iter())
            .filter(|s| Class::of(s.machine) == class)
            .collect();
        if !own.is_empty() {
            let _ = write!(
                text,
                "\n## {class}: {} machines\n\n{}",
                machines(&own),
                table(&own)
            );
        }
    }
    let lists = [
        ("Failed", grouped(scored, |s| s.failure.clone())),
        (
            "Worse than nothing",
            grouped(scored, |s| s.score.is_worse.then(String::new)),
        ),
    ];
    for (heading, list) in lists {
        let _ = write!(text, "\n## {heading}\n\n");
        if list.is_empty() {
            text += "None.\n";
        }
        text += &list;
    }
    text
}

/// A list of machines for each name and each reason.
fn grouped(scored: &[Scored], reason: impl Fn(&Scored) -> Option<String>) -> String {
    let mut groups: BTreeMap<(String, String), Vec<usize>> = BTreeMap::new();
    for one in scored {
        if let Some(reason) = reason(one) {
            let key = (one.name.clone(), reason);
            groups.entry(key).or_default().push(one.machine);
        }
    }
    let mut text = String::new();
    for ((name, reason), machines) in groups {
        let numbers: Vec<String> = machines.iter().map(usize::to_string).collect();
        let reason = if reason.is_empty() {
            reason
        } else {
            format!(", {reason}")
        };
        let _ = writeln!(
            text,
            "- **{name}**{reason}: {} machines ({})",
            machines.len(),
            numbers.join(", ")
        );
    }
    text
}

/// The page with the scores of the baselines.
#[must_use]
pub fn page(scored: &[Scored], round: u64) -> String {
    format!(
        "# Scores of the arena\n\n\
         <!-- Written by `cargo xtask arena --page docs/evidence`: change that, not this. -->\n\n\
         The round with the seed {round}. [The arena](arena.md#scores) says what the columns mean; `arena-scores.csv` beside \
         this page\nhas every machine. Errors of tip and direction are root mean squares over the positions of a machine, in µm and\nµrad.\n\n{}",
        tables(scored)
    )
}
