//! Schemes: from errors to tables.
//!
//! A scheme is a folder or a file here, a variant of [`Scheme`] with its name, and a line in [`find`]. It takes the
//! common [`Options`] and returns a [`SchemeResult`] or a [`SchemeError`].

pub(crate) mod blank;
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
mod subset;
pub mod trigo23;

pub use exact::Effort;
use exact::Minimize;
pub use name::UnknownScheme;
pub use options::Options;
pub use result::{SchemeError, SchemeResult};
use std::num::NonZeroU8;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// How tables are found, with the options of each scheme.
#[derive(Clone, Debug, PartialEq)]
pub enum Scheme {
    /// Finds the factors itself, for any machine and any errors.
    Exact {
        /// The quantity to minimize.
        minimize: Minimize,
    },
    /// Corrections at the nodes of a grid of the linear axes (Chapter 4).
    Grid3d(grid3d::Wanted),
    /// Cubic polynomials of every axis for every axis (Chapter 5).
    Poly25(poly25::Wanted),
    /// Products of trigonometric functions of a rotary axis and linear positions (Chapter 6).
    Trigo23(trigo23::Wanted),
    /// A chain of tables for each closed-form term of each error (Chapter 7).
    Fik {
        /// The errors whose weights can be set on the controller.
        adjustable: Vec<Parameter>,
    },
    /// The tables that remove most of the error, each of one axis for one axis (section 9.2).
    Subset {
        /// Largest number of tables.
        tables: NonZeroU8,
    },
}

impl Scheme {
    /// True if it finds as many tables as the tolerance needs. The others have a fixed number of tables; they are
    /// written even if they miss the tolerance or make the machine worse, with a warning.
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

    /// The rotary axes and the position (deg) for which alone the tables are made, if the scheme has one: axis
    /// indices and positions.
    #[must_use]
    pub fn held(&self, machine: &Machine) -> Vec<(usize, f64)> {
        match self {
            Self::Grid3d(wanted) => wanted.held(machine),
            _ => Vec::new(),
        }
    }

    /// What to do if the compensation does not fit into the target.
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

/// Finds the tables and terms of compensations of one machine, for one or several tolerances and targets.
pub struct Finder<'a> {
    machine: &'a Machine,
    errors: &'a ErrorModel,
    scheme: &'a Scheme,
    exact: Option<exact::Exact<'a>>,
}

impl<'a> Finder<'a> {
    /// Samples nothing yet.
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel, scheme: &'a Scheme) -> Self {
        Self {
            machine,
            errors,
            scheme,
            exact: None,
        }
    }

    /// Finds the tables and terms of a compensation. Its bounds are not set yet, and nothing is verified. Between calls,
    /// only the tolerance and the target in `options` may change.
    ///
    /// `None` if `effort`, which only the scheme `exact` looks at, does not allow for a result.
    ///
    /// # Errors
    /// [`SchemeError`].
    pub fn find(
        &mut self,
        options: &Options,
        effort: Effort,
    ) -> Result<Option<SchemeResult>, SchemeError> {
        let (machine, errors) = (self.machine, self.errors);
        let found = match self.scheme {
            Scheme::Exact { minimize } => {
                let known = self.exact.take();
                let exact = match known {
                    Some(exact) => exact,
                    None => exact::Exact::new(machine, errors, *minimize, options)?,
                };
                return self.exact.insert(exact).find(options, effort);
            }
            Scheme::Grid3d(wanted) => grid3d::compile(machine, errors, wanted, options),
            Scheme::Poly25(wanted) => poly25::compile(machine, errors, *wanted, options),
            Scheme::Trigo23(wanted) => trigo23::compile(machine, errors, *wanted, options),
            Scheme::Fik { adjustable } => fik::compile(machine, errors, adjustable, options),
            Scheme::Subset { tables } => subset::compile(machine, errors, *tables, options),
        };
        found.map(Some)
    }
}

/// Finds the tables and terms of a compensation. Its bounds are not set yet, and nothing is verified.
///
/// # Errors
/// [`SchemeError`].
pub fn find(
    machine: &Machine,
    errors: &ErrorModel,
    scheme: &Scheme,
    options: &Options,
) -> Result<SchemeResult, SchemeError> {
    let found = Finder::new(machine, errors, scheme).find(options, Effort::Best)?;
    Ok(found.expect("the best effort has a result"))
}

/// The note on errors that depend on the direction of travel, for schemes whose tables do not.
fn without_direction(machine: &Machine, errors: &ErrorModel) -> Option<String> {
    let reversing = (0..machine.axes.len()).filter(|i| errors.reverses(*i));
    let letters: Vec<String> = reversing
        .map(|i| machine.axes[i].letter.to_string())
        .collect();
    (!letters.is_empty()).then(|| {
        format!(
            "the tables ignore the direction of travel of {}: --scheme exact and fik include it",
            letters.join(", ")
        )
    })
}
