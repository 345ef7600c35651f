//! A compensation on trial on a board: loaded, judged while it corrects the machine, then kept or taken back.

use crate::client::{Client, LinkError};
use crate::control::{Action, ControlError, control};
use crate::flash::{Activated, PAUSE, UploadError, flash};
use crate::port::Port;
use std::path::Path;
use trueaxis::AlignedBlob;
use trueaxis::link::{Report, Slot};
use trueaxis_tables::target::Target;

/// A board, and what it did before.
pub struct BoardOnTrial<P> {
    client: Client<P>,
    target: Target,
    before: Before,
}

/// What is put back.
struct Before {
    enabled: bool,
    slot: Option<Slot>,
    is_changed: bool,
    /// Another compensation takes effect with the next motion.
    is_pending: bool,
}

/// Why a board does not correct.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The link fails, or the board refuses.
    #[error("{0}")]
    Link(#[from] LinkError),
    /// It refuses a setting.
    #[error("{0}")]
    Control(ControlError),
    /// It does not take the compensation.
    #[error("{0}")]
    Flash(#[from] UploadError),
    /// A file that cannot be read.
    #[error("{0}")]
    File(String),
    /// The servo is not updated, so that a change would wait for the next motion.
    #[error(
        "the servo of the board is not updated: a change would take effect with the next motion"
    )]
    Idle,
    /// The corrections are not what they should be.
    #[error("the corrections do not fade to {factor}: it is {state:?}, with a factor of {:.3}", .state.factor)]
    NotFaded {
        /// What was asked.
        factor: f32,
        /// What the board reports.
        state: Box<Report>,
    },
}

impl From<ControlError> for BoardError {
    fn from(error: ControlError) -> Self {
        match error {
            ControlError::Link(error) => Self::Link(error),
            other => Self::Control(other),
        }
    }
}

impl<P: Port> BoardOnTrial<P> {
    /// A board at the end of a link.
    ///
    /// # Errors
    /// The link fails.
    pub fn new(mut client: Client<P>) -> Result<Self, BoardError> {
        let state = control(&mut client, &Action::Show)?.after;
        Ok(Self {
            client,
            target: state.controller.target(),
            before: Before {
                enabled: state.report.enabled,
                slot: state.controller.active,
                is_changed: false,
                is_pending: false,
            },
        })
    }

    /// What it has room for.
    #[must_use]
    pub fn target(&self) -> &Target {
        &self.target
    }

    /// What puts back the state from before, as words of `trueaxis control`, in order.
    #[must_use]
    pub fn back(&self) -> Vec<String> {
        let Before { enabled, slot, .. } = self.before;
        let mut words = vec!["disable".to_owned()];
        match slot {
            Some(slot) => words.push(format!("activate {slot} --force")),
            None => words.push("enable-at-start off".to_owned()),
        }
        if enabled && slot.is_some() {
            words.push("enable".to_owned());
        }
        words
    }

    /// Switches the corrections on or off, and waits until they have faded in or out.
    ///
    /// # Errors
    /// They do not.
    pub fn switch(&mut self, on: bool) -> Result<(), BoardError> {
        self.before.is_changed = true;
        let report = control(&mut self.client, &Action::Enable(on))?.after.report;
        let factor = if on { 1.0 } else { 0.0 };
        match report.factor == factor {
            true => Ok(()),
            false => Err(BoardError::NotFaded {
                factor,
                state: Box::new(report),
            }),
        }
    }

    /// Puts the compensation of a file in the place of the one in use, with the corrections off.
    ///
    /// # Errors
    /// The file cannot be read, or is refused; what was in use still is.
    pub fn load(&mut self, blob: &Path) -> Result<(), BoardError> {
        let bytes = std::fs::read(blob)
            .map_err(|error| BoardError::File(format!("{}: {error}", blob.display())))?;
        self.switch(false)?;
        let updates = self.client.status()?.updates;
        self.client.port().wait(PAUSE);
        if self.client.status()?.updates == updates {
            return Err(BoardError::Idle);
        }
        let blob = AlignedBlob::from_bytes(&bytes);
        let controller = self.client.hello()?;
        let outcome = flash(&mut self.client, &controller, &blob, false, true, &())?;
        self.before.is_pending = outcome.activated != Activated::Yes;
        match self.before.is_pending {
            true => Err(BoardError::Idle),
            false => Ok(()),
        }
    }

    /// What has been loaded and switched stays.
    pub fn keep(&mut self) {
        self.before.is_changed = false;
    }

    /// Puts back what was there before the first change.
    ///
    /// # Errors
    /// It cannot: what is in use is then not known.
    pub fn undo(&mut self) -> Result<(), BoardError> {
        if !self.before.is_changed {
            return Ok(());
        }
        let Before { enabled, slot, .. } = self.before;
        control(&mut self.client, &Action::Enable(false))?;
        if self.before.is_pending {
            return Err(BoardError::Idle);
        }
        match slot {
            Some(slot) if self.client.hello()?.active != Some(slot) => {
                control(&mut self.client, &Action::Activate { slot, force: true })?;
            }
            Some(_) => {}
            // There is nothing to go back to: the new one stays in its slot, and off.
            None => {
                control(&mut self.client, &Action::EnableAtStart(false))?;
            }
        }
        if enabled && slot.is_some() {
            control(&mut self.client, &Action::Enable(true))?;
        }
        self.before.is_changed = false;
        Ok(())
    }
}
