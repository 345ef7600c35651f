//! The description in postcard: the head, the axes, then items.

use serde::{Deserialize, Serialize};

/// A pose: three columns of its rotation, then its translation (mm).
pub type Frame = [f64; 12];

/// The parts that occur once.
#[derive(Serialize, Deserialize)]
pub struct Head<'f> {
    pub name: &'f str,
    pub axes: u8,
    pub spindle: Frame,
    pub tool_axis: u8,
    pub tip: [f64; 3],
    pub workpiece: Frame,
    pub items: u32,
}

/// An axis: mm and degrees, except `calibrated` (mm, rad).
#[derive(Serialize, Deserialize)]
pub struct AxisEntry {
    pub letter: u8,
    pub tool: bool,
    pub modulo: bool,
    pub reversed: bool,
    pub frame: Frame,
    pub travel: [f64; 2],
    pub max_speed: f64,
    pub reversal_threshold: f64,
    pub calibrated: [f64; 2],
}

/// A coefficient of an error motion.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub enum Kind {
    Degree(u8),
    Cosine(u8),
    Sine(u8),
    Backlash,
}

/// One error, located by axis (the number of axes for the spindle) and component.
#[derive(Serialize, Deserialize)]
pub enum Item {
    /// A sensor, with its reference temperature (°C).
    Reference(f64),
    Location([u8; 2], f64),
    /// Sensor index, and change per kelvin.
    LocationPerKelvin([u8; 2], u8, f64),
    Motion([u8; 2], Kind, f64),
    MotionPerKelvin([u8; 2], Kind, u8, f64),
    /// Number of points, and whether there are separate values after negative travel.
    Table([u8; 2], u32, bool),
    /// Of the last sensor: the reading that it follows, and its lag (s). Without it, the reading of the same number at once.
    Lag(u8, f64),
}
