//! Schemes on one machine, side by side.

pub mod probed;

use crate::identify::{Compensated, IdentifyError};
use crate::simulate::SimulateError;
use probed::Strategy;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{self, CompileError, Compiled, Progress, Size};
use trueaxis_tables::cost::instructions;
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::validate::Runtime;

/// One scheme on this machine.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Name of the scheme.
    pub scheme: String,
    /// What it does, or why it cannot.
    pub found: Result<Figures, CompileError>,
}

/// What the tables of a scheme take and do.
#[derive(Clone, Debug)]
pub struct Figures {
    /// Tables, terms, samples, bytes.
    pub size: Size,
    /// Estimated instructions of one evaluation on the reference target.
    pub instructions: f64,
    /// The compensation and what it does.
    pub compiled: Compiled,
    /// What it does to each error parameter; or why that cannot be said.
    pub compensability: Result<Compensated, Unknown>,
}

/// Why nothing can be said of the parameters that are left after a compensation.
#[derive(Clone, Debug, thiserror::Error)]
pub enum Unknown {
    /// There are none.
    #[error("the error file has no parameters, only tables")]
    NoParameters,
    /// Not enough balls can be reached at many rotary positions.
    #[error("the stylus reaches too few places for simulated probings")]
    NotReached,
    /// A probing fails.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The parameters cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// Runs every scheme with the same options, but for their own, on one machine and its errors. None is refused
/// for corrections that are unusually large: nothing is written.
///
/// Compensability (Eq. 38 of the source document) is that of parameters that are identified from simulated
/// probings without noise while the compensation is on, of balls whose distances are known, at rotary positions
/// all over the travel.
#[must_use]
pub fn compare(
    machine: &Machine,
    errors: &ErrorModel,
    schemes: &[Scheme],
    options: &compile::Options,
    progress: &dyn Progress,
) -> Vec<Compared> {
    let strategy = Strategy::new(machine, errors, options.seed);
    let one = |scheme: &Scheme| {
        let options = compile::Options {
            scheme: scheme.clone(),
            allow_large: true,
            ..options.clone()
        };
        let compiled = compile::compile(machine, errors, &options, progress)?;
        let runtime = Runtime::load(&compiled.built.blob)?;
        let compensability = match &strategy {
            Ok(strategy) => strategy.compensability(machine, errors, &runtime),
            Err(unknown) => Err(unknown.clone()),
        };
        let instructions = instructions(&runtime);
        drop(runtime);
        Ok(Figures {
            size: compiled.built.size,
            instructions,
            compensability,
            compiled,
        })
    };
    schemes
        .iter()
        .map(|scheme| Compared {
            scheme: scheme.name(),
            found: one(scheme),
        })
        .collect()
}
