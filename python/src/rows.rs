//! Arrays of positions.

use crate::error::raise;
use numpy::ndarray::ArrayView2;
use numpy::{
    PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

/// Rows between two looks at pending signals: a few milliseconds.
pub const LOOK: usize = 1 << 16;

/// One row per position, of either precision. An array of floats is read where it is, whatever its strides.
pub struct Rows<'py> {
    pub values: Values<'py>,
    /// Whether the caller gave one position and not a list of them.
    is_single: bool,
}

pub enum Values<'py> {
    F32(PyReadonlyArray2<'py, f32>),
    F64(PyReadonlyArray2<'py, f64>),
}

impl<'py> Rows<'py> {
    /// Of an array, of anything that numpy makes one of, or of a table with a named column for each of `names`.
    pub fn of(positions: &Bound<'py, PyAny>, names: &[String]) -> PyResult<Self> {
        let positions = match positions.hasattr("columns")? && positions.hasattr("to_numpy")? {
            true => named(positions, names)?,
            false => positions.clone(),
        };
        let numpy = positions.py().import("numpy")?;
        let is_single_precision = positions.extract::<PyReadonlyArrayDyn<'_, f32>>().is_ok();
        let dtype = if is_single_precision {
            "float32"
        } else {
            "float64"
        };
        let array = numpy
            .call_method1("asarray", (&positions, dtype))
            .map_err(|cause| {
                raise(
                    format!("positions must be numbers: {}", cause.value(positions.py())),
                    format!(
                        "give an array with a row for each position: {}",
                        names.join(", ")
                    ),
                )
            })?;
        let dimensions: usize = array.getattr("ndim")?.extract()?;
        let is_single = dimensions == 1;
        let rows = match dimensions {
            1 => array.call_method1("reshape", (1, -1))?,
            2 => array,
            _ => {
                return Err(raise(
                    format!("positions have {dimensions} dimensions"),
                    "give one position, or an array with a row for each",
                ));
            }
        };
        let values = match is_single_precision {
            true => Values::F32(rows.extract()?),
            false => Values::F64(rows.extract()?),
        };
        let rows = Self { values, is_single };
        let columns = rows.shape()[1];
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
        let shape = match &self.values {
            Values::F32(array) => array.shape(),
            Values::F64(array) => array.shape(),
        };
        [shape[0], shape[1]]
    }

    /// A copy, for functions that take rows; refuses values that are not finite.
    pub fn finite(&self, py: Python<'_>) -> PyResult<Vec<Vec<f64>>> {
        match &self.values {
            Values::F32(array) => copied(py, array.as_array()),
            Values::F64(array) => copied(py, array.as_array()),
        }
    }

    /// Results in the shape of the positions: one row for one position that was given alone.
    pub fn shaped<T: numpy::Element>(
        &self,
        found: Bound<'py, PyArray2<T>>,
    ) -> PyResult<Bound<'py, PyArrayDyn<T>>> {
        let [rows, columns] = [found.shape()[0], found.shape()[1]];
        match self.is_single {
            true => found.reshape(vec![columns]),
            false => found.reshape(vec![rows, columns]),
        }
    }
}

fn copied<T: Copy + Into<f64>>(
    py: Python<'_>,
    array: ArrayView2<'_, T>,
) -> PyResult<Vec<Vec<f64>>> {
    let mut rows = Vec::with_capacity(array.nrows());
    for (number, row) in array.rows().into_iter().enumerate() {
        if number % LOOK == LOOK - 1 {
            py.check_signals()?;
        }
        let row: Vec<f64> = row.iter().map(|v| (*v).into()).collect();
        if !row.iter().all(|v| v.is_finite()) {
            return Err(raise(
                format!("row {number} has a value that is not finite"),
                "remove rows with NaN and infinity first",
            ));
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The columns of these names, in this order. A table whose columns have only numbers is taken as it is.
fn named<'py>(table: &Bound<'py, PyAny>, names: &[String]) -> PyResult<Bound<'py, PyAny>> {
    let columns: Vec<String> = (table.getattr("columns")?.try_iter()?)
        .map(|name| Ok(name?.str()?.to_string()))
        .collect::<PyResult<_>>()?;
    if columns.iter().all(|name| name.parse::<u32>().is_ok()) {
        return table.call_method0("to_numpy");
    }
    let missing: Vec<&str> = (names.iter().map(String::as_str))
        .filter(|name| !columns.iter().any(|column| column == name))
        .collect();
    if !missing.is_empty() {
        return Err(raise(
            format!("the table has no column {}", missing.join(", ")),
            format!("name its columns {}; others are ignored", names.join(", ")),
        ));
    }
    table.get_item(names)?.call_method0("to_numpy")
}
