//! The C interface of trueaxis: `trueaxis.h` and what is behind it.
//!
//! Two kinds of objects, in memory that the caller provides: *tables*, a compensation that was loaded, and a
//! *servo*, which holds one or two of them and corrects. No heap, no lock, no system call; every function
//! returns, with a code.
//!
//! `unsafe` is in `border.rs` and `border/`, where pointers become references, and nowhere else. What is
//! behind it is checked by the compiler: `tables.rs` (loading, and what was loaded), `servo.rs` (the loop),
//! `model.rs` (a simulated machine, with the feature `model`), `code.rs` (what functions return), `text.rs`
//! (text in the caller's buffers), `facts.rs` (structures that C sees), `capacities.rs` (how much the library
//! holds).
#![no_std]
#![deny(unsafe_code)]
#![deny(missing_docs)]

#[cfg(any(test, feature = "std"))]
extern crate std;

#[allow(unsafe_code)]
pub mod border;
mod capacities;
mod code;
mod facts;
mod guarded;
#[cfg(feature = "model")]
mod model;
mod servo;
mod tables;
mod text;

pub use capacities::{Room, TRUEAXIS_HEADER};
pub use code::Code;
pub use facts::{
    Adjustable, AuxiliaryFacts, AxisFacts, Facts, ServoMemory, StatusFacts, TablesMemory,
};
#[cfg(feature = "model")]
pub use model::{Model, ModelMemory, ModelPose};
pub use servo::Servo;
pub use tables::Tables;

/// Stops. No function of this library is known to come here: `cargo xtask capi` looks for it.
#[cfg(all(feature = "halt", not(feature = "std"), not(test)))]
#[panic_handler]
fn halt(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
