//! Counts the instructions of one evaluation, of one servo update, and of the alternatives without tables, on a
//! Cortex-M4F in QEMU, and the stack they need. Prints one `key value` per line; `cargo xtask bench-target` builds the
//! blobs, runs this and checks the figures.
#![no_std]
#![no_main]

mod counter;
mod generated;
mod path;
mod rivals;
mod stack;
mod workloads;

use core::hint::black_box;

use cortex_m_rt::entry;
use counter::{Counter, Spread};
use path::Path;
use rivals::htm::Direct;
use rivals::{closed_form, exact};
use semihosting::{println, process};
use trueaxis::{Compensation, Inputs, Room, Row, Servo, Travel, Travelling, capacities};
use trueaxis_kinematics::{Kinematics, Policy};
use workloads::{
    CUBIC, DOCUMENT, FIK, GRID, HURON, HURON_DIRECTION, KOLIBRI_DIRECTION, LINEAR, THERMAL,
};

/// Number of positions per measurement.
const POSITIONS: usize = 512;
/// Number of servo updates per measurement, with several reversals of every axis.
const UPDATES: usize = 4096;
/// Number of measured servo updates after the corrections are disabled; axes reverse meanwhile.
const RAMPING: usize = 1024;
/// Number of measured servo updates during a change of compensation, to its end and beyond.
const FADING: usize = 1200;
/// Servo period of the measurements, s.
const PERIOD: f32 = 0.001;
/// Permitted difference between a rival and the tables, mm or degrees: f32 rounds products of matrices of 1 m to about
/// 1e-3.
const AGREE: f32 = 0.005;

/// The default capacities of the runtime, for the headline figures.
type Usual = Compensation<'static>;
/// Capacities of a controller for five axes.
type Tight =
    Compensation<'static, capacities!(axes: 5, banks: 16, tables: 32, terms: 64, grids: 1)>;

/// Ends the run with a message.
fn fail(what: &str) -> ! {
    println!("failed {what}");
    process::exit(1)
}

fn load<C: Room>(
    place: &'static mut Compensation<'static, C>,
    blob: &'static [u8],
) -> &'static Compensation<'static, C> {
    if let Err(error) = place.load(blob) {
        println!("failed load: {error}");
        process::exit(1);
    }
    place
}

fn report(key: &str, counts: &mut [u32]) {
    let Spread {
        least,
        typical,
        most,
    } = Spread::of(counts);
    println!("{key} {typical}");
    println!("{key}_min {least}");
    println!("{key}_max {most}");
}

/// Evaluations at random positions in the travel.
fn evaluate<C: Room>(counter: &mut Counter, key: &str, c: &Compensation<'static, C>) {
    let mut path = Path::new(c);
    let (travel, weights) = (
        Travelling(C::Axes::<Travel>::all(Travel::Unknown)),
        c.weights(),
    );
    let mut stack = 0;
    let mut counts = [0; POSITIONS];
    for count in &mut counts {
        let q = path.random();
        let inputs = path::inputs(q);
        let mut corrections = C::Axes::<f32>::all(0.0);
        *count = counter.instructions(|| {
            c.evaluate_into(&inputs, &travel, &weights, black_box(&mut corrections));
        });
        stack = stack.max(stack::peak(|| {
            c.evaluate_into(&inputs, &travel, &weights, black_box(&mut corrections));
        }));
    }
    report(key, &mut counts);
    println!("stack_{key} {stack}");
}

/// Servo updates with all axes moving, one per period, starting at period `first`.
fn updates<C: Room>(
    counter: &mut Counter,
    key: &str,
    servo: &mut Servo<&'static Compensation<'static, C>>,
    path: &Path,
    first: usize,
    counts: &mut [u32],
) {
    let mut stack = 0;
    let mut period = first;
    let mut call = |measured: &mut dyn FnMut(&mut dyn FnMut())| {
        let inputs = path::moving(path, period);
        period += 1;
        measured(&mut || {
            black_box(servo.advance(&inputs, black_box(u16::MAX), black_box(PERIOD)));
        });
    };
    for count in counts.iter_mut() {
        call(&mut |update| *count = counter.instructions(update));
        call(&mut |update| stack = stack.max(stack::peak(update)));
    }
    report(key, counts);
    println!("stack_{key} {stack}");
}

/// Updates from period `first` on until the corrections are fully in, and many more of them; returns the
/// next period.
fn let_in<C: Room>(
    servo: &mut Servo<&'static Compensation<'static, C>>,
    path: &Path,
    first: usize,
) -> usize {
    servo.enable();
    let mut period = first;
    while period < first + UPDATES {
        servo.update(&path::moving(path, period), u16::MAX, PERIOD);
        period += 1;
    }
    if servo.factor() != 1.0 {
        fail("the corrections are not in");
    }
    period
}

/// Servo updates in the steady state, while the corrections ramp out and in, and through a change of compensation.
fn servo<C: Room>(
    counter: &mut Counter,
    keys: [&str; 3],
    [c, other]: [&'static Compensation<'static, C>; 2],
    counts: &mut [u32; UPDATES],
) {
    let path = Path::new(c);
    let mut servo = Servo::new(c);
    let first = let_in(&mut servo, &path, 0);
    updates(counter, keys[0], &mut servo, &path, first, counts);
    servo.disable();
    let first = first + 2 * counts.len();
    updates(
        counter,
        keys[1],
        &mut servo,
        &path,
        first,
        &mut counts[..RAMPING],
    );
    let first = first + 2 * RAMPING;
    let first = let_in(&mut servo, &path, first);
    if servo.swap(other).is_err() {
        fail("the compensation does not take the place of another");
    }
    updates(
        counter,
        keys[2],
        &mut servo,
        &path,
        first,
        &mut counts[..FADING],
    );
    if servo.is_swapping() {
        fail("the measurement ended before the change");
    }
}

/// An alternative without tables, at the same positions; it must give the same corrections. Prints its largest
/// difference in nm (for rotary axes: 1e-6°).
fn rival(counter: &mut Counter, key: &str, c: &Usual, correction: impl Fn(&[f32; 5]) -> [f32; 5]) {
    let mut path = Path::new(c);
    let (travel, weights) = (Travelling::default(), c.weights());
    let mut counts = [0; POSITIONS];
    let mut worst: f32 = 0.0;
    for count in counts.iter_mut() {
        let q = path.random();
        let position: [f32; 5] = core::array::from_fn(|i| q[i]);
        let mut found = [0.0; 5];
        *count = counter.instructions(|| {
            found = black_box(correction(black_box(&position)));
        });
        let tables = c.evaluate(&Inputs::at(q), &travel, &weights);
        for (a, b) in tables.iter().zip(found) {
            let off = (a - b).abs();
            if off.is_nan() || off > worst {
                worst = off;
            }
        }
    }
    if worst.is_nan() || worst > AGREE {
        println!("failed {key} is off by {worst}");
        process::exit(1);
    }
    report(key, &mut counts);
    println!("{key}_nm {}", (worst * 1e6) as u32);
}

/// Generated code, which must have the bits of the tables.
fn generated<const N: usize>(
    counter: &mut Counter,
    key: &str,
    c: &Usual,
    evaluate: impl Fn(&[f32; N]) -> [f32; N],
) {
    let mut path = Path::new(c);
    let (travel, weights) = (Travelling::default(), c.weights());
    let mut counts = [0; POSITIONS];
    let mut stack = 0;
    for count in counts.iter_mut() {
        let q = path.random();
        let position: [f32; N] = core::array::from_fn(|i| q[i]);
        let mut found = [0.0; N];
        *count = counter.instructions(|| {
            found = black_box(evaluate(black_box(&position)));
        });
        stack = stack.max(stack::peak(|| {
            black_box(evaluate(black_box(&position)));
        }));
        let tables = c.evaluate(&Inputs::at(q), &travel, &weights);
        let same = |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits() || (*a == 0.0 && *b == 0.0);
        if !tables.iter().zip(&found).all(same) {
            println!("failed {key} differs from the tables at {position:?}");
            process::exit(1);
        }
    }
    report(key, &mut counts);
    println!("stack_{key} {stack}");
}

/// Evaluations of banks with one and with nine tables.
fn evaluate_banks(counter: &mut Counter, places: &'static mut [Tight; 4]) {
    let keys = [
        "linear_1_table",
        "linear_9_tables",
        "cubic_1_table",
        "cubic_9_tables",
    ];
    let blobs = LINEAR.into_iter().chain(CUBIC);
    for ((key, place), blob) in keys.into_iter().zip(places).zip(blobs) {
        evaluate(counter, key, load(place, &blob.0));
    }
}

/// Evaluations by the programs generated from these compensations.
fn all_generated(counter: &mut Counter, [huron, direction, kolibri, document]: [&Usual; 4]) {
    generated(
        counter,
        "generated_huron13",
        huron,
        generated::huron13::evaluate,
    );
    generated(
        counter,
        "generated_huron13_direction",
        direction,
        generated::huron13_direction::evaluate,
    );
    generated(
        counter,
        "generated_kolibri10_direction",
        kolibri,
        generated::kolibri10_direction::evaluate,
    );
    generated(
        counter,
        "generated_document_40_tables",
        document,
        generated::document40::evaluate,
    );
}

/// The alternatives without tables for the Huron.
fn all_rivals(counter: &mut Counter, huron: &Usual) {
    rival(
        counter,
        "rival_closed_form_libm",
        huron,
        closed_form::with_libm,
    );
    rival(
        counter,
        "rival_closed_form_micromath",
        huron,
        closed_form::with_micromath,
    );
    let direct = Direct::new();
    rival(counter, "rival_htm_nalgebra", huron, |q| {
        direct.correction(q)
    });
    let Ok(machine) = exact::machine() else {
        fail("the machine is none")
    };
    let errors = exact::errors(&machine);
    let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Orientation);
    rival(counter, "rival_exact_correction", huron, |q| {
        exact::correction(&kinematics, q)
    });
}

/// Servo updates with temperatures.
fn warm_servos(
    counter: &mut Counter,
    places: &'static mut [Tight; 3],
    counts: &mut [u32; UPDATES],
) {
    let keys = [
        "servo_thermal_none",
        "servo_thermal_2",
        "servo_thermal_2_lag",
    ];
    for ((key, place), blob) in keys.into_iter().zip(places).zip(THERMAL) {
        let c = load(place, &blob.0);
        let path = Path::new(c);
        let mut servo = Servo::new(c);
        let first = let_in(&mut servo, &path, 0);
        updates(counter, key, &mut servo, &path, first, counts);
    }
}

#[entry]
fn main() -> ! {
    static mut HURON_USUAL: Usual = Usual::empty();
    static mut HURON_AGAIN: Usual = Usual::empty();
    static mut HURON_TIGHT: Tight = Tight::empty();
    static mut DIRECTION: Usual = Usual::empty();
    static mut KOLIBRI: Usual = Usual::empty();
    static mut TIGHT_AGAIN: Tight = Tight::empty();
    static mut CUBE: Usual = Usual::empty();
    static mut LAYOUT: Usual = Usual::empty();
    static mut CHAINS: Usual = Usual::empty();
    static mut WEIGHTED: Usual = Usual::empty();
    static mut BANKS: [Tight; 4] = [const { Tight::empty() }; 4];
    static mut WARM: [Tight; 3] = [const { Tight::empty() }; 3];
    static mut COUNTS: [u32; UPDATES] = [0; UPDATES];

    let Some(peripherals) = cortex_m::Peripherals::take() else {
        fail("no peripherals")
    };
    let counter = &mut Counter::new(peripherals.SYST);
    if !counter.is_right() {
        fail("ten instructions are not counted as ten: is -icount shift=10 set?");
    }

    let huron = load(HURON_USUAL, &HURON.0);
    let tight = load(HURON_TIGHT, &HURON.0);
    evaluate(counter, "evaluate_huron13", huron);
    evaluate(counter, "evaluate_huron13_5_axes", tight);
    let direction = load(DIRECTION, &HURON_DIRECTION.0);
    evaluate(counter, "evaluate_huron13_direction", direction);
    let kolibri = load(KOLIBRI, &KOLIBRI_DIRECTION.0);
    evaluate(counter, "evaluate_kolibri10_direction", kolibri);
    evaluate(counter, "grid25_3out", load(CUBE, &GRID.0));
    let document = load(LAYOUT, &DOCUMENT.0);
    evaluate(counter, "document_40_tables", document);
    let [fixed, weighted] = FIK;
    evaluate(counter, "fik_huron13", load(CHAINS, &fixed.0));
    evaluate(
        counter,
        "fik_huron13_5_weights",
        load(WEIGHTED, &weighted.0),
    );
    evaluate_banks(counter, BANKS);
    all_generated(counter, [huron, direction, kolibri, document]);
    all_rivals(counter, huron);
    let keys = [
        "servo_update_huron13",
        "servo_long_huron13",
        "servo_fade_huron13",
    ];
    let both = [huron, load(HURON_AGAIN, &HURON.0)];
    servo(counter, keys, both, COUNTS);
    let keys = [
        "servo_update_huron13_5_axes",
        "servo_long_huron13_5_axes",
        "servo_fade_huron13_5_axes",
    ];
    let both = [tight, load(TIGHT_AGAIN, &HURON.0)];
    servo(counter, keys, both, COUNTS);
    warm_servos(counter, WARM, COUNTS);
    println!("done 1");
    process::exit(0)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    println!("failed {info}");
    process::exit(1)
}
