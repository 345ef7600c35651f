//! The error budget: the effect of each parameter over the travel if it alone is wrong.

use super::volumetric::quality;
use super::words::{in_words, name};
use super::worst::{FEW, Of, WorstSearch};
use super::{ReportError, Subject};
use serde::{Deserialize, Serialize};
use trueaxis_model::errors::{MAX_SENSORS, Situation, Switches};
use trueaxis_model::explain::{EntryKind, SingleEntry};
use trueaxis_model::kinematics::{Htm, Kinematics};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;
use trueaxis_model::validate::{Command, Quality, Region, direction, random_commands};

/// Number of random positions; a mean over this many is accurate to 2 % if the scatter of errors equals their size.
const POSITIONS: usize = 2000;
/// Number of these at which the part that no correction removes is computed.
const CORRECTED: usize = 200;
/// Parameters that change the tool direction by less than this (µrad) on average are ignored there.
const TURNS: f64 = 0.01;
/// Coverage factor of expanded uncertainties: 95 %.
const EXPANDED: f64 = 2.0;

/// Effects of single parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorBudget {
    /// Number of random positions in the travel.
    pub positions: usize,
    /// The effect of every parameter; the largest mean at the tip first.
    pub shares: Vec<Share>,
}

/// The effect of one parameter alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Share {
    /// Name, as in the error file; `EXX (table)` for a tabulated motion.
    pub name: String,
    /// Description of the effect.
    pub words: String,
    /// Value (mm, rad, per mm or rad to the power of its degree); `None` for a tabulated motion.
    pub value: Option<f64>,
    /// Standard uncertainty in the same unit, if known.
    pub standard_uncertainty: Option<f64>,
    /// The volumetric error of a machine on which only this parameter is wrong: means at random positions, and the
    /// maxima found by a search.
    pub alone: Quality,
    /// The mean volumetric error that its expanded uncertainty (k = 2) can cause.
    pub expanded_uncertainty_mean_um: Option<f64>,
    /// The largest volumetric error that its expanded uncertainty (k = 2) can cause.
    pub expanded_uncertainty_max_um: Option<f64>,
    /// The mean for the tool direction.
    #[serde(default)]
    pub expanded_uncertainty_mean_urad: Option<f64>,
    /// The largest for the tool direction.
    pub expanded_uncertainty_max_urad: Option<f64>,
    /// Mean error of the tool direction that the exact kinematic correction leaves; `None` if the correction fails
    /// somewhere.
    pub uncorrected_urad: Option<f64>,
}

/// A position at which every parameter is looked at.
struct Place {
    command: Command,
    q: PerAxis,
    situation: Situation,
    /// From the workpiece to the tool where it should be.
    from_nominal: Htm,
}

impl Place {
    fn new(kinematics: &Kinematics<'_>, command: &Command) -> Self {
        let (q, situation) = command.kinematic(kinematics.machine);
        Self {
            command: *command,
            q,
            situation,
            from_nominal: kinematics.nominal(&q, situation.length).inverse(),
        }
    }
}

/// What is computed for each parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// Effect.
    Alone,
    /// Also the effect of its uncertainty, and the part that no correction removes.
    Everything,
}

/// Computes the effect of each parameter alone.
pub fn budget(subject: &Subject<'_>, depth: Depth) -> Result<ErrorBudget, ReportError> {
    let (machine, errors) = (subject.machine, subject.errors);
    let kinematics = Kinematics::new(machine, errors).with_policy(subject.policy);
    let commands = random_commands(&kinematics, Region::Travel, POSITIONS, subject.seed)?;
    let all = SingleEntry::all(machine, errors);
    let places: Vec<Place> = commands
        .iter()
        .map(|c| Place::new(&kinematics, c))
        .collect();
    let mut shares = parallel::try_map(&all, |alone| share(subject, alone, &places, depth))?;
    let size = |share: &Share| {
        let Quality {
            translation_um,
            direction_urad,
        } = share.alone;
        (translation_um.mean, direction_urad.mean)
    };
    shares.sort_by(|a, b| {
        let (a, b) = (size(a), size(b));
        b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1))
    });
    Ok(ErrorBudget {
        positions: POSITIONS,
        shares,
    })
}

fn share(
    subject: &Subject<'_>,
    alone: &SingleEntry<'_>,
    places: &[Place],
    depth: Depth,
) -> Result<Share, ReportError> {
    let quality = does(subject, alone, places, depth)?;
    let (value, standard_uncertainty) = match &alone.said {
        EntryKind::Parameter(value) => (
            Some(*value),
            uncertainty(subject, alone).filter(|u| *u > 0.0),
        ),
        EntryKind::PerKelvin { per_kelvin, .. } => (Some(*per_kelvin), None),
        EntryKind::Table | EntryKind::TableReversal => (None, None),
    };
    let is_whole = depth == Depth::Everything;
    let unsure = standard_uncertainty.filter(|_| is_whole);
    let unsure = unsure.map(|u| alone.instead(alone.parameter, EXPANDED * u));
    let spread = unsure.map(|unsure| does(subject, &unsure, places, depth));
    let spread = spread.transpose()?;
    let turns = quality.direction_urad.mean > TURNS;
    let uncorrected_urad = match turns {
        _ if !is_whole => None,
        true => left(subject, alone, &places[..CORRECTED.min(places.len())]),
        false => Some(0.0),
    };
    Ok(Share {
        name: name(alone),
        words: in_words(alone),
        value,
        standard_uncertainty,
        alone: quality,
        expanded_uncertainty_mean_um: spread.map(|s| s.translation_um.mean),
        expanded_uncertainty_max_um: spread.map(|s| s.translation_um.max),
        expanded_uncertainty_mean_urad: spread.map(|s| s.direction_urad.mean),
        expanded_uncertainty_max_urad: spread.map(|s| s.direction_urad.max),
        uncorrected_urad,
    })
}

/// Standard uncertainty, from a covariance file or from the error file.
fn uncertainty(subject: &Subject<'_>, alone: &SingleEntry<'_>) -> Option<f64> {
    let covariance = subject.errors.covariance();
    let known = covariance.parameters.iter();
    let place = known.clone().position(|p| *p == alone.parameter)?;
    Some(covariance.matrix[(place, place)].sqrt())
}

/// The situation with the temperature of the only sensor in the model of one parameter.
fn situation(subject: &Subject<'_>, alone: &SingleEntry<'_>, situation: &Situation) -> Situation {
    let mut kelvin = [0.0; MAX_SENSORS];
    if let EntryKind::PerKelvin { sensor, .. } = &alone.said {
        let sensors = &subject.errors.sensors;
        if let Some(index) = sensors.iter().position(|s| s.name() == *sensor) {
            kelvin[0] = situation.kelvin[index];
        }
    }
    Situation {
        kelvin,
        ..*situation
    }
}

/// The volumetric error caused by this parameter alone. For a verdict, maxima are those at the commands.
fn does(
    subject: &Subject<'_>,
    alone: &SingleEntry<'_>,
    places: &[Place],
    depth: Depth,
) -> Result<Quality, ReportError> {
    let (machine, errors) = (subject.machine, subject.errors);
    let (model, _) = alone.model(1.0);
    let kinematics = Kinematics::new(machine, &model);
    let zero = subject.subtracted.zero(machine, &model)?;
    let errors_at = |place: &Place| {
        let corrected = std::array::from_fn(|i| place.q[i] + zero[i]);
        let situation = situation(subject, alone, &place.situation);
        let actual = kinematics.actual(&corrected, &situation, &Switches::ALL);
        let error = (place.from_nominal * actual).twist();
        [error.t.norm(), direction(machine, &error)]
    };
    let found: Vec<[f64; 2]> = places.iter().map(errors_at).collect();
    let mut found = quality(found.into_iter());
    let left =
        |command: &Command, of: Of| errors_at(&Place::new(&kinematics, command))[of as usize];
    if depth == Depth::Everything {
        let few = places.iter().take(FEW).map(|place| place.command);
        let few: Vec<Command> = few.collect();
        WorstSearch { machine, errors }.raise(&mut found, &few, &left);
    }
    Ok(found)
}

/// Mean error of the tool direction (µrad) that the kinematic correction leaves.
fn left(subject: &Subject<'_>, alone: &SingleEntry<'_>, places: &[Place]) -> Option<f64> {
    let (model, _) = alone.model(1.0);
    let kinematics = Kinematics::new(subject.machine, &model).with_policy(subject.policy);
    let left = places.iter().map(
        |Place {
             q, situation: at, ..
         }| {
            let at = situation(subject, alone, at);
            let dq = kinematics.correction(q, &at, &Switches::ALL).ok()?.dq;
            let error = kinematics.volumetric_error(q, &dq, &at);
            Some(direction(subject.machine, &error) * 1e6)
        },
    );
    let left: Option<Vec<f64>> = left.collect();
    left.map(|left| left.iter().sum::<f64>() / left.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::errors::ErrorModel;
    use trueaxis_model::machine::Machine;

    fn kolibri(errors: &str) -> (Machine, ErrorModel) {
        let text = include_str!("../../../examples/kolibri/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let text = format!("machine = \"Kolibri\"\n{errors}");
        let errors = ErrorModel::with_files(&text, &machine, &|_| Err(String::new())).unwrap();
        (machine, errors)
    }

    #[test]
    fn a_share_is_what_the_parameter_does_to_the_exact_poses() {
        let (machine, errors) = kolibri(
            "[parameters]\nEB0A = 1e-3\nEYY1 = 20e-6\nEXXb = 4e-3\nEZ0C = 5e-3\nEZX2 = 1e-7\n",
        );
        let subject = Subject::new(&machine, &errors, None, 7);
        let found = budget(&subject, Depth::Everything).unwrap();
        let kinematics = Kinematics::new(&machine, &errors);
        let commands = random_commands(&kinematics, Region::Travel, POSITIONS, 7).unwrap();
        for (parameter, value) in &errors.parameters {
            let mut only = ErrorModel::perfect(&machine);
            assert!(only.set(&machine, *parameter, *value));
            let kinematics = Kinematics::new(&machine, &only);
            let distance = commands.iter().map(|command| {
                let (q, situation) = command.kinematic(&machine);
                let nominal = kinematics.nominal(&q, None);
                let actual = kinematics.actual(&q, &situation, &Switches::ALL);
                let turn = nominal
                    .r
                    .column(machine.tool_axis)
                    .dot(&actual.r.column(machine.tool_axis));
                [
                    (actual.t - nominal.t).norm() * 1e3,
                    libm::acos(turn.clamp(-1.0, 1.0)) * 1e6,
                ]
            });
            let distances: Vec<[f64; 2]> = distance.collect();
            let mean = |k: usize| distances.iter().map(|d| d[k]).sum::<f64>() / POSITIONS as f64;
            let share = found
                .shares
                .iter()
                .find(|s| s.name == parameter.to_string())
                .unwrap();
            let tip = share.alone.translation_um;
            // Rounding of positions of 1 m; for the cosine of a small angle, half of its last digit.
            assert!(
                (tip.mean - mean(0)).abs() < 1e-9,
                "{parameter}: {tip:?} {}",
                mean(0)
            );
            let direction = share.alone.direction_urad.mean;
            assert!(
                (direction - mean(1)).abs() < 0.05,
                "{parameter}: {direction} {}",
                mean(1)
            );
        }
        let scale = found.shares.iter().find(|s| s.name == "EZ0C").unwrap();
        assert!((scale.alone.translation_um.max - 5.0).abs() < 1e-9);
        assert_eq!(scale.expanded_uncertainty_max_um, None);
    }

    #[test]
    fn an_uncertainty_does_what_a_parameter_of_its_size_does_twice() {
        let (machine, errors) =
            kolibri("[parameters]\nEZ0C = 5e-3\n[standard_uncertainty]\nEZ0C = 1e-3\n");
        let found = budget(&Subject::new(&machine, &errors, None, 1), Depth::Everything).unwrap();
        let share = &found.shares[0];
        assert_eq!(share.standard_uncertainty, Some(1e-3));
        for um in [
            share.expanded_uncertainty_mean_um,
            share.expanded_uncertainty_max_um,
        ] {
            assert!((um.unwrap() - 2.0).abs() < 1e-9);
        }
    }
}
