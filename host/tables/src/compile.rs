//! From a machine and its errors to a verified compensation: scheme, bounds, blob, verification.
//!
//! There are two steps, so that a program can write the file in between and prove what it reads back: [`build`]
//! makes the blob, [`prove`] evaluates a blob with the runtime and compares it with the exact model. [`compile`]
//! does both.

mod best;
mod bounds;
pub mod extended;
mod limits;
mod proof;
mod room;
mod verdict;
mod verify;
mod warnings;

use crate::schemes::{self, Effort, Finder, Scheme, SchemeError};
pub use crate::size::Size;
use crate::target::Shortage;
use crate::target::Target;
pub use best::{Best, FINEST, TOLERANCES, best};
pub use bounds::{AxisBounds, REVERSAL};
pub use limits::TooFast;
pub(crate) use proof::prove_held;
pub use proof::seed_over_travel;
pub use proof::{Held, Mismatch, Proof, belongs, prove};
pub use room::Full;
use trueaxis::{AlignedBlob, EncodeError, LoadError};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{DrawError, Runtime};
pub use verdict::Refusal;
pub use verify::{VerifyOutcome, VerifyRequest, verify};
pub(crate) use warnings::over_bounds;
pub use warnings::{Culprit, Warning, worse};

/// What to make, and how thoroughly to prove it.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How tables are found.
    pub scheme: Scheme,
    /// Options that apply to every scheme.
    pub tables: schemes::Options,
    /// Accept corrections whose bound exceeds 2 mm or 1°.
    pub allow_large: bool,
    /// Random positions in each region of the verification.
    pub random: usize,
    /// Seed of the random positions.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            scheme: Scheme::default(),
            tables: schemes::Options::default(),
            allow_large: false,
            random: 20_000,
            seed: 1,
        }
    }
}

impl Options {
    /// The default options for a target.
    #[must_use]
    pub fn of(target: Target) -> Self {
        Self {
            tables: schemes::Options {
                format: target.samples,
                target,
                ..schemes::Options::default()
            },
            ..Self::default()
        }
    }
}

/// Receives the progress of the work. `()` ignores it.
pub trait Progress: Sync {
    /// A new stage begins, with `total` steps, or 0 if the number is unknown.
    fn stage(&self, what: &'static str, total: usize);
    /// One step of the stage is done.
    fn step(&self);
}

impl Progress for () {
    fn stage(&self, _: &'static str, _: usize) {}
    fn step(&self) {}
}

/// A blob before verification, with its properties.
#[derive(Clone, Debug)]
pub struct Built {
    /// The compensation as written to a file.
    pub blob: AlignedBlob,
    /// Counts and sizes of the blob before verification.
    pub size: Size,
    /// Bounds of each axis, with the largest corrections that they are derived from.
    pub bounds: Vec<AxisBounds>,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
    /// Largest difference from the kinematic correction due to the structure alone, in units of the tolerance;
    /// `None` if the scheme does not know it.
    pub structure_error: Option<f64>,
    /// The tolerance (mm) that the tables meet according to the scheme's own measurements, if any.
    pub meets: Option<f64>,
    /// True if, according to the scheme, the requested tolerance needs more than the target holds.
    pub is_full: bool,
    /// The scheme's notes.
    pub notes: Vec<String>,
}

/// A verified compensation.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The blob and what is known about it.
    pub built: Built,
    /// Effect on the volumetric error.
    pub verification: Proof,
}

/// Why there is no compensation.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CompileError {
    /// The scheme failed.
    #[error(transparent)]
    Scheme(#[from] SchemeError),
    /// The kinematic correction does not converge somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// The draft cannot be encoded.
    #[error("the compensation cannot be written: {0}")]
    Encode(#[from] EncodeError),
    /// The encoded blob cannot be loaded.
    #[error("the compensation cannot be read back: {0}")]
    Load(#[from] LoadError),
    /// The target is too small for a scheme that does not adapt to it, or not even the axes.
    #[error("the target {target} is too small: {}", list(.shortages))]
    NoRoom {
        /// Name of the target.
        target: String,
        /// What it lacks, at least one.
        shortages: Vec<Shortage>,
    },
    /// A bound is too large to protect the machine.
    #[error(
        "{warning}, which asks for a bound of {bound:.3} {unit}: more than {most} {unit} is refused"
    )]
    TooLarge {
        /// Axis, position and main cause.
        warning: Box<Warning>,
        /// The bound needed.
        bound: f64,
        /// The largest bound that is accepted.
        most: f32,
        /// `mm` or `deg`.
        unit: &'static str,
    },
    /// A correction moves faster than its axis' limit allows.
    #[error(transparent)]
    TooFast(#[from] TooFast),
    /// Almost no position is where no error motion holds its end value, so nothing can be verified there.
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

fn list(shortages: &[Shortage]) -> String {
    let texts: Vec<String> = shortages.iter().map(Shortage::to_string).collect();
    texts.join(", ")
}

impl CompileError {
    /// What to do about the error.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Scheme(error) => error.remedy(),
            Self::NotConverged(error) => SchemeError::from(*error).remedy(),
            Self::Encode(_) | Self::Load(_) => {
                "raise --tolerance or lower --points, so that fewer tables and samples are needed"
            }
            Self::NoRoom { .. } => {
                "raise --tolerance, store --samples i16 if bytes are short, or give another --target"
            }
            Self::TooLarge { .. } => {
                "check this parameter and its unit (mm and rad), say under [calibrated] where it is known, subtract a constant with --zero-at, or use --allow-large if the machine really is so far off"
            }
            Self::TooFast(too_fast) => too_fast.remedy(),
            Self::Draw(_) => {
                "widen [calibrated] in the error file: it is barely wider than the corrections"
            }
        }
    }
}

/// Bounds of a compensation that was not compiled from errors of the machine, found from the output of its tables.
///
/// # Errors
/// [`CompileError`] if positions cannot be drawn.
pub fn bounds_of(
    machine: &Machine,
    runtime: &Runtime<'_>,
    seed: u64,
    progress: &dyn Progress,
) -> Result<Vec<AxisBounds>, CompileError> {
    let errors = ErrorModel::perfect(machine);
    let survey = bounds::Survey::new(machine, &errors, runtime, seed, progress)?;
    Ok(survey.bounds())
}

/// Runs the scheme, sets the bounds, encodes the blob and loads it once.
///
/// # Errors
/// [`CompileError`].
pub fn build(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Built, CompileError> {
    let mut finder = Finder::new(machine, errors, &options.scheme);
    let built = build_with(
        &mut finder,
        machine,
        errors,
        options,
        Effort::Best,
        progress,
    )?;
    Ok(built.expect("the best effort has a result"))
}

/// [`build`] with what is known of the machine from other tolerances.
fn build_with(
    finder: &mut Finder<'_>,
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    effort: Effort,
    progress: &dyn Progress,
) -> Result<Option<Built>, CompileError> {
    progress.stage("finding tables and terms", 0);
    let Some(found) = finder.find(&options.tables, effort)? else {
        return Ok(None);
    };
    let schemes::SchemeResult {
        mut draft,
        structure_error,
        meets,
        is_full,
        notes,
    } = found;
    let provisional = draft.encode()?;
    let runtime = Runtime::load(&provisional)?;
    // Not affected by bounds.
    let size = Size::of(&runtime);
    let target = &options.tables.target;
    let shortages = target.shortages(&size);
    if !shortages.is_empty() {
        return Err(CompileError::NoRoom {
            target: target.name.clone(),
            shortages,
        });
    }
    let survey = bounds::Survey::new(machine, errors, &runtime, options.seed, progress)?;
    let bounds = survey.bounds();
    let mut warnings = warnings::large(&survey)?;
    for (axis, (bound, found)) in draft
        .axes
        .iter_mut()
        .zip(bounds.iter().zip(&survey.largest))
    {
        if bound.value_bound > bound.most() && !options.allow_large {
            let warning = warnings::culprit(&survey.kinematics, bound, found)?;
            return Err(CompileError::TooLarge {
                warning: Box::new(warning),
                bound: f64::from(bound.value_bound),
                most: bound.most(),
                unit: bound.unit,
            });
        }
        bound.set(axis);
    }
    let blob = draft.encode()?;
    let runtime = Runtime::load(&blob)?;
    limits::check(machine, &runtime)?;
    warnings.extend(warnings::short_tables(machine, &runtime));
    assert_eq!(size, Size::of(&runtime));
    drop(runtime);
    Ok(Some(Built {
        blob,
        size,
        bounds,
        warnings,
        structure_error,
        meets,
        is_full,
        notes,
    }))
}

/// [`build`], then a [`Proof`] of the resulting bytes.
///
/// # Errors
/// [`CompileError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    progress: &dyn Progress,
) -> Result<Compiled, CompileError> {
    let mut finder = Finder::new(machine, errors, &options.scheme);
    let made = compile_with(
        &mut finder,
        machine,
        errors,
        options,
        Effort::Best,
        progress,
    )?;
    Ok(made.expect("the best effort has a result"))
}

/// [`compile`] with what is known of the machine from other tolerances.
fn compile_with(
    finder: &mut Finder<'_>,
    machine: &Machine,
    errors: &ErrorModel,
    options: &Options,
    effort: Effort,
    progress: &dyn Progress,
) -> Result<Option<Compiled>, CompileError> {
    let Some(built) = build_with(finder, machine, errors, options, effort, progress)? else {
        return Ok(None);
    };
    let zero = options.tables.zero(machine, errors)?;
    let runtime = Runtime::load(&built.blob)?;
    let verification = prove_held(
        machine,
        errors,
        &runtime,
        &zero,
        &options.scheme.held(machine),
        options.random,
        options.seed,
        progress,
    )?;
    drop(runtime);
    Ok(Some(Compiled {
        built,
        verification,
    }))
}
