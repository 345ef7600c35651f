//! Output of `trueaxis plan`.

use super::quantity::{EXPANDED, count, shown};
use super::unidentifiable;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::errors::Parameter;
use trueaxis_model::explain::MinimalParameters;
use trueaxis_probing::plan::{Judgement, Planned, Setup, UncertaintySpread};

/// How much is measured, in words.
fn counted(setup: &Setup<'_>, plan: &Probings, minutes: f64) -> String {
    let [observations, setups] = setup.observed();
    let mut parts = Vec::new();
    if observations == 0 || !plan.rows.is_empty() {
        let balls = count(plan.balls.len(), "ball");
        let probings = count(plan.rows.len(), "probing");
        parts.push(format!("{probings} of {balls}, {minutes:.0} min"));
    }
    if observations > 0 {
        let rows = count(observations, "observation");
        parts.push(format!("{rows} with {}", count(setups, "set-up")));
    }
    parts.join(", and ")
}

/// Largest number of rows listed.
const NAMED: usize = 10;

/// The text output.
pub fn screen(setup: &Setup<'_>, planned: &Planned, minutes: f64) -> String {
    let (judgement, other) = (&planned.judgement, planned.other.as_ref());
    let (plan, foreseen) = (&judgement.plan, &judgement.foreseen);
    let machine = setup.machine;
    let mut text = format!(
        "{}: {}\nrank {} of {}, condition {:.0}\n{}\n\n",
        machine.name,
        counted(setup, plan, minutes),
        foreseen.rank,
        foreseen.unknowns,
        foreseen.condition,
        MinimalParameters::of(machine)
    );
    parameters(&mut text, judgement, other);
    over_travel(&mut text, judgement, other);
    unidentifiable::lines(
        &mut text,
        "by this plan",
        machine,
        &plan.balls,
        &foreseen.unseen,
        &judgement.remedies,
    );
    if !judgement.unreachable.is_empty() {
        text += "\nrows that cannot be touched so\n";
        for (row, reason) in judgement.unreachable.iter().take(NAMED) {
            let ball = &plan.balls[row.ball];
            text += &format!("  line {}: ball {ball}: {reason}\n", row.line);
        }
        more(&mut text, judgement.unreachable.len());
    }
    text
}

/// The standard uncertainty of tip and direction over the travel.
fn over_travel(text: &mut String, judgement: &Judgement, other: Option<&Judgement>) {
    *text += "\nstandard over travel     mean     95 %  largest";
    if other.is_some() {
        *text += "    other: mean     95 %  largest";
    }
    text.push('\n');
    type SpreadOf = fn(&Judgement) -> &UncertaintySpread;
    let rows: [(&str, SpreadOf, f64); 2] = [
        ("tip (µm)", |j| &j.tip, 1e3),
        ("direction (µrad)", |j| &j.direction, 1e6),
    ];
    for (name, spread, scale) in rows {
        *text += &format!("  {name:<17}");
        for (judgement, first) in [(Some(judgement), 9), (other, 15)] {
            if let Some(spread) = judgement.map(spread) {
                let [mean, most_of, largest] =
                    [spread.mean, spread.most_of, spread.largest].map(|v| v * scale);
                *text += &format!("{mean:>first$.2}{most_of:>9.2}{largest:>9.2}");
            }
        }
        text.push('\n');
    }
}

fn parameters(text: &mut String, judgement: &Judgement, other: Option<&Judgement>) {
    let there: Vec<(Parameter, f64)> = other.map_or(Vec::new(), |other| {
        let known = other.foreseen.parameters.iter().copied();
        known.zip(other.foreseen.uncertainties()).collect()
    });
    *text += "parameter     standard   expanded (k = 2)";
    if let Some(other) = other {
        *text += &format!("   standard with the other {}", other.plan.rows.len());
    }
    text.push('\n');
    let foreseen = &judgement.foreseen;
    for (parameter, uncertainty) in foreseen.parameters.iter().zip(foreseen.uncertainties()) {
        let (show, unit) = shown(*parameter);
        *text += &format!(
            "  {:<9}{:>11}{:>11}",
            parameter.to_string(),
            show(uncertainty),
            show(EXPANDED * uncertainty)
        );
        if other.is_some() {
            let found = there.iter().find(|(p, _)| p == parameter);
            *text += &format!("{:>11}", found.map_or("-".to_owned(), |(_, u)| show(*u)));
        }
        *text += &format!(" {unit}\n");
    }
}

fn more(text: &mut String, count: usize) {
    if count > NAMED {
        *text += &format!("  and {} more\n", count - NAMED);
    }
}
