//! Detects common mistakes in all readings of a set-up: another unit, a deviation instead of a length or the reverse, a
//! coordinate that counts the other way.
//!
//! Each set-up is fitted by itself to the nominal machine. Its errors leave some micrometres; what leaves much more is
//! another quantity than the header says. It is named if one change of all readings explains what is left.

use crate::descent::setup_alone;
use crate::identified::Solution;
use crate::instrument::{InitialSample, Kind, SettingPart};
use crate::mistakes::{EXPLAINS, GROSS, Mistake};
use crate::rows::{EquationWeights, Problem};
use crate::stated::PLACES;
use crate::{Identified, IdentifyError, Unknown, root_mean_square};
use nalgebra::{DVector, Vector3};
use trueaxis_model::numbers::by;

/// Smallest standard uncertainty (mm) of what is stated about a set-up while the machine is taken for nominal: its
/// errors may move a dead length as much.
const NOMINAL: f64 = 0.05;
/// Readings that are all smaller (mm) may be deviations of a length.
const DEVIATIONS: f64 = 1.0;
/// A laser whose positions in mm are taken for deviations in µm seems to see a scale of a thousandth; less than this
/// fraction of the travel is not one.
const PROPORTIONAL: f64 = 3e-4;
/// A unit is the right one if no other is within this many times as good.
const ALIKE: f64 = 2.0;

/// A change of all readings of a set-up.
#[derive(Clone, Copy)]
struct Misreading {
    /// What the rows fit, and what to do.
    what: &'static str,
    remedy: &'static str,
    /// The actual reading (mm) from that of the file; the second is how far the tool was commanded along the direction.
    change: fn(&Vector3<f64>, f64) -> Vector3<f64>,
}

const fn misreading(
    what: &'static str,
    remedy: &'static str,
    change: fn(&Vector3<f64>, f64) -> Vector3<f64>,
) -> Misreading {
    Misreading {
        what,
        remedy,
        change,
    }
}

const IN_MM: &str = "write them in mm, or correct the line `# unit` of a file that has one";
/// Units that are mistaken for millimetres, and the sense of points: any coordinate that counts the other way makes a frame
/// left-handed, whichever it is.
const POINTS: [Misreading; 4] = [
    misreading("in inches", IN_MM, |read, _| read * 25.4),
    misreading("in metres", IN_MM, |read, _| read * 1e3),
    misreading("in µm", IN_MM, |read, _| read * 1e-3),
    misreading(
        "of a left-handed frame",
        "change the sign of one of x_mm, y_mm and z_mm, or exchange two of them in the header",
        |read, _| Vector3::new(read.x, read.y, -read.z),
    ),
];
const DEVIATION: &str = "write how much farther the tool is than commanded, in µm";
const DEVIATION_OR_SENSE: &str =
    "write how much farther the tool is than commanded, in µm, or turn the direction in reads";
const POSITIONS: [Misreading; 4] = [
    misreading(
        "positions in µm instead of deviations",
        DEVIATION,
        |read, travel| Vector3::x() * (read.x - travel),
    ),
    misreading(
        "positions in mm instead of deviations in µm",
        DEVIATION,
        |read, travel| Vector3::x() * (1e3 * read.x - travel),
    ),
    misreading(
        "positions in µm that count the other way, instead of deviations",
        DEVIATION_OR_SENSE,
        |read, travel| Vector3::x() * (-read.x - travel),
    ),
    misreading(
        "positions in mm that count the other way, instead of deviations in µm",
        DEVIATION_OR_SENSE,
        |read, travel| Vector3::x() * (-1e3 * read.x - travel),
    ),
];

/// A file of runs whose readings contradict the others, and agree with them if they count the other way. Runs are kept as
/// tables of motions, each with its name, axis and component; by themselves they fit a machine with the opposite errors.
#[must_use]
pub fn turned(
    problem: &Problem<'_>,
    identified: &Identified,
    runs: &[(&str, usize, usize)],
) -> Option<Mistake> {
    let Solution {
        estimate,
        weights,
        factor,
    } = &identified.place;
    let residuals = problem.residuals(estimate, weights);
    let jacobian = problem.jacobian(estimate, weights);
    let all = residuals.norm_squared();
    let of_runs = runs.chunk_by(|a, b| a.0 == b.0).map(|motions| {
        let mut other = estimate.clone();
        for (_, axis, component) in motions {
            let motion = &mut other.errors.motions[*axis][*component];
            let table = motion.table.iter_mut();
            let values =
                table.flat_map(|t| t.positive.iter_mut().chain(t.negative.iter_mut().flatten()));
            values.for_each(|value| *value = -*value);
        }
        (motions[0].0, problem.residuals(&other, weights))
    });
    let left = |(name, other): (_, DVector<f64>)| {
        // What the unknowns cannot take up of the difference.
        let mut change = other - &residuals;
        let step = factor.step(&jacobian.tr_mul(&change))?;
        change += &jacobian * step;
        let left = (&residuals + change).norm_squared();
        left.is_finite().then_some((name, left))
    };
    let tried = of_runs.filter_map(left);
    let (name, left) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (left < TURNED * all && identified.freedom >= ENOUGH).then(|| Mistake {
        what: format!(
            "the readings of {name} contradict the others, and all fit {:.1} times as well if they count the other way",
            (all / left).sqrt()
        ),
        remedy: "turn the direction in its line `reads`, or its signs".to_owned(),
    })
}

/// Readings that count the other way leave less than this part of the squares, with so many degrees of freedom at least: half
/// the residuals, where noise alone varies by a fifth.
const TURNED: f64 = 0.25;
const ENOUGH: usize = 15;

/// Refuses readings of a set-up that fit the machine only if they are another quantity.
pub(crate) fn refuse(problem: &Problem<'_>) -> Result<(), IdentifyError> {
    let setups = 0..problem.observed.setups.len();
    match setups.into_iter().find_map(|setup| found(problem, setup)) {
        Some(mistake) => Err(IdentifyError::Mistake(mistake)),
        None => Ok(()),
    }
}

fn found(problem: &Problem<'_>, setup: usize) -> Option<Mistake> {
    let own = problem.of_set_up(setup);
    let (name, kind, _) = own.observed.setups[setup].clone();
    let at_first = left(&own)?;
    let readings: &[Misreading] = match kind {
        Kind::Length => &POINTS[..3],
        Kind::Point => &POINTS,
        Kind::Displacement => &POSITIONS,
        Kind::Angle | Kind::Surface => &[],
    };
    // Where the tool hardly moves along the direction, positions are no larger than deviations.
    if kind == Kind::Displacement && own.travel() < DEVIATIONS {
        return None;
    }
    // Positions that are taken for deviations in another unit may be small, but are proportional to the travel.
    let least = match kind {
        Kind::Displacement => PROPORTIONAL * own.travel(),
        _ => GROSS,
    };
    if at_first < least {
        return None;
    }
    let mut tried: Vec<(&Misreading, f64)> = (readings.iter())
        .filter_map(|reading| {
            let left = left(&own.read_as(setup, reading.change))?;
            Some((reading, left))
        })
        .collect();
    tried = by(tried, |(_, left)| *left);
    let is_clear = tried.len() < 2 || tried[1].1 > ALIKE * tried[0].1;
    if let Some((reading, left)) = tried.first()
        && is_clear
        && *left < EXPLAINS * at_first
    {
        return Some(Mistake {
            what: format!(
                "the readings of {name} fit if they are {}: {} as written, {} then (rms, against the machine without errors)",
                reading.what,
                shown(at_first),
                shown(*left)
            ),
            remedy: reading.remedy.to_owned(),
        });
    }
    match at_first < GROSS {
        true => None,
        false => dead_length(&own, setup, at_first),
    }
}

/// A dead length that is another one than stated.
fn dead_length(own: &Problem<'_>, setup: usize, at_first: f64) -> Option<Mistake> {
    let unknown = Unknown::Setup(setup, SettingPart::Length);
    let (_, stated, sigma) = *(own.observed.known.iter()).find(|(of, ..)| *of == unknown)?;
    let mut free = own.clone();
    free.observed.known.retain(|(of, ..)| *of != unknown);
    free.observed.given[setup].length_sigma = None;
    let free = free.read_as(setup, |read, _| *read);
    let (left, length) = fitted(&free, setup)?;
    // A dead length that is nearer may be made up for by scales of the machine.
    if left > EXPLAINS * at_first || (length - stated).abs() < PLACES {
        return None;
    }
    let name = &own.observed.setups[setup].0;
    let own = own.observed.rows.iter();
    let are_small = own.map(|row| row.read.norm()).fold(0.0, f64::max) < DEVIATIONS;
    let what = match are_small {
        true => format!(
            "the readings of {name} fit if they are deviations of a length of {length:.3} mm, not lengths: dead_length_mm is stated as {stated:.4} ± {sigma:.4}"
        ),
        false => format!(
            "the readings of {name} fit with a dead length of {length:.3} mm, which is stated as {stated:.4} ± {sigma:.4}"
        ),
    };
    Some(Mistake {
        what,
        remedy: format!("write whole lengths, or correct dead_length_mm of [setup.{name}]"),
    })
}

fn shown(mm: f64) -> String {
    match mm < 0.1 {
        true => format!("{:.1} µm remain", mm * 1e3),
        false => format!("{mm:.2} mm remain"),
    }
}

/// Residual of the readings with only the set-up fitted (mm); `None` if it cannot be fitted.
fn left(problem: &Problem<'_>) -> Option<f64> {
    fitted(problem, 0).map(|(left, _)| left)
}

/// Residual as [`left`] has it, and the dead length of a set-up then (mm).
fn fitted(problem: &Problem<'_>, setup: usize) -> Option<(f64, f64)> {
    let weights = EquationWeights {
        rows: vec![1.0 / NOMINAL; problem.observed.rows.len()],
        least: NOMINAL,
    };
    problem.can_be_solved().ok()?;
    let estimate = setup_alone(problem, &weights).ok()?;
    let left = root_mean_square(problem.misses(&estimate).iter().map(Vector3::norm));
    left.is_finite()
        .then(|| (left, estimate.settings[setup].length))
}

impl Problem<'_> {
    /// With nothing but one set-up, on the machine without errors.
    fn of_set_up(&self, setup: usize) -> Self {
        let mut other = self.clone();
        other.places.clear();
        other.bars.clear();
        other.observed.rows.retain(|row| row.setup == setup);
        let tools: Vec<usize> = other.observed.rows.iter().filter_map(|r| r.tool).collect();
        let is_own = |unknown: &Unknown| match unknown {
            Unknown::Setup(of, _) => *of == setup,
            Unknown::Tool(of, _) => tools.contains(of),
            _ => false,
        };
        other.unknowns.retain(is_own);
        other.observed.known.retain(|(unknown, ..)| is_own(unknown));
        other.balls.clear();
        other.without_stylus()
    }

    /// Standard deviation of the commanded travel along the direction of reading (mm).
    fn travel(&self) -> f64 {
        let rows = self.observed.rows.iter();
        let along: Vec<f64> = rows
            .map(|row| row.commanded.along.dot(&row.commanded.travel))
            .collect();
        let mean = along.iter().sum::<f64>() / along.len().max(1) as f64;
        root_mean_square(along.iter().map(|v| v - mean))
    }

    /// With other readings of a set-up, and a first place of it that follows from them.
    fn read_as(&self, setup: usize, change: fn(&Vector3<f64>, f64) -> Vector3<f64>) -> Self {
        let mut other = self.clone();
        for row in &mut other.observed.rows {
            let travel = row.commanded.along.dot(&row.commanded.travel);
            row.read = change(&row.read, travel);
        }
        let samples = other.observed.rows.iter().map(|row| InitialSample {
            commanded: row.commanded,
            read: row.read,
        });
        let samples: Vec<InitialSample> = samples.collect();
        let given = other.observed.given[setup];
        let (_, kind, setting) = &mut other.observed.setups[setup];
        *setting = kind.start(&given, &samples);
        other
    }
}
