//! One program for every kind of processor: it writes its results to the standard output, and their bits are compared
//! with those of the desktop (`cargo xtask portable`).
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
/// Generated from the first of the blobs.
#[path = "../../../../shared/examples/generated/huron_13.rs"]
mod huron_13;
#[path = "../../../../tests/src/moves.rs"]
mod moves;
mod work;
