//! A compensation under construction, on the side that has a heap.

mod aligned_blob;

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt;

use serde::Serialize;

use crate::compensation::Compensation;
use crate::description::{
    Auxiliary, Axis, Bank, Direction, Grid, GridAxis, Interpolation, Policy, SampleFormat, Term,
};
use crate::format::{ALIGNMENT, HEADER, LARGEST_BLOB, MAGIC, VERSION};
use crate::header;
use crate::load_error::LoadError;
use crate::notes::Notes;
use crate::room::capacities;

pub use aligned_blob::AlignedBlob;

/// Capacities with which [`Draft::encode`] verifies its output: any smaller target refuses a large blob with
/// [`LoadError::TooSmall`].
pub type Largest<'a> =
    Compensation<'a, capacities!(axes: 16, banks: 255, tables: 255, terms: 4096, grids: 8)>;

/// Everything needed to build a blob.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft {
    /// Name of the machine.
    pub machine: String,
    /// How the rotary corrections were solved.
    pub policy: Policy,
    /// The axes, both inputs and outputs.
    pub axes: Vec<Axis>,
    /// Auxiliary inputs; their numbers follow those of the axes.
    pub auxiliaries: Vec<Auxiliary>,
    /// Banks of tables; tables are numbered consecutively through them.
    pub banks: Vec<DraftBank>,
    /// Products of tables.
    pub terms: Vec<Term>,
    /// Grids.
    pub grids: Vec<DraftGrid>,
    /// What hosts want to know about the origin of the corrections.
    pub notes: Notes,
}

/// Tables over the same points of the same input.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftBank {
    /// Index of the input: the axes in order, then the auxiliaries.
    pub input: u8,
    /// Position of the first point; for cubic tables, the start of the first interval.
    pub start: f32,
    /// Distance between points.
    pub step: f32,
    /// The input wraps into the period `points · step`.
    pub modulo: bool,
    /// Direction of travel for which the tables apply.
    pub direction: Direction,
    /// How the tables are interpolated between points.
    pub interpolation: Interpolation,
    /// Storage format of the samples.
    pub format: SampleFormat,
    /// One column per table, all of equal length: the values at the points or, for cubic tables, the coefficients.
    pub columns: Vec<Vec<f32>>,
}

/// Corrections of several axes at the nodes of a rectangular grid.
#[derive(Clone, Debug, PartialEq)]
pub struct DraftGrid {
    /// One to three inputs; the first varies slowest in the node order.
    pub axes: Vec<GridAxis>,
    /// Indices of the output axes.
    pub outputs: Vec<u8>,
    /// Storage format of the samples.
    pub format: SampleFormat,
    /// Node by node, the outputs interleaved.
    pub values: Vec<f32>,
}

/// Why a draft cannot become a blob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EncodeError {
    /// The columns of a bank have different lengths.
    Columns {
        /// Index of the bank.
        bank: usize,
    },
    /// The number of values of a grid is not nodes × outputs.
    Values {
        /// Index of the grid.
        grid: usize,
        /// Required number of values.
        expected: u64,
        /// Actual number of values.
        found: usize,
    },
    /// A value that must be stored as an integer is not finite.
    NotFinite {
        /// Index of the bank or grid.
        index: usize,
    },
    /// More than [`LARGEST_BLOB`] bytes.
    TooLarge,
    /// The encoded blob would be refused.
    Refused(LoadError),
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Columns { bank } => write!(f, "bank {bank}: the columns differ in length"),
            Self::Values {
                grid,
                expected,
                found,
            } => write!(f, "grid {grid}: {found} values, expected {expected}"),
            Self::NotFinite { index } => write!(
                f,
                "bank or grid {index}: a value to be stored as an integer is not finite"
            ),
            Self::TooLarge => write!(f, "the blob would exceed {LARGEST_BLOB} bytes"),
            Self::Refused(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for EncodeError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Refused(error) => Some(error),
            _ => None,
        }
    }
}

impl From<LoadError> for EncodeError {
    fn from(error: LoadError) -> Self {
        Self::Refused(error)
    }
}

/// The description on the wire; the field order defines the format.
#[derive(Serialize)]
pub(crate) struct Wire<'d> {
    pub(crate) machine: &'d str,
    pub(crate) policy: Policy,
    pub(crate) floats: u32,
    pub(crate) shorts: u32,
    pub(crate) axes: &'d [Axis],
    pub(crate) auxiliaries: &'d [Auxiliary],
    pub(crate) banks: Vec<WireBank>,
    pub(crate) terms: &'d [Term],
    pub(crate) grids: Vec<Grid>,
}

#[derive(Serialize)]
pub(crate) struct WireBank {
    pub(crate) bank: Bank,
    pub(crate) scales: Vec<f32>,
}

/// The two sections of samples.
#[derive(Default)]
pub(crate) struct Samples {
    pub(crate) floats: Vec<f32>,
    pub(crate) shorts: Vec<i16>,
}

impl Samples {
    fn next(&self, format: SampleFormat) -> Result<u32, EncodeError> {
        let length = match format {
            SampleFormat::F32 => self.floats.len(),
            SampleFormat::I16 => self.shorts.len(),
        };
        u32::try_from(length).map_err(|_| EncodeError::TooLarge)
    }
}

/// The scale that maps the largest of `values` to ±32767.
fn scale(values: impl Iterator<Item = f32>) -> Option<f32> {
    let mut peak = 0.0_f32;
    for value in values {
        if !value.is_finite() {
            return None;
        }
        peak = peak.max(value.abs());
    }
    // Small enough to be negligible, large enough to be a normal number, even if all values are zero.
    Some((peak / 32767.0).max(1e-30))
}

/// Nearest integer to value / scale.
fn quantise(value: f32, scale: f32) -> i16 {
    let steps = f64::from(value) / f64::from(scale);
    let half = if steps < 0.0 { -0.5 } else { 0.5 };
    (steps + half) as i16 // truncates and saturates
}

impl Draft {
    /// Writes the blob, and loads it once to make sure that it is accepted.
    ///
    /// # Errors
    /// See [`EncodeError`].
    pub fn encode(&self) -> Result<AlignedBlob, EncodeError> {
        let blob = AlignedBlob::from_bytes(&self.write()?);
        let mut trial = Box::new(Largest::empty());
        trial.load(&blob)?;
        Ok(blob)
    }

    /// Writes the blob without verifying it.
    fn write(&self) -> Result<Vec<u8>, EncodeError> {
        let mut samples = Samples::default();
        let wire = self.wire(&mut samples)?;
        let description = postcard::to_allocvec(&wire).map_err(|_| EncodeError::TooLarge)?;
        let notes = self.notes.encode();
        let notes = notes.map_err(|_| EncodeError::TooLarge)?;
        assemble(&description, &samples, &notes)
    }

    pub(crate) fn wire(&self, samples: &mut Samples) -> Result<Wire<'_>, EncodeError> {
        let mut banks = Vec::with_capacity(self.banks.len());
        for (index, bank) in self.banks.iter().enumerate() {
            banks.push(bank.write(index, samples)?);
        }
        let mut grids = Vec::with_capacity(self.grids.len());
        for (index, grid) in self.grids.iter().enumerate() {
            grids.push(grid.write(index, samples)?);
        }
        Ok(Wire {
            machine: &self.machine,
            policy: self.policy,
            floats: samples.next(SampleFormat::F32)?,
            shorts: samples.next(SampleFormat::I16)?,
            axes: &self.axes,
            auxiliaries: &self.auxiliaries,
            banks,
            terms: &self.terms,
            grids,
        })
    }
}

/// Joins header, description, padding, samples and notes.
pub(crate) fn assemble(
    description: &[u8],
    samples: &Samples,
    notes: &[u8],
) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = vec![0; HEADER];
    bytes.extend(description);
    bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
    bytes.extend(samples.floats.iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(samples.shorts.iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(notes);
    if bytes.len() > LARGEST_BLOB {
        return Err(EncodeError::TooLarge);
    }
    let noted = u16::try_from(notes.len()).map_err(|_| EncodeError::TooLarge)?;
    let length = bytes.len() as u32;
    bytes[..4].copy_from_slice(&MAGIC);
    bytes[4..6].copy_from_slice(&VERSION.to_le_bytes());
    bytes[6..8].copy_from_slice(&noted.to_le_bytes());
    bytes[8..12].copy_from_slice(&length.to_le_bytes());
    let checksum = header::checksum(&bytes);
    bytes[12..16].copy_from_slice(&checksum.to_le_bytes());
    Ok(bytes)
}

impl DraftBank {
    fn write(&self, index: usize, samples: &mut Samples) -> Result<WireBank, EncodeError> {
        let points = self.columns.first().map_or(0, Vec::len);
        if self.columns.iter().any(|column| column.len() != points) {
            return Err(EncodeError::Columns { bank: index });
        }
        let bank = Bank {
            input: self.input,
            start: self.start,
            step: self.step,
            points: u32::try_from(points).map_err(|_| EncodeError::TooLarge)?,
            modulo: self.modulo,
            direction: self.direction,
            interpolation: self.interpolation,
            format: self.format,
            tables: u16::try_from(self.columns.len()).map_err(|_| EncodeError::TooLarge)?,
            first: samples.next(self.format)?,
        };
        let mut scales = Vec::new();
        match self.format {
            SampleFormat::F32 => {
                for point in 0..points {
                    samples
                        .floats
                        .extend(self.columns.iter().map(|column| column[point]));
                }
            }
            SampleFormat::I16 => {
                for column in &self.columns {
                    let scale = scale(column.iter().copied());
                    scales.push(scale.ok_or(EncodeError::NotFinite { index })?);
                }
                for point in 0..points {
                    let row = self.columns.iter().zip(&scales);
                    samples
                        .shorts
                        .extend(row.map(|(column, &scale)| quantise(column[point], scale)));
                }
            }
        }
        Ok(WireBank { bank, scales })
    }
}

impl DraftGrid {
    fn write(&self, index: usize, samples: &mut Samples) -> Result<Grid, EncodeError> {
        let refused = |error| Err(EncodeError::Refused(error));
        let number = u16::try_from(index).map_err(|_| EncodeError::TooLarge)?;
        let Ok(axes) = heapless::Vec::from_slice(&self.axes) else {
            return refused(LoadError::GridInputs {
                grid: number,
                found: self.axes.len() as u32,
            });
        };
        let Ok(outputs) = heapless::Vec::<u8, 6>::from_slice(&self.outputs) else {
            return refused(LoadError::GridOutputs { grid: number });
        };
        let width = outputs.len();
        let mut grid = Grid {
            axes,
            outputs,
            format: self.format,
            scales: heapless::Vec::new(),
            first: samples.next(self.format)?,
        };
        let expected = grid.nodes().saturating_mul(width as u64);
        if expected != self.values.len() as u64 {
            return Err(EncodeError::Values {
                grid: index,
                expected,
                found: self.values.len(),
            });
        }
        match self.format {
            SampleFormat::F32 => samples.floats.extend(&self.values),
            SampleFormat::I16 => {
                for output in 0..width {
                    let scale = scale(self.values.iter().skip(output).step_by(width).copied());
                    let _ = grid
                        .scales
                        .push(scale.ok_or(EncodeError::NotFinite { index })?);
                }
                let scales = grid.scales.iter().cycle();
                samples.shorts.extend(
                    self.values
                        .iter()
                        .zip(scales)
                        .map(|(&v, &s)| quantise(v, s)),
                );
            }
        }
        Ok(grid)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::room::Holds;
    use crate::specimen;

    #[test]
    fn what_was_drafted_is_what_is_loaded() {
        let mut draft = specimen::everything();
        draft.policy = Policy::Position;
        let blob = draft.encode().unwrap();
        assert_eq!(blob.as_ptr() as usize % ALIGNMENT, 0);
        let c = Compensation::decode(&blob).unwrap();
        assert_eq!((c.axes(), c.samples()), (&draft.axes[..], 64));
        let said = alloc::format!("{c:?}");
        for part in ["specimen", "axes: 3", "tables: 7", "terms: 10", "grids: 2"] {
            assert!(said.contains(part), "{said}");
        }
        let c = Compensation::<'_, Holds<3, 8, 8, 16, 2>>::from_blob(&blob).unwrap();
        assert_eq!(c.machine(), draft.machine);
        assert_eq!(c.policy(), draft.policy);
        assert_eq!(c.axes(), draft.axes);
        assert_eq!(c.auxiliaries(), draft.auxiliaries);
        assert_eq!(c.blob_len(), blob.len());
        assert_eq!(c.terms().len(), draft.terms.len());
        for (view, term) in c.terms().zip(&draft.terms) {
            assert_eq!(
                (view.output, view.weight, view.limits, view.factors),
                (term.output, term.weight, term.limits, &term.factors[..])
            );
        }
        let mut table = 0;
        for (bank, draft) in c.banks().iter().zip(&draft.banks) {
            for column in &draft.columns {
                let scale = match bank.format {
                    SampleFormat::F32 => 0.0,
                    // Rounding to the nearest integer is off by half a scale, and the product with the scale by half a
                    // bit.
                    SampleFormat::I16 => {
                        column.iter().fold(0.0, |m: f32, v| m.max(v.abs())) / 32767.0
                    }
                };
                for (point, &value) in column.iter().enumerate() {
                    let read = c.sample(table, point).unwrap();
                    assert!((read - value).abs() <= scale * 0.501, "{read} {value}");
                }
                assert_eq!(c.sample(table, column.len()), None);
                let samples = (0..column.len()).filter_map(|point| c.sample(table, point));
                let peak = samples.fold(0.0, |peak: f32, v| peak.max(v.abs()));
                assert_eq!(c.peak(table), Some(peak));
                table += 1;
            }
        }
        assert_eq!(c.tables(), table);
        assert_eq!(c.sample(table, 0), None);
        assert_eq!(c.peak(table), None);
        for (number, (grid, draft)) in c.grids().iter().zip(&draft.grids).enumerate() {
            assert_eq!(&grid.axes[..], &draft.axes);
            assert_eq!(&grid.outputs[..], &draft.outputs);
            let width = grid.outputs.len();
            for (place, &value) in draft.values.iter().enumerate() {
                let read = c.grid_sample(number, place / width, place % width).unwrap();
                let scale = grid.scales.first().copied().unwrap_or(0.0);
                assert!((read - value).abs() <= scale * 0.501, "{read} {value}");
            }
            assert_eq!(c.grid_sample(number, 0, width), None);
            assert_eq!(c.grid_sample(number, draft.values.len() / width, 0), None);
        }
        assert_eq!(c.samples(), 2 + 10 + 4 + 3 + 4 + 2 + 36 + 3);
        assert_eq!(c.inputs_used(), 0b1111);
    }

    #[test]
    fn drafts_that_do_not_fit_together_are_refused() {
        let mut draft = specimen::everything();
        draft.banks[1].columns[1].pop();
        assert_eq!(draft.encode(), Err(EncodeError::Columns { bank: 1 }));
        let mut draft = specimen::everything();
        draft.grids[0].values.pop();
        assert!(matches!(
            draft.encode(),
            Err(EncodeError::Values {
                grid: 0,
                expected: 36,
                found: 35
            })
        ));
        let mut draft = specimen::everything();
        draft.banks[3].columns[0][1] = f32::NAN;
        assert_eq!(draft.encode(), Err(EncodeError::NotFinite { index: 3 }));
        let mut draft = specimen::everything();
        draft.axes.clear();
        assert_eq!(draft.encode(), Err(EncodeError::Refused(LoadError::NoAxes)));
    }

    #[test]
    fn a_column_of_zeros_can_be_stored_as_integers() {
        let mut draft = specimen::everything();
        draft.banks[3].columns[0] = vec![0.0; 3];
        let blob = draft.encode().unwrap();
        let c = Largest::from_blob(&blob).unwrap();
        assert_eq!(c.sample(4, 1), Some(0.0));
    }
}
