//! What the host asks.

use serde::{Deserialize, Serialize};

use super::slot::Slot;

/// Most bytes of a chunk: a multiple of 32, so that no flash word is split.
pub const MOST_CHUNK: usize = 992;

/// A request. Every one may be repeated: the controller answers a repetition (same session, same
/// sequence number) as it answered the first, without doing it again.
///
/// The variants may only be appended to; anything else is a new [`PROTOCOL`](super::PROTOCOL).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request<'a> {
    /// Opens a session and asks who is there. In place of the session its header has a random
    /// number; the same one asks for the same session again. Answer:
    /// [`Reply::Hello`](super::Reply::Hello), under that number.
    Hello,
    /// Asks for the status. Answer: [`Reply::Status`](super::Reply::Status).
    Status,
    /// Begins an upload into the slot that is not active, or continues it, or asks how far it has
    /// come: to be repeated until it is [`Upload::Receiving`](super::Upload::Receiving).
    /// Answer of this and of the next three: [`Reply::Upload`](super::Reply::Upload).
    Begin {
        /// Bytes of the blob.
        length: u32,
        /// CRC-32 in the header of the blob.
        crc: u32,
    },
    /// The next bytes of the blob.
    Chunk {
        /// Place of the first byte within the blob.
        offset: u32,
        /// At most [`MOST_CHUNK`] bytes.
        bytes: &'a [u8],
    },
    /// All bytes are sent: check them and make them the newest compensation, which is in use once it
    /// is activated.
    Commit {
        /// Also if its machine (name or axes) is another one than that of the active compensation.
        force: bool,
    },
    /// Gives the upload up.
    Abort,
    /// Changes over to the compensation of a slot, or asks how far that has come. Answer:
    /// [`Reply::Activation`](super::Reply::Activation).
    Activate {
        /// Which; normally the one just committed.
        slot: Slot,
        /// Also if its machine (name or axes) is another one than that of the active compensation.
        force: bool,
    },
    /// Lets the corrections in (`true`) or takes them out. Answer of this and of the next four:
    /// [`Reply::Done`](super::Reply::Done).
    Enable(bool),
    /// Starts (`true`) or ends a dry run.
    DryRun(bool),
    /// Sets the weight of an adjustable term of the compensation last accepted.
    SetWeight {
        /// Index of the term in the blob.
        term: u16,
        /// The weight, within the limits of the term.
        value: f32,
    },
    /// Sets the tool length, mm, along the tool axis from the spindle frame.
    ToolLength(f32),
    /// Sets the mask of referenced axes, bit 0 for the first.
    Referenced(u16),
    /// Evaluates the active compensation at positions, without any state: rows as
    /// [`EvaluateRow`](super::EvaluateRow) writes them. Answer:
    /// [`Reply::Corrections`](super::Reply::Corrections).
    Evaluate(&'a [u8]),
    /// Commands positions to the servo, in lock-step: one servo period for each row of
    /// [`positions`](super::positions). Answer: [`Reply::Motion`](super::Reply::Motion).
    Motion(&'a [u8]),
    /// Asks how well the controller is. Answer: [`Reply::Health`](super::Reply::Health).
    Health,
    /// Asks what the next start goes by. Answer of this and of the next:
    /// [`Reply::AtStart`](super::Reply::AtStart).
    AtStart,
    /// Lets the corrections in at start (`true`) or not, as it is at first; survives uploads.
    EnableAtStart(bool),
    /// [`Commit`](Self::Commit), and the next start takes it. Without this it waits until it is
    /// [activated](Self::Activate).
    CommitInUse {
        /// As that of `Commit`.
        force: bool,
    },
    /// Asks for the weights of the adjustable terms, with their limits. Answer:
    /// [`Reply::Weights`](super::Reply::Weights).
    Weights,
}
