//! Schemes: from errors to tables.
//!
//! A scheme is a folder or a file here, a value of [`Scheme`] with its name, and a line in [`find`]. It is
//! given what is common to all of them, [`Options`], and returns what is: [`SchemeResult`] or a [`SchemeError`].

mod blank;
pub mod exact;
pub mod fik;
pub mod grid3d;
mod lattice;
mod moments;
mod name;
mod options;
mod points;
pub mod poly25;
mod products;
mod result;
pub mod subset;
pub mod trigo23;

use exact::Minimize;
pub use name::UnknownScheme;
pub use options::Options;
pub use result::{SchemeError, SchemeResult};
use std::num::NonZeroU8;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// How tables are found, with what only this scheme is asked.
#[derive(Clone, Debug, PartialEq)]
pub enum Scheme {
    /// Finds the factors itself, for any machine and any errors.
    Exact {
        /// What is to be least.
        minimize: Minimize,
    },
    /// Corrections at the nodes of a grid of the linear axes (Chapter 4).
    Grid3d(grid3d::Wanted),
    /// Cubic polynomials of every axis for every axis (Chapter 5).
    Poly25(poly25::Wanted),
    /// Trigonometric functions of a rotary axis times linear positions (Chapter 6).
    Trigo23(trigo23::Wanted),
    /// A chain of tables for each closed-form term of each error (Chapter 7).
    Fik {
        /// The errors whose weights can be set on the controller.
        adjustable: Vec<Parameter>,
    },
    /// The tables that remove most, each of one axis for one axis (section 9.2).
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
            Self::Grid3d(_)
            | Self::Poly25(_)
            | Self::Trigo23(_)
            | Self::Fik { .. }
            | Self::Subset { .. } => false,
        }
    }

    /// The rotary axes for one position (deg) of which alone its tables are made, if they are: their numbers, and
    /// where they are.
    #[must_use]
    pub fn held(&self, machine: &Machine) -> Vec<(usize, f64)> {
        match self {
            Self::Grid3d(wanted) => wanted.held(machine),
            _ => Vec::new(),
        }
    }

    /// What to do where a controller holds less than it needs.
    #[must_use]
    pub const fn smaller(&self) -> &'static str {
        match self {
            Self::Exact { .. } => {
                "raise --tolerance, store --samples i16 if bytes are short, or give another --target"
            }
            Self::Grid3d(_) => {
                "raise --threshold, so that fewer nodes are needed, store --samples i16, correct linear axes only with --policy position, or give another --target"
            }
            Self::Poly25(_) | Self::Trigo23(_) => {
                "give another --target, fewer --points if bytes are short, or use --scheme exact, which keeps to its target"
            }
            Self::Fik { .. } => {
                "use --scheme exact, which needs fewer tables, give another --target, or write fewer errors"
            }
            Self::Subset { .. } => "ask for fewer tables, lower --points, or give another --target",
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
) -> Result<SchemeResult, SchemeError> {
    match scheme {
        Scheme::Exact { minimize } => exact::compile(machine, errors, *minimize, options),
        Scheme::Grid3d(wanted) => grid3d::compile(machine, errors, wanted, options),
        Scheme::Poly25(wanted) => poly25::compile(machine, errors, *wanted, options),
        Scheme::Trigo23(wanted) => trigo23::compile(machine, errors, *wanted, options),
        Scheme::Fik { adjustable } => fik::compile(machine, errors, adjustable, options),
        Scheme::Subset { tables } => subset::compile(machine, errors, *tables, options),
    }
}

/// What to say of errors that depend on the direction of travel, where tables do not.
fn without_direction(machine: &Machine, errors: &ErrorModel) -> Option<String> {
    let reversing = (0..machine.axes.len()).filter(|i| errors.reverses(*i));
    let letters: Vec<String> = reversing
        .map(|i| machine.axes[i].letter.to_string())
        .collect();
    (!letters.is_empty()).then(|| {
        format!(
            "what depends on the direction of travel of {} is not in the tables: --scheme exact has it",
            letters.join(", ")
        )
    })
}
