//! Machines and poses.

use crate::error::{NamedText, raise, warn};
use crate::errors::Errors;
use crate::interrupt::interruptible;
use crate::rows::Rows;
use numpy::{PyArray2, PyArrayDyn};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use trueaxis_model::errors::{ErrorModel, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::motion::situations;
use trueaxis_model::pose::ToolPose;
use trueaxis_model::positions::ColumnInput;
use trueaxis_model::{machine, parallel};

/// A machine: its axes, spindle, tool and workpiece, as in machine.toml.
#[pyclass(frozen, module = "trueaxis")]
#[derive(Clone)]
pub struct Machine(pub Arc<machine::Machine>, Arc<str>);

#[pymethods]
impl Machine {
    /// Reads machine.toml.
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Self::read(py, NamedText::read(&path)?)
    }

    /// Reads the text of a machine.toml.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: String) -> PyResult<Self> {
        Self::read(py, NamedText { file: None, text })
    }

    /// The text that the machine was read from.
    fn to_toml(&self) -> &str {
        &self.1
    }

    /// Name, to which error files and compensations refer.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// The chain from the workpiece w to the tool t; F is the foundation, S the spindle.
    #[getter]
    fn topology(&self) -> String {
        self.0.topology()
    }

    /// Letters of the axes, in the order of the columns of positions.
    #[getter]
    fn axes(&self) -> Vec<char> {
        self.0.axes.iter().map(|axis| axis.letter.char()).collect()
    }

    /// Names of the columns of positions: the axes, then the tool length (mm), if it is an input.
    #[getter(inputs)]
    fn names(&self) -> Vec<String> {
        self.inputs(None)
    }

    /// Ends of the travel of each axis (mm, deg): one row per axis.
    #[getter]
    fn travel<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let travel: Vec<Vec<f64>> = self.0.axes.iter().map(|a| a.travel.to_vec()).collect();
        Ok(PyArray2::from_vec2(py, &travel)?)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook(slf.as_any(), "machine")
    }

    fn __repr__(&self) -> String {
        format!("<Machine {:?}: {}>", self.0.name, self.0.topology())
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn _state(&self) -> (&str,) {
        (&self.1,)
    }

    #[staticmethod]
    fn _restored(text: String) -> PyResult<Self> {
        let text = NamedText { file: None, text };
        let machine = machine::Machine::from_toml(&text.text).map_err(|e| text.bad(e))?;
        Ok(Self(Arc::new(machine), text.text.into()))
    }
}

impl Machine {
    fn read(py: Python<'_>, text: NamedText) -> PyResult<Self> {
        let machine = machine::Machine::from_toml(&text.text).map_err(|e| text.bad(e))?;
        for doubt in machine::Machine::doubts(&text.text) {
            warn(py, &text.said(&doubt))?;
        }
        Ok(Self(Arc::new(machine), text.text.into()))
    }

    /// Names of the inputs of a machine with its errors.
    pub fn inputs(&self, errors: Option<&ErrorModel>) -> Vec<String> {
        let sensors = errors.into_iter().flat_map(|errors| &errors.sensors);
        let inputs = ColumnInput::of_machine(&self.0, sensors);
        inputs.into_iter().map(|input| input.name).collect()
    }
}

type Array<'py> = Bound<'py, PyArrayDyn<f64>>;

/// Tip (mm) and direction of the tool in the workpiece frame, one row per position; rows are a motion.
///
/// Positions are an array, a list, or a table with the axes as named columns. For a single position, each result is one
/// vector.
#[pyfunction]
#[pyo3(signature = (machine, positions, errors=None))]
pub fn pose<'py>(
    py: Python<'py>,
    machine: &Machine,
    positions: &Bound<'py, PyAny>,
    errors: Option<&Errors>,
) -> PyResult<(Array<'py>, Array<'py>)> {
    let known = match errors {
        Some(errors) => Some(errors.of(machine)?),
        None => None,
    };
    let positions = Rows::of(positions, &machine.inputs(known.map(|model| &**model)))?;
    let rows = positions.finite(py)?;
    let machine = Arc::clone(&machine.0);
    let model = known.map_or_else(|| Arc::new(ErrorModel::perfect(&machine)), Arc::clone);
    let tools = interruptible(py, move |abandoned| {
        let kinematics = Kinematics::new(&machine, &model);
        let along = situations(&machine, &rows);
        parallel::map(&along, |(q, situation)| {
            abandoned.look();
            ToolPose::of(&machine, &kinematics.actual(q, situation, &Switches::ALL))
        })
    })?;
    let array = |of: fn(&ToolPose) -> [f64; 3]| {
        let flat = tools.iter().flat_map(of).collect();
        positions.shaped(array(py, flat, tools.len(), 3)?)
    };
    Ok((array(|tool| tool.tip)?, array(|tool| tool.direction)?))
}

/// What a notebook shows, from the function of this name in `_html.py`.
pub fn in_notebook<'py>(whole: &Bound<'py, PyAny>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    whole
        .py()
        .import("trueaxis._html")?
        .call_method1(name, (whole,))
}

/// An array of rows.
pub fn array(
    py: Python<'_>,
    flat: Vec<f64>,
    rows: usize,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    use numpy::{PyArray1, PyArrayMethods};
    PyArray1::from_vec(py, flat)
        .reshape([rows, columns])
        .map_err(|error| raise(error.to_string(), "report this with the positions"))
}
