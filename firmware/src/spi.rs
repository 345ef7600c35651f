//! Commands from the motion side, and corrections back to it.
//!
//! **The motion side is the master** of the bus and sends one frame per servo period of its own;
//! the end of the frame is this controller's period, so that there is one clock. While a frame
//! brings the command of a period, the correction for the command before goes out. Both have the
//! same length, 16 + 4 · axes bytes, little-endian:
//!
//! | offset | size | command | answer |
//! |---|---|---|---|
//! | 0 | 1 | `02` (version) | `02` |
//! | 1 | 1 | count: one more, modulo 256, in every new command | count of the command last taken |
//! | 2 | 2 | mask of referenced axes, bit 0 the first | [`Conditions`](trueaxis::Conditions) |
//! | 4 | 1 | bits 0 and 1: 0 enabling is left to the host, 1 enable, 2 disable; bit 2: the tool length counts | bit 0: it answers a command; bit 1: no fault |
//! | 5 | 1 | number of axes | number of axes |
//! | 6 | 2 | 0 | periods without a new frame and frames without a period, a count that wraps |
//! | 8 | 4 | tool length, f32, mm | 0 |
//! | 12 | 4 · axes | positions, f32, mm or degrees | corrections Δq, f32, mm or degrees |
//! | | 4 | CRC-32/ISO-HDLC of all before | the same |
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
#[cfg(test)]
mod two_clocks;

pub use exchange::{Exchange, Sink, Source};
pub use frame::{Answer, MOST, NoFrame, Said, VERSION, length};
pub use intake::{Intake, Tolerance};
pub use polled::Polled;
