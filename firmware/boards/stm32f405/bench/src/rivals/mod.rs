//! Alternatives without tables, for the Huron K2X8-Five and its thirteen errors.
//!
//! Positions and corrections are in the order of the blob, Y A C X Z, mm and degrees.

pub mod closed_form;
pub mod exact;
pub mod htm;

/// Degrees per radian.
pub const DEGREES: f32 = 180.0 / core::f32::consts::PI;

/// Distance along the tool axis from the spindle frame to the tip, mm.
pub const TIP: f32 = 130.0;

/// The thirteen errors, as published (`examples/huron-k2x8/errors-13.toml`); mm, rad, mm/mm.
pub mod errors {
    pub const EZ0S: f32 = 55.6e-3;
    pub const EA0Z: f32 = 106.0e-6;
    pub const EZZ1: f32 = 30.0e-6;
    pub const EB0A: f32 = 39.1e-6;
    pub const EA0C: f32 = 33.8e-6;
    pub const EC0X: f32 = -32.0e-6;
    pub const EB0Z: f32 = 22.0e-6;
    pub const EB0C: f32 = -14.6e-6;
    pub const EXX1: f32 = 25.9e-6;
    pub const EX0S: f32 = -2.1e-3;
    pub const EYY1: f32 = -14.3e-6;
    pub const EC0A: f32 = 5.5e-6;
    pub const EY0C: f32 = 1.0e-3;
}
