//! Commands from the motion side, and corrections back to it.
//!
//! **The motion side is the master** of the bus and sends one frame per servo period of its own;
//! the end of the frame is this controller's period, so that there is one clock. While a frame
//! brings the command of a period, the correction for the command before goes out. The bytes are in
//! the manual, `docs/src/board.md`, "Frames".
//!
//! A frame that is damaged is none; one with the count of the one before is that one once more. How
//! many may be missing or too many is a [`Tolerance`]. What the motion side does with the answers,
//! and without them, is [`motion_side`](crate::motion_side).
//!
//! | file | what it holds |
//! |---|---|
//! | `frame` | the bytes |
//! | `intake` | from frames to one command per period |
//! | `exchange` | both directions: for a board that is the slave |
//! | `polled` | for a board with a clock of its own |

mod exchange;
mod frame;
mod intake;
mod polled;
#[cfg(test)]
mod tests;

pub use exchange::{Exchange, Sink, Source};
pub use frame::{Answer, CommandFrame, MOST, NoFrame, VERSION, length};
pub use intake::{Intake, Tolerance};
pub use polled::Polled;
