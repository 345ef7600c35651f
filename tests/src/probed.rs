//! Machines with known errors, and their probing plans.

use crate::{Fixed, read};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueaxis_identify::formats::artefact::{Artefact, ArtefactBar, Ball};
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::{self, Probing, Probings};
use trueaxis_identify::simulate::{self, Disturbances};
use trueaxis_identify::{
    Chosen, HeldOut, Identified, IdentifyError, IdentifyOptions, Measured, Model, NotKnown,
    Problem, automatic, error_file, held_out, honesty, identify,
};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Table, covariance};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;

/// A machine, its errors, and its probing plan.
#[derive(Clone, Debug)]
pub struct Case {
    /// The machine.
    pub machine: Machine,
    /// Errors of the machine.
    pub errors: ErrorModel,
    /// Positions of the balls.
    pub artefact: Artefact,
    /// The balls and the rotary positions at which they are probed.
    pub plan: Probings,
}

/// Machines for which model 12 has all that it needs.
const OF_MODEL_12: [&str; 5] = [
    "kolibri",
    "linuxcnc-xyzac-trt",
    "hu40",
    "table-head",
    "fork-head",
];
/// Points of a wave.
const POINTS: usize = 97;
/// Number of balls in a random plan.
const BALLS: usize = 4;
/// Number of rotary positions tried for each requested row.
const TRIES: usize = 10;
/// Magnitude of random angles (rad) and lengths (mm) at the ends of the travel.
const ANGLE: f64 = 1e-4;
const LENGTH: f64 = 0.02;

impl Case {
    /// One of the examples that have a plan.
    ///
    /// # Panics
    /// If there is no such example.
    #[must_use]
    pub fn new(folder: &str, errors: &str) -> Self {
        let file = |name: &str| read(&format!("examples/{folder}/{name}"));
        let machine = Machine::from_toml(&file("machine.toml")).expect("a machine");
        let errors = ErrorModel::from_toml(&file(errors), &machine).expect("its errors");
        Self {
            artefact: Artefact::from_toml(&file("artefact.toml"), machine.tool_axis)
                .expect("an artefact"),
            plan: probings::read(&file("plan.csv"), &machine, false).expect("a plan"),
            machine,
            errors,
        }
    }

    /// With axes that approach each row from the previous one.
    #[must_use]
    pub fn coming(mut self) -> Self {
        let rotary =
            (0..self.machine.axes.len()).filter(|i| self.machine.axes[*i].letter.is_rotary());
        for i in rotary {
            let mut came = 0.0;
            for k in 1..self.plan.rows.len() {
                let way = self.plan.rows[k].position[i] - self.plan.rows[k - 1].position[i];
                came = if way == 0.0 { came } else { way.signum() };
                self.plan.rows[k].direction[i] = came;
            }
        }
        self
    }

    /// The automatic choice from what was measured on the machine, of which nothing else is known.
    ///
    /// # Panics
    /// If nothing can be identified.
    #[must_use]
    pub fn chosen(&self, probings: &Probings, observations: &Observations) -> Chosen {
        let perfect = ErrorModel::perfect(&self.machine);
        let measured = self.known(probings, observations, &perfect);
        automatic(&measured, IdentifyOptions::default()).expect("a model")
    }

    /// How well rows are predicted by a model without them.
    ///
    /// # Errors
    /// [`IdentifyError`] if it cannot be identified without some of the rows.
    pub fn held_out(
        &self,
        probings: &Probings,
        observations: &Observations,
        parameters: &[Parameter],
    ) -> Result<HeldOut, IdentifyError> {
        let perfect = ErrorModel::perfect(&self.machine);
        let measured = self.known(probings, observations, &perfect);
        held_out(&measured, parameters, IdentifyOptions::default())
    }

    fn known<'a>(
        &'a self,
        probings: &'a Probings,
        observations: &'a Observations,
        base: &'a ErrorModel,
    ) -> Measured<'a> {
        Measured {
            machine: &self.machine,
            probings,
            artefact: &self.artefact,
            observations,
            base,
        }
    }

    /// A machine with random values of these parameters, four balls at random places and `rows` rows at random,
    /// reachable rotary positions; `None` if too few are reachable.
    #[must_use]
    pub fn drawn(
        machine: &Machine,
        parameters: &[Parameter],
        rows: usize,
        random: &mut Fixed,
    ) -> Option<Self> {
        Self::spread(machine, parameters, BALLS, rows, random)
    }

    /// A ball where the tip is at a random place in the middle half of the travel.
    fn ball_drawn(&self, name: String, random: &mut Fixed) -> Ball {
        let machine = &self.machine;
        let q = machine.axes.iter().map(|axis| {
            let [low, high] = axis.travel;
            low + (high - low) * random.within(0.25, 0.75)
        });
        let q: Vec<f64> = q.collect();
        let kinematics = Kinematics::new(machine, &self.errors);
        Ball {
            name,
            nominal: Some(kinematics.nominal(&machine.to_kinematic(&q), None).t),
            away: Vector3::z(),
            post: None,
        }
    }

    /// Like `drawn`, with a given number of balls.
    #[must_use]
    pub fn spread(
        machine: &Machine,
        parameters: &[Parameter],
        balls: usize,
        rows: usize,
        random: &mut Fixed,
    ) -> Option<Self> {
        let mut errors = ErrorModel::perfect(machine);
        for parameter in parameters {
            let value = random.within(-1.0, 1.0) * size(machine, *parameter);
            errors.set(machine, *parameter, value);
        }
        let mut case = Self {
            machine: machine.clone(),
            artefact: Artefact::default(),
            plan: Probings {
                balls: (1..=balls).map(|b| b.to_string()).collect(),
                rows: Vec::new(),
            },
            errors,
        };
        for name in case.plan.balls.clone() {
            let ball = case.ball_drawn(name, random);
            case.artefact.balls.push(ball);
        }
        for k in 0..rows * TRIES {
            let row = case.row(k, random);
            let one = Probings {
                balls: case.plan.balls.clone(),
                rows: vec![row.clone()],
            };
            let kinematics = Kinematics::new(machine, &case.errors);
            let disturbances = Disturbances::default();
            if simulate::probings(&kinematics, &case.artefact, &one, &disturbances).is_ok() {
                case.plan.rows.push(row);
            }
            if case.plan.rows.len() == rows {
                return Some(case);
            }
        }
        None
    }

    /// A machine with random errors of model 12, whose number chooses the layout, and a stylus that was measured to 1 µm:
    /// otherwise it takes up errors that are then not seen. `None` if too few rows are reachable.
    #[must_use]
    pub fn of_model_12(number: usize, rows: usize, random: &mut Fixed) -> Option<Self> {
        let folder = OF_MODEL_12[number % OF_MODEL_12.len()];
        let machine = crate::machine(&format!("examples/{folder}/machine.toml"));
        let twelve = Model::Twelve.parameters(&machine, 0, &[]).ok()?;
        let mut case = Self::drawn(&machine, &twelve, rows, random)?;
        case.artefact.stylus.uncertainty = [Some(1e-3); 3];
        Some(case)
    }

    /// Makes an error motion of an axis (by index) a wave over its travel: an error that is in no model. `amplitude` in mm
    /// or rad.
    ///
    /// # Panics
    /// If there is no such motion.
    pub fn add_wave(
        &mut self,
        (axis, component): (usize, usize),
        amplitude: f64,
        periods: f64,
        phase: f64,
    ) {
        let [low, high] = self.travel(axis);
        let part = |k: usize| k as f64 / (POINTS - 1) as f64;
        let wave = |k: usize| amplitude * (TAU * periods * part(k) + phase).sin();
        let table = Table {
            at: (0..POINTS).map(|k| low + (high - low) * part(k)).collect(),
            positive: (0..POINTS).map(wave).collect(),
            negative: None,
        };
        assert!(self.errors.tabulate(axis, component, table));
    }

    /// Makes an axis (by index) reverse with a lag along `component`, which goes from `part` of `size` (mm or rad) at the
    /// lower end of its travel to all of it: backlash that depends on the position.
    ///
    /// # Panics
    /// If there is no such motion.
    pub fn add_reversal(&mut self, (axis, component): (usize, usize), size: f64, part: f64) {
        let [low, high] = self.travel(axis);
        let half = [0.5 * part * size, 0.5 * size];
        let slope = match self.errors.motions[axis][component].coefficients.get(1) {
            Some(slope) => *slope,
            None => 0.0,
        };
        let of = |sign: f64| vec![slope * low + sign * half[0], slope * high + sign * half[1]];
        let table = Table {
            at: vec![low, high],
            positive: of(1.0),
            negative: Some(of(-1.0)),
        };
        assert!(self.errors.tabulate(axis, component, table));
    }

    /// The travel of an axis (by index), in mm or rad.
    #[must_use]
    pub fn travel(&self, axis: usize) -> [f64; 2] {
        let axis = &self.machine.axes[axis];
        let [low, high] = axis.travel.map(|q| axis.to_kinematic(q));
        [low.min(high), low.max(high)]
    }

    /// The machine as the error file of an identification describes it.
    ///
    /// # Panics
    /// If the file cannot be read again.
    #[must_use]
    pub fn written(
        &self,
        measured: &Probings,
        observed: &Observations,
        found: &Identified,
        predicted: Option<&HeldOut>,
    ) -> ErrorModel {
        let machine = &self.machine;
        let perfect = ErrorModel::perfect(machine);
        let looked_for = &found.looked_for;
        let problem = Problem::new(machine, measured, &self.artefact, looked_for, &perfect);
        let problem = problem.with(observed);
        let honesty = honesty(&problem, measured, found);
        let not_known = NotKnown::of(&problem, found, &honesty, predicted).expect("a misfit");
        let file = error_file(machine, measured, observed, found, &not_known, "c.csv");
        let covariances = covariance::write(&found.known);
        let read = |_: &str| Ok(covariances.clone());
        ErrorModel::with_files(&file, machine, &read).expect("an error file")
    }

    fn row(&self, number: usize, random: &mut Fixed) -> Probing {
        let mut row = Probing {
            ball: number % self.plan.balls.len(),
            line: number + 2,
            ..Probing::default()
        };
        for (i, axis) in self.machine.axes.iter().enumerate() {
            let [low, high] = axis.travel;
            if axis.letter.is_rotary() {
                row.position[i] = random.within(low, high);
                let is_reversed = random.within(0.0, 1.0) < 0.5;
                row.direction[i] = if is_reversed { -1.0 } else { 1.0 };
            }
        }
        row
    }

    /// The probings, with disturbances.
    ///
    /// # Panics
    /// If a ball cannot be reached.
    #[must_use]
    pub fn measured(&self, disturbances: &Disturbances) -> Probings {
        let kinematics = Kinematics::new(&self.machine, &self.errors);
        simulate::probings(&kinematics, &self.artefact, &self.plan, disturbances)
            .expect("balls in reach")
    }

    /// With errors of these parameters only.
    #[must_use]
    pub fn only(&self, parameters: &[Parameter]) -> Self {
        let mut case = self.clone();
        case.errors = ErrorModel::perfect(&self.machine);
        for parameter in parameters {
            let value = self.truth(*parameter);
            case.errors.set(&self.machine, *parameter, value);
        }
        case
    }

    /// The probings without disturbances; `None` if a ball cannot be reached.
    #[must_use]
    pub fn reached(&self) -> Option<Probings> {
        let kinematics = Kinematics::new(&self.machine, &self.errors);
        let disturbances = Disturbances::default();
        simulate::probings(&kinematics, &self.artefact, &self.plan, &disturbances).ok()
    }

    /// The probings with 1 µm of noise.
    #[must_use]
    pub fn noisy(&self, seed: u64) -> Probings {
        self.measured(&Disturbances {
            noise: 1e-3,
            seed,
            ..Disturbances::default()
        })
    }

    /// The parameters of a model, and the scale of X if the machine has one that a bar shows.
    ///
    /// # Panics
    /// If the machine has no such model.
    #[must_use]
    pub fn parameters(&self, model: &str) -> Vec<Parameter> {
        let model: Model = model.parse().expect("a model");
        let mut all = model.parameters(&self.machine, 0, &[]).expect("the model");
        let scale = Parameter::scale('X');
        let has_one = self.errors.parameters.contains_key(&scale);
        if has_one && !self.artefact.bars.is_empty() && !all.contains(&scale) {
            all.push(scale);
        }
        all
    }

    /// Makes the first two balls a bar whose stated length is off by no more than √3 of its standard `uncertainty` (mm),
    /// and gives X a random scale, which the bar shows.
    pub fn add_bar(&mut self, uncertainty: f64, random: &mut Fixed) {
        let [a, b] = [0, 1].map(|k| self.ball(k));
        let off = random.within(-1.0, 1.0) * uncertainty * 3.0_f64.sqrt();
        self.artefact.bars.push(ArtefactBar {
            balls: [0, 1].map(|k| self.artefact.balls[k].name.clone()),
            length: (a - b).norm() + off,
            uncertainty,
        });
        let scale = Parameter::scale('X');
        let value = random.within(-1.0, 1.0) * size(&self.machine, scale);
        self.errors.set(&self.machine.clone(), scale, value);
    }

    /// The result of an identification from probings.
    ///
    /// # Errors
    /// As for [`identify`].
    pub fn tried(
        &self,
        model: &str,
        measured: &Probings,
        options: IdentifyOptions,
    ) -> Result<Identified, IdentifyError> {
        let perfect = ErrorModel::perfect(&self.machine);
        let parameters = self.parameters(model);
        let problem = Problem::new(
            &self.machine,
            measured,
            &self.artefact,
            &parameters,
            &perfect,
        );
        identify(&problem, options)
    }

    /// The result of an identification from probings.
    ///
    /// # Panics
    /// If the identification fails.
    #[must_use]
    pub fn found(&self, model: &str, measured: &Probings, options: IdentifyOptions) -> Identified {
        self.tried(model, measured, options).expect("a result")
    }

    /// The true value of a parameter.
    #[must_use]
    pub fn truth(&self, parameter: Parameter) -> f64 {
        self.errors
            .parameters
            .get(&parameter)
            .copied()
            .unwrap_or(0.0)
    }

    /// Position of a ball (mm).
    ///
    /// # Panics
    /// If there is no such ball.
    #[must_use]
    pub fn ball(&self, index: usize) -> Vector3<f64> {
        self.artefact.balls[index].nominal.expect("a place")
    }
}

/// The largest remaining distance between tip and ball (mm).
#[must_use]
pub fn worst(identified: &Identified) -> f64 {
    let left = identified.rows.iter().map(|row| row.after.norm());
    left.fold(0.0, f64::max)
}

/// Magnitude of a parameter: chosen so that all parameters have about the same effect.
fn size(machine: &Machine, parameter: Parameter) -> f64 {
    let whole = if parameter.is_angular() {
        ANGLE
    } else {
        LENGTH
    };
    match (parameter.kind, machine.index(parameter.axis)) {
        (ParameterKind::Degree(k), Some(index)) => {
            let axis = &machine.axes[index];
            let ends = axis.travel.map(|t| axis.to_kinematic(t).abs());
            whole / ends[0].max(ends[1]).max(1.0).powi(i32::from(k))
        }
        _ => whole,
    }
}
