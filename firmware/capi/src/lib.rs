//! The C interface of trueaxis: `trueaxis.h` and its implementation.
//!
//! There are two kinds of objects, in memory provided by the caller: *tables*, a loaded compensation, and a *servo*,
//! which holds one or two of them and computes corrections. No heap, no lock, no system call; every function returns,
//! with a code.
//!
//! `unsafe` is used only in `border.rs` and `border/`, where pointers become references. The compiler checks
//! all other files: `tables.rs` (loading, and information about loaded tables), `servo.rs` (the loop),
//! `model.rs` (a simulated machine, with the feature `model`), `code.rs` (results of functions), `text.rs` (text in the
//! caller's buffers), `facts.rs` (structures visible to C), `capacities.rs` (capacities of the library).
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
    Adjustable, AuxiliaryFacts, AxisFacts, Facts, Generated, ServoMemory, StatusFacts, TablesMemory,
};
#[cfg(feature = "model")]
pub use model::{Model, ModelMemory, ModelPose};
pub use servo::Servo;
pub use tables::Tables;

/// Stops. No function of this library is known to reach it; `cargo xtask capi` checks that.
#[cfg(all(feature = "halt", not(feature = "std"), not(test)))]
#[panic_handler]
fn halt(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
