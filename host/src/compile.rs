//! From a machine and its errors to a proven compensation: scheme, bounds, blob, verification.
//!
//! Two steps, so that a program can write the file in between and prove what it reads back:
//! [`build`] makes the blob, [`prove`] evaluates a blob with the runtime and compares it with the
//! exact model. [`compile`] does both.

mod bounds;
mod proof;
mod warnings;

use crate::errors::{ErrorModel, Situation, Switches};
use crate::kinematics::{Kinematics, NotConverged};
use crate::machine::{Machine, PerAxis};
use crate::schemes::exact::{self, ExactError};
use crate::validate::{DrawError, Runtime};
pub use bounds::AxisBounds;
pub use proof::{Mismatch, Proof, belongs, prove};
use serde::Serialize;
use trueaxis::{AlignedBlob, EncodeError, LoadError};
pub use warnings::{Culprit, Warning, over_bounds};

/// What to make, and how thoroughly to prove it.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Options of the scheme.
    pub scheme: exact::Options,
    /// Accept corrections whose bound exceeds 1 mm or 1°.
    pub allow_large: bool,
    /// Random positions in each region of the verification.
    pub random: usize,
    /// Seed of the random positions.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            scheme: exact::Options::default(),
            allow_large: false,
            random: 20_000,
            seed: 1,
        }
    }
}

/// Is told how far the work is. `()` tells nobody.
pub trait Progress: Sync {
    /// A new piece of work begins; `total` steps, or 0 if nobody knows.
    fn stage(&self, what: &'static str, total: usize);
    /// One step of it is done.
    fn step(&self);
}

impl Progress for () {
    fn stage(&self, _: &'static str, _: usize) {}
    fn step(&self) {}
}

/// Numbers and sizes of a compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Tables.
    pub tables: usize,
    /// Banks: tables that share their points.
    pub banks: usize,
    /// Terms.
    pub terms: usize,
    /// Grids.
    pub grids: usize,
    /// Samples of both formats.
    pub samples: usize,
    /// Bytes of the blob.
    pub bytes: usize,
}

impl Size {
    /// Of a loaded blob.
    #[must_use]
    pub fn of(runtime: &Runtime<'_>) -> Self {
        let compensation = runtime.compensation();
        Self {
            tables: compensation.tables(),
            banks: compensation.banks().len(),
            terms: compensation.terms().len(),
            grids: compensation.grids().len(),
            samples: compensation.samples(),
            bytes: compensation.blob_len(),
        }
    }
}

/// A blob with what is known about it before verification.
#[derive(Clone, Debug)]
pub struct Built {
    /// The compensation, as it is written to a file.
    pub blob: AlignedBlob,
    /// Its numbers.
    pub size: Size,
    /// Bounds of each axis, and the largest corrections they came from.
    pub bounds: Vec<AxisBounds>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// Largest difference to the kinematic correction that the structure alone leaves, in units
    /// of the tolerance.
    pub structure_error: f64,
}

/// A proven compensation.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The blob and what is known about it.
    pub built: Built,
    /// What it does to the volumetric error.
    pub proof: Proof,
}

/// Why there is no compensation.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CompileError {
    /// The scheme found none.
    #[error(transparent)]
    Scheme(#[from] ExactError),
    /// The kinematic correction fails somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// The draft cannot be written.
    #[error("the compensation cannot be written: {0}")]
    Encode(#[from] EncodeError),
    /// What was written cannot be read.
    #[error("the compensation cannot be read back: {0}")]
    Load(#[from] LoadError),
    /// A bound is so large that it protects from nothing.
    #[error(
        "{warning}, which asks for a bound of {bound:.3} {unit}: more than 1 {unit} is refused"
    )]
    TooLarge {
        /// Axis, place and culprit.
        warning: Box<Warning>,
        /// The bound needed.
        bound: f64,
        /// `mm` or `deg`.
        unit: &'static str,
    },
    /// Hardly a position is inside the calibrated ranges, so nothing could be proven there.
    #[error("{0}")]
    Draw(DrawError),
}

impl From<DrawError> for CompileError {
    fn from(error: DrawError) -> Self {
        match error {
            DrawError::NotConverged(error) => Self::NotConverged(error),
            rare @ DrawError::Rare { .. } => Self::Draw(rare),
        }
    }
}

impl CompileError {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Scheme(ExactError::TooManyTables { .. }) => {
                "raise --tolerance, or use --minimize cost"
            }
            Self::Scheme(ExactError::ZeroPosition { .. }) => "give one position for each axis",
            Self::Scheme(ExactError::NotConverged(_)) | Self::NotConverged(_) => {
                "check the units of the error parameters (mm and rad), and where they are known under [calibrated]"
            }
            Self::Encode(_) | Self::Load(_) => {
                "raise --tolerance or lower --points, so that fewer tables and samples are needed"
            }
            Self::TooLarge { .. } => {
                "check this parameter and its unit (mm and rad), say under [calibrated] where it is known, subtract a constant with --zero-at, or use --allow-large if the machine really is so far off"
            }
            Self::Draw(_) => {
                "widen [calibrated] in the error file: it is hardly wider than the corrections are large"
            }
        }
    }
}

/// The correction (mm, rad) at the zero position (mm, deg) that a compensation subtracts
/// everywhere; nothing without one. The machine's own tool, unknown directions, reference
/// temperature.
///
/// # Errors
/// [`NotConverged`] where the kinematic correction itself fails.
pub fn zero(
    machine: &Machine,
    errors: &ErrorModel,
    zero_at: Option<&[f64]>,
) -> Result<PerAxis, NotConverged> {
    let Some(position) = zero_at else {
        return Ok(PerAxis::default());
    };
    let kinematics = Kinematics::new(machine, errors);
    let q = machine.to_kinematic(position);
    Ok(kinematics
        .correction(&q, &Situation::default(), &Switches::ALL)?
        .dq)
}

/// Runs the scheme, sets the bounds, writes the blob and loads it once.
///
/// # Errors
/// [`CompileError`].
pub fn build(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Built, CompileError> {
    progress.stage("finding tables and terms", 0);
    let exact::Exact {
        mut draft,
        structure_error,
        ..
    } = exact::compile(machine, errors, &options.scheme)?;
    let provisional = draft.encode()?;
    let survey = bounds::Survey::new(
        machine,
        errors,
        &Runtime::load(&provisional)?,
        options.seed,
        progress,
    )?;
    let bounds = survey.bounds();
    let mut warnings = warnings::large(machine, errors, &survey)?;
    for (axis, (bound, found)) in draft
        .axes
        .iter_mut()
        .zip(bounds.iter().zip(&survey.largest))
    {
        if bound.value_bound > 1.0 && !options.allow_large {
            let warning = warnings::culprit(machine, errors, bound, found)?;
            return Err(CompileError::TooLarge {
                warning: Box::new(warning),
                bound: f64::from(bound.value_bound),
                unit: bound.unit,
            });
        }
        axis.value_bound = bound.value_bound;
        axis.rate_bound = bound.rate_bound;
        axis.ramp_rate = bound.ramp_rate;
    }
    let blob = draft.encode()?;
    let runtime = Runtime::load(&blob)?;
    warnings.extend(warnings::short_tables(machine, &runtime));
    warnings.extend(warnings::capacity(&runtime));
    let size = Size::of(&runtime);
    drop(runtime);
    Ok(Built {
        blob,
        size,
        bounds,
        warnings,
        structure_error,
    })
}

/// [`build`], then [`prove`] of the bytes that were built.
///
/// # Errors
/// [`CompileError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Compiled, CompileError> {
    let built = build(machine, errors, options, progress)?;
    let zero = zero(machine, errors, options.scheme.zero_at.as_deref())?;
    let runtime = Runtime::load(&built.blob)?;
    let proof = prove(
        machine,
        errors,
        &runtime,
        &zero,
        options.random,
        options.seed,
        progress,
    )?;
    drop(runtime);
    Ok(Compiled { built, proof })
}
