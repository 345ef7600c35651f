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
use trueaxis_measure::identify::{
    Identified, IdentifyError, Model, ModelError, NotKnown, Options, Problem, automatic, drifting,
    error_file, held_out, honesty, identify,
};
use trueaxis_measure::simulate::{self, Disturbances};
use trueaxis_model::errors::{ErrorModel, covariance};
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
    found: Identified,
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
        parameters
            .map(|p| (p.parameter.to_string(), p.value))
            .collect()
    }

    #[getter]
    fn standard_uncertainty(&self) -> BTreeMap<String, f64> {
        let parameters = self.found.parameters.iter();
        parameters
            .map(|p| (p.parameter.to_string(), p.uncertainty))
            .collect()
    }

    #[getter]
    fn noise_um(&self) -> f64 {
        self.found.noise * 1e3
    }

    #[getter]
    fn unseen(&self) -> usize {
        self.found.unseen.len()
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
#[pyo3(name = "identify", signature = (machine, probings=None, *, artefact=None, observations=Vec::new(), model="auto", robust=false))]
pub fn identified(
    py: Python<'_>,
    machine: &Machine,
    probings: Option<&Probings>,
    artefact: Option<PathBuf>,
    observations: Vec<PathBuf>,
    model: &str,
    robust: bool,
) -> PyResult<Found> {
    let artefact = self::artefact(artefact, machine)?;
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
    let measured = probings.map_or(&none, |probings| &probings.found);
    let bad = |error: ModelError| raise(error.reason, error.remedy);
    let model: Model = model.parse().map_err(bad)?;
    let parameters = match model {
        Model::Auto => Vec::new(),
        _ => model.parameters(&machine.0, 0, &[]).map_err(bad)?,
    };
    let options = Options {
        robust,
        ..Options::default()
    };
    let base = ErrorModel::perfect(&machine.0);
    let found = py.detach(|| -> Result<Identified, IdentifyError> {
        if model == Model::Auto {
            let chosen = automatic(&machine.0, measured, &artefact, &observed, &base, options)?;
            observed.drift.clone_from(&chosen.drift);
            return Ok(chosen.identified);
        }
        let problem = || Problem::new(&machine.0, measured, &artefact, &parameters, &base);
        let steady = problem().with(&observed);
        let found = identify(&steady, options)?;
        observed.drift = drifting(&steady, &found);
        match observed.drift.is_empty() {
            true => Ok(found),
            false => identify(&problem().with(&observed), options),
        }
    });
    let found = found.map_err(|error| raise(error.to_string(), error.remedy()))?;
    let problem = Problem::new(&machine.0, measured, &artefact, &found.looked_for, &base);
    let problem = problem.with(&observed);
    let predicted = held_out(
        &machine.0,
        measured,
        &artefact,
        &observed,
        &found.looked_for,
        &base,
        options,
    );
    let honesty = honesty(&problem, measured, &found);
    let not_known = NotKnown::of(&problem, &found, &honesty, predicted.as_ref().ok());
    let not_known = not_known.map_err(|error| raise(error.to_string(), error.remedy()))?;
    Ok(Found {
        toml: error_file(
            &machine.0, measured, &observed, &found, &not_known, COVARIANCE,
        ),
        covariance: covariance::write(&found.known),
        machine: Arc::clone(&machine.0),
        found,
    })
}
