//! Explains error parameters on a machine: what an instrument would show.
//!
//! Every figure is computed with the exact model of the uncompensated machine, on which only this parameter is
//! wrong, by moving the machine as the instrument is used. No sign convention is coded here: the sign of a reading
//! follows from the commanded motion.

mod bench;
mod choose;
mod instrument;
mod minimal;
mod nothing;
mod sentence;
mod single_entry;

use crate::errors::{ErrorModel, Parameter};
use crate::machine::Machine;
pub use bench::{Bench, BenchState, Deviation};
pub use instrument::{BallPlacement, BenchInstrument, InstrumentReading, REACH, Sense};
pub use minimal::MinimalParameters;
pub use sentence::number;
pub use single_entry::{EntryKind, Nature, SingleEntry};

/// The explanation of one entry of an error file.
#[derive(Clone, Debug)]
pub struct Explained<'a> {
    /// The entry.
    pub alone: SingleEntry<'a>,
    /// The reading that shows it; `None` if it changes nothing.
    pub reading: Option<InstrumentReading>,
    /// For an inclination that changes nothing: the pair of axes (by index) whose squareness may have been meant,
    /// and the corresponding parameters.
    pub meant: Option<([usize; 2], Vec<Parameter>)>,
}

/// Explains every entry of an error file, axis by axis.
#[must_use]
pub fn explain<'a>(machine: &'a Machine, errors: &'a ErrorModel) -> Vec<Explained<'a>> {
    let all = SingleEntry::all(machine, errors).into_iter();
    all.map(|alone| {
        if nothing::changes_nothing(&alone) {
            let meant = nothing::meant(&alone);
            return Explained {
                alone,
                reading: None,
                meant,
            };
        }
        let (model, kelvin) = alone.model(1.0);
        let reading = choose::choose(&Bench::new(machine, &model, kelvin), &alone);
        Explained {
            alone,
            reading,
            meant: None,
        }
    })
    .collect()
}

impl Explained<'_> {
    /// The explanation as one sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let subject = sentence::subject(&self.alone);
        match &self.reading {
            Some(reading) => format!("{subject}: {}", sentence::reading(&self.alone, reading)),
            None => format!("{subject}: {}", self.nothing()),
        }
    }

    /// Why it changes nothing, and which parameter would.
    fn nothing(&self) -> String {
        let alone = &self.alone;
        if alone.size() == 0.0 {
            return "changes nothing".to_owned();
        }
        let spindle = alone.index() == alone.machine.axes.len();
        let is_warmth = matches!(alone.said, EntryKind::PerKelvin { .. });
        match (alone.parameter.is_angular(), alone.nature()) {
            (true, Nature::Constant) if !spindle => {
                let text = "turns everything and changes nothing".to_owned();
                text + &self.squareness()
            }
            (true, _) => "turns the tool about its own axis and changes nothing".to_owned(),
            (false, Nature::Constant) if is_warmth => self.grows(),
            (false, Nature::Constant) if spindle => {
                "shifts everything and changes nothing: it belongs to the tool's offsets".to_owned()
            }
            (false, Nature::Constant) => {
                let motion = &alone.parameter.to_string()[..2];
                let axis = alone.parameter.axis;
                let rotary = alone.machine.axes[alone.index()].letter.is_rotary();
                let along = if rotary { "with" } else { "along" };
                format!(
                    "shifts everything and changes nothing; what changes {along} {axis} is {motion}{axis}1, {motion}{axis}2 … or a table"
                )
            }
            (false, _) => "changes nothing".to_owned(),
        }
    }

    /// What a displacement that grows with a temperature does at every position.
    fn grows(&self) -> String {
        let (model, kelvin) = self.alone.model(1.0);
        let bench = Bench::new(self.alone.machine, &model, kelvin);
        let home = BenchState::at(bench.home());
        let off = bench.actual(&home).t - bench.nominal(&home.q).t;
        let parts = ["X", "Y", "Z"].iter().zip(off.iter());
        let parts = parts.filter(|(_, mm)| mm.abs() > 1e-9 * off.norm());
        let parts: Vec<String> = parts
            .map(|(letter, mm)| {
                let sign = if *mm < 0.0 { '−' } else { '+' };
                format!("{:.2} µm along {sign}{letter}", mm.abs() * 1e3)
            })
            .collect();
        format!(
            "1 K warmer, the tool is off by {} everywhere, seen from the workpiece",
            parts.join(" and ")
        )
    }

    fn squareness(&self) -> String {
        let Some(([a, b], parameters)) = &self.meant else {
            return String::new();
        };
        let letter = |i: usize| self.alone.machine.axes[i].letter;
        let (a, b) = (letter(*a).min(letter(*b)), letter(*a).max(letter(*b)));
        let names: Vec<String> = parameters.iter().map(Parameter::to_string).collect();
        format!("; the squareness of {a} and {b} is {}", names.join(" or "))
    }
}
