//! The size of a compensation.

use serde::{Deserialize, Serialize};
use trueaxis::Counts;
use trueaxis_model::validate::Runtime;

/// Counts and sizes of a compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Size {
    /// Axes.
    #[serde(skip)]
    pub axes: usize,
    /// Tables.
    pub tables: usize,
    /// Banks: tables that share their points.
    pub banks: usize,
    /// Terms.
    pub terms: usize,
    /// Grids.
    pub grids: usize,
    /// Samples of both formats.
    pub samples: usize,
    /// Bytes of the blob.
    pub bytes: usize,
}

impl Size {
    /// The size of a loaded blob.
    #[must_use]
    pub fn of(runtime: &Runtime<'_>) -> Self {
        let compensation = runtime.compensation();
        Self {
            axes: compensation.axes().len(),
            tables: compensation.tables(),
            banks: compensation.banks().len(),
            terms: compensation.terms().len(),
            grids: compensation.grids().len(),
            samples: compensation.samples(),
            bytes: compensation.blob_len(),
        }
    }

    /// The smallest capacities that hold it, displayed as the type to write.
    #[must_use]
    pub fn capacities(&self) -> Counts {
        Counts {
            axes: self.axes as u32,
            banks: self.banks as u32,
            tables: self.tables as u32,
            terms: self.terms as u32,
            grids: self.grids as u32,
        }
    }
}
