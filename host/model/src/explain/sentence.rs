//! Readings as text.

use super::bench::BenchState;
use super::instrument::{BallPlacement, BenchInstrument, InstrumentReading, REACH, Sense};
use super::single_entry::{EntryKind, Nature, SingleEntry};
use crate::errors::ParameterKind;
use crate::machine::Machine;
use crate::pose::carries;

/// The entry and its value: `EXX1 = 20e-6, X carries the workpiece and is reversed`.
#[must_use]
pub fn subject(alone: &SingleEntry<'_>) -> String {
    let name = alone.parameter.to_string();
    let motion = &name[..3.min(name.len())];
    let what = match &alone.said {
        EntryKind::Parameter(value) => format!("{name} = {}", number(*value)),
        EntryKind::Table => format!("the table {motion}"),
        EntryKind::TableReversal => format!("the table {motion}, between its two directions"),
        EntryKind::PerKelvin { per_kelvin, sensor } => {
            let sign = if *per_kelvin < 0.0 { "" } else { "+" };
            format!("{name} {sign}{} per K of {sensor}", number(*per_kelvin))
        }
    };
    let Some(axis) = alone.machine.axes.get(alone.index()) else {
        return what;
    };
    if alone.parameter.kind == ParameterKind::Inter {
        return what;
    }
    let reversed = if axis.reversed {
        " and is reversed"
    } else {
        ""
    };
    format!(
        "{what}, {} carries the {}{reversed}",
        axis.letter,
        carries(axis.branch)
    )
}

/// The reading of the instrument and where it is taken.
#[must_use]
pub fn reading(alone: &SingleEntry<'_>, reading: &InstrumentReading) -> String {
    let words = ReadingWords::new(alone.machine, reading);
    match alone.said {
        _ if alone.nature() == Nature::Reversal => words.reversal(),
        EntryKind::PerKelvin { .. } => format!("1 K warmer, {}", words.text()),
        _ => words.text(),
    }
}

/// What the sentences about a reading have in common.
struct ReadingWords<'a> {
    machine: &'a Machine,
    reading: &'a InstrumentReading,
    /// The moved axis, or a space.
    moved: char,
    value: String,
    /// The direction in which an instrument reads, with a space before it.
    sense: String,
    at: String,
    from: String,
    /// Where the instrument is set to zero, unless the moved axis is at zero there.
    zeroed: String,
}

impl<'a> ReadingWords<'a> {
    fn new(machine: &'a Machine, reading: &'a InstrumentReading) -> Self {
        let letter = |axis: usize| machine.axes[axis].letter.char();
        let place = |state: &BenchState| match reading.moved {
            Some(axis) => place(machine, axis, state.q[axis]),
            None => everywhere(machine, state),
        };
        let from = place(&reading.from);
        Self {
            machine,
            reading,
            moved: reading.moved.map_or(' ', letter),
            value: match reading.sense {
                Sense::In(_) => format!("{} µm", signed(reading.value * 1e3)),
                _ => format!("{} µrad", signed(reading.value * 1e6)),
            },
            sense: match reading.sense {
                Sense::In(axis) => format!(" in {}", letter(axis)),
                Sense::From(a, b) => format!(" from +{} towards +{}", letter(a), letter(b)),
                Sense::About(_) => String::new(),
            },
            at: place(&reading.to),
            zeroed: match reading.moved {
                Some(axis) if reading.from.q[axis] != 0.0 => format!(", zero at {from},"),
                _ => String::new(),
            },
            from,
        }
    }

    /// The difference between both directions of travel.
    fn reversal(&self) -> String {
        let device = reversal_device(self.machine, self.reading);
        let sense = match self.reading.sense {
            Sense::From(..) => &self.sense,
            _ => "",
        };
        format!(
            "{device} reads {}{sense} after positive less after negative travel of {}, at {}",
            self.value, self.moved, self.at
        )
    }

    fn text(&self) -> String {
        let (machine, moved) = (self.machine, self.moved);
        let (at, from, zeroed) = (&self.at, &self.from, &self.zeroed);
        let (value, sense) = (&self.value, &self.sense);
        match self.reading.instrument {
            BenchInstrument::Laser => {
                format!("a laser along {moved}{zeroed} reads {value} at {at}")
            }
            BenchInstrument::Straightedge { ends } => {
                let [a, b] = ends.map(|end| place(machine, self.reading.moved.unwrap_or(0), end));
                format!(
                    "a dial along a straightedge in {moved}, zero at {a} and {b}, reads {value}{sense} at {at}"
                )
            }
            BenchInstrument::Square => format!(
                "a square on the table, dial moved along {moved}, reads {value} per {REACH} mm{sense}"
            ),
            BenchInstrument::Angle => {
                let rotary = |axis: usize| machine.axes[axis].letter.is_rotary();
                let way = match self.reading.moved {
                    None => format!(", zero at {from},"),
                    Some(axis) if rotary(axis) => format!(" on {moved}{zeroed}"),
                    Some(_) => format!(" along {moved}{zeroed}"),
                };
                format!("an angle laser or level{way} reads {value}{sense} at {at}")
            }
            BenchInstrument::Calibrator => {
                format!("a rotary calibrator on {moved}{zeroed} reads {value} at {at}")
            }
            BenchInstrument::Ball { place } => {
                let ball = ball(machine, moved, place);
                format!("{ball}, reads {value}{sense} from {moved} = {from} to {at}")
            }
            BenchInstrument::Tram => {
                let side = match self.reading.sense {
                    Sense::In(axis) => machine.axes[axis].letter.char(),
                    _ => ' ',
                };
                format!(
                    "a dial on an arm of {REACH} mm in the spindle, swept over the table, reads {value} more at +{side} than at −{side}"
                )
            }
            BenchInstrument::Probe => {
                format!("the tip, zero at {from}, is off by {value}{sense} at {at}")
            }
        }
    }
}

/// What shows a difference between both directions of travel.
fn reversal_device(machine: &Machine, reading: &InstrumentReading) -> String {
    match (reading.instrument, reading.sense) {
        (BenchInstrument::Calibrator, _) => "a rotary calibrator".to_owned(),
        (BenchInstrument::Angle, _) => "an angle laser or level".to_owned(),
        (_, Sense::In(axis)) => {
            let letter = machine.axes[axis].letter.char();
            format!("a dial or laser along {letter}")
        }
        _ => "a dial".to_owned(),
    }
}

/// A ball in or around a moved axis, and its indicator.
fn ball(machine: &Machine, moved: char, place: BallPlacement) -> String {
    match place {
        BallPlacement::OnAxis => format!("a ball on the axis of {moved}, indicator in the spindle"),
        BallPlacement::Away(axis) => format!(
            "a ball {REACH} mm in +{} from the axis of {moved}, indicator in the spindle",
            machine.axes[axis].letter.char()
        ),
        BallPlacement::Tip => "a ball on the table, indicator in the spindle kept on it".to_owned(),
    }
}

/// `+100 mm`.
fn place(machine: &Machine, axis: usize, q: f64) -> String {
    let axis = &machine.axes[axis];
    let unit = if axis.letter.is_rotary() { "°" } else { " mm" };
    let rounded = (axis.to_command(q) * 10.0).round() / 10.0;
    let sign = if rounded > 0.0 { "+" } else { "" };
    format!("{sign}{}{unit}", minus(&(rounded + 0.0).to_string()))
}

/// `X = 10, A = -30`.
fn everywhere(machine: &Machine, state: &BenchState) -> String {
    let axes = machine.axes.iter().zip(state.q);
    let places = axes.map(|(axis, q)| {
        let rounded = (axis.to_command(q) * 10.0).round() / 10.0 + 0.0;
        format!("{} = {}", axis.letter, minus(&rounded.to_string()))
    });
    places.collect::<Vec<_>>().join(", ")
}

/// A number with its sign and at least two digits.
#[must_use]
pub fn signed(value: f64) -> String {
    let digits = match value.abs() {
        v if v >= 999.5 => 0,
        v if v >= 0.995 => 1,
        v if v >= 0.0995 => 2,
        v if v >= 0.009_95 => 3,
        _ => 4,
    };
    // Halves are rounded up, whatever the last bit of a sine or cosine.
    let text = format!("{:.digits$}", value.abs() * (1.0 + 1e-9));
    match value {
        v if text.chars().all(|c| "0.".contains(c)) || v == 0.0 => text,
        v if v < 0.0 => format!("−{text}"),
        _ => format!("+{text}"),
    }
}

/// A value as written in files: `20e-6`, `-0.9e-3`.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return "0".to_owned();
    }
    let exponent = libm::log10(value.abs()).floor() as i32;
    let three = exponent.div_euclid(3) * 3;
    // The digits as written, without those from the division.
    let mantissa = format!("{:.9}", value / 10_f64.powi(three));
    let mantissa = mantissa.trim_end_matches('0').trim_end_matches('.');
    match three {
        0 => mantissa.to_owned(),
        _ => format!("{mantissa}e{three}"),
    }
}

/// Replaces a hyphen by a minus sign.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}
