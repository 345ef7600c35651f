//! The figures of the source document that can be recomputed, compared with the printed ones.
//!
//! Parameters, strategies and machines are those published in the document, as contained in the files of `examples/`.
//! What it does not publish (ball positions, tool lengths, some travels) is assumed in these files. Nothing is fitted
//! to the document's results but the places of its ball and of its ball-bar, and the zone of the Huron, which the chapters
//! say.

mod ball;
mod ballbar;
mod embedded;
mod found;
mod grids;
mod not_reproduced;
mod page;
mod polynomials;
mod probing_noise;
mod skewed;
mod strategies;
mod table_6_2;
mod table_counts;
mod validated;

pub use found::{
    Chapter, Compared, Drawn, Figure, Fixed, NotReproduced, Picture, Quantity, Reproduced, Table,
};
pub use page::page;
pub use table_6_2::{CASES as TABLE_6_2, LINEAR as WITHOUT_REST};
use trueaxis::LoadError;
use trueaxis_direct::ballbar::{TooFew, Uneven};
use trueaxis_identify::IdentifyError;
use trueaxis_identify::simulate::SimulateError;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::source::FileError;
use trueaxis_model::validate::DrawError;
use trueaxis_report::scheme_comparison::NotCompared;
use trueaxis_tables::compile::{CompileError, Progress};
use trueaxis_tables::schemes::SchemeError;

/// Why a figure could not be recomputed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReproduceError {
    /// A file of the examples cannot be read.
    #[error("{}", .0.message)]
    File(Box<FileError>),
    /// A scheme finds no tables.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// A scheme fails before there is a blob.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// Positions cannot be generated.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// The remaining parameters cannot be identified.
    #[error(transparent)]
    Unknown(#[from] NotCompared),
    /// The ends of the ball-bar's path do not meet.
    #[error(transparent)]
    Uneven(#[from] Uneven),
    /// The ball-bar's readings cannot be evaluated.
    #[error(transparent)]
    TooFew(#[from] TooFew),
    /// A machine has no axes X, Y and Z.
    #[error("{machine} has no axes X, Y and Z")]
    NoBar {
        /// Name.
        machine: String,
    },
    /// A blob cannot be read back.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// A probing cannot be simulated.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Nothing can be identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The kinematic correction fails.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
}

impl From<FileError> for ReproduceError {
    fn from(error: FileError) -> Self {
        Self::File(Box::new(error))
    }
}

/// Recomputes everything.
///
/// # Errors
/// [`ReproduceError`]: none of them should occur, because there is no external input.
pub fn reproduce(progress: &dyn Progress) -> Result<Reproduced, ReproduceError> {
    progress.stage("Chapter 4: tables", 0);
    let tables = grids::Tables::new()?;
    progress.stage("Chapter 4: grids and ball-bar", 0);
    let mut found = vec![grids::chapter(&tables)?, ballbar::chapter(&tables)?];
    progress.stage("Chapter 5: the ball", 0);
    let balls = ball::inferred()?;
    progress.stage("Chapter 5: polynomials", 0);
    found.push(polynomials::chapter(&balls)?);
    progress.stage("Chapter 6: Table 6-2", 0);
    found.push(table_6_2::chapter(&balls)?);
    progress.stage("Chapter 6: the other machine", 0);
    found.push(skewed::chapter()?);
    progress.stage("Chapter 6: probings", 0);
    found.push(probing_noise::chapter(&balls)?);
    progress.stage("Chapter 7: tables", 0);
    found.push(table_counts::chapter()?);
    progress.stage("strategies", 0);
    found.push(strategies::chapter()?);
    Ok(Reproduced {
        chapters: found,
        not_reproduced: not_reproduced::list(),
    })
}
