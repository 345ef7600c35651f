//! The equations: one per coordinate of each probing and each observation, per bar, and per known coordinate of the
//! stylus or of a set-up.

mod residuals;
mod variants;

use crate::estimate::Estimate;
use crate::formats::artefact::{Artefact, ArtefactBar};
use crate::formats::observations::{Drift, Observations};
use crate::formats::probings::Probings;
use crate::instrument::turned;
use crate::observed::{Observed, period};
use crate::unidentifiable::ProbedSpindle;
use crate::{IdentifyError, Unknown};
use nalgebra::{DVector, Matrix3, Vector3};
use std::ops::Range;
use trueaxis_model::errors::{ErrorModel, Parameter, Situation};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers;
use trueaxis_model::numbers::extremes;

/// What was measured on a machine, and what is known of it beforehand.
#[derive(Clone, Copy, Debug)]
pub struct Measured<'a> {
    /// The nominal machine.
    pub machine: &'a Machine,
    /// Balls as they were probed, if any were.
    pub probings: &'a Probings,
    /// What is known about balls, bars and stylus.
    pub artefact: &'a Artefact,
    /// Readings of instruments.
    pub observations: &'a Observations,
    /// Errors that were known before.
    pub base: &'a ErrorModel,
}

impl<'a> Measured<'a> {
    /// The equations for these parameters.
    #[must_use]
    pub fn problem(&self, parameters: &[Parameter]) -> Problem<'a> {
        let (machine, probings, artefact) = (self.machine, self.probings, self.artefact);
        Problem::new(machine, probings, artefact, parameters, self.base).with(self.observations)
    }
}

/// The probings, the machine, and the unknowns.
#[derive(Clone, Debug)]
pub struct Problem<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// The unknowns: parameters, stylus, balls.
    pub unknowns: Vec<Unknown>,
    /// The probings, in an order that does not depend on the file.
    pub(crate) places: Vec<ProbingRow>,
    /// Names of the balls, in the order of the file.
    pub(crate) balls: Vec<String>,
    pub(crate) bars: Vec<BarRow>,
    /// Observations other than probings.
    pub(crate) observed: Observed,
    /// The times (s) of the first and the last probing, if all have one.
    pub(crate) period: Option<[f64; 2]>,
    /// Drift that is looked for.
    pub(crate) drift: Vec<Drift>,
    /// Standard uncertainties of changes with temperature from the choice of temperatures, lags and terms.
    pub(crate) choice: Vec<(Unknown, f64)>,
    stylus: StylusPrior,
    /// Approximate positions of the balls.
    nominal: Vec<Option<Vector3<f64>>>,
    pub(crate) base: Box<ErrorModel>,
    pub(crate) spindle: ProbedSpindle,
}

/// A probing.
#[derive(Clone, Debug)]
pub(crate) struct ProbingRow {
    pub ball: usize,
    /// Row in the file, and its line.
    pub row: usize,
    pub line: usize,
    pub q: PerAxis,
    pub situation: Situation,
    /// Rotation of the stylus by the spindle, and the spindle angle (deg).
    pub turned: Matrix3<f64>,
    pub spindle: f64,
    /// Stated standard uncertainty of a coordinate (mm).
    pub sigma: Option<f64>,
    /// [`Drift::hours`] of each component of drift.
    pub hours: [f64; 6],
    /// Time (s) by the clock of the file.
    pub clock: Option<f64>,
}

impl ProbingRow {
    fn of(machine: &Machine, probings: &Probings, row: usize) -> Self {
        let probing = &probings.rows[row];
        Self {
            ball: probing.ball,
            row,
            line: probing.line,
            q: machine.to_kinematic(&probing.position),
            situation: Situation {
                sign: probing.direction,
                ..Situation::default()
            },
            turned: turned(machine.tool_axis, probing.spindle),
            spindle: probing.spindle,
            sigma: probing.sigma,
            hours: [0.0; 6],
            clock: probing.time,
        }
    }
}

/// A known distance.
#[derive(Clone, Debug)]
pub(crate) struct BarRow {
    pub balls: [usize; 2],
    /// Length and its standard uncertainty (mm).
    pub length: f64,
    pub sigma: f64,
}

impl BarRow {
    /// `None` if a ball was not probed.
    fn of(bar: &ArtefactBar, probings: &Probings) -> Option<Self> {
        let index = |name: &String| probings.balls.iter().position(|b| b == name);
        Some(Self {
            balls: [index(&bar.balls[0])?, index(&bar.balls[1])?],
            length: bar.length,
            sigma: bar.uncertainty,
        })
    }
}

#[derive(Clone, Debug)]
struct StylusPrior {
    tip: Vector3<f64>,
    sigma: [Option<f64>; 3],
}

impl StylusPrior {
    fn of(artefact: &Artefact, machine: &Machine) -> Self {
        Self {
            tip: artefact.stylus.place(machine),
            sigma: artefact.stylus.uncertainty,
        }
    }
}

/// Weights of the equations.
#[derive(Clone, Debug)]
pub(crate) struct EquationWeights {
    /// The inverse standard uncertainty of each probing, then of each observation (1/mm).
    pub rows: Vec<f64>,
    /// Lower limit of the uncertainty of bars and stylus (mm), used while the machine is not known yet. Otherwise
    /// they would prevent any step that is not exactly right.
    pub least: f64,
}

/// Upper limit for the errors of any machine (mm).
pub(crate) const LARGEST_LENGTH: f64 = 1.0;
/// Smallest lever (mm): the size of a ball.
const LEAST_LEVER: f64 = 1.0;

impl<'a> Problem<'a> {
    /// Sets up the problem. `base` is the known machine, or the starting point. Balls of the artefact that were not
    /// probed are left out, together with their bars, and so are parameters of motions that `base` has as tables.
    #[must_use]
    pub fn new(
        machine: &'a Machine,
        probings: &Probings,
        artefact: &Artefact,
        parameters: &[Parameter],
        base: &ErrorModel,
    ) -> Self {
        let balls = by_name(probings);
        let coordinates = |b: usize| (0..3).map(move |i| Unknown::Ball(b, i));
        let parameters = parameters.iter().filter(|p| !base.is_tabulated(machine, p));
        let parameters = parameters.map(|p| Unknown::Parameter(*p));
        // Without probings, no row depends on the stylus.
        let setup = (0..3).filter(|_| !probings.rows.is_empty());
        let setup = setup.map(Unknown::Stylus);
        let setup = setup.chain(balls.into_iter().flat_map(coordinates));
        let nominal = |name: &String| artefact.balls.iter().find(|b| b.name == *name)?.nominal;
        Self {
            machine,
            unknowns: parameters.chain(setup).collect(),
            places: (order(probings).into_iter())
                .map(|row| ProbingRow::of(machine, probings, row))
                .collect(),
            balls: probings.balls.clone(),
            bars: (artefact.bars.iter())
                .filter_map(|bar| BarRow::of(bar, probings))
                .collect(),
            stylus: StylusPrior::of(artefact, machine),
            nominal: probings.balls.iter().map(nominal).collect(),
            base: Box::new(base.clone()),
            observed: Observed::default(),
            period: period(probings.rows.iter().map(|row| row.time)),
            drift: Vec::new(),
            choice: Vec::new(),
            spindle: ProbedSpindle {
                tool_axis: machine.tool_axis,
                is_indexed: (probings.rows.windows(2)).any(|w| w[0].spindle != w[1].spindle),
            },
        }
    }

    /// With observations of other kinds, and with the drift that these say to look for.
    #[must_use]
    pub fn with(mut self, observations: &Observations) -> Self {
        let observed = Observed::new(self.machine, observations);
        if observed.has_stylus() && self.places.is_empty() {
            self.unknowns.extend((0..3).map(Unknown::Stylus));
        }
        self.unknowns.extend(&observed.unknowns);
        self.observed = observed;
        self = self.at_times(observations);
        if let Some(thermal) = &observations.thermal {
            let terms = thermal.terms.iter();
            let terms = terms.map(|(p, input)| Unknown::PerKelvin(*p, *input));
            self.unknowns.extend(terms.clone());
            self.choice = terms.zip(thermal.choice.iter().copied()).collect();
            self.base.sensors.clone_from(&thermal.inputs);
        }
        let drift = observations.drift.iter();
        self.unknowns
            .extend(drift.map(|one| Unknown::Drift(one.setup, one.component)));
        self
    }

    /// With what drift and temperatures are at the times of its rows.
    #[must_use]
    pub(crate) fn at_times(mut self, observations: &Observations) -> Self {
        self.drift.clone_from(&observations.drift);
        for drift in &self.drift {
            for row in self.places.iter_mut().filter(|_| drift.setup.is_none()) {
                row.hours[drift.component] = row.clock.map_or(0.0, |time| drift.hours(time));
            }
            let observed = self.observed.rows.iter_mut();
            for row in observed.filter(|row| drift.setup == Some(row.setup)) {
                row.hours[drift.component] = row.clock.map_or(0.0, |time| drift.hours(time));
            }
        }
        if let Some(thermal) = &observations.thermal {
            for row in &mut self.places {
                row.situation.kelvin = thermal.at(row.clock);
            }
            for row in &mut self.observed.rows {
                row.situation.kelvin = thermal.at(row.clock);
            }
        }
        self
    }

    /// The time (s) of each probing, then of each observation.
    pub(crate) fn clocks(&self) -> impl Iterator<Item = Option<f64>> {
        let probed = self.places.iter().map(|row| row.clock);
        probed.chain(self.observed.rows.iter().map(|row| row.clock))
    }

    /// Source and time (s) of each equation of a probing or an observation.
    pub(crate) fn times(&self) -> Vec<(Option<usize>, Option<f64>)> {
        let probed = self.places.iter().map(|row| (None, row.clock));
        let observed = self.observed.rows.iter();
        let rows = probed.chain(observed.map(|row| (Some(row.setup), row.clock)));
        let each = rows.zip(self.blocks());
        each.flat_map(|(row, block)| block.map(move |_| row))
            .collect()
    }

    /// True if the artefact or a set-up has times at which its rows were measured.
    pub(crate) fn has_times(&self) -> bool {
        self.period.is_some() || self.observed.periods.iter().any(Option::is_some)
    }

    /// The coordinates (mm) of the stylus that are stated, each with its number and its standard uncertainty.
    pub(crate) fn known_stylus(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        (0..3).filter_map(|k| Some((k, self.stylus.tip[k], self.stylus.sigma[k]?)))
    }

    /// The equations of each probing, then of each observation.
    pub(crate) fn blocks(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        let probed = (0..self.places.len()).map(|i| 3 * i..3 * i + 3);
        let first = 3 * self.places.len();
        let observed = self.observed.rows.iter().scan(first, |end, row| {
            let start = *end;
            *end += row.kind.dimension();
            Some(start..*end)
        });
        probed.chain(observed)
    }

    /// Number of equations of probings and observations, which come first.
    pub(crate) fn measured(&self) -> usize {
        3 * self.places.len() + self.observed.equations()
    }

    /// Weights for residuals in mm.
    pub(crate) fn unweighted(&self, least: f64) -> EquationWeights {
        EquationWeights {
            rows: vec![1.0; self.places.len() + self.observed.rows.len()],
            least,
        }
    }

    /// The command of each probing, then of each observation (mm, rad), and its situation.
    pub(crate) fn commands(&self) -> impl Iterator<Item = (&PerAxis, &Situation)> {
        let probed = self.places.iter().map(|row| (&row.q, &row.situation));
        let observed = self.observed.rows.iter();
        probed.chain(observed.map(|row| (&row.q, &row.situation)))
    }

    /// The parameters among some of the unknowns, by index.
    pub(crate) fn parameters(&self, unknowns: impl IntoIterator<Item = usize>) -> Vec<Parameter> {
        let unknowns = unknowns.into_iter().map(|i| self.unknowns[i]);
        let parameter = |unknown| match unknown {
            Unknown::Parameter(parameter) => Some(parameter),
            _ => None,
        };
        unknowns.filter_map(parameter).collect()
    }

    /// The range of an axis (by index) at all rows (mm or rad).
    pub(crate) fn range(&self, axis: usize) -> [f64; 2] {
        extremes(self.commands().map(|(q, _)| q[axis]))
    }

    /// The machine as known, with balls where the stylus was.
    pub(crate) fn start(&self) -> Estimate {
        let mut sums = vec![(Vector3::zeros(), 0.0); self.balls.len()];
        for (ball, tip) in self.tips(&self.base, &self.stylus.tip) {
            let (sum, count) = &mut sums[ball];
            *sum += tip;
            *count += 1.0;
        }
        let balls = (sums.iter().zip(&self.nominal))
            .map(|((sum, count), nominal)| nominal.unwrap_or(sum / *count))
            .collect();
        Estimate {
            errors: self.base.clone(),
            stylus: self.stylus.tip,
            balls,
            settings: self.observed.settings(),
            tools: self.observed.places(),
            drift: self.no_drift(),
        }
    }

    /// The sources whose drift is looked for, without drift.
    fn no_drift(&self) -> Vec<(Option<usize>, [f64; 6])> {
        let mut sources: Vec<Option<usize>> = (self.unknowns.iter())
            .filter_map(|unknown| match unknown {
                Unknown::Drift(source, _) => Some(*source),
                _ => None,
            })
            .collect();
        sources.sort_unstable();
        sources.dedup();
        (sources.into_iter())
            .map(|source| (source, [0.0; 6]))
            .collect()
    }

    /// Root mean square distance of linear axes from their mean position (mm).
    pub(crate) fn lever(&self) -> f64 {
        let linear =
            (0..self.machine.axes.len()).filter(|i| !self.machine.axes[*i].letter.is_rotary());
        let at = |i: usize| self.commands().map(move |(q, _)| q[i]);
        let count = self.commands().count() as f64;
        let variances = linear.map(|i| {
            let mean = at(i).sum::<f64>() / count;
            at(i).map(|q| (q - mean).powi(2)).sum::<f64>() / count
        });
        // If nothing moves, nothing can be identified either.
        variances.sum::<f64>().sqrt().max(LEAST_LEVER)
    }

    /// Number of equations.
    pub(crate) fn equations(&self) -> usize {
        self.measured()
            + self.bars.len()
            + self.known_coordinates().count()
            + self.observed.known.len()
    }

    /// Refuses problems that no rows can solve: parameters that the machine does not have, and too few equations.
    pub(crate) fn can_be_solved(&self) -> Result<(), IdentifyError> {
        let mut machine = ErrorModel::perfect(self.machine);
        let mut parameters = 0;
        for unknown in &self.unknowns {
            let Unknown::Parameter(parameter) = *unknown else {
                continue;
            };
            if !machine.set(self.machine, parameter, 0.0) {
                return Err(IdentifyError::NoSuchParameter { parameter });
            }
            parameters += 1;
        }
        let (equations, unknowns) = (self.equations(), self.unknowns.len());
        // One additional equation is needed to estimate the noise.
        if equations <= unknowns {
            return Err(IdentifyError::TooFew {
                equations,
                unknowns,
                parameters,
                has_setups: !self.observed.rows.is_empty(),
            });
        }
        Ok(())
    }

    /// Stated position of the stylus (mm, spindle frame).
    pub(crate) fn stated_stylus(&self) -> Vector3<f64> {
        self.stylus.tip
    }

    /// Stated positions of the balls (mm, workpiece frame).
    pub(crate) fn stated_balls(&self) -> &[Option<Vector3<f64>>] {
        &self.nominal
    }

    /// Known coordinates of the stylus, with their uncertainty.
    pub(crate) fn known_coordinates(&self) -> impl Iterator<Item = (usize, f64)> {
        (self.stylus.sigma.iter().enumerate()).filter_map(|(i, sigma)| Some((i, (*sigma)?)))
    }

    /// Adds a step to the unknowns.
    pub(crate) fn moved(&self, estimate: &Estimate, step: &DVector<f64>) -> Estimate {
        let mut next = estimate.clone();
        for (unknown, step) in self.unknowns.iter().zip(step.iter()) {
            // Unknowns that have been given up keep no value.
            if *step == 0.0 {
                continue;
            }
            match *unknown {
                Unknown::Parameter(parameter) => {
                    let before = next
                        .errors
                        .parameters
                        .get(&parameter)
                        .copied()
                        .unwrap_or(0.0);
                    next.errors.set(self.machine, parameter, before + step);
                }
                Unknown::PerKelvin(parameter, input) => {
                    (next.errors).adjust_per_kelvin(self.machine, parameter, input, *step);
                }
                Unknown::Stylus(k) => next.stylus[k] += step,
                Unknown::Ball(ball, k) => next.balls[ball][k] += step,
                Unknown::Setup(setup, part) => {
                    next.settings[setup] = next.settings[setup].moved(part, *step);
                }
                Unknown::Tool(tool, k) => next.tools[tool][k] += step,
                Unknown::Drift(source, k) => {
                    let mut all = next.drift.iter_mut();
                    if let Some((_, drift)) = all.find(|(of, _)| *of == source) {
                        drift[k] += step;
                    }
                }
            }
        }
        next
    }
}

/// The balls in the order of their names.
pub(crate) fn by_name(probings: &Probings) -> Vec<usize> {
    let mut balls: Vec<usize> = (0..probings.balls.len()).collect();
    balls.sort_by_key(|b| &probings.balls[*b]);
    balls
}

/// Places in the order of their rows.
pub(crate) fn by_row(places: &[ProbingRow]) -> Vec<usize> {
    let rows: Vec<f64> = places.iter().map(|place| place.row as f64).collect();
    numbers::order(&rows)
}

/// Rows of probings in an order that depends only on their content, because floating-point sums depend slightly on
/// the order.
pub(crate) fn order(probings: &Probings) -> Vec<usize> {
    let mut rows: Vec<usize> = (0..probings.rows.len()).collect();
    rows.sort_by_cached_key(|row| {
        let row = &probings.rows[*row];
        (
            probings.balls[row.ball].clone(),
            row.position.map(ordered),
            row.direction.map(ordered),
            [row.spindle, row.sigma.unwrap_or(0.0)].map(ordered),
        )
    });
    rows
}

/// Maps a number to an integer with the same order, for sorting.
fn ordered(value: f64) -> i64 {
    let bits = value.to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}
