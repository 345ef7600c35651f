//! Observations other than probings as equations, and their set-ups as unknowns.

use crate::Unknown;
use crate::estimate::Estimate;
use crate::formats::observations::{Drift, Observation, Observations, PlacePrior, STYLUS};
use crate::instrument::{
    Commanded, InitialSample, Instrument, Kind, LEVER, Seen, Setting, SettingPart, SetupPriors,
    turned,
};
use crate::prior::Prior;
use crate::setup::{FoundDrift, FoundPart, FoundSetup};
use nalgebra::{DVector, Matrix3, Rotation3, Vector3};
use std::collections::BTreeSet;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::numbers::extremes;

/// All observations.
#[derive(Clone, Debug, Default)]
pub(crate) struct Observed {
    pub rows: Vec<ObservedRow>,
    /// Name, kind, and first set-up.
    pub setups: Vec<(String, Kind, Setting)>,
    /// What is known about each.
    pub given: Vec<SetupPriors>,
    /// Name and first place (mm, spindle frame) of the points of the tool.
    pub tools: Vec<(String, Vector3<f64>)>,
    /// The times (s) of the first and the last row of each set-up, if all have one.
    pub periods: Vec<Option<[f64; 2]>>,
    /// Files that the observations come from.
    pub files: Vec<String>,
    /// Set-ups and tool points that are to be found.
    pub unknowns: Vec<Unknown>,
    /// Unknowns whose value is known beforehand, and the standard uncertainty of it (mm; rotations over [`LEVER`]).
    pub known: Vec<(Unknown, f64, f64)>,
}

/// An observation.
#[derive(Clone, Debug)]
pub(crate) struct ObservedRow {
    pub setup: usize,
    pub kind: Kind,
    /// The point of the tool; `None` for the stylus.
    pub tool: Option<usize>,
    pub q: PerAxis,
    pub situation: Situation,
    /// Rotation of the tool by the spindle.
    pub turned: Matrix3<f64>,
    pub commanded: Commanded,
    /// The reading (mm).
    pub read: Vector3<f64>,
    /// Stated standard uncertainty (mm).
    pub sigma: Option<f64>,
    /// [`Drift::hours`] of each component of drift.
    pub hours: [f64; 6],
    /// Time (s) by the clock of the file.
    pub clock: Option<f64>,
    pub file: usize,
    pub line: usize,
}

/// Set-up unknowns with a smaller effect on the observations (root mean square, mm per mm or per mrad) are left as
/// they are: misplacing a centre by 1 mm would move a reading by less than 0.1 µm.
const LEAST: f64 = 1e-4;
/// Effects that differ by less than this factor are equal: rounding must not decide.
const AS_LARGE: f64 = 1.0 + 1e-6;

impl Observed {
    pub fn new(machine: &Machine, all: &Observations) -> Self {
        let tools: Vec<(String, Vector3<f64>)> = (all.tools.iter().enumerate())
            .map(|(number, tool)| (tool.name.clone(), all.tip(machine, number)))
            .collect();
        let of_setup = |number: usize| {
            let own = all.rows.iter().filter(move |row| row.setup == number);
            period(own.map(|row| row.time))
        };
        let periods: Vec<Option<[f64; 2]>> = (0..all.setups.len()).map(of_setup).collect();
        let rows = ObservedRow::all(machine, all);
        let setups = all.setups.iter().enumerate();
        let setups = setups.map(|(number, setup)| {
            let own = rows.iter().filter(|row| row.setup == number);
            let samples: Vec<InitialSample> = own
                .map(|row| InitialSample {
                    commanded: row.commanded,
                    read: row.read,
                })
                .collect();
            let setting = setup.kind.start(&setup.given, &samples);
            (setup.name.clone(), setup.kind, setting)
        });
        let mut observed = Self {
            setups: setups.collect(),
            given: all.setups.iter().map(|setup| setup.given).collect(),
            rows,
            tools,
            periods,
            files: all.files.clone(),
            unknowns: Vec::new(),
            known: Vec::new(),
        };
        let (candidates, known) = observed.sought(all);
        observed.unknowns = observed.independent(machine, &candidates);
        (observed.unknowns).extend(known.iter().map(|(unknown, ..)| *unknown));
        observed.known = known;
        observed
    }

    /// The set-up and tool point unknowns of which nothing is known, and [`Self::known`].
    fn sought(&self, all: &Observations) -> (Vec<Unknown>, Vec<(Unknown, f64, f64)>) {
        let rows = &self.rows;
        let mut known = Vec::new();
        let mut candidates = Vec::new();
        for (number, setup) in all.setups.iter().enumerate() {
            // Without observations (left out, or in a file without rows) there is nothing to find.
            if !rows.iter().any(|row| row.setup == number) {
                continue;
            }
            for part in setup.kind.instrument().parts() {
                let unknown = Unknown::Setup(number, *part);
                match (part, setup.given.sigma(*part)) {
                    (_, None) => candidates.push(unknown),
                    (SettingPart::Length, Some(sigma)) => {
                        known.push((unknown, setup.given.length.unwrap_or(0.0), sigma));
                    }
                    // A rotation is one from the orientation as stated, and counts over a lever.
                    (_, Some(sigma)) => known.push((unknown, 0.0, sigma * LEVER)),
                }
            }
        }
        for (number, tool) in all.tools.iter().enumerate() {
            if !rows.iter().any(|row| row.tool == Some(number)) {
                continue;
            }
            for k in 0..3 {
                let unknown = Unknown::Tool(number, k);
                match tool.known {
                    PlacePrior::Unknown => candidates.push(unknown),
                    PlacePrior::Within(sigma) => {
                        known.push((unknown, self.tools[number].1[k], sigma));
                    }
                    PlacePrior::Exactly => {}
                }
            }
        }
        (candidates, known)
    }

    /// The effect of each unknown on the observations, on the nominal machine.
    fn nominal_effects(&self, machine: &Machine, unknowns: &[Unknown]) -> Vec<DVector<f64>> {
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        let estimate = Estimate {
            errors: Box::new(perfect.clone()),
            stylus: Vector3::zeros(),
            balls: Vec::new(),
            settings: self.settings(),
            tools: self.places(),
            drift: Vec::new(),
        };
        let nominal = |row: &ObservedRow| {
            let tip = row.turned
                * row
                    .tool
                    .map_or(Vector3::from(machine.tip), |t| self.tools[t].1);
            let pose = kinematics.nominal(&row.q, None);
            (row.commanded.seen(machine, &pose, &tip), pose.r)
        };
        let seen: Vec<_> = self.rows.iter().map(nominal).collect();
        let column = |unknown: &Unknown| {
            let mut column = DVector::zeros(3 * self.rows.len());
            for (i, (row, (seen, by_tool))) in self.rows.iter().zip(&seen).enumerate() {
                let effect = row.by_unknown(*unknown, &estimate, seen, by_tool);
                column.fixed_rows_mut::<3>(3 * i).copy_from(&effect);
            }
            let scale = match unknown {
                Unknown::Setup(_, SettingPart::Turn(_)) => LEVER,
                _ => 1.0,
            };
            column / scale
        };
        unknowns.iter().map(column).collect()
    }

    /// Those of the candidates whose effect on the observations differs from that of the others, on the nominal
    /// machine: again and again the one whose effect is largest, apart from what the chosen ones can do, and the first
    /// of several equal ones.
    fn independent(&self, machine: &Machine, candidates: &[Unknown]) -> Vec<Unknown> {
        let least = LEAST * (self.rows.len() as f64).sqrt();
        let columns = self.nominal_effects(machine, candidates);
        let mut left: Vec<(Unknown, DVector<f64>, f64)> = (candidates.iter().zip(columns))
            .map(|(unknown, column)| {
                let whole = column.norm();
                (*unknown, column, least.max(LEAST * whole))
            })
            .collect();
        let mut chosen = Vec::new();
        loop {
            left.retain(|(_, column, least)| column.norm() > *least);
            let best = (left.iter().enumerate()).fold(None, |best, (i, (_, column, _))| {
                let size = column.norm();
                match best {
                    Some((_, most)) if size <= most * AS_LARGE => best,
                    _ => Some((i, size)),
                }
            });
            let Some((best, size)) = best else {
                break;
            };
            let (unknown, column, _) = left.remove(best);
            chosen.push(unknown);
            let unit = column / size;
            for (_, column, _) in &mut left {
                column.axpy(-unit.dot(column), &unit, 1.0);
            }
        }
        // In the order of the candidates.
        (candidates.iter())
            .copied()
            .filter(|u| chosen.contains(u))
            .collect()
    }

    /// The value (mm; a rotation over [`LEVER`]) of an unknown of a set-up or a tool point, and its derivative by the unknown.
    pub fn value(&self, unknown: Unknown, estimate: &Estimate) -> (f64, f64) {
        match unknown {
            Unknown::Tool(tool, k) => (estimate.tools[tool][k], 1.0),
            Unknown::Setup(setup, SettingPart::Turn(k)) => {
                let first = &self.setups[setup].2.turn;
                let turn = estimate.settings[setup].turn * first.transpose();
                let turn = Rotation3::from_matrix_unchecked(turn).scaled_axis();
                (turn[k] * LEVER, LEVER)
            }
            Unknown::Setup(setup, SettingPart::Place(k)) => {
                (estimate.settings[setup].place[k], 1.0)
            }
            Unknown::Setup(setup, _) => (estimate.settings[setup].length, 1.0),
            _ => (0.0, 0.0),
        }
    }

    /// First set-ups.
    pub fn settings(&self) -> Vec<Setting> {
        self.setups.iter().map(|(_, _, setting)| *setting).collect()
    }

    /// First places of tool points.
    pub fn places(&self) -> Vec<Vector3<f64>> {
        self.tools.iter().map(|(_, place)| *place).collect()
    }

    /// The unknowns of a set-up and of the tool points that it observes, and what each is.
    fn parts(&self, number: usize) -> Vec<(Unknown, String)> {
        let own = self.rows.iter().filter(|row| row.setup == number);
        let tools: BTreeSet<usize> = own.filter_map(|row| row.tool).collect();
        let parts = self.setups[number].1.instrument().parts().iter();
        let parts = parts.map(|part| (Unknown::Setup(number, *part), part.to_string()));
        let points = tools.into_iter().flat_map(|tool| {
            ["x", "y", "z"]
                .into_iter()
                .enumerate()
                .map(move |(k, name)| (Unknown::Tool(tool, k), format!("tool point in {name}")))
        });
        parts.chain(points).collect()
    }

    /// The set-ups as found; `least` is the smallest uncertainty (mm) that priors were given, and `variance` that of an
    /// unknown, if it was determined.
    pub fn set_up(
        &self,
        estimate: &Estimate,
        least: f64,
        variance: &dyn Fn(Unknown) -> Option<f64>,
    ) -> Vec<FoundSetup> {
        let of = |(number, (name, kind, _)): (usize, &(String, Kind, Setting))| {
            let parts = self.parts(number).into_iter();
            let parts = parts.filter_map(|(unknown, what)| {
                let uncertainty = variance(unknown)?.sqrt();
                // Rotations count over a lever.
                let (value, scale) = self.value(unknown, estimate);
                let value = value / scale;
                let prior = self.known.iter().find(|(of, ..)| *of == unknown);
                let prior = prior.map(|(_, stated, sigma)| {
                    let used = sigma.max(least);
                    let [stated, sigma, used] = [*stated, *sigma, used].map(|v| v / scale);
                    Prior::new(stated, sigma, used, value, uncertainty)
                });
                Some(FoundPart {
                    what,
                    value,
                    uncertainty,
                    prior,
                })
            });
            FoundSetup {
                name: name.clone(),
                kind: *kind,
                parts: parts.collect(),
            }
        };
        self.setups.iter().enumerate().map(of).collect()
    }

    /// Drift as found.
    pub fn drifts(
        &self,
        all: &[Drift],
        estimate: &Estimate,
        variance: &dyn Fn(Unknown) -> Option<f64>,
    ) -> Vec<FoundDrift> {
        let found = |drift: &Drift| {
            let (setup, component) = (drift.setup, drift.component);
            let hours = drift.hours(drift.last) - drift.hours(drift.first);
            Some(FoundDrift {
                setup: setup.map(|number| self.setups[number].0.clone()),
                component,
                lag: drift.lag,
                value: estimate.drift_of(setup)?[component] * hours,
                uncertainty: variance(Unknown::Drift(setup, component))?.sqrt() * hours,
                seconds: drift.last - drift.first,
            })
        };
        all.iter().filter_map(found).collect()
    }

    /// True if an instrument observes the stylus.
    pub fn has_stylus(&self) -> bool {
        self.rows.iter().any(|row| row.tool.is_none())
    }

    /// Number of equations.
    pub fn equations(&self) -> usize {
        self.rows.iter().map(|row| row.kind.dimension()).sum()
    }
}

/// The times (s) of the first and the last row, if all have one and these differ.
pub(crate) fn period(times: impl Iterator<Item = Option<f64>>) -> Option<[f64; 2]> {
    let times: Vec<f64> = times.collect::<Option<_>>()?;
    let [low, high] = extremes(times);
    (high > low).then_some([low, high])
}

impl ObservedRow {
    fn all(machine: &Machine, all: &Observations) -> Vec<Self> {
        let row = |(row, commanded): (&Observation, Commanded)| {
            let setup = &all.setups[row.setup];
            Self {
                setup: row.setup,
                kind: setup.kind,
                tool: (all.tools[setup.tool].name != STYLUS).then_some(setup.tool),
                q: machine.to_kinematic(&row.position),
                situation: Situation {
                    sign: row.direction,
                    ..Situation::default()
                },
                turned: turned(machine.tool_axis, row.spindle),
                commanded,
                read: row.value,
                sigma: row.sigma,
                hours: [0.0; 6],
                clock: row.time,
                file: row.file,
                line: row.line,
            }
        };
        let rows = all.rows.iter().zip(all.commanded(machine));
        rows.map(row).collect()
    }

    pub fn instrument(&self) -> &'static dyn Instrument {
        self.kind.instrument()
    }

    /// The observed point of the tool (mm, spindle frame, turned by the spindle).
    pub fn tip(&self, estimate: &Estimate) -> Vector3<f64> {
        self.turned
            * self
                .tool
                .map_or(estimate.stylus, |tool| estimate.tools[tool])
    }

    /// What the instrument, which may have drifted, sees of the tool.
    pub fn drifted(&self, seen: Seen, estimate: &Estimate) -> Seen {
        match estimate.drift_of(Some(self.setup)) {
            None => seen,
            Some(drift) => Seen {
                point: moved(seen.point, &drift, &self.hours),
                turn: Rotation3::from_scaled_axis(-turn(&drift, &self.hours)).matrix() * seen.turn,
            },
        }
    }

    /// The reading according to an estimate less the actual one (mm).
    pub fn miss(
        &self,
        machine: &Machine,
        kinematics: &Kinematics<'_>,
        estimate: &Estimate,
    ) -> Vector3<f64> {
        let actual = kinematics.actual(&self.q, &self.situation, &Switches::ALL);
        let seen = self.commanded.seen(machine, &actual, &self.tip(estimate));
        let seen = self.drifted(seen, estimate);
        let setting = &estimate.settings[self.setup];
        self.instrument().reads(&self.commanded, setting, &seen) - self.read
    }

    /// Derivative of the reading by an unknown of its set-up, tool point or drift: mm per mm or rad. `by_tool` is the
    /// derivative of the point by the point in the spindle frame.
    pub fn by_unknown(
        &self,
        unknown: Unknown,
        estimate: &Estimate,
        seen: &Seen,
        by_tool: &Matrix3<f64>,
    ) -> Vector3<f64> {
        let instrument = self.instrument();
        let (commanded, setting) = (&self.commanded, &estimate.settings[self.setup]);
        let by_point = || instrument.by_point(commanded, setting, seen);
        match unknown {
            Unknown::Setup(setup, part) if setup == self.setup => {
                instrument.by_part(commanded, setting, seen, part)
            }
            Unknown::Tool(tool, k) if self.tool == Some(tool) => {
                by_point() * by_tool * self.turned.column(k)
            }
            Unknown::Stylus(k) if self.tool.is_none() => {
                by_point() * by_tool * self.turned.column(k)
            }
            Unknown::Drift(Some(setup), k) if setup == self.setup => match k {
                0..3 => -self.hours[k] * by_point().column(k),
                _ => {
                    let axis = Vector3::ith(k - 3, 1.0);
                    let about = instrument.about(commanded).unwrap_or_default();
                    let turned = Vector3::new(LEVER * about[k - 3], 0.0, 0.0);
                    -self.hours[k] * (by_point() * axis.cross(&seen.point) + turned)
                }
            },
            _ => Vector3::zeros(),
        }
    }
}

/// A point as seen from a set-up that drifts (mm/h and rad/h), after hours of each component of drift.
pub(crate) fn moved(point: Vector3<f64>, drift: &[f64; 6], hours: &[f64; 6]) -> Vector3<f64> {
    let shift = Vector3::from_fn(|k, _| drift[k] * hours[k]);
    point - shift - turn(drift, hours).cross(&point)
}

fn turn(drift: &[f64; 6], hours: &[f64; 6]) -> Vector3<f64> {
    Vector3::from_fn(|k, _| drift[3 + k] * hours[3 + k])
}
