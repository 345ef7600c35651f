//! The output of `explain`, compared with a second derivation of every reading, and with signs derived by hand.

mod first_order;

use first_order::{First, left};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::{BallPlacement, BenchInstrument, BenchState, Nature, Sense, explain};
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
            assert!(sentence.contains("changes nothing"), "{name}: {sentence}");
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

/// The sentence of one parameter.
fn sentence(machine: &Machine, name: &str, value: f64) -> String {
    let mut errors = ErrorModel::perfect(machine);
    assert!(errors.set(machine, Parameter::parse(name).unwrap(), value));
    let all = explain(machine, &errors);
    assert_eq!(all.len(), 1);
    all[0].sentence()
}

/// X on Y carries the workpiece, both reversed; Z carries the tool.
fn mill() -> Machine {
    machine("examples/mill-21/machine.toml")
}

/// Y carries X, which carries Z, which carries the tool.
fn router() -> Machine {
    machine("examples/router/machine.toml")
}

/// The signs by hand. On the router X carries the tool: 20 µm per m too long is too far, +2 µm. On the mill the table
/// goes to −100 mm for X = +100, 2 µm short of its target, so the tool is at +100 mm minus 2 µm along the part.
#[test]
fn a_scale_reads_the_other_way_on_a_reversed_workpiece_axis() {
    assert_eq!(
        sentence(&mill(), "EXX1", 20e-6),
        "EXX1 = 20e-6, X carries the workpiece and is reversed: a laser along X reads −2.0 µm at +100 mm"
    );
    assert_eq!(
        sentence(&router(), "EXX1", 20e-6),
        "EXX1 = 20e-6, X carries the tool: a laser along X reads +2.0 µm at +100 mm"
    );
}

/// On the router X leans towards +Y by 30 µrad: the angle between +X and +Y is less than a right angle. On the mill the
/// whole table on X is rotated together with X, by 30 µrad about z, so Y of the machine runs towards +x of the table:
/// again less than a right angle.
#[test]
fn squareness_of_x_and_y_is_that_of_the_one_that_is_carried() {
    for machine in [mill(), router()] {
        assert_eq!(
            sentence(&machine, "EC0X", 30e-6),
            "EC0X = 30e-6: a square on the table, dial moved along Y, reads +3.0 µm per 100 mm in X"
        );
        assert_eq!(
            sentence(&machine, "EC0Y", 30e-6),
            "EC0Y = 30e-6: turns everything and changes nothing; the squareness of X and Y is EC0X"
        );
    }
}

/// By hand, on the mill: the table is displaced by +30e-6·y in x for a command y, so the tool is displaced by the same
/// amount in −x of the part.
#[test]
fn a_straightness_that_leans_is_a_squareness() {
    assert!(
        sentence(&mill(), "EXY1", 30e-6)
            .ends_with("a square on the table, dial moved along Y, reads −3.0 µm per 100 mm in X")
    );
    assert!(
        sentence(&router(), "EXY1", 30e-6)
            .ends_with("a square on the table, dial moved along Y, reads +3.0 µm per 100 mm in X")
    );
}

/// By hand: rotated about x by +30 µrad, the +Y end of a 100 mm arm rises by 3 µm and the −Y end falls, so the dial is
/// pushed in by 6 µm less at +Y. About y, the +X end falls.
#[test]
fn the_tram_of_a_spindle_has_the_sign_of_its_rotation() {
    for machine in [mill(), router()] {
        assert!(sentence(&machine, "EA0S", 30e-6).ends_with("reads −6.0 µm more at +Y than at −Y"));
        assert!(sentence(&machine, "EB0S", 30e-6).ends_with("reads +6.0 µm more at +X than at −X"));
        assert!(
            sentence(&machine, "EC0S", 30e-6)
                .ends_with("turns the tool about its own axis and changes nothing")
        );
    }
}

/// By hand, Kolibri (A and C carry the workpiece): the centre of C is 42.1 µm too far in +y of the machine. Y moves the
/// workpiece in +y, so the tool is too far by the same amount on the other side, which is +Y for a command, and by
/// twice as much half a turn apart.
#[test]
fn a_centre_shows_twice_on_a_ball() {
    let kolibri = machine("examples/kolibri/machine.toml");
    let mut errors = ErrorModel::perfect(&kolibri);
    assert!(errors.set(&kolibri, Parameter::parse("EY0C").unwrap(), 42.1e-3));
    let all = explain(&kolibri, &errors);
    let reading = all[0].reading.unwrap();
    assert_eq!(
        reading.instrument,
        BenchInstrument::Ball {
            place: BallPlacement::OnAxis
        }
    );
    assert!((reading.value - 84.2e-3).abs() < 1e-9);
    assert_eq!(
        all[0].sentence(),
        "EY0C = 42.1e-3: a ball on the axis of C, indicator in the spindle, reads +84.2 µm in Y from C = 0° to +180°"
    );
}

/// By hand: the error is +2 µm after positive travel and −2 µm after negative.
#[test]
fn backlash_is_half_of_what_a_dial_shows() {
    let text = sentence(&router(), "EXXb", 2e-3);
    assert!(
        text.contains("reads +4.0 µm after positive less after negative travel of X"),
        "{text}"
    );
    let text = sentence(&mill(), "EXXb", 2e-3);
    assert!(
        text.contains("reads −4.0 µm after positive less after negative travel of X"),
        "{text}"
    );
}

#[test]
fn what_shifts_everything_changes_nothing_on_three_axes_but_does_with_rotary_ones() {
    for name in ["EX0X", "EY0X", "EZ0Z", "EX0S", "EXX0"] {
        for machine in [mill(), router()] {
            let text = sentence(&machine, name, 0.01);
            assert!(
                text.contains("shifts everything and changes nothing"),
                "{text}"
            );
        }
    }
    let kolibri = machine("examples/kolibri/machine.toml");
    for name in ["EX0X", "EX0S", "EZ0S"] {
        let text = sentence(&kolibri, name, 0.01);
        assert!(text.contains("a ball on the axis of"), "{text}");
    }
    // The zero of the last rotary axis, and its origin along itself.
    for name in ["EC0C", "EZ0C"] {
        let text = sentence(&kolibri, name, 1e-4);
        assert!(text.contains("changes nothing"), "{text}");
    }
}

#[test]
fn a_parameter_of_nothing_changes_nothing() {
    assert_eq!(
        sentence(&router(), "EXX1", 0.0),
        "EXX1 = 0, X carries the tool: changes nothing"
    );
}

#[test]
fn the_nature_of_a_parameter_decides_on_its_instrument() {
    let kolibri = machine("examples/kolibri/machine.toml");
    for (name, value, nature, words) in [
        (
            "ECC1",
            1e-5,
            Nature::Slope,
            "a rotary calibrator on C reads",
        ),
        ("EXCc1", 1e-3, Nature::Curve, "a ball on the axis of C"),
        (
            "EYX2",
            1e-7,
            Nature::Curve,
            "a dial along a straightedge in X",
        ),
        (
            "EAX1",
            1e-7,
            Nature::Slope,
            "an angle laser or level along X",
        ),
        ("ECCb", 1e-5, Nature::Reversal, "a rotary calibrator reads"),
    ] {
        let mut errors = ErrorModel::perfect(&kolibri);
        assert!(errors.set(&kolibri, Parameter::parse(name).unwrap(), value));
        let all = explain(&kolibri, &errors);
        assert_eq!(all[0].alone.nature(), nature, "{name}");
        assert!(all[0].sentence().contains(words), "{}", all[0].sentence());
    }
}
