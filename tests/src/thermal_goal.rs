//! From temperatures and points measured on a machine that warms up to its drift in duty cycles that nobody has seen.

use crate::Fixed;
use crate::thermal_field::{Duty, MACHINE, Parts, SENSORS, STEP, State, duty_cycle, training};
use nalgebra::Vector3;
use std::fmt::Write;
use trueaxis::Lag;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::{self, Observations};
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::formats::temperatures::{self, Temperatures};
use trueaxis_identify::{
    Identified, IdentifyOptions, NotKnown, Problem, Warmed, error_file, identify, thermal,
};
use trueaxis_model::errors::{ErrorModel, Parameter, Situation, Switches, Thermal};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// Standard uncertainty of a coordinate of a point (mm).
const NOISE: f64 = 0.5e-3;
/// Errors of the cold machine.
const COLD: [(&str, f64); 5] = [
    ("EXX1", 20e-6),
    ("EYY1", -15e-6),
    ("EZZ1", 30e-6),
    ("EC0Y", 40e-6),
    ("EB0Z", -25e-6),
];
/// The parameters that are looked for and may change with temperature.
pub const MODEL: [&str; 10] = [
    "EXX1", "EYY1", "EZZ1", "EC0Y", "EA0Z", "EB0Z", "EX0S", "EY0S", "EZ0S", "EZZ2",
];

/// What the machine was learnt from, as files.
#[derive(Clone, Debug)]
pub struct Files {
    /// Measured points.
    pub points: String,
    /// Temperatures over time.
    pub temperatures: String,
}

/// How a machine is measured.
#[derive(Clone, Copy, Debug)]
pub struct Measurement {
    /// Length of each of the four cycles (h).
    pub hours: f64,
    /// Time (s) from one round of points to the next.
    pub every: f64,
    /// Time (s) from one row of temperatures to the next.
    pub log: f64,
    /// What the machine does to the temperatures' effect: 1, or 0 for a machine that does not move.
    pub effect: f64,
    /// Seed of noise.
    pub seed: u64,
}

impl Measurement {
    /// The goal: 8 h.
    pub const EIGHT_HOURS: Self = Self {
        hours: 2.0,
        every: 300.0,
        log: 10.0,
        effect: 1.0,
        seed: 1,
    };
}

/// Drift (µm) over unseen duty cycles.
#[derive(Clone, Copy, Debug, Default)]
pub struct Drift {
    /// Root mean square of a coordinate.
    pub rms: f64,
    /// The largest distance.
    pub most: f64,
}

/// The figures of the goal.
#[derive(Clone, Debug)]
pub struct Reached {
    /// Hours of data.
    pub hours: f64,
    /// The chosen sensors.
    pub sensors: Vec<String>,
    /// Number of cycles in the data.
    pub cycles: usize,
    /// Drift in unseen duty cycles without temperatures.
    pub without: Drift,
    /// Like `without`, with them.
    pub with: Drift,
    /// The stated coverage interval (µm).
    pub band: f64,
    /// The part of the coordinates of unseen duty cycles within it.
    pub covered: f64,
    /// The part of the drift that is left in the duty cycle where it is largest.
    pub worst: f64,
    /// The error file.
    pub errors: String,
    /// What was chosen, and why.
    pub warmed: Warmed,
}

/// The machine.
///
/// # Panics
/// Never: its file is right.
#[must_use]
pub fn machine() -> Machine {
    Machine::from_toml(MACHINE).expect("a machine")
}

fn cold(machine: &Machine) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    for (name, value) in COLD {
        errors.set(machine, named(name), value);
    }
    errors
}

fn named(name: &str) -> Parameter {
    Parameter::parse(name).expect("a parameter")
}

/// Places at which points are measured, all over the volume.
fn places() -> Vec<[f64; 3]> {
    vec![
        [-250.0, -150.0, -350.0],
        [250.0, -150.0, -350.0],
        [-250.0, 150.0, -350.0],
        [0.0, 0.0, -200.0],
        [250.0, 150.0, -50.0],
        [-250.0, 0.0, -50.0],
    ]
}

/// The tip (mm, workpiece frame).
#[must_use]
pub fn tip(
    machine: &Machine,
    errors: &ErrorModel,
    place: &[f64; 3],
    situation: &Situation,
) -> Vector3<f64> {
    let kinematics = Kinematics::new(machine, errors);
    let q = machine.to_kinematic(place);
    kinematics.actual(&q, situation, &Switches::ALL).t
}

/// Temperatures and points of four cycles.
#[must_use]
pub fn measured(machine: &Machine, measurement: &Measurement) -> Files {
    let parts = Parts::all(measurement.effect);
    measured_on(machine, &cold(machine), &parts, measurement)
}

/// A row of a point as it is measured, with noise.
fn row(place: [f64; 3], mut point: Vector3<f64>, time: f64, random: &mut Fixed) -> String {
    for value in point.iter_mut() {
        let sum: f64 = (0..12).map(|_| random.within(-0.5, 0.5)).sum();
        *value += NOISE * sum;
    }
    let ([x, y, z], p) = (place, point);
    let um = NOISE * 1e3;
    format!(
        "point,camera,{x},{y},{z},{:.6},{:.6},{:.6},{um},{time}\n",
        p.x, p.y, p.z
    )
}

/// Like `measured`, of a machine with other errors when it is cold, and other effects of temperatures. `effect` is not used.
#[must_use]
pub fn measured_on(
    machine: &Machine,
    cold: &ErrorModel,
    parts: &Parts,
    measurement: &Measurement,
) -> Files {
    let Measurement {
        hours,
        every,
        log: log_every,
        seed,
        ..
    } = *measurement;
    let mut random = Fixed::new(seed);
    let mut state = State::cold();
    let names: Vec<String> = SENSORS.iter().map(|s| format!("{s}_C")).collect();
    let mut log = format!("time_s,cycle,{}\n", names.join(","));
    let mut points = "kind,setup,X,Y,Z,x_mm,y_mm,z_mm,sigma_um,time_s\n".to_owned();
    let mut time = 0.0;
    for (cycle, duties) in training(hours).into_iter().enumerate() {
        for duty in duties {
            let celsius = state.celsius(time, &mut random).map(|c| format!("{c:.2}"));
            if time % log_every == 0.0 {
                let _ = writeln!(log, "{time},{cycle},{}", celsius.join(","));
            }
            if time % every == 0.0 {
                let errors = state.errors(machine, cold, parts);
                for place in places() {
                    let point = tip(machine, &errors, &place, &Situation::default());
                    points += &row(place, point, time, &mut random);
                }
            }
            state.advance(duty);
            time += STEP;
        }
    }
    // One more row, so that the last points have temperatures after them.
    let celsius = state.celsius(time, &mut random).map(|c| format!("{c:.2}"));
    let _ = writeln!(log, "{time},3,{}", celsius.join(","));
    Files {
        points,
        temperatures: log,
    }
}

/// Identifies the machine from files, as `trueaxis identify --temperatures` does.
///
/// # Panics
/// If it cannot.
#[must_use]
pub fn learnt(machine: &Machine, files: &Files) -> (Identified, Warmed, String) {
    let log = temperatures::read(&files.temperatures).expect("temperatures");
    let observations = observations::read(&files.points, "points.csv", machine).expect("points");
    learnt_from(machine, observations, &log).expect("an identification")
}

/// Like `learnt`, from what was read of files.
///
/// # Errors
/// Why it cannot.
pub fn learnt_from(
    machine: &Machine,
    mut observations: Observations,
    log: &Temperatures,
) -> Result<(Identified, Warmed, String), String> {
    let base = ErrorModel::perfect(machine);
    let model = MODEL.map(named);
    let (probings, artefact) = (Probings::default(), Artefact::default());
    let find = |observations: &Observations| {
        let problem = Problem::new(machine, &probings, &artefact, &model, &base);
        let problem = problem.with(observations);
        let identified =
            identify(&problem, IdentifyOptions::default()).map_err(|e| e.to_string())?;
        Ok::<_, String>((problem, identified))
    };
    let (problem, identified) = find(&observations)?;
    let warmed = thermal(&problem, &identified, log, &model).map_err(|e| e.to_string())?;
    observations.thermal = Some(warmed.model.clone());
    let (_, identified) = find(&observations)?;
    let text = error_file(
        machine,
        &probings,
        &observations,
        &identified,
        &NotKnown::default(),
        "covariance.csv",
    );
    Ok((identified, warmed, text))
}

/// What a controller takes a sensor's lagged difference from its reference (K) to be.
fn followed(input: &Thermal, lag: &mut Lag, celsius: &[f64]) -> f64 {
    let mut sensors = SENSORS.iter();
    let sensor = sensors.position(|s| *s == input.sensor).expect("a sensor");
    let u = (celsius[sensor] - input.reference_celsius) as f32;
    // As a controller does, with a coarser period: a fraction of the shortest lag.
    let y = match input.lag_rate() {
        0.0 => u,
        rate => (0..100)
            .map(|_| lag.follow(u, rate, 0.1))
            .fold(0.0, |_, y| y),
    };
    let [low, high] = input.range_kelvin;
    // Tables hold the ends of the range.
    f64::from(y).clamp(low, high)
}

/// Compares the drift of the machine in `count` random duty cycles of `hours` with what the identified errors say.
///
/// # Panics
/// If the parts of the comparison do not fit together.
#[must_use]
pub fn unseen(
    machine: &Machine,
    identified: &Identified,
    warmed: &Warmed,
    hours: f64,
    count: u64,
) -> (Drift, Drift, f64, f64) {
    let cold = cold(machine);
    let band = warmed.band;
    let mut sums = [0.0; 2];
    let mut most = [0.0_f64; 2];
    let (mut within, mut all, mut worst) = (0, 0, 0.0_f64);
    for cycle in 0..count {
        let mut random = Fixed::new(1000 + cycle);
        let duties: Vec<Duty> = duty_cycle(hours, &mut random);
        let mut state = State::cold();
        let mut lags = vec![Lag::NEW; warmed.model.inputs.len()];
        let mut first: Option<Vec<[Vector3<f64>; 2]>> = None;
        let mut own = [0.0; 2];
        for (step, duty) in duties.into_iter().enumerate() {
            let time = step as f64 * STEP;
            let celsius = state.celsius(time, &mut random);
            let mut situation = Situation::default();
            let inputs = warmed.model.inputs.iter().zip(&mut lags);
            for ((input, lag), kelvin) in inputs.zip(&mut situation.kelvin) {
                *kelvin = followed(input, lag, &celsius);
            }
            if step % 30 == 0 {
                let errors = state.errors(machine, &cold, &Parts::all(1.0));
                let at = |place: &[f64; 3]| {
                    let truth = tip(machine, &errors, place, &Situation::default());
                    let model = tip(machine, &identified.errors, place, &situation);
                    [truth, model]
                };
                let now: Vec<[Vector3<f64>; 2]> = places().iter().map(at).collect();
                let start = first.get_or_insert_with(|| now.clone());
                for ([truth, model], [truth_0, model_0]) in now.iter().zip(start.iter()) {
                    let drift = truth - truth_0;
                    let left = drift - (model - model_0);
                    for (k, d) in [drift, left].into_iter().enumerate() {
                        own[k] += d.norm_squared();
                        most[k] = most[k].max(d.norm());
                    }
                    all += 3;
                    within += left.iter().filter(|v| v.abs() <= band).count();
                }
            }
            state.advance(duty);
        }
        worst = worst.max((own[1] / own[0]).sqrt());
        sums[0] += own[0];
        sums[1] += own[1];
    }
    let drift = |k: usize| Drift {
        rms: (sums[k] / f64::from(all)).sqrt() * 1e3,
        most: most[k] * 1e3,
    };
    (drift(0), drift(1), within as f64 / f64::from(all), worst)
}

/// The whole goal, with `count` unseen duty cycles of 4 h.
#[must_use]
pub fn reached(measurement: &Measurement, count: u64) -> Reached {
    let machine = machine();
    let files = measured(&machine, measurement);
    let (identified, warmed, errors) = learnt(&machine, &files);
    let (without, with, covered, worst) = unseen(&machine, &identified, &warmed, 4.0, count);
    let mut sensors: Vec<String> = warmed
        .model
        .inputs
        .iter()
        .map(|i| i.sensor.clone())
        .collect();
    sensors.sort_unstable();
    sensors.dedup();
    Reached {
        hours: 4.0 * measurement.hours,
        sensors,
        cycles: warmed.cycles.len(),
        without,
        with,
        band: warmed.band * 1e3,
        covered,
        worst,
        errors,
        warmed,
    }
}
