//! Drift of the artefact and of instruments that the residuals show.

use crate::formats::observations::Drift;
use crate::narrowed::narrowed;
use crate::rows::Problem;
use crate::snooping::deviations;
use crate::{Identified, Unknown};
use nalgebra::{DMatrix, DVector};

/// A component of drift is significant beyond this many standard deviations of a normal distribution: chance gives
/// one this large once in a thousand.
const SIGNIFICANT: f64 = 3.09;
/// The fraction of its effect that the unknowns must not be able to absorb. Drift of rows in an order in which a
/// parameter changes steadily would otherwise take the place of the parameter.
const TESTABLE: f64 = 0.1;
/// Time constants that are tried, as parts of the time of the rows: longer ones hardly bend, and shorter ones are over
/// before there are enough rows.
const LAGS: [f64; 6] = [0.0625, 0.125, 0.25, 0.5, 1.0, 2.0];
/// The ratio of neighbours.
const RATIO: f64 = 2.0;
/// Steps of the search between neighbours, each of which leaves 0.62 of the interval: to half a percent.
const STEPS: usize = 12;
/// How often each component is judged again when the others are known.
const ROUNDS: usize = 2;

/// The drift that the residuals of an identification show, along and about the axes of the workpiece frame, of the
/// artefact and of each set-up whose rows all have a time. The component that chance explains least (F-test) is
/// accepted if it is significant, then the next one is searched. Drift is linear in time, or exponential where that
/// lowers the Bayesian information criterion although the time constant is one more unknown. For
/// [`Observations::drift`](crate::formats::observations::Observations::drift).
#[must_use]
pub fn drifting(problem: &Problem<'_>, identified: &Identified) -> Vec<Drift> {
    let steady = steady(problem);
    if steady.is_empty() {
        return steady;
    }
    let search = DriftSearch::new(problem, identified, steady);
    let mut found: Vec<DriftComponent> = Vec::new();
    loop {
        let rest = search.rest(&found);
        let is_new = |i: &usize| found.iter().all(|one| one.number != *i);
        let others = (0..search.steady.len()).filter(is_new);
        let others = others.filter_map(|i| search.best(i, &rest));
        match others.max_by(|a, b| a.deviations.total_cmp(&b.deviations)) {
            Some(best) if best.deviations >= SIGNIFICANT => found.push(best),
            _ => break,
        }
    }
    for _ in 0..ROUNDS {
        for _ in 0..found.len() {
            let number = found.remove(0).number;
            let again = search.best(number, &search.rest(&found));
            found.extend(again.filter(|again| again.deviations >= SIGNIFICANT));
        }
    }
    found.into_iter().map(|one| one.drift).collect()
}

/// Every component, linear.
fn steady(problem: &Problem<'_>) -> Vec<Drift> {
    let artefact = problem.period.map(|period| (None, period));
    let setups = problem.observed.periods.iter().enumerate();
    let setups = setups.filter_map(|(setup, period)| Some((Some(setup), (*period)?)));
    let sources = artefact.into_iter().chain(setups);
    let all = sources.flat_map(|(setup, [first, last])| {
        (0..6).map(move |component| Drift {
            setup,
            component,
            lag: None,
            first,
            last,
        })
    });
    all.collect()
}

/// A component of drift with the best course.
struct DriftComponent {
    /// As an index into [`DriftSearch::steady`].
    number: usize,
    drift: Drift,
    effect: Effect,
    /// Chance explains as much as a normal distribution gives this many standard deviations.
    deviations: f64,
}

/// The effect of drift of 1 mm/h or rad/h on all equations.
#[derive(Clone)]
struct Effect {
    /// The part that the unknowns cannot absorb.
    free: DVector<f64>,
    /// The size of the part that varies.
    whole: f64,
}

/// What the unknowns and the components found so far leave.
struct Remainder {
    /// Orthonormal effects of these components.
    basis: Vec<DVector<f64>>,
    left: DVector<f64>,
    freedom: usize,
}

impl Remainder {
    fn apart(&self, mut column: DVector<f64>) -> DVector<f64> {
        for unit in &self.basis {
            column.axpy(-unit.dot(&column), unit, 1.0);
        }
        column
    }

    /// By how much an effect lowers the sum of squares; `None` if the unknowns absorb it.
    fn gain(&self, effect: &Effect) -> Option<f64> {
        let free = self.apart(effect.free.clone());
        let size = free.norm();
        (size > TESTABLE * effect.whole).then(|| (free.dot(&self.left) / size).powi(2))
    }

    /// The Bayesian information criterion after a gain by a number of unknowns.
    fn criterion(&self, gain: f64, unknowns: usize) -> f64 {
        let count = self.left.len() as f64;
        let squares = (self.left.norm_squared() - gain).max(f64::MIN_POSITIVE);
        count * libm::log(squares) + unknowns as f64 * libm::log(count)
    }

    /// How unlikely chance gives a gain by a number of unknowns, in standard deviations of a normal distribution.
    fn deviations(&self, gain: f64, unknowns: usize) -> f64 {
        let freedom = self.freedom - unknowns;
        let squares = (self.left.norm_squared() - gain).max(f64::MIN_POSITIVE);
        let ratio = (gain / unknowns as f64) / (squares / freedom as f64);
        deviations(ratio, unknowns, freedom)
    }
}

/// All components that can be found.
struct DriftSearch<'a> {
    steady: Vec<Drift>,
    /// Each with its linear course, then with each of [`LAGS`].
    effects: Vec<Vec<Effect>>,
    identified: &'a Identified,
    jacobian: DMatrix<f64>,
    left: DVector<f64>,
    /// The effect of one hour of each component.
    hour: DMatrix<f64>,
    /// Source and time (s) of each equation of a probing or an observation.
    times: Vec<(Option<usize>, Option<f64>)>,
}

impl<'a> DriftSearch<'a> {
    fn new(problem: &Problem<'_>, identified: &'a Identified, steady: Vec<Drift>) -> Self {
        let place = &identified.place;
        let unknowns: Vec<Unknown> = (steady.iter())
            .map(|drift| Unknown::Drift(drift.setup, drift.component))
            .collect();
        let hour = problem.after_an_hour();
        let mut search = Self {
            steady,
            effects: Vec::new(),
            identified,
            jacobian: problem.jacobian(&place.estimate, &place.weights),
            left: problem.residuals(&place.estimate, &place.weights),
            hour: hour.derivatives(&unknowns, &place.estimate, &place.weights),
            times: problem.times(),
        };
        let of = |(number, drift): (usize, &Drift)| {
            let lags = LAGS.map(|part| Some(part * (drift.last - drift.first)));
            let lags = std::iter::once(None).chain(lags);
            lags.map(|lag| search.effect(number, lag)).collect()
        };
        search.effects = search.steady.iter().enumerate().map(of).collect();
        search
    }

    fn effect(&self, number: usize, lag: Option<f64>) -> Effect {
        let drift = Drift {
            lag,
            ..self.steady[number]
        };
        let hours: Vec<Option<f64>> = (self.times.iter())
            .map(|(source, time)| Some(drift.hours((*time).filter(|_| *source == drift.setup)?)))
            .collect();
        let own = hours.iter().flatten();
        let mean = own.clone().sum::<f64>() / own.count() as f64;
        let column = |less: f64| {
            let mut column = self.hour.column(number).into_owned();
            for (value, hours) in column.iter_mut().zip(&hours) {
                *value *= hours.map_or(0.0, |hours| hours - less);
            }
            column
        };
        let mut free = column(0.0);
        let gradient = self.jacobian.tr_mul(&free);
        if let Some(step) = self.identified.place.factor.step(&gradient) {
            free += &self.jacobian * step;
        }
        Effect {
            free,
            whole: column(mean).norm(),
        }
    }

    fn rest(&self, found: &[DriftComponent]) -> Remainder {
        let unknowns = found.iter().map(|one| one.drift.unknowns());
        let mut rest = Remainder {
            basis: Vec::new(),
            left: self.left.clone(),
            freedom: self.identified.freedom.saturating_sub(unknowns.sum()),
        };
        for one in found {
            let unit = rest.apart(one.effect.free.clone()).normalize();
            rest.left.axpy(-unit.dot(&rest.left), &unit, 1.0);
            rest.basis.push(unit);
        }
        rest
    }

    /// A component with its best course; `None` if it cannot be told from the unknowns.
    fn best(&self, number: usize, rest: &Remainder) -> Option<DriftComponent> {
        let of = |drift: Drift, effect: Effect| {
            let (gain, unknowns) = (rest.gain(&effect)?, drift.unknowns());
            (rest.freedom > unknowns).then(|| {
                let component = DriftComponent {
                    number,
                    drift,
                    effect,
                    deviations: rest.deviations(gain, unknowns),
                };
                (component, rest.criterion(gain, unknowns))
            })
        };
        let steady = self.steady[number];
        let tried = std::iter::once(None).chain(LAGS.map(Some));
        let tried = self.effects[number].iter().zip(tried);
        let tried = tried.filter_map(|(effect, part)| {
            let lag = part.map(|part| part * (steady.last - steady.first));
            let (component, criterion) = of(Drift { lag, ..steady }, effect.clone())?;
            Some((component, criterion, part))
        });
        let (component, _, part) = tried.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let refined = part.and_then(|part| {
            let (drift, effect) = self.refined(number, part, rest);
            of(drift, effect)
        });
        Some(refined.map_or(component, |(refined, _)| refined))
    }

    /// A component with the time constant near one of [`LAGS`] that leaves least.
    fn refined(&self, number: usize, part: f64, rest: &Remainder) -> (Drift, Effect) {
        let steady = self.steady[number];
        let span = steady.last - steady.first;
        let ends = [LAGS[0], LAGS[LAGS.len() - 1]];
        let near = [part / RATIO, part * RATIO].map(|part| part.clamp(ends[0], ends[1]) * span);
        let left = |lag| -(rest.gain(&self.effect(number, Some(lag)))).unwrap_or(0.0);
        let lag = Some(narrowed(near, STEPS, left).0);
        (Drift { lag, ..steady }, self.effect(number, lag))
    }
}
