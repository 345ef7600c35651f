//! What a controller does with its corrections: settings, and which compensation is in use.

use super::client::{Client, Controller, LinkError};
use super::flash::{PAUSE, change_over};
use super::port::Port;
use trueaxis::WeightError;
use trueaxis::link::{AtStart, Refusal, Report, Request, Slot, Storing, TermWeight};

/// Most questions until something is stored, or the corrections have come in or gone out: five
/// seconds.
const QUESTIONS: u32 = 100;
/// So many of them in a row without a servo update: nobody commands.
const IDLE: u32 = 4;

/// What is asked of a controller.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// Nothing: how things are.
    Show,
    /// Lets the corrections in, or takes them out.
    Enable(bool),
    /// The same at start.
    EnableAtStart(bool),
    /// Starts or ends a dry run.
    DryRun(bool),
    /// Sets the tool length, mm.
    ToolLength(f32),
    /// Sets the weight of an adjustable term.
    Weight {
        /// Its index in the blob.
        term: u16,
        /// The weight.
        value: f32,
    },
    /// Changes over to a slot, for good.
    Activate {
        /// Which.
        slot: Slot,
        /// Also if it is for another machine.
        force: bool,
    },
    /// Changes over to the slot that was in use before, for good.
    Rollback {
        /// Also if it is for another machine.
        force: bool,
    },
    /// These axes, by their letters, are referenced, and no other.
    Reference(String),
}

/// Why it was not done.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// The controller refuses, or the link fails.
    #[error("{0}")]
    Link(#[from] LinkError),
    /// Not a finite number.
    #[error("{0} is not a finite number")]
    NotFinite(f32),
    /// No such adjustable term.
    #[error("term {term} does not exist or has a fixed weight; adjustable: {}", listed(.known))]
    NotAdjustable {
        /// The term.
        term: u16,
        /// Those that are.
        known: Vec<u16>,
    },
    /// No such axis.
    #[error("there is no axis {axis}; the axes are {axes}")]
    NoAxis {
        /// Its letter.
        axis: char,
        /// Those that there are.
        axes: String,
    },
    /// The other slot was never in use, or is not valid.
    #[error("there is no compensation to go back to")]
    NothingBefore,
}

/// Numbers, or that there are none.
fn listed(numbers: &[u16]) -> String {
    let words: Vec<String> = numbers.iter().map(u16::to_string).collect();
    match words[..] {
        [] => "none".to_owned(),
        _ => words.join(", "),
    }
}

/// How a controller is.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Who it is, with its slots.
    pub controller: Controller,
    /// Its status.
    pub report: Report,
    /// What its next start goes by.
    pub at_start: AtStart,
    /// Its adjustable terms; none without a compensation in use, nor while one is changed.
    pub weights: Vec<TermWeight>,
}

impl State {
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

/// What was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Done {
    /// Before it.
    pub before: State,
    /// After it, as far as it has come within a few seconds.
    pub after: State,
}

/// Does what is asked, and says how things were before and are after it.
///
/// # Errors
/// [`ControlError`]; nothing has changed.
pub fn control<P: Port>(client: &mut Client<P>, action: &Action) -> Result<Done, ControlError> {
    let before = State::of(client)?;
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
            finite(length)?;
            client.set(&Request::ToolLength(length))?;
        }
        Action::Weight { term, value } => {
            finite(value)?;
            match client.set(&Request::SetWeight { term, value }) {
                Err(LinkError::Refused(Refusal::Weight(WeightError::NotAdjustable))) => {
                    let known = before.weights.iter().map(|weight| weight.term).collect();
                    return Err(ControlError::NotAdjustable { term, known });
                }
                other => other?,
            }
        }
        Action::Activate { slot, force } => activate(client, slot, force)?,
        Action::Rollback { force } => {
            let AtStart {
                in_use,
                before: previous,
                ..
            } = before.at_start;
            let mut candidates = [previous, in_use].into_iter().flatten();
            let other = candidates.find(|slot| before.controller.active != Some(*slot));
            activate(client, other.ok_or(ControlError::NothingBefore)?, force)?;
        }
        Action::Reference(ref letters) => {
            let axes = &before.controller.axes;
            let mut mask = 0;
            for axis in letters.chars() {
                let place = axes.chars().position(|letter| letter == axis);
                let place = place.ok_or_else(|| ControlError::NoAxis {
                    axis,
                    axes: axes.clone(),
                })?;
                mask |= 1 << place;
            }
            client.set(&Request::Referenced(mask))?;
        }
    }
    let after = State::of(client)?;
    Ok(Done { before, after })
}

fn finite(value: f32) -> Result<(), ControlError> {
    match value.is_finite() {
        true => Ok(()),
        false => Err(ControlError::NotFinite(value)),
    }
}

/// Changes over, and waits until the next start goes by it.
fn activate<P: Port>(client: &mut Client<P>, slot: Slot, force: bool) -> Result<(), LinkError> {
    change_over(client, slot, force)?;
    store(client)
}

/// Waits until what is wanted at the next start is stored; not longer than until the machine moves.
fn store<P: Port>(client: &mut Client<P>) -> Result<(), LinkError> {
    for _ in 0..QUESTIONS {
        if client.at_start()?.storing != Storing::Pending {
            break;
        }
        client.port().wait(PAUSE);
    }
    Ok(())
}

/// Waits until the corrections are in, or out; not while the servo is not updated.
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
