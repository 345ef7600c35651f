//! What positions of the axes can tell at all, whatever was read at them.

use super::IdentifyError;
use super::descent::setup_alone;
use super::factor::Factor;
use super::rows::{Estimate, Problem, Weights};
use super::unidentifiable::{GivenUp, seen};
use crate::simulate::on_ball;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;

/// A combination of unknowns is seen if it does more than this at the probings (root of the mean square), of what
/// each of its parts does by itself. Derivatives are those of the nominal machine: the angles of a real one, some
/// 0.1 mrad, change them by as much, so that what is smaller would rest on errors that are not known. What does
/// nothing is seen by no more than rounding, 1e-15.
pub(super) const SEEN: f64 = 1e-4;
/// The uncertainty of a coordinate against which parameters count that show in no row (mm), and with which bars and a
/// stylus of known length do.
const PROBED: f64 = 1e-3;

/// The nominal machine on the balls.
pub(super) struct Ideal<'a> {
    pub problem: Problem<'a>,
    pub estimate: Estimate,
    pub weights: Weights,
}

/// What can be told, and what cannot.
#[derive(Clone, Debug)]
pub(super) struct Structure {
    /// The numbers of the unknowns that are seen, ascending.
    pub kept: Vec<usize>,
    pub given_up: Vec<GivenUp>,
}

impl Structure {
    /// What the positions of a problem can tell: the rank of the equations of the nominal machine, its linear axes
    /// where the stylus is on the balls. What was read matters only through the places of balls and stylus that follow.
    /// `least`: see [`Options::least`](super::Options::least).
    pub fn of(problem: &Problem<'_>, least: f64) -> Result<Self, IdentifyError> {
        let Ideal {
            problem: ideal,
            estimate,
            weights,
        } = Ideal::new(problem)?;
        let jacobian = ideal.jacobian(&estimate, &weights);
        let all = (0..problem.unknowns.len()).collect();
        let factor = Factor::new(&jacobian, all, &problem.alone());
        let factor = factor.ok_or(IdentifyError::NotFinite)?;
        let idle = ideal.idle(&factor, &weights).into_iter();
        let idle = idle.map(|i| GivenUp::idle(i, problem.unknowns[i], problem.spindle));
        let (factor, given_up) = seen(
            (&problem.unknowns, problem.spindle),
            factor,
            idle.collect(),
            least.max(SEEN),
        );
        Ok(Self {
            kept: factor.unknowns().to_vec(),
            given_up,
        })
    }
}

impl<'a> Ideal<'a> {
    pub fn new(problem: &Problem<'a>) -> Result<Self, IdentifyError> {
        let mut ideal = problem.clone();
        ideal.base = ErrorModel::perfect(problem.machine);
        let weights = |least| Weights {
            rows: vec![PROBED.recip(); problem.places.len()],
            least,
        };
        let estimate = setup_alone(&ideal, &weights(f64::INFINITY))?;
        let kinematics = Kinematics::new(problem.machine, &ideal.base);
        for place in &mut ideal.places {
            let tip = place.turned * estimate.stylus;
            let ball = estimate.balls[place.ball];
            // Without three linear axes, where they are must do.
            place.q =
                on_ball(&kinematics, &place.q, &place.situation, &tip, &ball).unwrap_or(place.q);
        }
        Ok(Self {
            problem: ideal,
            estimate,
            weights: weights(0.0),
        })
    }
}
