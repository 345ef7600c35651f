//! Compares schemes on one machine.

pub mod probed;
mod record;
mod single;

use crate::identify::{Compensated, IdentifyError};
use crate::simulate::SimulateError;
use probed::Strategy;
pub use record::{
    ComparisonRecord, SchemeCost, SchemeRecord, SingleCost, SingleRecord, SinglesRecord,
};
pub use single::{SingleError, TablesTaken, single, single_schemes};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{self, CompileError, Compiled, Progress, Size};
use trueaxis_tables::cost::instructions;
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::validate::Runtime;

/// One scheme on this machine.
#[derive(Clone, Debug)]
pub struct ComparedScheme {
    /// Name of the scheme.
    pub scheme: String,
    /// Figures, or why it does not support the machine.
    pub found: Result<SchemeFigures, CompileError>,
}

/// Resources and effect of a scheme's tables.
#[derive(Clone, Debug)]
pub struct SchemeFigures {
    /// Tables, terms, samples, bytes.
    pub size: Size,
    /// Estimated instructions of one evaluation on the reference target.
    pub instructions: f64,
    /// The compensation and its verification.
    pub compiled: Compiled,
    /// Effect on each error parameter, or why that cannot be determined.
    pub compensability: Result<Compensated, NotCompared>,
}

/// Why the remaining parameters after a compensation cannot be determined.
#[derive(Clone, Debug, thiserror::Error)]
pub enum NotCompared {
    /// There are no parameters.
    #[error("the error file has no parameters, only tables")]
    NoParameters,
    /// Not enough balls can be reached at many rotary positions.
    #[error("the stylus reaches too few places for simulated probings")]
    NotReached,
    /// A probing cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// The parameters cannot be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// Runs every scheme on one machine and its errors, with the same common options. Unusually large corrections are
/// accepted, because nothing is written.
///
/// Compensability (Eq. 38 of the source document) is that of parameters identified from simulated noise-free
/// probings with the compensation on, of balls with known distances, at rotary positions over the whole travel.
#[must_use]
pub fn compare(
    machine: &Machine,
    errors: &ErrorModel,
    schemes: &[Scheme],
    options: &compile::Options,
    progress: &dyn Progress,
) -> Vec<ComparedScheme> {
    let plan = Strategy::new(machine, errors, options.seed);
    let one = |scheme: &Scheme| {
        let options = compile::Options {
            scheme: scheme.clone(),
            allow_large: true,
            ..options.clone()
        };
        let compiled = compile::compile(machine, errors, &options, progress)?;
        let runtime = Runtime::load(&compiled.built.blob)?;
        let compensability = match &plan {
            Ok(plan) => plan.compensability(machine, errors, &runtime),
            Err(unknown) => Err(unknown.clone()),
        };
        let instructions = instructions(&runtime);
        drop(runtime);
        Ok(SchemeFigures {
            size: compiled.built.size,
            instructions,
            compensability,
            compiled,
        })
    };
    (schemes.iter())
        .map(|scheme| ComparedScheme {
            scheme: scheme.name(),
            found: one(scheme),
        })
        .collect()
}
