//! What an identification cannot know of a machine.

use crate::candidates::{self, RotationForm, of_degree};
use crate::elsewhere::Elsewhere;
use crate::instrument::{Kind, LEVER};
use crate::noise::{NoiseSource, VarianceComponent};
use crate::{HeldOut, Honesty, Identified, IdentifyError, Problem, Unknown};
use trueaxis_model::errors::{Parameter, ParameterKind};

/// What the measurements do not show of the machine.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NotKnown {
    /// Location errors that the stylus takes up.
    pub hidden: Vec<Parameter>,
    /// Error motions that nothing has measured over the travel, each as its lowest coefficient that bends. Probings and
    /// points show what every motion does to the tip, and the misfit has what the model lacks; distances and angles on
    /// single lines and circles do not.
    pub motions: Vec<Parameter>,
    /// Backlash of axes that no row says to have come from both sides, unless the error file had it.
    pub backlash: Vec<Parameter>,
    /// Standard deviation (mm) of a coordinate of the tip by errors that the model lacks, where it was measured; `None`
    /// if only angles were.
    pub misfit: Option<f64>,
    /// Standard deviation (rad) of a component of the tool's direction by the same; `None` if angles were not measured over
    /// all axes and both ways across the tool.
    pub misfit_of_direction: Option<f64>,
}

impl NotKnown {
    /// For an identification and the prediction of probings that were left out.
    ///
    /// # Errors
    /// [`IdentifyError`] if derivatives are not finite.
    pub fn of(
        problem: &Problem<'_>,
        identified: &Identified,
        honesty: &Honesty,
        held_out: Option<&HeldOut>,
    ) -> Result<Self, IdentifyError> {
        let of_stylus = of_stylus(problem, identified)?;
        let misfit = misfit(problem, identified, honesty, held_out);
        Ok(Self {
            hidden: problem.hidden_by_stylus(identified)?,
            motions: motions(problem, identified),
            backlash: backlash(problem, identified),
            misfit: misfit.map(|misfit| libm::hypot(misfit, of_stylus)),
            misfit_of_direction: of_direction(problem, identified, honesty),
        })
    }
}

/// What residuals have beyond the noise of probing: σ² = s² − σ₀². The noise σ₀ is what the file states, or the
/// repeatability if that is smaller. With neither, residuals cannot tell errors from noise, and all of them count as errors;
/// so they do if the file states more than they have, or if neighbouring rows are alike: what is stated is no noise then.
/// Probings that were left out show more of an error than the fit, which follows it as far as it can.
fn misfit(
    problem: &Problem<'_>,
    identified: &Identified,
    honesty: &Honesty,
    held_out: Option<&HeldOut>,
) -> Option<f64> {
    if identified.rows.is_empty() {
        let all = identified.components.iter();
        return all
            .filter_map(|one| of_observations(one, honesty))
            .reduce(f64::max);
    }
    let stated = stated_noise(&identified.components[0], honesty);
    let repeated = honesty.repeats.map(|repeats| repeats.deviation);
    let known = [stated, repeated].into_iter().flatten();
    let noise = known.reduce(f64::min).unwrap_or(0.0);
    let has_errors = (stated.is_none() && repeated.is_none())
        || identified.components[0].is_refuted
        || honesty.repeats.is_some_and(|repeats| repeats.is_less);
    // Where nothing speaks for errors, what left-out rows show beyond the noise is the uncertainty of the parameters.
    let held_out = held_out.filter(|_| has_errors);
    let coordinate = |held_out: &HeldOut| {
        let together = held_out.together.map_or(0.0, |one| one.deviation());
        held_out.rms.max(together) / 3.0_f64.sqrt()
    };
    let zones = match has_errors {
        true => in_zones(problem, identified),
        false => 0.0,
    };
    let left = held_out.map_or(0.0, coordinate).max(zones);
    let left = left.max(identified.noise);
    Some((left * left - noise * noise).max(0.0).sqrt())
}

/// How far off a coordinate of the tip is (mm, root mean square) in zones of the travel that the others predict. A model with
/// many motions follows the errors that it lacks between its rows, and is wrong beyond them. Instruments are no rows of the tip.
fn in_zones(problem: &Problem<'_>, identified: &Identified) -> f64 {
    if identified.components.len() > 1 {
        return 0.0;
    }
    let place = &identified.place;
    let unknowns = place.factor.unknowns().iter();
    let unknowns: Vec<Unknown> = unknowns.map(|i| problem.unknowns[*i]).collect();
    let all: Vec<usize> = (0..unknowns.len()).collect();
    let elsewhere = Elsewhere::new(problem, &place.estimate, &place.weights, &unknowns);
    elsewhere.map_or(0.0, |elsewhere| {
        elsewhere.predicted(&all).at_rows() / 3.0_f64.sqrt()
    })
}

/// How far errors that the stylus takes up move a coordinate of the tip (mm), if its place is stated with an uncertainty.
/// They are as large as it was found from that place, and the place may be wrong by its uncertainty.
fn of_stylus(problem: &Problem<'_>, identified: &Identified) -> Result<f64, IdentifyError> {
    let squares = problem.known_stylus().map(|(k, stated, sigma)| {
        let off = identified.stylus[k] - stated;
        off * off + sigma * sigma
    });
    let squares: f64 = squares.sum();
    let takes_up = || problem.without_stylus().hidden_by_stylus(identified);
    if identified.rows.is_empty() || squares == 0.0 || takes_up()?.is_empty() {
        return Ok(0.0);
    }
    // Rotary axes turn it in all directions.
    Ok((squares / 3.0).sqrt())
}

/// Like `of_stylus`, of observations alone: what they read along one line has of a coordinate of the tip.
fn of_observations(one: &VarianceComponent, honesty: &Honesty) -> Option<f64> {
    if matches!(
        one.source,
        NoiseSource::Probings | NoiseSource::Observations(Kind::Angle)
    ) {
        return None;
    }
    Some(beyond_noise(one, honesty))
}

/// The noise that is stated (mm), unless the residuals show that it is something else.
fn stated_noise(one: &VarianceComponent, honesty: &Honesty) -> Option<f64> {
    let factor = one.of_stated?;
    let is_more = factor < 1.0 && one.is_misstated();
    (!is_more && honesty.alike.is_none()).then_some(one.noise / factor)
}

/// What residuals of observations have beyond their stated noise (mm, rms).
fn beyond_noise(one: &VarianceComponent, honesty: &Honesty) -> f64 {
    let noise = stated_noise(one, honesty).unwrap_or(0.0);
    (one.noise * one.noise - noise * noise).max(0.0).sqrt()
}

/// The misfit of what reads directions (rad), if that was read both ways across the tool while every axis moved: a level on
/// one axis does not show how another one tilts.
fn of_direction(problem: &Problem<'_>, identified: &Identified, honesty: &Honesty) -> Option<f64> {
    let mut all = identified.components.iter();
    let angles = all.find(|one| one.source == NoiseSource::Observations(Kind::Angle))?;
    let rows = problem.observed.rows.iter();
    let rows: Vec<_> = rows.filter(|row| row.kind == Kind::Angle).collect();
    let machine = problem.machine;
    let moves = |axis: usize| rows.iter().any(|row| row.q[axis] != rows[0].q[axis]);
    let mut across = (0..3).filter(|k| *k != machine.tool_axis);
    let is_read = |k: usize| {
        rows.iter()
            .any(|row| row.commanded.about_tool()[k].abs() > SLANTED)
    };
    let is_measured = (0..machine.axes.len()).all(moves) && across.all(is_read);
    is_measured.then(|| beyond_noise(angles, honesty) / LEVER)
}

/// A reading counts for a direction that has at least this part of it.
const SLANTED: f64 = 0.1;

/// The error motions that have neither a table nor a coefficient, if no tip was measured in space.
fn motions(problem: &Problem<'_>, identified: &Identified) -> Vec<Parameter> {
    let is_point = |one: &VarianceComponent| {
        matches!(
            one.source,
            NoiseSource::Probings | NoiseSource::Observations(Kind::Point)
        )
    };
    if identified.components.iter().any(is_point) {
        return Vec::new();
    }
    let errors = &identified.errors;
    let mut all = Vec::new();
    for (index, axis) in problem.machine.axes.iter().enumerate() {
        for component in 0..6 {
            let is_own = |p: &&Parameter| {
                (p.axis, p.component) == (axis.letter.char(), component)
                    && !matches!(p.kind, ParameterKind::Inter | ParameterKind::Backlash)
            };
            let has_table = errors.motions[index][component].table.is_some();
            let lowest = [2, 1].map(|k| of_degree(axis, component, k, RotationForm::Harmonics)[0]);
            // A turn has no lower coefficient than its first harmonic.
            let bends = match lowest[1].kind {
                ParameterKind::Degree(_) => lowest[0],
                _ => lowest[1],
            };
            // A scale or a squareness is a straight line.
            let is_straight = |p: &Parameter| p.kind == ParameterKind::Degree(1) && component < 3;
            let mut known = errors.parameters.keys().filter(is_own);
            if !has_table && known.all(is_straight) {
                all.push(bends);
            }
        }
    }
    all
}

/// The backlash of axes of which no two rows come from different sides.
fn backlash(problem: &Problem<'_>, identified: &Identified) -> Vec<Parameter> {
    let machine = problem.machine;
    let comes_from = |axis: usize, side: f64| {
        let mut signs = problem
            .commands()
            .map(|(_, situation)| situation.sign[axis]);
        signs.any(|sign| sign == side)
    };
    let is_unseen = |axis: usize| !(comes_from(axis, 1.0) && comes_from(axis, -1.0));
    let unseen: Vec<bool> = (0..machine.axes.len()).map(is_unseen).collect();
    let errors = &identified.errors;
    let is_known =
        |p: &Parameter| errors.parameters.contains_key(p) || errors.is_tabulated(machine, p);
    candidates::backlash(machine, &unseen)
        .filter(|p| !is_known(p))
        .collect()
}
