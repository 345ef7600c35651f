//! Programs that nobody wrote: all modes, arcs of every kind, rotary moves; and lines that are no programs.

use crate::program::{blob, example};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::fmt::Write;
use trueaxis::AlignedBlob;
use trueaxis_host::errors::ErrorModel;
use trueaxis_host::gcode::axes::{self, COUNT};
use trueaxis_host::gcode::check::{Exact, check};
use trueaxis_host::gcode::modal::Units;
use trueaxis_host::gcode::offsets::System;
use trueaxis_host::gcode::words::Block;
use trueaxis_host::gcode::{Corrector, Options, Rules, Setup, State, Tables, stream};
use trueaxis_host::machine::Machine;
use trueaxis_host::validate::Runtime;

/// A machine with what its programs are corrected with.
pub struct Bench {
    pub machine: Machine,
    errors: ErrorModel,
    pub blob: AlignedBlob,
    /// What the tables leave at the tip (µm): their tolerance, along and across.
    own: f64,
}

impl Bench {
    fn new(name: &str, machine: &str, errors: &str) -> Self {
        let bytes = std::fs::read(blob(name)).unwrap();
        Self::of(AlignedBlob::from_bytes(&bytes), machine, errors)
    }

    /// With another compensation.
    pub fn of(blob: AlignedBlob, machine: &str, errors: &str) -> Self {
        let read = |path: &str| std::fs::read_to_string(example(path)).unwrap();
        let machine = Machine::from_toml(&read(machine)).unwrap();
        let errors =
            ErrorModel::with_files(&read(errors), &machine, &|_| Err(String::new())).unwrap();
        Self {
            machine,
            errors,
            blob,
            own: 0.1,
        }
    }
}

/// Where a program may go: well within the travel.
fn box_of(machine: &Machine, axis: usize) -> [f64; 2] {
    let letter = axes::name(axis);
    let place = machine.index(letter).unwrap();
    let [low, high] = machine.axes[place].travel;
    let (low, high) = (low.max(-1000.0), high.min(1000.0));
    let middle = 0.5 * (low + high);
    let half = (0.3 * (high - low)).min(if axes::is_rotary(axis) { 60.0 } else { 80.0 });
    [middle - half, middle + half]
}

/// A program of so many motions, which stays in the box.
pub fn program(random: &mut Pcg64Mcg, rules: &Rules, machine: &Machine, motions: usize) -> String {
    let mut state = State::new(rules);
    let mut block = Block::default();
    let mut text = String::new();
    let mut put = |state: &mut State, line: String| {
        block.scan(line.as_bytes(), rules.dialect).unwrap();
        state
            .step(&block, rules)
            .unwrap_or_else(|fault| panic!("{line}: {}", fault.cause));
        text += &line;
        text += "\n";
    };
    let all: Vec<usize> = (0..COUNT)
        .filter(|axis| rules.axes & (1 << axis) != 0)
        .collect();
    put(&mut state, "G21 G90 G17 G94 F1000".to_owned());
    let inside = |random: &mut Pcg64Mcg, axis: usize| {
        let [low, high] = box_of(machine, axis);
        low + (high - low) * random.random::<f64>()
    };
    let number = |value: f64, digits: usize| format!("{value:.digits$}");
    for motion in 0..motions {
        if random.random_range(0..4) == 0 {
            let mode = [
                "G20", "G21", "G90", "G91", "G17", "G18", "G19", "G54", "G55", "G92.1",
            ][random.random_range(0..10)];
            // Under a rotation arcs stay in XY.
            put(&mut state, mode.to_owned());
            put(&mut state, format!("F{}", random.random_range(100..2000)));
        }
        if random.random_range(0..12) == 0 && motion > 0 {
            put(
                &mut state,
                format!(
                    "G92 X{} Y{}",
                    random.random_range(-50..50),
                    random.random_range(-50..50)
                ),
            );
        }
        let unit = state.units.map_or(1.0, Units::mm);
        let digits = if unit > 1.0 {
            5
        } else {
            random.random_range(1..5)
        };
        let turned = state.offsets.is_turned();
        let plane = state.plane.unwrap();
        let [i, j, n] = plane.axes();
        let arc = random.random_range(0..3) == 0 && motion > 0 && (!turned || n == 2);
        let mut to = state.position.at;
        for axis in &all {
            let rotary = axes::is_rotary(*axis);
            let chance = if motion == 0 {
                1.0
            } else if rotary {
                0.3
            } else {
                0.7
            };
            if random.random::<f64>() < chance && !(arc && rotary) {
                to[*axis] = inside(random, *axis);
                // Short moves too.
                if random.random_range(0..3) == 0 && motion > 0 {
                    to[*axis] =
                        state.position.at[*axis] + 0.01 * (to[*axis] - state.position.at[*axis]);
                }
            }
        }
        let incremental =
            state.distance == Some(trueaxis_host::gcode::modal::Distance::Incremental);
        let words = |state: &State, to: &[f64; COUNT], only: &[usize]| {
            let (target, here) = (
                state.offsets.program(to),
                state.offsets.program(&state.position.at),
            );
            let mut words = String::new();
            for axis in only {
                let unit = if axes::is_rotary(*axis) { 1.0 } else { unit };
                let value = if incremental {
                    target[*axis] - here[*axis]
                } else {
                    target[*axis]
                };
                let _ = write!(
                    words,
                    " {}{}",
                    axes::name(*axis),
                    number(value / unit, digits)
                );
            }
            words
        };
        if arc {
            let from = state.position.at;
            let letters = ["I", "J", "K"];
            let full = random.random_range(0..4) == 0;
            let word = ["G2", "G3"][random.random_range(0..2)];
            // A centre near by, so that the circle stays in the travel.
            let radius = 0.5 + 14.0 * random.random::<f64>();
            let angle = std::f64::consts::TAU * random.random::<f64>();
            let by = [radius * angle.cos(), radius * angle.sin()];
            let program_by = match turned {
                true => state.offsets.turned_back(by),
                false => by,
            };
            // The centre as it will be read.
            let by_words = program_by.map(|v| number(v / unit, 5));
            let centre = format!(
                " {}{} {}{}",
                letters[i], by_words[0], letters[j], by_words[1]
            );
            let helix = random.random_range(0..2) == 0;
            let mut end = from;
            if !full {
                let turn = angle + std::f64::consts::PI + 0.3 + 5.5 * random.random::<f64>();
                end[i] = from[i] + by[0] + radius * turn.cos();
                end[j] = from[j] + by[1] + radius * turn.sin();
            }
            if helix {
                end[n] = inside(random, n);
            }
            let mut only = Vec::new();
            if !full {
                only.extend([i, j]);
            }
            if helix {
                only.push(n);
            }
            only.sort_unstable();
            let text: Vec<String> = {
                let (target, here) = (state.offsets.program(&end), state.offsets.program(&from));
                let only = only.iter();
                only.map(|axis| {
                    let value = if incremental {
                        target[*axis] - here[*axis]
                    } else {
                        target[*axis]
                    };
                    format!(" {}{}", axes::name(*axis), number(value / unit, 5))
                })
                .collect()
            };
            put(&mut state, format!("{word}{}{centre}", text.concat()));
            continue;
        }
        let moved: Vec<usize> = all
            .iter()
            .copied()
            .filter(|axis| to[*axis] != state.position.at[*axis])
            .collect();
        if moved.is_empty() {
            continue;
        }
        let rapid = random.random_range(0..4) == 0;
        let inverse = !rapid && random.random_range(0..5) == 0;
        let words = words(&state, &to, &moved);
        if inverse {
            put(
                &mut state,
                format!("G93 G1{words} F{}", random.random_range(1..50)),
            );
            put(
                &mut state,
                format!("G94 F{}", random.random_range(100..2000)),
            );
        } else {
            put(
                &mut state,
                format!("{}{words}", if rapid { "G0" } else { "G1" }),
            );
        }
    }
    text
}

pub fn rules(bench: &Bench, tables: &Tables<'_>) -> Rules {
    let mut setup = Setup {
        units: Some(Units::Millimetre),
        ..Setup::default()
    };
    let mut second = System {
        rotation: 20.0,
        ..System::default()
    };
    for axis in (0..COUNT).filter(|axis| tables.axes & (1 << axis) != 0) {
        let [low, high] = box_of(&bench.machine, axis);
        setup.start.set(axis, 0.5 * (low + high));
        second.origin[axis] = 0.3 * (low + high);
        setup.travel[axis] = trueaxis::Travel::Positive;
    }
    setup.systems.insert(1, System::default());
    setup.systems.insert(2, second);
    setup.tool = Some(1);
    let mut tool = [0.0; COUNT];
    tool[2] = bench.machine.tool_length();
    setup.tools.insert(1, tool);
    Rules {
        axes: tables.axes,
        setup,
        ..Rules::default()
    }
}

/// Corrects and checks so many programs.
fn try_programs(bench: &Bench, count: u64) {
    let runtime = Runtime::load(&bench.blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    let rules = rules(bench, &tables);
    let options = Options::default();
    let exact = Exact {
        machine: &bench.machine,
        errors: &bench.errors,
    };
    for seed in 0..count {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let text = program(&mut random, &rules, &bench.machine, 8);
        let mut corrector = Corrector::new(&rules, &tables, None, options, None).unwrap();
        let mut written = Vec::new();
        stream::correct(text.as_bytes(), &mut written, &mut corrector, |_| {})
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{text}"));
        let shown = || format!("seed {seed}\n{text}\n{}", String::from_utf8_lossy(&written));
        let found = check(
            text.as_bytes(),
            written.as_slice(),
            &rules,
            &tables,
            None,
            Some(&exact),
            options,
        )
        .unwrap_or_else(|e| panic!("{e}: {}", shown()));
        assert!(found.excess_um == 0.0, "{found:?} {}", shown());
        let chord = if corrector.report.arcs[1] > 0 {
            options.chord * 1e3
        } else {
            0.0
        };
        let allowed = options.tolerance * 1e3 + chord;
        assert!(
            found.off_urad <= options.direction * 1e6,
            "{found:?} {}",
            shown()
        );
        assert_eq!(found.times_differ, 0, "{found:?} {}", shown());
        if let Some(path) = &found.tool_path {
            assert!(
                path.after_um.max <= allowed + bench.own,
                "{found:?} {}",
                shown()
            );
        }
    }
}

#[test]
fn random_programs_of_three_axes_are_corrected_within_the_tolerance_and_keep_their_times() {
    let bench = Bench::new("mill-21", "mill-21/machine.toml", "mill-21/errors-21.toml");
    try_programs(&bench, 500);
}

#[test]
fn random_programs_of_five_axes_with_backlash_are_corrected_within_the_tolerance_and_keep_their_times()
 {
    let name = "linuxcnc-xyzac-trt";
    let bench = Bench::new(
        "xyzac-trt",
        &format!("{name}/machine.toml"),
        &format!("{name}/errors-11.toml"),
    );
    try_programs(&bench, 500);
}

fn word() -> impl Strategy<Value = String> {
    let letters = "[GMXYZACFIJKRLPQHTSND]";
    (
        letters,
        prop_oneof!["-?[0-9]{1,2}", "-?[0-9]{1,2}\\.[0-9]{1,3}", "[0-4]"],
    )
        .prop_map(|(l, n)| l + &n)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn whatever_is_written_is_accepted_by_the_check(
        lines in proptest::collection::vec(proptest::collection::vec(word(), 0..6), 1..12),
    ) {
        let bench = Bench::new("mill-21", "mill-21/machine.toml", "mill-21/errors-21.toml");
        let runtime = Runtime::load(&bench.blob).unwrap();
        let tables = Tables::new(runtime.compensation()).unwrap();
        let rules = rules(&bench, &tables);
        let options = Options::default();
        let lines: Vec<String> = lines.iter().map(|words| words.join(" ")).collect();
        let text = format!("G21 G90 F100\n{}\n", lines.join("\n"));
        let mut corrector = Corrector::new(&rules, &tables, None, options, None).unwrap();
        let mut written = Vec::new();
        if stream::correct(text.as_bytes(), &mut written, &mut corrector, |_| {}).is_ok() {
            let found = check(text.as_bytes(), written.as_slice(), &rules, &tables, None, None, options);
            let found = found.unwrap_or_else(|e| panic!("{e}:\n{text}\n{}", String::from_utf8_lossy(&written)));
            prop_assert!(found.excess_um == 0.0, "{found:?}\n{text}\n{}", String::from_utf8_lossy(&written));
        }
    }
}
