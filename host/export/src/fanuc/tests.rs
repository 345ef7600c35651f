use super::*;
use crate::positions::random;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::{Options as Compile, build};

fn blob(errors: &str) -> trueaxis::AlignedBlob {
    let machine = include_str!("../../../../examples/mill-21/machine.toml");
    let machine = Machine::from_toml(machine).unwrap();
    let errors = errors.replace("NAME", &machine.name);
    let errors = ErrorModel::from_toml(&errors, &machine).unwrap();
    let options = Compile {
        random: 100,
        ..Compile::default()
    };
    build(&machine, &errors, &options, &()).unwrap().blob
}

fn options(points: usize, unit: f64) -> FanucOptions {
    FanucOptions {
        points: [points; 3],
        unit,
        at: Vec::new(),
        positions: 500,
        seed: 1,
    }
}

/// The formula of Fanuc A-79351E, with its eight vertices, on the text.
fn by_control(text: &str, position: [f64; 3]) -> [f64; 3] {
    let head = |words: &str| -> Vec<f64> {
        let line = text
            .lines()
            .find(|line| line.starts_with(&format!("# {words}")))
            .unwrap();
        let numbers = line.rsplit(", ").map(|w| w.parse::<f64>());
        let mut numbers: Vec<f64> = numbers.map_while(Result::ok).collect();
        numbers.reverse();
        numbers
    };
    let unit = head("detection unit")[0];
    let [count, start, step, times] =
        ["number", "first point", "interval", "magnification"].map(head);
    let rows: Vec<Vec<f64>> = (text
        .lines()
        .skip_while(|line| !line.starts_with("point"))
        .skip(1))
    .map(|line| line.split(',').map(|w| w.parse().unwrap()).collect())
    .collect();
    let cell: Vec<(usize, f64)> = (0..3)
        .map(|k| {
            let along = ((position[k] - start[k]) / step[k]).clamp(0.0, count[k] - 1.0);
            let first = (along.floor()).min(count[k] - 2.0);
            (first as usize, along - first)
        })
        .collect();
    let [(i, x), (j, y), (k, z)] = cell[..] else {
        unreachable!()
    };
    let c = |a: usize, b: usize, d: usize, axis: usize| {
        let number = (i + a) + count[0] as usize * ((j + b) + count[1] as usize * (k + d));
        assert_eq!(rows[number][0], (number + 1) as f64);
        rows[number][axis + 1] * times[axis] * unit
    };
    std::array::from_fn(|axis| {
        c(0, 0, 0, axis) * (1.0 - x) * (1.0 - y) * (1.0 - z)
            + c(1, 0, 0, axis) * x * (1.0 - y) * (1.0 - z)
            + c(1, 1, 0, axis) * x * y * (1.0 - z)
            + c(0, 1, 0, axis) * (1.0 - x) * y * (1.0 - z)
            + c(0, 0, 1, axis) * (1.0 - x) * (1.0 - y) * z
            + c(1, 0, 1, axis) * x * (1.0 - y) * z
            + c(1, 1, 1, axis) * x * y * z
            + c(0, 1, 1, axis) * (1.0 - x) * y * z
    })
}

/// Scales and squareness: linear in each axis, which a grid of any size keeps.
const LINEAR: &str =
    "machine = \"NAME\"\n[parameters]\nEXX1 = 1e-4\nEYY1 = -8e-5\nEC0X = 2e-4\nEB0Z = 1e-4\n";

#[test]
fn the_control_interpolates_what_the_compensation_needs() {
    let measured = include_str!("../../../../examples/mill-21/errors-21.toml");
    for (errors, points, unit) in [(LINEAR, 3, 1e-3), (LINEAR, 9, 1e-4), (measured, 11, 1e-4)] {
        let blob = blob(errors);
        let runtime = Runtime::load(&blob).unwrap();
        let (table, text, found) = export(&runtime, &options(points, unit)).unwrap();
        for (difference, letter) in found.iter().zip(runtime.compensation().axes()) {
            let k = [b'X', b'Y', b'Z']
                .iter()
                .position(|l| *l == letter.name)
                .unwrap();
            let step = f64::from(table.magnification[k]) * unit * 1e3;
            // Half a step at a node, and second order of 0.2 mrad over 0.5 m.
            let is_linear = errors == LINEAR;
            assert!(
                !is_linear || difference.difference < step / 2.0 + 0.05,
                "{found:?} {step}"
            );
        }
        let axes = runtime.compensation().axes();
        let inputs = [b'X', b'Y', b'Z'].map(|l| axes.iter().position(|a| a.name == l).unwrap());
        let mut worst = [0.0_f64; 3];
        for command in random(axes, 60, 9) {
            let position = inputs.map(|i| f64::from(command.axes[i]));
            let wanted = runtime.evaluate(&command);
            for (k, value) in by_control(&text, position).into_iter().enumerate() {
                let apart = (value - f64::from(wanted[inputs[k]])).abs() * 1e3;
                worst[k] = worst[k].max(apart);
            }
        }
        for (k, worst) in worst.into_iter().enumerate() {
            let found = &found[inputs[k]];
            // The largest of other random positions differs, on values that are the same.
            assert!(worst < 1.3 * found.difference + 0.1, "{worst} {found:?}");
            assert!(worst > 0.3 * found.difference - 0.1, "{worst} {found:?}");
        }
    }
}

#[test]
fn what_a_grid_cannot_hold_is_refused() {
    let blob = blob("machine = \"NAME\"\n[parameters]\nEXX1 = 1e-3\n");
    let runtime = Runtime::load(&blob).unwrap();
    let small = export(&runtime, &options(3, 1e-6));
    assert!(
        small
            .as_ref()
            .is_err_and(|e| e.cause.contains("a correction of X of")),
        "{small:?}"
    );
    let mut held = options(3, 1e-3);
    held.at = vec![('C', 0.0)];
    let refused = export(&runtime, &held).unwrap_err().cause;
    assert!(refused.starts_with("C is not an axis"), "{refused}");
    let (_, text, _) = export(&runtime, &options(3, 1e-3)).unwrap();
    for (text, message) in [
        (text.replace("\n27,", "\n28,"), "not the next point"),
        (text.replace("interval", "step"), "no interval"),
        (text[..text.len() / 2].to_owned(), ""),
    ] {
        assert!(read(&text).unwrap_err().message.contains(message));
    }
}
