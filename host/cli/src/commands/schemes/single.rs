//! Output of `trueaxis schemes --single`.

use crate::commands::screen::{self, number};
use serde::Serialize;
use std::collections::BTreeMap;
use trueaxis_measure::compare::{SingleError, TablesTaken};
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::Options;
use trueaxis_tables::policy::{PolicyName, stored};
use trueaxis_tables::schemes::Scheme;

/// The schemes that can correct a single error completely.
pub fn schemes() -> Vec<Scheme> {
    let adjustable = Vec::new();
    vec![Scheme::default(), Scheme::Fik { adjustable }]
}

/// What each error parameter takes by itself.
#[derive(Serialize)]
pub struct SinglesAnswer<'a> {
    machine: &'a str,
    zero_at: Option<&'a str>,
    #[serde(flatten)]
    policy: PolicyName,
    #[serde(skip)]
    stored: trueaxis::Policy,
    tolerance_um: f64,
    #[serde(skip)]
    schemes: Vec<String>,
    single: Vec<SingleRow>,
    /// Why a scheme does not support the machine.
    reasons: BTreeMap<String, String>,
}

#[derive(Serialize)]
struct SingleRow {
    parameter: String,
    /// mm, rad, per mm or rad to its degree.
    value: f64,
    /// Mean displacement of the tip over the travel without a compensation.
    before_um: Option<f64>,
    /// By the name of the scheme.
    schemes: BTreeMap<String, SingleTakes>,
}

#[derive(Serialize)]
struct SingleTakes {
    tables: usize,
    terms: usize,
    /// Largest displacement of the tip with these tables.
    largest_after_um: f64,
}

impl<'a> SinglesAnswer<'a> {
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
                let takes = SingleTakes {
                    tables: taken.tables,
                    terms: taken.terms,
                    largest_after_um: taken.left,
                };
                (name.clone(), takes)
            };
            SingleRow {
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
            stored: policy,
            tolerance_um: 1e3 * options.tables.tolerance,
            single: found.iter().map(one).collect(),
            schemes: names,
            reasons,
        }
    }

    /// A line for each parameter.
    pub fn screen(&self) -> String {
        let mut text = format!("{}, each error by itself\n", self.machine);
        text += &screen::zero(self.zero_at);
        text += &screen::policy(self.stored);
        let names: String = (self.schemes.iter())
            .map(|name| format!("{name:>28}"))
            .collect();
        text += &format!("\n{:<10}{:>10}{names}\n", "", "before");
        let heads = format!("{:>10}{:>7}{:>11}", "tables", "terms", "left");
        text += &format!(
            "{:<10}{:>10}{}\n",
            "",
            "mean (µm)",
            heads.repeat(self.schemes.len())
        );
        for one in &self.single {
            let before = one.before_um.map_or("-".to_owned(), number);
            text += &format!("{:<10}{before:>10}", one.parameter);
            for name in &self.schemes {
                text += &match one.schemes.get(name) {
                    Some(takes) => format!(
                        "{:>10}{:>7}{:>11}",
                        takes.tables,
                        takes.terms,
                        number(takes.largest_after_um)
                    ),
                    None => format!("{:>10}{:>7}{:>11}", "-", "-", "-"),
                };
            }
            text += "\n";
        }
        text += "\nleft: largest displacement of the tip over the travel (µm)\n";
        for (name, reason) in &self.reasons {
            text += &format!("{name}: {reason}\n");
        }
        text
    }
}
