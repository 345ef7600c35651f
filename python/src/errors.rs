//! Error parameters and reference corrections.

use crate::error::{NamedText, raise, warn};
use crate::interrupt::interruptible;
use crate::machine::{Machine, array, in_notebook};
use crate::rows::Rows;
use numpy::PyArrayDyn;
use pyo3::prelude::*;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use trueaxis_direct::counted_twice;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Policy;
use trueaxis_model::motion;

/// The errors of a machine, as in errors.toml.
#[pyclass(frozen, module = "trueaxis")]
#[derive(Clone)]
pub struct Errors {
    machine: Machine,
    model: Arc<ErrorModel>,
    /// What they were read from: the text, and the files that it names.
    source: Arc<(String, Files)>,
}

/// Texts of files by their names.
pub type Files = BTreeMap<String, String>;

#[pymethods]
impl Errors {
    /// Reads errors.toml and the files that it names.
    #[staticmethod]
    fn from_file(py: Python<'_>, path: PathBuf, machine: &Machine) -> PyResult<Self> {
        let text = NamedText::read(&path)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_owned();
        let read = |name: &str| {
            let other = folder.join(name);
            std::fs::read_to_string(&other).map_err(|e| format!("{}: {e}", other.display()))
        };
        Self::read(text, machine, &read)?.warned(py)
    }

    /// Reads the text of an errors.toml that names no other files.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: String, machine: &Machine) -> PyResult<Self> {
        let text = NamedText { file: None, text };
        let none = |name: &str| Err(format!("`{name}` is not read here: a text has no folder"));
        Self::read(text, machine, &none)?.warned(py)
    }

    /// From parameters by name (mm, rad): Errors.from_dict({"EC0X": 50e-6}, machine).
    #[staticmethod]
    #[pyo3(signature = (parameters, machine, *, standard_uncertainty=None))]
    fn from_dict(
        py: Python<'_>,
        parameters: BTreeMap<String, Bound<'_, PyAny>>,
        machine: &Machine,
        standard_uncertainty: Option<BTreeMap<String, Bound<'_, PyAny>>>,
    ) -> PyResult<Self> {
        let mut text = head(machine) + &section("parameters", &numbers(parameters)?)?;
        if let Some(uncertainty) = standard_uncertainty {
            text += &section("standard_uncertainty", &numbers(uncertainty)?)?;
        }
        let none = |_: &str| Err(String::new());
        let model = ErrorModel::with_files(&text, &machine.0, &none)
            // There is no line: the dictionary is not a text.
            .map_err(|error| raise(error.message, error.remedy))?;
        Self::of_model(model, machine, text, Files::new()).warned(py)
    }

    /// A machine without errors.
    #[staticmethod]
    fn perfect(machine: &Machine) -> Self {
        let model = ErrorModel::perfect(&machine.0);
        let text = head(machine) + "[parameters]\n";
        Self::of_model(model, machine, text, Files::new())
    }

    /// The text that the errors were read from.
    fn to_toml(&self) -> &str {
        &self.source.0
    }

    /// The machine that they belong to.
    #[getter]
    fn machine(&self) -> Machine {
        self.machine.clone()
    }

    /// Names of the columns of positions: the axes, then the tool length (mm) and temperatures (K).
    #[getter]
    fn inputs(&self) -> Vec<String> {
        self.machine.inputs(Some(&self.model))
    }

    /// References of the inputs after the axes.
    #[getter]
    fn _references(&self) -> Vec<f64> {
        let machine = &self.machine.0;
        let length = machine.length_range.map(|_| machine.tool_length());
        let sensors = self.model.sensors.iter().map(|_| 0.0);
        length.into_iter().chain(sensors).collect()
    }

    /// Parameters by name (mm, rad, per mm or rad to the degree); measured motions are not among them.
    #[getter]
    fn parameters(&self) -> BTreeMap<String, f64> {
        let parameters = self.model.parameters.iter();
        parameters.map(|(name, v)| (name.to_string(), *v)).collect()
    }

    /// Standard uncertainties of the parameters that state one, in the same units.
    #[getter]
    fn standard_uncertainty(&self) -> BTreeMap<String, f64> {
        let known = self.model.covariance();
        let names = known.parameters.iter().map(ToString::to_string);
        let diagonal = known.matrix.diagonal();
        names.zip(diagonal.iter().map(|v| v.sqrt())).collect()
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook(slf.as_any(), "errors")
    }

    fn __repr__(&self) -> String {
        format!(
            "<Errors of {:?}: {} parameters>",
            self.machine.0.name,
            self.model.parameters.len()
        )
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.machine.0 == other.machine.0 && self.model == other.model
    }

    fn _state(&self) -> (&str, Files, Machine) {
        let (text, files) = &*self.source;
        (text, files.clone(), self.machine.clone())
    }

    #[staticmethod]
    fn _restored(text: String, files: Files, machine: &Machine) -> PyResult<Self> {
        Self::with_files(text, files, machine)
    }
}

/// The first line of an error file. A string of JSON is one of TOML.
fn head(machine: &Machine) -> String {
    format!(
        "machine = {}\n",
        serde_json::Value::from(machine.0.name.as_str())
    )
}

/// Values by name, or the name of the one that is no number.
fn numbers(values: BTreeMap<String, Bound<'_, PyAny>>) -> PyResult<BTreeMap<String, f64>> {
    let number = |(name, value): (String, Bound<'_, PyAny>)| match value.extract() {
        Ok(number) => Ok((name, number)),
        Err(_) => Err(raise(
            format!("{name}: {} is not a number", value.repr()?),
            "write mm or rad: 30 µm is 30e-3, 30 µrad is 30e-6",
        )),
    };
    values.into_iter().map(number).collect()
}

/// A section of an error file.
fn section(name: &str, values: &BTreeMap<String, f64>) -> PyResult<String> {
    let mut text = format!("[{name}]\n");
    for (parameter, value) in values {
        if !value.is_finite() {
            return Err(raise(
                format!("{parameter} is not finite"),
                "give each parameter a number, or leave it out",
            ));
        }
        let key = serde_json::Value::from(parameter.as_str());
        text += &format!("{key} = {value:e}\n");
    }
    Ok(text)
}

impl Errors {
    fn read(
        text: NamedText,
        machine: &Machine,
        read: &dyn Fn(&str) -> Result<String, String>,
    ) -> PyResult<Self> {
        let files = RefCell::new(Files::new());
        let kept = |name: &str| {
            let found = read(name)?;
            files.borrow_mut().insert(name.to_owned(), found.clone());
            Ok(found)
        };
        let model = ErrorModel::with_files(&text.text, &machine.0, &kept);
        let model = model.map_err(|e| text.bad(e))?;
        Ok(Self::of_model(
            model,
            machine,
            text.text,
            files.into_inner(),
        ))
    }

    /// From texts that are known.
    pub fn with_files(text: String, files: Files, machine: &Machine) -> PyResult<Self> {
        let read = |name: &str| {
            let found = files.get(name).cloned();
            found.ok_or_else(|| format!("`{name}` is missing"))
        };
        Self::read(NamedText { file: None, text }, machine, &read)
    }

    fn of_model(model: ErrorModel, machine: &Machine, text: String, files: Files) -> Self {
        Self {
            machine: machine.clone(),
            model: Arc::new(model),
            source: Arc::new((text, files)),
        }
    }

    /// Warns of errors that are counted twice.
    fn warned(self, py: Python<'_>) -> PyResult<Self> {
        if !self.model.slopes_beside_squareness {
            for doubt in counted_twice(&self.machine.0, &self.model) {
                warn(py, &format!("{doubt}\n  {}", doubt.remedy))?;
            }
        }
        Ok(self)
    }

    /// Refuses the errors of another machine.
    pub fn of<'a>(&'a self, machine: &Machine) -> PyResult<&'a Arc<ErrorModel>> {
        let own = &self.machine.0;
        match Arc::ptr_eq(own, &machine.0) || **own == *machine.0 {
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

/// Exact kinematic corrections (mm, deg), one row per position; rows are a motion.
///
/// The policy is direction, orientation or position; damping (0.01 to 1) belongs to direction.
#[pyfunction]
#[pyo3(signature = (machine, errors, positions, *, policy="direction", damping=None))]
pub fn correct<'py>(
    py: Python<'py>,
    machine: &Machine,
    errors: &Errors,
    positions: &Bound<'py, PyAny>,
    policy: &str,
    damping: Option<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let model = Arc::clone(errors.of(machine)?);
    let policy = self::policy(policy, damping)?;
    let positions = Rows::of(positions, &machine.inputs(Some(&model)))?;
    let rows = positions.finite(py)?;
    let (count, machine) = (rows.len(), Arc::clone(&machine.0));
    let axes = machine.axes.len();
    let found = interruptible(py, move |_| {
        motion::correct(&machine, &model, policy, &rows)
    })?;
    let found = found.map_err(|(row, error)| {
        raise(
            format!("row {}: {error}", row - 1),
            "look at the errors: they are too large for a correction there",
        )
    })?;
    positions.shaped(array(py, found.concat(), count, axes)?)
}
