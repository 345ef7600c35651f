//! Proposes a plan for a given number of probings.

use super::band::Band;
use super::candidates::{Allowed, Setup};
use super::collision::obstructed;
use super::exchange::{Measure, RowExchange};
use super::judge::band;
use super::order::{ordered, repeated};
use nalgebra::DMatrix;
use trueaxis_identify::formats::probings::{Probing, Probings, ball_index};
use trueaxis_identify::{Foreseen, IdentifyError, Unknown};
use trueaxis_model::errors::{ErrorModel, Parameter};

/// What a plan optimizes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Criterion {
    /// The volumetric error over the travel (I-optimal).
    ///
    /// The mean variance at the tip. In a comparison of plans also that of the direction.
    #[default]
    Volume,
    /// All unknowns together (D-optimal).
    ///
    /// The determinant of their covariance. In a comparison of plans, each parameter and the volumetric error.
    Parameters,
}

/// The requested plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WantedDesign {
    /// Number of probings, including repeated ones.
    pub probings: usize,
    /// What it optimizes.
    pub criterion: Criterion,
}

/// Why there is no plan.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{what}")]
pub struct DesignError {
    what: String,
    /// What to do about it.
    pub remedy: String,
}

impl DesignError {
    fn new(what: impl Into<String>, remedy: impl Into<String>) -> Self {
        let (what, remedy) = (what.into(), remedy.into());
        Self { what, remedy }
    }

    /// Even all positions together are too few.
    fn too_few_positions(probings: usize, error: &IdentifyError) -> Self {
        Self::new(
            format!("at all {probings} positions that are allowed and can be reached: {error}"),
            "allow more positions (--indexings, --cone), or give a model with fewer parameters",
        )
    }
}

/// One probing in this many is repeated, to show drift.
const REPEATED: usize = 20;

/// Number of repetitions of the first probing in a plan with `probings` probings.
pub(super) fn repeats(probings: usize) -> usize {
    probings.div_ceil(REPEATED + 1)
}

/// All candidates as equations.
pub(super) struct DesignCandidates {
    pub candidates: Probings,
    /// What all of them together would identify.
    pub foreseen: Foreseen,
    /// Derivatives by the identifiable unknowns.
    rows: Vec<DMatrix<f64>>,
    /// Like `rows`, of what is there anyway: instruments and prior knowledge.
    fixed: DMatrix<f64>,
    /// The volumetric error for the uncertainty of these.
    pub band: Band,
}

impl DesignCandidates {
    pub fn new(
        setup: &Setup<'_>,
        allowed: &Allowed,
        parameters: &[Parameter],
        assumed: &ErrorModel,
    ) -> Result<Self, DesignError> {
        let (candidates, first) = setup.candidates(allowed);
        if candidates.rows.is_empty() {
            let what = match first {
                Some((row, reason)) => format!(
                    "no ball can be probed at any of the allowed positions: ball `{}` first: {reason}",
                    setup.balls[row.ball]
                ),
                None => "no ball can be probed: there are no allowed positions".to_owned(),
            };
            return Err(DesignError::new(
                what,
                "allow more: --indexings, --cone, the balls' nominal_mm and away_from_table, the range of the axis",
            ));
        }
        let perfect = ErrorModel::perfect(setup.machine);
        let problem = setup.problem(&candidates, parameters, &perfect);
        let foreseen = (problem.foresee(assumed))
            .map_err(|error| DesignError::too_few_positions(candidates.rows.len(), &error))?;
        let (rows, fixed) = problem.equations_at(assumed);
        let kept = |matrix: &DMatrix<f64>| matrix.select_columns(&foreseen.kept);
        Ok(Self {
            rows: rows.iter().map(kept).collect(),
            fixed: kept(&fixed),
            band: band(setup, &foreseen.parameters, &candidates, assumed),
            candidates,
            foreseen,
        })
    }

    /// Smallest number of probings: `identify` needs an equation more than unknowns, also of those that cannot be
    /// identified.
    pub fn least(&self) -> usize {
        (self.foreseen.unknowns + 1)
            .saturating_sub(self.fixed.nrows())
            .div_ceil(3)
    }

    /// Number of probings if nobody says how many: as many as unknowns that can be identified, but no fewer than the
    /// smallest number with its repetitions.
    fn enough(&self) -> usize {
        let (rank, least) = (self.foreseen.rank, self.least());
        let mut enough = rank.max(least);
        while enough < least + repeats(enough) {
            enough += 1;
        }
        enough
    }

    /// A design for this choice; `effect` is what matters of the parameters.
    pub fn exchange(&self, effect: &DMatrix<f64>) -> RowExchange {
        RowExchange::new(&self.rows, &self.fixed, &self.with_setup(effect))
    }

    /// The effect with zero columns for balls and stylus.
    pub(crate) fn with_setup(&self, effect: &DMatrix<f64>) -> DMatrix<f64> {
        let setup = self.foreseen.kept.len() - self.foreseen.parameters.len();
        effect.clone().insert_columns(effect.ncols(), setup, 0.0)
    }

    /// Chosen rows in the order in which they are probed, with the repeated ones.
    pub fn plan(&self, setup: &Setup<'_>, chosen: &[usize], repeats: usize) -> Probings {
        let rows = chosen.iter().map(|i| self.candidates.rows[*i].clone());
        let rows = repeated(ordered(setup.machine, rows.collect()), repeats);
        numbered(&self.candidates.balls, rows)
    }
}

/// Rows as in a file: balls in order of appearance, line numbers after a header.
fn numbered(names: &[String], rows: Vec<Probing>) -> Probings {
    let mut plan = Probings::default();
    for (i, row) in rows.into_iter().enumerate() {
        let ball = ball_index(&mut plan.balls, &names[row.ball]);
        plan.rows.push(Probing {
            ball,
            line: i + 2,
            ..row
        });
    }
    plan
}

/// A matrix R with RᵀR = `square`, which is symmetric and positive semidefinite up to rounding.
pub(super) fn root(square: &DMatrix<f64>) -> DMatrix<f64> {
    let eigen = square.clone().symmetric_eigen();
    let mut root = eigen.eigenvectors.transpose();
    for (mut row, value) in root.row_iter_mut().zip(eigen.eigenvalues.iter()) {
        row *= value.max(0.0).sqrt();
    }
    root
}

/// The parameters that cannot be separated from the stylus at all allowed positions together unless the spindle is
/// indexed.
///
/// # Errors
/// [`DesignError`]: nothing can be reached, or too few positions.
pub fn needs_spindle(
    setup: &Setup<'_>,
    allowed: &Allowed,
    parameters: &[Parameter],
    assumed: &ErrorModel,
) -> Result<Vec<Parameter>, DesignError> {
    let all = DesignCandidates::new(setup, allowed, parameters, assumed)?.foreseen;
    // Turning the spindle does not move the stylus along the tool.
    let is_stylus = |(unknown, _): &(Unknown, f64)| matches!(unknown, Unknown::Stylus(k) if *k != setup.machine.tool_axis);
    let needs = all.unseen.iter().filter_map(|unseen| match unseen.unknown {
        Unknown::Parameter(parameter) if unseen.with.iter().any(is_stylus) => Some(parameter),
        _ => None,
    });
    Ok(needs.collect())
}

/// Rows that cannot be reached clear of everything are replaced by others at most this often; then they are left out.
const REPLACED: usize = 20;

/// Proposes a plan of allowed positions: the best choice found by exchange, in an order with short moves, and
/// with the first probing repeated to show drift. Rows on whose way solids meet that are described are replaced by
/// others, or left out.
///
/// # Errors
/// [`DesignError`]: nothing can be reached, or too few probings.
pub fn design(
    setup: &Setup<'_>,
    allowed: &Allowed,
    parameters: &[Parameter],
    assumed: &ErrorModel,
    wanted: impl Fn(usize) -> WantedDesign,
) -> Result<Probings, DesignError> {
    let mut allowed = setup.clear_of_collisions(allowed);
    for _ in 0..REPLACED {
        let plan = chosen(setup, &allowed, parameters, assumed, &wanted)?;
        let Some(row) = obstructed(setup, &plan) else {
            return Ok(plan);
        };
        let row = &plan.rows[row];
        let ball = plan.balls[row.ball].clone();
        allowed.without.push((ball, row.clone()));
    }
    let plan = chosen(setup, &allowed, parameters, assumed, &wanted)?;
    let clear = clear(setup, plan);
    let perfect = ErrorModel::perfect(setup.machine);
    match setup.problem(&clear, parameters, &perfect).foresee(assumed) {
        Ok(_) => Ok(clear),
        Err(error) => Err(DesignError::too_few_positions(clear.rows.len(), &error)),
    }
}

/// A plan without the rows that cannot be reached clear of everything.
pub(super) fn clear(setup: &Setup<'_>, mut plan: Probings) -> Probings {
    while let Some(row) = obstructed(setup, &plan) {
        plan.rows.remove(row);
        plan = numbered(&plan.balls.clone(), plan.rows);
    }
    plan
}

fn chosen(
    setup: &Setup<'_>,
    allowed: &Allowed,
    parameters: &[Parameter],
    assumed: &ErrorModel,
    wanted: &impl Fn(usize) -> WantedDesign,
) -> Result<Probings, DesignError> {
    let choice = DesignCandidates::new(setup, allowed, parameters, assumed)?;
    let wanted = wanted(choice.enough());
    let repeats = repeats(wanted.probings);
    let least = choice.least();
    if wanted.probings < least + repeats {
        return Err(DesignError::new(
            format!(
                "{} probings are too few for {} unknowns (parameters, stylus and balls)",
                wanted.probings, choice.foreseen.unknowns
            ),
            format!(
                "give --probings {} or more, or more --minutes, or a model with fewer parameters",
                least + repeats.max(1)
            ),
        ));
    }
    let mut exchange = choice.exchange(&root(&choice.band.mean_squares()[0]));
    let measure = match wanted.criterion {
        Criterion::Parameters => Measure::Determinant,
        Criterion::Volume => Measure::Effect,
    };
    exchange.choose(wanted.probings - repeats, measure);
    Ok(choice.plan(setup, &exchange.chosen(), repeats))
}
