//! What is answered for one machine.

use std::collections::BTreeMap;
use trueaxis_model::errors::Parameter;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::cost::instructions;

/// A parameter as stated: it is in `value` ± `band` with a probability of 95 % (mm, rad, per mmᵏ or radᵏ).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stated {
    /// Value.
    pub value: f64,
    /// Half the width of the interval.
    pub band: f64,
}

/// Instructions and bytes of a compensation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cost {
    /// Instructions of one evaluation on a Cortex-M4F, estimated ([`instructions`]).
    pub instructions: f64,
    /// Bytes of the blob.
    pub bytes: usize,
}

impl Cost {
    /// Of a loaded blob.
    #[must_use]
    pub fn of(runtime: &Runtime<'_>) -> Self {
        Self {
            instructions: instructions(runtime),
            bytes: runtime.compensation().blob_len(),
        }
    }
}

/// What is answered for one machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Answer {
    /// Corrections at each position (mm, rad).
    pub corrections: Vec<PerAxis>,
    /// Lengths that the errors of tip (mm) and tool direction (rad) do not exceed at each position with a probability
    /// of 95 %.
    pub bands: Vec<[f64; 2]>,
    /// Parameters; those that are missing are 0 ± 0.
    pub parameters: BTreeMap<Parameter, Stated>,
    /// Cost, if it is a compensation for the runtime.
    pub cost: Option<Cost>,
}

impl Answer {
    /// Nothing is corrected, and no error is expected.
    #[must_use]
    pub fn none(positions: usize) -> Self {
        Self {
            corrections: vec![PerAxis::default(); positions],
            bands: vec![[0.0; 2]; positions],
            ..Self::default()
        }
    }
}
