//! What `export cec` and `import cec` share.

use super::bad_input::BadInput;
use clap::ValueEnum;
use trueaxis_controllers::cec::{self, AxesError};

/// Whether factor tables are added by themselves, too.
#[derive(Clone, Copy, ValueEnum)]
pub enum FactorTables {
    /// A table that another is multiplied by is added, too
    Added,
    /// It is not
    NotAdded,
}

impl From<FactorTables> for cec::FactorTables {
    fn from(tables: FactorTables) -> Self {
        match tables {
            FactorTables::Added => Self::Added,
            FactorTables::NotAdded => Self::NotAdded,
        }
    }
}

/// What is wrong with `--axes`.
pub fn axes(error: &AxesError) -> BadInput {
    BadInput::new(
        format!("--axes: {error}"),
        "write what the controller calls each axis, by number or name: X=AX1,Y=AX2,Z=AX3,A=AX4,C=AX5",
    )
}
