//! Warns about descriptions that are possible but unlikely: wrong units, a tool off its axis.

use super::{MachineFile, along};
use crate::machine::{Letter, Machine};
use crate::source::{Exactly, FileError};
use toml::Spanned;

/// A full turn in radians is 6.3. A rotary travel below this (deg) is narrower than any that is really in degrees.
const NARROW: f64 = 7.0;
/// Angles on drawings are multiples of this (deg); orientations below a turn in radians that are not are suspicious.
const ROUND: f64 = 0.5;
/// The shortest tool (mm); a shorter one may be in metres.
const SHORT: f64 = 1.0;
/// Distance (mm) from the tool axis below which a tip gets no warning.
const BESIDE: f64 = 1e-3;

impl Machine {
    /// Warnings about a description that [`Self::from_toml`] accepts: a rotary travel or an orientation that looks
    /// like radians, a tip close to the spindle frame or off the tool axis.
    #[must_use]
    pub fn doubts(text: &str) -> Vec<FileError> {
        let Ok(file) = toml::from_str::<MachineFile>(text) else {
            return Vec::new();
        };
        let mut doubts = Vec::new();
        for entry in file.axis.iter().map(Spanned::get_ref) {
            let name = entry.name.get_ref();
            let rotary = name.chars().next().and_then(Letter::new);
            if rotary.is_some_and(Letter::is_rotary) {
                doubts.extend(narrow(name, &entry.range));
            }
            doubts.extend(radians(&format!("axis {name}"), &entry.orientation_deg));
        }
        if let Some(spindle) = &file.spindle {
            doubts.extend(radians("the spindle", &spindle.get_ref().orientation_deg));
        }
        doubts.extend(radians("the workpiece", &file.workpiece.orientation_deg));
        if let (Some(tool), Some(spindle)) = (&file.tool, &file.spindle)
            && let Some(axis) = &spindle.get_ref().axis
        {
            doubts.extend(tip(&tool.tip_mm, axis.get_ref()));
        }
        doubts
    }
}

/// A rotary travel that looks like radians.
fn narrow(axis: &str, range: &Spanned<Exactly<2>>) -> Option<FileError> {
    let Exactly([low, high]) = *range.get_ref();
    let width = high - low;
    (width < NARROW).then(|| {
        FileError::at(
            range.span(),
            format!(
                "the travel of axis {axis} is {width} degrees in all, which looks like radians"
            ),
            "degrees",
            "write it in degrees",
        )
    })
}

/// An orientation that looks like radians.
fn radians(of: &str, orientation: &Option<Spanned<Exactly<3>>>) -> Option<FileError> {
    let orientation = orientation.as_ref()?;
    let looks = |v: &&f64| {
        let steps = **v / ROUND;
        v.abs() <= std::f64::consts::TAU && steps != steps.round()
    };
    let value = orientation.get_ref().0.iter().find(looks)?;
    Some(FileError::at(
        orientation.span(),
        format!(
            "the orientation of {of} has {value} degrees, which looks like radians: {:.1} degrees",
            value.to_degrees()
        ),
        "degrees",
        "write it in degrees; a measured misalignment belongs into the error file",
    ))
}

/// A tip that looks like metres, or lies off the tool axis.
fn tip(tip: &Spanned<Exactly<3>>, axis: &str) -> Option<FileError> {
    let Exactly([x, y, z]) = *tip.get_ref();
    let beside = match axis {
        "x" => libm::hypot(y, z),
        "y" => libm::hypot(x, z),
        _ => libm::hypot(x, y),
    };
    let length = libm::hypot(libm::hypot(x, y), z);
    let at = |message, remedy| Some(FileError::at(tip.span(), message, "mm", remedy));
    if length < SHORT {
        return at(
            format!("the tip is {length} mm from the spindle frame"),
            "write tip_mm in mm, from the spindle frame to the tip of the tool".to_owned(),
        );
    }
    if beside <= BESIDE {
        return None;
    }
    at(
        format!("the tip is {beside:.3} mm off the tool axis {axis} of the spindle"),
        format!(
            "a rotating tool has its tip on the axis: check axis in [spindle] (the tip is along {})",
            along([x, y, z])
        ),
    )
}
