//! What corrections leave.

use crate::task::Task;
use nalgebra::Vector3;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;
use trueaxis_model::validate::{Command, direction};

/// What is left at one position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Left {
    /// Error of the tip (mm).
    pub tip: f64,
    /// Error of the tool direction (rad).
    pub direction: f64,
}

/// What corrections (mm, rad) leave at each position of a machine with errors `errors_at`, which may change from
/// position to position.
///
/// A workpiece is set up anew at the beginning of each cycle of a machine that warms up: the mean error of the tip at
/// that time is subtracted in the whole cycle.
pub fn left<'a>(
    task: &Task,
    commands: &[Command],
    errors_at: impl Fn(usize) -> &'a ErrorModel,
    corrections: &[PerAxis],
) -> Vec<Left> {
    let machine = &task.machine;
    let each = commands.iter().zip(corrections).enumerate();
    let mut found: Vec<(Vector3<f64>, f64)> = each
        .map(|(i, (command, dq))| {
            let (q, situation) = command.kinematic(machine);
            let kinematics = Kinematics::new(machine, errors_at(i));
            let error = kinematics.volumetric_error(&q, dq, &situation);
            (error.t, direction(machine, &error))
        })
        .collect();
    for cycle in task.cycles() {
        let sum: Vector3<f64> = cycle.start.iter().map(|i| found[*i].0).sum();
        let mean = sum / cycle.start.len().max(1) as f64;
        for i in cycle.all {
            found[i].0 -= mean;
        }
    }
    let each = found.into_iter().map(|(tip, direction)| Left {
        tip: tip.norm(),
        direction,
    });
    each.collect()
}
