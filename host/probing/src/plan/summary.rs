//! What a plan promises, for programs: `trueaxis plan --json`.

use super::band::UncertaintySpread;
use super::candidates::Setup;
use super::compare::Ratios;
use super::remedy::added;
use super::sets::SetPositions;
use super::task::Planned;
use serde::Serialize;
use trueaxis_model::explain::MinimalParameters;

/// Coverage factor of expanded uncertainties: 95 %.
const EXPANDED: f64 = 2.0;

/// The figures of a plan. Parameters are in mm, rad, and per mm or rad to the power of their degree; other names state
/// their units.
#[derive(Clone, Debug, Serialize)]
pub struct Summary<'a> {
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
    parameters: Vec<ExpectedParameter>,
    tip_um: SpreadOverTravel,
    direction_urad: SpreadOverTravel,
    unseen: Vec<NotForeseen>,
    unreachable: Vec<NotReached>,
    /// Probings of a named position set that are not reachable.
    left_out: Vec<UnreachedProbing>,
    compared: Option<ComparedPlan>,
    /// Location errors that the model cannot compensate for.
    missing: Vec<String>,
}

#[derive(Clone, Debug, Serialize)]
struct ExpectedParameter {
    parameter: String,
    standard_uncertainty: f64,
    expanded_uncertainty: f64,
}

/// Standard uncertainty over the travel.
#[derive(Clone, Debug, Serialize)]
struct SpreadOverTravel {
    mean: f64,
    percentile_95: f64,
    largest: f64,
}

impl SpreadOverTravel {
    fn new(spread: &UncertaintySpread, scale: f64) -> Self {
        Self {
            mean: spread.mean * scale,
            percentile_95: spread.most_of * scale,
            largest: spread.largest * scale,
        }
    }
}

#[derive(Clone, Debug, Serialize)]
struct NotForeseen {
    unknown: String,
    sentence: String,
    /// A probing that would identify it.
    add: Option<String>,
}

#[derive(Clone, Debug, Serialize)]
struct NotReached {
    line: usize,
    reason: String,
}

#[derive(Clone, Debug, Serialize)]
struct UnreachedProbing {
    ball: String,
    reason: String,
}

#[derive(Clone, Debug, Serialize)]
struct ComparedPlan {
    probings: usize,
    tip_um: SpreadOverTravel,
    direction_urad: SpreadOverTravel,
    parameter: Option<(String, f64)>,
}

impl<'a> Summary<'a> {
    /// Of a plan whose probings take so many minutes, from a position set if there is one.
    #[must_use]
    pub fn new(
        setup: &Setup<'a>,
        planned: &'a Planned,
        minutes: f64,
        set: Option<&SetPositions>,
    ) -> Self {
        let machine = setup.machine;
        let judgement = &planned.judgement;
        let [observations, setups] = setup.observed();
        let minimal = MinimalParameters::of(machine);
        let foreseen = &judgement.foreseen;
        let parameters = foreseen.parameters.iter().zip(foreseen.uncertainties());
        let balls = &judgement.plan.balls;
        let left_out = set.iter().flat_map(|set| &set.left_out);
        Self {
            machine: &machine.name,
            probings: judgement.plan.rows.len(),
            balls,
            observations,
            setups,
            minutes,
            unknowns: foreseen.unknowns,
            rank: foreseen.rank,
            condition: foreseen.condition,
            independent_constants: minimal.all(),
            location_errors: minimal.locations(),
            parameters: (parameters.map(|(parameter, uncertainty)| ExpectedParameter {
                parameter: parameter.to_string(),
                standard_uncertainty: uncertainty,
                expanded_uncertainty: EXPANDED * uncertainty,
            }))
            .collect(),
            tip_um: SpreadOverTravel::new(&judgement.tip, 1e3),
            direction_urad: SpreadOverTravel::new(&judgement.direction, 1e6),
            unseen: (foreseen.unseen.iter())
                .map(|u| NotForeseen {
                    unknown: u.unknown.to_string(),
                    sentence: u.sentence(),
                    add: added(machine, balls, u.unknown, &judgement.remedies),
                })
                .collect(),
            unreachable: (judgement.unreachable.iter())
                .map(|(row, reason)| NotReached {
                    line: row.line,
                    reason: reason.to_string(),
                })
                .collect(),
            left_out: left_out
                .map(|(ball, _, reason)| UnreachedProbing {
                    ball: ball.clone(),
                    reason: reason.to_string(),
                })
                .collect(),
            missing: planned.missing.iter().map(ToString::to_string).collect(),
            compared: planned.other.as_ref().map(|other| ComparedPlan {
                probings: other.plan.rows.len(),
                tip_um: SpreadOverTravel::new(&other.tip, 1e3),
                direction_urad: SpreadOverTravel::new(&other.direction, 1e6),
                parameter: (Ratios::of(judgement, other).parameter)
                    .map(|(parameter, ratio)| (parameter.to_string(), ratio)),
            }),
        }
    }
}
