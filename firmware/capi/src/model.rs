//! A machine with its errors, which computes the actual position of the tool.

use crate::capacities::TRUEAXIS_AXES;
use crate::code::Code;
use crate::facts::TRUEAXIS_ALIGNMENT;
use crate::text::Text;
use trueaxis::{Reversal, Travel};
use trueaxis_kinematics::{
    Htm, Kinematics, MAX_AXES, MAX_SENSORS, Machine, PerAxis, Sensor, Situation, Stored,
    StoredError, Switches,
};

/// Size of a model in bytes.
pub const TRUEAXIS_MODEL_SIZE: usize = 40960;
/// Size of a model in words of 8 bytes.
pub const TRUEAXIS_MODEL_WORDS: usize = 5120;

/// Memory for a model, in a `static` or anywhere else.
#[repr(C)]
pub struct ModelMemory {
    /// For use by the library only.
    pub words: [u64; TRUEAXIS_MODEL_WORDS],
}

/// Position of the tool relative to the workpiece.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelPose {
    /// The actual tip of the tool, with all errors at the positions (mm).
    pub tip: [f64; 3],
    /// Unit vector from the actual tip to the spindle.
    pub direction: [f64; 3],
    /// The nominal tip, without errors at the commands (mm).
    pub nominal_tip: [f64; 3],
    /// Unit vector from the nominal tip to the spindle.
    pub nominal_direction: [f64; 3],
}

/// A model: a machine with its errors. Points of measured motions stay in the file.
pub struct Model {
    stored: Option<Stored<'static>>,
    reversals: [Reversal; MAX_AXES],
    /// What the errors see of each sensor (K from its reference); `None` before the first reading.
    warmed: [Option<f64>; MAX_SENSORS],
}

const _: () = {
    assert!(size_of::<ModelMemory>() == TRUEAXIS_MODEL_SIZE);
    assert!(size_of::<Model>() <= TRUEAXIS_MODEL_SIZE);
    assert!(align_of::<Model>() <= TRUEAXIS_ALIGNMENT);
};

impl Model {
    /// Nothing is loaded.
    pub(crate) const fn empty() -> Self {
        Self {
            stored: None,
            reversals: [const { Reversal::new() }; MAX_AXES],
            warmed: [None; MAX_SENSORS],
        }
    }

    /// Loads a file; on failure the model is empty. More axes than fit into a C array of `TRUEAXIS_AXES` are refused.
    pub(crate) fn load(&mut self, file: &'static [u8]) -> Result<(), Code> {
        *self = Self::empty();
        let stored = Stored::read(file)?;
        if stored.machine.axes.len() > TRUEAXIS_AXES {
            return Err(Code::Capacity);
        }
        self.stored = Some(stored);
        Ok(())
    }

    fn loaded(&self) -> Result<&Stored<'static>, Code> {
        self.stored.as_ref().ok_or(Code::NotLoaded)
    }

    /// Letters of the axes, in order.
    pub(crate) fn axes(&self, text: &mut Text<'_>) {
        for axis in self.stored.iter().flat_map(|stored| &stored.machine.axes) {
            text.push(axis.letter.char().encode_utf8(&mut [0; 4]));
        }
    }

    pub(crate) fn count(&self) -> Result<usize, Code> {
        self.loaded().map(|stored| stored.machine.axes.len())
    }

    /// Lets the errors follow readings (°C) for a time (s), each with the lag of its sensor; without a reading, a
    /// sensor stays as it is, at first at its reference.
    pub(crate) fn warm(&mut self, celsius: &[f64], seconds: f64) -> Result<(), Code> {
        let stored = self.stored.as_ref().ok_or(Code::NotLoaded)?;
        for (warmed, sensor) in self.warmed.iter_mut().zip(&stored.sensors) {
            let Some(kelvin) = read(sensor, celsius) else {
                continue;
            };
            let before = warmed.unwrap_or(kelvin);
            // y' = (u − y)/τ, backward: half a step over τ from the exact solution, and stable for any step.
            let part = match sensor.lag > 0.0 {
                true => seconds.max(0.0) / (sensor.lag + seconds.max(0.0)),
                false => 1.0,
            };
            *warmed = Some(before + part * (kelvin - before));
        }
        Ok(())
    }

    /// The position of the tool; without `celsius`, at the temperatures of [`Self::warm`]. `commands` give the nominal
    /// pose and the directions of travel, as in the runtime; `positions` give the actual pose. Both are in mm and
    /// degrees, with one value per axis.
    pub(crate) fn pose(
        &mut self,
        commands: &[f64],
        positions: &[f64],
        tool_length: f64,
        celsius: &[f64],
    ) -> Result<ModelPose, Code> {
        let stored = self.stored.as_ref().ok_or(Code::NotLoaded)?;
        let machine = &stored.machine;
        let mut situation = Situation {
            length: tool_length.is_finite().then_some(tool_length),
            ..Situation::default()
        };
        for (index, (axis, command)) in machine.axes.iter().zip(commands).enumerate() {
            let period = if axis.modulo { 360.0 } else { 0.0 };
            let (command, reversal_threshold) = (*command as f32, axis.reversal_threshold as f32);
            // On a bad input the runtime does not change the directions either.
            if command.is_finite() {
                self.reversals[index].update(command, reversal_threshold, period);
            }
            situation.sign[index] = match self.reversals[index].travel() {
                Travel::Positive => 1.0,
                Travel::Negative => -1.0,
                Travel::Unknown => 0.0,
            };
        }
        let mut kelvin = [0.0; MAX_SENSORS];
        for ((kelvin, warmed), sensor) in kelvin.iter_mut().zip(self.warmed).zip(&stored.sensors) {
            let found = if celsius.is_empty() {
                warmed
            } else {
                read(sensor, celsius)
            };
            *kelvin = found.unwrap_or(0.0);
        }
        situation.kelvin = kelvin;
        let kinematics = Kinematics::new(machine, &stored.errors);
        let nominal = kinematics.nominal(&kinematic(machine, commands), situation.length);
        let at = kinematic(machine, positions);
        let actual = kinematics.actual(&at, &situation, &Switches::ALL);
        let tip = |pose: &Htm| pose.t.into();
        Ok(ModelPose {
            tip: tip(&actual),
            direction: machine.direction(&actual),
            nominal_tip: tip(&nominal),
            nominal_direction: machine.direction(&nominal),
        })
    }
}

/// A reading (°C) as a difference from the sensor's reference (K), if there is one.
fn read(sensor: &Sensor, celsius: &[f64]) -> Option<f64> {
    let celsius = celsius.get(sensor.reading).filter(|v| v.is_finite())?;
    Some(celsius - sensor.reference)
}

/// Converts positions (mm, deg) to mm and rad, reducing those of endless axes to the turn in which errors are
/// described.
fn kinematic(machine: &Machine, positions: &[f64]) -> PerAxis {
    let mut q = PerAxis::default();
    for ((q, axis), position) in q.iter_mut().zip(&machine.axes).zip(positions) {
        *q = axis.to_kinematic(axis.within_turn(*position));
    }
    q
}

impl From<StoredError> for Code {
    fn from(error: StoredError) -> Self {
        match error {
            StoredError::NoModel => Self::NotAModel,
            StoredError::Version { .. } => Self::Version,
            StoredError::Damaged => Self::Damaged,
            StoredError::Misaligned => Self::Misaligned,
            StoredError::Contents => Self::Contents,
        }
    }
}
