//! Positions and corrections as rows of little-endian f32: the same bits on both sides, with no overhead per number.

use super::frame::MOST_BODY;
use super::report::MOST_AXES;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::room::Row;
use crate::status::{Conditions, Correction, Status};

/// Maximum number of rows of a motion, whatever the number of axes.
pub const MOST_ROWS: usize = 32;
/// Bytes around the rows in a body.
const AROUND: usize = 4;
/// Length of the status in a row of results, bytes.
const STATUS: usize = 8;

/// Number of motion rows that fit into one answer.
#[must_use]
pub const fn motion_rows(axes: usize) -> usize {
    let rows = (MOST_BODY - AROUND) / (8 * axes + STATUS);
    if rows < MOST_ROWS { rows } else { MOST_ROWS }
}

/// Number of evaluation rows that fit into one request.
#[must_use]
pub const fn evaluate_rows(axes: usize, auxiliaries: usize) -> usize {
    (MOST_BODY - AROUND) / EvaluateRow::bytes(axes, auxiliaries)
}

const _: () = assert!(motion_rows(MOST_AXES) >= 1, "a row of results fits");

/// Writes the first `axes` positions as a row; `None` if they do not fit.
pub fn put_positions<'o>(q: &[f32], axes: usize, out: &'o mut [u8]) -> Option<&'o mut [u8]> {
    let (row, rest) = out.split_at_mut_checked(4 * axes)?;
    for (bytes, value) in row.chunks_exact_mut(4).zip(q.get(..axes)?) {
        bytes.copy_from_slice(&value.to_le_bytes());
    }
    Some(rest)
}

/// Reads a row of `axes` positions or corrections; the other entries are 0. Also returns the remaining bytes.
#[must_use]
pub fn positions<A: Row<f32>>(bytes: &[u8], axes: usize) -> Option<(A, &[u8])> {
    let (row, rest) = bytes.split_at_checked(4 * axes)?;
    let mut q = A::all(0.0);
    for (value, bytes) in q
        .as_mut()
        .get_mut(..axes)?
        .iter_mut()
        .zip(row.chunks_exact(4))
    {
        *value = f32::from_le_bytes(bytes.try_into().ok()?);
    }
    Some((q, rest))
}

/// One point at which to evaluate a compensation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EvaluateRow<A = [f32; 8], T = [Travel; 8]> {
    /// Positions and auxiliaries.
    pub inputs: Inputs<A>,
    /// Directions of travel.
    pub travelling: Travelling<T>,
}

impl EvaluateRow {
    /// Length of a row in bytes.
    #[must_use]
    pub const fn bytes(axes: usize, auxiliaries: usize) -> usize {
        4 * axes + 4 * auxiliaries + 4
    }
}

impl<A: Row<f32>, T: Row<Travel>> EvaluateRow<A, T> {
    /// Writes a row: positions, auxiliaries, and two bits for the direction of each axis (0
    /// unknown, 1 positive, 2 negative; the first axis lowest). Returns the rest of `out`.
    pub fn put<'o>(
        &self,
        axes: usize,
        auxiliaries: usize,
        out: &'o mut [u8],
    ) -> Option<&'o mut [u8]> {
        let rest = put_positions(self.inputs.axes.as_ref(), axes, out)?;
        let rest = put_positions(&self.inputs.auxiliaries, auxiliaries, rest)?;
        let (row, rest) = rest.split_first_chunk_mut::<4>()?;
        let mut directions = 0_u32;
        for (k, travel) in self
            .travelling
            .0
            .as_ref()
            .iter()
            .take(MOST_AXES)
            .enumerate()
        {
            directions |= match travel {
                Travel::Unknown => 0,
                Travel::Positive => 1,
                Travel::Negative => 2,
            } << (2 * k);
        }
        *row = directions.to_le_bytes();
        Some(rest)
    }

    /// Reads a row; also returns the remaining bytes. `None` if the input is too short or a direction is 3.
    #[must_use]
    pub fn get(bytes: &[u8], axes: usize, auxiliaries: usize) -> Option<(Self, &[u8])> {
        let (q, rest) = positions(bytes, axes)?;
        let mut inputs = Inputs::at(q);
        let rest = {
            let (values, rest) = positions(rest, auxiliaries)?;
            inputs.auxiliaries = values;
            rest
        };
        let (row, rest) = rest.split_first_chunk::<4>()?;
        let directions = u32::from_le_bytes(*row);
        let mut travelling = Travelling(T::all(Travel::Unknown));
        for (k, travel) in travelling.0.as_mut().iter_mut().take(MOST_AXES).enumerate() {
            *travel = match (directions >> (2 * k)) & 3 {
                0 => Travel::Unknown,
                1 => Travel::Positive,
                2 => Travel::Negative,
                _ => return None,
            };
        }
        Some((Self { inputs, travelling }, rest))
    }
}

/// Result of a servo update.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionResult<A = [f32; 8]>(pub Correction<A>);

impl MotionResult {
    /// Length of a row in bytes.
    #[must_use]
    pub const fn bytes(axes: usize) -> usize {
        8 * axes + STATUS
    }
}

impl<A: Row<f32>> MotionResult<A> {
    /// Writes a row: corrections, computed corrections, conditions, masks of saturated, of
    /// rate-limited and of travel-limited axes. Returns the rest of `out`.
    pub fn put<'o>(&self, axes: usize, out: &'o mut [u8]) -> Option<&'o mut [u8]> {
        let Correction {
            dq,
            computed,
            status,
        } = &self.0;
        let rest = put_positions(dq.as_ref(), axes, out)?;
        let rest = put_positions(computed.as_ref(), axes, rest)?;
        let (row, rest) = rest.split_first_chunk_mut::<STATUS>()?;
        let masks = [
            status.conditions.0,
            status.saturated,
            status.rate_limited,
            status.travel_limited,
        ];
        for (bytes, mask) in row.chunks_exact_mut(2).zip(masks) {
            bytes.copy_from_slice(&mask.to_le_bytes());
        }
        Some(rest)
    }

    /// Reads a row; also returns the remaining bytes.
    #[must_use]
    pub fn get(bytes: &[u8], axes: usize) -> Option<(Self, &[u8])> {
        let (dq, rest) = positions(bytes, axes)?;
        let (computed, rest) = positions(rest, axes)?;
        let (&[a, b, c, d, e, f, g, h], rest) = rest.split_first_chunk::<STATUS>()?;
        let status = Status {
            conditions: Conditions(u16::from_le_bytes([a, b])),
            saturated: u16::from_le_bytes([c, d]),
            rate_limited: u16::from_le_bytes([e, f]),
            travel_limited: u16::from_le_bytes([g, h]),
        };
        let correction = Correction {
            dq,
            computed,
            status,
        };
        Some((Self(correction), rest))
    }
}
