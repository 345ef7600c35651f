//! Compensations: made, read, evaluated.

use crate::error::{os_error, raise, warn, write};
use crate::errors::{Errors, policy};
use crate::interrupt::interruptible;
use crate::machine::{Machine, in_notebook};
use crate::rows::{LOOK, Rows, Values};
use numpy::ndarray::ArrayView2;
use numpy::{Element, PyArray2, PyArrayDyn, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::slice::ChunksExactMut;
use std::sync::Arc;
use trueaxis::{
    AlignedBlob, Bank, Direction, Inputs, Largest, LoadError, MOST_PERIODS, Reversal, Travel,
    Travelling,
};
use trueaxis_model::positions::ColumnInput;
use trueaxis_tables::compile::Options;
use trueaxis_tables::made::{self, VerifiedFigures};
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::target::Target;

/// Largest number of axes of a blob.
const MOST_AXES: usize = 16;

type Loaded<'a> = Box<Largest<'a>>;

self_cell::self_cell!(
    /// A compensation and the bytes that it reads.
    struct Owned {
        owner: AlignedBlob,
        #[covariant]
        dependent: Loaded,
    }
);

/// Tables that correct the errors of a machine.
#[pyclass(frozen, module = "trueaxis")]
pub struct Compensation {
    tables: Owned,
    made: Option<Made>,
}

type MadeState = (Machine, Errors, Vec<String>, String);

/// How a compensation was made.
#[derive(Clone)]
struct Made {
    machine: Machine,
    errors: Errors,
    warnings: Vec<String>,
    /// As JSON.
    verification: String,
}

#[pymethods]
impl Compensation {
    /// Reads a .trax file.
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        let blob = std::fs::read(&path).map_err(|error| os_error(&path, error))?;
        Self::load(&blob, None)
    }

    /// Reads the content of a .trax file.
    #[staticmethod]
    fn from_bytes(blob: &[u8]) -> PyResult<Self> {
        Self::load(blob, None)
    }

    /// The content of a .trax file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.tables.borrow_owner())
    }

    /// Writes a .trax file.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        write(&path, &**self.tables.borrow_owner())
    }

    /// Name of the machine.
    #[getter]
    fn machine(&self) -> &str {
        self.tables().machine()
    }

    /// Letters of the axes, in the order of the columns of corrections.
    #[getter]
    fn axes(&self) -> Vec<char> {
        self.tables()
            .axes()
            .iter()
            .map(|a| char::from(a.name))
            .collect()
    }

    /// Names of the columns of positions: the axes, then the tool length (mm) and temperatures (K).
    #[getter]
    fn inputs(&self) -> Vec<String> {
        let inputs =
            ColumnInput::of_compensation(self.tables().axes(), self.tables().auxiliaries());
        inputs.into_iter().map(|input| input.name).collect()
    }

    /// What the rotary axes correct.
    #[getter]
    fn policy(&self) -> String {
        self.tables().policy().to_string()
    }

    /// What trueaxis compile warns of; empty for a compensation that was read.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        let made = self.made.iter();
        made.flat_map(|made| made.warnings.clone()).collect()
    }

    /// Figures of the verification, with the keys of trueaxis compile --json, as a dictionary: the tolerance, the volumetric errors
    /// before and after, sizes, bounds. None for a compensation that was read.
    #[getter]
    fn verification<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let loads = |made: &Made| {
            py.import("json")?
                .call_method1("loads", (&made.verification,))
        };
        self.made.as_ref().map(loads).transpose()
    }

    fn __eq__(&self, other: &Self) -> bool {
        **self.tables.borrow_owner() == **other.tables.borrow_owner()
    }

    /// The machine and the errors that it was made from, if it was made here.
    #[getter]
    fn _source(&self) -> Option<(Machine, Errors)> {
        let made = self.made.as_ref();
        made.map(|made| (made.machine.clone(), made.errors.clone()))
    }

    fn _state<'py>(&self, py: Python<'py>) -> (Bound<'py, PyBytes>, Option<MadeState>) {
        let made = self.made.clone();
        let made = made.map(|made| (made.machine, made.errors, made.warnings, made.verification));
        (self.to_bytes(py), made)
    }

    #[staticmethod]
    fn _restored(
        blob: &[u8],
        made: Option<(PyRef<'_, Machine>, PyRef<'_, Errors>, Vec<String>, String)>,
    ) -> PyResult<Self> {
        let made = made.map(|(machine, errors, warnings, verification)| Made {
            machine: machine.clone(),
            errors: errors.clone(),
            warnings,
            verification,
        });
        Self::load(blob, made)
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        in_notebook(slf.as_any(), "compensation")
    }

    fn __repr__(&self) -> String {
        let tables = self.tables();
        format!(
            "<Compensation of {:?}: {} tables, {} grids, {} bytes>",
            tables.machine(),
            tables.tables(),
            tables.grids().len(),
            tables.blob_len()
        )
    }

    /// Corrections (mm, deg) before the limits, one row per position, as the controller computes them.
    ///
    /// Positions are an array, a list, or a table with the inputs as named columns. With motion, the order of the rows is the
    /// motion, which gives the direction of travel; without, directions are unknown. An array of floats is read in place, and
    /// other threads run meanwhile.
    #[pyo3(signature = (positions, *, motion=true))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
        motion: bool,
    ) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let rows = Rows::of(positions, &self.inputs())?;
        let tables = self.tables();
        let shape = [rows.shape()[0], tables.axes().len()];
        let found = PyArray2::<f32>::zeros(py, shape, false);
        let mut writable = found.try_readwrite()?;
        let to = writable.as_slice_mut()?;
        let failed = match &rows.values {
            Values::F32(array) => {
                let array = array.as_array();
                py.detach(|| evaluate(tables, array, to, motion))
            }
            Values::F64(array) => {
                let array = array.as_array();
                py.detach(|| evaluate(tables, array, to, motion))
            }
        };
        drop(writable);
        match failed {
            Ok(()) => rows.shaped(found),
            Err(Stop::Signal(raised)) => Err(raised),
            Err(Stop::Value(row, input)) => Err(unusable(tables, row, input)),
        }
    }
}

impl Compensation {
    fn load(blob: &[u8], made: Option<Made>) -> PyResult<Self> {
        Self::load_aligned(AlignedBlob::from_bytes(blob), made)
    }

    fn load_aligned(blob: AlignedBlob, made: Option<Made>) -> PyResult<Self> {
        let loaded = Owned::try_new(blob, |blob| -> Result<Loaded<'_>, LoadError> {
            let mut tables = Box::new(Largest::empty());
            tables.load(blob)?;
            Ok(tables)
        });
        let tables = loaded.map_err(|error| {
            raise(
                error.to_string(),
                "give the content of a .trax file, whole, and of this version",
            )
        })?;
        Ok(Self { tables, made })
    }

    fn tables(&self) -> &Largest<'_> {
        self.tables.borrow_dependent()
    }
}

/// Why rows are not all evaluated: a value of a row that cannot be used, by row and input, or a signal.
enum Stop {
    Value(usize, usize),
    Signal(PyErr),
}

/// Evaluates rows of axes and auxiliaries. With `motion`, directions of travel follow from the order of the rows; otherwise
/// they are unknown. Fails with the row and input of a value that is not usable.
fn evaluate<T: Element + Copy + Into<f64>>(
    tables: &Largest<'_>,
    rows: ArrayView2<'_, T>,
    to: &mut [f32],
    motion: bool,
) -> Result<(), Stop> {
    let columns = rows.ncols();
    let to = to.chunks_exact_mut(tables.axes().len());
    match rows.as_slice() {
        Some(values) => along(tables, values.chunks_exact(columns), to, motion),
        // Rows with strides, each in one piece.
        None => {
            let mut each = rows.rows().into_iter().map(|row| row.to_vec());
            along(tables, std::iter::from_fn(|| each.next()), to, motion)
        }
    }
}

/// An input of a row without a usable value.
fn unusable(tables: &Largest<'_>, row: usize, input: usize) -> PyErr {
    match input.checked_sub(tables.axes().len()) {
        Some(auxiliary) => raise(
            format!(
                "row {row}: {} is not finite",
                tables.auxiliaries()[auxiliary].name
            ),
            "give every auxiliary input a value in each row",
        ),
        None => raise(
            format!(
                "row {row}: the position of {} is not finite, or more than {MOST_PERIODS} periods away from zero",
                char::from(tables.axes()[input].name)
            ),
            "remove rows with NaN and infinity, and reduce positions of endless axes into a few turns",
        ),
    }
}

/// Like `evaluate`, for rows in one piece.
fn along<T: Copy + Into<f64>, R: AsRef<[T]>>(
    tables: &Largest<'_>,
    rows: impl Iterator<Item = R>,
    to: ChunksExactMut<'_, f32>,
    motion: bool,
) -> Result<(), Stop> {
    let axes = tables.axes();
    let mut farthest = [f32::MAX; MOST_AXES];
    for (i, most) in farthest.iter_mut().enumerate().take(axes.len()) {
        *most = tables.farthest(i).unwrap_or(f32::MAX);
    }
    // Without tables for a direction, no correction depends on it.
    let is_directed = |bank: &Bank| bank.direction != Direction::Both;
    let motion = motion && tables.banks().iter().any(is_directed);
    let mut reversals = [Reversal::new(); MOST_AXES];
    let mut inputs = Inputs::at([0.0; MOST_AXES]);
    let mut travelling = Travelling([Travel::Unknown; MOST_AXES]);
    let mut found = [0.0; MOST_AXES];
    let weights = tables.weights();
    for (number, (row, to)) in rows.zip(to).enumerate() {
        if number % LOOK == LOOK - 1 {
            Python::attach(|py| py.check_signals()).map_err(Stop::Signal)?;
        }
        let (positions, auxiliaries) = row.as_ref().split_at(axes.len());
        let mut usable = true;
        for ((q, most), value) in inputs.axes.iter_mut().zip(&farthest).zip(positions) {
            *q = (*value).into() as f32;
            // Not a number is not usable, either.
            usable &= q.abs() <= *most;
        }
        if !usable {
            let is_usable = |i: &usize| inputs.axes[*i].abs() <= farthest[*i];
            let axis = (0..axes.len()).take_while(is_usable).count();
            return Err(Stop::Value(number, axis));
        }
        for (i, (auxiliary, value)) in inputs.auxiliaries.iter_mut().zip(auxiliaries).enumerate() {
            *auxiliary = (*value).into() as f32;
            if !auxiliary.is_finite() {
                return Err(Stop::Value(number, axes.len() + i));
            }
        }
        if motion {
            for (i, axis) in axes.iter().enumerate() {
                travelling.0[i] =
                    reversals[i].update(inputs.axes[i], axis.reversal_threshold, axis.period);
            }
        }
        tables.evaluate_into(&inputs, &travelling, &weights, &mut found);
        to.copy_from_slice(&found[..to.len()]);
    }
    Ok(())
}

/// Makes and proves a compensation; the options are those of trueaxis compile. The tolerance is in µm.
///
/// What the command refuses is raised as Error. What it warns of is a TrueaxisWarning, and in Compensation.warnings.
#[pyfunction]
#[pyo3(signature = (machine, errors, *, policy="direction", damping=None, tolerance=None, scheme="exact", target="stm32f405",
    zero_at=None, best_effort=false, allow_large=false, random=20_000, seed=1))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn compile(
    py: Python<'_>,
    machine: &Machine,
    errors: &Errors,
    policy: &str,
    damping: Option<f64>,
    tolerance: Option<f64>,
    scheme: &str,
    target: &str,
    zero_at: Option<Vec<f64>>,
    best_effort: bool,
    allow_large: bool,
    random: usize,
    seed: u64,
) -> PyResult<Compensation> {
    let model = Arc::clone(errors.of(machine)?);
    let scheme: Scheme = scheme
        .parse()
        .map_err(|error| raise(format!("{error}"), "see the manual on schemes"))?;
    let target = Target::named(target).ok_or_else(|| {
        raise(
            format!("`{target}` is not a target"),
            "write stm32f405 or desktop",
        )
    })?;
    if tolerance.is_some_and(|um| !(um > 0.0 && um < 1e6)) {
        return Err(raise(
            "the tolerance is not a positive number",
            "write micrometres, like 0.1",
        ));
    }
    let mut options = Options {
        scheme,
        allow_large,
        random,
        seed,
        ..Options::default()
    };
    options.tables.policy = self::policy(policy, damping)?;
    options.tables.format = target.samples;
    options.tables.target = target;
    options.tables.zero_at = zero_at;
    let described = Arc::clone(&machine.0);
    let (options, made) = interruptible(py, move |abandoned| {
        let made = made::Made::new(&described, &model, &options, tolerance, abandoned);
        (options, made)
    })?;
    let made = made.map_err(|error| raise(error.to_string(), error.remedy()))?;
    let whole = accepted(made, &options, best_effort)?;
    let warnings = whole.warnings.iter().map(ToString::to_string);
    let missed = whole.missed.iter().map(ToString::to_string);
    let warnings: Vec<String> = warnings.chain(missed).collect();
    for warning in &warnings {
        warn(py, warning)?;
    }
    let made = Made {
        machine: machine.clone(),
        errors: errors.clone(),
        warnings,
        verification: verification(&whole)?,
    };
    Compensation::load_aligned(whole.best.built.blob, Some(made))
}

/// Tables that may be written.
fn accepted(made: made::Made, options: &Options, best_effort: bool) -> PyResult<Box<made::Whole>> {
    let may_be_written = made.may_be_written(best_effort);
    let whole = match made {
        made::Made::Verified(whole) => whole,
        made::Made::NoRoom(shortages) => {
            let name = &options.tables.target.name;
            return Err(raise(
                format!("the target {name} is too small: {}", all(&shortages)),
                options.scheme.smaller(),
            ));
        }
    };
    if may_be_written {
        return Ok(whole);
    }
    let coarser = whole.best.fits_um.map_or_else(
        || "a coarser tolerance".to_owned(),
        |um| format!("tolerance={um}, which is met"),
    );
    Err(raise(
        all(&whole.refusals),
        format!("give {coarser}, another target, or best_effort=True"),
    ))
}

/// The figures of a verification as JSON.
fn verification(whole: &made::Whole) -> PyResult<String> {
    let figures = ProofFigures {
        tolerance_um: whole.best.tolerance,
        meets_tolerance: whole.best.verification.meets(whole.best.tolerance),
        verified: VerifiedFigures::new(whole),
    };
    serde_json::to_string(&figures)
        .map_err(|error| raise(error.to_string(), "report this with the machine"))
}

/// What is kept of a verification.
#[derive(serde::Serialize)]
struct ProofFigures<'a> {
    tolerance_um: f64,
    meets_tolerance: bool,
    #[serde(flatten)]
    verified: VerifiedFigures<'a>,
}

/// Several sentences in one.
fn all(sentences: &[impl ToString]) -> String {
    let sentences: Vec<String> = sentences.iter().map(ToString::to_string).collect();
    sentences.join("; ")
}
