//! Why nothing could be identified.

use crate::Mistake;
use trueaxis_model::errors::Parameter;

/// Why nothing could be identified.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum IdentifyError {
    /// There are too few probings.
    #[error(
        "{equations} equations, three of each probing, for {unknowns} unknowns: {parameters} parameters, stylus and balls{}", if *.has_setups { ", set-ups of instruments" } else { "" }
    )]
    TooFew {
        /// Number of equations.
        equations: usize,
        /// Number of unknowns.
        unknowns: usize,
        /// Number of error parameters among them.
        parameters: usize,
        /// True if some of them are set-ups of instruments.
        has_setups: bool,
    },
    /// There is no ball to leave out.
    #[error("there are no probings")]
    NoProbings,
    /// The machine does not have a parameter.
    #[error("the machine has no parameter {parameter}")]
    NoSuchParameter {
        /// The parameter.
        parameter: Parameter,
    },
    /// The iteration does not converge.
    #[error("the probings fit no machine of this model: {rms:.3} mm remain on average")]
    NotConverged {
        /// Root mean square distance from tip to ball (mm).
        rms: f64,
    },
    /// The set of identifiable unknowns or of trusted rows changes from round to round.
    #[error(
        "after {rounds} rounds it is not settled {what}: {rms:.4} mm remain on average, and most in line {line}"
    )]
    Unsettled {
        /// Number of rounds.
        rounds: usize,
        /// What still changes.
        what: &'static str,
        /// Root mean square distance from tip to ball (mm).
        rms: f64,
        /// Line of the row with the largest distance.
        line: usize,
    },
    /// At these positions no parameter can be identified, whatever the readings.
    #[error(
        "no parameter of this model shows at these positions: each can be made up for by where balls and stylus are"
    )]
    NothingSeen,
    /// Uncertainties or positions are too large or too small to compute with.
    #[error("the equations are not finite numbers")]
    NotFinite,
    /// A bar whose balls are at the same place.
    #[error("the balls {} and {} of a bar are in the same place to start with", balls[0], balls[1])]
    SamePlace {
        /// Balls.
        balls: [String; 2],
    },
    /// Known lengths show that positions are in another unit.
    #[error(
        "{what} is {known:.3} mm, but {found:.4} in the probings: their linear positions look like {unit}"
    )]
    OtherUnit {
        /// What has a known length.
        what: String,
        /// The known length (mm).
        known: f64,
        /// The length found if positions are in mm.
        found: f64,
        /// `metres` or `inches`.
        unit: &'static str,
    },
    /// The file fits the machine only if it is interpreted differently.
    #[error("{}", .0.what)]
    Mistake(Mistake),
    /// Some rows are so far off the others that nothing can be identified with them.
    #[error("some rows are so far off that nothing can be identified with them: {}", .sentences.join("; "))]
    Outliers {
        /// The outliers.
        sentences: Vec<String>,
    },
    /// Bars do not fit the probings.
    #[error("the probings fit a machine of this model, but not with the lengths of bars: {}", told(.bars))]
    Bars {
        /// Balls, length in the artefact and in the probings (mm).
        bars: Vec<([String; 2], f64, f64)>,
    },
}

fn told(bars: &[([String; 2], f64, f64)]) -> String {
    let bars = bars.iter().map(|([a, b], length, found)| {
        format!("{a} to {b} is {length:.4} mm in the artefact and {found:.4} mm in the probings")
    });
    bars.collect::<Vec<_>>().join("; ")
}

impl IdentifyError {
    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> &str {
        match self {
            Self::Mistake(mistake) => &mistake.remedy,
            Self::Outliers { .. } => {
                "correct these rows, leave them out (--without), or let rows that fit badly count less (--robust)"
            }
            Self::TooFew { .. } => {
                "probe at more rotary positions, or give a model with fewer parameters"
            }
            Self::NoProbings => "probe balls, to see how well they are predicted",
            Self::NoSuchParameter { .. } => {
                "leave it out: parameters are of axes of the machine, harmonics of rotary ones, up to the eighth"
            }
            Self::NothingSeen => {
                "probe at other rotary positions, or choose another model; balls reveal nothing about a machine whose rotary axes do not move, and the surface of a bed shows only how X and Y bend (EZX2,EZY2)"
            }
            Self::NotConverged { .. } => {
                "look whether the machine file describes this machine (trueaxis pose), whether positions are machine coordinates in mm and degrees without tool length, and whether balls have the right names"
            }
            Self::Unsettled { .. } => {
                "give a model with fewer parameters, or probe at more rotary positions; look at that row, and remove it if it is wrong"
            }
            Self::NotFinite => {
                "look for positions and uncertainties (sigma_um, standard_uncertainty_mm) that cannot be"
            }
            Self::SamePlace { .. } => {
                "correct nominal_mm of the two balls in the artefact, or leave it out"
            }
            Self::OtherUnit { .. } => {
                "write linear positions in mm, or correct the artefact and the tool of the machine file"
            }
            Self::Bars { .. } => {
                "correct the length of the bar, or leave it out; a model with scales (EXX1, EYY1, EZZ1) takes in a scale of the whole machine"
            }
        }
    }
}
