//! What `trueaxis schemes` shows on the screen.

use crate::commands::screen::{self, number};
use trueaxis::Policy;
use trueaxis_model::validate::Quality;
use trueaxis_report::scheme_comparison::{
    ComparisonRecord, SchemeCost, SchemeRecord, SinglesRecord,
};

/// Three tables: the resources of each scheme, its quality, and what it leaves of each parameter.
pub fn comparison(found: &ComparisonRecord, policy: Policy) -> String {
    let mut text = format!("{}, for {}\n", found.machine, found.target);
    text += &screen::zero(found.zero_at.as_deref());
    text += &screen::policy(policy);
    let able = || {
        let all = found.schemes.iter();
        all.filter_map(|one| Some((one.scheme.as_str(), one.figures.as_ref()?)))
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
    quality(&mut text, found.before.as_ref(), able());
    gone(&mut text, &able().collect::<Vec<_>>());
    let remarks: Vec<String> = found.schemes.iter().flat_map(remarks).collect();
    if !remarks.is_empty() {
        text += &format!("\n{}\n", remarks.join("\n"));
    }
    text
}

fn quality<'b>(
    text: &mut String,
    before: Option<&Quality>,
    able: impl Iterator<Item = (&'b str, &'b SchemeCost)>,
) {
    *text += &format!(
        "\n{:<14}{:>27}{:>29}{:>20}\n",
        "whole travel", "translation (µm)", "tool direction (µrad)", "from the correction"
    );
    let heads = format!("{:>9}{:>9}{:>9}", "mean", "rms", "max");
    *text += &format!("{:14}{heads}  {heads}{:>10}{:>10}\n", "", "µm", "µrad");
    if let Some(before) = before {
        *text += &format!("{:<14}{}\n", "none", row(before));
    }
    for (name, figures) in able {
        *text += &format!(
            "{name:<14}{}{:>10}{:>10}\n",
            row(&figures.after),
            number(figures.difference_um),
            number(figures.difference_urad)
        );
    }
}

/// The removed share of each parameter.
fn gone(text: &mut String, able: &[(&str, &SchemeCost)]) {
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
        let shown = |figures: &SchemeCost| {
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

/// Remarks that do not fit into the tables, one line each.
fn remarks(scheme: &SchemeRecord) -> Vec<String> {
    let mut lines = Vec::new();
    if let (Some(reason), Some(remedy)) = (&scheme.reason, scheme.remedy) {
        lines.push(format!("cannot do this machine: {reason} ({remedy})"));
    }
    if let Some(figures) = &scheme.figures {
        lines.extend(figures.notes.iter().cloned());
        if let Some(held) = &figures.held {
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
        .map(|line| format!("{}: {line}", scheme.scheme))
        .collect()
}

fn row(quality: &Quality) -> String {
    let three = |s: &trueaxis_model::validate::Statistics| {
        let values = [s.mean, s.rms, s.max].map(number);
        format!("{:>9}{:>9}{:>9}", values[0], values[1], values[2])
    };
    format!(
        "{}  {}",
        three(&quality.translation_um),
        three(&quality.direction_urad)
    )
}

/// A line for each parameter.
pub fn singles(found: &SinglesRecord, policy: Policy) -> String {
    let mut text = format!("{}, each error by itself\n", found.machine);
    text += &screen::zero(found.zero_at.as_deref());
    text += &screen::policy(policy);
    let names: String = (found.schemes.iter())
        .map(|name| format!("{name:>28}"))
        .collect();
    text += &format!("\n{:<10}{:>10}{names}\n", "", "before");
    let heads = format!("{:>10}{:>7}{:>11}", "tables", "terms", "left");
    text += &format!(
        "{:<10}{:>10}{}\n",
        "",
        "mean (µm)",
        heads.repeat(found.schemes.len())
    );
    for one in &found.single {
        let before = one.before_um.map_or("-".to_owned(), number);
        text += &format!("{:<10}{before:>10}", one.parameter);
        for name in &found.schemes {
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
    for (name, reason) in &found.reasons {
        text += &format!("{name}: {reason}\n");
    }
    text
}
