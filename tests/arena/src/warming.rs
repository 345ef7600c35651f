//! Machines that warm up: the milling machine of finite differences, each with other errors when it is cold and other
//! effects of its parts.

use crate::class::Class;
use crate::effect::effects;
use crate::measured::Measured;
use crate::seed::{self, Purpose};
use crate::task::{Hidden, Position, Task, Warm};
use std::fmt::Write;
use trueaxis_identify::formats::temperatures;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Command, commands_in_travel};
use trueaxis_tests::Fixed;
use trueaxis_tests::thermal_field::{MACHINE, Parts, SENSORS, STEP, State, duty_cycle};
use trueaxis_tests::thermal_goal::{Measurement, machine, measured_on};

/// Errors of the cold machine.
const COLD: [&str; 6] = ["EXX1", "EYY1", "EZZ1", "EC0Y", "EA0Z", "EB0Z"];
/// Root mean square effect at the tip (mm) up to which each is drawn.
const EFFECT: f64 = 0.02;
/// Largest and smallest part of the effects of temperatures.
const PARTS: [f64; 2] = [0.5, 1.5];
/// Cycles of the positions to answer, their length (h), and the time (s) between them.
const CYCLES: usize = 4;
const HOURS: f64 = 4.0;
const PAUSE: f64 = 7200.0;
/// Steps from one round of positions to the next, and positions of a round.
const EVERY: usize = 72;
const ROUND: usize = 6;
/// Steps from one row of temperatures to the next.
const LOG: usize = 6;

/// A machine of a round.
pub fn hidden(round: u64, number: usize) -> Hidden {
    let machine = machine();
    let random = |purpose| seed::random(round, number, purpose);
    let mut of_errors = random(Purpose::Errors);
    let cold = cold(&machine, &mut of_errors);
    let mut part = || of_errors.within(PARTS[0], PARTS[1]);
    let parts = Parts {
        spindle: part(),
        head: part(),
        column: part(),
        screws: part(),
    };
    let measurement = Measurement {
        every: 600.0,
        log: 60.0,
        seed: seed::of(round, number, Purpose::Noise),
        ..Measurement::EIGHT_HOURS
    };
    let files = measured_on(&machine, &cold, &parts, &measurement);
    let perfect = ErrorModel::perfect(&machine);
    let rounds = CYCLES * (HOURS * 3600.0 / STEP) as usize / EVERY;
    let seed = seed::of(round, number, Purpose::Positions);
    let commands = commands_in_travel(&machine, &perfect, rounds * ROUND, seed);
    let mut unseen = Unseen {
        machine: &machine,
        cold: &cold,
        parts: &parts,
        positions: Vec::new(),
        truth: Vec::new(),
        log: format!(
            "time_s,cycle,{}\n",
            SENSORS.map(|s| format!("{s}_C")).join(",")
        ),
    };
    let mut of_cycles = random(Purpose::Strategy);
    let per_cycle = commands.len() / CYCLES;
    for (cycle, commands) in commands.chunks(per_cycle).enumerate() {
        unseen.run(cycle, commands, &mut of_cycles);
    }
    let read = |text: &str| temperatures::read(text).expect("a file of the arena");
    let task = Task {
        number,
        class: Class::Thermal,
        machine_file: MACHINE.trim_start().to_owned(),
        measured: Measured::Points(files.points),
        asked: Vec::new(),
        positions: unseen.positions,
        warm: Some(Warm {
            measured: read(&files.temperatures),
            measured_file: files.temperatures,
            unseen: read(&unseen.log),
            unseen_file: unseen.log,
        }),
        machine: machine.clone(),
    };
    Hidden {
        task,
        truth: unseen.truth,
    }
}

fn cold(machine: &Machine, random: &mut Fixed) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    let places = commands_in_travel(machine, &errors, 100, 1);
    let parameters = COLD.map(|name| Parameter::parse(name).expect("a parameter"));
    let effects = effects(machine, &parameters, &places);
    for (parameter, effect) in parameters.into_iter().zip(effects) {
        let value = random.within(-1.0, 1.0) * EFFECT / effect;
        assert!(errors.set(machine, parameter, value), "{parameter}");
    }
    errors
}

/// Cycles that nobody has measured.
struct Unseen<'a> {
    machine: &'a Machine,
    cold: &'a ErrorModel,
    parts: &'a Parts,
    positions: Vec<Position>,
    truth: Vec<ErrorModel>,
    log: String,
}

impl Unseen<'_> {
    /// One more cycle, from cold.
    fn run(&mut self, cycle: usize, commands: &[Command], random: &mut Fixed) {
        let start = cycle as f64 * (HOURS * 3600.0 + PAUSE);
        let mut state = State::cold();
        let mut rounds = commands.chunks(ROUND);
        let duties = duty_cycle(HOURS, random);
        for (step, duty) in duties.into_iter().enumerate() {
            let time = start + step as f64 * STEP;
            self.temperatures(step, time, cycle, &state, random);
            if step.is_multiple_of(EVERY) {
                let truth = state.errors(self.machine, self.cold, self.parts);
                for command in rounds.next().unwrap_or_default() {
                    self.positions.push(Position {
                        command: *command,
                        time: Some(time),
                    });
                    self.truth.push(truth.clone());
                }
            }
            state.advance(duty);
        }
    }

    fn temperatures(
        &mut self,
        step: usize,
        time: f64,
        cycle: usize,
        state: &State,
        random: &mut Fixed,
    ) {
        if step.is_multiple_of(LOG) {
            let celsius = state.celsius(time, random).map(|c| format!("{c:.2}"));
            let _ = writeln!(self.log, "{time},{cycle},{}", celsius.join(","));
        }
    }
}
