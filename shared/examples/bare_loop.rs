//! A bare loop with two compensations that are reloaded alternately while it runs: `cargo run -p trueaxis --example
//! bare_loop`.
//!
//! Here the blob is part of the program; in a controller that receives new tables it is in flash.

use trueaxis::{Compensation, Inputs, LoadError, Servo, capacities, include_blob};

/// Capacities for five axes and the tables of this machine.
type Room = capacities!(axes: 5, banks: 8, tables: 32, terms: 64, grids: 1);
type Tables = Compensation<'static, Room>;

static BLOB: &[u8] = include_blob!("huron-13.trax");
/// All five axes.
const REFERENCED: u16 = 0b1_1111;
/// Servo period, s.
const PERIOD: f32 = 0.001;
/// Number of servo periods between two changes of the tables.
const CHANGE: u16 = 2000;

fn main() -> Result<(), LoadError> {
    // On a controller these would be statics.
    let place: &'static mut Tables = Box::leak(Box::new(Tables::empty()));
    place.load(BLOB)?;
    let mut servo = Servo::new(place);
    let mut vacant: Option<&'static mut Tables> = Some(Box::leak(Box::new(Tables::empty())));
    servo.enable();
    for period in 0..6000_u16 {
        // The uncorrected commands: Y, A, C, X, Z; mm and degrees.
        let y = f32::from(period) * 0.02;
        let commands = Inputs::at([y, 30.0, 45.0, -50.0, -120.0]);
        let correction = *servo.advance(&commands, REFERENCED, PERIOD);
        let to_drive = f64::from(y) + f64::from(correction.dq[0]);
        if period % CHANGE == CHANGE - 1
            && let Some(place) = vacant.take()
        {
            place.load(BLOB)?;
            match servo.swap(place) {
                Ok(_) => println!("other tables are being faded in"),
                Err(refused) => println!("not changed: {refused}"),
            }
        }
        if let Some(place) = servo.take_retired() {
            println!("a place is vacant");
            vacant = Some(place);
        }
        if period % 1000 == 999 {
            // The correction's share of the velocity goes to the drives' feed-forward.
            let velocity = 20.0 + servo.velocity()[0];
            let conditions = correction.status.conditions;
            println!("Y {y:.2} to {to_drive:.5} at {velocity:.5} mm/s {conditions:?}");
        }
    }
    Ok(())
}
