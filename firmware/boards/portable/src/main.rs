//! One program on every kind of processor: what it computes goes to the standard output, whose bits are compared
//! with the desktop's (`cargo xtask portable`).
#![no_std]
#![no_main]
#![deny(unsafe_code)]

#[allow(unsafe_code)]
#[cfg_attr(target_os = "none", path = "console/bare.rs")]
#[cfg_attr(unix, path = "console/hosted.rs")]
#[cfg_attr(target_family = "wasm", path = "console/web.rs")]
mod console;
#[allow(unsafe_code)]
mod counter;
#[path = "../../../../tests/src/fixed.rs"]
#[allow(dead_code)] // tests draw more kinds of numbers
mod fixed;
#[path = "../../../../tests/src/moves.rs"]
mod moves;
mod work;
