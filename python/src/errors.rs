//! Error parameters and exact corrections.

use crate::error::{Text, raise};
use crate::machine::{Machine, shape};
use crate::rows::{Rows, finite};
use numpy::{PyArray2, ToPyArray};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Policy;
use trueaxis_model::machine;
use trueaxis_model::motion;

/// The errors of a machine.
#[pyclass(frozen, module = "trueaxis")]
pub struct Errors {
    pub machine: Arc<machine::Machine>,
    pub model: ErrorModel,
}

#[pymethods]
impl Errors {
    #[staticmethod]
    fn from_file(path: PathBuf, machine: &Machine) -> PyResult<Self> {
        let text = Text::read(&path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let read = |name: &str| {
            let other = folder.join(name);
            std::fs::read_to_string(&other).map_err(|e| format!("{}: {e}", other.display()))
        };
        Self::read(&text, machine, &read)
    }

    #[staticmethod]
    fn from_toml(text: String, machine: &Machine) -> PyResult<Self> {
        let text = Text { file: None, text };
        Self::read(&text, machine, &|name| {
            Err(format!("`{name}` is not read here: a text has no folder"))
        })
    }

    #[staticmethod]
    fn perfect(machine: &Machine) -> Self {
        Self {
            machine: Arc::clone(&machine.0),
            model: ErrorModel::perfect(&machine.0),
        }
    }

    #[getter]
    fn parameters(&self) -> BTreeMap<String, f64> {
        let parameters = self.model.parameters.iter();
        parameters.map(|(name, v)| (name.to_string(), *v)).collect()
    }

    #[getter]
    fn standard_uncertainty(&self) -> BTreeMap<String, f64> {
        let known = self.model.covariance();
        let names = known.parameters.iter().map(ToString::to_string);
        let diagonal = known.matrix.diagonal();
        names.zip(diagonal.iter().map(|v| v.sqrt())).collect()
    }

    fn __repr__(&self) -> String {
        format!(
            "<Errors of {:?}: {} parameters>",
            self.machine.name,
            self.model.parameters.len()
        )
    }
}

impl Errors {
    fn read(
        text: &Text,
        machine: &Machine,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> PyResult<Self> {
        let model = ErrorModel::with_files(&text.text, &machine.0, read);
        Ok(Self {
            machine: Arc::clone(&machine.0),
            model: model.map_err(|e| text.bad(e))?,
        })
    }

    /// Refuses the errors of another machine.
    pub fn of<'a>(&'a self, machine: &Machine) -> PyResult<&'a ErrorModel> {
        match Arc::ptr_eq(&self.machine, &machine.0) || *self.machine == *machine.0 {
            true => Ok(&self.model),
            false => Err(raise(
                "the errors were read for another machine",
                "read them with this machine: Errors.from_file(path, machine)",
            )),
        }
    }
}

/// A policy by its name.
pub fn policy(name: &str, damping: Option<f64>) -> PyResult<Policy> {
    match (name, damping) {
        ("direction", None) => Ok(Policy::default()),
        ("direction", Some(damping)) if (0.01..=1.0).contains(&damping) => {
            Ok(Policy::Direction { damping })
        }
        ("direction", Some(_)) => Err(raise("the damping is out of range", "write 0.01 to 1")),
        ("orientation", None) => Ok(Policy::Orientation),
        ("position", None) => Ok(Policy::Position),
        ("orientation" | "position", Some(_)) => Err(raise(
            format!("policy {name} has no damping"),
            "leave out damping, or use policy=\"direction\"",
        )),
        _ => Err(raise(
            format!("`{name}` is not a policy"),
            "write direction, orientation or position",
        )),
    }
}

/// Exact kinematic corrections.
#[pyfunction]
#[pyo3(signature = (machine, errors, positions, *, policy="direction", damping=None))]
pub fn correct<'py>(
    py: Python<'py>,
    machine: &Machine,
    errors: &Errors,
    positions: &Bound<'py, PyAny>,
    policy: &str,
    damping: Option<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let model = errors.of(machine)?;
    let policy = self::policy(policy, damping)?;
    let rows = Rows::of(positions, &machine.inputs(Some(model)))?.copied();
    finite(&rows)?;
    let found = py.detach(|| motion::correct(&machine.0, model, policy, &rows));
    let found = found.map_err(|(row, error)| {
        raise(
            format!("row {}: {error}", row - 1),
            "look at the errors: they are too large for a correction there",
        )
    })?;
    let flat: Vec<f64> = found.concat();
    let shaped = numpy::ndarray::Array2::from_shape_vec((rows.len(), machine.0.axes.len()), flat);
    Ok(shaped.map_err(shape)?.to_pyarray(py))
}
