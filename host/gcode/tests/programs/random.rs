//! Programs that nobody wrote, and lines that are no programs, corrected and checked.

use super::drawn::{Boxes, program};
use proptest::prelude::*;
use rand::SeedableRng;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64Mcg;
use std::sync::OnceLock;
use trueaxis::AlignedBlob;
use trueaxis_gcode::axes::{self, COUNT};
use trueaxis_gcode::check::{CheckResult, Corrected, Exact, check};
use trueaxis_gcode::fault::Refusal;
use trueaxis_gcode::modal::Units;
use trueaxis_gcode::offsets::System;
use trueaxis_gcode::stream::StreamError;
use trueaxis_gcode::{Backlash, Corrector, Dialect, Options, Rules, Setup, Tables, Tip, stream};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile;

/// A machine with what its programs are corrected with.
pub struct Bench {
    pub machine: Machine,
    errors: ErrorModel,
    pub blob: AlignedBlob,
    /// What the tables leave at the tip (µm): their tolerance, along and across.
    own: f64,
}

impl Bench {
    /// Three axes.
    fn mill() -> Self {
        static BLOB: OnceLock<AlignedBlob> = OnceLock::new();
        let (machine, errors) = (
            include_str!("../../../../examples/mill-21/machine.toml"),
            include_str!("../../../../examples/mill-21/errors-21.toml"),
        );
        Self::new(&BLOB, machine, errors)
    }

    /// Five axes, two of which turn the part, with backlash.
    pub fn five() -> Self {
        static BLOB: OnceLock<AlignedBlob> = OnceLock::new();
        let (machine, errors) = (
            include_str!("../../../../examples/linuxcnc-xyzac-trt/machine.toml"),
            include_str!("../../../../examples/linuxcnc-xyzac-trt/errors-11.toml"),
        );
        Self::new(&BLOB, machine, errors)
    }

    fn new(blob: &OnceLock<AlignedBlob>, machine: &str, errors: &str) -> Self {
        let machine = Machine::from_toml(machine).unwrap();
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        let options = compile::Options {
            random: 100,
            ..compile::Options::default()
        };
        let compiled = || compile::compile(&machine, &errors, &options, &()).unwrap();
        let blob = blob.get_or_init(|| compiled().built.blob).clone();
        Self {
            blob,
            machine,
            errors,
            own: 0.1,
        }
    }
}

/// Where a program may go: well within the travel.
fn box_of(machine: &Machine, axis: usize) -> [f64; 2] {
    let Some(place) = machine.index(axes::name(axis)) else {
        return [0.0; 2];
    };
    let [low, high] = machine.axes[place].travel;
    let (low, high) = (low.max(-1000.0), high.min(1000.0));
    let middle = 0.5 * (low + high);
    let half = (0.3 * (high - low)).min(if axes::is_rotary(axis) { 60.0 } else { 80.0 });
    [middle - half, middle + half]
}

/// Like `box_of`, of all axes.
pub fn boxes(machine: &Machine) -> Boxes {
    std::array::from_fn(|axis| box_of(machine, axis))
}

pub fn rules(bench: &Bench, tables: &Tables<'_>) -> Rules {
    let mut setup = Setup {
        units: Some(Units::Millimetre),
        ..Setup::default()
    };
    for axis in (0..COUNT).filter(|axis| tables.axes & (1 << axis) != 0) {
        let [low, high] = box_of(&bench.machine, axis);
        setup.start.set(axis, 0.5 * (low + high));
        setup.travel[axis] = trueaxis::Travel::Positive;
    }
    setup.systems.insert(1, System::default());
    setup.systems.insert(2, System::default());
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

/// Corrects a program and checks what was written, with the exact machine; what is refused in it otherwise.
pub fn try_one(
    bench: &Bench,
    tables: &Tables<'_>,
    rules: &Rules,
    tip: Option<&Tip<'_>>,
    options: Options,
    text: &str,
) -> Result<CheckResult, Refusal> {
    let mut corrector = Corrector::new(rules, tables, tip, options, None).unwrap();
    let (mut written, mut map) = (Vec::new(), Vec::new());
    match stream::correct(
        text.as_bytes(),
        &mut written,
        &mut map,
        &mut corrector,
        |_| {},
    ) {
        Ok(()) => {}
        Err(StreamError::Refused(refusal)) => return Err(refusal),
        Err(other) => panic!("{other}\n{text}"),
    }
    let shown = || format!("{options:?}\n{text}\n{}", String::from_utf8_lossy(&written));
    let exact = Exact {
        machine: &bench.machine,
        errors: &bench.errors,
    };
    let found = check(
        text.as_bytes(),
        Corrected {
            text: written.as_slice(),
            map: map.as_slice(),
        },
        rules,
        tables,
        tip,
        Some(&exact),
        options,
    )
    .unwrap_or_else(|e| panic!("{e}: {}", shown()));
    assert!(found.holds(&options), "{found:?} {}", shown());
    let chord = if corrector.report.arcs[1] > 0 {
        options.chord * 1e3
    } else {
        0.0
    };
    let rounding = (options.coarsest_rounding() + 500.0 * options.angle_rounding()) * 1e3;
    let allowed = (options.tolerance * 1e3 + chord + rounding).max(found.hole_um);
    // A step that is blended into a move or left out is not on the path. What goes back by no more than its reversal threshold
    // stays in its lost motion.
    if let (Some(path), Backlash::Move) = (&found.tool_path, options.backlash) {
        assert!(
            path.turned_um <= unturned_um(tables),
            "{found:?} {}",
            shown()
        );
        assert!(
            path.after_um.max <= allowed + bench.own + path.turned_um,
            "{found:?} {}",
            shown()
        );
    }
    Ok(found)
}

/// What axes make at the tip that each go back by their reversal threshold (µm), half a metre from it.
fn unturned_um(tables: &Tables<'_>) -> f64 {
    let thresholds = tables.reversal_threshold.iter().enumerate();
    let parts = thresholds.map(|(axis, back)| match axis {
        3..6 => (500.0 * back.to_radians()).powi(2),
        _ => back * back,
    });
    parts.sum::<f64>().sqrt() * 1e3
}

/// Corrects and checks so many programs with these options.
fn try_programs(bench: &Bench, count: u64, options: Options) {
    let runtime = Runtime::load(&bench.blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    let rules = rules(bench, &tables);
    let boxes = boxes(&bench.machine);
    for seed in 0..count {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let text = program(&mut random, &rules, &boxes, 8);
        try_one(bench, &tables, &rules, None, options, &text)
            .unwrap_or_else(|e| panic!("seed {seed}: {e}\n{text}"));
    }
}

/// One of them.
pub fn one<T: Copy>(random: &mut Pcg64Mcg, of: &[T]) -> T {
    *of.choose(random).unwrap()
}

/// What becomes of reversals: mostly the default.
pub fn backlash(random: &mut Pcg64Mcg) -> Backlash {
    let of = [
        Backlash::Move,
        Backlash::Move,
        Backlash::Blend,
        Backlash::Leave,
    ];
    one(random, &of)
}

/// A program, and how it is corrected.
pub struct Trial {
    pub text: String,
    pub dialect: Dialect,
    pub options: Options,
}

/// Tries so many programs of five axes, with G54 in the middle of the table, below the tool: how many are corrected,
/// and how many are refused for one of these reasons.
pub fn try_five(count: u64, refusals: &[&str], next: impl Fn(&mut Pcg64Mcg) -> Trial) -> [u64; 2] {
    let bench = Bench::five();
    let runtime = Runtime::load(&bench.blob).unwrap();
    let tables = Tables::new(runtime.compensation()).unwrap();
    let tip = Tip::new(&bench.machine).unwrap();
    let mut rules = rules(&bench, &tables);
    rules.has_machine = true;
    let mut middle = System::default();
    middle.origin[..3].copy_from_slice(&[200.0, 150.0, -125.0]);
    rules.setup.systems.insert(1, middle);
    let [mut done, mut refused] = [0; 2];
    for seed in 0..count {
        let trial = next(&mut Pcg64Mcg::seed_from_u64(seed));
        rules.dialect = trial.dialect;
        match try_one(
            &bench,
            &tables,
            &rules,
            Some(&tip),
            trial.options,
            &trial.text,
        ) {
            Ok(_) => done += 1,
            Err(refusal) if refusals.iter().any(|why| refusal.cause.contains(why)) => refused += 1,
            Err(other) => panic!("seed {seed}: {other}\n{}", trial.text),
        }
    }
    [done, refused]
}

#[test]
fn random_programs_of_three_axes_are_corrected_within_the_tolerance_and_keep_their_times() {
    let bench = Bench::mill();
    try_programs(&bench, 500, Options::default());
}

#[test]
fn random_programs_whose_words_have_three_decimals_are_within_what_rounding_costs() {
    let bench = Bench::mill();
    let options = Options {
        decimals: Some(3),
        ..Options::default()
    };
    try_programs(&bench, 200, options);
}

#[test]
fn random_programs_of_five_axes_with_backlash_are_corrected_within_the_tolerance_and_keep_their_times()
 {
    try_programs(&Bench::five(), 500, Options::default());
}

#[test]
fn the_least_tolerance_is_kept_by_the_decimals_of_words() {
    let options = Options {
        tolerance: 0.3e-3,
        ..Options::default()
    };
    let mill = Bench::mill();
    for bench in [mill, Bench::five()] {
        try_programs(&bench, 200, options);
    }
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
        let bench = Bench::mill();
        let runtime = Runtime::load(&bench.blob).unwrap();
        let tables = Tables::new(runtime.compensation()).unwrap();
        let rules = rules(&bench, &tables);
        let options = Options::default();
        let lines: Vec<String> = lines.iter().map(|words| words.join(" ")).collect();
        let text = format!("G21 G90 F100\n{}\n", lines.join("\n"));
        let mut corrector = Corrector::new(&rules, &tables, None, options, None).unwrap();
        let (mut written, mut map) = (Vec::new(), Vec::new());
        if stream::correct(text.as_bytes(), &mut written, &mut map, &mut corrector, |_| {}).is_ok() {
            let corrected = Corrected { text: written.as_slice(), map: map.as_slice() };
            let found = check(text.as_bytes(), corrected, &rules, &tables, None, None, options);
            let found = found.unwrap_or_else(|e| panic!("{e}:\n{text}\n{}", String::from_utf8_lossy(&written)));
            prop_assert!(found.excess_um == 0.0, "{found:?}\n{text}\n{}", String::from_utf8_lossy(&written));
        }
    }
}
