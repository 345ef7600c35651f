//! The truth of the thermal goal: a milling machine whose bed, column and spindle are rods of finite differences. Its
//! drift follows from whole temperature fields, which no sum of a few lagged sensors contains exactly.

use crate::Fixed;
use trueaxis_model::errors::{ErrorModel, Parameter, Table};
use trueaxis_model::machine::Machine;

/// Expansion of steel and cast iron (1/K).
const ALPHA: f64 = 11.5e-6;
/// Their thermal diffusivity (m²/s).
const DIFFUSIVITY: f64 = 1.3e-5;
/// Distance of nodes (m); explicit steps of [`STEP`] are stable up to 0.5 · NODE² / [`DIFFUSIVITY`] = 96 s.
const NODE: f64 = 0.05;
/// Time between two states (s).
pub const STEP: f64 = 10.0;
/// Temperature (°C) of everything at the start.
pub const START: f64 = 21.0;

/// A rod that conducts along itself and exchanges heat with its surroundings.
#[derive(Clone, Debug)]
struct Rod {
    /// Temperature of each node (°C).
    celsius: Vec<f64>,
    /// Time constant of the exchange with the surroundings (s).
    exchange: f64,
}

impl Rod {
    fn new(nodes: usize, exchange: f64) -> Self {
        Self {
            celsius: vec![START; nodes],
            exchange,
        }
    }

    /// One step with these sources (K/s at each node).
    fn advance(&mut self, around: f64, source: impl Fn(usize) -> f64) {
        let before = self.celsius.clone();
        let last = before.len() - 1;
        for (i, celsius) in self.celsius.iter_mut().enumerate() {
            // Ends are insulated.
            let (left, right) = (before[i.saturating_sub(1)], before[(i + 1).min(last)]);
            let conducted = DIFFUSIVITY * (left + right - 2.0 * before[i]) / (NODE * NODE);
            let exchanged = (around - before[i]) / self.exchange;
            *celsius += STEP * (conducted + exchanged + source(i));
        }
    }

    /// How much longer it is from its start to each node (mm).
    fn growth(&self) -> Vec<f64> {
        let mut sum = 0.0;
        let each = self.celsius.iter().map(|celsius| {
            sum += ALPHA * (celsius - START) * NODE * 1e3;
            sum
        });
        each.collect()
    }
}

/// What the machine does and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Duty {
    /// Speed of the spindle, as a part of the largest.
    pub spindle: f64,
    /// Speed of the axes, as a part of the largest.
    pub axes: f64,
    /// Temperature of the hall (°C).
    pub hall: f64,
}

/// How much each part of the machine does of what it does here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parts {
    /// The spindle, which grows.
    pub spindle: f64,
    /// The head, which leans and moves away from the column.
    pub head: f64,
    /// The column, which rises.
    pub column: f64,
    /// Screws and scales of X and Z.
    pub screws: f64,
}

impl Parts {
    /// All of them the same.
    #[must_use]
    pub const fn all(effect: f64) -> Self {
        Self {
            spindle: effect,
            head: effect,
            column: effect,
            screws: effect,
        }
    }
}

/// The machine at one time.
#[derive(Clone, Debug)]
pub struct State {
    spindle: Rod,
    column: Rod,
    bed: Rod,
    /// Rear wall of the column (°C).
    rear: f64,
    hall: f64,
}

/// The sensors, in the order of [`State::celsius`].
pub const SENSORS: [&str; 6] = ["bearing", "motor", "column", "bed", "hall", "cabinet"];

impl State {
    /// Everything at [`START`].
    #[must_use]
    pub fn cold() -> Self {
        Self {
            spindle: Rod::new(8, 1500.0),
            column: Rod::new(18, 5400.0),
            bed: Rod::new(16, 7200.0),
            rear: START,
            hall: START,
        }
    }

    /// One [`STEP`] later.
    pub fn advance(&mut self, duty: Duty) {
        let heat = duty.spindle.powf(1.5);
        let end = self.spindle.celsius[0];
        self.spindle.advance(duty.hall, |node| match node {
            // Motor, and bearing near the nose.
            1 => 0.030 * heat,
            6 => 0.055 * heat,
            _ => 0.0,
        });
        // The head, at 0.7 of the column's height, takes heat from the spindle and gives friction of the Z axis.
        let head = self.column.celsius[13];
        self.column.advance(duty.hall, |node| match node {
            12..=14 => (end - head) / 4000.0 + 0.0006 * duty.axes,
            _ => 0.0,
        });
        // Drive and nut of X.
        self.bed.advance(duty.hall, |node| match node {
            0 => 0.012 * duty.axes,
            6..=9 => 0.0035 * duty.axes,
            _ => 0.0,
        });
        let front = self.column.celsius.iter().sum::<f64>() / self.column.celsius.len() as f64;
        self.rear += STEP * ((front - self.rear) / 9000.0 + (duty.hall - self.rear) / 5400.0);
        self.hall = duty.hall;
    }

    /// What the sensors read (°C), with noise of 0.03 K. The cabinet has a life of its own.
    pub fn celsius(&self, time: f64, random: &mut Fixed) -> [f64; 6] {
        let cabinet = 30.0 + 3.0 * (time / 2300.0).sin();
        let exact = [
            self.spindle.celsius[5],
            self.spindle.celsius[0],
            self.column.celsius[11],
            self.bed.celsius[4],
            self.hall,
            cabinet,
        ];
        // The sum of four uniform numbers from −1 to 1 has a variance of 4/3, and is close enough to normal.
        exact.map(|celsius| {
            let noise: f64 = (0..4).map(|_| random.within(-1.0, 1.0)).sum();
            celsius + 0.03 * 0.75_f64.sqrt() * noise
        })
    }

    /// The errors of the machine now, in addition to `errors`. `parts` multiplies what it does: 1, or that of another
    /// machine of its kind.
    ///
    /// # Panics
    /// If the machine is not [`MACHINE`].
    #[must_use]
    pub fn errors(&self, machine: &Machine, errors: &ErrorModel, parts: &Parts) -> ErrorModel {
        let mut errors = errors.clone();
        let named = |name: &str| Parameter::parse(name).expect("a parameter");
        let mut add = |name: &str, value: f64| {
            let before = errors.parameters.get(&named(name)).copied().unwrap_or(0.0);
            assert!(errors.set(machine, named(name), before + value), "{name}");
        };
        // The spindle grows out of its housing, towards -z; its front half counts fully, the rear half by a third.
        let growth = self.spindle.growth();
        let long = growth[7] - growth[2] + growth[2] / 3.0;
        add("EZ0S", -long * parts.spindle);
        // The head leans away from the column as the spindle warms it, and rises with the column up to it.
        let front = self.column.celsius.iter().sum::<f64>() / self.column.celsius.len() as f64;
        add(
            "EA0Z",
            parts.head * ALPHA * (front - self.rear) * 0.9 / 0.3 * 0.5,
        );
        add(
            "EY0S",
            parts.head * -0.35 * ALPHA * 1e3 * 0.12 * (self.spindle.celsius[0] - self.hall),
        );
        add("EZ0Z", parts.column * self.column.growth()[9]);
        // Screws and scales: the table is where the field puts it, node by node.
        let rods = [('X', 0, &self.bed, -400.0), ('Z', 2, &self.column, -450.0)];
        for (letter, component, rod, first) in rods {
            let growth = rod.growth();
            let fixed = growth[growth.len() / 2];
            let sign = if letter == 'X' { -1.0 } else { 1.0 };
            let at = (0..growth.len()).map(|i| first + 1e3 * NODE * i as f64);
            let table = Table {
                at: at.collect(),
                positive: growth
                    .iter()
                    .map(|g| parts.screws * sign * (g - fixed) * 0.6)
                    .collect(),
                negative: None,
            };
            let index = machine.index(letter).expect("an axis");
            assert!(errors.tabulate(index, component, table));
        }
        errors
    }
}

/// A vertical milling machine.
pub const MACHINE: &str = r#"
name = "Mill that warms up"
topology = "wYXFZSt"
[[axis]]
name = "X"
branch = "workpiece"
range = [-300.0, 300.0]
[[axis]]
name = "Y"
branch = "workpiece"
range = [-200.0, 200.0]
[[axis]]
name = "Z"
branch = "tool"
range = [-400.0, 0.0]
[spindle]
axis = "z"
[tool]
tip_mm = [0.0, 0.0, -150.0]
"#;

/// A duty cycle: what the machine does in each [`STEP`].
#[must_use]
pub fn duty_cycle(hours: f64, random: &mut Fixed) -> Vec<Duty> {
    let steps = (hours * 3600.0 / STEP) as usize;
    let (phase, swing) = (
        random.within(0.0, std::f64::consts::TAU),
        random.within(0.5, 1.5),
    );
    let mut duties = Vec::with_capacity(steps);
    let (mut spindle, mut axes, mut until) = (0.0, 0.0, 0);
    for step in 0..steps {
        let time = step as f64 * STEP;
        if step >= until {
            // Every third part is a rest.
            let rests = random.within(0.0, 3.0) < 1.0;
            spindle = if rests { 0.0 } else { random.within(0.3, 1.0) };
            axes = if rests { 0.0 } else { random.within(0.1, 1.0) };
            until = step + (random.within(600.0, 3000.0) / STEP) as usize;
        }
        let turn = std::f64::consts::TAU * time / 18_000.0 + phase;
        let hall = START + swing * (turn.sin() - phase.sin());
        duties.push(Duty {
            spindle,
            axes,
            hall,
        });
    }
    duties
}

/// The warm-ups and cool-downs from which the machine is learnt: each for `hours`, the machine as it was left by the
/// one before.
#[must_use]
pub fn training(hours: f64) -> Vec<Vec<Duty>> {
    // Speeds of the spindle and of the axes in the first part of each cycle; then it rests.
    let speeds = [(1.0, 0.2), (0.3, 1.0), (0.0, 0.9), (0.8, 0.6)];
    let of = |(number, (spindle, axes)): (usize, (f64, f64))| {
        let steps = (hours * 3600.0 / STEP) as usize;
        let duty = move |step: usize| {
            let time = (number as f64 * hours) * 3600.0 + step as f64 * STEP;
            let hall = START + 1.5 * (std::f64::consts::TAU * time / 21_600.0).sin();
            let works = (step as f64) < 0.6 * steps as f64;
            let of = |speed: f64| if works { speed } else { 0.0 };
            Duty {
                spindle: of(spindle),
                axes: of(axes),
                hall,
            }
        };
        (0..steps).map(duty).collect()
    };
    speeds.into_iter().enumerate().map(of).collect()
}
