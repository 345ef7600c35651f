//! Comments at the start of a file: what it is for, and what the machine data must allow.

use super::axes::NamedAxes;
use super::{CecPlan, CecTable, FactorTables, largest_sums};
use trueaxis::Largest;

/// The tool length (mm) for which tables hold, in words.
#[must_use]
pub fn for_tool(length: Option<f64>) -> String {
    match length {
        Some(length) => format!("{length} mm"),
        None => "the length in the machine file it was compiled with".to_owned(),
    }
}

/// Comments at the start of the file.
#[must_use]
pub fn comments(
    compensation: &Largest<'_>,
    factor_tables: FactorTables,
    length: Option<f64>,
    plan: &CecPlan,
    axes: &NamedAxes,
) -> Vec<String> {
    let most = plan.tables.iter().map(CecTable::stored).max();
    let mut comments = vec![
        format!("trueaxis: {}", compensation.machine()),
        format!(
            "for a controller with factor tables {}",
            factor_tables.name()
        ),
        format!("for one tool length: {}", for_tool(length)),
        format!(
            "MD18342: at most {} values in a table",
            most.unwrap_or_default()
        ),
    ];
    comments.push(
        "a controller keeps tables of earlier files: for those with higher numbers than here, $SN_CEC_TABLE_ENABLE[n]=0"
            .to_owned(),
    );
    for (axis, sum) in largest_sums(&plan.tables, factor_tables) {
        let rate = compensation.axes()[axis].rate_bound;
        comments.extend(axis_limits(axes, axis, sum, rate.into()));
    }
    if plan.tables.iter().any(|table| table.times.is_some()) {
        comments.push(
            "leave SD41310 $SN_CEC_TABLE_WEIGHT of all tables as it is in this file: products have"
                .to_owned(),
        );
        comments.push(
            "their weights multiplied in, and another weight would part corrections that belong together"
                .to_owned(),
        );
    }
    comments
}

/// What the machine data of an axis must allow, rounded up: `sum` in mm or degrees, `rate` per second.
fn axis_limits(axes: &NamedAxes, axis: usize, sum: f64, rate: f64) -> [String; 2] {
    let name = axes.name(axis);
    let sum = (sum * 1e6).ceil() / 1e6;
    let up = |value: f64, step: f64| (value / step).ceil() * step;
    // In the unit of MD32000.
    let (unit, rate) = match axes.is_rotary(axis) {
        true => (
            "deg",
            format!("{:.4} rev/min", up(rate * 60.0 / 360.0, 1e-4)),
        ),
        false => ("mm", format!("{:.1} mm/min", up(rate * 60.0, 0.1))),
    };
    [
        format!(
            "{name}: MD32710 $MA_CEC_ENABLE 1; MD32720 $MA_CEC_MAX_SUM at least {sum:.6} {unit}"
        ),
        format!("{name}: MD32730 $MA_CEC_MAX_VELO at least {rate}, as a percentage of MD32000"),
    ]
}
