//! Simulated observations of any kind.

use super::drifted;
use crate::formats::observations::Observations;
use crate::instrument::{InitialSample, Kind, turned};
use nalgebra::Vector3;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::numbers::{extremes, normal};

/// Disturbances of observations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OfObservations {
    /// Standard deviation of each reading as a multiple of the standard uncertainty that its row states.
    pub noise: f64,
    /// Movement of every instrument from the first to the last time (mm, workpiece frame).
    pub drift: [f64; 3],
    /// Time constant of that, as a part of the whole time; linear if it is 0.
    pub drift_lag: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

/// These observations with the readings on a machine with known errors. Set-ups and tool points are as stated;
/// what is not stated is zero, and a displacement is zero at the first row, as is a part in its nominal place.
#[must_use]
pub fn observations(
    kinematics: &Kinematics<'_>,
    plan: &Observations,
    disturbances: &OfObservations,
) -> Observations {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(disturbances.seed);
    let commanded = plan.commanded(machine);
    let settings: Vec<_> = (plan.setups.iter().enumerate())
        .map(|(number, setup)| {
            let own = plan.rows.iter().zip(&commanded);
            let own = own.filter(|(row, _)| row.setup == number);
            let samples: Vec<InitialSample> = own
                .map(|(_, commanded)| InitialSample {
                    commanded: *commanded,
                    read: Vector3::zeros(),
                })
                .collect();
            match setup.kind {
                Kind::Displacement | Kind::Surface => {
                    setup.kind.instrument().start(&setup.given, &samples)
                }
                _ => setup.given.setting(),
            }
        })
        .collect();
    let times = plan.rows.iter().filter_map(|row| row.time);
    let [first, last] = extremes(times);
    let span = last - first;
    let last = (plan.rows.len().max(2) - 1) as f64;
    let mut measured = plan.clone();
    for (number, (row, commanded)) in measured.rows.iter_mut().zip(&commanded).enumerate() {
        let setup = &plan.setups[row.setup];
        let tip = turned(machine.tool_axis, row.spindle) * plan.tip(machine, setup.tool);
        let situation = Situation {
            sign: row.direction,
            ..Situation::default()
        };
        let q = machine.to_kinematic(&row.position);
        let actual = kinematics.actual(&q, &situation, &Switches::ALL);
        let mut seen = commanded.seen(machine, &actual, &tip);
        let at = match row.time {
            Some(time) if span > 0.0 => (time - first) / span,
            _ => number as f64 / last,
        };
        seen.point -= drifted(disturbances.drift, disturbances.drift_lag, at);
        let instrument = setup.kind.instrument();
        row.value = instrument.reads(commanded, &settings[row.setup], &seen);
        let sigma = disturbances.noise * row.sigma.unwrap_or(0.0);
        for k in 0..setup.kind.dimension() {
            row.value[k] += sigma * normal(&mut random);
        }
    }
    measured
}
