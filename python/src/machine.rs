//! Machines and poses.

use crate::error::Text;
use crate::errors::Errors;
use crate::rows::{Rows, finite};
use numpy::{PyArray2, ToPyArray};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::motion::situations;
use trueaxis_model::pose::Tool;
use trueaxis_model::positions::Input;
use trueaxis_model::{errors::Switches, kinematics::Kinematics, machine, parallel};

/// A machine.
#[pyclass(frozen, module = "trueaxis")]
pub struct Machine(pub Arc<machine::Machine>);

#[pymethods]
impl Machine {
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        Self::read(&Text::read(&path)?)
    }

    #[staticmethod]
    fn from_toml(text: String) -> PyResult<Self> {
        Self::read(&Text { file: None, text })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn axes(&self) -> Vec<char> {
        self.0.axes.iter().map(|axis| axis.letter.char()).collect()
    }

    #[getter]
    fn travel<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let travel: Vec<Vec<f64>> = self.0.axes.iter().map(|a| a.travel.to_vec()).collect();
        Ok(PyArray2::from_vec2(py, &travel)?)
    }

    fn __repr__(&self) -> String {
        format!("<Machine {:?}: {}>", self.0.name, self.0.topology())
    }
}

impl Machine {
    fn read(text: &Text) -> PyResult<Self> {
        let machine = machine::Machine::from_toml(&text.text).map_err(|e| text.bad(e))?;
        Ok(Self(Arc::new(machine)))
    }

    /// Names of the inputs of a machine with its errors.
    pub fn inputs(&self, errors: Option<&ErrorModel>) -> Vec<String> {
        let sensors = errors.into_iter().flat_map(|errors| &errors.sensors);
        let inputs = Input::of_machine(&self.0, sensors);
        inputs.into_iter().map(|input| input.name).collect()
    }
}

type Array<'py> = Bound<'py, PyArray2<f64>>;

/// Tip and direction of the tool in the workpiece frame.
#[pyfunction]
#[pyo3(signature = (machine, positions, errors=None))]
pub fn pose<'py>(
    py: Python<'py>,
    machine: &Machine,
    positions: &Bound<'py, PyAny>,
    errors: Option<&Errors>,
) -> PyResult<(Array<'py>, Array<'py>)> {
    let perfect;
    let (model, known) = match errors {
        Some(errors) => (&errors.model, Some(&errors.model)),
        None => {
            perfect = ErrorModel::perfect(&machine.0);
            (&perfect, None)
        }
    };
    let rows = Rows::of(positions, &machine.inputs(known))?.copied();
    finite(&rows)?;
    let tools = py.detach(|| {
        let kinematics = Kinematics::new(&machine.0, model);
        let along = situations(&machine.0, &rows);
        parallel::map(&along, |(q, situation)| {
            Tool::of(&machine.0, &kinematics.actual(q, situation, &Switches::ALL))
        })
    });
    let array = |of: fn(&Tool) -> [f64; 3]| {
        let flat: Vec<f64> = tools.iter().flat_map(of).collect();
        let shaped = numpy::ndarray::Array2::from_shape_vec((tools.len(), 3), flat);
        shaped.map(|array| array.to_pyarray(py)).map_err(shape)
    };
    Ok((array(|tool| tool.tip)?, array(|tool| tool.direction)?))
}

/// An array that does not have the shape of its values.
pub fn shape(error: numpy::ndarray::ShapeError) -> PyErr {
    pyo3::exceptions::PyRuntimeError::new_err(error.to_string())
}
