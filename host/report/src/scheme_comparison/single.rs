//! What it takes to correct each error parameter by itself (source document, section 9.2).

use serde::Serialize;
use std::collections::BTreeMap;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{PolicyName, stored};
use trueaxis_tables::compile::{self, CompileError, Progress};
use trueaxis_tables::schemes::Scheme;

/// The schemes that can correct a single error completely.
#[must_use]
pub fn single_schemes() -> Vec<Scheme> {
    let adjustable = Vec::new();
    vec![Scheme::default(), Scheme::Fik { adjustable }]
}

/// What each error parameter takes by itself.
#[derive(Clone, Debug, Serialize)]
pub struct SinglesRecord {
    /// Name of the machine.
    pub machine: String,
    /// The position whose correction is subtracted everywhere, as it was given.
    pub zero_at: Option<String>,
    /// How rotary axes take part.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// Largest permitted difference from the kinematic correction.
    pub tolerance_um: f64,
    /// Names of the schemes.
    #[serde(skip)]
    pub schemes: Vec<String>,
    /// The error parameters.
    pub single: Vec<SingleRecord>,
    /// Why a scheme does not support the machine.
    pub reasons: BTreeMap<String, String>,
}

/// One error parameter, on a machine that has no other.
#[derive(Clone, Debug, Serialize)]
pub struct SingleRecord {
    /// Name of the parameter.
    pub parameter: String,
    /// mm, rad, per mm or rad to its degree.
    pub value: f64,
    /// Mean displacement of the tip over the travel without a compensation.
    pub before_um: Option<f64>,
    /// By the name of the scheme.
    pub schemes: BTreeMap<String, SingleCost>,
}

/// What a scheme takes for one error parameter.
#[derive(Clone, Debug, Serialize)]
pub struct SingleCost {
    /// Number of tables.
    pub tables: usize,
    /// Number of terms.
    pub terms: usize,
    /// Largest displacement of the tip with these tables.
    pub largest_after_um: f64,
}

/// Runs schemes on every error parameter by itself, with the same options. Errors that are tables are left out.
#[must_use]
pub fn single(
    machine: &Machine,
    errors: &ErrorModel,
    schemes: &[Scheme],
    options: &compile::Options,
    zero_at: Option<&str>,
    progress: &dyn Progress,
) -> SinglesRecord {
    let mut reasons = BTreeMap::new();
    let one = |(parameter, value): (&Parameter, &f64)| {
        let mut alone = ErrorModel::perfect(machine);
        alone.calibrated = errors.calibrated;
        alone.set(machine, *parameter, *value);
        let mut record = SingleRecord {
            parameter: parameter.to_string(),
            value: *value,
            before_um: None,
            schemes: BTreeMap::new(),
        };
        for scheme in schemes {
            match taken(machine, &alone, scheme, options, progress) {
                Ok((before, cost)) => {
                    record.before_um.get_or_insert(before);
                    record.schemes.insert(scheme.name(), cost);
                }
                Err(error) => {
                    let reason = || format!("{error} ({})", error.remedy());
                    reasons.entry(scheme.name()).or_insert_with(reason);
                }
            }
        }
        record
    };
    let single = errors.parameters.iter().map(one).collect();
    SinglesRecord {
        machine: machine.name.clone(),
        zero_at: zero_at.map(str::to_owned),
        policy: stored(options.tables.policy).into(),
        tolerance_um: 1e3 * options.tables.tolerance,
        schemes: schemes.iter().map(Scheme::name).collect(),
        single,
        reasons,
    }
}

/// The mean displacement of the tip without tables (µm), and what the tables of a scheme take.
fn taken(
    machine: &Machine,
    errors: &ErrorModel,
    scheme: &Scheme,
    options: &compile::Options,
    progress: &dyn Progress,
) -> Result<(f64, SingleCost), CompileError> {
    let options = compile::Options {
        scheme: scheme.clone(),
        allow_large: true,
        ..options.clone()
    };
    let compiled = compile::compile(machine, errors, &options, progress)?;
    let travel = &compiled.verification.travel;
    let cost = SingleCost {
        tables: compiled.built.size.tables,
        terms: compiled.built.size.terms,
        largest_after_um: travel.after.translation_um.max,
    };
    Ok((travel.before.translation_um.mean, cost))
}
