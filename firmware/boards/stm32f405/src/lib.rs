//! trueaxis on an STM32F405, and the same in QEMU: what does not depend on the board.
//!
//! | file | what it holds |
//! |---|---|
//! | `controller` | the main loop: link, settings, temperatures, signals |
//! | `servo` | the servo side, shared between the interrupt and the main loop |
//! | `standstill` | whether the machine stands still with its drives off |
//! | `signals` | lamp and fault pin |
//! | `bare` | all `unsafe`: memory and registers at fixed addresses |
//! | `stm32f405`, `qemu` | drivers of the one board and of the other |
#![no_std]
#![deny(unsafe_code)]

pub mod bare;
pub mod controller;
#[cfg(feature = "qemu")]
pub mod qemu;
pub mod servo;
pub mod signals;
pub mod standstill;
#[cfg(feature = "stm32f405")]
pub mod stm32f405;

use heapless::spsc::Consumer;
use trueaxis::Holds;
use trueaxis_firmware::places;

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

/// Takes what an interrupt has received; waits for the first byte, as `embedded_io` wants it.
pub fn received(bytes: &mut Consumer<'static, u8>, buffer: &mut [u8]) -> usize {
    let mut count = 0;
    while let Some(place) = buffer.get_mut(count) {
        match bytes.dequeue() {
            Some(byte) => {
                *place = byte;
                count += 1;
            }
            None if count > 0 => break,
            None => cortex_m::asm::wfi(),
        }
    }
    count
}
