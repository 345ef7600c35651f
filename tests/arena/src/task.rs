//! What is public of one machine, and what is hidden.

use crate::class::Class;
use crate::measured::Measured;
use trueaxis_identify::formats::temperatures::Temperatures;
use trueaxis_model::errors::{ErrorModel, MAX_SENSORS, Parameter, Thermal};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Command;

/// A position to answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// The commanded position.
    pub command: Command,
    /// The time (s) in the log of temperatures, on a machine that warms up.
    pub time: Option<f64>,
}

/// What is public of one machine.
#[derive(Clone, Debug)]
pub struct Task {
    /// Number.
    pub number: usize,
    /// Class.
    pub class: Class,
    /// The machine file.
    pub machine_file: String,
    /// The machine.
    pub machine: Machine,
    /// What was measured on it.
    pub measured: Measured,
    /// Parameters to find. All others are zero, except for waves of the class [`Class::Rich`]. None on a machine that
    /// warms up.
    pub asked: Vec<Parameter>,
    /// Positions to answer.
    pub positions: Vec<Position>,
    /// Temperatures of a machine that warms up.
    pub warm: Option<Warm>,
}

/// Temperatures of a machine that warms up.
#[derive(Clone, Debug)]
pub struct Warm {
    /// While the machine was measured, as a file.
    pub measured_file: String,
    /// Like `measured_file`, as read.
    pub measured: Temperatures,
    /// In the cycles of the positions, as a file.
    pub unseen_file: String,
    /// Like `unseen_file`, as read.
    pub unseen: Temperatures,
}

impl Task {
    /// The positions with the temperatures that these inputs see there, each after its lag.
    ///
    /// # Errors
    /// If the machine has no such sensor.
    pub fn commands(&self, inputs: &[Thermal]) -> Result<Vec<Command>, String> {
        let values = inputs
            .iter()
            .map(|input| self.kelvin(input))
            .collect::<Result<Vec<_>, _>>()?;
        let mut commands: Vec<Command> = self.positions.iter().map(|p| p.command).collect();
        for (command, number) in commands.iter_mut().zip(0..) {
            for (auxiliary, values) in command.auxiliaries.iter_mut().zip(&values) {
                let kelvin: f64 = values[number];
                *auxiliary = kelvin as f32;
            }
        }
        Ok(commands)
    }

    /// What an input sees at each position (K).
    fn kelvin(&self, input: &Thermal) -> Result<Vec<f64>, String> {
        let unknown = || {
            let known = self
                .warm
                .as_ref()
                .map_or_else(|| "none".to_owned(), |warm| warm.unseen.sensors.join(", "));
            format!(
                "machine {} has no temperature `{}`: it has {known}",
                self.number, input.sensor
            )
        };
        let log = &self.warm.as_ref().ok_or_else(unknown)?.unseen;
        let sensor = log.sensors.iter().position(|s| *s == input.sensor);
        let values = log.kelvin(
            sensor.ok_or_else(unknown)?,
            input.reference_celsius,
            input.lag,
        );
        let [low, high] = input.range_kelvin;
        let each = self.positions.iter().map(|position| {
            let kelvin = position.time.and_then(|time| log.at(&values, time));
            kelvin.unwrap_or_default().clamp(low, high)
        });
        Ok(each.collect())
    }

    /// The positions at which the workpiece is set up: those at the beginning of each cycle, with all of that cycle.
    #[must_use]
    pub fn cycles(&self) -> Vec<Cycle> {
        let Some(warm) = &self.warm else {
            return Vec::new();
        };
        let cycle = |p: &Position| p.time.and_then(|time| warm.unseen.cycle_at(time));
        let of = |number| {
            let own = self.positions.iter().enumerate();
            let own = own.filter(|(_, p)| cycle(p) == Some(number));
            let all: Vec<usize> = own.map(|(i, _)| i).collect();
            let first = all.first().and_then(|i| self.positions[*i].time);
            let start = all.iter().copied();
            Cycle {
                start: start.filter(|i| self.positions[*i].time == first).collect(),
                all,
            }
        };
        (0..warm.unseen.cycles()).map(of).collect()
    }
}

/// A cycle of a machine that warms up: indices of its positions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cycle {
    /// At its beginning.
    pub start: Vec<usize>,
    /// All of them.
    pub all: Vec<usize>,
}

/// A machine with its errors.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// What is public.
    pub task: Task,
    /// Errors: one for all positions, or one for each.
    pub truth: Vec<ErrorModel>,
}

impl Hidden {
    /// The errors at a position.
    #[must_use]
    pub fn truth_at(&self, position: usize) -> &ErrorModel {
        &self.truth[position.min(self.truth.len() - 1)]
    }
}

const _: () = assert!(MAX_SENSORS <= trueaxis::AUXILIARIES);
