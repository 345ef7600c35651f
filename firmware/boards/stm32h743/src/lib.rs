//! trueaxis on an STM32H743. The board-independent part is [`trueaxis_firmware::controller`]; the same in QEMU is
//! `trueaxis-qemu`.
//!
//! | file | contents |
//! |---|---|
//! | `stm32h743` | drivers |
//! | `bare` | all `unsafe`: memory and registers at fixed addresses |
#![no_std]
#![deny(unsafe_code)]

#[cfg(feature = "stm32h743")]
pub mod bare;
#[cfg(feature = "stm32h743")]
pub mod stm32h743;

/// Servo periods per second.
pub const RATE: u32 = 4000;
/// Nominal servo period, s.
pub const PERIOD: f32 = 1.0 / RATE as f32;

/// Maximum number of axes of a compensation, and number of axes in a frame of the motion side.
pub const AXES: usize = 8;
/// Capacities of a compensation: axes, banks, tables, terms, grids.
pub type Tables = trueaxis::capacities!(axes: AXES, banks: 32, tables: 96, terms: 256, grids: 2);
