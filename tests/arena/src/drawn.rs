//! Machines whose errors are drawn.

use crate::class::Class;
use crate::effect::effects;
use crate::layout;
use crate::measured::{Measured, Places};
use crate::seed::{self, Purpose};
use crate::task::{Hidden, Position, Task};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueaxis_identify::{IdentifyOptions, Model, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, Table};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Command, commands_in_travel};
use trueaxis_tests::Fixed;

/// Number of positions to answer.
const POSITIONS: usize = 500;
/// A combination of parameters is asked for if its effect at the readings is more than this fraction of the effects of
/// its parts: 1 µm of noise in several hundred readings then leaves about 1 µm of it.
const SEEN: f64 = 0.03;
/// Root mean square effect at the tip (mm) up to which a parameter is drawn, if it is one of a few.
const EFFECT: f64 = 0.02;
/// Like `EFFECT`, of all parameters together, if they are many.
const TOGETHER: f64 = 0.08;
/// Effect at the tip (mm) up to which a wave is drawn.
const WAVE: f64 = 0.002;
/// Points of a wave.
const POINTS: usize = 80;

/// What is drawn of one machine.
struct Streams {
    machine: Fixed,
    strategy: Fixed,
    setups: Fixed,
    errors: Fixed,
    noise: u64,
    positions: u64,
}

/// A machine of a round.
pub fn hidden(round: u64, number: usize) -> Hidden {
    let random = |purpose| seed::random(round, number, purpose);
    let mut streams = Streams {
        machine: random(Purpose::Machine),
        strategy: random(Purpose::Strategy),
        setups: random(Purpose::Setups),
        errors: random(Purpose::Errors),
        noise: seed::of(round, number, Purpose::Noise),
        positions: seed::of(round, number, Purpose::Positions),
    };
    loop {
        if let Some(hidden) = measurable(number, &mut streams) {
            return hidden;
        }
    }
}

/// The next machine, if it can be measured.
fn measurable(number: usize, streams: &mut Streams) -> Option<Hidden> {
    let class = Class::of(number);
    let (machine_file, machine) = drawn_machine(class, number, &mut streams.machine);
    let perfect = ErrorModel::perfect(&machine);
    let (strategy, setups) = (&mut streams.strategy, &mut streams.setups);
    let places = Places::draw(class, &machine, strategy, setups)?;
    let read = |errors: &ErrorModel| places.read(&machine, errors, streams.noise);
    let asked = asked(class, &machine, &read(&perfect)?);
    let commands = commands_in_travel(&machine, &perfect, POSITIONS, streams.positions);
    let mut truth = drawn(class, &machine, &asked, &commands, &mut streams.errors);
    if class == Class::Rich {
        waves(&machine, &mut truth, &mut streams.errors);
    }
    let position = |command| Position {
        command,
        time: None,
    };
    let task = Task {
        number,
        class,
        machine_file,
        measured: read(&truth)?,
        asked,
        positions: commands.into_iter().map(position).collect(),
        warm: None,
        machine: machine.clone(),
    };
    Some(Hidden {
        task,
        truth: vec![truth],
    })
}

/// A machine that can be corrected, and its file.
fn drawn_machine(class: Class, number: usize, random: &mut Fixed) -> (String, Machine) {
    loop {
        let text = layout::draw(class, number, random);
        if let Ok(machine) = Machine::from_toml(&text) {
            return (text, machine);
        }
    }
}

/// The parameters that can be told from measurements at these places: from those of a machine without errors.
fn asked(class: Class, machine: &Machine, measured: &Measured) -> Vec<Parameter> {
    let degree = match class {
        Class::ThreeAxis => 2,
        Class::Rich => 3,
        _ => 0,
    };
    let all = Model::Auto.parameters(machine, degree, &[]);
    let all = all.expect("every machine has them");
    let perfect = ErrorModel::perfect(machine);
    let readings = measured.read(machine);
    let problem = readings.problem(machine, &all, &perfect);
    let options = IdentifyOptions {
        least: SEEN,
        ..IdentifyOptions::default()
    };
    let identified = identify(&problem, options).expect("a machine without errors");
    identified.parameters.iter().map(|e| e.parameter).collect()
}

/// Errors of the given parameters.
fn drawn(
    class: Class,
    machine: &Machine,
    parameters: &[Parameter],
    positions: &[Command],
    random: &mut Fixed,
) -> ErrorModel {
    let most = match class {
        Class::Rich | Class::ThreeAxis => TOGETHER / (parameters.len() as f64).sqrt(),
        _ => EFFECT,
    };
    let mut errors = ErrorModel::perfect(machine);
    let effects = effects(machine, parameters, positions);
    for (parameter, effect) in parameters.iter().zip(effects) {
        let value = random.within(-1.0, 1.0) * most / effect;
        assert!(errors.set(machine, *parameter, value), "{parameter}");
    }
    errors
}

/// Adds waves to every motion of every axis.
fn waves(machine: &Machine, errors: &mut ErrorModel, random: &mut Fixed) {
    let lever = Vector3::from(machine.tip).norm();
    for (index, axis) in machine.axes.iter().enumerate() {
        let [low, high] = axis.travel.map(|t| axis.to_kinematic(t));
        let at = |k: usize| low + (high - low) * k as f64 / (POINTS - 1) as f64;
        for component in 0..6 {
            let size = if component < 3 { WAVE } else { WAVE / lever };
            let (size, phase) = (random.within(0.0, size), random.within(0.0, TAU));
            // More than polynomials of degree 3 and three harmonics have.
            let waves = random.within(4.0, 7.0);
            let value =
                |k: usize| size * (TAU * waves * k as f64 / (POINTS - 1) as f64 + phase).sin();
            let table = Table {
                at: (0..POINTS).map(at).collect(),
                positive: (0..POINTS).map(value).collect(),
                negative: None,
            };
            assert!(errors.tabulate(index, component, table));
        }
    }
}
