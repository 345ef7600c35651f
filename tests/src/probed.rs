//! Machines with known errors, and their probing strategies.

use crate::{Fixed, read};
use nalgebra::Vector3;
use trueaxis_measure::formats::artefact::{Artefact, Ball};
use trueaxis_measure::formats::probings::{self, Probing, Probings};
use trueaxis_measure::identify::{Identified, IdentifyError, Model, Options, Problem, identify};
use trueaxis_measure::simulate::{self, Disturbances};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine};

/// A machine, its errors, and its probing strategy.
#[derive(Clone, Debug)]
pub struct Case {
    /// The machine.
    pub machine: Machine,
    /// Its errors.
    pub errors: ErrorModel,
    /// Positions of the balls.
    pub artefact: Artefact,
    /// The balls and the rotary positions at which they are probed.
    pub strategy: Probings,
}

/// Number of balls in a random strategy.
const BALLS: usize = 4;
/// Number of rotary positions tried for each requested row.
const TRIES: usize = 10;
/// Magnitude of random angles (rad) and lengths (mm) at the ends of the travel.
const ANGLE: f64 = 1e-4;
const LENGTH: f64 = 0.02;

impl Case {
    /// One of the examples that have a strategy.
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
            strategy: probings::read(&file("strategy.csv"), &machine, false).expect("a strategy"),
            machine,
            errors,
        }
    }

    /// The same, with axes that approach each row from the previous one.
    #[must_use]
    pub fn coming(mut self) -> Self {
        let rotary =
            (0..self.machine.axes.len()).filter(|i| self.machine.axes[*i].letter.is_rotary());
        for i in rotary {
            let mut came = 0.0;
            for k in 1..self.strategy.rows.len() {
                let way = self.strategy.rows[k].position[i] - self.strategy.rows[k - 1].position[i];
                came = if way == 0.0 { came } else { way.signum() };
                self.strategy.rows[k].direction[i] = came;
            }
        }
        self
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

    /// The same with a given number of balls.
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
            strategy: Probings {
                balls: (1..=balls).map(|b| b.to_string()).collect(),
                rows: Vec::new(),
            },
            errors,
        };
        for name in &case.strategy.balls {
            // The tip at a random place in the middle half of the travel.
            let q: Vec<f64> = (machine.axes.iter())
                .map(|axis| {
                    let [low, high] = axis.travel;
                    low + (high - low) * random.within(0.25, 0.75)
                })
                .collect();
            let kinematics = Kinematics::new(machine, &case.errors);
            let tip = kinematics.nominal(&machine.to_kinematic(&q), None).t;
            case.artefact.balls.push(Ball {
                name: name.clone(),
                nominal: Some(tip),
                away: Vector3::z(),
                post: None,
            });
        }
        for k in 0..rows * TRIES {
            let row = case.row(k, random);
            let one = Probings {
                balls: case.strategy.balls.clone(),
                rows: vec![row.clone()],
            };
            let kinematics = Kinematics::new(machine, &case.errors);
            let disturbances = Disturbances::default();
            if simulate::probings(&kinematics, &case.artefact, &one, &disturbances).is_ok() {
                case.strategy.rows.push(row);
            }
            if case.strategy.rows.len() == rows {
                return Some(case);
            }
        }
        None
    }

    fn row(&self, number: usize, random: &mut Fixed) -> Probing {
        let mut row = Probing {
            ball: number % self.strategy.balls.len(),
            position: [0.0; MAX_AXES],
            direction: [0.0; MAX_AXES],
            spindle: 0.0,
            run: None,
            time: None,
            sigma: None,
            temperature: None,
            line: number + 2,
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
        simulate::probings(&kinematics, &self.artefact, &self.strategy, disturbances)
            .expect("balls in reach")
    }

    /// The same with errors of these parameters only.
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
        simulate::probings(&kinematics, &self.artefact, &self.strategy, &disturbances).ok()
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

    /// The parameters of a model.
    ///
    /// # Panics
    /// If the machine has no such model.
    #[must_use]
    pub fn parameters(&self, model: &str) -> Vec<Parameter> {
        let model: Model = model.parse().expect("a model");
        model.parameters(&self.machine, 0, &[]).expect("the model")
    }

    /// The result of an identification from probings.
    ///
    /// # Errors
    /// As for [`identify`].
    pub fn tried(
        &self,
        model: &str,
        measured: &Probings,
        options: Options,
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
    pub fn found(&self, model: &str, measured: &Probings, options: Options) -> Identified {
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
