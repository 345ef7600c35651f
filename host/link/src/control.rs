//! Controls the corrections of a controller: settings, and the compensation in use.

use crate::client::{Client, LinkError, LinkedController};
use crate::flash::{PAUSE, change_over};
use crate::port::Port;
use trueaxis::WeightError;
use trueaxis::link::{AtStart, Refusal, Report, Request, Slot, Storing, TermWeight};

/// Maximum number of queries until something is stored or the corrections are switched on or off: five seconds.
const QUESTIONS: u32 = 100;
/// This many in a row without a servo update mean that nothing is commanding motion.
const IDLE: u32 = 4;

/// A request to a controller.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Only show the state.
    Show,
    /// Switch the corrections on or off.
    Enable(bool),
    /// Switch the corrections on or off at start.
    EnableAtStart(bool),
    /// Start or end a dry run.
    DryRun(bool),
    /// Set the tool length (mm).
    ToolLength(f32),
    /// Set the weight of an adjustable term.
    Weight {
        /// Index in the blob.
        term: u16,
        /// The weight.
        value: f32,
    },
    /// Switch to a slot permanently.
    Activate {
        /// The slot.
        slot: Slot,
        /// Even if it is for another machine.
        force: bool,
    },
    /// Switch back to the previous slot permanently.
    Rollback {
        /// Even if it is for another machine.
        force: bool,
    },
    /// Set exactly these axes, by their letters, as referenced.
    Reference(String),
}

/// Why a request failed.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// The controller refuses, or the link fails.
    #[error("{0}")]
    Link(#[from] LinkError),
    /// Not a finite number.
    #[error("{0} is not a finite number")]
    NotFinite(f32),
    /// There is no such adjustable term.
    #[error("term {term} does not exist or has a fixed weight; adjustable: {}", listed(.known))]
    NotAdjustable {
        /// The term.
        term: u16,
        /// The adjustable terms.
        known: Vec<u16>,
    },
    /// There is no such axis.
    #[error("there is no axis {axis}; the axes are {axes}")]
    NoAxis {
        /// Letter.
        axis: char,
        /// The available axes.
        axes: String,
    },
    /// The other slot was never in use, or is invalid.
    #[error("there is no compensation to go back to")]
    NothingBefore,
}

impl ControlError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Link(error) => error.remedy(),
            Self::NotFinite(_) => "give a number such as 120.5",
            Self::NotAdjustable { .. } => {
                "give one of the adjustable terms, as `trueaxis control … show` lists them"
            }
            Self::NoAxis { .. } => {
                "give the letters of the compensation in use, for example XYZ, or all or none"
            }
            Self::NothingBefore => {
                "the other slot has no compensation that was in use; see `trueaxis control … show`, and `activate` for one that waits"
            }
        }
    }
}

/// A list of numbers as text, or a note that it is empty.
fn listed(numbers: &[u16]) -> String {
    let words: Vec<String> = numbers.iter().map(u16::to_string).collect();
    match words[..] {
        [] => "none".to_owned(),
        _ => words.join(", "),
    }
}

/// The state of a controller.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerState {
    /// The controller and its slots.
    pub controller: LinkedController,
    /// Status.
    pub report: Report,
    /// The settings for its next start.
    pub at_start: AtStart,
    /// Adjustable terms; empty without a compensation in use, and while it is being switched.
    pub weights: Vec<TermWeight>,
}

impl ControllerState {
    fn of<P: Port>(client: &mut Client<P>) -> Result<Self, LinkError> {
        let weights = match client.weights() {
            Err(LinkError::Refused(Refusal::NoCompensation | Refusal::Busy)) => vec![],
            other => other?,
        };
        Ok(Self {
            controller: client.hello()?,
            report: client.status()?,
            at_start: client.at_start()?,
            weights,
        })
    }

    /// The referenced axes, by their letters.
    #[must_use]
    pub fn referenced(&self) -> String {
        let referenced = |k: &usize| (self.report.referenced >> k) & 1 != 0;
        let letters = self.controller.axes.chars().enumerate();
        letters
            .filter(|(k, _)| referenced(k))
            .map(|l| l.1)
            .collect()
    }
}

/// The result of a request.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// The state before.
    pub before: ControllerState,
    /// The state after, as reached within a few seconds.
    pub after: ControllerState,
}

/// Executes a request, and returns the state before and after.
///
/// # Errors
/// [`ControlError`]; nothing has changed then.
pub fn control<P: Port>(client: &mut Client<P>, action: &Action) -> Result<Done, ControlError> {
    let before = ControllerState::of(client)?;
    match *action {
        Action::Show => {}
        Action::Enable(on) => {
            client.set(&Request::Enable(on))?;
            settle(client, on)?;
        }
        Action::EnableAtStart(on) => {
            client.enable_at_start(on)?;
            store(client)?;
        }
        Action::DryRun(on) => client.set(&Request::DryRun(on))?,
        Action::ToolLength(length) => {
            client.set(&Request::ToolLength(finite(length)?))?;
        }
        Action::Weight { term, value } => {
            let value = finite(value)?;
            let set = client.set(&Request::SetWeight { term, value });
            if let Err(LinkError::Refused(Refusal::Weight(WeightError::NotAdjustable))) = set {
                let known = before.weights.iter().map(|weight| weight.term).collect();
                return Err(ControlError::NotAdjustable { term, known });
            }
            set?;
        }
        Action::Activate { slot, force } => activate(client, slot, force)?,
        Action::Rollback { force } => {
            let at_start = before.at_start;
            let mut candidates = [at_start.before, at_start.in_use].into_iter().flatten();
            let other = candidates.find(|slot| before.controller.active != Some(*slot));
            activate(client, other.ok_or(ControlError::NothingBefore)?, force)?;
        }
        Action::Reference(ref letters) => {
            let mask = mask(letters, &before.controller.axes)?;
            client.set(&Request::Referenced(mask))?;
        }
    }
    let after = ControllerState::of(client)?;
    Ok(Done { before, after })
}

/// Axes (bits) by their letters.
fn mask(letters: &str, axes: &str) -> Result<u16, ControlError> {
    letters.chars().try_fold(0, |mask, axis| {
        let place = axes.chars().position(|letter| letter == axis);
        let place = place.ok_or_else(|| ControlError::NoAxis {
            axis,
            axes: axes.to_owned(),
        })?;
        Ok(mask | 1 << place)
    })
}

fn finite(value: f32) -> Result<f32, ControlError> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(ControlError::NotFinite(value)),
    }
}

/// Switches to a slot, and waits until the setting for the next start is stored.
fn activate<P: Port>(client: &mut Client<P>, slot: Slot, force: bool) -> Result<(), LinkError> {
    change_over(client, slot, force)?;
    store(client)
}

/// Waits until the requested setting for the next start is stored, but gives up once the machine moves.
fn store<P: Port>(client: &mut Client<P>) -> Result<(), LinkError> {
    for _ in 0..QUESTIONS {
        if client.at_start()?.storing != Storing::Pending {
            break;
        }
        client.port().wait(PAUSE);
    }
    Ok(())
}

/// Waits until the corrections are on, or off, but gives up if the servo is not updated.
fn settle<P: Port>(client: &mut Client<P>, on: bool) -> Result<(), LinkError> {
    let (mut updates, mut idle) = (None, 0);
    for _ in 0..QUESTIONS {
        let report = client.status()?;
        let factor = if on { 1.0 } else { 0.0 };
        idle = if updates.replace(report.updates) == Some(report.updates) {
            idle + 1
        } else {
            0
        };
        if report.factor == factor || idle == IDLE {
            break;
        }
        client.port().wait(PAUSE);
    }
    Ok(())
}
