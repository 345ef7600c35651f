//! Output of `trueaxis identify --json`.

use super::super::quantity::EXPANDED;
use super::super::unidentifiable::added;
use super::Found;
use super::compensability::Gone;
use super::listed::Listed;
use super::observed::Observed;
use super::screen::correlated;
use super::thermal::Temperatures;
use nalgebra::Vector3;
use serde::Serialize;
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::{Along, BarCheck, Checked, Estimated, Level, Unseen};
use trueaxis_model::machine::Machine;
use trueaxis_report::Probed;

/// The results as JSON. Parameters are in mm, rad, and per mm or rad to the power of their degree; other names state
/// their units.
#[derive(Serialize)]
pub struct Answer<'a> {
    machine: &'a str,
    probings: usize,
    probed: Vec<Probed>,
    balls: Vec<Ball<'a>>,
    stylus_mm: [f64; 3],
    parameters: Vec<One>,
    correlations: Vec<(String, String, f64)>,
    covariance: Vec<Vec<f64>>,
    bars: Vec<Bar<'a>>,
    /// Readings of instruments, and drift.
    #[serde(skip_serializing_if = "Option::is_none")]
    observed: Option<Observed<'a>>,
    /// What temperatures explain (`--temperatures`).
    #[serde(skip_serializing_if = "Option::is_none")]
    temperatures: Option<Temperatures>,
    /// Comparison with the errors before a compensation (`--before`).
    compensated: Option<Gone>,
    unseen: Vec<NotSeen>,
    noise_um: f64,
    noise_of_stated: Option<f64>,
    /// Standard deviation of a coordinate of the tip by errors that the model lacks, in the probed zone.
    misfit_um: Option<f64>,
    /// The same of a component of the tool's direction.
    misfit_urad: Option<f64>,
    /// Sources whose residuals exceed what they state, beyond chance.
    refuted: Vec<&'static str>,
    degrees_of_freedom: usize,
    condition: f64,
    levels: Vec<AtLevel>,
    /// For `auto`: the list published for machines of this layout.
    published: Option<Listed>,
    /// Prediction of balls that were left out, or the reason why it could not be computed.
    held_out: Option<Predicted<'a>>,
    not_held_out: Option<String>,
    left_um: [f64; 3],
    checks: Vec<Check>,
    repeats: Option<Repeated>,
    places: Vec<Place<'a>>,
    suspected: Vec<Suspected<'a>>,
    rows: Vec<AtRow>,
}

/// A ball or the stylus, found and as stated.
#[derive(Serialize)]
struct Place<'a> {
    what: &'a str,
    found_mm: [f64; 3],
    stated_mm: Option<[f64; 3]>,
}

/// Rows that do not fit the others.
#[derive(Serialize)]
struct Suspected<'a> {
    sentence: &'a str,
    is_group: bool,
    lines: Vec<usize>,
}

#[derive(Serialize)]
struct Ball<'a> {
    name: &'a str,
    place_mm: [f64; 3],
    probings: usize,
    left_um: f64,
    most_um: f64,
}

/// A bar, with its length according to the machine and the other bars.
#[derive(Serialize)]
struct Bar<'a> {
    balls: &'a [String; 2],
    length_mm: f64,
    standard_uncertainty_mm: f64,
    others_mm: Option<f64>,
    others_standard_uncertainty_mm: Option<f64>,
    normalised: Option<f64>,
    is_doubtful: bool,
}

/// Prediction of a ball by models that were fitted without it.
#[derive(Serialize)]
struct Predicted<'a> {
    rms_um: f64,
    balls: Vec<(&'a str, f64)>,
}

/// Whether the residuals depend on something.
#[derive(Serialize)]
struct Check {
    along: &'static str,
    axis: Option<char>,
    run: Option<f64>,
    /// In s or K.
    over: Option<f64>,
    change_um: Option<[f64; 3]>,
    standard_uncertainty_um: Option<[f64; 3]>,
    is_significant: bool,
}

#[derive(Serialize)]
struct Repeated {
    places: usize,
    degrees_of_freedom: usize,
    pooled_standard_deviation_um: f64,
    ratio: f64,
    is_less: bool,
}

#[derive(Serialize)]
struct One {
    parameter: String,
    value: f64,
    standard_uncertainty: f64,
    expanded_uncertainty: f64,
}

#[derive(Serialize)]
struct NotSeen {
    unknown: String,
    sentence: String,
    /// The errors of other parameters per unit of this one.
    with: Vec<(String, f64)>,
    /// A probing that would identify it.
    add: Option<String>,
}

#[derive(Serialize)]
struct AtLevel {
    model: String,
    parameters: Option<usize>,
    unseen: Option<usize>,
    left_um: Option<f64>,
    elsewhere_um: Option<f64>,
    /// Why there is no such model.
    error: Option<String>,
}

#[derive(Serialize)]
struct AtRow {
    line: usize,
    run: Option<f64>,
    time_s: Option<f64>,
    #[serde(rename = "temperature_C")]
    temperature: Option<f64>,
    before_um: [f64; 3],
    after_um: [f64; 3],
    is_trusted: bool,
}

impl<'a> Answer<'a> {
    pub fn new(found: &'a Found<'_>) -> Self {
        let Found {
            machine,
            measured,
            identified,
            levels,
            published,
            compared,
            honesty,
            held_out,
            ..
        } = found;
        let name = |i: usize| identified.parameters[i].parameter.to_string();
        let covariance = identified.covariance.row_iter();
        let lines = |rows: &[usize]| rows.iter().map(|i| measured.rows[*i].line).collect();
        let is_suspected = |row: usize| found.is_suspected(row);
        Self {
            machine: &machine.name,
            probings: measured.rows.len(),
            probed: probed(machine, measured, found.observations),
            balls: (honesty.balls.iter().zip(&identified.balls))
                .map(|(ball, place)| Ball {
                    name: &ball.name,
                    place_mm: (*place).into(),
                    probings: ball.rows,
                    left_um: ball.rms * 1e3,
                    most_um: ball.max * 1e3,
                })
                .collect(),
            stylus_mm: identified.stylus.into(),
            parameters: identified.parameters.iter().map(One::new).collect(),
            correlations: correlated(identified)
                .into_iter()
                .map(|(i, j, r)| (name(i), name(j), r))
                .collect(),
            covariance: covariance
                .map(|row| row.iter().copied().collect())
                .collect(),
            bars: identified.bars.iter().map(Bar::new).collect(),
            observed: Observed::new(found),
            temperatures: Temperatures::of(found),
            compensated: compared.as_ref().map(Gone::new),
            unseen: (identified.unseen.iter())
                .map(|unseen| NotSeen::new(unseen, found))
                .collect(),
            noise_um: identified.noise * 1e3,
            noise_of_stated: identified.of_stated,
            misfit_um: found.not_known.misfit.map(|misfit| misfit * 1e3),
            misfit_urad: found.not_known.misfit_of_direction.map(|urad| urad * 1e6),
            refuted: (identified.components.iter())
                .filter(|one| one.is_refuted)
                .map(|one| one.source.name())
                .collect(),
            degrees_of_freedom: identified.freedom,
            condition: identified.condition,
            levels: levels.iter().map(AtLevel::new).collect(),
            published: published.as_ref().map(Listed::new),
            held_out: held_out.as_ref().ok().map(|held_out| Predicted {
                rms_um: held_out.rms * 1e3,
                balls: (held_out.balls.iter())
                    .map(|(name, rms)| (name.as_str(), rms * 1e3))
                    .collect(),
            }),
            not_held_out: held_out.as_ref().err().map(ToString::to_string),
            left_um: um(honesty.coordinates),
            checks: honesty.checks.iter().map(Check::new).collect(),
            repeats: honesty.repeats.map(|repeats| Repeated {
                places: repeats.places,
                degrees_of_freedom: repeats.freedom,
                pooled_standard_deviation_um: repeats.deviation * 1e3,
                ratio: repeats.ratio,
                is_less: repeats.is_less,
            }),
            places: (found.places.iter())
                .map(|one| Place {
                    what: &one.what,
                    found_mm: one.found.into(),
                    stated_mm: one.stated.map(Into::into),
                })
                .collect(),
            suspected: (found.suspicions.iter())
                .map(|(suspicion, sentence)| Suspected {
                    sentence,
                    is_group: suspicion.is_group(),
                    lines: lines(&suspicion.rows),
                })
                .collect(),
            rows: (measured.rows.iter().zip(&identified.rows).enumerate())
                .map(|(number, (row, found))| AtRow {
                    line: row.line,
                    run: row.run,
                    time_s: row.time,
                    temperature: row.temperature,
                    before_um: um(found.before),
                    after_um: um(found.after),
                    is_trusted: found.is_trusted && !is_suspected(number),
                })
                .collect(),
        }
    }
}

/// The range that each axis covered.
fn probed(machine: &Machine, measured: &Probings, observations: &Observations) -> Vec<Probed> {
    let axes = machine.axes.iter().enumerate();
    axes.map(|(i, axis)| {
        let at = measured.rows.iter().map(|row| row.position[i]);
        let at = at.chain(observations.rows.iter().map(|row| row.position[i]));
        Probed {
            axis: axis.letter.char(),
            range: at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], q| {
                [low.min(q), high.max(q)]
            }),
        }
    })
    .collect()
}

fn um(mm: Vector3<f64>) -> [f64; 3] {
    (mm * 1e3).into()
}

impl One {
    fn new(e: &Estimated) -> Self {
        Self {
            parameter: e.parameter.to_string(),
            value: e.value,
            standard_uncertainty: e.uncertainty,
            expanded_uncertainty: EXPANDED * e.uncertainty,
        }
    }
}

impl<'a> Bar<'a> {
    fn new(bar: &'a BarCheck) -> Self {
        Self {
            balls: &bar.balls,
            length_mm: bar.length,
            standard_uncertainty_mm: bar.uncertainty,
            others_mm: bar.others.map(|others| others.length),
            others_standard_uncertainty_mm: bar.others.map(|others| others.uncertainty),
            normalised: bar.others.map(|others| others.normalised),
            is_doubtful: bar.is_doubtful(),
        }
    }
}

impl NotSeen {
    fn new(unseen: &Unseen, found: &Found<'_>) -> Self {
        let with = unseen.with.iter();
        let (balls, remedies) = (&found.measured.balls, &found.remedies);
        Self {
            unknown: unseen.unknown.to_string(),
            sentence: unseen.sentence(),
            with: with.map(|(u, part)| (u.to_string(), *part)).collect(),
            add: added(found.machine, balls, unseen.unknown, remedies),
        }
    }
}

impl AtLevel {
    fn new(level: &Level) -> Self {
        let fit = level.found.as_ref();
        let elsewhere = fit.ok().and_then(|fit| fit.elsewhere);
        Self {
            model: level.tried.to_string(),
            parameters: fit.ok().map(|fit| fit.parameters),
            unseen: fit.ok().map(|fit| fit.unseen),
            left_um: fit.ok().map(|fit| fit.left * 1e3),
            elsewhere_um: elsewhere.map(|off| off * 1e3),
            error: fit.err().map(ToString::to_string),
        }
    }
}

impl Check {
    fn new(checked: &Checked) -> Self {
        let (along, axis, run, over) = match checked.along {
            Along::Time(span) => ("time_s", None, None, Some(span)),
            Along::Order => ("order", None, None, None),
            Along::Temperature(span) => ("temperature_C", None, None, Some(span)),
            Along::Run(run) => ("run", None, Some(run), None),
            Along::Direction(axis) => ("direction", Some(axis), None, None),
        };
        Self {
            along,
            axis,
            run,
            over,
            change_um: checked.trend.map(|trend| um(trend.change)),
            standard_uncertainty_um: checked.trend.map(|trend| um(trend.uncertainty)),
            is_significant: checked.trend.is_some_and(|trend| trend.is_significant()),
        }
    }
}
