//! The controller side of trueaxis.
//!
//! A motion controller links this crate beside its own code. It re-exports the
//! runtime; table slots, the host link and thermal inputs join it here.
#![no_std]
#![forbid(unsafe_code)]

pub use trueaxis as runtime;
