//! Arrays of positions.

use crate::error::raise;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

/// One row per position, of either precision; read where it is, whatever its strides.
pub enum Rows<'py> {
    F32(PyReadonlyArray2<'py, f32>),
    F64(PyReadonlyArray2<'py, f64>),
}

impl<'py> Rows<'py> {
    /// Checks that an object is an array of rows with a value for each of `names`.
    pub fn of(array: &Bound<'py, PyAny>, names: &[String]) -> PyResult<Self> {
        let rows = match array.extract::<PyReadonlyArray2<'py, f64>>() {
            Ok(rows) => Self::F64(rows),
            Err(_) => Self::F32(array.extract().map_err(|_| {
                raise(
                    "positions must be a two-dimensional array of float64 or float32",
                    format!(
                        "write np.array([[…], …], dtype=float), with a row for each position: {}",
                        names.join(", ")
                    ),
                )
            })?),
        };
        let [_, columns] = rows.shape();
        match columns == names.len() {
            true => Ok(rows),
            false => Err(raise(
                format!("the array has {columns} columns instead of {}", names.len()),
                format!("give each row its {}", names.join(", ")),
            )),
        }
    }

    /// Number of rows and columns.
    pub fn shape(&self) -> [usize; 2] {
        let shape = match self {
            Self::F32(array) => array.shape(),
            Self::F64(array) => array.shape(),
        };
        [shape[0], shape[1]]
    }

    /// A copy, for functions that take rows.
    pub fn copied(&self) -> Vec<Vec<f64>> {
        match self {
            Self::F32(array) => (array.as_array().rows().into_iter())
                .map(|row| row.iter().map(|v| f64::from(*v)).collect())
                .collect(),
            Self::F64(array) => (array.as_array().rows().into_iter())
                .map(|row| row.to_vec())
                .collect(),
        }
    }
}

/// Refuses rows with a value that is not finite.
pub fn finite(rows: &[Vec<f64>]) -> PyResult<()> {
    match rows
        .iter()
        .position(|row| !row.iter().all(|v| v.is_finite()))
    {
        None => Ok(()),
        Some(row) => Err(raise(
            format!("row {row} has a value that is not finite"),
            "remove rows with NaN and infinity first",
        )),
    }
}
