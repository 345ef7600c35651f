//! The controller side of trueaxis.
//!
//! A motion controller links this crate beside its own code. It re-exports the runtime and adds table slots, the host
//! link, thermal inputs and the main loop of a board.
#![no_std]
#![deny(unsafe_code)]

#[cfg(any(test, feature = "mock"))]
extern crate std;

pub mod controller;
#[cfg(feature = "cortex-m")]
pub mod cycles;
#[cfg(any(test, feature = "mock"))]
pub mod desktop;
pub mod device;
pub mod double_buffer;
pub mod link;
pub mod mirror;
#[cfg(any(test, feature = "mock"))]
pub mod mock_flash;
pub mod motion_side;
pub mod record;
pub mod slots;
pub mod spi;
pub mod temperature;

pub use trueaxis as runtime;
