//! The host's end of the link to a controller: from a compensation's file to one that is in use there, and what the
//! controller reports. The protocol is defined in [`trueaxis::link`].
//!
//! Everything begins with [`open`] and [`Client`]. Builds on `trueaxis-model` and `trueaxis-tables`.

// Modules, most of which use only those before them: `port` (bytes there and back), `transports` (serial line, TCP) ·
// `client` (requests and their answers) · `flash` (a file to a slot) · `control` (switches, slots, weights) · `trial`
// (a compensation until it is judged).

#![forbid(unsafe_code)]

mod client;
mod control;
mod flash;
mod port;
#[cfg_attr(target_family = "wasm", path = "transports_in_browser.rs")]
mod transports;
mod trial;

pub use client::{Client, LinkError, LinkedController};
pub use control::{Action, ControlError, ControllerState, Done, control};
pub use flash::{Activated, UploadError, UploadOutcome, check, flash};
pub use port::{BadPort, Port};
pub use transports::open;
#[cfg(not(target_family = "wasm"))]
pub use transports::{Serial, Tcp};
pub use trial::{BoardError, BoardOnTrial};
