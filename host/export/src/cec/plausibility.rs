//! Warns about values in tables that are more often a mistake than intended.

use super::axes::NamedAxes;
use super::raw::Raw;
use super::{CecTable, named};
use trueaxis_model::numbers::ascending;
use trueaxis_model::source::FileError;

/// Slope of a correction (mm/mm) above which a value is more likely a mistake; scale and straightness errors of
/// machine tools are a hundredth of it. Rotary corrections may be steep where the tool is parallel to an axis.
const SLOPE: f64 = 0.005;
/// An outlier deviates from its neighbours by more than this many times the median.
const TIMES: f64 = 8.0;
/// Smaller deviations (mm, deg) are not outliers.
const LEAST: f64 = 1e-3;

/// Warns about slopes that no machine has, and about single values that stand out.
///
/// Only applies to tables that are added themselves; factors may have any values.
pub fn doubts(
    tables: &[CecTable],
    raw: &[&Raw<'_>],
    axes: &NamedAxes,
    doubts: &mut Vec<FileError>,
) {
    let named = named(tables);
    for (index, table) in tables.iter().enumerate() {
        if table.times.is_some() || named[index] {
            continue;
        }
        let unit = axes.unit(table.output);
        let [output, input] = [table.output, table.input].map(|axis| axes.letter(axis));
        let (point, message, remedy) = if let Some(point) = outlier(&table.values) {
            (
                point,
                format!(
                    "the correction {output}({input}) stands out at {}: {} {unit} between {} and {}",
                    table.spacing.at(point),
                    table.values[point],
                    table.values[point - 1],
                    table.values[point + 1]
                ),
                "look whether a sign or a digit is wrong",
            )
        } else if !axes.is_rotary(table.input)
            && !axes.is_rotary(table.output)
            && let Some((point, slope)) = steepest(table)
            && slope > SLOPE
        {
            (
                point + 1,
                format!(
                    "the correction {output}({input}) changes by {:.3} µm/mm from {} to {}",
                    slope * 1e3,
                    table.spacing.at(point),
                    table.spacing.at(point + 1)
                ),
                "look whether the unit, MIN, MAX and STEP are right",
            )
        } else {
            continue;
        };
        let value = raw[index].values.get(&point);
        let span = value.map_or(&raw[index].span, |(_, span)| span).clone();
        doubts.push(FileError::here(span, message, remedy));
    }
}

/// The steepest interval and its slope.
fn steepest(table: &CecTable) -> Option<(usize, f64)> {
    let slopes = table.values.windows(2).map(|w| {
        f64::from(table.weight) * (f64::from(w[1]) - f64::from(w[0])).abs()
            / f64::from(table.spacing.step)
    });
    slopes.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The single value that does not fit its neighbours, if all others do.
fn outlier(values: &[f32]) -> Option<usize> {
    // A single wrong value makes three bends, which must be fewer than half of them.
    if values.len() < 8 {
        return None;
    }
    let off = |w: &[f32]| f64::from(w[1]) - 0.5 * (f64::from(w[0]) + f64::from(w[2]));
    let bends: Vec<f64> = values.windows(3).map(off).collect();
    let mut sizes: Vec<f64> = bends.iter().map(|b| b.abs()).collect();
    ascending(&mut sizes);
    let usual = sizes[(sizes.len() - 1) / 2];
    let (worst, bend) = bends
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    // The bends beside a value that is off by e are off by −e/2.
    let is_half = |neighbour: Option<&f64>| {
        neighbour.is_none_or(|n| (n + 0.5 * bend).abs() <= 0.2 * bend.abs())
    };
    let stands_out = bend.abs() > LEAST.max(TIMES * usual);
    let before = worst.checked_sub(1).and_then(|i| bends.get(i));
    (stands_out && is_half(before) && is_half(bends.get(worst + 1))).then_some(worst + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_value_that_is_off_stands_out_and_a_bend_does_not() {
        let smooth: Vec<f32> = (0..20).map(|i| 0.01 * libm::sinf(i as f32 * 0.4)).collect();
        assert_eq!(outlier(&smooth), None);
        for at in [1, 7, 18] {
            let mut values = smooth.clone();
            values[at] += 0.02;
            assert_eq!(outlier(&values), Some(at));
        }
        let bent: Vec<f32> = (0..20)
            .map(|i| if i < 10 { 0.0 } else { 0.01 * (i - 10) as f32 })
            .collect();
        assert_eq!(outlier(&bent), None);
        let step: Vec<f32> = (0..20).map(|i| if i < 10 { 0.0 } else { 0.01 }).collect();
        assert_eq!(outlier(&step), None);
        assert_eq!(outlier(&[0.0, 1.0, 0.0]), None);
    }
}
