//! The host's requests.

use serde::{Deserialize, Serialize};

use super::slot::Slot;

/// Maximum length of a chunk in bytes: a multiple of 32, so that no flash word is split.
pub const MOST_CHUNK: usize = 992;

/// A request. Every request may be repeated: the controller answers a repetition (same session, same sequence number)
/// like the first, without executing it again.
///
/// Variants may only be appended; any other change requires a new [`PROTOCOL`](super::PROTOCOL).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request<'a> {
    /// Opens a session and asks for the controller's identity. Its header carries a random number in place of the
    /// session; the same number asks for the same session again. Answer: [`Reply::Hello`](super::Reply::Hello), under
    /// that number.
    Hello,
    /// Asks for the status. Answer: [`Reply::Status`](super::Reply::Status).
    Status,
    /// Begins or continues an upload into the inactive slot, or asks for its progress. Repeat it until the answer is
    /// [`Upload::Receiving`](super::Upload::Receiving). Answer to this and to the next three:
    /// [`Reply::Upload`](super::Reply::Upload).
    Begin {
        /// Bytes of the blob.
        length: u32,
        /// CRC-32 in the header of the blob.
        crc: u32,
    },
    /// The next bytes of the blob.
    Chunk {
        /// Offset of the first byte within the blob.
        offset: u32,
        /// At most [`MOST_CHUNK`] bytes.
        bytes: &'a [u8],
    },
    /// All bytes have been sent: check them and make them the newest compensation, which is used once it is activated.
    Commit {
        /// Accept another machine (name or axes) than that of the active compensation.
        force: bool,
    },
    /// Cancels the upload.
    Abort,
    /// Switches to the compensation of a slot, or asks for the progress of that. Answer:
    /// [`Reply::Activation`](super::Reply::Activation).
    Activate {
        /// The slot, normally the one just committed.
        slot: Slot,
        /// Accept another machine (name or axes) than that of the active compensation.
        force: bool,
    },
    /// Enables (`true`) or disables corrections. Answer to this and to the next four:
    /// [`Reply::Done`](super::Reply::Done).
    Enable(bool),
    /// Starts (`true`) or ends a dry run.
    DryRun(bool),
    /// Sets the weight of an adjustable term of the compensation accepted last.
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
    /// Evaluates the active compensation at positions, without any state: rows in the format of
    /// [`EvaluateRow`](super::EvaluateRow). Answer: [`Reply::Corrections`](super::Reply::Corrections).
    Evaluate(&'a [u8]),
    /// Commands positions to the servo in lock-step: one servo period for each row in the format of
    /// [`positions`](super::positions). Answer: [`Reply::Motion`](super::Reply::Motion).
    Motion(&'a [u8]),
    /// Asks for the state of the controller itself. Answer: [`Reply::Health`](super::Reply::Health).
    Health,
    /// Asks for the settings of the next start. Answer to this and to the next:
    /// [`Reply::AtStart`](super::Reply::AtStart).
    AtStart,
    /// Enables corrections at start (`true`) or not (the initial setting); survives uploads.
    EnableAtStart(bool),
    /// Like [`Commit`](Self::Commit), and the next start uses the new compensation. With `Commit` alone it waits until
    /// it is [activated](Self::Activate).
    CommitInUse {
        /// As for `Commit`.
        force: bool,
    },
    /// Asks for the weights of the adjustable terms, with their limits. Answer:
    /// [`Reply::Weights`](super::Reply::Weights).
    Weights,
}
