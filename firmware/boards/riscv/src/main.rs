//! The runtime alone on RISC-V with hardware floats: what it computes goes to a file, whose bits are
//! compared (`cargo xtask hil`).
//!
//! In the working directory of QEMU, through semihosting:
//!
//! | file | what |
//! |---|---|
//! | `blob.trax` | the compensation |
//! | `work.bin` | rows to be evaluated, then a servo's: see [`work`] |
//! | `results.bin` | the corrections of the first; what each servo update gave |
#![no_std]
#![no_main]
#![deny(unsafe_code)]

use core::ffi::CStr;

use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::{eprintln, process};
use static_cell::ConstStaticCell;
use trueaxis::link::{EvaluateRow, MotionResult, positions, put_positions};
use trueaxis::{Compensation, Inputs, Servo};

/// At the alignment that a compensation is read at.
#[repr(align(32))]
struct Blob([u8; 512 * 1024]);

static BLOB: ConstStaticCell<Blob> = ConstStaticCell::new(Blob([0; 512 * 1024]));
static WORK: ConstStaticCell<[u8; 1024 * 1024]> = ConstStaticCell::new([0; 1024 * 1024]);
static COMPENSATION: ConstStaticCell<Compensation<'static>> =
    ConstStaticCell::new(Compensation::empty());

#[riscv_rt::entry]
fn main() -> ! {
    let compensation = COMPENSATION.take();
    let blob = read(c"blob.trax", &mut BLOB.take().0);
    if let Err(error) = compensation.load(blob) {
        stop(&error);
    }
    let Ok(mut results) = File::create(c"results.bin") else {
        stop(&"results.bin cannot be written")
    };
    if work(compensation, read(c"work.bin", WORK.take()), &mut results).is_none() {
        stop(&"work.bin ends too early, or results.bin cannot be written");
    }
    process::exit(0)
}

/// Little-endian: the number of rows to be evaluated and those rows; then a servo's period, s, its
/// auxiliary inputs, the number of its commands and those. A servo that is enabled and referenced.
fn work(compensation: &Compensation<'_>, bytes: &[u8], results: &mut File) -> Option<()> {
    let axes = compensation.axes().len();
    let auxiliaries = compensation.auxiliaries().len();
    let mut out = [0; 256];
    let (rows, mut rest) = number(bytes)?;
    let weights = compensation.weights();
    for _ in 0..rows {
        let (row, after) = EvaluateRow::<[f32; 8], _>::get(rest, axes, auxiliaries)?;
        rest = after;
        let dq = compensation.evaluate(&row.inputs, &row.travelling, &weights);
        put_positions(&dq, axes, &mut out)?;
        results.write_all(out.get(..4 * axes)?).ok()?;
    }
    let ([period], rest) = positions::<[f32; 1]>(rest, 1)?;
    let (values, rest) = positions(rest, auxiliaries)?;
    let (commands, mut rest) = number(rest)?;
    let mut servo = Servo::new(compensation);
    servo.enable();
    for _ in 0..commands {
        let (axes_now, after) = positions::<[f32; 8]>(rest, axes)?;
        rest = after;
        let mut inputs = Inputs::at(axes_now);
        inputs.auxiliaries = values;
        let correction = servo.update(&inputs, u16::MAX, period);
        MotionResult(correction).put(axes, &mut out)?;
        results
            .write_all(out.get(..MotionResult::bytes(axes))?)
            .ok()?;
    }
    rest.is_empty().then_some(())
}

fn number(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (number, rest) = bytes.split_first_chunk()?;
    Some((u32::from_le_bytes(*number), rest))
}

/// The whole of a file.
fn read<'b>(name: &CStr, room: &'b mut [u8]) -> &'b [u8] {
    let Ok(mut file) = File::open(name) else {
        stop(&"a file is missing")
    };
    let mut length = 0;
    while let Some(free) = room.get_mut(length..).filter(|free| !free.is_empty()) {
        match file.read(free) {
            Ok(0) => break,
            Ok(count) => length += count,
            Err(_) => stop(&"a file cannot be read"),
        }
    }
    if length == room.len() {
        stop(&"a file is too long");
    }
    room.get(..length).unwrap_or(&[])
}

fn stop(why: &dyn core::fmt::Display) -> ! {
    eprintln!("{why}");
    process::exit(1)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    eprintln!("{info}");
    process::exit(101)
}
