//! From probings of balls and observations of instruments to error parameters with their uncertainties.
//!
//! A row of probings has the positions of all axes with the nominal stylus centre at the centre of a ball. With the
//! right error parameters, balls and stylus, the tip of the actual machine is at the ball in every row. [`identify`]
//! finds the values for which it is as close as the noise permits, and determines how well each is known and which
//! ones these rows cannot separate from others.
//!
//! Everything begins with a [`Problem`]. Builds on `trueaxis-model` and `trueaxis-direct`.

// Modules that others build on: `instrument` (what each kind of instrument, or a cut part, shows of exact poses, and
// its set-up) · `formats` (artefacts, probings, observations, temperatures) · `simulate` (probings and observations of a
// machine with known errors).

#![forbid(unsafe_code)]

mod auto;
mod bars;
mod candidates;
mod compensability;
mod derivatives;
mod descent;
mod drift;
mod elsewhere;
mod error;
mod error_file;
mod estimate;
mod factor;
mod foresee;
pub mod formats;
mod gram;
mod held_out;
mod identified;
pub mod instrument;
mod locations;
mod misread;
mod missing;
mod mistakes;
mod model;
mod monte_carlo;
mod narrowed;
mod noise;
mod not_known;
mod observed;
mod prior;
mod published;
mod repeated;
mod residual_checks;
mod rows;
mod score;
mod set_up_priors;
mod setup;
pub mod simulate;
mod snooping;
mod solve;
mod stated;
mod structure;
mod tables;
mod thermal;
mod thermal_choice;
mod trend;
mod unidentifiable;
mod units;
mod unknown;
mod unmodelled;
mod without;

pub use auto::{Chosen, Fit, Level, TriedTerms, automatic};
pub use bars::BarCheck;
pub use candidates::RotationForm;
pub use compensability::{Compensability, Compensated, compensability};
pub use drift::drifting;
pub use error::IdentifyError;
pub use error_file::error_file;
pub use estimate::RowResult;
pub use foresee::Foreseen;
pub use held_out::{HeldOut, Together, held_out, scatters};
pub use identified::{Estimated, FoundChange, Identified};
pub use locations::effect_over_travel;
pub use misread::turned;
pub use missing::lacks;
pub use mistakes::{Mistake, unseen_senses};
pub use model::{Model, ModelError};
pub use monte_carlo::{MonteCarloOutcome, Normalised, Trial, TrialError, monte_carlo};
pub use noise::{NoiseSource, VarianceComponent};
pub use not_known::NotKnown;
pub use prior::Prior;
pub use published::{Missing, Published, published};
pub use repeated::{Repeated, repeated};
pub use residual_checks::{Checked, Honesty, TrendAlong, honesty};
pub use rows::{Measured, Problem};
pub use score::{Lacking, lacking};
pub use set_up_priors::{Contradicted, contradicted};
pub use setup::{FoundDrift, FoundPart, FoundSetup};
pub use snooping::{Misread, Outlier, OutlierKind, deviations, snoop};
pub use solve::{IdentifyOptions, identify};
pub use stated::{PLACES, Stated, misplaced, stated};
pub use thermal::{LeftOut, TakenTemperature, ThermalError, Warmed, thermal};
pub use trend::{OfBall, Repeats, Trend};
pub use unidentifiable::{ProbedSpindle, Unseen, grouped};
pub use unknown::Unknown;
pub use unmodelled::Unmodelled;
pub use without::without;

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len();
    (values.map(|v| v * v).sum::<f64>() / count as f64).sqrt()
}
