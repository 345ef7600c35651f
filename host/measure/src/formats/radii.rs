//! Readings of a ball-bar as CSV: positions on a sphere, or angles on a circle.

use crate::ballbar::Turns;
use nalgebra::Vector3;
use serde::Deserialize;
use std::ops::Range;
use toml::Spanned;
use trueaxis_model::formats::cells::{cells, lines, separated};
use trueaxis_model::formats::units;
use trueaxis_model::source::FileError;

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Radii {
    /// Nominal length of the bar (mm).
    pub radius: f64,
    /// On a circle the two axes, if the file says them.
    pub plane: Option<String>,
    /// The readings.
    pub readings: Readings,
}

/// Readings of a test.
#[derive(Clone, Debug, PartialEq)]
pub enum Readings {
    /// On a circle.
    Circle(Turns),
    /// On a sphere: nominal directions of the bar, of length 1, and by how much (mm) it is longer than nominal.
    Sphere(Vec<(Vector3<f64>, f64)>),
}

/// What the lines that begin with `#` say; the machine and the place are for people.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Heading {
    radius_mm: Option<Spanned<f64>>,
    unit: Option<Spanned<String>>,
    plane: Option<String>,
    #[serde(rename = "machine")]
    _machine: Option<String>,
    #[serde(rename = "at")]
    _at: Option<toml::Table>,
}

const HEADING: &str = "begin the file with # radius_mm = 150.0 and # unit = \"um\" (or \"mm\"), each in a line of its own";
const COLUMNS: &str = "name the columns: angle,ccw,cw or angle,ccw or angle,cw on a circle (degrees), X,Y,Z,radial on a sphere (mm from the centre of the test)";
/// Lengths of bars (mm).
const LENGTHS: Range<f64> = 1.0..10_000.0;
/// A position may be off the bar's length by this part: feed-ins, and positions after an error of setup.
const OFF: f64 = 0.1;

/// What the columns are.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    Angle,
    CounterClockwise,
    Clockwise,
    Place(usize),
    Radial,
}

impl Column {
    fn named(name: &str) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_str() {
            "angle" => Self::Angle,
            "ccw" => Self::CounterClockwise,
            "cw" => Self::Clockwise,
            "x" => Self::Place(0),
            "y" => Self::Place(1),
            "z" => Self::Place(2),
            "radial" => Self::Radial,
            _ => return None,
        })
    }
}

/// Reads a file.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: a heading without radius or unit, unknown columns, what is not a finite
/// number, a position that is not near the sphere.
pub fn read(text: &str) -> Result<Radii, FileError> {
    let mut bare = String::with_capacity(text.len());
    let mut rows = Vec::new();
    for (line, start) in lines(text) {
        // The heading with the marks blanked, so that places stay where they are.
        bare.extend(std::iter::repeat_n('\n', usize::from(!bare.is_empty())));
        bare.extend(std::iter::repeat_n(' ', start.saturating_sub(bare.len())));
        match line.trim_start().strip_prefix('#') {
            Some(rest) if rows.is_empty() => {
                bare.extend(std::iter::repeat_n(' ', line.len() - rest.len()));
                bare += rest;
            }
            Some(_) => {
                return Err(FileError::at(
                    start..start + line.len(),
                    "there is a line with # between the readings".to_owned(),
                    "here",
                    "lines with # say how it was measured and come before the column names",
                ));
            }
            None => rows.push((line, start)),
        }
    }
    let heading: Heading = toml::from_str(&bare).map_err(|error| FileError {
        remedy: HEADING.to_owned(),
        ..FileError::syntax(&error, &bare)
    })?;
    let (radius, factor) = heading.numbers()?;
    let readings = readings(&rows, radius, factor)?;
    Ok(Radii {
        radius,
        plane: heading.plane,
        readings,
    })
}

impl Heading {
    /// Radius (mm), and the mm in a unit of the readings.
    fn numbers(&self) -> Result<(f64, f64), FileError> {
        let missing =
            |key: &str| FileError::whole(format!("the file does not say `{key}`"), HEADING);
        let radius = self
            .radius_mm
            .as_ref()
            .ok_or_else(|| missing("radius_mm"))?;
        let at = |span: Range<usize>, message: String, remedy: &str| {
            FileError::at(span, message, "here", remedy)
        };
        if !LENGTHS.contains(radius.get_ref()) {
            return Err(at(
                radius.span(),
                format!("{} mm is not a length of a ball-bar", radius.get_ref()),
                "write the nominal length in mm: # radius_mm = 150.0",
            ));
        }
        let unit = self.unit.as_ref().ok_or_else(|| missing("unit"))?;
        let factor = units::factor(unit.get_ref(), false)
            .map_err(|(message, remedy)| at(unit.span(), message, &remedy))?;
        Ok((*radius.get_ref(), factor))
    }
}

/// The columns' names, and the rows below.
fn readings(rows: &[(&str, usize)], radius: f64, factor: f64) -> Result<Readings, FileError> {
    let Some(((names, start), rows)) = rows.split_first() else {
        return Err(FileError::whole("the file has no readings", COLUMNS));
    };
    if let Some(error) = separated(names, *start) {
        return Err(error);
    }
    let mut columns = Vec::new();
    for (name, span) in cells(names, *start) {
        let column = Column::named(name).filter(|column| !columns.contains(column));
        let wrong = || {
            FileError::at(
                span,
                format!("`{name}` is not a column, or is listed twice"),
                "here",
                COLUMNS,
            )
        };
        columns.push(column.ok_or_else(wrong)?);
    }
    let has = |column: Column| columns.contains(&column);
    let is_sphere =
        columns.len() == 4 && has(Column::Radial) && (0..3).all(|k| has(Column::Place(k)));
    let turns = usize::from(has(Column::CounterClockwise)) + usize::from(has(Column::Clockwise));
    let is_circle = has(Column::Angle) && turns > 0 && columns.len() == turns + 1;
    if !is_sphere && !is_circle {
        let span = *start..start + names.len();
        return Err(FileError::at(
            span,
            "these columns are no test".to_owned(),
            "here",
            COLUMNS,
        ));
    }
    let mut found = Turns::default();
    let mut sphere = Vec::new();
    for (line, start) in rows {
        let row = numbers(line, *start, columns.len())?;
        let value = |wanted: Column| {
            let place = columns.iter().position(|column| *column == wanted)?;
            row[place].map(|number| match wanted {
                Column::Angle => number.to_radians(),
                Column::Place(_) => number,
                _ => number * factor,
            })
        };
        let whole = *start..start + line.len();
        let missing = |what: &str| {
            FileError::at(
                whole.clone(),
                format!("the row has no {what}"),
                "here",
                COLUMNS,
            )
        };
        if is_circle {
            let angle = value(Column::Angle).ok_or_else(|| missing("angle"))?;
            let turns = [
                (&mut found.counter_clockwise, Column::CounterClockwise),
                (&mut found.clockwise, Column::Clockwise),
            ];
            for (turn, column) in turns {
                turn.extend(value(column).map(|reading| (angle, reading)));
            }
            continue;
        }
        let part = |k: usize| value(Column::Place(k)).ok_or_else(|| missing("position"));
        let place = Vector3::new(part(0)?, part(1)?, part(2)?);
        if (place.norm() - radius).abs() > OFF * radius {
            return Err(FileError::at(
                whole,
                format!(
                    "the position is {:.3} mm from the centre, the bar is {radius} mm long",
                    place.norm()
                ),
                "here",
                "positions count from the centre of the test, in mm",
            ));
        }
        let reading = value(Column::Radial).ok_or_else(|| missing("reading"))?;
        sphere.push((place.normalize(), reading));
    }
    Ok(match is_circle {
        true => Readings::Circle(found),
        false => Readings::Sphere(sphere),
    })
}

/// The numbers of a row; none where a cell is empty.
fn numbers(line: &str, start: usize, wanted: usize) -> Result<Vec<Option<f64>>, FileError> {
    let cells = cells(line, start);
    if cells.len() != wanted {
        return Err(FileError::at(
            start..start + line.len(),
            format!(
                "the row has {} columns, the first line names {wanted}",
                cells.len()
            ),
            "here",
            COLUMNS,
        ));
    }
    let number = |(cell, span): (&str, Range<usize>)| match cell {
        "" => Ok(None),
        _ => match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(FileError::at(
                span,
                format!("`{cell}` is not a finite number"),
                "not a number",
                "write numbers with a decimal point",
            )),
        },
    };
    cells.into_iter().map(number).collect()
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
        let Readings::Circle(turns) = found.readings else {
            panic!("a circle")
        };
        assert_eq!(turns.counter_clockwise.len(), 2);
        assert_eq!(turns.clockwise, [(0.0, -0.5e-3)]);
        let sphere = "\u{feff}# radius_mm = 150\r\n# unit = \"mm\"\r\nX,Y,Z,radial\r\n150,0,0,0.01\r\n0,0,150,-0.02\r\n";
        let Readings::Sphere(read) = read(sphere).unwrap().readings else {
            panic!("a sphere")
        };
        assert_eq!(read, [(Vector3::x(), 0.01), (Vector3::z(), -0.02)]);
    }

    #[test]
    fn every_mistake_is_told_with_its_line() {
        let head = "# radius_mm = 100\n# unit = \"um\"\n";
        for (text, line, message) in [
            (
                "angle,ccw\n0,1\n".to_owned(),
                None,
                "the file does not say `radius_mm`",
            ),
            (
                "# radius_mm = 100\nangle,ccw\n".to_owned(),
                None,
                "the file does not say `unit`",
            ),
            (
                "# radius_mm = 0.1\n# unit = \"um\"\nangle,ccw\n".to_owned(),
                Some(1),
                "0.1 mm is not a length of a ball-bar",
            ),
            (
                "# radius_mm = 100\n# unit = \"furlong\"\nangle,ccw\n".to_owned(),
                Some(2),
                "`furlong` is not a unit of a length",
            ),
            (head.to_owned(), None, "the file has no readings"),
            (
                format!("{head}angle;ccw\n"),
                Some(3),
                "the columns are separated by semicolons",
            ),
            (
                format!("{head}angle,phi\n"),
                Some(3),
                "`phi` is not a column, or is listed twice",
            ),
            (
                format!("{head}angle,angle\n"),
                Some(3),
                "`angle` is not a column, or is listed twice",
            ),
            (
                format!("{head}X,Y,radial\n"),
                Some(3),
                "these columns are no test",
            ),
            (
                format!("{head}angle,ccw\n0,1,2\n"),
                Some(4),
                "the row has 3 columns, the first line names 2",
            ),
            (
                format!("{head}angle,ccw\n0,inf\n"),
                Some(4),
                "`inf` is not a finite number",
            ),
            (
                format!("{head}angle,ccw\n,1\n"),
                Some(4),
                "the row has no angle",
            ),
            (
                format!("{head}X,Y,Z,radial\n1,2,3,0\n"),
                Some(4),
                "the position is 3.742 mm from the centre, the bar is 100 mm long",
            ),
            (
                format!("{head}angle,ccw\n0,1\n# unit = \"mm\"\n"),
                Some(5),
                "there is a line with # between the readings",
            ),
        ] {
            let error = read(&text).unwrap_err();
            assert_eq!(error.message, message);
            assert_eq!(error.line(&text), line, "{message}");
        }
    }
}
