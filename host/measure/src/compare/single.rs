//! What it takes to correct each error parameter by itself (source document, section 9.2).

use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{self, CompileError, Progress};
use trueaxis_tables::schemes::Scheme;

/// The schemes that can correct a single error completely.
#[must_use]
pub fn single_schemes() -> Vec<Scheme> {
    let adjustable = Vec::new();
    vec![Scheme::default(), Scheme::Fik { adjustable }]
}

/// One error parameter, on a machine that has no other.
#[derive(Clone, Debug)]
pub struct SingleError {
    /// The parameter.
    pub parameter: Parameter,
    /// Value (mm, rad, per mm or rad to its degree).
    pub value: f64,
    /// What each scheme takes for it, or why it does not support the machine.
    pub schemes: Vec<Result<TablesTaken, CompileError>>,
}

/// The tables of a scheme for one error, and their effect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TablesTaken {
    /// Number of tables.
    pub tables: usize,
    /// Number of terms.
    pub terms: usize,
    /// Mean displacement of the tip over the travel without them (µm).
    pub before: f64,
    /// Largest displacement of the tip with them (µm).
    pub left: f64,
}

/// Runs schemes on every error parameter by itself, with the same options. Errors that are tables are left out.
#[must_use]
pub fn single(
    machine: &Machine,
    errors: &ErrorModel,
    schemes: &[Scheme],
    options: &compile::Options,
    progress: &dyn Progress,
) -> Vec<SingleError> {
    let of = |(parameter, value): (&Parameter, &f64)| {
        let mut alone = ErrorModel::perfect(machine);
        alone.calibrated = errors.calibrated;
        alone.set(machine, *parameter, *value);
        let taken = schemes.iter().map(|scheme| {
            let options = compile::Options {
                scheme: scheme.clone(),
                allow_large: true,
                ..options.clone()
            };
            let compiled = compile::compile(machine, &alone, &options, progress)?;
            let travel = &compiled.verification.travel;
            Ok(TablesTaken {
                tables: compiled.built.size.tables,
                terms: compiled.built.size.terms,
                before: travel.before.translation_um.mean,
                left: travel.after.translation_um.max,
            })
        });
        SingleError {
            parameter: *parameter,
            value: *value,
            schemes: taken.collect(),
        }
    };
    errors.parameters.iter().map(of).collect()
}
