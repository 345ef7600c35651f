//! Computes the program from the same tree that is printed.

use crate::program::{Array, Local, Operation, Program, Statement, Value};
// `f32::mul_add` calls the C library, and that of Windows (MinGW) rounds twice.
use libm::fmaf as fused;
use trueaxis::Travel;

/// A program with room for its locals.
pub struct Machine<'p> {
    program: &'p Program,
    floats: Vec<f32>,
    indices: Vec<usize>,
    /// The value of each local that is one.
    definitions: Vec<Option<&'p Value>>,
    /// What a wrong compiler does, if the machine is to do that.
    pub liberty: Option<Liberty>,
}

/// An operand of an operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Left,
    Right,
}

/// Something that no compiler may do, because it rounds once instead of twice or in another order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Liberty {
    /// Fuses a product, which is this operand of the value, with what is added to it.
    Fused(*const Value, Side),
    /// Adds or multiplies in another order: this operand of the value is itself a sum or a product.
    Regrouped(*const Value, Side),
    /// Fuses the product of a distance and the inverse of a step with what is subtracted from it.
    FusedFraction(*const Value),
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
        let mut definitions = vec![None; count];
        for statement in &program.statements {
            if let Statement::Let(local, value) = statement {
                definitions[local.0] = Some(value);
            }
        }
        Self {
            program,
            floats: vec![0.0; count],
            indices: vec![0; count],
            definitions,
            liberty: None,
        }
    }

    /// Everything that a compiler might do wrong.
    pub fn liberties(&self) -> Vec<Liberty> {
        let mut all = Vec::new();
        for statement in &self.program.statements {
            match statement {
                Statement::Let(_, value) | Statement::Correction(_, value) => {
                    self.add_liberties(value, &mut all);
                }
                Statement::Interval { steps, .. } => {
                    self.add_liberties(steps, &mut all);
                    if self.product(steps).is_some() {
                        all.push(Liberty::FusedFraction(steps));
                    }
                }
                Statement::Next { .. } | Statement::Comment(_) => {}
            }
        }
        all
    }

    fn add_liberties(&self, value: &Value, all: &mut Vec<Liberty>) {
        match value {
            Value::Binary(operation, a, b) => {
                for (operand, side) in [(a, Side::Left), (b, Side::Right)] {
                    self.add_liberties(operand, all);
                    let is_sum = *operation != Operation::Multiply;
                    let is_product = self.product(operand).is_some();
                    if is_sum && is_product {
                        all.push(Liberty::Fused(value, side));
                    } else if is_product || (is_sum && self.sum(operand).is_some()) {
                        all.push(Liberty::Regrouped(value, side));
                    }
                }
            }
            Value::Negated(inner) => self.add_liberties(inner, all),
            Value::Reduced(inner, ..) | Value::Line(inner, _) => {
                self.add_liberties(inner, all);
                all.push(Liberty::Fused(value, Side::Right));
            }
            Value::ByTravel(_, positive, negative) => {
                self.add_liberties(positive, all);
                self.add_liberties(negative, all);
            }
            Value::Input(_)
            | Value::Weight(_)
            | Value::Number(_)
            | Value::Local(_)
            | Value::Sample(..) => {}
        }
    }

    /// The value that a local stands for.
    fn resolved<'v>(&self, value: &'v Value) -> &'v Value
    where
        'p: 'v,
    {
        match value {
            Value::Local(local) => self.definitions[local.0].map_or(value, |of| self.resolved(of)),
            _ => value,
        }
    }

    /// The factors of a product.
    fn product<'v>(&self, value: &'v Value) -> Option<(&'v Value, &'v Value)>
    where
        'p: 'v,
    {
        match self.resolved(value) {
            Value::Binary(Operation::Multiply, a, b) => Some((a, b)),
            _ => None,
        }
    }

    /// The terms of a sum, and the sign of the second.
    fn sum<'v>(&self, value: &'v Value) -> Option<(&'v Value, &'v Value, f32)>
    where
        'p: 'v,
    {
        match self.resolved(value) {
            Value::Binary(Operation::Add, a, b) => Some((a, b, 1.0)),
            Value::Binary(Operation::Subtract, a, b) => Some((a, b, -1.0)),
            _ => None,
        }
    }

    /// The result of an operation where the machine takes its liberty, if it does.
    fn taken(&self, value: &Value, given: &Given<'_>) -> Option<f32> {
        let liberty = self.liberty?;
        let (Liberty::Fused(at, side) | Liberty::Regrouped(at, side)) = liberty else {
            return None;
        };
        let Value::Binary(operation, a, b) = value else {
            return None;
        };
        if !std::ptr::eq(at, value) {
            return None;
        }
        let (inner, outer) = match side {
            Side::Left => (a, b),
            Side::Right => (b, a),
        };
        let outer = self.value(outer, given);
        // The signs of both operands in the result.
        let (of_inner, of_outer) = match (operation, side) {
            (Operation::Subtract, Side::Left) => (1.0, -1.0),
            (Operation::Subtract, Side::Right) => (-1.0, 1.0),
            _ => (1.0, 1.0),
        };
        if let Some((x, y)) = self.product(inner) {
            let (x, y) = (self.value(x, given), self.value(y, given));
            return Some(match liberty {
                Liberty::Fused(..) => fused(of_inner * x, y, of_outer * outer),
                _ => x * (y * outer),
            });
        }
        let (x, y, sign) = self.sum(inner)?;
        let (x, y) = (self.value(x, given), self.value(y, given));
        Some(of_inner * x + (of_inner * sign * y + of_outer * outer))
    }

    fn is_fused(&self, value: &Value) -> bool {
        matches!(self.liberty, Some(Liberty::Fused(at, _)) if std::ptr::eq(at, value))
    }

    /// The corrections of all axes.
    pub fn run(&mut self, given: &Given<'_>, corrections: &mut [f32]) {
        for statement in &self.program.statements {
            match statement {
                Statement::Comment(_) => {}
                Statement::Let(local, value) => self.floats[local.0] = self.value(value, given),
                Statement::Interval {
                    index,
                    fraction,
                    steps,
                    count,
                    is_circular,
                } => {
                    let end = *count as f32;
                    let beyond = if *is_circular { 0.0 } else { end };
                    self.count([*index, *fraction], steps, [end, beyond], given);
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

    /// Sets an index and a fraction to the steps from the first point: 0 before it, and `beyond` from the end on.
    fn count(
        &mut self,
        [index, fraction]: [Local; 2],
        steps: &Value,
        [end, beyond]: [f32; 2],
        given: &Given<'_>,
    ) {
        let number = self.value(steps, given);
        let counted = if number > 0.0 { number } else { 0.0 };
        let counted = if counted < end { counted } else { beyond };
        self.indices[index.0] = counted as usize;
        self.floats[fraction.0] = counted - (counted as usize) as f32;
        self.fuse(index, fraction, steps, given);
    }

    /// Computes the fraction from the distance, if that is the liberty. Within a table only.
    fn fuse(&mut self, index: Local, fraction: Local, steps: &Value, given: &Given<'_>) {
        let is_taken =
            matches!(self.liberty, Some(Liberty::FusedFraction(at)) if std::ptr::eq(at, steps));
        if let Some((x, y)) = self.product(steps).filter(|_| is_taken) {
            let whole = self.indices[index.0] as f32;
            let nearer = fused(self.value(x, given), self.value(y, given), -whole);
            if self.floats[fraction.0] > 0.0 {
                self.floats[fraction.0] = nearer;
            }
        }
    }

    /// The row of an array at indices with offsets.
    fn row(&self, array: &Array, at: &[(Local, usize)]) -> usize {
        let along = at.iter().zip(&array.points);
        along.fold(0, |point, ((index, offset), points)| {
            let index = self.indices[index.0] + offset;
            assert!(index < *points, "{}: index {index} of {points}", array.name);
            point * points + index
        })
    }

    fn value(&self, value: &Value, given: &Given<'_>) -> f32 {
        if let Some(result) = self.taken(value, given) {
            return result;
        }
        match value {
            Value::Input(k) => given.inputs[*k],
            Value::Weight(k) => given.weights[*k],
            Value::Number(number) => *number,
            Value::Local(local) => self.floats[local.0],
            Value::Sample(array, at, column) => {
                let array = &self.program.arrays[*array];
                array
                    .samples
                    .value(self.row(array, at) * array.columns + column)
            }
            Value::Binary(operation, a, b) => {
                operation.of(self.value(a, given), self.value(b, given))
            }
            Value::Negated(value) => -self.value(value, given),
            Value::Reduced(distance, period, inverse) => {
                let distance = self.value(distance, given);
                reduced(distance, *period, *inverse, self.is_fused(value))
            }
            Value::Line(steps, [first, change, last]) => match self.value(steps, given) {
                steps if (0.0..1.0).contains(&steps) => match self.is_fused(value) {
                    true => fused(*change, steps, *first),
                    false => first + change * steps,
                },
                steps if steps > 0.0 => *last,
                _ => *first,
            },
            Value::ByTravel(axis, positive, negative) => match given.travel[*axis] {
                Travel::Positive => self.value(positive, given),
                Travel::Negative => self.value(negative, given),
                Travel::Unknown => 0.0,
            },
        }
    }
}

/// The remainder of a distance by a period; with a fused multiplication and subtraction, as a compiler may do it.
fn reduced(distance: f32, period: f32, inverse: f32, is_fused: bool) -> f32 {
    const MOST: f32 = 4_194_304.0;
    let p = distance * inverse;
    let p = if p < MOST { p } else { MOST };
    let p = if p > -MOST { p } else { -MOST };
    match is_fused {
        true => fused(-p.floor(), period, distance),
        false => distance - p.floor() * period,
    }
}
