//! A bare loop with two compensations, one after the other: `cargo run -p trueaxis --example bare_loop`.
//!
//! The blob is part of the program; in a controller that is given new tables it lies in flash.

use trueaxis::{Compensation, Inputs, Servo, include_blob};

/// Axes of this machine, and room for the tables of one compensation.
type Tables<'a> = Compensation<'a, 5, 32, 64, 1>;

static BLOB: &[u8] = include_blob!("huron-13.trax");
/// All five axes.
const REFERENCED: u16 = 0b1_1111;
/// Servo period, s.
const PERIOD: f32 = 0.001;

fn main() {
    let (mut first, mut second) = (Tables::empty(), Tables::empty());
    for tables in [&mut first, &mut second] {
        if let Err(error) = tables.load(BLOB) {
            println!("not corrected: {error}");
            return;
        }
    }
    let mut servo = Servo::new(&first);
    servo.enable();
    for period in 0..6000_u16 {
        // The commands before any correction: Y, A, C, X, Z; mm and degrees.
        let y = f32::from(period) * 0.02;
        let commands = Inputs::at([y, 30.0, 45.0, -50.0, -120.0]);
        let correction = *servo.advance(&commands, REFERENCED, PERIOD);
        let to_drive = f64::from(y) + f64::from(correction.dq[0]);
        if period == 2000 {
            match servo.swap(&second) {
                Ok(()) => println!("the other tables are being faded in"),
                Err(refused) => println!("not changed: {refused}"),
            }
        }
        if period % 1000 == 999 {
            // The drives' feed-forward gets what the correction adds to the velocity.
            let velocity = 20.0 + servo.velocity()[0];
            let conditions = correction.status.conditions;
            println!("Y {y:.2} to {to_drive:.5} at {velocity:.5} mm/s {conditions:?}");
        }
    }
    assert!(std::ptr::eq(servo.compensation(), &second));
}
