//! Readings of displacement sensors over whole turns of a spindle, for error motions to ISO 230-7, as CSV.

use super::displacements::{apart, displacements, sensor, sensors};
use crate::iso230_7::Turns;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use toml::Spanned;
use trueaxis_model::formats::csv::{self, CsvTable};
use trueaxis_model::source::FileError;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RevolutionHeading {
    sensors_apart_mm: Option<Spanned<f64>>,
    #[serde(rename = "machine")]
    _machine: Option<String>,
}

const HEADING: &str = "lines with # are # machine = \"NAME\" and # sensors_apart_mm = 100.0";
const COLUMNS: &str = "name the columns: turn, angle_deg, then x1_um, y1_um, x2_um, y2_um, z_um as far as there are sensors";
const VALUES: &str = "write one value per column, with a decimal point";
/// Angles (deg) that differ by less are the same: a hundredth of a step of the finest encoders in use.
const SAME: f64 = 1e-4;
/// Fewest angles: two lobes need four, and their height as many again.
const FEWEST: usize = 8;
/// A circle that is off centre is seen from this many micrometres on, and turns in one sense if it is this many times the
/// other one.
const OFF: f64 = 1e-3;
const CLEARLY: f64 = 3.0;

/// Reads a file: each row has the number of its turn, the angle of the spindle, and the readings there. Rows may be in any
/// order; every turn has the same angles.
///
/// # Errors
/// [`FileError`] with line, cause and remedy: whatever [`CsvTable`] refuses, missing columns, a row that is there twice, an
/// angle that a turn lacks, fewer than two turns or eight angles, angles that count in the wrong sense.
pub fn read(text: &str) -> Result<Turns, FileError> {
    let (heading, end): (RevolutionHeading, usize) = csv::heading(text, HEADING)?;
    let table = CsvTable::open(text, end, COLUMNS, VALUES)?;
    let (sensors, turns) = rows(table)?;
    let angles = common_angles(&turns)?;
    let turns = Turns {
        apart: apart(heading.sensors_apart_mm.as_ref())?,
        sensors,
        angles: (angles.iter())
            .map(|steps| (*steps as f64 * SAME).to_radians())
            .collect(),
        readings: (turns.into_values())
            .map(|turn| turn.into_values().collect())
            .collect(),
    };
    let [right, wrong] = turns.senses();
    if turns.sensors[..2] == [true; 2] && wrong > OFF.max(CLEARLY * right) {
        return Err(FileError::whole(
            format!(
                "the artefact is {:.1} µm off centre and goes round from Y to X, but angles count from X to Y",
                wrong * 1e3
            ),
            "write angle_deg with the other sign, or turn the sign of x1_um or y1_um if that sensor reads the other way",
        ));
    }
    Ok(turns)
}

/// The readings (mm) of each turn by its number and the angle, in steps of [`SAME`].
type ByTurn = BTreeMap<i64, BTreeMap<i64, [f64; 5]>>;

/// Which sensors there are, and what they read.
fn rows(table: CsvTable<'_>) -> Result<([bool; 5], ByTurn), FileError> {
    let is_known = |name: &str| ["turn", "angle_deg"].contains(&name) || sensor(name).is_some();
    let columns = table.columns(0, |name| is_known(name).then(|| name.to_owned()))?;
    let place = |name: &str| {
        let place = columns.iter().position(|c| c == name);
        place.ok_or_else(|| table.missing(name))
    };
    let (turn, angle) = (place("turn")?, place("angle_deg")?);
    let sensors = sensors(&table, &columns)?;
    let mut turns = ByTurn::new();
    for row in table {
        let row = row?;
        let number = row.number(turn)?;
        if number.fract() != 0.0 || number.abs() > 1e9 {
            let message = format!("`{}` is not the number of a turn", row.cells[turn].text);
            return Err(row.error(turn, message, "here", "count turns: 1, 2, 3"));
        }
        let steps = (row.number(angle)?.rem_euclid(360.0) / SAME).round() as i64;
        let steps = steps.rem_euclid((360.0 / SAME) as i64);
        let read = displacements(&row, sensors)?;
        let of_turn = turns.entry(number as i64).or_default();
        if of_turn.insert(steps, read).is_some() {
            let message = format!("turn {number} has this angle twice");
            let remedy = "give every turn a number of its own in the column turn";
            return Err(row.error(angle, message, "the second time", remedy));
        }
    }
    Ok((sensors.map(|column| column.is_some()), turns))
}

/// The angles of every turn.
fn common_angles(turns: &ByTurn) -> Result<BTreeSet<i64>, FileError> {
    let all: BTreeSet<i64> = turns
        .values()
        .flat_map(|turn| turn.keys().copied())
        .collect();
    if turns.len() < 2 || all.len() < FEWEST {
        return Err(FileError::whole(
            format!(
                "{} turns with {} angles do not show the part that repeats in every turn",
                turns.len(),
                all.len()
            ),
            format!("read at the same angles, {FEWEST} or more, in two or more turns"),
        ));
    }
    for (number, turn) in turns {
        if let Some(lacks) = all.iter().find(|steps| !turn.contains_key(steps)) {
            return Err(FileError::whole(
                format!(
                    "turn {number} lacks the angle {}°, which others have",
                    *lacks as f64 * SAME
                ),
                "trigger the readings by the encoder, at the same angles in every turn, and leave out turns that are not whole",
            ));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(rows: &[(i32, f64)], sense: f64) -> String {
        let row = |(turn, angle): &(i32, f64)| {
            let (sine, cosine) = libm::sincos((sense * angle).to_radians());
            format!("{turn},{angle},{},{}\n", 10.0 * cosine, 10.0 * sine)
        };
        let rows: String = rows.iter().map(row).collect();
        format!("# sensors_apart_mm = 100.0\nturn,angle_deg,x1_um,y1_um\n{rows}")
    }

    fn whole(turns: i32) -> Vec<(i32, f64)> {
        let turn = |turn| (0..12).map(move |k| (turn, 30.0 * f64::from(k)));
        (1..=turns).flat_map(turn).collect()
    }

    #[test]
    fn rows_in_any_order_and_angles_of_any_turn_are_read() {
        let rows = whole(3);
        let first = read(&file(&rows, 1.0)).unwrap();
        assert_eq!((first.angles.len(), first.readings.len()), (12, 3));
        assert_eq!(first.apart, Some(100.0));
        let mut other = rows.clone();
        other.reverse();
        other
            .iter_mut()
            .for_each(|(turn, angle)| *angle += 360.0 * f64::from(*turn));
        let other = read(&file(&other, 1.0)).unwrap();
        assert_eq!(other.angles, first.angles);
        let apart = |i: usize, k: usize| (other.readings[1][i][k] - first.readings[1][i][k]).abs();
        assert!((0..12).all(|i| apart(i, 0) < 1e-15 && apart(i, 1) < 1e-15));
    }

    #[test]
    fn what_is_no_set_of_turns_is_refused() {
        let rows = whole(3);
        let twice = [&rows[..], &rows[..1]].concat();
        let off = "10.0 µm off centre and goes round from Y to X";
        for (text, part) in [
            (&*file(&whole(1), 1.0), "1 turns with 12 angles"),
            (&file(&rows[1..], 1.0), "turn 1 lacks the angle 0°"),
            (&file(&twice, 1.0), "this angle twice"),
            (&file(&rows, -1.0), off),
            ("turn,angle_deg\n1,0\n", "no column with readings"),
            ("angle_deg,x1_um\n0,1\n", "`turn` is missing"),
            (
                "turn,angle_deg,x1_um\n1.5,0,1\n",
                "not the number of a turn",
            ),
            ("turn,angle_deg,x1_um\n1,0,99999\n", "larger than any value"),
        ] {
            let said = read(text).unwrap_err().message;
            assert!(said.contains(part), "{said}");
        }
    }
}
