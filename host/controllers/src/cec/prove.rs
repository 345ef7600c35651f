//! Reads a file again and compares its effect with the compensation.

use super::axes::NamedAxes;
use super::draft::draft;
use super::read::read;
use super::reading::ReadOptions;
use super::{CecPlan, CecTolerance, FactorTables};
use crate::positions::random;
use serde::Serialize;
use trueaxis::{AuxiliaryKind, EncodeError, LoadError};
use trueaxis_model::machine::MAX_AXES;
use trueaxis_model::parallel;
use trueaxis_model::source::FileError;
use trueaxis_tables::validate::{Command, Runtime};

/// Change of tool length (mm) for measuring the sensitivity.
const LENGTH_CHANGE: f32 = 1.0;

/// Largest differences of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AxisDifference {
    /// Letter of the axis.
    pub axis: char,
    /// `µm` or `µrad`.
    pub unit: &'static str,
    /// Largest correction of the compensation.
    pub largest: f64,
    /// Largest difference between the compensation and the file.
    pub difference: f64,
    /// Like `difference`, for a controller with the other interpretation of factor tables.
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
            let most = if a.unit == "µm" {
                tolerance.um
            } else {
                tolerance.urad
            };
            a.difference <= most
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
    let commands = random(&axes.axes, positions, seed);
    let lengths: Vec<usize> = compensation
        .auxiliaries()
        .iter()
        .enumerate()
        .filter_map(|(i, a)| (a.kind == AuxiliaryKind::ToolLength).then_some(i))
        .collect();
    let with_length = |command: &Command, more: f32| {
        let mut command = *command;
        for i in &lengths {
            command.auxiliaries[*i] = plan.length.unwrap_or_default() as f32 + more;
        }
        command
    };
    let worst = |command: &Command| {
        let compiled = runtime.evaluate(&with_length(command, 0.0));
        let longer = runtime.evaluate(&with_length(command, LENGTH_CHANGE));
        let (own, other) = (own.evaluate(command), other.evaluate(command));
        std::array::from_fn(|i| {
            let differs = |found: f32| (f64::from(found) - f64::from(compiled[i])).abs();
            [
                f64::from(compiled[i]).abs(),
                differs(own[i]),
                differs(other[i]),
                differs(longer[i]),
            ]
        })
    };
    let larger = |a: [[f64; 4]; MAX_AXES], b: [[f64; 4]; MAX_AXES]| {
        std::array::from_fn(|i| std::array::from_fn(|k| f64::max(a[i][k], b[i][k])))
    };
    let found = parallel::map(&commands, worst);
    let found = found.into_iter().fold([[0.0; 4]; MAX_AXES], larger);
    let of = |i: usize| {
        let (unit, fine) = match axes.is_rotary(i) {
            true => ("µrad", 1_f64.to_radians() * 1e6),
            false => ("µm", 1e3),
        };
        let [largest, difference, other_reading, _] = found[i].map(|value| value * fine);
        AxisDifference {
            axis: axes.letter(i),
            unit,
            largest,
            difference,
            other_reading,
        }
    };
    let linear = (0..axes.axes.len()).filter(|i| !axes.is_rotary(*i));
    let per_mm = linear.map(|i| found[i][3] * 1e3 / f64::from(LENGTH_CHANGE));
    Ok(CecProof {
        positions,
        axes: (0..axes.axes.len()).map(of).collect(),
        um_per_mm_of_tool_length: (!lengths.is_empty()).then(|| per_mm.fold(0.0, f64::max)),
    })
}
