//! From a compensation to straight-line code, with the operations and their order as the format specifies them.

use crate::program::{Array, Local, Program, Samples, Statement, Value};
use crate::text::plain;
use trueaxis::{Bank, Direction, Grid, GridAxis, Interpolation, Largest, SampleFormat};
use trueaxis_tables::contents::Contents;

/// 1/6 as binary32.
const SIXTH: f32 = f32::from_bits(0x3E2A_AAAB);

struct Lowering<'c, 'b> {
    compensation: &'c Largest<'b>,
    contents: &'c Contents<'c>,
    program: Program,
    tables: Vec<Table>,
}

/// A table, which becomes a local where it is first used: so few are needed at a time.
struct Table {
    value: Value,
    /// The axis and the direction of travel that it depends on.
    axis: usize,
    direction: Direction,
    is_local: bool,
}

/// The code of a compensation.
pub fn lower(compensation: &Largest<'_>, contents: &Contents<'_>) -> Program {
    let axes = compensation.axes().len();
    let adjustable = compensation.terms().filter(|term| term.limits.is_some());
    let mut lowering = Lowering {
        compensation,
        contents,
        program: Program {
            axes,
            inputs: axes + compensation.auxiliaries().len(),
            weights: adjustable.count(),
            ..Program::default()
        },
        tables: Vec::new(),
    };
    let used: Vec<u8> = compensation
        .terms()
        .flat_map(|term| term.factors)
        .copied()
        .collect();
    for (number, bank) in compensation.banks().iter().enumerate() {
        lowering.bank(number, bank, &used);
    }
    let mut grids: Vec<Vec<Value>> = vec![Vec::new(); axes];
    for (number, grid) in compensation.grids().iter().enumerate() {
        lowering.grid(number, grid, &mut grids);
    }
    for (axis, grids) in grids.into_iter().enumerate() {
        lowering.say(format!("d{}", contents.axes[axis].name));
        let sum = lowering
            .terms(axis)
            .into_iter()
            .chain(grids)
            .reduce(Value::add);
        let value = sum.unwrap_or(Value::Number(0.0));
        let statements = &mut lowering.program.statements;
        statements.push(Statement::Correction(axis, value));
    }
    lowering.program
}

impl Lowering<'_, '_> {
    fn local(&mut self, name: String) -> Local {
        self.program.locals.push(name);
        Local(self.program.locals.len() - 1)
    }

    fn bind(&mut self, name: String, value: Value) -> Value {
        let local = self.local(name);
        self.program.statements.push(Statement::Let(local, value));
        Value::Local(local)
    }

    fn say(&mut self, comment: String) {
        self.program.statements.push(Statement::Comment(comment));
    }

    /// The interval that an input is in: its index, and the fraction in it.
    fn interval(&mut self, name: &str, input: &GridAxis, intervals: u32) -> (Local, Value) {
        let inverse = 1.0 / input.step;
        let distance = Value::Input(usize::from(input.input)).subtract(Value::Number(input.start));
        let index = self.local(format!("i{name}"));
        let fraction = self.local(format!("f{name}"));
        let period = input.points as f32 * input.step;
        let (distance, count) = match input.modulo {
            true => (
                Value::Reduced(Box::new(distance), period, 1.0 / period),
                input.points,
            ),
            false => (distance, intervals),
        };
        self.program.statements.push(Statement::Interval {
            index,
            fraction,
            steps: distance.multiply(Value::Number(inverse)),
            count,
            is_circular: input.modulo,
        });
        (index, Value::Local(fraction))
    }

    /// The interval of a bank, and its tables.
    fn bank(&mut self, number: usize, bank: &Bank, used: &[u8]) {
        let first = self.tables.len();
        let columns = usize::from(bank.tables);
        let all = first..first + columns;
        if !used.iter().any(|table| all.contains(&usize::from(*table))) {
            return all.for_each(|_| self.table(bank, Value::Number(0.0)));
        }
        let about = self.bank_in_words(number, first, columns);
        self.say(about.clone());
        let reads = match bank.interpolation {
            Interpolation::Linear => 2,
            Interpolation::Cubic => 4,
        };
        let intervals = bank.points + 1 - reads;
        if bank.points == 2 && !bank.modulo {
            return self.lines(number, bank);
        }
        let input = GridAxis {
            input: bank.input,
            start: bank.start,
            step: bank.step,
            points: bank.points,
            modulo: bank.modulo,
        };
        let (index, t) = self.interval(&number.to_string(), &input, intervals);
        let array = self.bank_samples(number, bank, first, about);
        let weights = match bank.interpolation {
            Interpolation::Linear => None,
            Interpolation::Cubic => Some(self.spline_weights(number, &t)),
        };
        for column in 0..columns {
            let sample = |row: usize| Value::Sample(array, vec![(index, row)], column);
            let between = match &weights {
                None => mixed(sample(0), sample(1), t.clone()),
                Some(weights) => weighed(weights, sample),
            };
            let scale = self.compensation.scale(first + column).unwrap_or_default();
            self.table(bank, scaled(between, bank.format, scale));
        }
    }

    fn bank_in_words(&self, number: usize, first: usize, columns: usize) -> String {
        let entry = &self.contents.bank_list[number];
        plain(&format!(
            "{} of {}: {} points from {} to {}, {}",
            names(first, columns),
            entry.input,
            entry.points,
            entry.start,
            entry.end,
            entry.interpolation
        ))
    }

    /// The tables of a bank of two points: straight lines.
    fn lines(&mut self, number: usize, bank: &Bank) {
        let distance = Value::Input(usize::from(bank.input)).subtract(Value::Number(bank.start));
        let steps = distance.multiply(Value::Number(1.0 / bank.step));
        let steps = self.bind(format!("f{number}"), steps);
        self.program.has_lines = true;
        for table in self.tables.len()..self.tables.len() + usize::from(bank.tables) {
            let scale = self.compensation.scale(table).unwrap_or_default();
            let [first, last] = [0, 1].map(|point| {
                let value = self.compensation.sample(table, point).unwrap_or_default();
                match bank.format {
                    SampleFormat::F32 => value,
                    SampleFormat::I16 => f32::from(stored(value, scale)),
                }
            });
            let value = Value::Line(Box::new(steps.clone()), [first, last - first, last]);
            self.table(bank, scaled(value, bank.format, scale));
        }
    }

    fn table(&mut self, bank: &Bank, value: Value) {
        self.tables.push(Table {
            value,
            axis: bank.input.into(),
            direction: bank.direction,
            is_local: false,
        });
    }

    /// The local of a table.
    fn local_table(&mut self, number: usize) -> Value {
        let Table {
            value,
            axis,
            direction,
            is_local,
        } = &self.tables[number];
        if *is_local {
            return value.clone();
        }
        let (value, axis, direction) = (value.clone(), *axis, *direction);
        let value = self.by_travel(number, axis, direction, value);
        let value = self.bind(format!("t{number}"), value);
        let table = &mut self.tables[number];
        (table.value, table.is_local) = (value.clone(), true);
        value
    }

    /// What a table counts after either direction of travel.
    fn by_travel(
        &mut self,
        number: usize,
        axis: usize,
        direction: Direction,
        value: Value,
    ) -> Value {
        let none = Value::Number(0.0);
        let (positive, negative) = match direction {
            Direction::Both => return value,
            Direction::Positive => (value, none),
            Direction::Negative => (none, value),
            Direction::Signed => {
                let value = self.bind(format!("t{number}_stored"), value);
                (value.clone(), Value::Negated(Box::new(value)))
            }
        };
        self.program.is_directional = true;
        Value::ByTravel(axis, Box::new(positive), Box::new(negative))
    }

    /// The samples of a bank, with as many rows more as are read beyond the last index.
    fn bank_samples(&mut self, number: usize, bank: &Bank, first: usize, about: String) -> usize {
        let points = bank.points as usize;
        let more = match (bank.interpolation, bank.modulo) {
            (Interpolation::Cubic, true) => 3,
            _ => 1,
        };
        let row = |row: usize| match (
            row.checked_sub(points),
            bank.modulo || bank.interpolation == Interpolation::Cubic,
        ) {
            (None, _) => row,
            (Some(over), true) => over,
            (Some(_), false) => points - 1,
        };
        let columns = usize::from(bank.tables);
        let values =
            (0..points + more).flat_map(|point| (0..columns).map(move |column| (point, column)));
        let values = values.map(|(point, column)| {
            let table = first + column;
            let value = self.compensation.sample(table, row(point));
            let scale = self.compensation.scale(table);
            (value.unwrap_or_default(), scale.unwrap_or_default())
        });
        self.program.arrays.push(Array {
            name: format!("BANK_{number}"),
            about,
            points: vec![points + more],
            columns,
            samples: samples(bank.format, values),
        });
        self.program.arrays.len() - 1
    }

    /// The weights of a cubic B-spline: of the first, third and fourth sample.
    fn spline_weights(&mut self, number: usize, t: &Value) -> [Value; 3] {
        let one = || Value::Number(1.0);
        let sixth = || Value::Number(SIXTH);
        let cube = |v: &Value| v.clone().multiply(v.clone()).multiply(v.clone());
        let s = self.bind(format!("s{number}"), one().subtract(t.clone()));
        let w0 = sixth().multiply(cube(&s));
        let w2 = sixth().add(
            Value::Number(0.5)
                .multiply(t.clone())
                .multiply(one().add(t.clone().multiply(s))),
        );
        let w3 = sixth().multiply(cube(t));
        let mut bind = |k: usize, value: Value| self.bind(format!("w{number}_{k}"), value);
        [bind(0, w0), bind(2, w2), bind(3, w3)]
    }

    /// Weights times products of tables, in stored order, for one axis.
    fn terms(&mut self, axis: usize) -> Vec<Value> {
        let mut adjustable = 0..;
        let mut products = Vec::new();
        for term in self.compensation.terms() {
            let weight = match term.limits {
                Some(_) => adjustable.next().map(Value::Weight),
                None if term.weight == 1.0 && !term.factors.is_empty() => None,
                None => Some(Value::Number(term.weight)),
            };
            if usize::from(term.output) == axis {
                let factors = term
                    .factors
                    .iter()
                    .map(|table| self.local_table((*table).into()));
                products.extend(weight.into_iter().chain(factors).reduce(Value::multiply));
            }
        }
        products
    }

    /// Multilinear interpolation: a value for each of its outputs.
    fn grid(&mut self, number: usize, grid: &Grid, grids: &mut [Vec<Value>]) {
        let about = self.grid_in_words(number);
        self.say(about.clone());
        let along = self.cell(number, grid);
        let columns = grid.outputs.len();
        let scale = |column: usize| grid.scales.get(column).copied().unwrap_or_default();
        let nodes = 0..grid.nodes() as usize;
        let values = nodes.flat_map(|node| (0..columns).map(move |column| (node, column)));
        let values = values.map(|(node, column)| {
            let value = self.compensation.grid_sample(number, node, column);
            (value.unwrap_or_default(), scale(column))
        });
        let array = self.program.arrays.len();
        self.program.arrays.push(Array {
            name: format!("GRID_{number}"),
            about,
            points: grid.axes.iter().map(|axis| axis.points as usize).collect(),
            columns,
            samples: samples(grid.format, values),
        });
        for (column, output) in grid.outputs.iter().enumerate() {
            let mut name = 0;
            let value = self.between(
                array,
                column,
                &along,
                &mut Vec::new(),
                &mut |this, value| {
                    name += 1;
                    this.bind(format!("g{number}_{column}_{name}"), value)
                },
            );
            let value = scaled(value, grid.format, scale(column));
            grids[usize::from(*output)].push(value);
        }
    }

    fn grid_in_words(&self, number: usize) -> String {
        let entry = &self.contents.grid_list[number];
        let outputs: Vec<String> = entry.outputs.iter().map(|o| format!("d{o}")).collect();
        let inputs: Vec<&str> = entry.inputs.iter().map(|i| i.input.as_str()).collect();
        let (inputs, outputs) = (inputs.join(", "), outputs.join(", "));
        plain(&format!("G{number} of {inputs} to {outputs}"))
    }

    /// The cell of a grid that the inputs are in: both indices along each input, and the fraction.
    fn cell(&mut self, number: usize, grid: &Grid) -> Vec<([Local; 2], Value)> {
        let axes = grid.axes.iter().enumerate();
        axes.map(|(k, axis)| {
            let name = format!("g{number}_{k}");
            let (index, fraction) = self.interval(&name, axis, axis.points - 1);
            let next = self.local(format!("j{name}"));
            self.program.statements.push(Statement::Next {
                index: next,
                of: index,
                last: axis.points - 1,
                wraps: axis.modulo,
            });
            ([index, next], fraction)
        })
        .collect()
    }

    /// The interpolation along the inputs that are left; `at` are the indices along those before.
    fn between(
        &mut self,
        array: usize,
        column: usize,
        along: &[([Local; 2], Value)],
        at: &mut Vec<(Local, usize)>,
        bind: &mut dyn FnMut(&mut Self, Value) -> Value,
    ) -> Value {
        let Some(([index, next], fraction)) = along.get(at.len()) else {
            return Value::Sample(array, at.clone(), column);
        };
        let mut side = |local: &Local, this: &mut Self| {
            at.push((*local, 0));
            let value = this.between(array, column, along, at, bind);
            at.pop();
            bind(this, value)
        };
        let a = side(index, self);
        let b = side(next, self);
        mixed(a, b, fraction.clone())
    }
}

/// A value of stored samples in their unit.
fn scaled(value: Value, format: SampleFormat, scale: f32) -> Value {
    match format {
        SampleFormat::F32 => value,
        SampleFormat::I16 => value.multiply(Value::Number(scale)),
    }
}

/// Values, each with its scale, as they are stored.
fn samples(format: SampleFormat, values: impl Iterator<Item = (f32, f32)>) -> Samples {
    match format {
        SampleFormat::F32 => Samples::Floats(values.map(|(value, _)| value).collect()),
        SampleFormat::I16 => Samples::Shorts(values.map(|(v, scale)| stored(v, scale)).collect()),
    }
}

/// A cubic B-spline, from the weights of its first, third and fourth sample.
fn weighed([w0, w2, w3]: &[Value; 3], sample: impl Fn(usize) -> Value) -> Value {
    let away = |row: usize, weight: &Value| {
        let difference = sample(row).subtract(sample(1));
        weight.clone().multiply(difference)
    };
    let parts = away(0, w0).add(away(2, w2)).add(away(3, w3));
    sample(1).add(parts)
}

/// The integer that was stored, from its product with the scale.
fn stored(value: f32, scale: f32) -> i16 {
    (f64::from(value) / f64::from(scale)).round() as i16
}

/// a + (b − a) · t.
fn mixed(a: Value, b: Value, t: Value) -> Value {
    a.clone().add(b.subtract(a).multiply(t))
}

/// `T3`, or `T3 to T7`.
fn names(first: usize, count: usize) -> String {
    match count {
        1 => format!("T{first}"),
        _ => format!("T{first} to T{}", first + count - 1),
    }
}
