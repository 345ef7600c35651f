//! Simulated probings that show how much of each error parameter remains with a compensation on.

use super::NotCompared;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_identify::formats::artefact::{Artefact, ArtefactBar, Ball, Stylus};
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_identify::simulate::{self, Disturbances, compensated, corrections, reach};
use trueaxis_identify::{Compensated, IdentifyOptions, Problem, compensability, identify};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine};
use trueaxis_model::validate::Runtime;

/// Number of balls, placed where the tip can reach them.
const BALLS: usize = 6;
/// Probings for each parameter, and their smallest number.
const PER_PARAMETER: usize = 10;
const LEAST: usize = 240;
/// Tries for each probing: at few rotary positions the linear axes reach a ball within their travel.
const TRIES: usize = 200;
/// Fraction of the travel that is kept free at either end, for corrections and errors.
const MARGIN: f64 = 0.02;
/// Standard uncertainty of exactly known lengths (mm), the smallest permitted for a bar.
const EXACT: f64 = 1e-6;

/// Balls, and the probings of them.
pub struct Strategy {
    artefact: Artefact,
    probings: Probings,
    parameters: Vec<Parameter>,
}

impl Strategy {
    /// Balls over the whole space that the tip reaches, each probed at the same number of rotary positions, with
    /// axes arriving from either direction.
    pub fn new(machine: &Machine, errors: &ErrorModel, seed: u64) -> Result<Self, NotCompared> {
        let parameters: Vec<Parameter> = errors.parameters.keys().copied().collect();
        if parameters.is_empty() {
            return Err(NotCompared::NoParameters);
        }
        let rows = LEAST.max(PER_PARAMETER * parameters.len()) / BALLS;
        let (balls, probings) = everywhere(machine, rows, seed)?;
        let bar = |pair: &[Ball]| {
            let (one, other) = (&pair[0], &pair[1]);
            Some(ArtefactBar {
                balls: [one.name.clone(), other.name.clone()],
                length: (one.nominal? - other.nominal?).norm(),
                uncertainty: EXACT,
            })
        };
        Ok(Self {
            artefact: Artefact {
                bars: balls.windows(2).filter_map(bar).collect(),
                balls,
                stylus: Stylus {
                    tip: machine.tip.map(Some),
                    uncertainty: [Some(EXACT); 3],
                    shaft: None,
                },
            },
            probings,
            parameters,
        })
    }

    /// The remainder of each parameter with this compensation on.
    pub fn compensability(
        &self,
        machine: &Machine,
        errors: &ErrorModel,
        runtime: &Runtime<'_>,
    ) -> Result<Compensated, NotCompared> {
        let kinematics = runtime.kinematics(machine, errors);
        let measured = compensated(
            &kinematics,
            &self.artefact,
            &self.probings,
            &Disturbances::default(),
            |rows| Ok::<_, simulate::SimulateError>(corrections(kinematics.machine, runtime, rows)),
        )?;
        let base = ErrorModel::perfect(machine);
        let problem = Problem::new(machine, &measured, &self.artefact, &self.parameters, &base);
        let identified = identify(&problem, IdentifyOptions::default())?;
        // The errors before are known exactly, because they were simulated.
        let mut before = errors.clone();
        before.standard_uncertainty.clear();
        Ok(compensability(&problem, &identified, &before))
    }
}

/// Balls at random places, and this many probings of each.
fn everywhere(
    machine: &Machine,
    rows: usize,
    seed: u64,
) -> Result<(Vec<Ball>, Probings), NotCompared> {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut balls: Vec<Ball> = Vec::new();
    let mut probings = Probings::default();
    for _ in 0..TRIES {
        if balls.len() == BALLS {
            break;
        }
        let somewhere = machine.to_kinematic(&drawn(machine, &mut random).position);
        let place = kinematics.nominal(&somewhere, None).t;
        let Some(found) = rows_at(&kinematics, &place, rows, &mut random) else {
            continue;
        };
        let name = format!("{}", balls.len() + 1);
        probings.balls.push(name.clone());
        let ball = balls.len();
        probings
            .rows
            .extend(found.into_iter().map(|row| Probing { ball, ..row }));
        balls.push(Ball {
            name,
            nominal: Some(place),
            away: Vector3::z(),
            post: None,
        });
    }
    if balls.len() < BALLS {
        return Err(NotCompared::NotReached);
    }
    for (number, row) in probings.rows.iter_mut().enumerate() {
        row.line = number + 2;
    }
    Ok((balls, probings))
}

/// This many probings of a place inside the travel, if they are found.
fn rows_at(
    kinematics: &Kinematics<'_>,
    place: &Vector3<f64>,
    rows: usize,
    random: &mut Pcg64Mcg,
) -> Option<Vec<Probing>> {
    let machine = kinematics.machine;
    let tip = Vector3::from(machine.tip);
    let found: Vec<Probing> = (0..TRIES * rows)
        .filter_map(|_| {
            let row = drawn(machine, random);
            let position = machine.to_command(&reach(kinematics, &row, &tip, place)?);
            let row = Probing { position, ..row };
            is_inside(machine, &row).then_some(row)
        })
        .take(rows)
        .collect();
    (found.len() == rows).then_some(found)
}

/// A random probing in the travel, away from its ends.
fn drawn(machine: &Machine, random: &mut Pcg64Mcg) -> Probing {
    let mut position = [0.0; MAX_AXES];
    let mut direction = [0.0; MAX_AXES];
    for (i, axis) in machine.axes.iter().enumerate() {
        let [low, high] = axis.travel;
        let part = MARGIN + (1.0 - 2.0 * MARGIN) * random.random::<f64>();
        position[i] = low + (high - low) * part;
        direction[i] = if random.random::<bool>() { 1.0 } else { -1.0 };
    }
    Probing {
        position,
        direction,
        ..Probing::default()
    }
}

fn is_inside(machine: &Machine, row: &Probing) -> bool {
    machine.axes.iter().zip(row.position).all(|(axis, q)| {
        let [low, high] = axis.travel;
        let margin = MARGIN * (high - low);
        (low + margin..=high - margin).contains(&q)
    })
}
