//! `trueaxis eval` at recorded positions.

use super::bench::LinuxCncBench;
use programs::csv;
use std::fmt::Write;

/// Corrections at these positions, in mm and degrees, in the order of `columns`, the inputs of the blob, of which the
/// first `axes` are axes; all as text that preserves every bit.
pub fn eval(
    bench: &LinuxCncBench,
    blob: &str,
    columns: &[&str],
    axes: usize,
    positions: &[Vec<f64>],
) -> Result<Vec<Vec<f32>>, String> {
    let mut text = columns.join(",");
    for row in positions {
        for (k, value) in row.iter().enumerate() {
            let separator = if k == 0 { '\n' } else { ',' };
            let _ = write!(text, "{separator}{value:?}");
        }
    }
    text.push('\n');
    bench.write("positions.csv", text)?;
    let printed = bench.trueaxis(&["eval", blob, "--positions", "positions.csv"])?;
    let corrections: Vec<String> = columns[..axes]
        .iter()
        .map(|axis| format!("d{axis}"))
        .collect();
    let rows = csv::columns::<f32>(&printed, &corrections).map_err(|e| format!("{blob}: {e}"))?;
    if rows.len() == positions.len() {
        Ok(rows)
    } else {
        Err(format!(
            "{} corrections for {} positions",
            rows.len(),
            positions.len()
        ))
    }
}

/// The rate bound of an axis, mm/s or degrees/s, as printed by `trueaxis inspect`: `  Y  0 to 300 mm  correction within
/// 0.147 mm, 6.396 mm/s; …`; plus its rounding error.
pub fn rate_bound(bench: &LinuxCncBench, blob: &str, letter: &str) -> Result<f64, String> {
    let printed = bench.trueaxis(&["inspect", blob])?;
    let mut lines = printed.lines();
    let line = lines.find(|l| l.starts_with(&format!("  {letter}  ")));
    let rate = line
        .and_then(|l| l.split("/s;").next())
        .and_then(|l| l.rsplit(' ').nth(1))
        .and_then(|number| number.parse::<f64>().ok());
    let rate = rate.ok_or_else(|| format!("{blob}: no rate bound of {letter}"))?;
    Ok(rate + 0.0005)
}
