//! Compensations: made, read, evaluated.

use crate::error::raise;
use crate::errors::{Errors, policy};
use crate::machine::Machine;
use crate::rows::Rows;
use numpy::ndarray::ArrayView2;
use numpy::{Element, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::path::PathBuf;
use std::slice::ChunksExactMut;
use trueaxis::{
    AlignedBlob, Bank, Direction, Inputs, Largest, LoadError, MOST_PERIODS, Reversal, Travel,
    Travelling,
};
use trueaxis_model::positions::Input;
use trueaxis_tables::compile::Options;
use trueaxis_tables::made::Made;
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

/// A compensation.
#[pyclass(frozen, module = "trueaxis")]
pub struct Compensation {
    tables: Owned,
    warnings: Vec<String>,
}

#[pymethods]
impl Compensation {
    #[staticmethod]
    fn from_file(path: PathBuf) -> PyResult<Self> {
        Self::load(AlignedBlob::from_bytes(&std::fs::read(path)?))
    }

    #[staticmethod]
    fn from_bytes(blob: &[u8]) -> PyResult<Self> {
        Self::load(AlignedBlob::from_bytes(blob))
    }

    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.tables.borrow_owner())
    }

    fn save(&self, path: PathBuf) -> PyResult<()> {
        Ok(std::fs::write(path, &**self.tables.borrow_owner())?)
    }

    #[getter]
    fn machine(&self) -> &str {
        self.tables().machine()
    }

    #[getter]
    fn axes(&self) -> Vec<char> {
        self.tables()
            .axes()
            .iter()
            .map(|a| char::from(a.name))
            .collect()
    }

    #[getter]
    fn inputs(&self) -> Vec<String> {
        let inputs = Input::of_compensation(self.tables().axes(), self.tables().auxiliaries());
        inputs.into_iter().map(|input| input.name).collect()
    }

    #[getter]
    fn policy(&self) -> String {
        self.tables().policy().to_string()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.warnings.clone()
    }

    /// Corrections before the guard rails.
    #[pyo3(signature = (positions, *, motion=true))]
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        positions: &Bound<'py, PyAny>,
        motion: bool,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rows = Rows::of(positions, &self.inputs())?;
        let tables = self.tables();
        let shape = [rows.shape()[0], tables.axes().len()];
        let found = PyArray2::<f32>::zeros(py, shape, false);
        let mut writable = found.try_readwrite()?;
        let to = writable.as_slice_mut()?;
        let failed = match &rows {
            Rows::F32(array) => {
                let array = array.as_array();
                py.detach(|| evaluate(tables, array, to, motion))
            }
            Rows::F64(array) => {
                let array = array.as_array();
                py.detach(|| evaluate(tables, array, to, motion))
            }
        };
        drop(writable);
        match failed {
            Ok(()) => Ok(found),
            Err((row, input)) if input >= tables.axes().len() => Err(raise(
                format!(
                    "row {row}: {} is not finite",
                    tables.auxiliaries()[input - tables.axes().len()].name
                ),
                "give every auxiliary input a value in each row",
            )),
            Err((row, axis)) => Err(raise(
                format!(
                    "row {row}: the position of {} is not finite, or more than {MOST_PERIODS} periods away from zero",
                    char::from(tables.axes()[axis].name)
                ),
                "remove rows with NaN and infinity, and reduce positions of endless axes into a few turns",
            )),
        }
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
}

impl Compensation {
    fn load(blob: AlignedBlob) -> PyResult<Self> {
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
        Ok(Self {
            tables,
            warnings: Vec::new(),
        })
    }

    fn tables(&self) -> &Largest<'_> {
        self.tables.borrow_dependent()
    }
}

/// Evaluates rows of axes and auxiliaries. With `motion`, directions of travel follow from the order of the rows; otherwise
/// they are unknown. Fails with the row and input of a value that is not usable.
fn evaluate<T: Element + Copy + Into<f64>>(
    tables: &Largest<'_>,
    rows: ArrayView2<'_, T>,
    to: &mut [f32],
    motion: bool,
) -> Result<(), (usize, usize)> {
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

/// The same for rows in one piece.
fn along<T: Copy + Into<f64>, R: AsRef<[T]>>(
    tables: &Largest<'_>,
    rows: impl Iterator<Item = R>,
    to: ChunksExactMut<'_, f32>,
    motion: bool,
) -> Result<(), (usize, usize)> {
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
            return Err((number, axis));
        }
        for (i, (auxiliary, value)) in inputs.auxiliaries.iter_mut().zip(auxiliaries).enumerate() {
            *auxiliary = (*value).into() as f32;
            if !auxiliary.is_finite() {
                return Err((number, axes.len() + i));
            }
        }
        if motion {
            for (i, axis) in axes.iter().enumerate() {
                travelling.0[i] = reversals[i].update(inputs.axes[i], axis.hysteresis, axis.period);
            }
        }
        tables.evaluate_into(&inputs, &travelling, &weights, &mut found);
        to.copy_from_slice(&found[..to.len()]);
    }
    Ok(())
}

/// Makes and proves a compensation.
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
    let model = errors.of(machine)?;
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
    let made = py.detach(|| Made::new(&machine.0, model, &options, tolerance, &()));
    let made = made.map_err(|error| raise(error.to_string(), error.remedy()))?;
    let may_be_written = made.may_be_written(best_effort);
    let whole = match made {
        Made::Proven(whole) => whole,
        Made::NoRoom(shortages) => {
            let name = &options.tables.target.name;
            return Err(raise(
                format!("the target {name} is too small: {}", all(&shortages)),
                options.scheme.smaller(),
            ));
        }
    };
    if !may_be_written {
        let coarser = whole.best.fits_um.map_or_else(
            || "a coarser tolerance".to_owned(),
            |um| format!("tolerance={um}, which is met"),
        );
        return Err(raise(
            all(&whole.refusals),
            format!("give {coarser}, another target, or best_effort=True"),
        ));
    }
    let warnings = whole.warnings.iter().map(ToString::to_string);
    let missed = whole.missed.iter().map(ToString::to_string);
    Ok(Compensation {
        warnings: warnings.chain(missed).collect(),
        ..Compensation::load(whole.best.built.blob)?
    })
}

/// Several sentences in one.
fn all(sentences: &[impl ToString]) -> String {
    let sentences: Vec<String> = sentences.iter().map(ToString::to_string).collect();
    sentences.join("; ")
}
