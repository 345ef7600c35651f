//! The static figures of the page.

use super::{
    AxisMotions, AxisUse, CircularTest, Diagonal, ErrorBudget, Identification, MotionShown,
    Positioning, TableCurve, Volumetric,
};
use crate::picture::{Bars, Chart, ChartBar, Drawing, Ink, Mark, Polar, PolarTurn, Scale, Series};
use trueaxis_model::numbers::by;
use trueaxis_model::validate::Quality;
use trueaxis_study::validation::{Scatter, Validation};

/// Largest number of bars in one figure.
const BARS: usize = 30;
/// Shares below this (µm, µrad) get no bar.
const NOTHING: f64 = 1e-4;

/// A bar without uncertainty, for the errors of the tip or those of direction.
fn bar(name: &str, quality: &Quality, at_tip: bool) -> ChartBar {
    let statistics = match at_tip {
        true => quality.translation_um,
        false => quality.direction_urad,
    };
    ChartBar {
        name: name.to_owned(),
        mean: statistics.mean,
        max: statistics.max,
        uncertainty: None,
    }
}

/// Bars for the effect of each parameter at the tip or on the tool direction; `None` if there is no effect.
pub fn budget(budget: &ErrorBudget, together: &Volumetric, at_tip: bool) -> Option<Bars> {
    let of = |name: &str, quality: &Quality| bar(name, quality, at_tip);
    let alone = budget.shares.iter().map(|share| ChartBar {
        uncertainty: match at_tip {
            true => share.expanded_uncertainty_mean_um,
            false => share.expanded_uncertainty_mean_urad,
        },
        ..of(&share.name, &share.alone)
    });
    let alone: Vec<ChartBar> = alone.filter(|b| b.max >= NOTHING).collect();
    if alone.is_empty() {
        return None;
    }
    let alone = by(alone, |bar| -bar.mean);
    // What counts for whoever has no time: all of them together, and what the tables leave, with the uncertainty of the
    // parameters where it is known.
    let mut bars = vec![of("together", &together.before)];
    bars.extend(together.after.iter().map(|after| match &together.known {
        Some(known) => of("with the tables (95 %)", &known.with_tables(after)),
        None => of("with the tables", after),
    }));
    bars.extend(alone.into_iter().take(BARS));
    let (what, unit) = match at_tip {
        true => ("at the tip", "µm"),
        false => ("of the tool's direction", "µrad"),
    };
    let legend = [
        "mean over the travel",
        "maximum",
        "uncertainty of the mean (95 %)",
    ];
    Some(Bars {
        title: format!("Error {what} caused by each parameter alone, in {unit}"),
        label: format!("error {what} alone ({unit})"),
        legend: legend.map(str::to_owned),
        ink: Ink::Accent,
        bars,
    })
}

fn points(at: &[f64], values: &[f64], factor: f64) -> Vec<[f64; 2]> {
    at.iter()
        .zip(values)
        .map(|(x, y)| [*x, *y * factor])
        .collect()
}

fn series(name: &str, ink: Ink, mark: Mark, points: Vec<[f64; 2]>) -> Series {
    Series {
        name: name.to_owned(),
        ink,
        mark,
        points,
    }
}

fn chart(title: String, x: Scale, y: &str, shaded: Vec<[f64; 2]>, series: Vec<Series>) -> Chart {
    let values = series.iter().flat_map(|s| &s.points).map(|p| p[1]);
    Chart {
        title,
        x,
        y: Scale::around(y, values),
        shaded,
        series,
    }
}

/// The ranges of an axis with this name that were not measured.
fn unmeasured(axes: &[AxisMotions], name: &str) -> Vec<[f64; 2]> {
    let mut letters = axes.iter().filter(|axis| name == axis.axis.to_string());
    letters.next().map_or(Vec::new(), AxisMotions::unmeasured)
}

/// A curve over the positions of an axis, which gives it its name; two if they differ after negative travel.
fn after_travel(
    at: &[f64],
    positive: &[f64],
    negative: Option<&[f64]>,
    factor: f64,
) -> Vec<Series> {
    let line = |name: &str, ink: Ink, values: &[f64]| {
        series(name, ink, Mark::Line, points(at, values, factor))
    };
    match negative {
        Some(negative) => vec![
            line("after positive travel", Ink::Accent, positive),
            line("after negative travel", Ink::Other, negative),
        ],
        None => vec![line("", Ink::Accent, positive)],
    }
}

/// An error motion over the travel of its axis.
pub fn motion(axis: &AxisMotions, motion: &MotionShown) -> Chart {
    let negative = motion.negative.as_deref();
    let mut all = after_travel(&motion.at, &motion.positive, negative, 1.0);
    if !motion.measured_at.is_empty() {
        let measured = |points: &Series| {
            let is_measured = |p: &&[f64; 2]| motion.measured_at.contains(&p[0]);
            points.points.iter().filter(is_measured).copied().collect()
        };
        let marks: Vec<Series> = (all.iter())
            .map(|line| series("", line.ink, Mark::Points, measured(line)))
            .collect();
        all.extend(marks);
        if let Some(last) = all.last_mut() {
            last.name = "measured".to_owned();
        }
    }
    let x = Scale::exact(format!("{} ({})", axis.axis, axis.unit), axis.travel);
    let y = format!("{} ({})", motion.name, motion.unit);
    chart(
        format!("{}, {}, over {}", motion.name, motion.words, axis.axis),
        x,
        &y,
        axis.unmeasured(),
        all,
    )
}

/// A circular test.
pub fn circle(test: &CircularTest) -> Polar {
    let turn = |name: &str, ink, found: &super::CircleFound| PolarTurn {
        name: name.to_owned(),
        ink,
        readings: (found.angles_deg.iter().zip(&found.readings_um))
            .map(|(angle, reading)| (angle.to_radians(), *reading))
            .collect(),
    };
    let mut turns = vec![turn("before", Ink::Before, &test.before)];
    turns.extend(
        test.after
            .iter()
            .map(|after| turn("with the tables", Ink::After, after)),
    );
    let letter = |k: usize| test.plane.chars().nth(k).unwrap_or(' ').to_string();
    Polar {
        title: format!(
            "Circular test in {}, simulated, radius {} mm: radial deviation in µm",
            test.plane, test.radius_mm
        ),
        axes: [letter(0), letter(1)],
        unit: "µm".to_owned(),
        turns,
    }
}

/// Both directions, before and with the tables.
fn both_ways(at: &[f64], before: &[Vec<f64>; 2], after: Option<&[Vec<f64>; 2]>) -> Vec<Series> {
    let ways = |both: &[Vec<f64>; 2], names: [&str; 2], ink: Ink| {
        let [forth, back] = both;
        let mut all = vec![series(names[0], ink, Mark::Line, points(at, forth, 1.0))];
        if forth != back {
            all.push(series(names[1], ink, Mark::Dashed, points(at, back, 1.0)));
        }
        all
    };
    let mut all = ways(before, ["before", "before, backwards"], Ink::Before);
    let after = after.map(|after| {
        ways(
            after,
            ["with the tables", "with the tables, backwards"],
            Ink::After,
        )
    });
    all.extend(after.into_iter().flatten());
    all
}

/// A body diagonal.
pub fn diagonal(diagonal: &Diagonal) -> Chart {
    let all = both_ways(
        &diagonal.at_mm,
        &diagonal.before_um,
        diagonal.after_um.as_ref(),
    );
    let x = Scale::exact("along the diagonal (mm)", [0.0, diagonal.length_mm]);
    let title = format!("Deviation along the diagonal {}", diagonal.name);
    chart(title, x, "deviation (µm)", Vec::new(), all)
}

/// Positioning of a linear axis.
pub fn positioning(found: &Positioning, axes: &[AxisMotions]) -> Chart {
    let after = found.after.as_ref().map(|after| &after.deviations_um);
    let all = both_ways(&found.at_mm, &found.before.deviations_um, after);
    let ends = [found.at_mm.first(), found.at_mm.last()].map(|q| q.copied().unwrap_or(0.0));
    let x = Scale::exact(format!("{} (mm)", found.axis), ends);
    let title = format!(
        "Positioning of {} after positive and negative travel",
        found.axis
    );
    let shaded = unmeasured(axes, &found.axis.to_string());
    chart(title, x, "deviation (µm)", shaded, all)
}

/// Points of a line, thinned out to as many as a figure can resolve, including the last.
fn thinned(points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    const MOST: usize = 240;
    let (last, every) = (
        points.len().saturating_sub(1),
        points.len().div_ceil(MOST).max(1),
    );
    let kept = points
        .into_iter()
        .enumerate()
        .filter(|(k, _)| k % every == 0 || *k == last);
    kept.map(|(_, point)| point).collect()
}

/// A table.
pub fn curve(curve: &TableCurve, axes: &[AxisMotions]) -> Chart {
    let ends = [curve.at.first(), curve.at.last()].map(|q| q.copied().unwrap_or(0.0));
    let line = thinned(points(&curve.at, &curve.values, 1.0));
    // The axis has its name.
    let mut all = vec![series("", Ink::Accent, Mark::Line, line.clone())];
    if line.len() <= 80 {
        all.push(series("points", Ink::Accent, Mark::Points, line));
    }
    let x = Scale::exact(format!("{} ({})", curve.input, curve.input_unit), ends);
    let y = format!("{} ({})", curve.name, curve.unit);
    chart(
        format!("Table {} over {}", curve.name, curve.input),
        x,
        &y,
        unmeasured(axes, &curve.input),
        all,
    )
}

/// The correction of an axis along another, between its bounds; `None` if it varies along none.
pub fn along(used: &AxisUse, axes: &[AxisMotions]) -> Option<Chart> {
    let along = used.along.as_ref()?;
    let ends = [along.at.first(), along.at.last()].map(|q| q.copied().unwrap_or(0.0));
    let (factor, unit) = match used.unit.as_str() {
        "mm" => (1e3, "µm"),
        _ => (1e3, "0.001°"),
    };
    let mut all = after_travel(
        &along.at,
        &along.positive,
        along.negative.as_deref(),
        factor,
    );
    for (name, bound) in [("value bound", used.value_bound), ("", -used.value_bound)] {
        let line = ends.map(|q| [q, bound * factor]).to_vec();
        all.push(series(name, Ink::Muted, Mark::Dashed, line));
    }
    let x = Scale::exact(format!("{} ({})", along.axis, along.unit), ends);
    let title = format!(
        "Correction of {} along {}, between its bounds",
        used.axis, along.axis
    );
    Some(chart(
        title,
        x,
        &format!("Δ{} ({unit})", used.axis),
        unmeasured(axes, &along.axis.to_string()),
        all,
    ))
}

/// Residuals of an identification, ball by ball.
pub fn balls(identification: &Identification) -> Option<String> {
    let bars: Vec<ChartBar> = (identification.balls.iter())
        .map(|ball| ChartBar {
            name: format!("{} ({})", ball.name, ball.probings),
            mean: ball.left_um,
            max: ball.most_um,
            uncertainty: None,
        })
        .collect();
    let bars = Bars {
        title: "Residual at each ball, in µm".to_owned(),
        label: "residual at a ball, with its probings (µm)".to_owned(),
        legend: ["root mean square", "maximum", ""].map(str::to_owned),
        ink: Ink::After,
        bars,
    };
    (!bars.bars.is_empty()).then(|| bars.draw().inline())
}

/// What was measured before and after, beside what was predicted.
pub fn validation(found: &Validation) -> String {
    let bar = |name: &str, mean: f64, max: f64| ChartBar {
        name: name.to_owned(),
        mean,
        max,
        uncertainty: None,
    };
    let measured = |name: &str, scatter: Scatter| bar(name, scatter.rms_um, scatter.largest_um);
    let predicted = match found.unseen.is_empty() {
        true => "predicted, at most",
        false => "predicted from the measured errors",
    };
    let bars = Bars {
        title: "Scatter of the tip around the balls, before, after and as predicted, in µm"
            .to_owned(),
        label: "scatter of the tip (µm)".to_owned(),
        legend: ["root mean square", "maximum", ""].map(str::to_owned),
        ink: Ink::After,
        bars: vec![
            measured("before", found.before),
            measured("with the tables", found.after),
            bar(predicted, found.expected_um, found.expected_um),
        ],
    };
    bars.draw().inline()
}

/// Residuals of an identification over time, or over the rows if no time is known.
pub fn residuals(identification: &Identification) -> Option<String> {
    let rows = &identification.rows;
    let timed = rows.iter().all(|row| row.time_s.is_some());
    let at = |k: usize| match rows[k].time_s {
        Some(time) if timed => time / 60.0,
        _ => k as f64 + 1.0,
    };
    let component = |c: usize| {
        let all = rows.iter().enumerate();
        all.map(|(k, row)| [at(k), row.after_um[c]]).collect()
    };
    // The largest coordinate represents the row.
    let larger = |a: f64, b: &f64| if b.abs() > a.abs() { *b } else { a };
    let farthest = |of: &[f64; 3]| of.iter().fold(0.0, larger);
    let outliers = rows.iter().enumerate().filter(|(_, row)| !row.is_trusted);
    let outliers: Vec<[f64; 2]> = outliers
        .map(|(k, row)| [at(k), farthest(&row.after_um)])
        .collect();
    let all = [("x", Ink::Accent), ("y", Ink::Before), ("z", Ink::After)].into_iter();
    let all =
        (all.enumerate()).map(|(c, (name, ink))| series(name, ink, Mark::Points, component(c)));
    let mut all: Vec<Series> = all.collect();
    if !outliers.is_empty() {
        all.push(series("outliers", Ink::Text, Mark::Points, outliers));
    }
    let places = (0..rows.len()).map(at);
    let (low, high) = places.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
    let x = match timed {
        true => Scale::exact("time (min)", [low, high]),
        false => Scale::exact("probing", [low, high]),
    };
    let title = "Residual of each probing, in the workpiece frame, in µm".to_owned();
    (!rows.is_empty()).then(|| {
        chart(title, x, "residual (µm)", Vec::new(), all)
            .draw()
            .inline()
    })
}
