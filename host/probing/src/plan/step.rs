//! One step of a plan on a machine.

/// Positions of some axes (mm, deg), in the order X Y Z A B C U V W, by their index in the machine.
pub type AxisTargets = Vec<(usize, f64)>;

/// A move, or what precedes one.
#[derive(Clone, Debug, PartialEq)]
pub enum ProbingStep {
    /// What follows belongs to this row of the plan, counted from 0.
    Row(usize),
    /// Turn the spindle to this angle (deg).
    Orient(f64),
    /// A rapid move, clear of everything.
    Rapid(AxisTargets),
    /// A move near a ball.
    Near(AxisTargets),
    /// A move towards a ball, until there is contact.
    Touch {
        /// Number of the touch in its row, from 0.
        number: usize,
        /// Where it begins: where the last step ended.
        begin: AxisTargets,
        /// Where it ends if there is no contact.
        end: AxisTargets,
    },
}
