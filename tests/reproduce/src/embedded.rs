//! The document's machines with their parameters, artefacts and strategies: the files of `examples/`, embedded in the
//! program.

use super::ReproduceError;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::{self, Probings};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

macro_rules! example {
    ($path:literal) => {
        include_str!(concat!("../../../examples/", $path))
    };
}

/// A machine of the document.
pub struct Example {
    pub machine: Machine,
    artefact: String,
}

/// The Kolibri of Chapters 5 and 6.
pub fn kolibri() -> Result<Example, ReproduceError> {
    Ok(Example {
        machine: Machine::from_toml(example!("kolibri/machine.toml"))?,
        artefact: example!("kolibri/artefact.toml").to_owned(),
    })
}

/// The Mitsui Seiki of Chapter 4.
pub fn hu40() -> Result<Example, ReproduceError> {
    Ok(Example {
        machine: Machine::from_toml(example!("hu40/machine.toml"))?,
        artefact: example!("hu40/artefact.toml").to_owned(),
    })
}

/// The Huron of Chapter 7, with its tilted axis.
pub fn huron() -> Result<Example, ReproduceError> {
    Ok(Example {
        machine: Machine::from_toml(example!("huron-k2x8/machine.toml"))?,
        artefact: String::new(),
    })
}

/// Parameters from a table of the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameters {
    /// Table 6-4: the Kolibri as calibrated.
    Kolibri10,
    /// Table 5-5, setups 1 to 4.
    Kolibri12,
    /// Table 5-5, setup S: the same machine as validated.
    Kolibri12AtValidation,
    /// Appendix of Chapter 5.
    Kolibri81,
    /// Table 4-3.
    Hu40Of13,
    /// Table 4-2.
    Hu40Of84,
    /// Table 7-2, before compensation.
    Huron13,
    /// Table 7-2, after compensation.
    Huron13After,
}

/// A strategy of the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Strategy {
    /// Table 5-3: the calibration of the Kolibri, four balls.
    KolibriCalibration,
    /// Table 5-4: its validation, one ball.
    KolibriValidation,
    /// Table 6-3: both, with other angles in four pairs.
    KolibriCalibration63,
    KolibriValidation63,
    /// Table 4-1: the HU40.
    Hu40,
}

/// A and C (deg) of the pairs of Tables 5-3 and 5-4 that Table 6-3 prints differently, and its A.
const TABLE_6_3: [([f64; 2], f64); 4] = [
    ([55.0, 340.0], 50.0),
    ([-50.0, -310.0], -55.0),
    ([53.0, -208.0], 55.0),
    ([-5.0, -300.0], -50.0),
];

impl Example {
    pub fn errors(&self, parameters: Parameters) -> Result<ErrorModel, ReproduceError> {
        let text = match parameters {
            Parameters::Kolibri10 => example!("kolibri/errors-10.toml"),
            Parameters::Kolibri12 => example!("kolibri/errors-12.toml"),
            Parameters::Kolibri12AtValidation => example!("kolibri/errors-12-at-validation.toml"),
            Parameters::Kolibri81 => example!("kolibri/errors-81.toml"),
            Parameters::Hu40Of13 => example!("hu40/errors-13.toml"),
            Parameters::Hu40Of84 => example!("hu40/errors-84.toml"),
            Parameters::Huron13 => example!("huron-k2x8/errors-13.toml"),
            Parameters::Huron13After => example!("huron-k2x8/errors-13-after.toml"),
        };
        Ok(ErrorModel::from_toml(text, &self.machine)?)
    }

    pub fn strategy(&self, strategy: Strategy) -> Result<Probings, ReproduceError> {
        let text = match strategy {
            Strategy::KolibriCalibration | Strategy::KolibriCalibration63 => {
                example!("kolibri/plan.csv")
            }
            Strategy::KolibriValidation | Strategy::KolibriValidation63 => {
                example!("kolibri/validation.csv")
            }
            Strategy::Hu40 => example!("hu40/plan.csv"),
        };
        let mut read = probings::read(text, &self.machine, false)?;
        if matches!(
            strategy,
            Strategy::KolibriCalibration63 | Strategy::KolibriValidation63
        ) {
            self.as_in_table_6_3(&mut read);
        }
        Ok(read)
    }

    fn as_in_table_6_3(&self, strategy: &mut Probings) {
        let (Some(a), Some(c)) = (self.machine.index('A'), self.machine.index('C')) else {
            return;
        };
        for row in &mut strategy.rows {
            let pair = [row.position[a], row.position[c]];
            if let Some((_, there)) = TABLE_6_3.iter().find(|(here, _)| *here == pair) {
                row.position[a] = *there;
            }
        }
    }

    pub fn artefact(&self) -> Result<Artefact, ReproduceError> {
        Ok(Artefact::from_toml(&self.artefact, self.machine.tool_axis)?)
    }

    /// With the first ball at another place (mm), and no others.
    pub fn with_ball(mut self, [x, y, z]: [f64; 3]) -> Self {
        self.artefact = format!("[[ball]]\nname = \"1\"\nnominal_mm = [{x:?}, {y:?}, {z:?}]\n");
        self
    }

    /// With travels of X, Y and Z of the same length that begin at zero.
    pub fn begun_at_zero(mut self) -> Self {
        for axis in &mut self.machine.axes {
            if !axis.letter.is_rotary() {
                axis.travel = [0.0, axis.travel[1] - axis.travel[0]];
            }
        }
        self
    }

    /// With the tip in the frame of Z, as in Chapter 6 (Eq. 44 has no tool), and the travel of Z where the tip
    /// goes.
    pub fn tip_at_z(mut self) -> Self {
        let along = self.machine.tip[2];
        self.machine.tip = [0.0; 3];
        if let Some(index) = self.machine.index('Z') {
            self.machine.axes[index].travel =
                self.machine.axes[index].travel.map(|end| end + along);
        }
        self
    }

    /// With the travel of a linear axis, and the tool (mm).
    pub fn with_zone(mut self, zone: &[(char, [f64; 2])], tool: f64) -> Self {
        for (letter, travel) in zone {
            if let Some(index) = self.machine.index(*letter) {
                self.machine.axes[index].travel = *travel;
            }
        }
        let along = self.machine.tool_axis;
        self.machine.tip[along] = tool;
        self
    }

    /// With every axis limited to the probed range (sections 5.9.2 and 6.8).
    pub fn within_probed(mut self, probed: &Probings) -> Self {
        for (index, axis) in self.machine.axes.iter_mut().enumerate() {
            let at = probed.rows.iter().map(|row| row.position[index]);
            axis.travel = at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| {
                [low.min(at), high.max(at)]
            });
        }
        self
    }

    /// With an axis limited to ±`degrees`.
    pub fn within(mut self, letter: char, degrees: f64) -> Self {
        if let Some(index) = self.machine.index(letter) {
            self.machine.axes[index].travel = [-degrees, degrees];
        }
        self
    }
}
