//! A generated compensation and a servo, without a blob, a heap or an operating system.
//!
//! `trueaxis generate huron-13.trax --servo -o huron_13.rs` wrote the module.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
use semihosting::{println, process};
use trueaxis::{Compensation, Generated, Inputs, Servo, capacities};

#[path = "../../../../shared/examples/generated/huron_13.rs"]
mod huron_13;

/// As for the blob: the description is loaded, the samples are in the code.
type Room = capacities!(axes: 5, banks: 4, tables: 4, terms: 14, grids: 0);

#[entry]
fn main() -> ! {
    static mut FACTS: Compensation<'static, Room> = Compensation::<Room>::empty();

    if let Err(error) = FACTS.load(&huron_13::FACTS.0) {
        println!("{error}");
        process::exit(1)
    }
    let code = match Generated::new(&*FACTS, huron_13::corrections, huron_13::check) {
        Ok(code) => code,
        Err(error) => {
            println!("{error}");
            process::exit(1)
        }
    };
    let mut servo = Servo::new(code);
    servo.enable();
    let position = Inputs::at([100.0, 30.0, 45.0, -50.0, -120.0]); // Y, A, C, X, Z: see the code
    let mut correction = [0.0; 5];
    for _ in 0..4000 {
        // In every servo period, here 1 ms, with all five axes referenced.
        correction = servo.update(&position, 0b1_1111, 0.001).dq;
    }
    for (position, correction) in position.axes.iter().zip(correction) {
        println!("{:.6}", position + correction); // To the drive.
    }
    process::exit(0)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    println!("{info}");
    process::exit(1)
}
