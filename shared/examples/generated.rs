//! A servo whose corrections come from generated code, not from a blob.
//!
//! `trueaxis generate shared/examples/huron-13.trax --servo -o shared/examples/generated/huron_13.rs` wrote the code.
use std::error::Error;
use trueaxis::{Compensation, Generated, Inputs, Servo, capacities};

#[path = "generated/huron_13.rs"]
mod huron_13;

/// As for the blob: the description is loaded, the samples are in the code.
type Room = capacities!(axes: 5, banks: 4, tables: 4, terms: 14, grids: 0);

fn main() -> Result<(), Box<dyn Error>> {
    let mut facts = Compensation::<'_, Room>::empty(); // On a controller a static.
    facts.load(&huron_13::FACTS.0)?;
    let mut servo = Servo::new(Generated::new(
        &facts,
        huron_13::corrections,
        huron_13::check,
    )?);
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
    Ok(())
}
