//! Probings: read, simulated, identified.

use crate::error::{Text, raise};
use crate::errors::Errors;
use crate::machine::Machine;
use numpy::PyArray2;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::{observations, probings};
use trueaxis_measure::identify::{Model, ModelError};
use trueaxis_measure::simulate::{self, Disturbances};
use trueaxis_measure::study::{Identification, Refusal, Request, Study};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;

/// Probings of balls.
#[pyclass(frozen, module = "trueaxis")]
pub struct Probings {
    machine: Arc<trueaxis_model::machine::Machine>,
    found: probings::Probings,
}

#[pymethods]
impl Probings {
    #[staticmethod]
    fn from_file(path: PathBuf, machine: &Machine) -> PyResult<Self> {
        Self::read(&Text::read(&path)?, machine)
    }

    #[staticmethod]
    fn from_csv(text: String, machine: &Machine) -> PyResult<Self> {
        Self::read(&Text { file: None, text }, machine)
    }

    fn to_csv(&self) -> String {
        probings::write(&self.found, &self.machine)
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, self.to_csv())?)
    }

    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let axes = self.machine.axes.len();
        let rows = self
            .found
            .rows
            .iter()
            .map(|row| row.position[..axes].to_vec());
        Ok(PyArray2::from_vec2(py, &rows.collect::<Vec<_>>())?)
    }

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
}

impl Probings {
    fn read(text: &Text, machine: &Machine) -> PyResult<Self> {
        let found = probings::read(&text.text, &machine.0, true).map_err(|e| text.bad(e))?;
        let machine = Arc::clone(&machine.0);
        Ok(Self { machine, found })
    }
}

fn artefact(path: Option<PathBuf>, machine: &Machine) -> PyResult<Artefact> {
    let Some(path) = path else {
        return Ok(Artefact::default());
    };
    let text = Text::read(&path)?;
    Artefact::from_toml(&text.text, machine.0.tool_axis).map_err(|e| text.bad(e))
}

/// Probings as a machine with these errors would give them.
#[pyfunction]
#[pyo3(name = "simulate", signature = (machine, errors, *, artefact, strategy, noise=0.0, seed=1))]
pub fn simulated(
    py: Python<'_>,
    machine: &Machine,
    errors: &Errors,
    artefact: PathBuf,
    strategy: PathBuf,
    noise: f64,
    seed: u64,
) -> PyResult<Probings> {
    let model = errors.of(machine)?;
    if !(0.0..=1e6).contains(&noise) {
        return Err(raise(
            "the noise is not a number of 0 or more",
            "write micrometres",
        ));
    }
    let artefact = self::artefact(Some(artefact), machine)?;
    let text = Text::read(&strategy)?;
    let strategy = probings::read(&text.text, &machine.0, false).map_err(|e| text.bad(e))?;
    let disturbances = Disturbances {
        noise: noise * 1e-3,
        seed,
        ..Disturbances::default()
    };
    let found = py.detach(|| {
        let kinematics = Kinematics::new(&machine.0, model);
        simulate::probings(&kinematics, &artefact, &strategy, &disturbances)
    });
    let found = found.map_err(|error| {
        raise(
            error.to_string(),
            "correct the strategy, or where the balls are in the artefact",
        )
    })?;
    let machine = Arc::clone(&machine.0);
    Ok(Probings { machine, found })
}

/// The result of an identification.
#[pyclass(frozen, module = "trueaxis", name = "Identified")]
pub struct Found {
    machine: Arc<trueaxis_model::machine::Machine>,
    found: Identification,
    is_doubtful: bool,
    toml: String,
    covariance: String,
}

#[pymethods]
impl Found {
    #[getter]
    fn errors(&self) -> PyResult<Errors> {
        let read = |_: &str| Ok(self.covariance.clone());
        let model = ErrorModel::with_files(&self.toml, &self.machine, &read);
        let text = Text {
            file: None,
            text: self.toml.clone(),
        };
        Ok(Errors {
            machine: Arc::clone(&self.machine),
            model: model.map_err(|e| text.bad(e))?,
        })
    }

    #[getter]
    fn parameters(&self) -> BTreeMap<String, f64> {
        let parameters = self.found.parameters.iter();
        parameters.map(|p| (p.parameter.clone(), p.value)).collect()
    }

    #[getter]
    fn standard_uncertainty(&self) -> BTreeMap<String, f64> {
        let parameters = self.found.parameters.iter();
        parameters
            .map(|p| (p.parameter.clone(), p.standard_uncertainty))
            .collect()
    }

    #[getter]
    fn noise_um(&self) -> f64 {
        self.found.noise_um
    }

    #[getter]
    fn unseen(&self) -> usize {
        self.found.unseen.len()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        let warnings = self.found.warnings.iter();
        warnings.map(ToString::to_string).collect()
    }

    #[getter]
    fn is_doubtful(&self) -> bool {
        self.is_doubtful
    }

    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string_pretty(&self.found)
            .map_err(|error| raise(error.to_string(), "report this with the measurements"))
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        let other = path.with_extension("covariance.csv");
        let name = other
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        std::fs::write(other, &self.covariance)?;
        Ok(std::fs::write(path, self.toml.replace(COVARIANCE, &name))?)
    }

    fn __repr__(&self) -> String {
        let (parameters, noise) = (self.found.parameters.len(), self.noise_um());
        format!("<Identified: {parameters} parameters, noise {noise:.2} µm>")
    }
}

/// The name of the covariance file in the text of a result.
const COVARIANCE: &str = "covariance.csv";

/// Error parameters from probings and observations.
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
        let text = Text::read(&path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let one = observations::read(&text.text, &name, &machine.0).map_err(|e| text.bad(e))?;
        observed
            .add(one)
            .map_err(|(message, remedy)| raise(message, remedy))?;
    }
    let none = probings::Probings::default();
    let study = Study {
        machine: &machine.0,
        probings: probings.map_or(&none, |probings| &probings.found),
        artefact: &self::artefact(artefact, machine)?,
        observations: &observed,
        runs: &[],
        base: &ErrorModel::perfect(&machine.0),
    };
    let model: Model = model
        .parse()
        .map_err(|error: ModelError| raise(error.reason, error.remedy))?;
    let found = py.detach(|| -> Result<Found, Refusal> {
        let request = Request {
            robust,
            without,
            accept_places,
            ..Request::of(model)
        };
        let found = study.identify(&request)?;
        Ok(Found {
            machine: Arc::clone(&machine.0),
            toml: found.error_file(COVARIANCE),
            covariance: found.covariances(),
            is_doubtful: found.is_doubtful(),
            found: Identification::of(&found),
        })
    });
    found.map_err(|refusal| raise(refusal.to_string(), refusal.remedy()))
}
