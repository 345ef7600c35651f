//! What the servo side tells the main loop.

use trueaxis::link::{CostUnit, LimitCounts};
use trueaxis::{AUXILIARIES, Correction, Room, Weights};

use super::board::Regularity;

/// Counts since start.
#[derive(Clone, Copy, Debug)]
pub struct Counters<C: Room> {
    /// Number of servo updates.
    pub updates: u32,
    /// Periods without a command, after the first command of the source: nothing new has arrived for longer than the
    /// tolerance.
    pub missed: u32,
    /// Regularity of commands from the board's source.
    pub regularity: Regularity,
    /// Periods for which the previous one left no time.
    pub overruns: u32,
    /// Number of periods in which each limit of each axis acted.
    pub limits: C::Axes<LimitCounts>,
    /// Cost of the last update.
    pub cost: u32,
    /// Cost of the most expensive update.
    pub worst_cost: u32,
    /// Unit of both costs.
    pub cost_unit: CostUnit,
}

/// State after a period.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<C: Room> {
    /// The correction.
    pub last: Correction<C::Axes<f32>>,
    /// The last finite commanded positions, mm or degrees.
    pub positions: C::Axes<f32>,
    /// Auxiliary inputs, mm and K.
    pub auxiliaries: [f32; AUXILIARIES],
    /// Auxiliaries whose sensor has failed, bit 0 for the first.
    pub sensors_lost: u8,
    /// Requested weights.
    pub weights: Weights,
    /// Corrections are requested.
    pub enabled: bool,
    /// A dry run is requested.
    pub dry_run: bool,
    /// Updates are stopped.
    pub suspended: bool,
    /// Mask of referenced axes.
    pub referenced: u16,
    /// Fade factor, 0…1.
    pub factor: f32,
    /// Counts since start.
    pub counters: Counters<C>,
}
