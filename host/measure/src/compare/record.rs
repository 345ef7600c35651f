//! Comparisons of schemes as they are written to files and read by other programs.

use super::{ComparedScheme, SchemeFigures, SingleError, TablesTaken};
use crate::identify::Compensated;
use serde::Serialize;
use std::collections::BTreeMap;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Held, Options, Size};
use trueaxis_tables::policy::{PolicyName, stored};
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::validate::Quality;

/// A comparison of schemes on one machine.
#[derive(Clone, Debug, Serialize)]
pub struct ComparisonRecord<'a> {
    /// Name of the machine.
    pub machine: &'a str,
    /// The position whose correction is subtracted everywhere.
    pub zero_at: Option<&'a str>,
    /// How rotary axes take part.
    #[serde(flatten)]
    pub policy: PolicyName,
    /// Largest permitted difference from the kinematic correction.
    pub tolerance_um: f64,
    /// Name of the target.
    pub target: &'a str,
    /// Without a compensation, over the whole travel.
    pub before: Option<&'a Quality>,
    /// The schemes, in the order in which they were compared.
    pub schemes: Vec<SchemeRecord<'a>>,
}

/// One scheme.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeRecord<'a> {
    /// Name of the scheme.
    pub scheme: &'a str,
    /// What it costs and reaches, if it supports this machine.
    #[serde(flatten)]
    pub figures: Option<SchemeCost<'a>>,
    /// Why it does not support this machine.
    pub reason: Option<String>,
    /// What to do about that.
    pub remedy: Option<&'static str>,
}

/// What a scheme costs on a machine, and what it reaches.
#[derive(Clone, Debug, Serialize)]
pub struct SchemeCost<'a> {
    /// Tables, terms, samples, bytes.
    #[serde(flatten)]
    pub size: Size,
    /// Estimated, of one evaluation on the reference target.
    pub instructions: f64,
    /// Over the whole travel.
    pub after: &'a Quality,
    /// Largest difference of the tip from the kinematic correction, where the tolerance applies.
    pub difference_um: f64,
    /// Largest difference of the tool direction from it there.
    pub difference_urad: f64,
    /// Whether these are within the tolerance.
    pub meets_tolerance: bool,
    /// The rotary positions for which alone it is made, and its quality there.
    pub held: Option<&'a Held>,
    /// What the scheme says of its tables.
    pub notes: &'a [String],
    /// The removed share of each parameter: 1 if it is removed completely.
    pub compensability: BTreeMap<String, Option<f64>>,
    /// Why `compensability` is empty.
    pub no_compensability: Option<String>,
}

impl<'a> ComparisonRecord<'a> {
    /// `zero_at` as it was given.
    #[must_use]
    pub fn new(
        machine: &'a Machine,
        compared: &'a [ComparedScheme],
        options: &'a Options,
        zero_at: Option<&'a str>,
    ) -> Self {
        let policy = stored(options.tables.policy);
        let tolerance_um = 1e3 * options.tables.tolerance;
        let found = compared.iter().find_map(|one| one.found.as_ref().ok());
        Self {
            machine: &machine.name,
            zero_at,
            policy: policy.into(),
            tolerance_um,
            target: &options.tables.target.name,
            before: found.map(|figures| &figures.compiled.verification.travel.before),
            schemes: (compared.iter())
                .map(|one| SchemeRecord::new(one, tolerance_um))
                .collect(),
        }
    }
}

impl<'a> SchemeRecord<'a> {
    fn new(compared: &'a ComparedScheme, tolerance_um: f64) -> Self {
        let found = compared.found.as_ref();
        Self {
            scheme: &compared.scheme,
            figures: found
                .ok()
                .map(|figures| SchemeCost::new(figures, tolerance_um)),
            reason: found.err().map(ToString::to_string),
            remedy: found.err().map(|error| error.remedy()),
        }
    }
}

impl<'a> SchemeCost<'a> {
    fn new(figures: &'a SchemeFigures, tolerance_um: f64) -> Self {
        let verification = &figures.compiled.verification;
        let inside = verification.inside();
        let of = |compared: &Compensated| -> BTreeMap<String, Option<f64>> {
            let parameters = compared.parameters.iter();
            parameters
                .map(|one| (one.parameter.to_string(), one.part().map(|[part, _]| part)))
                .collect()
        };
        Self {
            size: figures.size,
            instructions: figures.instructions,
            after: &verification.travel.after,
            difference_um: inside.difference_um,
            difference_urad: inside.difference_urad,
            meets_tolerance: verification.meets(tolerance_um),
            held: verification.held.as_ref(),
            notes: &figures.compiled.built.notes,
            compensability: figures.compensability.as_ref().map(of).unwrap_or_default(),
            no_compensability: figures
                .compensability
                .as_ref()
                .err()
                .map(ToString::to_string),
        }
    }
}

/// What each error parameter takes by itself.
#[derive(Clone, Debug, Serialize)]
pub struct SinglesRecord<'a> {
    /// Name of the machine.
    pub machine: &'a str,
    /// The position whose correction is subtracted everywhere.
    pub zero_at: Option<&'a str>,
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

impl<'a> SinglesRecord<'a> {
    /// `zero_at` as it was given.
    #[must_use]
    pub fn new(
        machine: &'a Machine,
        schemes: &[Scheme],
        found: &[SingleError],
        options: &Options,
        zero_at: Option<&'a str>,
    ) -> Self {
        let policy = stored(options.tables.policy);
        let names: Vec<String> = schemes.iter().map(Scheme::name).collect();
        let mut reasons = BTreeMap::new();
        for single in found {
            for (name, taken) in names.iter().zip(&single.schemes) {
                if let Err(error) = taken {
                    let reason = format!("{error} ({})", error.remedy());
                    reasons.entry(name.clone()).or_insert(reason);
                }
            }
        }
        let one = |single: &SingleError| {
            let taken = names.iter().zip(&single.schemes);
            let taken = taken.filter_map(|(name, taken)| Some((name, taken.as_ref().ok()?)));
            let takes = |(name, taken): (&String, &TablesTaken)| {
                let takes = SingleCost {
                    tables: taken.tables,
                    terms: taken.terms,
                    largest_after_um: taken.left,
                };
                (name.clone(), takes)
            };
            SingleRecord {
                parameter: single.parameter.to_string(),
                value: single.value,
                before_um: taken.clone().next().map(|(_, taken)| taken.before),
                schemes: taken.map(takes).collect(),
            }
        };
        Self {
            machine: &machine.name,
            zero_at,
            policy: policy.into(),
            tolerance_um: 1e3 * options.tables.tolerance,
            single: found.iter().map(one).collect(),
            schemes: names,
            reasons,
        }
    }
}
