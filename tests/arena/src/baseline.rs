//! What the project itself answers.

use crate::answer::{Answer, Cost, Stated};
use crate::class::Class;
use crate::left::{Left, left};
use crate::task::Task;
use std::fmt;
use trueaxis::{Auxiliary, AuxiliaryKind};
use trueaxis_identify::{Identified, IdentifyOptions, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Switches, Thermal};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::uncertainty::{Leaves, leaves};
use trueaxis_model::validate::{Command, Runtime};
use trueaxis_tables::compile::{self, best};
use trueaxis_tables::schemes::{self, Scheme};
use trueaxis_tables::target::Target;
use trueaxis_tests::thermal_goal::{MODEL, learnt_from};

/// Tolerance of tables (µm), the noise of the readings.
const TOLERANCE: f64 = 1.0;
/// Random positions of the verification of tables.
const RANDOM: usize = 2000;
/// An interval of 95 %, in standard uncertainties.
const EXPANDED: f64 = 1.96;

/// A way of compensation.
#[derive(Clone, Debug, PartialEq)]
pub enum Baseline {
    /// Nothing is measured and nothing corrected.
    None,
    /// Scales and squareness of the linear axes alone are identified; tables of the scheme `exact`.
    ScalesAndSquareness,
    /// All parameters that are asked for are identified; tables of a scheme under a policy.
    Tables(Scheme, Policy),
    /// Like `Tables`, with the kinematic correction itself instead of tables.
    Kinematics,
}

impl fmt::Display for Baseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.pad("none"),
            Self::ScalesAndSquareness => f.pad("scales and squareness"),
            Self::Tables(scheme, Policy::Orientation) if scheme.keeps_tolerance() => {
                f.pad(&format!("{scheme} (orientation)"))
            }
            Self::Tables(scheme, _) => f.pad(&scheme.name()),
            Self::Kinematics => f.pad("exact kinematics"),
        }
    }
}

impl Baseline {
    /// All baselines. Those of the source document have its policy: a grid corrects the linear axes alone.
    ///
    /// # Panics
    /// Never: these schemes exist.
    #[must_use]
    pub fn every() -> Vec<Self> {
        let of = |name: &str, policy| Self::Tables(name.parse().expect("a scheme"), policy);
        vec![
            Self::None,
            Self::ScalesAndSquareness,
            of("grid3d", Policy::Position),
            of("poly25", Policy::Orientation),
            of("trigo23", Policy::Orientation),
            of("fik", Policy::Orientation),
            of("exact", Policy::Orientation),
            of("exact", Policy::default()),
            Self::Kinematics,
        ]
    }
}

/// Answers with every baseline, each with the reason if it has none.
#[must_use]
pub fn answers(task: &Task) -> Vec<(Baseline, Result<Answer, String>)> {
    let full = full(task);
    let of = |baseline: &Baseline| match baseline {
        Baseline::None => Ok(Answer::none(task.positions.len())),
        Baseline::ScalesAndSquareness => scales_and_squareness(task),
        Baseline::Tables(scheme, policy) => {
            tables(task, full.as_ref().map_err(String::clone)?, scheme, *policy)
        }
        Baseline::Kinematics => kinematic(task, full.as_ref().map_err(String::clone)?),
    };
    let each = Baseline::every().into_iter();
    each.map(|baseline| (baseline.clone(), of(&baseline)))
        .collect()
}

/// Errors as identified.
#[derive(Clone, Debug)]
struct Found {
    identified: Identified,
    /// Half the width (mm) of the interval in which 95 % of the coordinates of another warm-up are, if temperatures were
    /// identified.
    thermal: Option<f64>,
}

/// All parameters, with temperatures on a machine that warms up.
fn full(task: &Task) -> Result<Found, String> {
    let Some(warm) = &task.warm else {
        return identified(task, &task.asked);
    };
    let readings = task.measured.read(&task.machine).observations;
    let (identified, warmed, _) = learnt_from(&task.machine, readings, &warm.measured)?;
    Ok(Found {
        identified,
        thermal: Some(warmed.band),
    })
}

fn identified(task: &Task, parameters: &[Parameter]) -> Result<Found, String> {
    let base = ErrorModel::perfect(&task.machine);
    let readings = task.measured.read(&task.machine);
    let problem = readings.problem(&task.machine, parameters, &base);
    let identified = identify(&problem, IdentifyOptions::default());
    Ok(Found {
        identified: identified.map_err(|e| e.to_string())?,
        thermal: None,
    })
}

/// True for the scale of a linear axis, and for its direction.
fn is_scale_or_square(parameter: &Parameter) -> bool {
    let Some(own) = "XYZ".find(parameter.axis) else {
        return false;
    };
    match parameter.kind {
        ParameterKind::Degree(1) => parameter.component == own,
        ParameterKind::Inter => parameter.component >= 3,
        _ => false,
    }
}

fn scales_and_squareness(task: &Task) -> Result<Answer, String> {
    let all = match task.class {
        Class::Thermal => MODEL.iter().filter_map(|n| Parameter::parse(n)).collect(),
        _ => task.asked.clone(),
    };
    let own: Vec<Parameter> = all.into_iter().filter(is_scale_or_square).collect();
    let found = identified(task, &own)?;
    tables(task, &found, &Scheme::default(), Policy::default())
}

/// As `trueaxis compile --tolerance 1 --best-effort` does, for a controller that holds what the format can say.
fn tables(task: &Task, found: &Found, scheme: &Scheme, policy: Policy) -> Result<Answer, String> {
    let options = compile::Options {
        scheme: scheme.clone(),
        tables: schemes::Options {
            policy,
            target: Target::desktop(),
            ..schemes::Options::default()
        },
        allow_large: true,
        random: RANDOM,
        ..compile::Options::default()
    };
    let (machine, errors) = (&task.machine, &found.identified.errors);
    let best = best(machine, errors, &options, Some(TOLERANCE), &()).map_err(|e| e.to_string())?;
    let refusals = best.verification.refusals(best.tolerance);
    if scheme.keeps_tolerance()
        && let Some(refusal) = refusals.iter().find(|r| !r.yields_to_best_effort())
    {
        return Err(refusal.to_string());
    }
    let runtime = Runtime::load(&best.built.blob).map_err(|e| e.to_string())?;
    let corrections = evaluated(task, &runtime)?;
    let mut answer = answer(task, found, corrections)?;
    answer.cost = Some(Cost::of(&runtime));
    Ok(answer)
}

/// The corrections (mm, rad) of a compensation at every position.
///
/// # Errors
/// If it has an input that the machine does not have.
pub fn evaluated(task: &Task, runtime: &Runtime<'_>) -> Result<Vec<PerAxis>, String> {
    let commands = task.commands(&inputs(runtime)?)?;
    let of = |command| {
        let corrections = runtime.evaluate(command).map(f64::from);
        task.machine.to_kinematic(&corrections)
    };
    Ok(commands.iter().map(of).collect())
}

/// The temperatures on which a compensation depends.
fn inputs(runtime: &Runtime<'_>) -> Result<Vec<Thermal>, String> {
    let one = |input: &Auxiliary| {
        if input.kind == AuxiliaryKind::ToolLength {
            return Err(
                "the tool length is an input: machines of the arena have one tool".to_owned(),
            );
        }
        let lag = match input.sensor.lag_rate {
            0.0 => 0.0,
            rate => f64::from(rate).recip(),
        };
        Ok(Thermal {
            sensor: input.name.as_str().to_owned(),
            lag,
            reference_celsius: f64::from(input.reference),
            // Tables end with their range.
            range_kelvin: [f64::NEG_INFINITY, f64::INFINITY],
            rate: Thermal::RATE,
            range_celsius: Thermal::RANGE_CELSIUS,
        })
    };
    runtime
        .compensation()
        .auxiliaries()
        .iter()
        .map(one)
        .collect()
}

fn kinematic(task: &Task, found: &Found) -> Result<Answer, String> {
    let errors = &found.identified.errors;
    let kinematics = Kinematics::new(&task.machine, errors);
    let of = |command: &Command| {
        let (q, situation) = command.kinematic(&task.machine);
        let found = kinematics.correction(&q, &situation, &Switches::ALL);
        found.map(|c| c.dq).map_err(|e| e.to_string())
    };
    let commands = task.commands(&errors.sensors)?;
    let corrections = commands.iter().map(of).collect::<Result<_, _>>()?;
    answer(task, found, corrections)
}

/// A coordinate's interval of 95 %, as the length that three such coordinates do not exceed with that probability.
const LENGTH: f64 = 2.796 / 1.960;

/// States the identified parameters. The band at a position is what the corrections leave of the identified errors
/// there, plus that of the parameters and of temperatures.
fn answer(task: &Task, found: &Found, corrections: Vec<PerAxis>) -> Result<Answer, String> {
    let (machine, identified) = (&task.machine, &found.identified);
    let errors = &identified.errors;
    let commands = task.commands(&errors.sensors)?;
    let places: Vec<_> = commands.iter().map(|c| c.kinematic(machine)).collect();
    let uncertain = leaves(machine, errors, &identified.known, &places);
    let left = left(task, &commands, |_| errors, &corrections);
    let thermal = LENGTH * found.thermal.unwrap_or_default();
    let band = |(left, uncertain): (&Left, &Leaves)| {
        [
            left.tip + uncertain.tip_band().hypot(thermal),
            left.direction + uncertain.direction_band(),
        ]
    };
    let bands = left.iter().zip(&uncertain).map(band).collect();
    let stated = identified.parameters.iter().map(|e| {
        let stated = Stated {
            value: e.value,
            band: EXPANDED * e.uncertainty,
        };
        (e.parameter, stated)
    });
    Ok(Answer {
        bands,
        parameters: stated.collect(),
        corrections,
        cost: None,
    })
}
