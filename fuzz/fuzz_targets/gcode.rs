//! Arbitrary bytes as a program: never a panic, and nothing is written that the check would not accept.
#![no_main]

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;
use trueaxis::{
    AlignedBlob, Axis, Direction, Draft, DraftBank, Interpolation, Policy, SampleFormat, Term,
};
use trueaxis_gcode::check::{Corrected, check};
use trueaxis_gcode::modal::{Retract, Units};
use trueaxis_gcode::offsets::System;
use trueaxis_gcode::setup::Decimals;
use trueaxis_gcode::{
    Backlash, Corrector, Dialect, Options, Rules, Setup, Tables, Tip, stream, subprograms,
};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;

/// Choices of a mode byte: dialects, and their switches.
const DIALECTS: [Dialect; 7] = [
    Dialect::LinuxCnc,
    Dialect::Grbl,
    Dialect::GrblHal,
    Dialect::Fanuc,
    Dialect::Haas,
    Dialect::Siemens,
    Dialect::Printer,
];

/// Sagitta of chords (mm): with 1 µm chords take most of the time without reaching other code.
const CHORD: f64 = 0.004;
/// Longer programs (bytes) are not checked: hundreds of similar chords.
const LONGEST: usize = 8000;

/// Everything that does not depend on the input, made only once.
struct Bench {
    tables: Tables<'static>,
    tip: Tip<'static>,
    /// For each dialect, with `/` lines executed or skipped, with or without least increments.
    rules: Vec<Rules>,
}

/// The axes of the machine, in its order, with their travel.
const AXES: [(u8, [f32; 2]); 5] = [
    (b'Y', [0.0, 300.0]),
    (b'X', [0.0, 400.0]),
    (b'A', [-100.0, 100.0]),
    (b'C', [-360.0, 360.0]),
    (b'Z', [-250.0, 0.0]),
];

/// A small compensation with everything that cuts, turns and steps: curves, a product, backlash of a linear and of a
/// rotary axis.
fn draft() -> Draft {
    let axis = |(name, travel): (u8, [f32; 2])| Axis {
        name,
        travel,
        period: 0.0,
        value_bound: 1.0,
        rate_bound: 1.0,
        reversal_threshold: 0.001,
        ramp_rate: 1.0,
        reversal_rate: 1.0,
        reversal_acceleration: 20.0,
    };
    let bank =
        |input: u8, start: f32, step: f32, direction: Direction, column: Vec<f32>| DraftBank {
            input,
            start,
            step,
            modulo: false,
            direction,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![column],
        };
    let term = |output: u8, weight: f32, factors: &[u8]| Term {
        output,
        weight,
        limits: None,
        factors: factors.iter().copied().collect(),
    };
    let (y, x, a, c, z) = (0, 1, 2, 3, 4);
    Draft {
        machine: "xyzac-trt".to_owned(),
        policy: Policy::default(),
        axes: AXES.map(axis).to_vec(),
        auxiliaries: Vec::new(),
        banks: vec![
            bank(
                x,
                0.0,
                100.0,
                Direction::Both,
                vec![0.0, 0.003, 0.005, 0.009, 0.011],
            ),
            bank(
                c,
                -360.0,
                90.0,
                Direction::Both,
                vec![0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, -1.0, 0.0],
            ),
            bank(x, 0.0, 400.0, Direction::Signed, vec![0.002, 0.002]),
            bank(c, -360.0, 720.0, Direction::Signed, vec![0.003, 0.003]),
            bank(
                a,
                -100.0,
                50.0,
                Direction::Both,
                vec![-0.5, 0.2, 0.0, 0.3, 0.9],
            ),
        ],
        terms: vec![
            term(x, 1.0, &[0]),
            term(x, 1.0, &[2]),
            term(y, 0.01, &[1]),
            term(z, 1.0, &[0, 1]),
            term(z, 0.01, &[4]),
            term(a, 0.002, &[4]),
            term(c, 1.0, &[3]),
        ],
        ..Draft::default()
    }
}

static BENCH: LazyLock<Bench> = LazyLock::new(|| {
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft().encode().expect("a blob")));
    let runtime: &'static Runtime<'static> =
        Box::leak(Box::new(Runtime::load(blob).expect("it loads")));
    let tables = Tables::new(runtime.compensation()).expect("letters of programs");
    let text = include_str!("../../examples/linuxcnc-xyzac-trt/machine.toml");
    let machine: &'static Machine =
        Box::leak(Box::new(Machine::from_toml(text).expect("a machine")));
    let tip = Tip::new(machine).expect("workpiece coordinates");
    let mut setup = Setup {
        units: Some(Units::Millimetre),
        ..Setup::default()
    };
    let mut zero = System::default();
    let mut turned = System {
        rotation: 30.0,
        ..System::default()
    };
    for axis in 0..6 {
        if let Some([low, high]) = tables.travel[axis] {
            let middle = 0.5 * (low + high);
            setup.start.set(axis, middle);
            setup.travel[axis] = trueaxis::Travel::Positive;
            // A short number is a reachable position.
            zero.origin[axis] = middle;
            turned.origin[axis] = 0.5 * middle;
        }
    }
    setup.systems.insert(1, zero);
    setup.systems.insert(2, turned);
    setup.systems.insert(101, zero);
    setup.retract = Some(Retract::Initial);
    setup.homes = [Some(setup.start), None];
    setup.tools.insert(1, [0.0; 9]);
    setup
        .tools
        .insert(2, [0.0, 0.0, 12.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let rules = |dialect: Dialect, delete, least: bool| Rules {
        dialect,
        setup: Setup {
            decimals: (least && dialect.table().needs_points).then_some(Decimals::Least),
            systems: match dialect.table().systems_turn {
                true => setup.systems.clone(),
                // Others refuse a setup with a rotation.
                false => [(1, zero), (2, zero), (101, zero)].into(),
            },
            ..setup.clone()
        },
        axes: tables.axes,
        block_delete: Some(delete),
        has_machine: true,
        ..Rules::default()
    };
    let mut all = Vec::new();
    for dialect in DIALECTS {
        for switches in 0..4 {
            all.push(rules(dialect, switches & 1 != 0, switches & 2 != 0));
        }
    }
    Bench {
        tables,
        tip,
        rules: all,
    }
});

fuzz_target!(|data: &[u8]| {
    let Some((mode, program)) = data.split_first() else {
        return;
    };
    let Bench { tables, tip, rules } = &*BENCH;
    let (mode, choices) = (usize::from(*mode), rules.len());
    let rules = &rules[mode % choices];
    let backlash = [Backlash::Move, Backlash::Blend, Backlash::Leave];
    let options = Options {
        backlash: backlash[mode / choices % 3],
        chord: CHORD,
        ..Options::default()
    };
    let Ok(mut corrector) = Corrector::new(rules, tables, Some(tip), options, None) else {
        return;
    };
    let inlined;
    let mut program = program;
    // Without L, which only makes it long.
    if rules.dialect.table().calls && !program.contains(&b'L') {
        let Ok(done) = subprograms::inline(program, rules.dialect) else {
            return;
        };
        inlined = done.text;
        program = &inlined;
    }
    let (mut written, mut map) = (Vec::new(), Vec::new());
    if stream::correct(program, &mut written, &mut map, &mut corrector, |_| {}).is_err() {
        return;
    }
    if written.len() > LONGEST {
        return;
    }
    let found = check(
        program,
        Corrected {
            text: written.as_slice(),
            map: map.as_slice(),
        },
        rules,
        tables,
        Some(tip),
        None,
        options,
    );
    let written = || String::from_utf8_lossy(&written);
    match found {
        Ok(found) => assert!(found.holds(&options), "{found:?}:\n{}", written()),
        Err(error) => panic!("{error}:\n{}", written()),
    }
});
