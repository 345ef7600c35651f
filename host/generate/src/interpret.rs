//! Computes the program from the same tree that is printed.

use crate::program::{Local, Operation, Program, Statement, Value};
use trueaxis::Travel;

/// A program with room for its locals.
pub struct Machine<'p> {
    program: &'p Program,
    floats: Vec<f32>,
    indices: Vec<usize>,
}

/// What a call is given.
pub struct Given<'g> {
    pub inputs: &'g [f32],
    pub travel: &'g [Travel],
    pub weights: &'g [f32],
}

impl<'p> Machine<'p> {
    pub fn new(program: &'p Program) -> Self {
        let count = program.locals.len();
        Self {
            program,
            floats: vec![0.0; count],
            indices: vec![0; count],
        }
    }

    /// The corrections of all axes.
    pub fn run(&mut self, given: &Given<'_>, corrections: &mut [f32]) {
        for statement in &self.program.statements {
            match statement {
                Statement::Comment(_) => {}
                Statement::Let(local, value) => self.floats[local.0] = self.value(value, given),
                Statement::Held {
                    index,
                    fraction,
                    steps,
                    intervals,
                } => {
                    let steps = self.value(steps, given);
                    let end = *intervals as f32;
                    let steps = if steps > 0.0 { steps } else { 0.0 };
                    self.set(*index, *fraction, if steps < end { steps } else { end });
                }
                Statement::Circular {
                    index,
                    fraction,
                    steps,
                    points,
                } => {
                    let steps = self.value(steps, given);
                    let steps = if steps > 0.0 { steps } else { 0.0 };
                    self.set(
                        *index,
                        *fraction,
                        if steps < *points as f32 { steps } else { 0.0 },
                    );
                }
                Statement::Next {
                    index,
                    of,
                    last,
                    wraps,
                } => {
                    let of = self.indices[of.0];
                    self.indices[index.0] = match (of < *last as usize, wraps) {
                        (true, _) => of + 1,
                        (false, true) => 0,
                        (false, false) => *last as usize,
                    };
                }
                Statement::Correction(axis, value) => corrections[*axis] = self.value(value, given),
            }
        }
    }

    fn set(&mut self, index: Local, fraction: Local, steps: f32) {
        self.indices[index.0] = steps as usize;
        self.floats[fraction.0] = steps - (steps as usize) as f32;
    }

    fn value(&self, value: &Value, given: &Given<'_>) -> f32 {
        match value {
            Value::Input(k) => given.inputs[*k],
            Value::Weight(k) => given.weights[*k],
            Value::Number(number) => *number,
            Value::Local(local) => self.floats[local.0],
            Value::Sample(array, at, column) => {
                let array = &self.program.arrays[*array];
                let along = at.iter().zip(&array.points);
                let point = along.fold(0, |point, ((index, offset), points)| {
                    let index = self.indices[index.0] + offset;
                    assert!(index < *points, "{}: index {index} of {points}", array.name);
                    point * points + index
                });
                array.samples.value(point * array.columns + column)
            }
            Value::Binary(operation, a, b) => {
                let (a, b) = (self.value(a, given), self.value(b, given));
                match operation {
                    Operation::Add => a + b,
                    Operation::Subtract => a - b,
                    Operation::Multiply => a * b,
                }
            }
            Value::Negated(value) => -self.value(value, given),
            Value::Reduced(value, period, inverse) => {
                const MOST: f32 = 4_194_304.0;
                let d = self.value(value, given);
                let p = d * inverse;
                let p = if p < MOST { p } else { MOST };
                let p = if p > -MOST { p } else { -MOST };
                d - p.floor() * period
            }
            Value::Line(steps, [first, change, last]) => {
                let steps = self.value(steps, given);
                if (0.0..1.0).contains(&steps) {
                    first + change * steps
                } else {
                    if steps > 0.0 { *last } else { *first }
                }
            }
            Value::ByTravel(axis, positive, negative) => match given.travel[*axis] {
                Travel::Positive => self.value(positive, given),
                Travel::Negative => self.value(negative, given),
                Travel::Unknown => 0.0,
            },
        }
    }
}
