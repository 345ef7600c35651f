//! Readings of a ball-bar as CSV: positions on a sphere, or angles on a circle.

use crate::ballbar::BallBarTurns;
use nalgebra::Vector3;
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use trueaxis_model::formats::csv::{self, CsvTable};
use trueaxis_model::formats::units;
use trueaxis_model::source::FileError;

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Radii {
    /// Nominal length of the bar (mm).
    pub radius: f64,
    /// The two axes of a circle, if the file names them.
    pub plane: Option<String>,
    /// Positions (mm, deg) of axes at the centre, by letter, if the file has them.
    pub at: Vec<(String, f64)>,
    /// The name of the machine, and where it is in the file, if the file has it.
    pub machine: Option<(Range<usize>, String)>,
    /// The readings.
    pub readings: RadiusReadings,
}

/// Readings of a test.
#[derive(Clone, Debug, PartialEq)]
pub enum RadiusReadings {
    /// On a circle.
    Circle(BallBarTurns),
    /// On a sphere: positions from its centre (mm), and the length of the bar minus the nominal (mm).
    Sphere(Vec<(Vector3<f64>, f64)>),
}

/// The lines that begin with `#`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RadiusHeading {
    radius_mm: Option<Spanned<f64>>,
    unit: Option<Spanned<String>>,
    plane: Option<String>,
    machine: Option<Spanned<String>>,
    at: Option<toml::Table>,
}

/// Readings that all differ from the number of the radius by less than this part of it are lengths.
const LENGTHS_NOT_DEVIATIONS: f64 = 2e-3;

const HEADING: &str = "begin the file with # radius_mm = 150.0 and # unit = \"um\" (or \"mm\"), each in a line of its own";
const COLUMNS: &str = "name the columns: angle,ccw,cw or angle,ccw or angle,cw on a circle (degrees), X,Y,Z,radial on a sphere (mm from the centre of the test)";
const VALUES: &str =
    "write one value per column, with a decimal point; on a circle a reading may be left out";
/// Permitted lengths of bars (mm).
const LENGTHS: Range<f64> = 1.0..10_000.0;
/// A position may differ from the bar's length by this fraction: feed-ins, and positions with a setup error.
const OFF: f64 = 0.1;

/// Names of columns, in any case.
const NAMES: [&str; 7] = ["angle", "ccw", "cw", "x", "y", "z", "radial"];

/// Reads a file.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: whatever [`CsvTable`] refuses, a heading without radius or unit, columns
/// of neither test, a position that is not near the sphere.
pub fn read(text: &str) -> Result<Radii, FileError> {
    let (heading, end): (RadiusHeading, usize) = csv::heading(text, HEADING)?;
    let (radius, factor) = heading.numbers()?;
    let table = CsvTable::open(text, end, COLUMNS, VALUES)?;
    let readings = readings(table, radius, factor)?;
    // Deviations scatter by more than a thousandth of themselves, lengths do not.
    let all: Vec<f64> = match &readings {
        RadiusReadings::Circle(turns) => {
            let turns = turns.counter_clockwise.iter().chain(&turns.clockwise);
            turns.map(|(_, value)| *value / factor).collect()
        }
        RadiusReadings::Sphere(all) => all.iter().map(|(_, value)| *value / factor).collect(),
    };
    let mean = all.iter().sum::<f64>() / all.len().max(1) as f64;
    let is_length = |value: &f64| (value - radius).abs() < LENGTHS_NOT_DEVIATIONS * radius;
    if !all.is_empty() && all.iter().all(is_length) {
        let unit = heading.unit.as_ref().map_or(0..0, |unit| unit.span());
        return Err(FileError::here(
            unit,
            format!(
                "the readings are about {mean:.4}: these are lengths of a bar of {radius} mm, in mm"
            ),
            "write deviations from radius_mm, in the unit that is stated: 0.0025 for 100.0025 of 100 mm",
        ));
    }
    Ok(Radii {
        radius,
        at: heading.positions(),
        machine: heading.machine.map(|name| (name.span(), name.into_inner())),
        plane: heading.plane,
        readings,
    })
}

impl RadiusHeading {
    /// What it says about positions at the centre.
    fn positions(&self) -> Vec<(String, f64)> {
        let all = self.at.iter().flatten();
        let number =
            |value: &toml::Value| value.as_float().or(value.as_integer().map(|v| v as f64));
        all.filter_map(|(name, value)| Some((name.clone(), number(value)?)))
            .collect()
    }

    /// Radius (mm), and the size of the readings' unit in mm.
    fn numbers(&self) -> Result<(f64, f64), FileError> {
        let missing =
            |key: &str| FileError::whole(format!("the file does not say `{key}`"), HEADING);
        let radius = (self.radius_mm.as_ref()).ok_or_else(|| missing("radius_mm"))?;
        if !LENGTHS.contains(radius.get_ref()) {
            return Err(FileError::here(
                radius.span(),
                format!("a ball-bar cannot be {} mm long", radius.get_ref()),
                "write the nominal length in mm: # radius_mm = 150.0",
            ));
        }
        let unit = self.unit.as_ref().ok_or_else(|| missing("unit"))?;
        let factor = units::factor(unit.get_ref(), false)
            .map_err(|(message, remedy)| FileError::here(unit.span(), message, remedy))?;
        Ok((*radius.get_ref(), factor))
    }
}

fn readings(table: CsvTable<'_>, radius: f64, factor: f64) -> Result<RadiusReadings, FileError> {
    let column = |name: &str| {
        NAMES
            .iter()
            .position(|known| known.eq_ignore_ascii_case(name))
    };
    let columns = table.columns(0, column)?;
    let places: [Option<usize>; 7] =
        std::array::from_fn(|k| columns.iter().position(|column| *column == k));
    match places {
        [Some(angle), ccw, cw, None, None, None, None] if ccw.or(cw).is_some() => {
            let mut found = BallBarTurns::default();
            for row in table {
                let row = row?;
                let angle = row.number(angle)?.to_radians();
                let turns = [
                    (&mut found.counter_clockwise, ccw),
                    (&mut found.clockwise, cw),
                ];
                for (turn, column) in turns {
                    if let Some(column) = column.filter(|k| !row.cells[*k].text.is_empty()) {
                        turn.push((angle, row.number(column)? * factor));
                    }
                }
            }
            Ok(RadiusReadings::Circle(found))
        }
        [None, None, None, Some(x), Some(y), Some(z), Some(radial)] => {
            let mut found = Vec::new();
            for row in table {
                let row = row?;
                let place = Vector3::new(row.number(x)?, row.number(y)?, row.number(z)?);
                if (place.norm() - radius).abs() > OFF * radius {
                    return Err(FileError::here(
                        row.span,
                        format!(
                            "the position is {:.3} mm from the centre, the bar is {radius} mm long",
                            place.norm()
                        ),
                        "positions count from the centre of the test, in mm",
                    ));
                }
                found.push((place, row.number(radial)? * factor));
            }
            Ok(RadiusReadings::Sphere(found))
        }
        _ => Err(table.wrong_header("these columns are neither a circle nor a sphere")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_kinds_are_read() {
        let circle = "# radius_mm = 100.0\n# plane = \"XY\"\n# unit = \"um\"\nangle,ccw,cw\n0,1.5,-0.5\n90,2,\n";
        let found = read(circle).unwrap();
        assert_eq!(found.radius, 100.0);
        assert_eq!(found.plane.as_deref(), Some("XY"));
        let RadiusReadings::Circle(turns) = found.readings else {
            panic!("a circle")
        };
        assert_eq!(turns.counter_clockwise.len(), 2);
        assert_eq!(turns.clockwise, [(0.0, -0.5e-3)]);
        let sphere = "\u{feff}# radius_mm = 150\r\n# unit = \"mm\"\r\nX,Y,Z,radial\r\n150,0,0,0.01\r\n0,0,150,-0.02\r\n";
        let RadiusReadings::Sphere(read) = read(sphere).unwrap().readings else {
            panic!("a sphere")
        };
        assert_eq!(
            read,
            [(Vector3::x() * 150.0, 0.01), (Vector3::z() * 150.0, -0.02)]
        );
    }

    #[test]
    fn every_mistake_is_reported_with_its_line() {
        // A file, in which `;` ends a line and HEAD are two good ones; the line; what is said of it.
        for case in r#"
            angle,ccw;0,1;                                 | 0 | the file does not say `radius_mm`
            # radius_mm = 100;angle,ccw;                   | 0 | the file does not say `unit`
            # radius_mm = 0.1;# unit = "um";angle,ccw;     | 1 | a ball-bar cannot be 0.1 mm long
            # radius_mm = 100;# unit = "um";angle,ccw;0,99.9975;90,100.0025;180,100; | 2 | the readings are about 100.0000: these are lengths of a bar of 100 mm, in mm
            # radius_mm = 100;# unit = "furlong";angle,ccw;| 2 | `furlong` is not a unit of length
            HEAD                          | 0 | nothing follows the lines with #
            HEADangle,phi;                | 3 | column 2: `phi` is not a known column
            HEADangle,angle;              | 3 | column 2: `angle` is listed twice
            HEADX,Y,radial;               | 3 | these columns are neither a circle nor a sphere
            HEADangle,ccw;0,1,2;          | 4 | the row has 3 columns, the header has 2
            HEADangle,ccw;0,inf;          | 4 | column 2 (ccw): `inf` is not a finite number
            HEADangle,ccw;,1;             | 4 | column 1 (angle): the value is missing
            HEADX,Y,Z,radial;1,2,3,0;     | 4 | the position is 3.742 mm from the centre, the bar is 100 mm long
            HEADangle,ccw;0,1;# unit = 3; | 5 | there is a line with # below the header"#
            .lines()
            .skip(1)
        {
            let [text, line, message] = [0, 1, 2].map(|k| case.split('|').nth(k).unwrap().trim());
            let text = text.replace("HEAD", "# radius_mm = 100;# unit = \"um\";");
            let text = text.replace(';', "\n");
            let error = read(&text).unwrap_err();
            assert_eq!(error.message, message);
            let found = error.line(&text).unwrap_or(0).to_string();
            assert_eq!(found, line, "{message}");
        }
        let text = "# radius_mm = 100\n# unit = \"um\"\nangle;ccw\n";
        let semicolons = read(text).unwrap_err();
        assert_eq!(semicolons.line(text), Some(3));
        let message = "the columns are separated by semicolons";
        assert_eq!(semicolons.message, message);
    }
}
