//! Uploads a blob to a controller: transfer, verification, activation.

use crate::client::{Client, LinkError, LinkedController};
use crate::port::Port;
use std::time::Duration;
use trueaxis::link::{
    Activation, AtStart, MOST_CHUNK, Refusal, Request, Slot, SlotState, Upload, short_name,
};
use trueaxis::{Header, LoadError};
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::{Progress, Size};
use trueaxis_tables::target::Shortage;

/// Pause between two progress queries.
pub(crate) const PAUSE: Duration = Duration::from_millis(50);
/// Maximum number of queries: a minute.
const QUESTIONS: u32 = 1200;
/// Like `QUESTIONS`, for a fade, which requires motion: five seconds.
const FADE_QUESTIONS: u32 = 100;
/// Maximum number of attempts, after a restart of the controller or a failed write.
const ATTEMPTS: u32 = 5;

/// Why a blob was not uploaded.
#[derive(Debug, thiserror::Error)]
pub enum UploadError {
    /// The blob itself is damaged.
    #[error("{0}")]
    Blob(LoadError),
    /// It is for another machine.
    #[error(
        "the compensation is for `{blob}` ({blob_axes}), the controller has one for `{machine}` ({axes})"
    )]
    OtherMachine {
        /// Machine of the blob.
        blob: String,
        /// Axes.
        blob_axes: String,
        /// Machine of the controller.
        machine: String,
        /// Axes.
        axes: String,
    },
    /// The controller's capacity is too small.
    #[error("the compensation has {} {}, the controller has room for {}", .0.needed, .0.what, .0.held)]
    TooLarge(Shortage),
    /// The controller refuses it, or the link fails.
    #[error("{0}")]
    Link(#[from] LinkError),
    /// The corrections do not reach zero, or the erase does not end.
    #[error("the controller does not get ready: {0:?}")]
    NotReady(Upload),
    /// The content of the slot differs from what was sent.
    #[error("slot {0} differs from the data that was sent")]
    NotVerified(Slot),
}

impl UploadError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Blob(_) => "copy the file again (as binary), or compile it again",
            Self::OtherMachine { .. } => {
                "check that this is the right file and the right port; --force if it is meant so"
            }
            Self::TooLarge(_) => {
                "compile it with the --target that `trueaxis flash --dry-run` prints, or build the firmware with larger capacities"
            }
            Self::Link(error) => error.remedy(),
            Self::NotReady(_) => "`trueaxis monitor` shows the reason",
            Self::NotVerified(_) => {
                "flash it again; if that does not help, the flash memory is worn out"
            }
        }
    }
}

impl From<Refusal> for UploadError {
    fn from(refusal: Refusal) -> Self {
        Self::Link(LinkError::Refused(refusal))
    }
}

/// The result of an activation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activated {
    /// Not requested: it waits for activation.
    No,
    /// It is in use.
    Yes,
    /// It is accepted, and takes effect with the next motion.
    WithMotion,
}

/// The result of an upload.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UploadOutcome {
    /// The slot of the blob.
    pub slot: Slot,
    /// Sequence number.
    pub sequence: u32,
    /// True if it was already the newest and nothing was written.
    pub already: bool,
    /// Bytes already transferred by an interrupted upload.
    pub resumed: u32,
    /// Whether it is in use.
    pub activated: Activated,
    /// The settings for the next start.
    pub at_start: AtStart,
}

/// Checks that a controller can hold a blob: the same machine (unless forced) and enough capacity.
///
/// # Errors
/// [`UploadError`]
pub fn check(controller: &LinkedController, blob: &[u8], force: bool) -> Result<(), UploadError> {
    let runtime = Runtime::load(blob).map_err(UploadError::Blob)?;
    let new = runtime.compensation();
    let letters: String = new.axes().iter().map(|a| char::from(a.name)).collect();
    let same = short_name(new.machine()) == controller.machine && letters == controller.axes;
    // Without an active compensation there is nothing to compare with.
    if !force && !same && !controller.axes.is_empty() {
        return Err(UploadError::OtherMachine {
            blob: new.machine().to_owned(),
            blob_axes: letters,
            machine: controller.machine.clone(),
            axes: controller.axes.clone(),
        });
    }
    let shortages = controller.target().shortages(&Size::of(&runtime));
    if let Some(shortage) = shortages.first() {
        return Err(UploadError::TooLarge(*shortage));
    }
    Ok(())
}

/// The newest valid slot.
fn newest(controller: &LinkedController) -> Option<(Slot, u32, u32, u32)> {
    let valid =
        Slot::BOTH
            .into_iter()
            .filter_map(|slot| match controller.slots[slot.index()].state {
                SlotState::Valid {
                    sequence,
                    length,
                    crc,
                } => Some((slot, sequence, length, crc)),
                _ => None,
            });
    // Sequence numbers wrap.
    valid.reduce(|a, b| {
        let ahead = b.1.wrapping_sub(a.1);
        if ahead != 0 && ahead <= u32::MAX / 2 {
            b
        } else {
            a
        }
    })
}

/// Uploads a blob, verifies it in the controller, and activates it if requested.
///
/// An interrupted upload of the same blob is resumed. A blob that is already the newest is not written again.
///
/// # Errors
/// [`UploadError`]; the active compensation is unchanged then.
pub fn flash<P: Port>(
    client: &mut Client<P>,
    controller: &LinkedController,
    blob: &[u8],
    force: bool,
    activate: bool,
    progress: &dyn Progress,
) -> Result<UploadOutcome, UploadError> {
    check(controller, blob, force)?;
    let Header { length, crc } = Header::read(blob).map_err(UploadError::Blob)?;
    let own = |found: &LinkedController| newest(found).filter(|f| (f.2, f.3) == (length, crc));
    let (found, resumed) = match own(controller) {
        Some(found) => (found, None),
        None => {
            let last = match activate {
                true => Request::CommitInUse { force },
                false => Request::Commit { force },
            };
            let resumed = upload(client, blob, (length, crc), &last, progress)?;
            progress.stage("verifying", 0);
            let after = client.hello()?;
            let found = own(&after).ok_or_else(|| {
                UploadError::NotVerified(newest(&after).map_or(Slot::A, |found| found.0))
            })?;
            (found, Some(resumed))
        }
    };
    let (slot, sequence, ..) = found;
    let mut activated = Activated::No;
    if activate {
        progress.stage("changing over", 0);
        activated = change_over(client, slot, force)?;
    }
    Ok(UploadOutcome {
        slot,
        sequence,
        already: resumed.is_none(),
        resumed: resumed.unwrap_or(0),
        activated,
        at_start: client.at_start()?,
    })
}

/// Sends all bytes and commits; returns the position from which it resumed.
fn upload<P: Port>(
    client: &mut Client<P>,
    blob: &[u8],
    (length, crc): (u32, u32),
    last_request: &Request<'_>,
    progress: &dyn Progress,
) -> Result<u32, UploadError> {
    let mut resumed = None;
    let mut last = UploadError::NotReady(Upload::None);
    for _ in 0..ATTEMPTS {
        let next = match begin(client, (length, crc), progress) {
            // A block was not erased: try once more, then the controller reports which one.
            Err(UploadError::Link(LinkError::Refused(
                refusal @ (Refusal::Spoiled | Refusal::Flash),
            ))) => {
                last = refusal.into();
                continue;
            }
            begun => begun?,
        };
        let resumed = *resumed.get_or_insert(next);
        let done =
            send(client, blob, next, progress).and_then(|()| Ok(client.upload(last_request)?));
        match done {
            Ok(_) => return Ok(resumed),
            // The controller has restarted, or the flash does not contain what was sent.
            Err(UploadError::Link(LinkError::Refused(
                refusal @ (Refusal::NoUpload
                | Refusal::Spoiled
                | Refusal::Flash
                | Refusal::OtherBlob
                | Refusal::Conflict { .. }
                | Refusal::Missing { .. }),
            ))) => {
                last = refusal.into();
                if let Refusal::Conflict { .. } = refusal {
                    // Something else was uploaded under the same name.
                    client.upload(&Request::Abort)?;
                }
                // The answer to a commit may be lost if the session ends.
                let found = newest(&client.hello()?);
                if found.is_some_and(|(_, _, l, c)| (l, c) == (length, crc)) {
                    return Ok(resumed);
                }
            }
            Err(error) => {
                if let UploadError::Link(LinkError::Refused(_)) = error {
                    // The servo may be waiting for this upload: release it. If the link fails too, that is already
                    // reported.
                    let _ = client.upload(&Request::Abort);
                }
                return Err(error);
            }
        }
    }
    Err(last)
}

/// Waits until the controller accepts bytes; returns the position to start from.
fn begin<P: Port>(
    client: &mut Client<P>,
    (length, crc): (u32, u32),
    progress: &dyn Progress,
) -> Result<u32, UploadError> {
    let mut erased = None;
    let mut state = Upload::None;
    for _ in 0..QUESTIONS {
        state = client.upload(&Request::Begin { length, crc })?;
        match state {
            Upload::Receiving { next, .. } => return Ok(next),
            Upload::Erasing { done, blocks } => {
                if erased.is_none() {
                    progress.stage("erasing", blocks as usize);
                }
                for _ in erased.unwrap_or(0)..done {
                    progress.step();
                }
                erased = Some(done);
            }
            _ => {}
        }
        client.port().wait(PAUSE);
    }
    client.upload(&Request::Abort)?;
    Err(UploadError::NotReady(state))
}

/// Sends the bytes from `next` on.
fn send<P: Port>(
    client: &mut Client<P>,
    blob: &[u8],
    next: u32,
    progress: &dyn Progress,
) -> Result<(), UploadError> {
    let start = next as usize;
    let rest = blob.get(start..).unwrap_or_default();
    progress.stage("writing", rest.len().div_ceil(MOST_CHUNK));
    for (number, bytes) in rest.chunks(MOST_CHUNK).enumerate() {
        let offset = (start + number * MOST_CHUNK) as u32;
        client.upload(&Request::Chunk { offset, bytes })?;
        progress.step();
    }
    Ok(())
}

/// Switches to a slot, and waits until that is done.
pub(crate) fn change_over<P: Port>(
    client: &mut Client<P>,
    slot: Slot,
    force: bool,
) -> Result<Activated, LinkError> {
    for _ in 0..FADE_QUESTIONS {
        match client.activate(slot, force)? {
            Activation::Active(Some(active)) if active == slot => return Ok(Activated::Yes),
            _ => client.port().wait(PAUSE),
        }
    }
    Ok(Activated::WithMotion)
}
