//! Whether a compensation of uncertain errors makes the tip better.
//!
//! An estimate ê of the errors e of the tip is off by ε, with a covariance. Without compensation the mean square over
//! the travel is |e|²; with it |ε|² is left. Their difference is the *gain* |e|² − |ε|². As |ê|² is on average
//! |e|² + |ε|², the estimate |ê|² − 2·E|ε|² of the gain is unbiased. With ε = J·R·z, where R·Rᵀ is the covariance of
//! the parameters and z is standard normal, its variance is 4·|g|² + 2·tr(B²), where g is the mean of (J·R)ᵀ·ê and B
//! that of (J·R)ᵀ·J·R.

use super::Changes;
use crate::errors::Switches;
use crate::kinematics::Kinematics;
use crate::parallel;
use crate::validate::{DrawError, Region, random_commands};
use nalgebra::{DMatrix, DVector};

/// Number of positions over which means are taken.
const POSITIONS: usize = 1000;

/// What a compensation of uncertain errors is expected to do at the tip, over the travel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Benefit {
    /// Error of the tip without it, from the identified errors: root mean square (µm).
    pub before_um: f64,
    /// Error of the tip that is expected to remain: root mean square (µm).
    pub after_um: f64,
    /// Estimated gain, in multiples of its standard uncertainty.
    pub deviations: f64,
}

impl Benefit {
    /// Whether the compensation makes the tip better, with a probability of 99 % (one-sided): what becomes worse far from
    /// where something was measured, nobody sees.
    #[must_use]
    pub fn is_sure(&self) -> bool {
        self.deviations >= 2.326
    }
}

/// The benefit of compensating the errors of a machine, with the random positions, directions of travel, tool lengths
/// and temperatures of a verification. Without any uncertainty it is sure.
///
/// # Errors
/// [`DrawError`] if no positions can be drawn.
pub fn benefit(kinematics: &Kinematics<'_>, seed: u64) -> Result<Benefit, DrawError> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let covariance = errors.covariance();
    let root = covariance.root();
    let commands = random_commands(kinematics, Region::Travel, POSITIONS, seed)?;
    let parts = parallel::map(&commands, |command| {
        let (q, situation) = command.kinematic(machine);
        let error = kinematics.actual(&q, &situation, &Switches::ALL).t
            - kinematics.nominal(&q, situation.length).t;
        let changes = Changes::new(kinematics, &q, &situation);
        let [of_parameters, _] = changes.by(&covariance.parameters);
        let [of_tables, _] = changes.of_tables();
        (error, of_parameters * &root, of_tables)
    });
    let unknowns = covariance.parameters.len();
    let mut gradient = DVector::zeros(unknowns);
    let mut spread = DMatrix::zeros(unknowns, unknowns);
    let (mut square, mut of_tables) = (0.0, 0.0);
    let share = 1.0 / commands.len() as f64;
    for (error, changes, tables) in &parts {
        square += share * error.norm_squared();
        of_tables += share * tables.norm_squared();
        gradient += changes.transpose() * error * share;
        spread += changes.transpose() * changes * share;
    }
    let left = spread.trace() + of_tables;
    // Values of tables are independent of each other: over the travel their part of the gain varies little.
    let deviation = (4.0 * gradient.norm_squared() + 2.0 * spread.norm_squared()).sqrt();
    Ok(Benefit {
        before_um: square.sqrt() * 1e3,
        after_um: left.sqrt() * 1e3,
        deviations: (square - 2.0 * left) / deviation.max(f64::MIN_POSITIVE),
    })
}
