//! Only the runtime, as linked into a controller: to measure its size, and to determine what the servo path can reach.
//! It is linked, not run.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m as _;
use cortex_m_rt::entry;
use trueaxis::{Compensation, Correction, Inputs, Servo, Travel, Travelling, Weights};

/// Entry points from which `cargo xtask bench-target` walks the call graph.
mod servo_path {
    use super::*;

    #[inline(never)]
    pub fn evaluate(
        c: &Compensation<'_>,
        inputs: &Inputs<[f32; 8]>,
        travel: &Travelling<[Travel; 8]>,
        weights: &Weights,
    ) -> [f32; 8] {
        c.evaluate(inputs, travel, weights)
    }

    #[inline(never)]
    pub fn update(
        servo: &mut Servo<&Compensation<'_>>,
        inputs: &Inputs<[f32; 8]>,
        referenced: u16,
        dt: f32,
    ) -> Correction<[f32; 8]> {
        servo.update(inputs, referenced, dt)
    }
}

#[entry]
fn main() -> ! {
    static mut FIRST: Compensation<'static> = Compensation::empty();
    static mut SECOND: Compensation<'static> = Compensation::empty();

    // The slots are opaque to the compiler, so that nothing is optimised away.
    black_box(FIRST.load_slot(black_box(&[])).is_ok());
    black_box(SECOND.load_slot(black_box(&[])).is_ok());
    let mut servo = Servo::new(&*FIRST);
    let (travel, weights) = (Travelling::default(), FIRST.weights());
    loop {
        let inputs = black_box(Inputs::default());
        if black_box(true) {
            servo.enable();
        } else {
            servo.disable();
        }
        servo.dry_run(black_box(false));
        black_box(servo.swap(SECOND).is_ok());
        black_box(servo.set_weight(black_box(0), black_box(0.0)).is_ok());
        black_box(servo_path::update(
            &mut servo,
            &inputs,
            black_box(0),
            black_box(0.001),
        ));
        black_box(servo_path::evaluate(FIRST, &inputs, &travel, &weights));
        black_box((servo.factor(), servo.is_swapping(), servo.travelling()));
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        cortex_m::asm::nop();
    }
}
