//! Machines with random errors and two balls to calibrate them with, some of them with errors that no model of the
//! calibration has.

use crate::fixed::Fixed;
use nalgebra::Vector3;
use std::error::Error;
use std::f64::consts::TAU;
use trueaxis_identify::Model;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_probing::plan::{Allowed, Probe, Setup};

/// Layouts: a trunnion, table and head, a fork head, a trunnion with an inclined axis, and two trunnions of other sizes.
const MACHINES: [(&str, &str); 6] = [
    (
        "linuxcnc-xyzac-trt",
        include_str!("../../examples/linuxcnc-xyzac-trt/machine.toml"),
    ),
    (
        "table-head",
        include_str!("../../examples/table-head/machine.toml"),
    ),
    (
        "fork-head",
        include_str!("../../examples/fork-head/machine.toml"),
    ),
    (
        "huron-k2x8",
        include_str!("../../examples/huron-k2x8/machine.toml"),
    ),
    (
        "kolibri",
        include_str!("../../examples/kolibri/machine.toml"),
    ),
    ("hu40", include_str!("../../examples/hu40/machine.toml")),
];
/// Ordinary errors; they are drawn, and all multiplied by a factor from a tenth to ten.
const ANGLE: f64 = 40e-6;
const LENGTH: f64 = 15e-3;
const SCALE: f64 = 40e-6;
/// Largest errors outside the model (mm): reversal value, amplitudes of run-out and of waves of straightness with so many
/// pieces.
const BACKLASH: f64 = 4e-3;
const RUN_OUT: f64 = 2e-3;
const STRAIGHTNESS: f64 = 3e-3;
const POINTS: usize = 24;
/// Balls that can be reached at fewer rotary positions than this are placed elsewhere.
const LEAST: usize = 40;
const TRIES: usize = 500;

/// Random numbers.
struct Random(Fixed);

impl Random {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.bits()) / f64::from(u32::MAX)
    }
}

/// A machine and the balls on it.
pub struct DrawnMachine {
    /// The layout, and how many times the ordinary errors it has.
    pub about: String,
    /// The machine file.
    pub text: &'static str,
    /// The machine.
    pub machine: Machine,
    /// The error file.
    pub errors: String,
    /// Where the balls are said to be, and where they are.
    stated: [Vector3<f64>; 2],
    balls: [Vector3<f64>; 2],
}

impl DrawnMachine {
    /// The machine with this number, whose errors are inside the model of a calibration, or `outside` of it too.
    ///
    /// # Errors
    /// If no two balls can be reached at many positions.
    pub fn new(seed: u64, outside: bool) -> Result<Self, Box<dyn Error>> {
        let mut random = Random(Fixed::new(seed + 1));
        // Seeds that are close to each other begin alike.
        for _ in 0..20 {
            random.0.bits();
        }
        let (name, text) = MACHINES[seed as usize % MACHINES.len()];
        let machine = Machine::from_toml(text).map_err(|e| e.message)?;
        let factor = 10.0_f64.powf(random.within(-1.0, 1.0));
        let mut of_machine = errors(&machine, factor, &mut random)?;
        if outside {
            // Drawn apart, so that the rest of the machine is the same.
            of_machine += &errors_outside(&machine, &mut Random(Fixed::new(seed + 1001)));
        }
        let model = ErrorModel::from_toml(&of_machine, &machine).map_err(|e| e.message)?;
        let [(one, real_one), (two, real_two)] = balls(&machine, &model, &mut random)?;
        Ok(Self {
            about: format!("{name}, errors {factor:.2} times the ordinary ones"),
            text,
            machine,
            errors: of_machine,
            stated: [one, two],
            balls: [real_one, real_two].map(|ball| ball.map(|at| at + random.within(-0.05, 0.05))),
        })
    }

    /// The file of the artefact as its owner knows it, with the measured distance of the balls.
    #[must_use]
    pub fn artefact(&self) -> String {
        let mut artefact = String::new();
        for (name, stated) in ["one", "two"].iter().zip(&self.stated) {
            artefact += &format!(
                "[[ball]]\nname = \"{name}\"\nnominal_mm = [{:.1}, {:.1}, {:.1}]\n\n",
                stated.x, stated.y, stated.z
            );
        }
        let length = (self.balls[1] - self.balls[0]).norm();
        artefact += &format!(
            "[[bar]]\nballs = [\"one\", \"two\"]\nlength_mm = {length:.4}\nstandard_uncertainty_mm = 0.0005\n"
        );
        artefact
    }

    /// Where the balls are.
    #[must_use]
    pub fn balls(&self) -> &[Vector3<f64>; 2] {
        &self.balls
    }
}

/// The errors of model 13, times a factor.
fn errors(machine: &Machine, factor: f64, random: &mut Random) -> Result<String, Box<dyn Error>> {
    let parameters = Model::Thirteen
        .parameters(machine, 0, &[])
        .map_err(|e| e.reason)?;
    let mut text = format!("machine = \"{}\"\n\n[parameters]\n", machine.name);
    for parameter in parameters {
        let name = parameter.to_string();
        if name.ends_with('S') {
            continue; // The spindle turns with no machine here: part of the stylus.
        }
        let ordinary = match (parameter.is_angular(), name.ends_with('1')) {
            (_, true) => SCALE,
            (true, _) => ANGLE,
            (false, _) => LENGTH,
        };
        text += &format!(
            "{name} = {:e}\n",
            factor * ordinary * random.within(-1.0, 1.0)
        );
    }
    Ok(text)
}

/// Errors that no model of the loop has: backlash of linear axes, run-out and wobble of rotary ones, and straightness.
fn errors_outside(machine: &Machine, random: &mut Random) -> String {
    let (mut parameters, mut tables) = (String::new(), String::new());
    for axis in &machine.axes {
        let letter = axis.letter.char();
        let along = axis.letter.component();
        let across = (0..3).filter(|k| *k != along).map(|k| ["X", "Y", "Z"][k]);
        if axis.letter.is_rotary() {
            for (component, harmonic) in across.flat_map(|k| [(k, 'c'), (k, 's')]) {
                let amplitude = RUN_OUT * random.within(-1.0, 1.0);
                parameters += &format!("E{component}{letter}{harmonic}1 = {amplitude:e}\n");
            }
            continue;
        }
        // Half of the reversal value; lost motion is negative.
        let half = -0.5 * BACKLASH * random.within(0.3, 1.0);
        parameters += &format!("E{letter}{letter}b = {half:e}\n");
        let [low, high] = axis.travel;
        for component in across {
            let amplitude = STRAIGHTNESS * random.within(0.3, 1.0);
            let (waves, begins) = (random.within(0.7, 2.0), random.within(0.0, TAU));
            let parts = (0..=POINTS).map(|k| k as f64 / POINTS as f64);
            let value = |part: f64| amplitude * (TAU * waves * part + begins).sin();
            let list = |of: &dyn Fn(f64) -> f64| {
                let all: Vec<String> = parts
                    .clone()
                    .map(|part| format!("{:?}", of(part)))
                    .collect();
                all.join(", ")
            };
            tables += &format!(
                "\n[tabulated.E{component}{letter}]\nat = [{}]\nvalue = [{}]\nunit = \"mm\"\n",
                list(&|part| low + part * (high - low)),
                list(&value)
            );
        }
    }
    parameters + &tables
}

/// A ball: where its owner says it is, having driven there, and where that really is.
type Ball = (Vector3<f64>, Vector3<f64>);

/// Two balls that the stylus reaches at many rotary positions, 60 to 200 mm apart.
fn balls(
    machine: &Machine,
    errors: &ErrorModel,
    random: &mut Random,
) -> Result<[Ball; 2], Box<dyn Error>> {
    let real = Kinematics::new(machine, errors);
    let tip = Vector3::from(machine.tip);
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let allowed = Allowed::of(machine, &vec![false; machine.axes.len()]);
    let is_reached = |place: &Vector3<f64>| {
        let text = format!(
            "[[ball]]\nname = \"one\"\nnominal_mm = [{}, {}, {}]\n",
            place.x, place.y, place.z
        );
        let artefact = Artefact::from_toml(&text, machine.tool_axis).ok()?;
        let setup = Setup {
            machine,
            artefact: &artefact,
            balls: vec!["one".to_owned()],
            probe: Probe::default(),
            sigma: 1e-3,
            observations: None,
        };
        (setup.candidates(&allowed).0.rows.len() >= LEAST).then_some(())
    };
    let mut found: Vec<Ball> = Vec::new();
    for _ in 0..TRIES {
        let mut command = PerAxis::default();
        for (at, axis) in command.iter_mut().zip(&machine.axes) {
            let [low, high] = axis.travel;
            let middle = (low + high) / 2.0;
            *at = match axis.letter.is_rotary() {
                true => 0.0_f64.clamp(low, high),
                false => middle + random.within(-0.25, 0.25) * (high - low),
            };
        }
        let q = machine.to_kinematic(&command);
        let place = kinematics.nominal(&q, None).t;
        let place = place.map(|at| (at * 10.0).round() / 10.0);
        let fits = found
            .first()
            .is_none_or(|(first, _)| (60.0..200.0).contains(&(place - first).norm()));
        if fits && is_reached(&place).is_some() {
            let there = real.sensitivity(&q, &Situation::default(), &tip).point;
            found.push((place, there));
        }
        if let [one, two] = found[..] {
            return Ok([one, two]);
        }
    }
    Err("no two balls can be reached at many positions".into())
}
