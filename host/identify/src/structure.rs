//! Determines what axis positions can identify at all, whatever the readings.

use crate::IdentifyError;
use crate::descent::setup_alone;
use crate::estimate::Estimate;
use crate::factor::ScaledFactor;
use crate::rows::{EquationWeights, Problem};
use crate::simulate::on_ball;
use crate::unidentifiable::{GivenUp, seen};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;

/// A combination of unknowns can be identified if its effect at the probings (root mean square) exceeds this
/// fraction of the effects of its parts. Derivatives are those of the nominal machine. The angular errors of a real
/// machine, about 0.1 mrad, change them by as much, so smaller effects would depend on unknown errors. A combination
/// without any effect gives no more than rounding, 1e-15.
pub(crate) const SEEN: f64 = 1e-4;
/// Uncertainty of a coordinate (mm) for judging parameters without any effect, and for bars and a stylus of known
/// length.
const PROBED: f64 = 1e-3;

/// The nominal machine with its tip at the balls.
pub(crate) struct Ideal<'a> {
    pub problem: Problem<'a>,
    pub estimate: Estimate,
    pub weights: EquationWeights,
}

/// What can and what cannot be identified.
#[derive(Clone, Debug)]
pub(crate) struct Identifiability {
    /// Indices of the identifiable unknowns, ascending.
    pub kept: Vec<usize>,
    pub given_up: Vec<GivenUp>,
}

impl Identifiability {
    /// Finds what the positions of a problem can identify: the rank of the equations of the nominal machine, with
    /// linear axes that put the stylus at the balls. The readings only matter through the resulting positions of
    /// balls and stylus. `least`: see [`IdentifyOptions::least`](crate::IdentifyOptions::least).
    pub fn of(problem: &Problem<'_>, least: f64) -> Result<Self, IdentifyError> {
        let Ideal {
            problem: ideal,
            estimate,
            weights,
        } = Ideal::new(problem)?;
        let jacobian = ideal.jacobian(&estimate, &weights);
        let all = (0..problem.unknowns.len()).collect();
        let factor = ScaledFactor::new(&jacobian, all, &problem.alone());
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
        ideal.base = Box::new(ErrorModel::perfect(problem.machine));
        let weights = |least| EquationWeights {
            rows: vec![PROBED.recip(); problem.commands().count()],
            least,
        };
        let estimate = setup_alone(&ideal, &weights(f64::INFINITY))?;
        let kinematics = Kinematics::new(problem.machine, &ideal.base);
        for place in &mut ideal.places {
            let tip = place.turned * estimate.stylus;
            let ball = estimate.balls[place.ball];
            // Without three linear axes, use their recorded positions.
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
