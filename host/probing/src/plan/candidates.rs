//! Candidate probings: balls at rotary positions that the stylus can reach.

use super::touch::{Probe, Touching};
use super::touches::{Unreachable, touching};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_pcg::Pcg64Mcg;
use trueaxis_identify::Problem;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{Probing, Probings};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::parallel;

/// What a plan may use.
#[derive(Clone, Debug)]
pub struct Setup<'a> {
    /// The machine.
    pub machine: &'a Machine,
    /// Balls and stylus.
    pub artefact: &'a Artefact,
    /// Names of the balls that may be used.
    pub balls: Vec<String>,
    /// Geometry of the touches.
    pub probe: Probe,
    /// Standard uncertainty of a coordinate of a probing (mm).
    pub sigma: f64,
    /// What instruments read besides, as [`expected`](super::expected()).
    pub observations: Option<&'a Observations>,
}

impl Setup<'_> {
    /// Numbers of observations and of their set-ups.
    #[must_use]
    pub fn observed(&self) -> [usize; 2] {
        self.observations.map_or([0; 2], |observations| {
            [observations.rows.len(), observations.setups.len()]
        })
    }
}

/// Positions that rotary axes and spindle may take (deg).
#[derive(Clone, Debug, PartialEq)]
pub struct Allowed {
    /// For each axis; empty for linear ones.
    pub axes: Vec<Vec<f64>>,
    /// For the spindle.
    pub spindle: Vec<f64>,
    /// Directions from which each axis may arrive: 0 if it does not matter.
    pub directions: Vec<Vec<f64>>,
    /// Balls at positions that may not be used.
    pub(super) without: Vec<(String, Probing)>,
}

/// Why allowed positions are invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{reason}")]
pub struct AllowedError {
    /// What is wrong.
    pub reason: String,
    /// What to write instead.
    pub remedy: &'static str,
}

/// How to write allowed positions.
const REMEDY: &str =
    "write AXIS=FROM:TO:STEP in degrees, separated by commas: A=-60:60:15,C=0:330:30,S=0:300:60";
/// Default number of steps over a travel, and step (deg) if it is a full turn.
const STEPS: usize = 16;
const TURN: f64 = 360.0;
const WIDE: f64 = 30.0;
/// Angles of the spindle (deg), if it is indexed.
const SPINDLE: [f64; 6] = [0.0, 60.0, 120.0, 180.0, 240.0, 300.0];
/// Largest number of positions of one axis.
const MOST: usize = 721;
/// Distance that an axis travels in a prescribed direction before it stops (deg).
pub(super) const RUN_UP: f64 = 2.0;

impl Allowed {
    /// The whole travel of each rotary axis in sixteen steps, or steps of 30° if it covers a full turn, without
    /// indexing the spindle. `directions` tells for which axes the direction of approach matters.
    #[must_use]
    pub fn of(machine: &Machine, directions: &[bool]) -> Self {
        let axes = machine.axes.iter().map(|axis| {
            let [low, high] = axis.travel;
            if !axis.letter.is_rotary() {
                Vec::new()
            } else if axis.modulo {
                steps(0.0, TURN - WIDE, WIDE)
            } else if high - low >= TURN {
                // Starting from zero, so that zero is included.
                let (from, to) = ((low / WIDE).ceil() * WIDE, (high / WIDE).floor() * WIDE);
                steps(from, to, WIDE)
            } else {
                steps(low, high, (high - low) / STEPS as f64)
            }
        });
        Self {
            axes: axes.collect(),
            spindle: vec![0.0],
            directions: (directions.iter())
                .map(|matters| if *matters { vec![1.0, -1.0] } else { vec![0.0] })
                .collect(),
            without: Vec::new(),
        }
    }

    /// Lets the spindle be indexed over a full turn in steps of 60°.
    pub(crate) fn index_spindle(&mut self) {
        self.spindle = SPINDLE.to_vec();
    }

    /// Restricts the positions by a text such as `A=-60:60:15,S=0:300:60`; a single position is `A=0`.
    ///
    /// # Errors
    /// [`AllowedError`]: an axis that is not rotary, invalid numbers, positions outside the travel.
    pub fn restrict(&mut self, machine: &Machine, text: &str) -> Result<(), AllowedError> {
        let mut named = Vec::new();
        for part in text.split(',').map(str::trim) {
            let (name, range) = (part.split_once('='))
                .ok_or_else(|| bad(format!("`{part}` says no positions of an axis")))?;
            if named.contains(&name) {
                return Err(bad(format!("{name} is listed twice")));
            }
            named.push(name);
            let positions = listed(part, range)?;
            if name == "S" {
                self.spindle = positions;
                continue;
            }
            let letter = name.chars().next().filter(|_| name.len() == 1);
            let axis = letter.and_then(|l| machine.index(l));
            let Some(index) = axis.filter(|i| machine.axes[*i].letter.is_rotary()) else {
                return Err(bad(format!(
                    "{name} is not a rotary axis of {}",
                    machine.name
                )));
            };
            let axis = &machine.axes[index];
            let [low, high] = axis.travel;
            if let Some(outside) =
                (positions.iter()).find(|p| !axis.modulo && !(low..=high).contains(*p))
            {
                return Err(bad(format!(
                    "{name} = {outside} is outside the travel of {low} to {high}"
                )));
            }
            self.axes[index] = positions;
        }
        Ok(())
    }
}

fn bad(reason: String) -> AllowedError {
    AllowedError {
        reason,
        remedy: REMEDY,
    }
}

/// The positions of a part such as `A=-60:60:15`, given what comes after `=`.
fn listed(part: &str, range: &str) -> Result<Vec<f64>, AllowedError> {
    let numbers: Option<Vec<f64>> = (range.split(':'))
        .map(|n| n.trim().parse().ok().filter(|v: &f64| v.is_finite()))
        .collect();
    match numbers.as_deref() {
        Some([one]) => Ok(vec![*one]),
        Some([from, to, step]) if to >= from && *step > 0.0 && (to - from) / step < MOST as f64 => {
            Ok(steps(*from, *to, *step))
        }
        _ => Err(bad(format!("`{part}` are no positions"))),
    }
}

/// Each row with each of the values.
fn varied(rows: Vec<Probing>, values: &[f64], set: impl Fn(&mut Probing, f64)) -> Vec<Probing> {
    let mut all = Vec::with_capacity(rows.len() * values.len());
    for row in &rows {
        for value in values {
            let mut row = row.clone();
            set(&mut row, *value);
            all.push(row);
        }
    }
    all
}

fn steps(from: f64, to: f64, step: f64) -> Vec<f64> {
    // As many as fit, with a margin for rounding.
    let count = ((to - from) / step + 1e-9).floor() as usize;
    (0..=count).map(|i| from + i as f64 * step).collect()
}

/// More candidates are not worth the time and memory; they are thinned out at random.
const MANY: usize = 4000;

impl<'a> Setup<'a> {
    /// The equations of probings and of what instruments read besides. `base` is known of the machine.
    pub(super) fn problem(
        &self,
        probings: &Probings,
        parameters: &[Parameter],
        base: &ErrorModel,
    ) -> Problem<'a> {
        let problem = Problem::new(self.machine, probings, self.artefact, parameters, base);
        match self.observations {
            Some(observations) => problem.with(observations),
            None => problem,
        }
    }

    /// With the balls of a plan.
    pub(super) fn of_plan(&self, plan: &Probings) -> Self {
        let balls = plan.balls.clone();
        Self {
            balls,
            ..self.clone()
        }
    }

    /// All reachable probings, and the first unreachable one with the reason.
    #[must_use]
    pub fn candidates(&self, allowed: &Allowed) -> (Probings, Option<(Probing, Unreachable)>) {
        let mut rows = vec![Probing {
            sigma: Some(self.sigma),
            ..Probing::default()
        }];
        for (i, positions) in allowed.axes.iter().enumerate() {
            if !positions.is_empty() {
                rows = varied(rows, positions, |row, v| row.position[i] = v);
            }
        }
        let numbers: Vec<f64> = (0..self.balls.len()).map(|b| b as f64).collect();
        rows = varied(rows, &numbers, |row, v| row.ball = v as usize);
        let reached: Vec<Result<Probing, Box<(Probing, Unreachable)>>> =
            parallel::map(&rows, |row| {
                (self.touched(row)).map_err(|reason| Box::new((row.clone(), reason)))
            });
        let failed = reached.iter().find_map(|r| r.as_ref().err());
        let first = failed.map(|why| (**why).clone());
        let mut rows: Vec<Probing> = reached.into_iter().filter_map(Result::ok).collect();
        rows = varied(rows, &allowed.spindle, |row, v| row.spindle = v);
        if allowed.spindle.iter().any(|s| *s != 0.0) {
            // A stylus that is off centre moves with the spindle.
            let touched = rows.iter().filter_map(|row| self.touched(row).ok());
            rows = touched.collect();
        }
        for (i, directions) in allowed.directions.iter().enumerate() {
            rows = varied(rows, directions, |row, v| row.direction[i] = v);
        }
        let has_run_up =
            |row: &Probing| (0..self.machine.axes.len()).all(|i| self.can_come(row, i));
        rows.retain(|row| has_run_up(row) && !self.is_left_out(row, allowed));
        let mut random = Pcg64Mcg::seed_from_u64(1);
        if rows.len() > MANY {
            rows.shuffle(&mut random);
            rows.truncate(MANY);
        }
        let balls = self.balls.clone();
        (Probings { balls, rows }, first)
    }

    fn is_left_out(&self, row: &Probing, allowed: &Allowed) -> bool {
        allowed.without.iter().any(|(ball, other)| {
            *ball == self.balls[row.ball]
                && row.spindle == other.spindle
                && row.position == other.position
        })
    }

    /// A row with its linear axes at the centre of its ball.
    fn touched(&self, row: &Probing) -> Result<Probing, Unreachable> {
        let touching = self.touching(row)?;
        let mut row = row.clone();
        for (i, axis) in self.machine.axes.iter().enumerate() {
            if !axis.letter.is_rotary() {
                row.position[i] = touching.centre[i];
            }
        }
        Ok(row)
    }

    /// The touches of a row whose ball is one of [`Self::balls`].
    ///
    /// # Errors
    /// [`Unreachable`].
    pub fn touching(&self, row: &Probing) -> Result<Touching, Unreachable> {
        let name = &self.balls[row.ball];
        let ball = self.artefact.balls.iter().find(|b| b.name == *name);
        let ball = ball.ok_or_else(Unreachable::no_place)?;
        touching(self.machine, self.artefact, ball, row, &self.probe)
    }

    /// True if an axis has room to arrive from the direction that a row requires.
    pub(super) fn can_come(&self, row: &Probing, i: usize) -> bool {
        let axis = &self.machine.axes[i];
        let from = row.position[i] - row.direction[i] * RUN_UP;
        let [low, high] = axis.travel;
        axis.modulo || row.direction[i] == 0.0 || (low..=high).contains(&from)
    }
}
