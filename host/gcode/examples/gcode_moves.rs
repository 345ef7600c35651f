//! What the interpreter of `trueaxis gcode` makes of programs, for `cargo xtask gcode`, which compares it with
//! another interpreter: motions of each file in machine coordinates (mm, degrees), or the word that it is refused for.
//!
//! `gcode_moves [--tool=N=LENGTH]… [--wrapped=C] FILE…`; `gcode_moves --random=COUNT FOLDER` writes programs that nobody
//! wrote, `0.ngc` and so on.

#[path = "../tests/programs/drawn.rs"]
mod drawn;

use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::io::BufReader;
use trueaxis_gcode::cycle::Part;
use trueaxis_gcode::modal::{Retract, Units};
use trueaxis_gcode::moves::{Move, Rate};
use trueaxis_gcode::offsets::System;
use trueaxis_gcode::stream::{Lines, look_for_computing};
use trueaxis_gcode::trace::Path;
use trueaxis_gcode::words::Block;
use trueaxis_gcode::{Dialect, Refusal, Rules, Setup, State};

/// The machine of `rs274 -g`: in mm, at zero, offsets zero.
fn rules(tools: &[(u32, f64)]) -> Rules {
    let mut setup = Setup {
        units: Some(Units::Millimetre),
        ..Setup::default()
    };
    (0..9).for_each(|axis| setup.start.set(axis, 0.0));
    for number in 1..=9 {
        setup.systems.insert(number, System::default());
    }
    for (number, length) in tools {
        let mut offset = [0.0; 9];
        offset[2] = *length;
        setup.tools.insert(*number, offset);
    }
    setup.retract = Some(Retract::Plane);
    setup.tool = Some(0);
    setup.homes = [Some(setup.start); 2];
    Rules {
        axes: 0x1ff,
        setup,
        block_delete: Some(false),
        has_machine: true,
        ..Rules::default()
    }
}

fn place(at: &[f64; 9]) -> String {
    let at = at.map(|v| format!("{v:.5}"));
    at.join(" ")
}

/// What is asked on the command line.
#[derive(Default)]
struct CommandLine {
    tools: Vec<(u32, f64)>,
    wrapped: Vec<usize>,
}

impl CommandLine {
    fn rules(&self) -> Rules {
        let mut rules = rules(&self.tools);
        for axis in &self.wrapped {
            rules.setup.wrapped[*axis] = Some(true);
        }
        rules
    }
}

fn run(name: &str, asked: &CommandLine) -> Result<(), String> {
    let open = || std::fs::File::open(name).map(BufReader::new);
    let failed = |e: std::io::Error| format!("other {e}");
    let refused = |e: trueaxis_gcode::stream::StreamError| match e {
        trueaxis_gcode::stream::StreamError::Refused(r) => {
            format!("{:?} {} {r}", r.kind, r.word)
        }
        other => format!("other {other}"),
    };
    look_for_computing(open().map_err(failed)?, Dialect::LinuxCnc).map_err(refused)?;
    let rules = asked.rules();
    let mut state = State::new(&rules);
    let mut block = Block::default();
    let mut lines = Lines::new(open().map_err(failed)?);
    let mut number = 0;
    while let Some((line, _)) = lines.next_line().map_err(refused)? {
        number += 1;
        if state.ended {
            break;
        }
        let step = block
            .scan(line, Dialect::LinuxCnc)
            .and_then(|()| state.step(&block, &rules));
        let step = step.map_err(|f| {
            let r = Refusal::at(f, number, line);
            format!("{:?} {} {r}", r.kind, r.word)
        })?;
        if let Some(motion) = &step.motion {
            print(motion, &state)?;
        }
    }
    Ok(())
}

/// F as rs274 shows it.
fn feed(state: &State, rate: Rate, path: &Path) -> f64 {
    match rate {
        Rate::Rapid => 0.0,
        Rate::PerMinute(f) | Rate::PerRevolution(f) => f,
        // As rs274 shows it: what it makes of the length.
        Rate::Inverse(f) => {
            let unit = state.units.map_or(1.0, Units::mm);
            let by = path.by();
            let by = std::array::from_fn(|i| {
                if (3..6).contains(&i) {
                    by[i]
                } else {
                    by[i] / unit
                }
            });
            let length = match path {
                Path::Line(..) => Dialect::LinuxCnc.length(&by),
                Path::Arc(arc) => arc.length() / unit,
            };
            (length * f).max(0.1)
        }
    }
}

fn print(motion: &Move, state: &State) -> Result<(), String> {
    match motion {
        Move::Straight(straight, rate) => {
            let kind = if *rate == Rate::Rapid {
                "rapid"
            } else {
                "feed"
            };
            let feed = feed(state, *rate, &Path::Line(straight.from.at, straight.to));
            println!("{kind} {} {feed:.5}", place(&straight.to));
        }
        Move::Arc(arc, rate) => {
            let turns = (arc.sweep.abs() / std::f64::consts::TAU - 1e-9).floor() + 1.0;
            let [i, j] = arc.centre;
            println!(
                "arc {} {:.5} {} {i:.5} {j:.5}",
                place(&arc.to),
                feed(state, *rate, &Path::Arc(*arc)),
                turns.copysign(arc.sweep)
            );
        }
        Move::Cycle(cycle) => {
            let f = match cycle.rate {
                Rate::PerMinute(f) | Rate::PerRevolution(f) => f,
                rate => return Err(format!("other {rate:?} in a cycle")),
            };
            let parts = cycle.parts();
            let code = cycle.code / 10;
            let parts = parts.ok_or(format!("other G{code}, which moves with the spindle"))?;
            for part in parts {
                match part {
                    Part::Rapid(to) => println!("rapid {} 0", place(&to)),
                    Part::Feed(to) => println!("feed {} {f:.5}", place(&to)),
                    Part::Dwell(_) | Part::SpindleStops | Part::SpindleTurns => {}
                }
            }
        }
    }
    Ok(())
}

/// Writes so many programs for an empty table around zero.
fn write_programs(count: &str, folder: &str) -> Result<(), String> {
    let count = count.parse().map_err(|_| format!("{count}: no number"))?;
    let rules = rules(&[(1, 0.0)]);
    // X Y Z A B C, within what a small machine has.
    let boxes = std::array::from_fn(|axis| match axis {
        0..3 => [-80.0, 80.0],
        _ => [-60.0, 60.0],
    });
    let rules = Rules {
        axes: 0x3f,
        ..rules
    };
    for seed in 0..count {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let text = drawn::program(&mut random, &rules, &boxes, 20) + "M2\n";
        let path = format!("{folder}/{seed}.ngc");
        std::fs::write(&path, text).map_err(|e| format!("{path}: {e}"))?;
    }
    Ok(())
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [first, folder] = &arguments[..]
        && let Some(count) = first.strip_prefix("--random=")
    {
        if let Err(cause) = write_programs(count, folder) {
            println!("refused {cause}");
        }
        return;
    }
    let mut asked = CommandLine::default();
    for argument in arguments {
        if let Some(letter) = argument.strip_prefix("--wrapped=") {
            asked
                .wrapped
                .extend(letter.bytes().filter_map(trueaxis_gcode::axes::index));
            continue;
        }
        if let Some(tool) = argument.strip_prefix("--tool=") {
            let tool = tool
                .split_once('=')
                .and_then(|(n, l)| n.parse().ok().zip(l.parse().ok()));
            match tool {
                Some(tool) => asked.tools.push(tool),
                None => println!("no tool: {argument}"),
            }
            continue;
        }
        println!("file {argument}");
        if let Err(cause) = run(&argument, &asked) {
            println!("refused {cause}");
        }
    }
}
