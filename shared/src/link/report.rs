//! Answers to hello and status.

use core::fmt;

use serde::{Deserialize, Serialize};

use super::progress::{Activation, Upload};
use super::slot::{Slot, SlotReport};
use crate::description::{ADJUSTABLE, AUXILIARIES};
use crate::load_error::LoadError;

/// Maximum number of axes of any controller: masks have 16 bits.
pub const MOST_AXES: usize = 16;
/// Maximum length in bytes of a machine name in [`Hello`]; longer names are truncated, see [`short_name`].
pub const MOST_NAME: usize = 64;

/// The first [`MOST_NAME`] bytes of a name, or fewer, so that no character is split.
#[must_use]
pub fn short_name(name: &str) -> &str {
    let mut end = name.len();
    if end > MOST_NAME {
        end = MOST_NAME;
        while !name.is_char_boundary(end) {
            end -= 1;
        }
    }
    name.get(..end).unwrap_or(name)
}

/// How the servo keeps running while the flash is erased or programmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum WhileBusy {
    /// It does not: every fetch and every read stalls, for up to seconds. The slots are erased and written only while
    /// the machine stands still with its drives off.
    Standstill,
    /// Erasing and writing happen in a bank from which the servo reads nothing: neither its program nor the active
    /// samples. Reads of the other bank and of RAM are not affected.
    DualBank,
    /// Servo code, vectors and active samples are in RAM.
    ServoInRam,
}

/// Capacities of a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Capacities {
    /// Maximum number of axes.
    pub axes: u8,
    /// Maximum number of banks.
    pub banks: u16,
    /// Maximum number of tables.
    pub tables: u16,
    /// Maximum number of terms.
    pub terms: u16,
    /// Maximum number of grids.
    pub grids: u16,
    /// Maximum length in bytes of a blob in a slot.
    pub slot: u32,
}

/// Why the corrections are zero, or do not come from the slot selected for use.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Fault {
    /// Neither slot holds a valid compensation.
    NoCompensation,
    /// The compensation of this slot is refused by this firmware.
    Load(Slot, LoadError),
    /// Slots hold valid compensations, but none was ever in use; this is one of them.
    Waiting(Slot),
    /// The compensation in use is no longer valid; the one in use before it is taken if it is valid.
    Lost,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCompensation => f.write_str("no slot holds a valid compensation"),
            Self::Waiting(slot) => {
                write!(
                    f,
                    "slot {slot} holds a compensation that was never put in use"
                )
            }
            Self::Lost => f.write_str("the compensation that was in use is no longer valid"),
            Self::Load(slot, error) => write!(f, "slot {slot} cannot be used: {error}"),
        }
    }
}

/// Identity of the controller.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hello<'a> {
    /// Session number for the header of all further requests.
    pub session: u32,
    /// Name and version of the firmware.
    pub firmware: &'a str,
    /// Name of the board.
    pub board: &'a str,
    /// Lowest and highest blob format version that the firmware reads.
    pub formats: [u16; 2],
    /// Capacities of the controller.
    pub capacities: Capacities,
    /// Nominal servo period, s.
    pub period: f32,
    /// How the servo keeps running while the flash is busy.
    pub while_busy: WhileBusy,
    /// Machine name of the active compensation, see [`short_name`]; empty without one.
    pub machine: &'a str,
    /// Letters of its axes.
    pub axes: heapless::String<MOST_AXES>,
    /// Number of its auxiliary inputs.
    pub auxiliaries: u8,
    /// Active slot.
    pub active: Option<Slot>,
    /// Slots A and B.
    pub slots: [SlotReport; 2],
    /// Why the corrections are zero, or do not come from the slot selected for use.
    pub fault: Option<Fault>,
}

/// Unit of [`Report::cost`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum CostUnit {
    /// Nothing: the board has no counter.
    #[default]
    None,
    /// Processor cycles.
    Cycles,
    /// Instructions, as counted by an emulator.
    Instructions,
}

/// Number of servo periods since start in which each limit of an axis acted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LimitCounts {
    /// Value bound.
    pub value: u32,
    /// Rate bound.
    pub rate: u32,
    /// Travel.
    pub travel: u32,
}

/// Status of the last servo period, and counts since start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Commanded positions, mm or degrees, in the order of the axes.
    pub positions: heapless::Vec<f32, MOST_AXES>,
    /// Corrections, mm or degrees.
    pub dq: heapless::Vec<f32, MOST_AXES>,
    /// Corrections before fade factor, travel and rate bounds.
    pub computed: heapless::Vec<f32, MOST_AXES>,
    /// Tool length and temperatures, mm and K.
    pub auxiliaries: heapless::Vec<f32, AUXILIARIES>,
    /// Auxiliaries whose sensor has failed; their last value is held. Bit 0 is the first.
    pub sensors_lost: u8,
    /// Index and requested weight of each adjustable term.
    pub weights: heapless::Vec<(u16, f32), ADJUSTABLE>,
    /// Corrections are requested.
    pub enabled: bool,
    /// A dry run is requested.
    pub dry_run: bool,
    /// The servo is not updated, because the flash is or may become busy.
    pub suspended: bool,
    /// Mask of referenced axes.
    pub referenced: u16,
    /// Fade factor, 0…1.
    pub factor: f32,
    /// [`Conditions`](crate::Conditions) of the last period.
    pub conditions: u16,
    /// Axes on which the value bound acts.
    pub saturated: u16,
    /// Axes on which the rate bound acts.
    pub rate_limited: u16,
    /// Axes on which the travel acts.
    pub travel_limited: u16,
    /// Counts of the limits of each axis.
    pub limits: heapless::Vec<LimitCounts, MOST_AXES>,
    /// Number of servo updates.
    pub updates: u32,
    /// Number of servo periods without a command.
    pub missed: u32,
    /// Cost of the last update.
    pub cost: u32,
    /// Cost of the most expensive update.
    pub worst_cost: u32,
    /// Unit of both costs.
    pub cost_unit: CostUnit,
    /// Active slot, or progress of an activation.
    pub activation: Activation,
    /// Progress of the upload.
    pub upload: Upload,
    /// Why the corrections are zero, or do not come from the slot selected for use.
    pub fault: Option<Fault>,
}
