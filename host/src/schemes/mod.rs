//! Schemes: from errors to tables.
//!
//! A scheme is a folder here, a value of [`Scheme`] and a line in [`find`]. It is given what is
//! common to all of them, [`Options`], and returns what is: [`Found`] or a [`SchemeError`].

pub mod exact;
mod options;
mod result;

use crate::errors::ErrorModel;
use crate::machine::Machine;
use exact::Minimize;
pub use options::Options;
pub use result::{Found, SchemeError};

/// How tables are found, with what only this scheme is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// Finds the factors itself, for any machine and any errors.
    Exact {
        /// What is to be least.
        minimize: Minimize,
    },
}

impl Scheme {
    /// Its name in the command and in its answers.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Exact { .. } => "exact",
        }
    }
}

impl Default for Scheme {
    fn default() -> Self {
        Self::Exact {
            minimize: Minimize::Cost,
        }
    }
}

/// Finds the tables and terms of a compensation. Its bounds are still open, nothing is proven.
///
/// # Errors
/// [`SchemeError`].
pub fn find(
    machine: &Machine,
    errors: &ErrorModel,
    scheme: &Scheme,
    options: &Options,
) -> Result<Found, SchemeError> {
    match *scheme {
        Scheme::Exact { minimize } => exact::compile(machine, errors, minimize, options),
    }
}
