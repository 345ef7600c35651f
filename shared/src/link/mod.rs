//! What host and controller say to each other: frames, requests, replies.
//!
//! The normative description with byte tables is `docs/src/link.md`. The host asks, the controller
//! answers; one request is under way at a time, and the host repeats it until its answer has come.
//!
//! | file | what it holds |
//! |---|---|
//! | `cobs` | bytes without zeros, so that a zero ends a frame |
//! | `frame` | protocol version, session, sequence number, checksum |
//! | `request`, `reply` | the messages, postcard-encoded |
//! | `report` | what hello and status tell |
//! | `health` | frames of the motion side, and why the controller has started |
//! | `slot`, `progress` | what slots hold; how far uploads and changes have come |
//! | `refusal` | why a request was not carried out |
//! | `settings` | what can be set, and what the next start goes by |
//! | `rows` | positions and corrections as rows of little-endian f32 |
//!
//! **Panic contract.** Any bytes at all are either a message or dropped; nothing here panics,
//! allocates, or loops for longer than its input is long.

mod cobs;
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
    Capacities, CostUnit, Fault, Hello, MOST_AXES, MOST_NAME, Rails, Report, WhileBusy, short_name,
};
pub use request::{MOST_CHUNK, Request};
pub use rows::{
    EvaluateRow, MOST_ROWS, MotionResult, evaluate_rows, motion_rows, positions, put_positions,
};
pub use settings::{AtStart, Storing, TermWeight};
pub use slot::{Damage, Slot, SlotReport, SlotState};
