//! The figures of the source document that can be recomputed, beside those that it prints.
//!
//! Parameters, strategies and machines are those that the document publishes, as the files of `examples/` have them;
//! what it does not publish (places of balls, tool lengths, some travels) is what these files assume. Nothing is
//! fitted to the document's results.

mod embedded;
mod found;
mod page;
mod table_6_2;
mod validated;

use crate::compile::{CompileError, Progress};
use crate::identify::IdentifyError;
use crate::kinematics::NotConverged;
use crate::simulate::SimulateError;
use crate::source::FileError;
pub use found::{
    Chapter, Compared, Drawn, Figure, Fixed, NotReproduced, Picture, Reproduced, Series, Table,
};
pub use page::page;
use trueaxis::LoadError;

/// Why a figure could not be recomputed.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ReproduceError {
    /// A file of the examples cannot be read.
    #[error("{}", .0.message)]
    File(Box<FileError>),
    /// A scheme finds nothing.
    #[error(transparent)]
    Compile(#[from] CompileError),
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
/// [`ReproduceError`]: none of them should happen, for nothing comes from outside.
pub fn reproduce(progress: &dyn Progress) -> Result<Reproduced, ReproduceError> {
    let chapters: [(&'static str, fn() -> Result<Chapter, ReproduceError>); 1] =
        [("Table 6-2", table_6_2::chapter)];
    let mut found = Vec::new();
    for (name, chapter) in chapters {
        progress.stage(name, 0);
        found.push(chapter()?);
    }
    Ok(Reproduced {
        chapters: found,
        not_reproduced: Vec::new(),
    })
}
