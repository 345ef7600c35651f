//! Reads a file again and compares its effect with the compensation.

use super::axes::NamedAxes;
use super::draft::draft;
use super::read::read;
use super::reading::ReadOptions;
use super::{CecPlan, CecTolerance, FactorTables};
use crate::difference::{Difference, differences};
use crate::positions::random;
use serde::Serialize;
use trueaxis::{Auxiliary, AuxiliaryKind, EncodeError, LoadError};
use trueaxis_model::source::FileError;
use trueaxis_model::validate::{Command, Runtime};

/// Change of tool length (mm) for measuring the sensitivity.
const LENGTH_CHANGE: f32 = 1.0;

/// Largest differences of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AxisDifference {
    /// Between the compensation and the file.
    #[serde(flatten)]
    pub own: Difference,
    /// Like `own.difference`, for a controller with the other interpretation of factor tables.
    pub other_reading: f64,
}

/// The effect of a file.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CecProof {
    /// Number of random positions, with random directions of travel.
    pub positions: usize,
    /// Axis by axis.
    pub axes: Vec<AxisDifference>,
    /// Change of a linear correction (µm) per mm that the tool is longer, if that was an input.
    pub um_per_mm_of_tool_length: Option<f64>,
}

impl CecProof {
    /// True if no axis exceeds the tolerance.
    #[must_use]
    pub fn meets(&self, tolerance: CecTolerance) -> bool {
        self.axes.iter().all(|a| {
            let most = match a.own.unit {
                "µm" => tolerance.um,
                _ => tolerance.urad,
            };
            a.own.difference <= most
        })
    }
}

/// Why the file cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ProveError {
    /// It cannot be read.
    #[error("the written file cannot be read back: {0}")]
    Read(#[from] FileError),
    /// It cannot be encoded as a blob.
    #[error("the written file is not a compensation: {0}")]
    Encode(#[from] EncodeError),
    /// The blob cannot be loaded.
    #[error("the written file is not a compensation: {0}")]
    Load(#[from] LoadError),
}

/// Reads a text, evaluates it under both interpretations, and compares it with a compensation at `positions` random
/// positions over the travel.
///
/// # Errors
/// [`ProveError`]
pub fn prove(
    text: &str,
    runtime: &Runtime<'_>,
    axes: &NamedAxes,
    plan: &CecPlan,
    factor_tables: FactorTables,
    positions: usize,
    seed: u64,
) -> Result<CecProof, ProveError> {
    let reading = ReadOptions {
        axes,
        factor_tables,
        units: None,
        encoder: None,
    };
    let tables = read(text, &reading)?.tables;
    let compensation = runtime.compensation();
    let blob = |factor_tables| {
        let policy = compensation.policy();
        draft("", policy, axes, Vec::new(), &tables, factor_tables).encode()
    };
    let (own, other) = (blob(factor_tables)?, blob(factor_tables.other())?);
    let (own, other) = (Runtime::load(&own)?, Runtime::load(&other)?);
    let mut commands = random(&axes.axes, positions, seed);
    let auxiliaries = compensation.auxiliaries().iter();
    let is_length = |a: &Auxiliary| a.kind == AuxiliaryKind::ToolLength;
    let is_length: Vec<bool> = auxiliaries.map(is_length).collect();
    let lengthen = |command: &mut Command, more: f32| {
        let inputs = command.auxiliaries.iter_mut().zip(&is_length);
        inputs
            .filter(|(_, is)| **is)
            .for_each(|(input, _)| *input += more);
    };
    let length = plan.length.unwrap_or_default() as f32;
    commands
        .iter_mut()
        .for_each(|command| lengthen(command, length));
    let told_by =
        |file: &Runtime<'_>| differences(runtime, &commands, |c| file.evaluate(c).map(f64::from));
    let (own, other) = (told_by(&own), told_by(&other));
    let by_length = differences(runtime, &commands, |command| {
        let mut longer = *command;
        lengthen(&mut longer, LENGTH_CHANGE);
        runtime.evaluate(&longer).map(f64::from)
    });
    let linear = by_length.iter().filter(|axis| axis.unit == "µm");
    let per_mm = linear.map(|axis| axis.difference / f64::from(LENGTH_CHANGE));
    let axes = own
        .into_iter()
        .zip(other)
        .map(|(own, other)| AxisDifference {
            own,
            other_reading: other.difference,
        });
    Ok(CecProof {
        positions,
        axes: axes.collect(),
        um_per_mm_of_tool_length: (is_length.contains(&true)).then(|| per_mm.fold(0.0, f64::max)),
    })
}
