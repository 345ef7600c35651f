//! The controller around the servo.
mod board;
mod servo_side;
pub use board::{
    Clock, Command, CorrectionSink, Identity, LinkOnly, Machine, NoClock, PositionSource,
    ServoAccess,
};
pub use servo_side::{Counters, ServoSide};
