//! Commands from the motion side, and corrections back to it.
//!
//! **The motion side is the master** of the bus and sends one frame in each of its servo periods. The end of the frame
//! starts this controller's period, so that there is a single clock. While a frame brings the command of a period, the
//! correction for the previous command is sent. The bytes are described in the manual, `docs/src/board.md`, "Frames".
//!
//! A damaged frame is ignored; a frame with the same counter as the previous one is a repetition of it. [`Tolerance`]
//! limits how many may be missing or too many. How the motion side uses the answers, and what it does without them, is
//! in [`motion_side`](crate::motion_side).
//!
//! | file | contents |
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
