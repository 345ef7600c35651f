//! What the project itself answers.

use crate::answer::{Answer, Cost, Stated};
use crate::task::Task;
use std::fmt;
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::{self, Identified, Problem, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;
use trueaxis_tables::compile::{self, best};
use trueaxis_tables::schemes::{self, Scheme};
use trueaxis_tables::target::Target;
use trueaxis_tables::uncertainty::leaves;
use trueaxis_tables::validate::{Runtime, direction};

/// Tolerance of tables (µm), the noise of the readings.
const TOLERANCE: f64 = 1.0;
/// Random positions of the proof of tables.
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
    /// All parameters that are asked for are identified; tables of a scheme.
    Tables(Scheme),
    /// The same with the kinematic correction itself instead of tables.
    Kinematics,
}

impl fmt::Display for Baseline {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.pad("none"),
            Self::ScalesAndSquareness => f.pad("scales and squareness"),
            Self::Tables(scheme) => f.pad(&scheme.name()),
            Self::Kinematics => f.pad("exact kinematics"),
        }
    }
}

impl Baseline {
    /// All baselines.
    ///
    /// # Panics
    /// Never: these schemes exist.
    #[must_use]
    pub fn every() -> Vec<Self> {
        let scheme = |name: &str| Self::Tables(name.parse().expect("a scheme"));
        vec![
            Self::None,
            Self::ScalesAndSquareness,
            scheme("grid3d"),
            scheme("poly25"),
            scheme("trigo23"),
            scheme("fik"),
            scheme("exact"),
            Self::Kinematics,
        ]
    }
}

/// Answers with every baseline, each with the reason if it has none.
#[must_use]
pub fn answers(task: &Task) -> Vec<(Baseline, Result<Answer, String>)> {
    let full = identified(task, &task.asked);
    let all = Baseline::every().into_iter().map(|baseline| {
        let answer = match &baseline {
            Baseline::None => Ok(Answer::none(task.positions.len())),
            Baseline::ScalesAndSquareness => scales_and_squareness(task),
            Baseline::Tables(scheme) => full.clone().and_then(|full| tables(task, &full, scheme)),
            Baseline::Kinematics => full.clone().and_then(|full| kinematic(task, &full)),
        };
        (baseline, answer)
    });
    all.collect()
}

fn identified(task: &Task, parameters: &[Parameter]) -> Result<Identified, String> {
    let base = ErrorModel::perfect(&task.machine);
    let observations = task.observations();
    let (probings, artefact) = (Probings::default(), Artefact::default());
    let problem = Problem::new(&task.machine, &probings, &artefact, parameters, &base);
    let options = identify::Options::default();
    identify(&problem.with(&observations), options).map_err(|e| e.to_string())
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
    let asked = task.asked.iter().copied();
    let own: Vec<Parameter> = asked.filter(is_scale_or_square).collect();
    tables(task, &identified(task, &own)?, &Scheme::default())
}

/// As `trueaxis compile --tolerance 1 --best-effort` does, for a controller that holds what the format can say.
fn tables(task: &Task, identified: &Identified, scheme: &Scheme) -> Result<Answer, String> {
    let options = compile::Options {
        scheme: scheme.clone(),
        tables: schemes::Options {
            target: Target::desktop(),
            ..schemes::Options::default()
        },
        allow_large: true,
        random: RANDOM,
        ..compile::Options::default()
    };
    let (machine, errors) = (&task.machine, &identified.errors);
    let best = best(machine, errors, &options, Some(TOLERANCE), &()).map_err(|e| e.to_string())?;
    let refusals = best.proof.refusals(best.tolerance);
    if scheme.keeps_tolerance()
        && let Some(refusal) = refusals.iter().find(|r| !r.yields_to_best_effort())
    {
        return Err(refusal.to_string());
    }
    let runtime = Runtime::load(&best.built.blob).map_err(|e| e.to_string())?;
    let of = |command| {
        let corrections = runtime.evaluate(command).map(f64::from);
        Ok(task.machine.to_kinematic(&corrections))
    };
    let corrections = task
        .positions
        .iter()
        .map(of)
        .collect::<Result<_, String>>()?;
    let mut answer = answer(task, identified, corrections);
    answer.cost = Some(Cost::of(&runtime));
    Ok(answer)
}

fn kinematic(task: &Task, identified: &Identified) -> Result<Answer, String> {
    let kinematics = Kinematics::new(&task.machine, &identified.errors);
    let corrections = corrections(task, &kinematics)?;
    Ok(answer(task, identified, corrections))
}

/// The kinematic correction at every position (mm, rad).
///
/// # Errors
/// If it does not converge somewhere.
pub fn corrections(task: &Task, kinematics: &Kinematics<'_>) -> Result<Vec<PerAxis>, String> {
    let of = |command: &trueaxis_tables::validate::Command| {
        let (q, situation) = command.kinematic(&task.machine);
        let found = kinematics.correction(&q, &situation, &Switches::ALL);
        found.map(|c| c.dq).map_err(|e| e.to_string())
    };
    task.positions.iter().map(of).collect()
}

/// States the identified parameters. The band at a position is what the corrections leave of the identified errors
/// there, plus the band of the parameters.
fn answer(task: &Task, identified: &Identified, corrections: Vec<PerAxis>) -> Answer {
    let (machine, errors) = (&task.machine, &identified.errors);
    let kinematics = Kinematics::new(machine, errors);
    let commands = task.positions.iter().map(|c| c.kinematic(machine));
    let places: Vec<_> = commands.collect();
    let uncertain = leaves(machine, errors, &identified.known, &places);
    let band = |(((q, situation), dq), uncertain): (
        (&(PerAxis, _), &PerAxis),
        &trueaxis_tables::uncertainty::Leaves,
    )| {
        let left = kinematics.volumetric_error(q, dq, situation);
        [
            left.t.norm() + uncertain.tip_band(),
            direction(machine, &left) + uncertain.direction_band(),
        ]
    };
    let each = places.iter().zip(&corrections).zip(&uncertain);
    let bands = each.map(band).collect();
    let stated = identified.parameters.iter().map(|e| {
        let stated = Stated {
            value: e.value,
            band: EXPANDED * e.uncertainty,
        };
        (e.parameter, stated)
    });
    Answer {
        bands,
        parameters: stated.collect(),
        corrections,
        cost: None,
    }
}
