//! Where a target holds less than a compensation needs: what is missing, and what would fit.

use super::{CompileError, Options, Progress, Size, build, prove};
use crate::errors::ErrorModel;
use crate::machine::Machine;
use crate::schemes::{self, SchemeError};
use crate::target::{Shortage, Target};
use crate::validate::Runtime;
use serde::Serialize;

/// Coarsest tolerance that is tried (µm, µrad): beyond it nobody wants to know.
const COARSEST: f64 = 1000.0;

/// A tolerance with which the compensation fits.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// The tolerance, of linear axes (µm) and of rotary ones (µrad).
    pub tolerance_um: f64,
    /// What is needed then.
    #[serde(flatten)]
    pub size: Size,
}

/// What the target lacks to meet the tolerance, for a scheme that has left out what the target
/// cannot hold; nothing if it is missed with the most room, too.
///
/// # Errors
/// [`CompileError`].
pub fn lacking(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Vec<Shortage>, CompileError> {
    progress.stage("looking for what is missing", 0);
    let mut roomy = options.tables.clone();
    roomy.target = Target::desktop();
    let found = match schemes::find(machine, errors, &options.scheme, &roomy) {
        Ok(found) => found,
        Err(SchemeError::TooManyTables { tables }) => {
            return Ok(vec![Shortage {
                what: "tables",
                needed: tables,
                held: options.tables.target.tables,
            }]);
        }
        Err(error) => return Err(error.into()),
    };
    if found.structure_error.is_some_and(|error| error > 1.0) {
        return Ok(Vec::new());
    }
    let blob = found.draft.encode()?;
    let size = Size::of(&Runtime::load(&blob)?);
    Ok(options.tables.target.shortages(&size))
}

/// The first of twice, four times … the tolerance, up to 1000 µm, with which the compensation fits
/// into the target and meets it.
///
/// # Errors
/// [`CompileError`] other than that there is no room.
pub fn coarser(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Option<Fit>, CompileError> {
    let mut options = options.clone();
    let doublings = (COARSEST / (1e3 * options.tables.tolerance)).log2();
    progress.stage("looking for what fits", doublings.max(0.0) as usize);
    let mut tolerance_um = 1e3 * options.tables.tolerance;
    loop {
        tolerance_um = short(2.0 * tolerance_um);
        if tolerance_um > COARSEST {
            return Ok(None);
        }
        options.tables.tolerance = 1e-3 * tolerance_um;
        progress.step();
        let built = match build(machine, errors, &options, &()) {
            Ok(built) => built,
            Err(
                CompileError::NoRoom { .. }
                | CompileError::Scheme(SchemeError::TooManyTables { .. }),
            ) => continue,
            Err(error) => return Err(error),
        };
        // What the scheme itself has no hope for need not be proven.
        if built.structure_error.is_some_and(|error| error > 1.0) {
            continue;
        }
        let proof = prove(
            machine,
            errors,
            &Runtime::load(&built.blob)?,
            &options.tables.zero(machine, errors)?,
            options.random,
            options.seed,
            &(),
        )?;
        if proof.refusals(tolerance_um).is_empty() {
            return Ok(Some(Fit {
                tolerance_um,
                size: built.size,
            }));
        }
    }
}

/// Rounded to four digits: what is tried is what is printed, and what a user will type.
fn short(tolerance: f64) -> f64 {
    format!("{tolerance:.3e}").parse().unwrap_or(tolerance)
}

#[cfg(test)]
mod tests {
    use super::short;

    #[test]
    fn tolerances_to_type_are_short() {
        let mut tolerance = 0.05;
        for _ in 0..14 {
            tolerance = short(2.0 * tolerance);
            assert!(tolerance.to_string().len() <= 5, "{tolerance}");
        }
        assert_eq!(short(2.0 * (1.0 / 3.0)), 0.6667);
    }
}
