//! The smallest controller: tables, a servo, one correction after the other.
use trueaxis::{Compensation, Inputs, LoadError, Servo, capacities, include_blob};

/// `trueaxis inspect` prints the capacities that a blob needs.
type Room = capacities!(axes: 5, banks: 4, tables: 16, terms: 14, grids: 0);

fn main() -> Result<(), LoadError> {
    let mut tables = Compensation::<'_, Room>::empty(); // On a controller a static.
    tables.load(include_blob!("huron-13.trax"))?;
    let mut servo = Servo::new(&tables);
    servo.enable();
    let position = Inputs::at([100.0, 30.0, 45.0, -50.0, -120.0]); // Y, A, C, X, Z: see the blob
    let mut correction = [0.0; 5];
    for _ in 0..4000 {
        // In every servo period, here 1 ms, with all five axes referenced.
        correction = servo.update(&position, 0b1_1111, 0.001).dq;
    }
    for (position, correction) in position.axes.iter().zip(correction) {
        println!("{:.6}", position + correction); // To the drive.
    }
    Ok(())
}
