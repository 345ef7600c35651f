//! Probings: read, simulated, identified.

use crate::error::{NamedText, raise, warn, write};
use crate::errors::Errors;
use crate::interrupt::interruptible;
use crate::machine::{Machine, in_notebook};
use numpy::PyArray2;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::{observations, probings};
use trueaxis_identify::simulate::{self, Disturbances};
use trueaxis_identify::{Model, ModelError};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_study::{Identification, RowRecord, Study, StudyRefusal, StudyRequest};

/// Positions of the axes with the stylus on balls.
#[pyclass(frozen, module = "trueaxis")]
pub struct Probings {
    machine: Machine,
    found: Arc<probings::Probings>,
}

#[pymethods]
impl Probings {
    /// Reads a file of probings.
    #[staticmethod]
    fn from_file(path: PathBuf, machine: &Machine) -> PyResult<Self> {
        Self::read(&NamedText::read(&path)?, machine)
    }

    /// Reads the text of a file of probings.
    #[staticmethod]
    fn from_csv(text: String, machine: &Machine) -> PyResult<Self> {
        Self::read(&NamedText { file: None, text }, machine)
    }

    /// The text of a file of probings, with rounded positions.
    fn to_csv(&self) -> String {
        probings::write(&self.found, &self.machine.0)
    }

    /// Writes a file of probings.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write(&path, self.to_csv())
    }

    /// Positions of the axes (mm, deg), one row per probing.
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let axes = self.machine.0.axes.len();
        let rows = self
            .found
            .rows
            .iter()
            .map(|row| row.position[..axes].to_vec());
        Ok(PyArray2::from_vec2(py, &rows.collect::<Vec<_>>())?)
    }

    /// The ball of each row.
    #[getter]
    fn balls(&self) -> Vec<String> {
        let rows = self.found.rows.iter();
        rows.map(|row| self.found.balls[row.ball].clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.found.rows.len()
    }

    fn __repr__(&self) -> String {
        let (rows, balls) = (self.found.rows.len(), self.found.balls.len());
        format!("<Probings: {rows} of {balls} balls>")
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.machine.0 == other.machine.0 && self.found == other.found
    }

    fn _state(&self) -> PyResult<(String, Machine)> {
        Ok((json(&*self.found)?, self.machine.clone()))
    }

    #[staticmethod]
    fn _restored(found: &str, machine: &Machine) -> PyResult<Self> {
        Ok(Self {
            machine: machine.clone(),
            found: Arc::new(of_json(found)?),
        })
    }
}

impl Probings {
    fn read(text: &NamedText, machine: &Machine) -> PyResult<Self> {
        let found = probings::read(&text.text, &machine.0, true).map_err(|e| text.bad(e))?;
        Ok(Self {
            machine: machine.clone(),
            found: Arc::new(found),
        })
    }
}

fn artefact(path: Option<PathBuf>, machine: &Machine) -> PyResult<Artefact> {
    let Some(path) = path else {
        return Ok(Artefact::default());
    };
    let text = NamedText::read(&path)?;
    Artefact::from_toml(&text.text, machine.0.tool_axis).map_err(|e| text.bad(e))
}

/// Probings as a machine with these errors would give them, with noise (µm) of each coordinate.
#[pyfunction]
#[pyo3(name = "simulate", signature = (machine, errors, *, artefact, plan, noise=0.0, seed=1))]
pub fn simulated(
    py: Python<'_>,
    machine: &Machine,
    errors: &Errors,
    artefact: PathBuf,
    plan: PathBuf,
    noise: f64,
    seed: u64,
) -> PyResult<Probings> {
    let model = Arc::clone(errors.of(machine)?);
    if !(0.0..=1e6).contains(&noise) {
        return Err(raise(
            "the noise is not a number of 0 or more",
            "write micrometres",
        ));
    }
    let artefact = self::artefact(Some(artefact), machine)?;
    let text = NamedText::read(&plan)?;
    let plan = probings::read(&text.text, &machine.0, false).map_err(|e| text.bad(e))?;
    let disturbances = Disturbances {
        noise: noise * 1e-3,
        seed,
        ..Disturbances::default()
    };
    let described = Arc::clone(&machine.0);
    let found = interruptible(py, move |_| {
        let kinematics = Kinematics::new(&described, &model);
        simulate::probings(&kinematics, &artefact, &plan, &disturbances)
    })?;
    let found = found.map_err(|error| {
        raise(
            error.to_string(),
            "correct the plan, or where the balls are in the artefact",
        )
    })?;
    Ok(Probings {
        machine: machine.clone(),
        found: Arc::new(found),
    })
}

/// Error parameters that were found.
#[pyclass(frozen, module = "trueaxis", name = "Identified")]
pub struct Found {
    machine: Machine,
    outcome: Outcome,
}

/// What an identification found.
#[derive(Clone, PartialEq, Serialize, Deserialize)]
struct Outcome {
    found: Identification,
    is_doubtful: bool,
    toml: String,
    covariance: String,
}

#[pymethods]
impl Found {
    /// The errors, with their covariance.
    #[getter]
    fn errors(&self) -> PyResult<Errors> {
        let files = [(COVARIANCE.to_owned(), self.outcome.covariance.clone())];
        Errors::with_files(self.outcome.toml.clone(), files.into(), &self.machine)
    }

    /// Parameters by name (mm, rad, per mm or rad to the degree).
    #[getter]
    fn parameters(&self) -> BTreeMap<String, f64> {
        let parameters = self.outcome.found.parameters.iter();
        parameters.map(|p| (p.parameter.clone(), p.value)).collect()
    }

    /// Their standard uncertainties, in the same units.
    #[getter]
    fn standard_uncertainty(&self) -> BTreeMap<String, f64> {
        let parameters = self.outcome.found.parameters.iter();
        parameters
            .map(|p| (p.parameter.clone(), p.standard_uncertainty))
            .collect()
    }

    /// Standard deviation of one coordinate of a probing (µm), from the residuals.
    #[getter]
    fn noise_um(&self) -> f64 {
        self.outcome.found.noise_um
    }

    /// Names of the unknowns that could not be identified. to_dict()["unseen"] gives the reasons.
    #[getter]
    fn unseen(&self) -> Vec<String> {
        let unseen = self.outcome.found.unseen.iter();
        unseen.map(|one| one.unknown.clone()).collect()
    }

    /// Lines of the file of probings that do not fit the others. to_dict()["outliers"] gives causes and remedies.
    #[getter]
    fn outliers(&self) -> Vec<usize> {
        let outliers = self.outcome.found.outliers.iter();
        let lines: BTreeSet<usize> = outliers.flat_map(|one| one.lines.clone()).collect();
        lines.into_iter().collect()
    }

    /// What each probing is off by (µm) without the errors found and with them, along the axes of the workpiece frame.
    #[getter]
    #[expect(clippy::type_complexity, reason = "two arrays")]
    fn residuals_um<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let rows = &self.outcome.found.rows;
        let array = |of: fn(&RowRecord) -> [f64; 3]| {
            crate::machine::array(py, rows.iter().flat_map(of).collect(), rows.len(), 3)
        };
        Ok((array(|row| row.before_um)?, array(|row| row.after_um)?))
    }

    /// What to check before the parameters are trusted, as trueaxis identify prints it.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let warnings = self.outcome.found.warnings.iter();
        warnings.map(ToString::to_string).collect()
    }

    /// True where trueaxis identify exits with 1: rows contradict each other.
    #[getter]
    fn is_doubtful(&self) -> bool {
        self.outcome.is_doubtful
    }

    /// What trueaxis identify --json prints.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string_pretty(&self.outcome.found).map_err(not_json)
    }

    /// Like `to_json`, as a dictionary.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let loads = py.import("json")?.getattr("loads")?;
        loads.call1((json(&self.outcome.found)?,))
    }

    /// Writes the error file and, in the same folder, the file of covariances.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        let other = path.with_extension("covariance.csv");
        let name = other
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        write(&other, &self.outcome.covariance)?;
        write(&path, self.outcome.toml.replace(COVARIANCE, &name))
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook(slf.as_any(), "identified")
    }

    fn __repr__(&self) -> String {
        let (parameters, noise) = (self.outcome.found.parameters.len(), self.noise_um());
        format!("<Identified: {parameters} parameters, noise {noise:.2} µm>")
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.machine.0 == other.machine.0 && self.outcome == other.outcome
    }

    fn _state(&self) -> PyResult<(String, Machine)> {
        Ok((json(&self.outcome)?, self.machine.clone()))
    }

    #[staticmethod]
    fn _restored(outcome: &str, machine: &Machine) -> PyResult<Self> {
        Ok(Self {
            machine: machine.clone(),
            outcome: of_json(outcome)?,
        })
    }
}

fn json(value: &impl Serialize) -> PyResult<String> {
    serde_json::to_string(value).map_err(not_json)
}

fn not_json(error: serde_json::Error) -> PyErr {
    raise(error.to_string(), "report this with the measurements")
}

fn of_json<T: serde::de::DeserializeOwned>(text: &str) -> PyResult<T> {
    serde_json::from_str(text)
        .map_err(|error| raise(error.to_string(), "unpickle what this version has pickled"))
}

/// The name of the covariance file in the text of a result.
const COVARIANCE: &str = "covariance.csv";

/// Error parameters from probings and files of observations; options are those of trueaxis identify.
///
/// What the command refuses is raised as Error. What it warns of is a TrueaxisWarning, and in Identified.warnings.
#[pyfunction]
#[pyo3(name = "identify", signature = (machine, probings=None, *, artefact=None, observations=Vec::new(), model="auto", robust=false,
    without=Vec::new(), accept_places=false))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn identified(
    py: Python<'_>,
    machine: &Machine,
    probings: Option<&Probings>,
    artefact: Option<PathBuf>,
    observations: Vec<PathBuf>,
    model: &str,
    robust: bool,
    without: Vec<String>,
    accept_places: bool,
) -> PyResult<Found> {
    let mut observed = observations::Observations::default();
    for path in observations {
        let text = NamedText::read(&path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let one = observations::read(&text.text, &name, &machine.0).map_err(|e| text.bad(e))?;
        observed
            .add(one)
            .map_err(|(message, remedy)| raise(message, remedy))?;
    }
    let probings = probings.map(|probings| Arc::clone(&probings.found));
    let artefact = self::artefact(artefact, machine)?;
    let model: Model = model
        .parse()
        .map_err(|error: ModelError| raise(error.reason, error.remedy))?;
    let described = Arc::clone(&machine.0);
    let outcome = interruptible(py, move |_| -> Result<Outcome, StudyRefusal> {
        let study = Study {
            machine: &described,
            probings: &probings.unwrap_or_default(),
            artefact: &artefact,
            observations: &observed,
            runs: &[],
            base: &ErrorModel::perfect(&described),
        };
        let request = StudyRequest {
            robust,
            without,
            accept_places,
            ..StudyRequest::of(model)
        };
        let found = study.identify(&request)?;
        Ok(Outcome {
            toml: found.error_file(COVARIANCE),
            covariance: found.covariances(),
            is_doubtful: found.is_doubtful(),
            found: Identification::of(&found),
        })
    })?;
    let found = Found {
        machine: machine.clone(),
        outcome: outcome.map_err(|refusal| raise(refusal.to_string(), refusal.remedy()))?,
    };
    for warning in found.warnings() {
        warn(py, &warning)?;
    }
    Ok(found)
}
