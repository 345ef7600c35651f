//! The protocol between host and controller: frames, requests, replies.
//!
//! The normative description with byte tables is `docs/src/link.md`. The host asks, the controller answers. Only one
//! request is pending at a time, and the host repeats it until the answer arrives.
//!
//! | file | contents |
//! |---|---|
//! | `cobs` | encoding without zeros, so that a zero ends a frame |
//! | `frame` | protocol version, session, sequence number, checksum |
//! | `request`, `reply` | the messages, postcard-encoded |
//! | `report` | answers to hello and status |
//! | `health` | counts of motion-side frames, and why the controller started |
//! | `slot`, `progress` | contents of slots; progress of uploads and activations |
//! | `refusal` | why a request was refused |
//! | `settings` | what can be set, and the settings for the next start |
//! | `rows` | positions and corrections as rows of little-endian f32 |
//!
//! **Panic contract.** Any byte sequence is either a message or dropped. Nothing here panics, allocates, or loops
//! longer than the length of its input.

mod cobs;
#[cfg(all(test, feature = "exhaustive"))]
mod exhaustive;
mod frame;
mod health;
mod progress;
mod refusal;
mod reply;
mod report;
mod request;
mod rows;
mod settings;
mod slot;

#[cfg(test)]
mod tests;

pub use frame::{
    END, FrameError, Framed, Header, MOST_BODY, MOST_WIRE, PROTOCOL, Received, Receiver,
    VERSION_ANSWER, VersionAnswer, encode, encode_frame, encode_version_answer,
};
pub use health::{Health, Restart, Tail};
pub use progress::{Activation, Upload};
pub use refusal::Refusal;
pub use reply::Reply;
pub use report::{
    Capacities, CostUnit, Fault, Hello, LimitCounts, MOST_AXES, MOST_NAME, Report, WhileBusy,
    short_name,
};
pub use request::{MOST_CHUNK, Request};
pub use rows::{
    EvaluateRow, MOST_ROWS, MotionResult, evaluate_rows, motion_rows, positions, put_positions,
};
pub use settings::{AtStart, Storing, TermWeight};
pub use slot::{Damage, Slot, SlotReport, SlotState};
