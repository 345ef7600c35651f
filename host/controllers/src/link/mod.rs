//! The host's end of the link to a controller. The protocol is defined in [`trueaxis::link`].

mod client;
mod control;
mod flash;
mod port;
#[cfg_attr(target_family = "wasm", path = "transports_in_browser.rs")]
mod transports;

pub use client::{Client, LinkError, LinkedController};
pub use control::{Action, ControlError, ControllerState, Done, control};
pub(crate) use flash::PAUSE;
pub use flash::{Activated, UploadError, UploadOutcome, check, flash};
pub use port::{BadPort, Port};
pub use transports::open;
#[cfg(not(target_family = "wasm"))]
pub use transports::{Serial, Tcp};
