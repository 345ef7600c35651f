//! The host's end of the link to a controller. The protocol is defined in [`trueaxis::link`].

mod client;
mod control;
mod flash;
mod port;

pub use client::{Client, Controller, LinkError};
pub use control::{Action, ControlError, Done, State, control};
pub(crate) use flash::PAUSE;
pub use flash::{Activated, FlashError, Outcome, check, flash};
pub use port::{BadPort, Port, Serial, Tcp, open};
