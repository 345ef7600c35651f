//! trueaxis on an STM32F405, and the same in QEMU. What does not depend on the board is
//! [`trueaxis_firmware::controller`].
//!
//! | file | what it holds |
//! |---|---|
//! | `bare` | all `unsafe`: memory and registers at fixed addresses |
//! | `stm32f405`, `qemu` | drivers of the one board and of the other |
#![no_std]
#![deny(unsafe_code)]

pub mod bare;
#[cfg(feature = "qemu")]
pub mod qemu;
#[cfg(feature = "stm32f405")]
pub mod stm32f405;

use trueaxis::Holds;
use trueaxis_firmware::controller::{Event, Shown};
use trueaxis_firmware::{controller, places};

/// Axes of a compensation.
pub const AXES: usize = 8;
/// Banks of a compensation.
pub const BANKS: usize = 32;
/// Tables of a compensation.
pub const TABLES: usize = 96;
/// Terms of a compensation.
pub const TERMS: usize = 256;
/// Grids of a compensation.
pub const GRIDS: usize = 2;

/// Servo periods per second.
pub const RATE: u32 = 4000;
/// Nominal servo period, s.
pub const PERIOD: f32 = 1.0 / RATE as f32;

/// What a compensation has room for.
pub type Tables = Holds<AXES, BANKS, TABLES, TERMS, GRIDS>;
/// Room for two compensations.
pub type Places = places::Places<Tables>;
/// See [`trueaxis_firmware::device::ServoSide`].
pub type ServoSide = trueaxis_firmware::device::ServoSide<Tables>;
/// See [`controller::Shell`].
pub type Shell = controller::Shell<Tables>;
/// See [`controller::Shared`].
pub type Shared = controller::Shared<Tables>;

/// Writes to the log.
pub fn log(event: Event) {
    match event {
        Event::Found(slot, state) => defmt::info!("slot {}: {}", slot, state),
        Event::Active(slot) => defmt::info!("active slot: {}", slot),
        Event::Shown(Shown::Correcting) => defmt::info!("correcting"),
        Event::Shown(Shown::Idle) => defmt::info!("idle"),
        Event::Shown(Shown::Fault) => defmt::warn!("fault"),
    }
}
