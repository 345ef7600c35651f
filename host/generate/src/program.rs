//! Straight-line code as a tree: what is printed as Rust or C, and what the proof interprets.

/// A local variable, by its number in [`Program::locals`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Local(pub usize);

/// Stored samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// As f32.
    Floats(Vec<f32>),
    /// As integers.
    Shorts(Vec<i16>),
}

impl Samples {
    /// A sample as a number.
    pub fn value(&self, index: usize) -> f32 {
        match self {
            Self::Floats(values) => values[index],
            Self::Shorts(values) => f32::from(values[index]),
        }
    }
}

/// Constant samples in rows: one row per point of a bank or per node of a grid, one column per table or output.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    /// Name in the generated code, in capitals.
    pub name: String,
    /// What it holds, for the reader.
    pub about: String,
    /// How many points there are along each input; the last one varies fastest.
    pub points: Vec<usize>,
    /// Samples of each point.
    pub columns: usize,
    /// All of them.
    pub samples: Samples,
}

/// An operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Add,
    Subtract,
    Multiply,
}

impl Operation {
    /// The result, rounded to binary32.
    pub fn of(self, a: f32, b: f32) -> f32 {
        match self {
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
        }
    }
}

/// An f32.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// An axis position (mm, degrees) or an auxiliary input.
    Input(usize),
    /// The weight of an adjustable term.
    Weight(usize),
    Number(f32),
    Local(Local),
    /// A sample: the array, an index and an offset along each of its inputs, the column.
    Sample(usize, Vec<(Local, usize)>, usize),
    Binary(Operation, Box<Value>, Box<Value>),
    Negated(Box<Value>),
    /// The value reduced by whole periods; with the inverse of the period.
    Reduced(Box<Value>, f32, f32),
    /// Along the only interval of a table, so many steps from its first point: the first value, what is added per step,
    /// and the last value, which holds beyond.
    Line(Box<Value>, [f32; 3]),
    /// One value after positive, another one after negative travel of an axis, 0 while the direction is unknown.
    ByTravel(usize, Box<Value>, Box<Value>),
}

impl Value {
    pub fn add(self, other: Self) -> Self {
        Self::Binary(Operation::Add, Box::new(self), Box::new(other))
    }
    pub fn subtract(self, other: Self) -> Self {
        Self::Binary(Operation::Subtract, Box::new(self), Box::new(other))
    }
    pub fn multiply(self, other: Self) -> Self {
        Self::Binary(Operation::Multiply, Box::new(self), Box::new(other))
    }
}

/// A line of code.
#[derive(Clone, Debug, PartialEq)]
pub enum Statement {
    /// For the reader.
    Comment(String),
    /// A new local.
    Let(Local, Value),
    /// The interval of a distance in steps from the first point, and the fraction in it: held at both ends of so many
    /// intervals, or on a circle of so many points.
    Interval {
        index: Local,
        fraction: Local,
        steps: Value,
        count: u32,
        is_circular: bool,
    },
    /// The index after another one; after `last` comes 0 if it wraps, otherwise `last` again.
    Next {
        index: Local,
        of: Local,
        last: u32,
        wraps: bool,
    },
    /// Adds to the correction of an axis what is not the first to be added.
    Correction(usize, Value),
}

/// All of it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    pub arrays: Vec<Array>,
    /// Names of the locals.
    pub locals: Vec<String>,
    pub statements: Vec<Statement>,
    /// How many axes there are: inputs with these numbers have corrections.
    pub axes: usize,
    /// How many inputs there are: axes, then auxiliaries.
    pub inputs: usize,
    /// How many adjustable weights there are.
    pub weights: usize,
    /// True if a table is a line.
    pub has_lines: bool,
    /// True if a value depends on the direction of travel.
    pub is_directional: bool,
}

impl Program {
    /// The name of a local.
    pub fn name(&self, local: Local) -> &str {
        &self.locals[local.0]
    }
}
