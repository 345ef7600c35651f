//! Counts the instructions of an update through the C interface, with doubles, with floats and with generated code, and
//! of the Rust servo for the same positions, on a Cortex-M4F in QEMU; and the memory of its objects. Prints one `key value` per line for
//! `cargo xtask capi target`.
#![no_std]
#![no_main]

mod counter;
#[path = "../../../../../shared/examples/generated/huron_13.rs"]
mod huron_13;
#[allow(dead_code, reason = "this program needs no random positions")]
mod path;

use core::ffi::c_int;
use core::hint::black_box;
use core::mem::MaybeUninit;
use core::ptr::null_mut;

use cortex_m_rt::entry;
use counter::{Counter, Spread};
use path::Path;
use semihosting::{println, process};
use trueaxis::{Compensation, Servo};
use trueaxis_capi::border::{
    trueaxis_servo_enable, trueaxis_servo_new, trueaxis_servo_size, trueaxis_servo_update,
    trueaxis_servo_update_f32, trueaxis_tables_load, trueaxis_tables_load_generated,
    trueaxis_tables_new, trueaxis_tables_size,
};
use trueaxis_capi::{Code, Generated, Room, ServoMemory, TRUEAXIS_HEADER, TablesMemory};

/// Bytes aligned to 4.
#[repr(C, align(4))]
struct Aligned<B: ?Sized>(B);

static BLOB: &Aligned<[u8]> = &Aligned(*include_bytes!(
    "../../../../../tests/golden/v1/huron-13.trax"
));
/// Number of updates until the corrections are fully in.
const BEFORE: usize = 4096;
/// Number of measured updates, with several reversals of every axis.
const UPDATES: usize = 4096;
/// Servo period, s.
const PERIOD: f32 = 0.001;
const AXES: usize = 5;

/// Ends the run with a message.
fn fail(what: &str) -> ! {
    println!("failed {what}");
    process::exit(1)
}

fn must(code: Code) {
    if code != Code::Ok {
        println!("failed {code:?}");
        process::exit(1)
    }
}

/// The compensation as generated code that C calls.
static CODE: Code13 = Code13(Generated {
    facts: (&raw const huron_13::FACTS.0).cast(),
    size: huron_13::FACTS.0.len(),
    evaluate: Some(evaluate),
    check: Some(check),
    bytes: BLOB.0.len() as u32,
    checksum: huron_13::CHECKSUM,
});

struct Code13(Generated);

// SAFETY: it points to constants.
unsafe impl Sync for Code13 {}

unsafe extern "C" fn evaluate(
    positions: *const f32,
    _: *const f32,
    _: *const i8,
    _: *const f32,
    corrections: *mut f32,
) {
    // SAFETY: the servo has one value for each axis of the facts.
    unsafe { *corrections.cast() = huron_13::evaluate(&*positions.cast()) }
}

unsafe extern "C" fn check() -> c_int {
    huron_13::check().into()
}

/// Memory of a servo, and of its tables.
struct Memory {
    tables: MaybeUninit<TablesMemory>,
    servo: MaybeUninit<ServoMemory>,
}

impl Memory {
    const NEW: Self = Self {
        tables: MaybeUninit::uninit(),
        servo: MaybeUninit::uninit(),
    };

    /// A servo in this memory, enabled, with tables or with generated code.
    fn servo(&'static mut self, is_generated: bool) -> *mut trueaxis_capi::Servo {
        let (mut tables, mut servo) = (null_mut(), null_mut());
        // SAFETY: the memory stays in place, and nothing else uses it.
        unsafe {
            let (place, size) = (self.tables.as_mut_ptr(), size_of::<TablesMemory>());
            must(trueaxis_tables_new(
                TRUEAXIS_HEADER,
                place.cast(),
                size,
                &mut tables,
            ));
            let (blob, length) = (BLOB.0.as_ptr(), BLOB.0.len());
            must(match is_generated {
                true => trueaxis_tables_load_generated(tables, &CODE.0),
                false => trueaxis_tables_load(tables, blob.cast(), length),
            });
            let (place, size) = (self.servo.as_mut_ptr(), size_of::<ServoMemory>());
            must(trueaxis_servo_new(place.cast(), size, tables, &mut servo));
            must(trueaxis_servo_enable(servo, 1));
        }
        servo
    }
}

/// Measures one way of updating, which must give the same corrections as the others.
fn measure(
    counter: &mut Counter,
    key: &str,
    path: &Path,
    counts: &mut [u32; UPDATES],
    mut update: impl FnMut(&[f32; 8], &mut dyn FnMut(&mut dyn FnMut())) -> [f32; AXES],
) -> f32 {
    let mut sum = 0.0;
    for period in 0..BEFORE + UPDATES {
        let q = path.smooth(period);
        let mut count = 0;
        let dq = update(&q, &mut |call| count = counter.instructions(call));
        if let Some(place) = period.checked_sub(BEFORE) {
            counts[place] = count;
            sum += dq.iter().map(|dq| dq.abs()).sum::<f32>();
        }
    }
    let spread = Spread::of(counts);
    println!("{key} {}", spread.typical);
    println!("{key}_min {}", spread.least);
    println!("{key}_max {}", spread.most);
    sum
}

#[entry]
fn main() -> ! {
    static mut TABLES: Compensation<'static, Room> = Compensation::<Room>::empty();
    static mut DOUBLE: Memory = Memory::NEW;
    static mut SINGLE: Memory = Memory::NEW;
    static mut GENERATED: Memory = Memory::NEW;
    static mut COUNTS: [u32; UPDATES] = [0; UPDATES];

    let Some(peripherals) = cortex_m::Peripherals::take() else {
        fail("no peripherals")
    };
    let counter = &mut Counter::new(peripherals.SYST);
    if !counter.is_right() {
        fail("ten instructions are not counted as ten: is -icount shift=10 set?");
    }
    if TABLES.load(&BLOB.0).is_err() || TABLES.axes().len() != AXES {
        fail("the tables are not taken");
    }
    let path = Path::new(TABLES);
    let mut servo = Servo::new(&*TABLES);
    servo.enable();
    let rust = measure(counter, "rust", &path, COUNTS, |q, count| {
        let inputs = path::inputs(*q);
        count(&mut || {
            black_box(servo.advance(&inputs, black_box(u16::MAX), black_box(PERIOD)));
        });
        core::array::from_fn(|k| servo.correction().dq[k])
    });
    // Called as from C: not inlined.
    let (double, single) = (DOUBLE.servo(false), SINGLE.servo(false));
    let generated = GENERATED.servo(true);
    type Update<F> =
        unsafe extern "C" fn(*mut trueaxis_capi::Servo, *const F, usize, u32, F, *mut F) -> Code;
    let update = black_box(trueaxis_servo_update_f32 as Update<f32>);
    let [floats, code] = [("f32", single), ("generated", generated)].map(|(key, servo)| {
        measure(counter, key, &path, COUNTS, |q, count| {
            let mut dq = [0.0; AXES];
            let to = dq.as_mut_ptr();
            // SAFETY: the servo exists, and the arrays have this many values.
            count(&mut || must(unsafe { update(servo, q.as_ptr(), AXES, 0xFFFF, PERIOD, to) }));
            dq
        })
    });
    let update = black_box(trueaxis_servo_update as Update<f64>);
    let doubles = measure(counter, "f64", &path, COUNTS, |q, count| {
        let (q, mut dq) = (q.map(f64::from), [0.0; AXES]);
        let (to, period) = (dq.as_mut_ptr(), f64::from(PERIOD));
        // SAFETY: the servo exists, and the arrays have this many values.
        count(&mut || must(unsafe { update(double, q.as_ptr(), AXES, 0xFFFF, period, to) }));
        dq.map(|dq: f64| dq as f32)
    });
    let others = [floats, code, doubles];
    if rust < 1.0 || others.iter().any(|sum| sum.to_bits() != rust.to_bits()) {
        fail("the corrections differ, or there are none");
    }
    println!("tables_memory {}", size_of::<TablesMemory>());
    println!("servo_memory {}", size_of::<ServoMemory>());
    println!("tables_size {}", trueaxis_tables_size());
    println!("servo_size {}", trueaxis_servo_size());
    println!("done 1");
    process::exit(0)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    println!("failed {info}");
    process::exit(1)
}
