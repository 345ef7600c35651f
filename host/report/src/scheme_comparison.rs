//! Compares schemes on one machine.

pub mod probed;
mod single;

use probed::Strategy;
use serde::Serialize;
pub use single::{SingleCost, SingleRecord, SinglesRecord, single, single_schemes};
use std::collections::BTreeMap;
use trueaxis_identify::IdentifyError;
use trueaxis_identify::simulate::SimulateError;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::policy::{PolicyName, stored};
use trueaxis_model::validate::{Quality, Runtime};
use trueaxis_tables::compile::{self, CompileError, Held, Progress, Size};
use trueaxis_tables::cost::instructions;
use trueaxis_tables::schemes::Scheme;

/// A comparison of schemes on one machine.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonRecord {
    /// Name of the machine.
    pub machine: String,
    /// The position whose correction is subtracted everywhere, as it was given.
    pub zero_at: Option<String>,
    /// How rotary axes take part.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// Largest permitted difference from the kinematic correction.
    pub tolerance_um: f64,
    /// Name of the target.
    pub target: String,
    /// Without a compensation, over the whole travel.
    pub before: Option<Quality>,
    /// The schemes, in the order in which they were compared.
    pub schemes: Vec<SchemeRecord>,
}

/// One scheme.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeRecord {
    /// Name of the scheme.
    pub scheme: String,
    /// What it costs and reaches, if it supports this machine.
    #[serde(flatten)]
    pub figures: Option<SchemeCost>,
    /// Why it does not support this machine.
    pub reason: Option<String>,
    /// What to do about that.
    pub remedy: Option<&'static str>,
}

/// What a scheme costs on a machine, and what it reaches.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeCost {
    /// Tables, terms, samples, bytes.
    #[serde(flatten)]
    pub size: Size,
    /// Estimated, of one evaluation on the reference target.
    pub instructions: f64,
    /// Over the whole travel.
    pub after: Quality,
    /// Largest difference of the tip from the kinematic correction, where the tolerance applies.
    pub difference_um: f64,
    /// Largest difference of the tool direction from it there.
    pub difference_urad: f64,
    /// Whether these are within the tolerance.
    pub meets_tolerance: bool,
    /// The rotary positions for which alone it is made, and its quality there.
    pub held: Option<Held>,
    /// What the scheme says of its tables.
    pub notes: Vec<String>,
    /// The removed share of each parameter: 1 if it is removed completely.
    pub compensability: BTreeMap<String, Option<f64>>,
    /// Why `compensability` is empty.
    pub no_compensability: Option<String>,
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
    zero_at: Option<&str>,
    progress: &dyn Progress,
) -> ComparisonRecord {
    let plan = Strategy::new(machine, errors, options.seed);
    let tolerance_um = 1e3 * options.tables.tolerance;
    let mut before = None;
    let mut one = |scheme: &Scheme| -> Result<SchemeCost, CompileError> {
        let options = compile::Options {
            scheme: scheme.clone(),
            allow_large: true,
            ..options.clone()
        };
        let compiled = compile::compile(machine, errors, &options, progress)?;
        let runtime = Runtime::load(&compiled.built.blob)?;
        let compared = match &plan {
            Ok(plan) => plan.compensability(machine, errors, &runtime),
            Err(unknown) => Err(unknown.clone()),
        };
        let verification = &compiled.verification;
        before.get_or_insert(verification.travel.before);
        let inside = verification.inside();
        Ok(SchemeCost {
            size: compiled.built.size,
            instructions: instructions(&runtime),
            after: verification.travel.after,
            difference_um: inside.difference_um,
            difference_urad: inside.difference_urad,
            meets_tolerance: verification.meets(tolerance_um),
            held: verification.held.clone(),
            notes: compiled.built.notes.clone(),
            no_compensability: compared.as_ref().err().map(ToString::to_string),
            compensability: (compared.iter().flat_map(|found| &found.parameters))
                .map(|one| (one.parameter.to_string(), one.part().map(|[part, _]| part)))
                .collect(),
        })
    };
    let records = schemes.iter().map(|scheme| {
        let found = one(scheme);
        let error = found.as_ref().err();
        SchemeRecord {
            scheme: scheme.name(),
            reason: error.map(ToString::to_string),
            remedy: error.map(CompileError::remedy),
            figures: found.ok(),
        }
    });
    let schemes = records.collect();
    ComparisonRecord {
        machine: machine.name.clone(),
        zero_at: zero_at.map(str::to_owned),
        policy: stored(options.tables.policy).into(),
        tolerance_um,
        target: options.tables.target.name.to_string(),
        before,
        schemes,
    }
}
