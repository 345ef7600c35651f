//! The output of `explain`, compared with a second derivation of every reading, and with signs derived by hand.

mod first_order;

use first_order::{First, left};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::{BenchState, Nature, Sense, explain};
use trueaxis_model::machine::Machine;
use trueaxis_tests::random_machines::{ALL, cases};
use trueaxis_tests::{Fixed, errors, machine};

/// Compares every explanation of a machine with the first-order result.
fn check(name: &str, machine: &Machine, errors: &ErrorModel) -> usize {
    let first = First {
        machine,
        errors,
        perfect: ErrorModel::perfect(machine),
    };
    let all = explain(machine, errors);
    let tables = errors
        .motions
        .iter()
        .flatten()
        .filter_map(|m| m.table.as_ref());
    let tables: usize = tables.map(|t| 1 + usize::from(t.negative.is_some())).sum();
    let changes = errors.motions.iter().flatten().map(|m| m.thermal.len());
    let changes = changes.sum::<usize>() + errors.inter_thermal.len();
    assert_eq!(
        all.len(),
        errors.parameters.len() + tables + changes,
        "{name}"
    );
    let reach: f64 = machine
        .axes
        .iter()
        .map(|a| a.travel[1].abs().max(a.travel[0].abs()))
        .sum();
    let mut random = Fixed::new(3);
    for explained in &all {
        if explained.alone.size() > 0.0 {
            let positions: Vec<BenchState> = (0..30)
                .map(|k| {
                    let mut state = BenchState::at(random.position(machine));
                    if let Some(q) = state.q.get_mut(explained.alone.index()) {
                        let [low, high] = explained.alone.range;
                        *q = q.max(low).min(high);
                    }
                    if explained.alone.nature() == Nature::Reversal {
                        state.sign = [if k % 2 == 0 { 1.0 } else { -1.0 }; 6];
                    }
                    state
                })
                .collect();
            let left = left(&first, explained, &positions);
            assert_eq!(
                explained.reading.is_none(),
                left < 1e-4,
                "{name}: {}: {left}",
                explained.sentence()
            );
        }
        let sentence = explained.sentence();
        assert!(
            !sentence.contains("NaN") && !sentence.contains("inf"),
            "{name}: {sentence}"
        );
        let Some(reading) = &explained.reading else {
            // A shift by warmth does not change with the position, but with time.
            let [nothing, grows] = ["changes nothing", "1 K warmer, the tool is off by "];
            assert!(
                sentence.contains(nothing) || sentence.contains(grows),
                "{name}: {sentence}"
            );
            continue;
        };
        let expected = first.reads(explained, reading);
        let size = explained.alone.size();
        // The second order: an angle squared times a lever, or an angle times a displacement.
        let angular = explained.alone.parameter.is_angular();
        let second = match (angular, matches!(reading.sense, Sense::In(_))) {
            (true, true) => 3.0 * size * size * (reach + 1000.0),
            (true, false) => 3.0 * size * size,
            (false, _) => 1e-9,
        };
        // A scale over the whole length changes the legs of the square by the same amount again.
        let second = second + 3.0 * size * (size / 100.0).min(1e-3) + 1e-9;
        assert!(
            (reading.value - expected).abs() <= second,
            "{name}: {sentence}\n{} is not {expected}",
            reading.value
        );
    }
    all.len()
}

#[test]
fn every_parameter_of_every_example_reads_as_the_linearised_model_says() {
    let mut count = 0;
    for (machine_file, errors_file) in [
        ("huron-k2x8/machine", "huron-k2x8/errors-13"),
        ("huron-k2x8/machine-tool-length", "huron-k2x8/errors-13"),
        ("kolibri/machine", "kolibri/errors-10"),
        ("kolibri/machine", "kolibri/errors-12"),
        ("kolibri/machine", "kolibri/errors-81"),
        ("hu40/machine", "hu40/errors-13"),
        ("hu40/machine", "hu40/errors-84"),
        ("fork-head/machine", "fork-head/errors-13"),
        ("table-head/machine", "table-head/errors-13"),
        ("router/machine", "router/errors-10"),
        ("mill-21/machine", "mill-21/errors-21"),
        ("five-axis-30/machine", "five-axis-30/errors-30"),
        ("linuxcnc-xyzac-trt/machine", "linuxcnc-xyzac-trt/errors-11"),
    ] {
        let machine = machine(&format!("examples/{machine_file}.toml"));
        let errors = errors(&format!("examples/{errors_file}.toml"), &machine);
        count += check(errors_file, &machine, &errors);
    }
    assert!(count > 300, "{count}");
}

#[test]
fn every_parameter_of_random_machines_reads_as_the_linearised_model_says() {
    let mut count = 0;
    for case in cases(ALL / 5) {
        count += check(&format!("seed {}", case.seed), &case.machine, &case.errors);
    }
    assert!(count > 2_000, "{count}");
}

/// Every kind of parameter by itself, on every axis of every example.
#[test]
fn every_parameter_that_there_can_be_is_explained() {
    for name in [
        "huron-k2x8",
        "kolibri",
        "hu40",
        "fork-head",
        "table-head",
        "router",
        "mill-21",
    ] {
        let machine = machine(&format!("examples/{name}/machine.toml"));
        let mut errors = ErrorModel::perfect(&machine);
        for letter in machine.axes.iter().map(|a| a.letter.char()).chain(['S']) {
            for component in 0..6 {
                for kind in [
                    ParameterKind::Inter,
                    ParameterKind::Degree(0),
                    ParameterKind::Degree(1),
                    ParameterKind::Degree(3),
                    ParameterKind::Cosine(1),
                    ParameterKind::Sine(2),
                    ParameterKind::Backlash,
                ] {
                    let axis = machine.axes.iter().find(|a| a.letter.char() == letter);
                    let long = axis.map_or(1.0, |a| a.to_kinematic(a.travel[1]).max(1.0));
                    let size = if component < 3 { 1e-2 } else { 1e-5 };
                    let value = match kind {
                        ParameterKind::Degree(k) => size / long.powi(k.into()),
                        _ => size,
                    };
                    let parameter = Parameter {
                        component,
                        axis: letter,
                        kind,
                    };
                    errors.set(&machine, parameter, value);
                }
            }
        }
        assert!(check(name, &machine, &errors) >= 6 + 30 * machine.axes.len());
    }
}

/// Signs by hand where the page "From measurement to parameter" has none (`measurement.rs`): the example, the parameter, its
/// value, its nature, and what the sentence has. On the mill X on Y carries the workpiece, both reversed, and a table
/// displaced by +30e-6·y in x displaces the tool by as much in −x of the part. On the router all axes carry the tool.
const SENTENCES: &str = "\
mill-21 | EC0Y  | 30e-6 | Constant | turns everything and changes nothing; the squareness of X and Y is EC0X
router  | EC0Y  | 30e-6 | Constant | turns everything and changes nothing; the squareness of X and Y is EC0X
mill-21 | EXY1  | 30e-6 | Slope    | a square on the table, dial moved along Y, reads −3.0 µm per 100 mm in X
router  | EXY1  | 30e-6 | Slope    | a square on the table, dial moved along Y, reads +3.0 µm per 100 mm in X
mill-21 | EC0S  | 30e-6 | Constant | turns the tool about its own axis and changes nothing
router  | EC0S  | 30e-6 | Constant | turns the tool about its own axis and changes nothing
mill-21 | EX0X  | 0.01  | Constant | shifts everything and changes nothing
router  | EY0X  | 0.01  | Constant | shifts everything and changes nothing
mill-21 | EZ0Z  | 0.01  | Constant | shifts everything and changes nothing
router  | EX0S  | 0.01  | Constant | shifts everything and changes nothing
mill-21 | EXX0  | 0.01  | Constant | shifts everything and changes nothing
router  | EXX1  | 0     | Slope    | EXX1 = 0, X carries the tool: changes nothing
kolibri | EX0X  | 0.01  | Constant | a ball on the axis of
kolibri | EX0S  | 0.01  | Constant | a ball on the axis of
kolibri | EZ0S  | 0.01  | Constant | a ball on the axis of
kolibri | EC0C  | 1e-4  | Constant | changes nothing
kolibri | EZ0C  | 1e-4  | Constant | changes nothing
kolibri | ECC1  | 1e-5  | Slope    | a rotary calibrator on C reads
kolibri | EXCc1 | 1e-3  | Curve    | a ball on the axis of C
kolibri | EYX2  | 1e-7  | Curve    | a dial along a straightedge in X
kolibri | EAX1  | 1e-7  | Slope    | an angle laser or level along X
kolibri | ECCb  | 1e-5  | Reversal | a rotary calibrator reads";

#[test]
fn a_parameter_has_its_nature_its_instrument_and_its_sign() {
    for line in SENTENCES.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let machine = machine(&format!("examples/{}/machine.toml", cells[0]));
        let (parameter, value) = (Parameter::parse(cells[1]).unwrap(), cells[2].parse());
        let mut errors = ErrorModel::perfect(&machine);
        assert!(errors.set(&machine, parameter, value.unwrap()));
        let all = explain(&machine, &errors);
        assert_eq!(all.len(), 1, "{line}");
        let sentence = all[0].sentence();
        assert_eq!(format!("{:?}", all[0].alone.nature()), cells[3], "{line}");
        assert!(sentence.contains(cells[4]), "{line}: {sentence}");
    }
}
