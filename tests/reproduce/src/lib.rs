//! The figures of the source document that can be recomputed, compared with the printed ones.
//!
//! Parameters, strategies and machines are those published in the document, as contained in the files of `examples/`.
//! What it does not publish (ball positions, tool lengths, some travels) is assumed in these files. Nothing is fitted
//! to the document's results.

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
    Chapter, Compared, Drawn, Figure, Fixed, NotReproduced, Picture, Reproduced, Table,
};
pub use page::page;
pub use table_6_2::{CASES as TABLE_6_2, LINEAR as WITHOUT_REST};
use trueaxis::LoadError;
use trueaxis_measure::ballbar::{TooFew, Uneven};
use trueaxis_measure::compare::Unknown;
use trueaxis_measure::identify::IdentifyError;
use trueaxis_measure::simulate::SimulateError;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::source::FileError;
use trueaxis_tables::compile::{CompileError, Progress};
use trueaxis_tables::schemes::SchemeError;
use trueaxis_tables::validate::DrawError;

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
    Unknown(#[from] Unknown),
    /// The ends of the ball-bar's path do not meet.
    #[error(transparent)]
    Uneven(#[from] Uneven),
    /// The ball-bar's readings cannot be evaluated.
    #[error(transparent)]
    TooFew(#[from] TooFew),
    /// A machine has no axes X, Y and Z.
    #[error("{machine} has no axes X, Y and Z")]
    NoBar {
        /// Its name.
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
    let chapters: [(&'static str, Computed); 6] = [
        ("Chapter 5: polynomials", polynomials::chapter),
        ("Chapter 6: Table 6-2", table_6_2::chapter),
        ("Chapter 6: the other machine", skewed::chapter),
        ("Chapter 6: probings", probing_noise::chapter),
        ("Chapter 7: tables", table_counts::chapter),
        ("strategies", strategies::chapter),
    ];
    for (name, chapter) in chapters {
        progress.stage(name, 0);
        found.push(chapter()?);
    }
    Ok(Reproduced {
        chapters: found,
        not_reproduced: not_reproduced::list(),
    })
}

/// A function that recomputes a chapter.
type Computed = fn() -> Result<Chapter, ReproduceError>;
