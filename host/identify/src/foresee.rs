//! Predicts what probings will identify before they are made: the equations of [`identify`](crate::identify()) on
//! the assumed machine.

use crate::estimate::Estimate;
use crate::factor::ScaledFactor;
use crate::rows::{EquationWeights, Problem};
use crate::solve::STIFF;
use crate::structure::Identifiability;
use crate::unidentifiable::Unseen;
use crate::{IdentifyError, root_mean_square};
use nalgebra::{DMatrix, DVector, Vector3};
use trueaxis_model::errors::{ErrorModel, Parameter};

/// A prediction of what probings will identify.
#[derive(Clone, Debug)]
pub struct Foreseen {
    /// The parameters that can be identified, in the order of the model.
    pub parameters: Vec<Parameter>,
    /// Their covariance, in this order (mm, rad, per mmᵏ or radᵏ).
    pub covariance: DMatrix<f64>,
    /// Unknowns that cannot be identified.
    pub unseen: Vec<Unseen>,
    /// Number of unknowns, including the setup.
    pub unknowns: usize,
    /// Number of them that can be identified.
    pub rank: usize,
    /// Condition number of the Jacobian of the identifiable unknowns, with columns scaled to the same length.
    pub condition: f64,
    /// Indices of the unknowns that can be identified.
    pub kept: Vec<usize>,
    /// For each of [`Self::unseen`], the change of all unknowns that no probing notices.
    pub hidden: Vec<DVector<f64>>,
}

impl Foreseen {
    /// Standard uncertainty of each parameter that `identify` will state.
    #[must_use]
    pub fn uncertainties(&self) -> Vec<f64> {
        let variances = self.covariance.diagonal();
        variances.iter().map(|v| v.sqrt()).collect()
    }
}

/// Standard uncertainty of rows that state none (mm).
const UNSTATED: f64 = 1e-3;

impl Problem<'_> {
    /// Predicts the identification from probings at which the assumed machine is on the balls, with the standard
    /// uncertainties that the rows state (1 µm if they state none).
    ///
    /// # Errors
    /// [`IdentifyError::TooFew`] and [`IdentifyError::NoSuchParameter`], as from `identify`.
    pub fn foresee(&self, assumed: &ErrorModel) -> Result<Foreseen, IdentifyError> {
        self.can_be_solved()?;
        let (count, equations) = (self.unknowns.len(), self.equations());
        let stated: Vec<f64> = self.stated();
        let sigma = root_mean_square(stated.iter().copied());
        let left = sigma * (3.0 * (equations - count) as f64 / equations as f64).sqrt();
        let weights = EquationWeights {
            rows: stated.iter().map(|s| s.recip()).collect(),
            least: STIFF * left,
        };
        let jacobian = self.jacobian(&self.assumed(assumed), &weights);
        let Identifiability { kept, given_up } = Identifiability::of(self, 0.0)?;
        let factor = ScaledFactor::new(&jacobian, kept.clone(), &self.alone());
        let factor = factor.ok_or(IdentifyError::NotFinite)?;
        let parameters = self.parameters(kept.iter().copied());
        let covariance = factor.covariance(parameters.len());
        let covariance = covariance.ok_or(IdentifyError::NotConverged { rms: f64::NAN })?;
        let hidden = given_up.iter().map(|one| {
            let mut change = DVector::zeros(count);
            change[one.number] = -1.0;
            for (i, part) in &one.others {
                change[*i] += part;
            }
            change
        });
        Ok(Foreseen {
            hidden: hidden.collect(),
            unseen: given_up.iter().map(|g| g.unseen.clone()).collect(),
            parameters,
            covariance,
            unknowns: count,
            rank: kept.len(),
            condition: factor.condition(),
            kept,
        })
    }

    /// The derivatives of every probing by all unknowns, in units of its standard uncertainty and in the order of
    /// the file, three rows each; followed by those of observations and of prior knowledge.
    pub fn equations_at(&self, errors: &ErrorModel) -> (Vec<DMatrix<f64>>, DMatrix<f64>) {
        let weights = EquationWeights {
            rows: self.stated().iter().map(|s| s.recip()).collect(),
            least: 0.0,
        };
        let jacobian = self.jacobian(&self.assumed(errors), &weights);
        let probed = 3 * self.places.len();
        let mut blocks = vec![DMatrix::zeros(0, 0); self.places.len()];
        for (i, place) in self.places.iter().enumerate() {
            blocks[place.row] = jacobian.rows(3 * i, 3).into_owned();
        }
        let others = jacobian.rows(probed, jacobian.nrows() - probed);
        (blocks, others.into_owned())
    }

    /// The standard uncertainty of a coordinate of each probing and observation (mm).
    fn stated(&self) -> Vec<f64> {
        let probed = self.places.iter().map(|row| row.sigma);
        let all = probed.chain(self.observed.rows.iter().map(|row| row.sigma));
        all.map(|sigma| sigma.unwrap_or(UNSTATED)).collect()
    }

    /// A machine with given errors, and balls at its tip positions.
    fn assumed(&self, errors: &ErrorModel) -> Estimate {
        let mut estimate = self.start();
        let tips = self.tips(errors, &estimate.stylus);
        for (number, ball) in estimate.balls.iter_mut().enumerate() {
            let of_ball = tips.iter().filter(|(b, _)| *b == number);
            let (sum, count) = of_ball.fold((Vector3::zeros(), 0.0), |(sum, count), (_, tip)| {
                (sum + tip, count + 1.0)
            });
            if count > 0.0 {
                *ball = sum / count;
            }
        }
        estimate.errors = Box::new(errors.clone());
        estimate
    }
}
