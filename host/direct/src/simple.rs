//! Readings of a glass scale, a square, a dial and a thermometer as people write them, and the error file that they
//! make.

use crate::single::Single;
use std::fmt::Write;
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::Machine;

/// A reading that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what}")]
pub struct ReadingError {
    /// What is wrong with it.
    pub what: String,
    /// What to write instead.
    pub remedy: String,
}

/// The largest slope (mm per mm, rad), as error files permit.
const LARGEST: f64 = 0.1;

impl Single {
    /// Reads the reading of a scale, `X=2/100`: µm too much per mm of travel. Axes count as their letters do.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn scale(letters: &[char], text: &str) -> Result<Self, ReadingError> {
        let (axes, slope) = sloped(letters, text, 1)?;
        Ok(Self::Scale {
            axis: axes[0],
            slope,
        })
    }

    /// Reads the reading of a square, `XY=3/100`: with one leg along X, a dial moved along the other by Y reads 3 µm
    /// per 100 mm in the direction of X.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn square(letters: &[char], text: &str) -> Result<Self, ReadingError> {
        let (axes, slope) = sloped(letters, text, 2)?;
        Ok(Self::Square {
            aligned: axes[0],
            moved: axes[1],
            slope,
        })
    }

    /// Reads the reading of a dial, `X=-4`: µm more after positive than after negative travel.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn dial(letters: &[char], text: &str) -> Result<Self, ReadingError> {
        let parsed = text.split_once('=').and_then(|(letter, um)| {
            let mut words = letter.trim().chars();
            let axis = linear(letters, words.next()?)?;
            let um: f64 = um.trim().parse().ok()?;
            (words.next().is_none() && um.is_finite() && um.abs() <= 1000.0).then_some((axis, um))
        });
        let (axis, um) = parsed.ok_or_else(|| ReadingError {
            what: format!("`{text}` is not like X=-4"),
            remedy: "give a linear axis of the machine and µm, at most 1000: X=-4".to_owned(),
        })?;
        Ok(Self::Reversal {
            axis,
            difference: um * 1e-3,
        })
    }

    /// A sentence if the reading of a dial is that of an axis that goes farther after positive travel, not of lost motion.
    #[must_use]
    pub fn doubt(&self, letters: &[char]) -> Option<String> {
        let Self::Reversal { axis, difference } = *self else {
            return None;
        };
        let (letter, um) = (letters.get(axis)?, difference * 1e3);
        (um > 0.0).then(|| format!(
            "the dial reading {letter}={um} is the opposite of lost motion, with which the tool lags behind after positive travel: lost motion of {um} µm is {letter}=-{um}"
        ))
    }

    /// The axis along which it was taken; a square is across two.
    #[must_use]
    pub fn along(&self) -> Option<usize> {
        match *self {
            Self::Scale { axis, .. } | Self::Reversal { axis, .. } => Some(axis),
            Self::Square { .. } => None,
        }
    }

    /// The remark of an error file.
    fn words(&self, machine: &Machine) -> String {
        let letter = |axis: usize| machine.axes[axis].letter;
        let [scale, dial, square] = REMARKS;
        match *self {
            Self::Scale { axis, slope } => {
                format!("{scale}{}: {:+.1} µm at +100 mm", letter(axis), slope * 1e5)
            }
            Self::Reversal { axis, difference } => format!(
                "{dial}{}: {:+.1} µm after positive less after negative travel",
                letter(axis),
                difference * 1e3
            ),
            Self::Square {
                aligned,
                moved,
                slope,
            } => format!(
                "{square}{} and {}: {:+.1} µm per 100 mm",
                letter(aligned),
                letter(moved),
                slope * 1e5
            ),
        }
    }
}

/// How the remarks of readings begin.
const REMARKS: [&str; 3] = ["scale along ", "dial along ", "square of "];

/// A linear axis, by its letter.
fn linear(letters: &[char], letter: char) -> Option<usize> {
    let letter = letter.to_ascii_uppercase();
    let is = |known: &char| *known == letter && !"ABC".contains(letter);
    letters.iter().position(is)
}

/// Reads `X=2/100`: axes and the slope.
fn sloped(known: &[char], text: &str, axes: usize) -> Result<(Vec<usize>, f64), ReadingError> {
    let example = ["X=2/100", "XY=3/100"][axes - 1];
    let wrong = || ReadingError {
        what: format!("`{text}` is not of the form {example}"),
        remedy: match text.contains(',') {
            true => format!("write a decimal point: {}", text.replace(',', ".")),
            false => format!("give linear axes of the machine, µm and mm: {example}"),
        },
    };
    let finite = |text: &str| text.trim().parse().ok().filter(|v: &f64| v.is_finite());
    let (letters, reading) = text.split_once('=').ok_or_else(wrong)?;
    let (um, mm) = reading.split_once('/').ok_or_else(wrong)?;
    let (um, mm) = finite(um).zip(finite(mm)).ok_or_else(wrong)?;
    let found: Option<Vec<usize>> = letters.trim().chars().map(|l| linear(known, l)).collect();
    let found = found.filter(|found| found.len() == axes);
    let found = found.ok_or_else(wrong)?;
    if mm <= 0.0 || axes == 2 && found[0] == found[1] {
        return Err(wrong());
    }
    let slope = um * 1e-3 / mm;
    if slope.abs() < LARGEST {
        return Ok((found, slope));
    }
    Err(ReadingError {
        what: format!(
            "`{text}` is {um} µm in {mm} mm: {:.0} mm per m",
            1e3 * slope
        ),
        remedy: format!(
            "give µm before the slash and mm behind it, as in {example}; no machine is off by {:.0} mm per m",
            1e3 * LARGEST
        ),
    })
}

/// How far a spindle grows with the temperature of a sensor: how much nearer its nose comes to the table.
#[derive(Clone, Debug, PartialEq)]
pub struct Growth {
    /// Name of the sensor.
    pub sensor: String,
    /// mm/K.
    pub mm_per_kelvin: f64,
}

impl Growth {
    /// Reads `bearing=12/15`: a sensor, µm and K.
    ///
    /// # Errors
    /// [`ReadingError`].
    pub fn parse<'s>(
        mut sensors: impl Iterator<Item = &'s str>,
        text: &str,
    ) -> Result<Self, ReadingError> {
        let parsed = text.split_once('=').and_then(|(name, reading)| {
            let (um, kelvin) = reading.split_once('/')?;
            let um: f64 = um.trim().parse().ok()?;
            let kelvin: f64 = kelvin.trim().parse().ok()?;
            let is_possible = kelvin > 0.0 && um.abs() <= 1000.0 && kelvin <= 200.0;
            let sensor = sensors.find(|sensor| *sensor == name.trim())?;
            is_possible.then(|| Self {
                sensor: sensor.to_owned(),
                mm_per_kelvin: um * 1e-3 / kelvin,
            })
        });
        parsed.ok_or_else(|| ReadingError {
            what: format!("`{text}` is not bearing=12/15 with a sensor of --temperature"),
            remedy: "give the sensor, µm and K: --temperature bearing=PIN --growth bearing=12/15"
                .to_owned(),
        })
    }
}

/// The error file of such readings, added to the errors in `kept`.
///
/// # Errors
/// [`ReadingError`]: a reading that no parameter of the machine shows alone, or two for one parameter.
pub fn simple_error_file(
    machine: &Machine,
    singles: &[Single],
    growths: &[Growth],
    kept: Option<String>,
) -> Result<String, ReadingError> {
    let mut lines = String::new();
    let mut found: Vec<Parameter> = Vec::new();
    for single in singles {
        let words = single.words(machine);
        let (parameter, value) = single.parameter(machine).ok_or_else(|| ReadingError {
            what: format!("{words}: no parameter of this machine shows that alone"),
            remedy: "give the readings to `trueaxis measured`".to_owned(),
        })?;
        if found.contains(&parameter) {
            return Err(ReadingError {
                what: format!("{words}: {parameter} has been measured twice"),
                remedy: "give one of the readings".to_owned(),
            });
        }
        // Readings have three digits.
        let value: f64 = format!("{value:.6e}").parse().unwrap_or(value);
        let _ = writeln!(lines, "{parameter} = {value:?}  # {words}");
        found.push(parameter);
    }
    let text = match kept {
        Some(text) if singles.is_empty() => text,
        Some(text) => with_parameters(&text, &lines),
        None => format!(
            "# As measured: `trueaxis explain` says what the instruments must have shown.\nmachine = {}\n\n[parameters]\n{lines}",
            toml::Value::from(machine.name.as_str())
        ),
    };
    Ok(text + &thermal(growths))
}

/// An error file with more parameters.
fn with_parameters(text: &str, lines: &str) -> String {
    if text.contains("[parameters]\n") {
        return text.replacen("[parameters]\n", &format!("[parameters]\n{lines}"), 1);
    }
    let at = text.find("\n#");
    let at = at.filter(|at| text[..*at].contains("machine ="));
    let (before, after) = text.split_at(at.unwrap_or(text.len()));
    format!("{before}\n[parameters]\n{lines}{after}")
}

/// An error file without the readings that [`simple_error_file`] wrote into it.
#[must_use]
pub fn without_readings(text: &str) -> String {
    let is_reading = |line: &&str| {
        let remark = line.split_once("  # ");
        remark.is_some_and(|(_, remark)| REMARKS.iter().any(|words| remark.starts_with(words)))
    };
    text.split_inclusive('\n')
        .filter(|line| !is_reading(line))
        .collect()
}

/// The section of an error file about growths of the spindle: a tool that is nearer to the table has moved in −z of the
/// spindle.
fn thermal(growths: &[Growth]) -> String {
    if growths.is_empty() {
        return String::new();
    }
    let entries = growths.iter().map(|growth| {
        format!(
            "    {{ per_kelvin = {:.6e}, sensor = {}, reference_celsius = 20.0 }},\n",
            -growth.mm_per_kelvin,
            toml::Value::from(growth.sensor.as_str())
        )
    });
    let entries: String = entries.collect();
    format!("\n[thermal]\n# Growth of the spindle.\nEZ0S = [\n{entries}]\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::ErrorModel;

    fn mill() -> Machine {
        let text = include_str!("../../../examples/mill-21/machine.toml");
        Machine::from_toml(text).unwrap()
    }

    fn letters(machine: &Machine) -> Vec<char> {
        machine.axes.iter().map(|axis| axis.letter.char()).collect()
    }

    #[test]
    fn a_file_of_readings_shows_the_readings() {
        let machine = mill();
        let letters = letters(&machine);
        let singles = [
            Single::scale(&letters, "x = 2 / 100").unwrap(),
            Single::square(&letters, "XY=3/100").unwrap(),
            Single::dial(&letters, "Z=-4").unwrap(),
        ];
        let text = simple_error_file(&machine, &singles, &[], None).unwrap();
        let errors = ErrorModel::from_toml(&text, &machine).unwrap();
        // The square also reads the scale's second order: below 1 nm per m.
        for (single, shown) in singles.iter().zip([20e-6, 30e-6, -4e-3]) {
            assert!(
                (single.read(&machine, &errors) - shown).abs() < 1e-9,
                "{text}"
            );
        }
        assert_eq!(
            without_readings(&text),
            simple_error_file(&machine, &[], &[], None).unwrap()
        );
    }

    #[test]
    fn readings_are_added_to_what_is_kept() {
        let machine = mill();
        let single = Single::scale(&letters(&machine), "X=2/100").unwrap();
        let growth = Growth::parse(["bearing"].into_iter(), "bearing=15/15").unwrap();
        for kept in [
            "machine = \"Mill with 21 errors\"\n\n[parameters]\nEYYb = 0.002\n",
            "machine = \"Mill with 21 errors\"\n\n# A table.\n[tabulated.EYY]\nat = [0, 300]\nvalue = [0, 0.01]\n",
        ] {
            let all = [single];
            let growths = [growth.clone()];
            let text = simple_error_file(&machine, &all, &growths, Some(kept.to_owned())).unwrap();
            let before = ErrorModel::from_toml(kept, &machine).unwrap();
            let after = ErrorModel::from_toml(&text, &machine).unwrap();
            assert_eq!(after.motions[0], before.motions[0], "{text}");
            assert_ne!(after.motions[1], before.motions[1], "{text}");
            assert_eq!(after.sensors.len(), 1, "{text}");
        }
    }

    #[test]
    fn what_is_no_reading_is_refused_with_an_example() {
        let letters = ['X', 'Y', 'Z', 'C'];
        for text in " X X=2 X=2/0 X=2/-100 C=2/100 XY=2/100 X=nan/100 X=1e9/1".split(' ') {
            let error = Single::scale(&letters, text).unwrap_err();
            assert!(error.remedy.contains("X=2/100"), "{text}: {error:?}");
        }
        for text in ["X=2/100", "XX=2/100", "XYZ=2/100", "XC=2/100"] {
            assert!(Single::square(&letters, text).is_err(), "{text}");
        }
        for text in ["X", "X=", "X=4/100", "XY=4", "C=4", "X=inf", "X=1001"] {
            assert!(Single::dial(&letters, text).is_err(), "{text}");
        }
        let error = Single::scale(&letters, "X=2,5/100").unwrap_err();
        assert_eq!(error.remedy, "write a decimal point: X=2.5/100");
        for text in [
            "bearing",
            "bearing=1",
            "bearing=1/0",
            "room=1/1",
            "bearing=1/201",
        ] {
            let found = Growth::parse(["bearing"].into_iter(), text);
            assert!(found.is_err(), "{text}");
        }
    }

    #[test]
    fn one_parameter_is_read_once() {
        let machine = mill();
        let letters = letters(&machine);
        let both = ["XY=3/100", "YX=3/100"].map(|text| Single::square(&letters, text).unwrap());
        let error = simple_error_file(&machine, &both, &[], None).unwrap_err();
        assert!(
            error.what.contains("EC0X has been measured twice"),
            "{error}"
        );
    }
}
