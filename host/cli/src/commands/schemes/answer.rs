//! Output of `trueaxis schemes`, as text and as JSON.

use crate::commands::screen::{self, number};
use serde::Serialize;
use std::collections::BTreeMap;
use trueaxis_measure::compare::{ComparedScheme, SchemeFigures};
use trueaxis_measure::identify::Compensated;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Options, Size};
use trueaxis_tables::policy::{PolicyName, stored};
use trueaxis_tables::validate::{Quality, Verification};

/// All results.
#[derive(Serialize)]
pub struct SchemesAnswer<'a> {
    machine: &'a str,
    zero_at: Option<&'a str>,
    #[serde(flatten)]
    policy: PolicyName,
    #[serde(skip)]
    stored: trueaxis::Policy,
    tolerance_um: f64,
    target: &'a str,
    /// Without a compensation, over the whole travel.
    before: Option<&'a Quality>,
    schemes: Vec<SchemeRow<'a>>,
}

/// One scheme.
#[derive(Serialize)]
struct SchemeRow<'a> {
    scheme: &'a str,
    #[serde(flatten)]
    figures: Option<SchemeTakes<'a>>,
    /// Why it does not support this machine, and what would.
    reason: Option<String>,
    remedy: Option<&'static str>,
}

#[derive(Serialize)]
struct SchemeTakes<'a> {
    #[serde(flatten)]
    size: Size,
    instructions: f64,
    /// Over the whole travel.
    after: &'a Quality,
    /// Difference of the tables from the kinematic correction where the tolerance applies.
    difference_um: f64,
    difference_urad: f64,
    meets_tolerance: bool,
    /// The rotary positions for which alone it is made, and its quality there.
    held: Option<&'a trueaxis_tables::compile::Held>,
    notes: &'a [String],
    /// The removed share of each parameter: 1 if it is removed completely.
    compensability: BTreeMap<String, Option<f64>>,
    /// Why `compensability` is empty.
    no_compensability: Option<String>,
}

impl<'a> SchemesAnswer<'a> {
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
            stored: policy,
            tolerance_um,
            target: &options.tables.target.name,
            before: found.map(|figures| &figures.compiled.verification.travel.before),
            schemes: compared
                .iter()
                .map(|one| SchemeRow::new(one, tolerance_um))
                .collect(),
        }
    }

    /// Three tables: the resources of each scheme, its quality, and what it leaves of each parameter.
    pub fn screen(&self) -> String {
        let mut text = format!("{}, for {}\n", self.machine, self.target);
        text += &screen::zero(self.zero_at);
        text += &screen::policy(self.stored);
        let able = || {
            let all = self.schemes.iter();
            all.filter_map(|one| Some((one.scheme, one.figures.as_ref()?)))
        };
        text += &format!(
            "\n{:<14}{:>8}{:>8}{:>8}{:>10}{:>10}{:>14}\n",
            "scheme", "tables", "terms", "grids", "samples", "bytes", "instructions"
        );
        for (name, figures) in able() {
            let size = &figures.size;
            text += &format!(
                "{name:<14}{:>8}{:>8}{:>8}{:>10}{:>10}{:>14.0}\n",
                size.tables, size.terms, size.grids, size.samples, size.bytes, figures.instructions
            );
        }
        self.quality(&mut text, able());
        Self::gone(&mut text, &able().collect::<Vec<_>>());
        let remarks: Vec<String> = self.schemes.iter().flat_map(SchemeRow::remarks).collect();
        if !remarks.is_empty() {
            text += &format!("\n{}\n", remarks.join("\n"));
        }
        text
    }

    fn quality<'b>(
        &self,
        text: &mut String,
        able: impl Iterator<Item = (&'b str, &'b SchemeTakes<'b>)>,
    ) {
        *text += &format!(
            "\n{:<14}{:>27}{:>29}{:>20}\n",
            "whole travel", "translation (µm)", "tool direction (µrad)", "from the correction"
        );
        let heads = format!("{:>9}{:>9}{:>9}", "mean", "rms", "max");
        *text += &format!("{:14}{heads}  {heads}{:>10}{:>10}\n", "", "µm", "µrad");
        if let Some(before) = self.before {
            *text += &format!("{:<14}{}\n", "none", row(before));
        }
        for (name, figures) in able {
            *text += &format!(
                "{name:<14}{}{:>10}{:>10}\n",
                row(figures.after),
                number(figures.difference_um),
                number(figures.difference_urad)
            );
        }
    }

    /// The removed share of each parameter.
    fn gone(text: &mut String, able: &[(&str, &SchemeTakes<'_>)]) {
        let mut parameters: Vec<&String> = able
            .iter()
            .flat_map(|(_, figures)| figures.compensability.keys())
            .collect();
        parameters.sort();
        parameters.dedup();
        if !parameters.is_empty() {
            let names: String = able.iter().map(|(name, _)| format!("{name:>14}")).collect();
            *text += &format!("\n{:<14}{names}\n", "compensability");
        }
        for parameter in parameters {
            let shown = |figures: &SchemeTakes<'_>| {
                let part = figures.compensability.get(parameter).copied().flatten();
                part.map_or("-".to_owned(), |part| format!("{:.2} %", 100.0 * part))
            };
            let parts: String = (able.iter())
                .map(|(_, figures)| format!("{:>14}", shown(figures)))
                .collect();
            *text += &format!("{parameter:<14}{parts}\n");
        }
        let mut reasons: Vec<&String> = able
            .iter()
            .filter_map(|(_, figures)| figures.no_compensability.as_ref())
            .collect();
        reasons.dedup();
        for reason in reasons {
            *text += &format!("\nno compensability: {reason}\n");
        }
    }
}

impl<'a> SchemeRow<'a> {
    fn new(compared: &'a ComparedScheme, tolerance_um: f64) -> Self {
        let found = compared.found.as_ref();
        Self {
            scheme: &compared.scheme,
            figures: found
                .ok()
                .map(|figures| SchemeTakes::new(figures, tolerance_um)),
            reason: found.err().map(ToString::to_string),
            remedy: found.err().map(|error| error.remedy()),
        }
    }

    /// Remarks that do not fit into the tables, one line each.
    fn remarks(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if let (Some(reason), Some(remedy)) = (&self.reason, self.remedy) {
            lines.push(format!("cannot do this machine: {reason} ({remedy})"));
        }
        if let Some(figures) = &self.figures {
            lines.extend(figures.notes.iter().cloned());
            if let Some(held) = figures.held {
                let after = &held.found.after.translation_um;
                let axes = held.axes.iter();
                let axes: Vec<String> = axes.map(|(axis, q)| format!("{axis} = {q}")).collect();
                lines.push(format!(
                    "at {} the remaining error is {} µm in the mean and {} µm at most; its distance from the correction is that there",
                    axes.join(", "),
                    number(after.mean),
                    number(after.max)
                ));
            }
        }
        let named = lines.into_iter();
        named
            .map(|line| format!("{}: {line}", self.scheme))
            .collect()
    }
}

impl<'a> SchemeTakes<'a> {
    fn new(figures: &'a SchemeFigures, tolerance_um: f64) -> Self {
        let verification = &figures.compiled.verification;
        let inside: &Verification = verification.inside();
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

fn row(quality: &Quality) -> String {
    let three = |s: &trueaxis_tables::validate::Statistics| {
        let values = [s.mean, s.rms, s.max].map(number);
        format!("{:>9}{:>9}{:>9}", values[0], values[1], values[2])
    };
    format!(
        "{}  {}",
        three(&quality.translation_um),
        three(&quality.direction_urad)
    )
}
