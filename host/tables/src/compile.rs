//! From a machine and its errors to a proven compensation: scheme, bounds, blob, verification.
//!
//! Two steps, so that a program can write the file in between and prove what it reads back:
//! [`build`] makes the blob, [`prove`] evaluates a blob with the runtime and compares it with the
//! exact model. [`compile`] does both.

mod best;
mod bounds;
mod proof;
mod room;
mod verdict;
mod warnings;

use crate::schemes::{self, Scheme, SchemeError};
pub use crate::size::Size;
use crate::target::Shortage;
use crate::validate::{DrawError, Runtime};
pub use best::{Best, FINEST, TOLERANCES, best};
pub use bounds::AxisBounds;
pub use proof::seed_over_travel;
pub use proof::{Held, Mismatch, Proof, belongs, prove, prove_held};
pub use room::Full;
use trueaxis::{AlignedBlob, EncodeError, LoadError};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::NotConverged;
use trueaxis_model::machine::Machine;
pub use verdict::Refusal;
pub use warnings::{Culprit, Warning, over_bounds, worse};

/// What to make, and how thoroughly to prove it.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// How tables are found.
    pub scheme: Scheme,
    /// What they are to be like, whatever the scheme.
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
    /// of the tolerance; if the scheme knows.
    pub structure_error: Option<f64>,
    /// The tolerance (mm) that the scheme measured its tables to meet, if any.
    pub meets: Option<f64>,
    /// True if the tolerance asked for needs more than the target holds, says the scheme.
    pub is_full: bool,
    /// What the scheme has to say.
    pub notes: Vec<String>,
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
    Scheme(#[from] SchemeError),
    /// The kinematic correction fails somewhere.
    #[error(transparent)]
    NotConverged(#[from] NotConverged),
    /// The draft cannot be written.
    #[error("the compensation cannot be written: {0}")]
    Encode(#[from] EncodeError),
    /// What was written cannot be read.
    #[error("the compensation cannot be read back: {0}")]
    Load(#[from] LoadError),
    /// The target holds less than is needed, for a scheme that does not keep to it; or not even
    /// the axes.
    #[error("the target {target} holds too little: {}", list(.shortages))]
    NoRoom {
        /// Name of the target.
        target: String,
        /// What it lacks, at least one.
        shortages: Vec<Shortage>,
    },
    /// A bound is so large that it protects from nothing.
    #[error(
        "{warning}, which asks for a bound of {bound:.3} {unit}: more than {most} {unit} is refused"
    )]
    TooLarge {
        /// Axis, place and culprit.
        warning: Box<Warning>,
        /// The bound needed.
        bound: f64,
        /// The largest that is not refused.
        most: f32,
        /// `mm` or `deg`.
        unit: &'static str,
    },
    /// Hardly a position is where no error motion holds its end value, so nothing could be proven there.
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
    /// What to do about it.
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
            Self::Draw(_) => {
                "widen [calibrated] in the error file: it is barely wider than the corrections"
            }
        }
    }
}

/// Bounds of a compensation that was not compiled from errors of the machine, from what its tables do.
///
/// # Errors
/// [`CompileError`] where positions cannot be drawn.
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
    let schemes::SchemeResult {
        mut draft,
        structure_error,
        meets,
        is_full,
        notes,
    } = schemes::find(machine, errors, &options.scheme, &options.tables)?;
    let provisional = draft.encode()?;
    let runtime = Runtime::load(&provisional)?;
    // Bounds change none of these numbers.
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
        axis.value_bound = bound.value_bound;
        axis.rate_bound = bound.rate_bound;
        axis.ramp_rate = bound.ramp_rate;
    }
    let blob = draft.encode()?;
    let runtime = Runtime::load(&blob)?;
    warnings.extend(warnings::short_tables(machine, &runtime));
    assert_eq!(size, Size::of(&runtime));
    drop(runtime);
    Ok(Built {
        blob,
        size,
        bounds,
        warnings,
        structure_error,
        meets,
        is_full,
        notes,
    })
}

/// [`build`], then [`prove_held`] of the bytes that were built.
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
    let zero = options.tables.zero(machine, errors)?;
    let runtime = Runtime::load(&built.blob)?;
    let proof = prove_held(
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
    Ok(Compiled { built, proof })
}
