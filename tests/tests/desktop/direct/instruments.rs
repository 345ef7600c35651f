//! All instruments, and their readings.

use nalgebra::Vector3;
use trueaxis_direct::simulate::runs::{self as simulated, OfReadings};
use trueaxis_direct::{AxisRuns, MeasuredRuns, Measurement, MeasurementSetup, RunColumn, Square};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::{Bench, Sense};
use trueaxis_model::machine::{Axis, Machine, PerAxis};

/// Indices of X, Y and Z.
fn linear(machine: &Machine) -> [usize; 3] {
    ['X', 'Y', 'Z'].map(|letter| machine.index(letter).unwrap())
}

/// An instrument setup, with a run in each direction.
fn line(machine: &Machine, moved: usize, sense: Sense, at: &PerAxis, targets: &[f64]) -> AxisRuns {
    let perfect = ErrorModel::perfect(machine);
    let home = Bench::new(machine, &perfect, Default::default()).home();
    let mut at = *at;
    at[moved] = home[moved];
    let column = |direction| RunColumn {
        direction,
        readings: vec![0.0; targets.len()],
    };
    AxisRuns {
        setup: MeasurementSetup {
            moved,
            sense,
            counts: 1.0,
            at,
            offset: Vector3::zeros(),
            keeps_slope: false,
        },
        targets: targets.to_vec(),
        columns: vec![column(1.0), column(-1.0)],
    }
}

/// Every possible measurement: each axis in six senses, the three squares.
pub fn everything(
    machine: &Machine,
    count: usize,
    mut place: impl FnMut() -> PerAxis,
) -> Vec<Measurement> {
    let [x, y, z] = linear(machine);
    let senses = [x, y, z].map(Sense::In);
    let turns = [(y, z), (z, x), (x, y)].map(|(a, b)| Sense::From(a, b));
    let mut all = Vec::new();
    let mut add = |name: String, measured| all.push(Measurement { name, measured });
    let targets = |axis: &Axis| -> Vec<f64> {
        let [low, high] = axis.travel;
        let step = (high - low) / (count - 1) as f64;
        (0..count).map(|k| low + step * k as f64).collect()
    };
    for (moved, axis) in machine.axes.iter().enumerate() {
        for sense in senses.into_iter().chain(turns) {
            let mut line = line(machine, moved, sense, &place(), &targets(axis));
            line.setup.offset = Vector3::new(11.0, -7.0, 23.0);
            add(
                format!("{}-{sense:?}", axis.letter),
                MeasuredRuns::Line(line),
            );
        }
    }
    for [a, b] in [[x, y], [z, x], [y, z]] {
        let at = place();
        let lines = [[a, b], [b, a]].map(|[moved, read]| {
            let targets = targets(&machine.axes[moved]);
            let mut line = line(machine, moved, Sense::In(read), &at, &targets);
            line.setup.at = at;
            line
        });
        add(
            format!("square {a} {b}"),
            MeasuredRuns::Square(Square { lines, over: 12e-6 }),
        );
    }
    all
}

/// Like `everything`, with the instruments' readings.
pub fn simulate(
    machine: &Machine,
    errors: &ErrorModel,
    plan: &[Measurement],
    noise: [f64; 2],
    seed: u64,
) -> Vec<Measurement> {
    let bench = Bench::new(machine, errors, Default::default());
    let number = plan.iter().enumerate();
    let all = number.map(|(k, one)| {
        let disturbed = |is_angular: bool| OfReadings {
            noise: noise[usize::from(is_angular)],
            seed: seed * 1000 + k as u64,
            ..OfReadings::default()
        };
        let measured = match &one.measured {
            MeasuredRuns::Line(line) => {
                let disturbed = disturbed(line.setup.is_angular());
                MeasuredRuns::Line(simulated::line(&bench, line, &disturbed).unwrap())
            }
            MeasuredRuns::Square(square) => {
                MeasuredRuns::Square(simulated::square(&bench, square, &disturbed(false)).unwrap())
            }
        };
        Measurement {
            name: one.name.clone(),
            measured,
        }
    });
    all.collect()
}
