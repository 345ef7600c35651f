//! What a program is corrected with: from a compensation, rules and a machine to correctors and checks that agree.

use crate::check::{self, CheckError, CheckResult, Corrected, Exact};
use crate::{Corrector, Options, Rules, Tables, Tip};
use std::io::{BufRead, Read};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;

/// Everything that correcting and checking a program depend on.
pub struct Job<'a> {
    /// The compensation's tables.
    pub tables: Tables<'a>,
    /// How words are read.
    pub rules: Rules,
    /// How the program is written.
    pub options: Options,
    tip: Option<Tip<'a>>,
    exact: Option<Exact<'a>>,
}

/// What belongs to a compensation.
#[derive(Clone, Copy, Debug)]
pub struct JobMachine<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The errors of the machine, if the check is to tell what the tool does.
    pub errors: Option<&'a ErrorModel>,
}

/// Why a program cannot be corrected with these.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JobError {
    /// Programs cannot follow this compensation.
    #[error("{0}")]
    Tables(String),
    /// The compensation is another machine's.
    #[error("this is `{machine}`, the compensation is for `{compensation}`, or their axes differ")]
    OtherMachine {
        /// Name of the machine.
        machine: String,
        /// Name of the compensation's.
        compensation: String,
    },
    /// The machine has no workpiece coordinates for programs with tool-centre-point control.
    #[error("--tcp: {0}")]
    NoTip(String),
}

impl JobError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Tables(_) => "use this compensation in the controller",
            Self::OtherMachine { .. } => {
                "give the machine file from which the compensation was compiled"
            }
            Self::NoTip(_) => {
                "describe the machine in the workpiece frame that the controller uses, or post the program without tool-centre-point control"
            }
        }
    }
}

impl<'a> Job<'a> {
    /// With the rules for the compensation's tables, completed by what the machine is.
    ///
    /// # Errors
    /// [`JobError`].
    pub fn new(
        compensation: &'a trueaxis::Largest<'a>,
        of: Option<JobMachine<'a>>,
        options: Options,
        rules: impl FnOnce(&Tables<'_>) -> Rules,
    ) -> Result<Self, JobError> {
        let tables = Tables::new(compensation).map_err(JobError::Tables)?;
        if let Some(of) = of {
            compiled_from(of.machine, compensation)?;
        }
        let mut rules = rules(&tables);
        let (tip, no_tip) = match of.map(|of| Tip::new(of.machine)) {
            Some(Err(cause)) if rules.tip => return Err(JobError::NoTip(cause)),
            Some(Err(cause)) => (None, Some(cause)),
            Some(Ok(tip)) => (Some(tip), None),
            None => (None, None),
        };
        rules.has_machine = tip.is_some();
        rules.no_tip = no_tip;
        rules.machine = compensation.machine().to_owned();
        let exact = of.and_then(|JobMachine { machine, errors }| {
            errors.map(|errors| Exact { machine, errors })
        });
        Ok(Self {
            tables,
            rules,
            options,
            tip,
            exact,
        })
    }

    /// Corrects one program, whose first comment will be `mark`.
    ///
    /// # Errors
    /// Rules that do not fit the dialect.
    pub fn corrector(&self, mark: String) -> Result<Corrector<'_>, String> {
        let tip = self.tip.as_ref();
        Corrector::new(&self.rules, &self.tables, tip, self.options, Some(mark))
    }

    /// Reads a program and the corrected one anew, and compares them.
    ///
    /// # Errors
    /// [`CheckError`]: a corrected program that makes no sense.
    pub fn check(
        &self,
        program: impl BufRead,
        corrected: Corrected<impl BufRead, impl Read>,
    ) -> Result<CheckResult, CheckError> {
        check::check(
            program,
            corrected,
            &self.rules,
            &self.tables,
            self.tip.as_ref(),
            self.exact.as_ref(),
            self.options,
        )
    }
}

/// The machine must be the one of the compensation.
///
/// # Errors
/// [`JobError::OtherMachine`] if its name or its axes differ.
pub fn compiled_from(
    machine: &Machine,
    compensation: &trueaxis::Largest<'_>,
) -> Result<(), JobError> {
    let axes = compensation.axes();
    let mut both = machine.axes.iter().zip(axes);
    let is_same = machine.axes.len() == axes.len()
        && both.all(|(a, b)| a.letter.char() as u8 == b.name)
        && machine.name == compensation.machine();
    match is_same {
        true => Ok(()),
        false => Err(JobError::OtherMachine {
            machine: machine.name.clone(),
            compensation: compensation.machine().to_owned(),
        }),
    }
}
