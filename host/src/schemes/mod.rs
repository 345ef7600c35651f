//! Schemes: from errors to tables.
//!
//! A scheme is a folder or a file here, a value of [`Scheme`] with its name, and a line in [`find`]. It is
//! given what is common to all of them, [`Options`], and returns what is: [`Found`] or a [`SchemeError`].

mod blank;
pub mod exact;
pub mod fik;
mod name;
mod options;
mod products;
mod result;
pub mod subset;

use crate::errors::{ErrorModel, Parameter};
use crate::machine::Machine;
use exact::Minimize;
pub use name::UnknownScheme;
pub use options::Options;
pub use result::{Found, SchemeError};
use std::num::NonZeroU8;

/// How tables are found, with what only this scheme is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Scheme {
    /// Finds the factors itself, for any machine and any errors.
    Exact {
        /// What is to be least.
        minimize: Minimize,
    },
    /// Chapter 7 of the source document: a chain of tables for each closed-form term of each error.
    Fik {
        /// The errors whose weights can be set on the controller; if there are none, as many as have
        /// tables of their own anyway.
        adjustable: Vec<Parameter>,
    },
    /// The tables that remove most, each of one axis for one axis.
    Subset {
        /// At most so many.
        tables: NonZeroU8,
    },
}

impl Scheme {
    /// True if it finds as many tables as the tolerance needs. The others have the tables that they have: they
    /// are written also when they miss the tolerance, or leave a machine worse than nothing, and say so.
    #[must_use]
    pub const fn keeps_tolerance(&self) -> bool {
        match self {
            Self::Exact { .. } => true,
            Self::Fik { .. } | Self::Subset { .. } => false,
        }
    }

    /// What to do where a controller holds less than it needs.
    #[must_use]
    pub const fn smaller(&self) -> &'static str {
        match self {
            Self::Exact { .. } => {
                "raise --tolerance, store --samples i16 if bytes are short, or give another --target"
            }
            Self::Fik { .. } => {
                "use --scheme exact, which needs fewer tables, give another --target, or write fewer errors"
            }
            Self::Subset { .. } => {
                "ask for fewer tables, lower --points, or give another --target"
            }
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
    match scheme {
        Scheme::Exact { minimize } => exact::compile(machine, errors, *minimize, options),
        Scheme::Fik { adjustable } => fik::compile(machine, errors, adjustable, options),
        Scheme::Subset { tables } => subset::compile(machine, errors, *tables, options),
    }
}
