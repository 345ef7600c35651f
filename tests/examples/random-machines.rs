use rayon::prelude::*;
use std::time::Instant;
use trueaxis_host::errors::Switches;
use trueaxis_host::kinematics::Kinematics;
use trueaxis_host::schemes::Options;
use trueaxis_host::schemes::exact::{Minimize, compile};
use trueaxis_host::target::Target;
use trueaxis_host::validate::{Command, Region, Runtime, holds, random_commands};
use trueaxis_tests::random_machines::{Case, case};

struct Outcome {
    seed: u64,
    achieved: f64,
    harm: f64,
    line: String,
}

fn commands(c: &Case) -> Vec<Command> {
    let mut all = random_commands(&c.machine, &c.errors, Region::Travel, 1200, 5).unwrap();
    let mut r = trueaxis_tests::Fixed::new(c.seed + 99);
    for (k, q) in all.iter_mut().enumerate() {
        if k % 3 == 0 {
            for (a, axis) in q.axes.iter_mut().zip(&c.machine.axes) {
                match r.bits() % 4 {
                    0 => *a = axis.travel[0] as f32,
                    1 => *a = axis.travel[1] as f32,
                    _ => {}
                }
            }
        }
    }
    all
}

fn judge(c: &Case, tolerance: f64) -> Outcome {
    let started = Instant::now();
    let target = if std::env::var("SMALL").is_ok() {
        Target::default()
    } else {
        Target {
            tables: 250,
            terms: 2000,
            bytes: None,
            ..Target::default()
        }
    };
    let options = Options {
        tolerance: tolerance * 1e-3,
        target,
        ..Options::default()
    };
    let found = match compile(&c.machine, &c.errors, Minimize::Cost, &options) {
        Ok(f) => f,
        Err(e) => {
            return Outcome {
                seed: c.seed,
                achieved: f64::INFINITY,
                harm: f64::INFINITY,
                line: format!("{e}"),
            };
        }
    };
    let elapsed = started.elapsed();
    let mut draft = found.draft;
    for a in &mut draft.axes {
        a.value_bound = 1e6;
    }
    let blob = match draft.encode() {
        Ok(b) => b,
        Err(e) => {
            return Outcome {
                seed: c.seed,
                achieved: f64::INFINITY,
                harm: f64::INFINITY,
                line: format!("{e}"),
            };
        }
    };
    let runtime = Runtime::load(&blob).unwrap();
    let k = Kinematics::new(&c.machine, &c.errors);
    let n = c.machine.axes.len();
    let (mut dev, mut largest, mut inside_dev) = ([0.0f64; 6], [0.0f64; 6], [0.0f64; 6]);
    for command in commands(c) {
        let (q, s) = command.kinematic(&c.machine);
        let dq = k.correction(&q, &s, &Switches::ALL).unwrap().dq;
        let t: Vec<f64> = runtime
            .evaluate(&command)
            .iter()
            .map(|x| f64::from(*x))
            .collect();
        let t = c.machine.to_kinematic(&t);
        let inside = !holds(&c.machine, &c.errors, &q, &dq);
        for i in 0..n {
            let d = (t[i] - dq[i]).abs();
            dev[i] = dev[i].max(d);
            largest[i] = largest[i].max(dq[i].abs());
            if inside {
                inside_dev[i] = inside_dev[i].max(d);
            }
        }
    }
    let tol = |i: usize| {
        if c.machine.axes[i].letter.is_rotary() {
            tolerance * 1e-6
        } else {
            tolerance * 1e-3
        }
    };
    let achieved = (0..n).map(|i| inside_dev[i] / tol(i)).fold(0.0, f64::max);
    let harm = (0..n)
        .map(|i| dev[i] / tol(i).max(largest[i]))
        .fold(0.0, f64::max);
    let c0 = runtime.compensation();
    let narrow: Vec<String> = c
        .machine
        .axes
        .iter()
        .map(|a| format!("{}{:.0}", a.letter, (a.travel[1] - a.travel[0]) / 2.0))
        .collect();
    Outcome {
        seed: c.seed,
        achieved,
        harm,
        line: format!(
            "{:<12} {:>4} errors, {:>3} tables {:>4} terms {:>6} samples, structure {:.2}, pairs {}, {:.1?}  {}",
            c.machine.topology(),
            c.errors.parameters.len(),
            c0.tables(),
            c0.terms().len(),
            c0.samples(),
            found.structure_error.unwrap_or_default(),
            found.notes.join(" "),
            elapsed,
            narrow.join(" ")
        ),
    }
}

fn main() {
    let a: Vec<String> = std::env::args().collect();
    let count: usize = a.get(1).map_or(30, |s| s.parse().unwrap());
    let tolerance: f64 = a.get(2).map_or(1.0, |s| s.parse().unwrap());
    let only: Option<u64> = a.get(3).map(|s| s.parse().unwrap());
    let cases: Vec<Case> = match only {
        Some(s) => case(s).into_iter().collect(),
        None => trueaxis_tests::random_machines::cases(count),
    };
    let (mut met, mut three, mut harmed) = (0, 0, 0);
    let outcomes: Vec<Outcome> = cases
        .par_iter()
        .map(|c| {
            let o = judge(c, tolerance);
            let flag = if o.achieved <= 1.0 {
                ' '
            } else if o.achieved <= 3.0 {
                '~'
            } else {
                '!'
            };
            println!(
                "{flag}{:>4}: {:>9.2} of the tolerance, harm {:>8.3}  {}",
                o.seed, o.achieved, o.harm, o.line
            );
            o
        })
        .collect();
    for o in &outcomes {
        met += usize::from(o.achieved <= 1.0);
        three += usize::from(o.achieved <= 3.0);
        harmed += usize::from(o.harm > 1.0);
    }
    println!(
        "{met} of {} met, {three} within 3 times, {harmed} harmed",
        outcomes.len()
    );
}
