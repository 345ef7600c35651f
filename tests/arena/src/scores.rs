//! Scores as a file, and their comparison with those that were published.

use crate::class::Class;
use crate::table::Scored;
use std::fmt::Write;

const HEADER: &str = "machine,class,name,tip_um,direction_urad,parameters_left,parameter_interval_um,within,interval_um,direction_within,direction_interval_urad,instructions,bytes,is_worse,failed\n";
/// Columns that identify a row.
const KEYS: usize = 3;
/// Figures agree within this part of them, and this much: another processor or library rounds sines differently, and an
/// identification may then leave out another of two equal parameters.
const RELATIVE: f64 = 0.02;
const ABSOLUTE: f64 = 0.02;

fn row(scored: &Scored) -> String {
    let score = &scored.score;
    let number = |value: f64| format!("{value:.4}");
    let maybe = |value: Option<f64>| value.map(number).unwrap_or_default();
    let cells = [
        scored.machine.to_string(),
        Class::of(scored.machine).to_string(),
        scored.name.clone(),
        number(score.tip),
        number(score.direction),
        maybe(score.parameters),
        maybe(score.parameter_interval),
        number(score.within[0]),
        number(score.interval[0]),
        number(score.within[1]),
        number(score.interval[1]),
        score
            .cost
            .map(|c| format!("{:.0}", c.instructions))
            .unwrap_or_default(),
        score.cost.map(|c| c.bytes.to_string()).unwrap_or_default(),
        score.is_worse.to_string(),
        scored.failure.is_some().to_string(),
    ];
    cells.join(",")
}

/// Scores as CSV.
#[must_use]
pub fn write(scored: &[Scored]) -> String {
    let mut text = HEADER.to_owned();
    for one in scored {
        let _ = writeln!(text, "{}", row(one));
    }
    text
}

/// Rows of scores that differ from the published ones, each with both.
#[must_use]
pub fn differences(scored: &[Scored], published: &str) -> Vec<String> {
    let key = |line: &str| line.split(',').take(KEYS).collect::<Vec<_>>().join(",");
    let each = scored.iter().filter_map(|one| {
        let found = row(one);
        let same = published.lines().find(|line| key(line) == key(&found));
        match same {
            None => Some(format!("{found} is not published")),
            Some(line) if is_close(line, &found) => None,
            Some(line) => Some(format!("{found} is published as {line}")),
        }
    });
    each.collect()
}

fn is_close(one: &str, other: &str) -> bool {
    let cells = one.split(',').zip(other.split(','));
    one.split(',').count() == other.split(',').count()
        && cells
            .skip(KEYS)
            .all(|(a, b)| match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(a), Ok(b)) => (a - b).abs() <= ABSOLUTE + RELATIVE * a.abs(),
                _ => a == b,
            })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_that_differ_by_more_than_rounding_are_reported() {
        let line = "3,rich motions,exact,1.5000,20.0000,,,0.9500,3.0000,400,900,false,false";
        assert!(is_close(line, &line.replace("1.5000", "1.5300")));
        for (from, to) in [
            ("1.5000", "1.7000"),
            ("false,false", "false,true"),
            (",400,", ",,"),
        ] {
            assert!(!is_close(line, &line.replace(from, to)), "{to}");
        }
    }
}
