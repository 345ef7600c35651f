//! Machines whose errors are drawn.

use crate::class::Class;
use crate::effect::effects;
use crate::layout;
use crate::seed::{self, Purpose};
use crate::task::{Hidden, Position, Task};
use nalgebra::Vector3;
use std::f64::consts::TAU;
use std::fmt::Write;
use trueaxis_measure::formats::artefact::Artefact;
use trueaxis_measure::formats::observations::{self, Observations};
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::{Model, Options, Problem, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, Table};
use trueaxis_model::machine::Machine;
use trueaxis_tables::validate::{Command, commands_in_travel};
use trueaxis_tests::Fixed;
use trueaxis_tests::observed::{Strategy, observed};

/// Number of positions to answer.
const POSITIONS: usize = 500;
/// Part of the travel in which points are measured.
const MEASURED: f64 = 0.98;
/// Standard uncertainty of each coordinate of a point (µm).
const SIGMA: f64 = 1.0;
/// A combination of parameters is asked for if its effect at the readings is more than this fraction of the effects of
/// its parts: 1 µm of noise in several hundred readings then leaves about 1 µm of it.
const SEEN: f64 = 0.03;
/// Root mean square effect at the tip (mm) up to which a parameter is drawn, if it is one of a few.
const EFFECT: f64 = 0.02;
/// The same of all parameters together, if they are many.
const TOGETHER: f64 = 0.08;
/// Effect at the tip (mm) up to which a wave is drawn.
const WAVE: f64 = 0.002;
/// Points of a wave.
const POINTS: usize = 80;

/// A machine of a round.
pub fn hidden(round: u64, number: usize) -> Hidden {
    let class = Class::of(number);
    let random = |purpose| seed::random(round, number, purpose);
    let (machine_file, machine) = drawn_machine(class, number, &mut random(Purpose::Machine));
    let mut of_strategy = random(Purpose::Strategy);
    let strategy = strategy(class, &machine, &mut of_strategy);
    let setups = setups(&machine, &mut random(Purpose::Setups));
    let noise = seed::of(round, number, Purpose::Noise);
    let read = |errors: &ErrorModel| observed(&machine, errors, &strategy, &setups, 1.0, noise);
    let perfect = ErrorModel::perfect(&machine);
    let asked = asked(class, &machine, &read(&perfect));
    let seed = seed::of(round, number, Purpose::Positions);
    let commands = commands_in_travel(&machine, &perfect, POSITIONS, seed);
    let mut of_errors = random(Purpose::Errors);
    let mut truth = drawn(class, &machine, &asked, &commands, &mut of_errors);
    if class == Class::Rich {
        waves(&machine, &mut truth, &mut of_errors);
    }
    let points = observations::write(&read(&truth), &machine);
    let position = |command| Position {
        command,
        time: None,
    };
    let task = Task {
        number,
        class,
        machine_file,
        points,
        asked,
        positions: commands.into_iter().map(position).collect(),
        warm: None,
        machine,
    };
    Hidden {
        task,
        truth: vec![truth],
    }
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

/// Length of the second tool beyond the first (mm): with two, errors of the tool direction are measured, too.
const LONGER: f64 = 100.0;

fn long_tool(machine: &Machine) -> [f64; 3] {
    let mut place = machine.tip;
    place[machine.tool_axis] += LONGER.copysign(place[machine.tool_axis]);
    place
}

/// Where points are measured, with two tools.
fn strategy<'a>(class: Class, machine: &'a Machine, random: &mut Fixed) -> Strategy<'a> {
    let heading = format!("# [setup.long]\n# tool_mm = {:?}\n", long_tool(machine));
    let mut strategy = Strategy::new(machine, &heading);
    let rows = match class {
        Class::ThreeAxis => 80,
        Class::Rich => 250,
        _ => 120,
    };
    for setup in ["short", "long"] {
        for _ in 0..rows {
            let position = strategy.anywhere(MEASURED, random);
            strategy.add("point", setup, &position, "", SIGMA);
        }
    }
    strategy
}

/// Where the instrument really is in each set-up.
fn setups(machine: &Machine, random: &mut Fixed) -> String {
    let mut text = String::new();
    for (name, tool) in [("short", machine.tip), ("long", long_tool(machine))] {
        let place: [f64; 3] = std::array::from_fn(|_| random.within(-300.0, 300.0));
        let turned: [f64; 3] = std::array::from_fn(|_| random.within(-20.0, 20.0));
        let _ = write!(
            text,
            "# [setup.{name}]\n# place_mm = {place:?}\n# orientation_deg = {turned:?}\n# tool_mm = {tool:?}\n"
        );
    }
    text
}

/// The parameters that can be told from readings of these places: from the readings of a machine without errors.
fn asked(class: Class, machine: &Machine, readings: &Observations) -> Vec<Parameter> {
    let degree = match class {
        Class::ThreeAxis => 2,
        Class::Rich => 3,
        _ => 0,
    };
    let all = Model::Auto.parameters(machine, degree, &[]);
    let all = all.expect("every machine has them");
    let perfect = ErrorModel::perfect(machine);
    let (probings, artefact) = (Probings::default(), Artefact::default());
    let problem = Problem::new(machine, &probings, &artefact, &all, &perfect).with(readings);
    let options = Options {
        least: SEEN,
        ..Options::default()
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
