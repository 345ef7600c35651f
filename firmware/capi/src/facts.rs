//! Structures visible to C.

use crate::capacities::{
    TRUEAXIS_AXES, TRUEAXIS_BANKS, TRUEAXIS_GRIDS, TRUEAXIS_TABLES, TRUEAXIS_TERMS,
};
use crate::text::Text;
use core::ffi::{c_char, c_int, c_void};
use trueaxis::{Auxiliary, AuxiliaryKind, Axis, Conditions, Policy};

/// Size of tables in words of 8 bytes: a fixed part, plus a part for each axis, bank, table, term and grid.
pub const TRUEAXIS_TABLES_WORDS: usize = 128
    + 6 * TRUEAXIS_AXES
    + 12 * TRUEAXIS_BANKS
    + TRUEAXIS_TABLES
    + 5 * TRUEAXIS_TERMS / 2
    + 34 * TRUEAXIS_GRIDS;
/// Size of tables in bytes.
pub const TRUEAXIS_TABLES_SIZE: usize = 8 * TRUEAXIS_TABLES_WORDS;
/// Size of a servo in words of 8 bytes: a fixed part, plus a part for each axis.
pub const TRUEAXIS_SERVO_WORDS: usize = 150 + 24 * TRUEAXIS_AXES;
/// Size of a servo in bytes.
pub const TRUEAXIS_SERVO_SIZE: usize = 8 * TRUEAXIS_SERVO_WORDS;
/// Required alignment of the memory for tables and servos in bytes.
pub const TRUEAXIS_ALIGNMENT: usize = 8;
/// Maximum number of auxiliary inputs.
pub const TRUEAXIS_AUXILIARIES: usize = 8;
/// Maximum number of adjustable terms.
pub const TRUEAXIS_ADJUSTABLE: usize = 16;
/// Size of a name in bytes, including the terminating zero.
pub const TRUEAXIS_NAME_SIZE: usize = 17;

/// Unit: mm.
pub const TRUEAXIS_MM: u8 = 0;
/// Unit: degrees.
pub const TRUEAXIS_DEGREES: u8 = 1;

/// Kind of auxiliary input: tool length, mm.
pub const TRUEAXIS_TOOL_LENGTH: u8 = 0;
/// Kind of auxiliary input: temperature, °C.
pub const TRUEAXIS_TEMPERATURE: u8 = 1;

/// Policy: rotary axes correct the orientation of the tool.
pub const TRUEAXIS_ORIENTATION: u8 = 0;
/// Policy: rotary axes correct the direction of the tool.
pub const TRUEAXIS_DIRECTION: u8 = 1;
/// Policy: rotary axes are not corrected.
pub const TRUEAXIS_POSITION: u8 = 2;

/// Condition: an input is NAN, infinite, or out of reach.
pub const TRUEAXIS_BAD_INPUT: u16 = 1;
/// Condition: the period is outside 1 µs to 10 ms.
pub const TRUEAXIS_BAD_PERIOD: u16 = 1 << 1;
/// Condition: an axis on which a correction depends is not referenced.
pub const TRUEAXIS_UNREFERENCED: u16 = 1 << 2;
/// Condition: the computed correction is from an earlier period.
pub const TRUEAXIS_HELD: u16 = 1 << 3;
/// Condition: after a fault or the loss of a reference, until the fade factor has reached 0.
pub const TRUEAXIS_FROZEN: u16 = 1 << 4;
/// Condition: the fade factor is moving to 0 or 1.
pub const TRUEAXIS_RAMPING: u16 = 1 << 5;
/// Condition: other tables, weights or auxiliaries are being faded in, or are waiting for that.
pub const TRUEAXIS_FADING: u16 = 1 << 6;
/// Condition: not enabled.
pub const TRUEAXIS_DISABLED: u16 = 1 << 7;
/// Condition: a dry run is active.
pub const TRUEAXIS_DRY_RUN: u16 = 1 << 8;
/// Condition: a tool length or a temperature that matters was never set or is unusable.
pub const TRUEAXIS_BAD_AUXILIARY: u16 = 1 << 9;
/// Condition: nothing is loaded, so nothing is corrected.
pub const TRUEAXIS_NOTHING_LOADED: u16 = 1 << 10;
/// Condition: a temperature that matters is beyond its tables, so its effect stays what it is at the border.
pub const TRUEAXIS_BEYOND_RANGE: u16 = 1 << 11;

const _: () = {
    assert!(size_of::<TablesMemory>() == TRUEAXIS_TABLES_SIZE);
    assert!(size_of::<ServoMemory>() == TRUEAXIS_SERVO_SIZE);
    assert!(TRUEAXIS_AUXILIARIES == trueaxis::AUXILIARIES);
    assert!(TRUEAXIS_ADJUSTABLE == trueaxis::ADJUSTABLE);
    assert!(TRUEAXIS_BAD_INPUT == Conditions::BAD_INPUT.0);
    assert!(TRUEAXIS_BAD_PERIOD == Conditions::BAD_PERIOD.0);
    assert!(TRUEAXIS_UNREFERENCED == Conditions::UNREFERENCED.0);
    assert!(TRUEAXIS_HELD == Conditions::HELD.0);
    assert!(TRUEAXIS_FROZEN == Conditions::FROZEN.0);
    assert!(TRUEAXIS_RAMPING == Conditions::RAMPING.0);
    assert!(TRUEAXIS_FADING == Conditions::FADING.0);
    assert!(TRUEAXIS_DISABLED == Conditions::DISABLED.0);
    assert!(TRUEAXIS_DRY_RUN == Conditions::DRY_RUN.0);
    assert!(TRUEAXIS_BAD_AUXILIARY == Conditions::BAD_AUXILIARY.0);
    assert!(TRUEAXIS_NOTHING_LOADED == Conditions::NOTHING_LOADED.0);
    assert!(TRUEAXIS_BEYOND_RANGE == Conditions::BEYOND_RANGE.0);
};

/// Memory for tables, in a `static` or anywhere else.
#[repr(C)]
pub struct TablesMemory {
    /// For use by the library only.
    pub words: [u64; TRUEAXIS_TABLES_WORDS],
}

/// Memory for a servo, in a `static` or anywhere else.
#[repr(C)]
pub struct ServoMemory {
    /// For use by the library only.
    pub words: [u64; TRUEAXIS_SERVO_WORDS],
}

/// Information about loaded tables.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Facts {
    /// Length of the blob in bytes; of generated code that of the blob from which it was generated.
    pub bytes: u32,
    /// CRC-32; together with the length it identifies a blob.
    pub checksum: u32,
    /// Version of the blob format.
    pub version: u16,
    /// Number of axes.
    pub axes: u16,
    /// Number of auxiliary inputs.
    pub auxiliaries: u16,
    /// Number of adjustable terms.
    pub adjustable: u16,
    /// Number of tables; generated code has its tables within it, and here one for each bank.
    pub tables: u16,
    /// Number of terms.
    pub terms: u16,
    /// Number of grids.
    pub grids: u16,
    /// What the rotary axes correct: `TRUEAXIS_ORIENTATION`, `TRUEAXIS_DIRECTION` or `TRUEAXIS_POSITION`.
    pub policy: u8,
    /// Always 0.
    pub reserved: u8,
    /// One bit per axis (bit 0 is the first) on whose position a correction depends, then one per
    /// auxiliary input.
    pub inputs_used: u32,
}

/// Code that computes corrections: from the positions in the order of the axes, the auxiliary inputs, the direction in
/// which each axis last moved (1, -1, or 0 if unknown), and the weights of the adjustable terms.
pub(crate) type Evaluate = unsafe extern "C" fn(
    positions: *const f32,
    auxiliaries: *const f32,
    travel: *const i8,
    weights: *const f32,
    corrections: *mut f32,
);

/// A compensation as code: what `trueaxis generate --servo` writes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Generated {
    /// Axes, bounds, auxiliary inputs and weights as a blob without samples, aligned to 4 bytes.
    pub facts: *const c_void,
    /// Length in bytes.
    pub size: usize,
    /// The code. `corrections` has room for one value per axis.
    pub evaluate: Option<
        unsafe extern "C" fn(
            positions: *const f32,
            auxiliaries: *const f32,
            travel: *const i8,
            weights: *const f32,
            corrections: *mut f32,
        ),
    >,
    /// 1 if the code gives the bits of the compensation as it was compiled.
    pub check: Option<unsafe extern "C" fn() -> c_int>,
    /// Length in bytes of the blob from which it was generated.
    pub bytes: u32,
    /// Checksum of that blob.
    pub checksum: u32,
}

/// The C constant of a policy.
pub(crate) fn policy(policy: Policy) -> u8 {
    match policy {
        Policy::Orientation => TRUEAXIS_ORIENTATION,
        Policy::Direction { .. } => TRUEAXIS_DIRECTION,
        Policy::Position => TRUEAXIS_POSITION,
    }
}

/// An axis: an input and an output of the tables.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AxisFacts {
    /// Letter of the axis.
    pub name: c_char,
    /// Unit of its positions and corrections: `TRUEAXIS_DEGREES` for A, B and C, otherwise `TRUEAXIS_MM`.
    pub unit: u8,
    /// Always 0.
    pub reserved: u16,
    /// Lower end of its travel; −FLT_MAX if it has none.
    pub lower: f32,
    /// Upper end of its travel; FLT_MAX if it has none.
    pub upper: f32,
    /// Length of one turn of an endless axis; 0 for others.
    pub turn: f32,
    /// Largest magnitude of its correction.
    pub value_bound: f32,
    /// Largest rate of change of its correction, per s.
    pub rate_bound: f32,
    /// Rate of change of its correction in transitions, per s.
    pub ramp_rate: f32,
    /// How far it must come back to count as reversed.
    pub reversal_threshold: f32,
    /// Largest rate of change of its correction while it makes up a reversal, per s.
    pub reversal_rate: f32,
    /// Largest acceleration of its correction meanwhile, per s².
    pub reversal_acceleration: f32,
}

impl From<&Axis> for AxisFacts {
    fn from(axis: &Axis) -> Self {
        let rotary = matches!(axis.name, b'A' | b'B' | b'C');
        Self {
            name: axis.name as c_char,
            unit: if rotary {
                TRUEAXIS_DEGREES
            } else {
                TRUEAXIS_MM
            },
            reserved: 0,
            lower: axis.travel[0],
            upper: axis.travel[1],
            turn: axis.period,
            value_bound: axis.value_bound,
            rate_bound: axis.rate_bound,
            ramp_rate: axis.ramp_rate,
            reversal_threshold: axis.reversal_threshold,
            reversal_rate: axis.reversal_rate,
            reversal_acceleration: axis.reversal_acceleration,
        }
    }
}

/// An auxiliary input.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuxiliaryFacts {
    /// The tool length for which the tables were made, mm, or the reference temperature, °C.
    pub reference: f32,
    /// Lowest plausible reading of a temperature, °C; one below is a fault of the input.
    pub lowest: f32,
    /// Highest plausible reading of a temperature, °C; one above is a fault of the input.
    pub highest: f32,
    /// How fast a temperature is followed, K/s.
    pub rate: f32,
    /// `TRUEAXIS_TOOL_LENGTH` or `TRUEAXIS_TEMPERATURE`.
    pub kind: u8,
    /// In UTF-8, terminated by a zero.
    pub name: [c_char; TRUEAXIS_NAME_SIZE],
}

impl From<&Auxiliary> for AuxiliaryFacts {
    fn from(auxiliary: &Auxiliary) -> Self {
        let mut name = [0; TRUEAXIS_NAME_SIZE];
        let mut text = Text::new(&mut name);
        text.push(&auxiliary.name);
        text.end();
        let [lowest, highest] = auxiliary.sensor.range;
        Self {
            reference: auxiliary.reference,
            lowest,
            highest,
            rate: auxiliary.sensor.rate,
            kind: match auxiliary.kind {
                AuxiliaryKind::ToolLength => TRUEAXIS_TOOL_LENGTH,
                AuxiliaryKind::Temperature => TRUEAXIS_TEMPERATURE,
            },
            name: name.map(|byte| byte as c_char),
        }
    }
}

/// A term with an adjustable weight.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Adjustable {
    /// Index among all terms, as used by `trueaxis_servo_set_weight`.
    pub term: u32,
    /// Index of the axis that it corrects.
    pub axis: u32,
    /// The weight that the blob stores.
    pub weight: f32,
    /// Lowest weight.
    pub lower: f32,
    /// Highest weight.
    pub upper: f32,
}

/// Status of the last period.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StatusFacts {
    /// Conditions, `TRUEAXIS_BAD_INPUT` …; `trueaxis_conditions_text` gives them in words.
    pub conditions: u16,
    /// Axes (bit 0 is the first) whose computed correction reached the value bound.
    pub saturated: u16,
    /// Axes whose correction lags because of the rate bound.
    pub rate_limited: u16,
    /// Axes whose correction would leave the travel.
    pub travel_limited: u16,
    /// The fade factor, 0…1.
    pub factor: f32,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Servo, Tables};

    #[test]
    fn memory_in_the_header_is_hardly_larger_than_what_it_holds() {
        // Sufficient size is checked at compile time. The coefficients in the constants above are the size of one more
        // axis, bank … with 8-byte pointers.
        for (offered, taken) in [
            (TRUEAXIS_TABLES_SIZE, size_of::<Tables>()),
            (TRUEAXIS_SERVO_SIZE, size_of::<Servo>()),
        ] {
            assert!(offered - taken <= taken / 10, "{offered} for {taken}");
        }
    }
}
