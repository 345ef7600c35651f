//! `probe.toml`: a qualified probe.

use nalgebra::Vector3;
use serde::Deserialize;
use std::fmt::Write;
use std::ops::Range;
use toml::Spanned;
use trueaxis_identify::formats::artefact::Stylus;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;

/// A qualified probe.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ProbeFile {
    /// The machine on which it was qualified.
    pub machine: String,
    /// Effective radius of the tip around its equator, mean of all directions (mm).
    pub radius: f64,
    /// Standard uncertainty (mm).
    pub radius_uncertainty: f64,
    /// Coordinates of the tip in the spindle frame (mm), where they were found.
    pub tip: [Option<f64>; 3],
    /// Their standard uncertainties (mm), where they do not rest on rotary axes that may have errors.
    pub tip_uncertainty: [Option<f64>; 3],
    /// Standard uncertainty of the term of the pole (mm).
    pub pole_uncertainty: f64,
    /// How the effective radius depends on the direction.
    pub shape: Spherical,
}

/// Deviation of an effective radius by direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spherical {
    /// At the pole (mm).
    pub pole: f64,
    /// Around the stylus.
    pub lobes: Vec<Lobe>,
}

/// A harmonic around the stylus.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lobe {
    /// Number of lobes in a turn.
    pub order: usize,
    /// Coefficient of the cosine (mm).
    pub cosine: f64,
    /// Coefficient of the sine (mm).
    pub sine: f64,
    /// Standard uncertainty of each (mm).
    pub uncertainty: f64,
}

impl Spherical {
    /// The angle around the stylus, from the next axis of the spindle frame after the tool axis, right-handed about the
    /// tool axis, and the height above the equator, both rad, of a direction in the spindle frame from the ball to a tip.
    #[must_use]
    pub fn direction(machine: &Machine, tip: &Vector3<f64>, own: &Vector3<f64>) -> [f64; 2] {
        let axis = machine.tool_axis;
        let up = if tip[axis] > 0.0 { -1.0 } else { 1.0 };
        let around = libm::atan2(own[(axis + 2) % 3], own[(axis + 1) % 3]);
        [around, libm::asin((own[axis] * up).clamp(-1.0, 1.0))]
    }

    /// The deviation (mm) in a direction (rad).
    #[must_use]
    pub fn deviation(&self, around: f64, height: f64) -> f64 {
        let lobes = self.lobes.iter().map(|lobe| {
            let angle = lobe.order as f64 * around;
            lobe.cosine * libm::cos(angle) + lobe.sine * libm::sin(angle)
        });
        self.pole * libm::sin(height).powi(2) + libm::cos(height) * lobes.sum::<f64>()
    }

    /// The lobe of an order.
    pub(crate) fn lobe(&mut self, order: usize) -> &mut Lobe {
        let at = self.lobes.iter().position(|lobe| lobe.order == order);
        let at = at.unwrap_or_else(|| {
            self.lobes.push(Lobe {
                order,
                ..Lobe::default()
            });
            self.lobes.len() - 1
        });
        &mut self.lobes[at]
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ProbeEntries {
    machine: Spanned<String>,
    tip_radius_mm: Spanned<f64>,
    tip_radius_standard_uncertainty_mm: Spanned<f64>,
    x_mm: Option<f64>,
    y_mm: Option<f64>,
    z_mm: Option<f64>,
    x_standard_uncertainty_mm: Option<f64>,
    y_standard_uncertainty_mm: Option<f64>,
    z_standard_uncertainty_mm: Option<f64>,
    #[serde(default)]
    pole_mm: f64,
    #[serde(default)]
    pole_standard_uncertainty_mm: f64,
    #[serde(default)]
    lobe: Vec<Spanned<LobeEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LobeEntry {
    order: usize,
    cosine_mm: f64,
    sine_mm: f64,
    standard_uncertainty_mm: f64,
}
const REMEDY: &str = "give the file that `trueaxis qualify` has written for this machine";

fn wrong<T>(span: Range<usize>) -> Result<T, FileError> {
    Err(FileError::here(span, "no probe is like this", REMEDY))
}

impl ProbeEntries {
    fn is_of(&self, machine: &Machine) -> Result<(), FileError> {
        if *self.machine.get_ref() == machine.name {
            return Ok(());
        }
        Err(FileError::at(
            self.machine.span(),
            format!("the probe was qualified on `{}`", self.machine.get_ref()),
            format!("not {}", machine.name),
            REMEDY,
        ))
    }

    fn tip(&self) -> [Option<f64>; 3] {
        [self.x_mm, self.y_mm, self.z_mm]
    }

    fn tip_uncertainty(&self) -> [Option<f64>; 3] {
        [
            self.x_standard_uncertainty_mm,
            self.y_standard_uncertainty_mm,
            self.z_standard_uncertainty_mm,
        ]
    }

    /// Checks all numbers but those of lobes.
    fn has_sizes(&self) -> Result<(), FileError> {
        let radius = *self.tip_radius_mm.get_ref();
        if !(radius > 0.0 && radius < 100.0) {
            return wrong(self.tip_radius_mm.span());
        }
        let uncertainties = [
            *self.tip_radius_standard_uncertainty_mm.get_ref(),
            self.pole_standard_uncertainty_mm,
        ];
        let is_uncertainty = |value: &f64| *value >= 0.0 && value.is_finite();
        let is_placed = |(tip, uncertainty): (&Option<f64>, &Option<f64>)| match (tip, uncertainty)
        {
            (None, uncertainty) => uncertainty.is_none(),
            (Some(tip), None) => tip.is_finite(),
            (Some(tip), Some(uncertainty)) => tip.is_finite() && *uncertainty > 0.0,
        };
        if !uncertainties.iter().all(is_uncertainty)
            || !self
                .tip()
                .iter()
                .zip(&self.tip_uncertainty())
                .all(is_placed)
            || self.pole_mm.is_nan()
            || self.pole_mm.abs() > LARGEST
        {
            return wrong(self.tip_radius_standard_uncertainty_mm.span());
        }
        Ok(())
    }

    fn shape(&self) -> Result<Spherical, FileError> {
        let mut shape = Spherical {
            pole: self.pole_mm,
            lobes: Vec::new(),
        };
        for entry in &self.lobe {
            let LobeEntry {
                order,
                cosine_mm: cosine,
                sine_mm: sine,
                standard_uncertainty_mm: uncertainty,
            } = *entry.get_ref();
            let is_new = shape.lobes.iter().all(|lobe| lobe.order != order);
            let is_small = cosine.abs() <= LARGEST && sine.abs() <= LARGEST && uncertainty >= 0.0;
            if !(is_new && is_small && (2..=ORDERS).contains(&order)) {
                return wrong(entry.span());
            }
            shape.lobes.push(Lobe {
                order,
                cosine,
                sine,
                uncertainty,
            });
        }
        Ok(shape)
    }
}

/// Largest deviation of an effective radius (mm), and highest order of lobes.
const LARGEST: f64 = 1.0;
/// Highest order of lobes.
pub const ORDERS: usize = 8;

impl ProbeFile {
    /// Reads the file of a machine.
    ///
    /// # Errors
    /// [`FileError`]: syntax, another machine, impossible sizes.
    pub fn from_toml(text: &str, machine: &Machine) -> Result<Self, FileError> {
        let file: ProbeEntries =
            toml::from_str(text).map_err(|error| FileError::syntax(&error, text))?;
        file.is_of(machine)?;
        file.has_sizes()?;
        Ok(Self {
            machine: machine.name.clone(),
            radius: *file.tip_radius_mm.get_ref(),
            radius_uncertainty: *file.tip_radius_standard_uncertainty_mm.get_ref(),
            tip: file.tip(),
            tip_uncertainty: file.tip_uncertainty(),
            pole_uncertainty: file.pole_standard_uncertainty_mm,
            shape: file.shape()?,
        })
    }

    /// What is found of the tip, in place of what an artefact file says.
    pub fn known(&self, stylus: &mut Stylus) {
        for (k, value) in self.tip.iter().enumerate() {
            if value.is_some() {
                stylus.tip[k] = *value;
                stylus.uncertainty[k] = self.tip_uncertainty[k];
            }
        }
    }

    /// The file.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "# A probe as `trueaxis qualify` found it.\nmachine = {}\n\
             tip_radius_mm = {:.6}\ntip_radius_standard_uncertainty_mm = {:.6}\n",
            toml::Value::from(self.machine.as_str()),
            self.radius,
            self.radius_uncertainty
        );
        for (k, name) in ["x", "y", "z"].iter().enumerate() {
            if let Some(value) = self.tip[k] {
                let _ = writeln!(text, "{name}_mm = {value:.6}");
            }
            if let Some(value) = self.tip_uncertainty[k] {
                let _ = writeln!(text, "{name}_standard_uncertainty_mm = {value:.6}");
            }
        }
        if self.shape.pole != 0.0 {
            let (value, uncertainty) = (self.shape.pole, self.pole_uncertainty);
            let _ = writeln!(
                text,
                "pole_mm = {value:.6}\npole_standard_uncertainty_mm = {uncertainty:.6}"
            );
        }
        for lobe in &self.shape.lobes {
            let _ = write!(
                text,
                "\n[[lobe]]\norder = {}\ncosine_mm = {:.6}\nsine_mm = {:.6}\nstandard_uncertainty_mm = {:.6}\n",
                lobe.order, lobe.cosine, lobe.sine, lobe.uncertainty
            );
        }
        text
    }
}
