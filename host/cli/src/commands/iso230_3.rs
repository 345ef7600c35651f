//! `trueaxis iso230-3`

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::output;
use clap::Args;
use std::path::PathBuf;
use trueaxis_direct::formats::displacements;
use trueaxis_direct::iso230_3::{Displacements, DriftAnalysis, DriftKind, DriftTestRecord, Unit};
use trueaxis_model::numbers::extremes;
use trueaxis_report::picture::{Chart, Drawing, Ink, Mark, Picture, Scale, Series};

/// Evaluate thermal drift to ISO 230-3: environment, rotating spindle, moving linear axis
///
/// Takes readings of up to five displacement sensors over time and prints how far each direction drifted (the range of
/// its readings), how the spindle inclined about X and Y, and the values after the times that you state. Drift counts
/// from the first reading.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis iso230-3 spindle.csv --at 60,240 --pictures drift\n\n\
The file begins with how it was measured; sensors, temperatures and a position of the axis may be left out:\n  \
# test = \"spindle\"            # or \"environment\"; or \"axis\", with # axis = \"X\"\n  \
# sensors_apart_mm = 120.0      # how far X2 and Y2 are from X1 and Y1 in +Z\n  \
# stops_at_s = 14400            # when the spindle stopped\n  \
time_s,x1_um,y1_um,x2_um,y2_um,z_um,housing_C\n  0,0.0,0.1,0.0,0.0,0.2,20.1\n  60,0.3,0.1,0.2,0.0,1.4,20.6"
)]
pub struct Arguments {
    /// Readings (CSV)
    readings: PathBuf,
    /// Print the values at these times after the first reading, in minutes
    #[arg(long, value_name = "MIN,…", value_delimiter = ',')]
    at: Vec<f64>,
    /// Write the courses over time into this folder, as SVG files
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let text = files::Text::read(&arguments.readings)?;
    let measured = displacements::read(&text.text).map_err(|error| text.bad(error))?;
    let [first, last] = measured.span();
    for minutes in &arguments.at {
        if !(0.0..=(last - first) / 60.0).contains(minutes) {
            return Err(BadInput::new(
                format!("--at {minutes}: nothing was read after {minutes} min"),
                format!("write times up to {:.1} min", (last - first) / 60.0),
            ));
        }
    }
    let record = DriftTestRecord::of(&measured, &arguments.at);
    if let Some(folder) = &arguments.pictures {
        output::write_pictures(folder, pictures(&measured, &record.results))?;
    }
    output::print_answer(arguments.json, &record, || {
        screen(&text.name, measured.readings.len(), &record)
    })?;
    Ok(Outcome::Done)
}

/// The text output.
fn screen(name: &str, readings: usize, record: &DriftTestRecord) -> String {
    let mut text = format!(
        "{name}: {}\n{readings} readings in {:.1} min",
        record.test, record.minutes
    );
    let stop = record.stopped_after_minutes;
    text += &stop.map_or(String::new(), |stop| {
        format!(", stopped after {stop:.1} min")
    });
    text.push('\n');
    for analysis in &record.results {
        text.push('\n');
        if let Some(position) = analysis.position_mm {
            text += &format!("at {position} mm\n");
        }
        text += &format!("{:<28}{:>10}", "", "range");
        if stop.is_some() {
            text += &format!("{:>12}{:>10}", "until stop", "after");
        }
        for minutes in &record.at_minutes {
            text += &format!("{:>13}", format!("at {minutes} min"));
        }
        text.push('\n');
        text.extend(analysis.drifts.iter().map(row));
    }
    text
}

/// The drift in one direction.
fn row(drift: &DriftKind) -> String {
    // Avoids "-0.00".
    let number = |v: f64| format!("{:.2}", (v * 100.0).round() / 100.0 + 0.0);
    let name = format!("{} ({})", drift.name, drift.unit);
    let mut text = format!("{name:<28}{:>10}", number(drift.range));
    if let (Some(until), Some(after)) = (drift.range_until_stop, drift.range_after_stop) {
        text += &format!("{:>12}{:>10}", number(until), number(after));
    }
    for value in &drift.at {
        text += &format!("{:>13}", value.map_or_else(|| "–".to_owned(), number));
    }
    text + "\n"
}

/// The courses of what has the same unit in a picture, with its name.
fn pictures(measured: &Displacements, found: &[DriftAnalysis]) -> Vec<(String, Picture)> {
    let mut pictures = Vec::new();
    for analysis in found {
        for (unit, what) in [
            (Unit::Length, "displacement"),
            (Unit::Angle, "tilt"),
            (Unit::Temperature, "temperature"),
            (Unit::Expansion, "expansion"),
        ] {
            let drifts: Vec<&DriftKind> = (analysis.drifts.iter())
                .filter(|d| d.unit == unit)
                .collect();
            if drifts.is_empty() {
                continue;
            }
            let name = match analysis.position_mm {
                Some(position) => format!("{what}-at-{position}"),
                None => what.to_owned(),
            };
            pictures.push((name, picture(measured, what, &drifts)));
        }
    }
    pictures
}

/// Courses over time.
fn picture(measured: &Displacements, what: &str, drifts: &[&DriftKind]) -> Picture {
    let [first, last] = measured.span();
    let unit = drifts[0].unit;
    let hours = |time: f64| (time - first) / 3600.0;
    let mut series: Vec<Series> = Vec::new();
    for (k, drift) in drifts.iter().enumerate() {
        let (ink, mark) = stroke(k);
        let points = drift.course.iter();
        let points = points.map(|[time, value]| [hours(*time), *value]);
        series.push(Series {
            name: drift.name.clone(),
            ink,
            mark,
            points: points.collect(),
        });
    }
    let values = series.iter().flat_map(|s| &s.points).map(|p| p[1]);
    let title = format!("{what} ({unit})");
    let y = match unit {
        // They are far from zero.
        Unit::Temperature => {
            let [low, high] = extremes(values);
            Scale::exact(title, [low - 0.5, high + 0.5])
        }
        _ => Scale::around(title, values),
    };
    if let Some(stop) = measured.stop {
        series.push(Series {
            name: "stop".to_owned(),
            ink: Ink::Muted,
            mark: Mark::Dashed,
            points: y.range.map(|v| [hours(stop), v]).to_vec(),
        });
    }
    Chart {
        title: format!("{what} over time: {}", measured.test),
        x: Scale::exact("time (h)", [0.0, hours(last)]),
        y,
        shaded: Vec::new(),
        series,
    }
    .draw()
}

/// How the course with this number is drawn.
fn stroke(number: usize) -> (Ink, Mark) {
    use Ink::{Accent, After, Before, Muted, Other, Text};
    const INKS: [Ink; 6] = [Accent, Before, Other, After, Text, Muted];
    let mark = match number < INKS.len() {
        true => Mark::Line,
        false => Mark::Dashed,
    };
    (INKS[number % INKS.len()], mark)
}
