//! The controller's limits of the corrections of an axis.

use super::axes::{NamedAxes, unknown_axis};
use super::raw::{RawText, number};
use std::ops::Range;
use trueaxis_model::source::FileError;

/// A limit of the correction of an axis in the controller.
#[derive(Clone, Debug, PartialEq)]
pub struct CorrectionLimit {
    /// Index of the axis.
    pub axis: usize,
    /// What is limited.
    pub limited: Limited,
    /// The limit, in its unit.
    pub value: f64,
    /// Place in the file.
    pub span: Range<usize>,
}

impl CorrectionLimit {
    /// `name[axis]=value`, in the unit of the file.
    pub(super) fn read(
        limited: Limited,
        name: &str,
        indices: &[&str],
        written: RawText<'_>,
        axes: &NamedAxes,
    ) -> Result<Self, FileError> {
        let span = written.1.clone();
        let [axis] = indices else {
            return Err(FileError::here(
                span,
                format!("these are not the indices of {name}"),
                format!("write {name}[AX1], with one axis"),
            ));
        };
        let axis = axes.find(axis).ok_or_else(|| unknown_axis(axis, &span))?;
        let value = number(&written).ok().filter(|value| *value >= 0.0);
        let value = value.ok_or_else(|| {
            FileError::here(
                span.clone(),
                format!("this is not a limit: {name} is a number from 0"),
                "write a decimal number with a point, like 0.5",
            )
        })?;
        Ok(Self {
            axis,
            limited,
            value,
            span,
        })
    }
}

/// What a [`CorrectionLimit`] limits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limited {
    /// The sum of all tables (MD32720), in mm or degrees.
    Sum,
    /// The rate of change of the sum (MD32730), in per cent of the maximum speed of the axis.
    Velocity,
}

impl Limited {
    pub(super) fn of(name: &str) -> Option<Self> {
        match name {
            "$MA_CEC_MAX_SUM" => Some(Self::Sum),
            "$MA_CEC_MAX_VELO" => Some(Self::Velocity),
            _ => None,
        }
    }
}
