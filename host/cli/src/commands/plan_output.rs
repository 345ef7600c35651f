//! Output of `trueaxis plan`.

use super::quantity::{EXPANDED, count, shown};
use super::unidentifiable;
use serde::Serialize;
use trueaxis_measure::formats::probings::{Probing, Probings};
use trueaxis_measure::identify::Unknown;
use trueaxis_measure::plan::{Judgement, Ratios, Setup, Spread, Unreachable, added};
use trueaxis_model::errors::Parameter;
use trueaxis_model::explain::MinimalParameters;

/// The results as JSON. Parameters are in mm, rad, and per mm or rad to the power of their degree; other names state
/// their units.
#[derive(Serialize)]
pub struct Answer<'a> {
    machine: &'a str,
    probings: usize,
    balls: &'a [String],
    observations: usize,
    setups: usize,
    minutes: f64,
    unknowns: usize,
    rank: usize,
    condition: f64,
    independent_constants: usize,
    location_errors: usize,
    parameters: Vec<One>,
    tip_um: Over,
    direction_urad: Over,
    unseen: Vec<NotSeen>,
    unreachable: Vec<NotReached>,
    /// Probings of a named position set that are not reachable.
    left_out: Vec<LeftOut>,
    compared: Option<Compared>,
    /// Location errors that the model cannot compensate for.
    missing: Vec<String>,
}

#[derive(Serialize)]
struct One {
    parameter: String,
    standard_uncertainty: f64,
    expanded_uncertainty: f64,
}

/// Standard uncertainty over the travel.
#[derive(Serialize)]
struct Over {
    mean: f64,
    percentile_95: f64,
    largest: f64,
}

#[derive(Serialize)]
struct NotSeen {
    unknown: String,
    sentence: String,
    /// A probing that would identify it.
    add: Option<String>,
}

#[derive(Serialize)]
struct NotReached {
    line: usize,
    reason: String,
}

#[derive(Serialize)]
struct LeftOut {
    ball: String,
    reason: String,
}

#[derive(Serialize)]
struct Compared {
    probings: usize,
    tip_um: Over,
    direction_urad: Over,
    parameter: Option<(String, f64)>,
}

impl Over {
    fn new(spread: &Spread, scale: f64) -> Self {
        Self {
            mean: spread.mean * scale,
            percentile_95: spread.most_of * scale,
            largest: spread.largest * scale,
        }
    }
}

impl Answer<'_> {
    /// Adds the location errors that the model cannot compensate for.
    pub fn lacking(mut self, missing: &[Parameter]) -> Self {
        self.missing = missing.iter().map(Parameter::to_string).collect();
        self
    }

    /// Adds the probings that were left out of a position set.
    pub fn leaving_out(mut self, rows: &[(String, Probing, Unreachable)]) -> Self {
        let one = |(ball, _, reason): &(String, Probing, Unreachable)| LeftOut {
            ball: ball.clone(),
            reason: reason.to_string(),
        };
        self.left_out = rows.iter().map(one).collect();
        self
    }
}

impl<'a> Answer<'a> {
    pub fn new(
        setup: &Setup<'a>,
        judgement: &'a Judgement,
        other: Option<&Judgement>,
        minutes: f64,
    ) -> Self {
        let machine = setup.machine;
        let [observations, setups] = observed(setup);
        let minimal = MinimalParameters::of(machine);
        let foreseen = &judgement.foreseen;
        let parameters = foreseen.parameters.iter().zip(foreseen.uncertainties());
        let add = |unknown: &Unknown| {
            let balls = &judgement.strategy.balls;
            added(machine, balls, *unknown, &judgement.remedies)
        };
        Self {
            machine: &machine.name,
            probings: judgement.strategy.rows.len(),
            balls: &judgement.strategy.balls,
            observations,
            setups,
            minutes,
            unknowns: foreseen.unknowns,
            rank: foreseen.rank,
            condition: foreseen.condition,
            independent_constants: minimal.all(),
            location_errors: minimal.locations(),
            parameters: (parameters.map(|(parameter, uncertainty)| One {
                parameter: parameter.to_string(),
                standard_uncertainty: uncertainty,
                expanded_uncertainty: EXPANDED * uncertainty,
            }))
            .collect(),
            tip_um: Over::new(&judgement.tip, 1e3),
            direction_urad: Over::new(&judgement.direction, 1e6),
            unseen: (foreseen.unseen.iter())
                .map(|u| NotSeen {
                    unknown: u.unknown.to_string(),
                    sentence: u.sentence(),
                    add: add(&u.unknown),
                })
                .collect(),
            unreachable: (judgement.unreachable.iter())
                .map(|(row, reason)| NotReached {
                    line: row.line,
                    reason: reason.to_string(),
                })
                .collect(),
            left_out: Vec::new(),
            missing: Vec::new(),
            compared: other.map(|other| Compared {
                probings: other.strategy.rows.len(),
                tip_um: Over::new(&other.tip, 1e3),
                direction_urad: Over::new(&other.direction, 1e6),
                parameter: (Ratios::of(judgement, other).parameter)
                    .map(|(parameter, ratio)| (parameter.to_string(), ratio)),
            }),
        }
    }
}

/// Numbers of observations and of their set-ups.
fn observed(setup: &Setup<'_>) -> [usize; 2] {
    setup.observations.map_or([0; 2], |observations| {
        [observations.rows.len(), observations.setups.len()]
    })
}

/// How much is measured, in words.
fn counted(setup: &Setup<'_>, strategy: &Probings, minutes: f64) -> String {
    let [observations, setups] = observed(setup);
    let mut parts = Vec::new();
    if observations == 0 || !strategy.rows.is_empty() {
        let balls = count(strategy.balls.len(), "ball");
        let probings = count(strategy.rows.len(), "probing");
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
pub fn screen(
    setup: &Setup<'_>,
    judgement: &Judgement,
    other: Option<&Judgement>,
    minutes: f64,
) -> String {
    let (strategy, foreseen) = (&judgement.strategy, &judgement.foreseen);
    let machine = setup.machine;
    let mut text = format!(
        "{}: {}\nrank {} of {}, condition {:.0}\n{}\n\n",
        machine.name,
        counted(setup, strategy, minutes),
        foreseen.rank,
        foreseen.unknowns,
        foreseen.condition,
        MinimalParameters::of(machine)
    );
    parameters(&mut text, judgement, other);
    let spread = |text: &mut String, name: &str, [one, two]: [Option<&Spread>; 2], scale: f64| {
        *text += &format!("  {name:<17}");
        for (spread, first) in [(one, 9), (two, 15)] {
            if let Some(spread) = spread {
                let [mean, most_of, largest] =
                    [spread.mean, spread.most_of, spread.largest].map(|v| v * scale);
                *text += &format!("{mean:>first$.2}{most_of:>9.2}{largest:>9.2}");
            }
        }
        text.push('\n');
    };
    text += "\nstandard over travel     mean     95 %  largest";
    if other.is_some() {
        text += "    other: mean     95 %  largest";
    }
    text.push('\n');
    spread(
        &mut text,
        "tip (µm)",
        [Some(&judgement.tip), other.map(|o| &o.tip)],
        1e3,
    );
    let directions = [Some(&judgement.direction), other.map(|o| &o.direction)];
    spread(&mut text, "direction (µrad)", directions, 1e6);
    unidentifiable::lines(
        &mut text,
        "by this strategy",
        machine,
        &strategy.balls,
        &foreseen.unseen,
        &judgement.remedies,
    );
    if !judgement.unreachable.is_empty() {
        text += "\nrows that cannot be touched so\n";
        for (row, reason) in judgement.unreachable.iter().take(NAMED) {
            let ball = &strategy.balls[row.ball];
            text += &format!("  line {}: ball {ball}: {reason}\n", row.line);
        }
        more(&mut text, judgement.unreachable.len());
    }
    text
}

fn parameters(text: &mut String, judgement: &Judgement, other: Option<&Judgement>) {
    let there: Vec<(Parameter, f64)> = other.map_or(Vec::new(), |other| {
        let known = other.foreseen.parameters.iter().copied();
        known.zip(other.foreseen.uncertainties()).collect()
    });
    *text += "parameter     standard   expanded (k = 2)";
    if let Some(other) = other {
        *text += &format!("   standard with the other {}", other.strategy.rows.len());
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
