//! Compares the scheme with the document's formulas, table counts and cases.

use super::compile;
use crate::schemes::{self, SchemeError, SchemeResult};
use trueaxis::{Inputs, Travel, Travelling};
use trueaxis_model::errors::{ErrorModel, Parameter, Situation};
use trueaxis_model::kinematics::{Kinematics, Linearised, Policy};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::{Command, Runtime};

fn machine(text: &str) -> Machine {
    Machine::from_toml(text).unwrap()
}

fn huron() -> (Machine, ErrorModel) {
    let machine = machine(include_str!(
        "../../../../../examples/huron-k2x8/machine.toml"
    ));
    let errors = include_str!("../../../../../examples/huron-k2x8/errors-13.toml");
    let errors = ErrorModel::from_toml(errors, &machine).unwrap();
    (machine, errors)
}

fn options(policy: Policy) -> schemes::Options {
    schemes::Options {
        policy,
        ..schemes::Options::default()
    }
}

fn parameters(names: &[&str]) -> Vec<Parameter> {
    names
        .iter()
        .map(|name| Parameter::parse(name).unwrap())
        .collect()
}

fn found(machine: &Machine, errors: &ErrorModel, policy: Policy) -> SchemeResult {
    compile(machine, errors, &[], &options(policy)).unwrap()
}

#[test]
fn the_huron_takes_the_documents_forty_tables_output_by_output() {
    let (machine, errors) = huron();
    let draft = found(&machine, &errors, Policy::Orientation).draft;
    // 13, 11, 14, 1 and 1 (section 7.4.1).
    for (letter, count) in [('X', 13), ('Y', 11), ('Z', 14), ('A', 1), ('C', 1)] {
        let output = machine.index(letter).unwrap();
        let terms = draft
            .terms
            .iter()
            .filter(|t| usize::from(t.output) == output);
        let mut tables: Vec<u8> = terms.flat_map(|t| t.factors.iter().copied()).collect();
        tables.sort_unstable();
        tables.dedup();
        assert_eq!(tables.len(), count, "{letter}");
    }
    let tables: usize = draft.banks.iter().map(|bank| bank.columns.len()).sum();
    assert_eq!(tables, 40);
}

/// The sums of Eq. 59 for A and C (rad), from the sine and cosine of A.
fn eq_59(e: &dyn Fn(&str) -> f64, s: f64, c: f64) -> [f64; 2] {
    let (half, root) = (0.5_f64.sqrt(), 2.0_f64.sqrt());
    [
        half * (c - 1.0) * e("EC0X") - half * (c + 1.0) * e("EA0Z") - s * e("EB0Z") + s * e("EB0A")
            - c * e("EC0A")
            + root * e("EA0C"),
        -c * e("EC0X") + c * e("EA0Z") + root * s * e("EB0Z") - root * s * e("EB0A")
            + root * c * e("EC0A")
            - e("EA0C"),
    ]
}

#[test]
fn tables_of_a_and_c_hold_the_sums_of_eq_59() {
    let (machine, errors) = huron();
    let draft = found(&machine, &errors, Policy::Orientation).draft;
    let [a, c] = ['A', 'C'].map(|letter| machine.index(letter).unwrap());
    let e = |name: &str| errors.parameters[&Parameter::parse(name).unwrap()];
    let bank = draft
        .banks
        .iter()
        .find(|b| usize::from(b.input) == a && b.columns[0].len() == 101);
    let bank = bank.unwrap();
    let before = draft
        .banks
        .iter()
        .take_while(|b| *b != bank)
        .map(|b| b.columns.len());
    let before: usize = before.sum();
    for (which, output) in [a, c].into_iter().enumerate() {
        let terms = draft
            .terms
            .iter()
            .filter(|t| usize::from(t.output) == output);
        let [term] = terms.collect::<Vec<_>>()[..] else {
            panic!("one term");
        };
        assert_eq!(term.weight, 1.0);
        let column = &bank.columns[usize::from(term.factors[0]) - before];
        for (i, value) in column.iter().enumerate() {
            let at = f64::from(bank.start) + i as f64 * f64::from(bank.step);
            let (s, c) = libm::sincos(at.to_radians());
            // Eq. 59 is the motion equivalent to the error; the correction is its negative.
            let wanted = -eq_59(&e, s, c)[which].to_degrees();
            // Half a unit in the last place of f32, for up to 0.01°.
            assert!(
                (f64::from(*value) - wanted).abs() < 6e-10,
                "{at}: {value} {wanted}"
            );
        }
    }
}

#[test]
fn figure_7_4_agrees_with_eq_59_for_a_and_has_three_signs_of_c_the_other_way() {
    let (_, errors) = huron();
    let e = |name: &str| errors.parameters[&Parameter::parse(name).unwrap()];
    let (half, root) = (0.5_f64.sqrt(), 2.0_f64.sqrt());
    let mut most = 0.0_f64;
    for degrees in -120..=120 {
        let (s, c) = libm::sincos(f64::from(degrees).to_radians());
        // As printed.
        let of_a = half * (c - 1.0) * e("EC0X") - half * (c + 1.0) * e("EA0Z") - s * e("EB0Z")
            + s * e("EB0A")
            - c * e("EC0A")
            + root * e("EA0C");
        let of_c = c * e("EC0X") - c * e("EA0Z") - root * s * e("EB0Z") - root * s * e("EB0A")
            + root * c * e("EC0A")
            - e("EA0C");
        let [a, c_of_59] = eq_59(&e, s, c);
        assert!((of_a - a).abs() < 1e-18, "{degrees}");
        let three = c * e("EC0X") - c * e("EA0Z") - root * s * e("EB0Z");
        assert!((of_c - c_of_59 - 2.0 * three).abs() < 1e-18, "{degrees}");
        most = most.max((of_c - c_of_59).abs());
    }
    // 283 µrad, as the manual says.
    assert!((most - 283e-6).abs() < 0.5e-6, "{most}");
}

/// The first-order correction (mm, rad) for all inter-axis errors and scales, by the transport matrices.
fn first_order(kinematics: &Kinematics<'_>, q: &PerAxis) -> PerAxis {
    let situation = Situation::default();
    let linearised = Linearised::new(kinematics, q, &situation);
    let solver = kinematics
        .jacobian(q, None)
        .solver(kinematics.policy)
        .unwrap();
    let mut sum = PerAxis::default();
    for (parameter, value) in &kinematics.errors.parameters {
        let dq = solver.correct(&linearised.column(*parameter).unwrap());
        for (s, d) in sum.iter_mut().zip(dq) {
            *s += value * d;
        }
    }
    sum
}

/// Compares the tables with the correction of first order at their points.
fn at_their_points(machine: &Machine, errors: &ErrorModel, policy: Policy) {
    let draft = found(machine, errors, policy).draft;
    let blob = draft.encode().unwrap();
    let runtime = Runtime::load(&blob).unwrap();
    let kinematics = Kinematics::new(machine, errors).with_policy(policy);
    let points = crate::schemes::points::points(&kinematics, super::POINTS);
    for k in 0..50 {
        let place = |i: usize| {
            let at = &points[i].at;
            let n = (k * (17 + 12 * i) + 5 * i) % at.len();
            machine.axes[i].to_command(at[n])
        };
        let position: Vec<f64> = (0..machine.axes.len()).map(place).collect();
        let command = Command::at(machine, &position);
        let (q, _) = command.kinematic(machine);
        let wanted = machine.to_command(&first_order(&kinematics, &q));
        let given = runtime.evaluate(&command);
        for (i, axis) in machine.axes.iter().enumerate() {
            // The runtime finds the place between points to 1e-5 of their spacing of up to 4°. The steepest
            // correction, that of the Kolibri's X where its C has a peak, changes by 0.25 mm per degree.
            let off = (f64::from(given[i]) - wanted[i]).abs();
            assert!(
                off < 1e-5,
                "{} {policy:?} {}: {off}",
                machine.name,
                axis.letter
            );
        }
    }
}

#[test]
fn at_their_points_tables_give_the_correction_of_first_order_on_every_machine_with_two_rotary_axes()
{
    macro_rules! example {
        ($machine:literal, $errors:literal) => {
            (
                include_str!(concat!("../../../../../examples/", $machine, ".toml")),
                include_str!(concat!("../../../../../examples/", $errors, ".toml")),
            )
        };
    }
    for (text, errors) in [
        example!("huron-k2x8/machine", "huron-k2x8/errors-13"),
        example!("kolibri/machine", "kolibri/errors-10"),
        example!("hu40/machine", "hu40/errors-13"),
        example!("fork-head/machine", "fork-head/errors-13"),
        example!("table-head/machine", "table-head/errors-13"),
        example!("linuxcnc-xyzac-trt/machine", "linuxcnc-xyzac-trt/errors-11"),
        example!(
            "linuxcnc-xyzac-trt/machine-endless",
            "linuxcnc-xyzac-trt/errors-11"
        ),
    ] {
        let machine = machine(text);
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        for policy in [Policy::Orientation, Policy::default(), Policy::Position] {
            at_their_points(&machine, &errors, policy);
        }
    }
}

#[test]
fn a_weight_that_is_set_is_another_value_of_the_error() {
    let (machine, errors) = huron();
    let names = ["EZ0S", "EA0C", "EB0A"];
    let adjustable = parameters(&names);
    let options = options(Policy::Orientation);
    let changed = {
        let mut changed = errors.clone();
        for parameter in &adjustable {
            assert!(changed.set(&machine, *parameter, 1.5 * errors.parameters[parameter]));
        }
        changed
    };
    let blobs = [&errors, &changed].map(|errors| {
        let draft = compile(&machine, errors, &adjustable, &options)
            .unwrap()
            .draft;
        draft.encode().unwrap()
    });
    let [as_is, other] = [&blobs[0], &blobs[1]].map(|blob| Runtime::load(blob).unwrap());
    let mut weights = as_is.compensation().weights();
    let mut set = 0;
    for (number, term) in as_is.compensation().terms().enumerate() {
        if term.limits.is_some() {
            weights.set(number, 1.5 * term.weight).unwrap();
            set += 1;
        }
    }
    // One for EZ0S, two for EA0C, and for EB0A two for each linear axis and one for each rotary axis.
    assert_eq!(set, 1 + 2 + 8);
    let position = [100.0, -30.0, 20.0, -200.0, 50.0];
    let mut inputs = Inputs::at([0.0; 16]);
    for (input, at) in inputs.axes.iter_mut().zip(position) {
        *input = at;
    }
    let travelling = Travelling([Travel::Unknown; 16]);
    let given = as_is
        .compensation()
        .evaluate(&inputs, &travelling, &weights);
    let position = position.map(f64::from);
    let wanted = other.evaluate(&Command::at(&machine, &position));
    for (given, wanted) in given.iter().zip(wanted) {
        // One unit in the last place of 0.1 mm.
        assert!((given - wanted).abs() < 1e-8, "{given} {wanted}");
    }
}

#[test]
fn weights_are_the_errors_and_may_go_from_nothing_to_twice() {
    let (machine, errors) = huron();
    let names = ["EZ0S", "EYY1", "EX0S", "EXX1", "EZZ1"];
    let options = options(Policy::Orientation);
    let found = compile(&machine, &errors, &parameters(&names), &options).unwrap();
    let open = found.draft.terms.iter().filter(|t| t.limits.is_some());
    let open: Vec<_> = open.collect();
    let values = names.map(|name| errors.parameters[&Parameter::parse(name).unwrap()] as f32);
    // Outputs in order: Y, X, Z. Each has one term, and no tables besides those that it has anyway.
    let weights: Vec<f32> = open.iter().map(|t| t.weight).collect();
    assert_eq!(weights, values);
    let tables: usize = found
        .draft
        .banks
        .iter()
        .map(|bank| bank.columns.len())
        .sum();
    assert_eq!(tables, 40);
    for term in open {
        let [low, high] = term.limits.unwrap();
        assert!(low == 0.0 || high == 0.0);
        assert_eq!(low + high, 2.0 * term.weight);
    }
}

#[test]
fn terms_are_named_by_the_errors_of_which_they_were_made_and_by_no_others() {
    let (machine, errors) = huron();
    let options = schemes::Options {
        zero_at: Some(vec![1.0, 2.0, 3.0, 4.0, 5.0]),
        points: Some(40),
        ..options(Policy::Orientation)
    };
    for adjustable in [vec![], parameters(&["EB0A", "EA0C"])] {
        let draft = compile(&machine, &errors, &adjustable, &options)
            .unwrap()
            .draft;
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let compensation = runtime.compensation();
        let names = super::names(&machine, &errors, compensation)
            .unwrap()
            .unwrap();
        assert_eq!(names.len(), compensation.terms().len());
        for (term, names) in compensation.terms().zip(&names) {
            assert_eq!(term.factors.is_empty(), names.is_empty());
            if term.limits.is_some() {
                let [name] = &names[..] else {
                    panic!("{names:?}");
                };
                let parameter = Parameter::parse(name).unwrap();
                assert_eq!(term.weight, errors.parameters[&parameter] as f32);
            }
        }
        let mut other = errors.clone();
        assert!(other.set(&machine, Parameter::parse("EB0C").unwrap(), 1e-5));
        assert_eq!(super::names(&machine, &other, compensation).unwrap(), None);
    }
}

/// A machine of these axes, each in its branch (`w` or `t`) with its travel to both sides.
fn of_axes(axes: &[(&str, f64)]) -> Machine {
    let axis = |(name, range): &(&str, f64)| {
        let (letter, branch) = (
            &name[..1],
            if name.ends_with('w') {
                "workpiece"
            } else {
                "tool"
            },
        );
        format!(
            "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [-{range:?}, {range:?}]\n"
        )
    };
    let axes: String = axes.iter().map(axis).collect();
    machine(&format!(
        "name = \"of axes\"\n{axes}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [3.0, -5.0, -100.0]\n"
    ))
}

#[test]
fn at_their_points_they_do_with_three_rotary_axes_too() {
    for axes in [
        &[
            ("Yw", 200.0),
            ("Cw", 180.0),
            ("Xt", 300.0),
            ("Zt", 250.0),
            ("Bt", 60.0),
            ("At", 30.0),
        ],
        &[
            ("Xt", 300.0),
            ("Yt", 200.0),
            ("Zt", 250.0),
            ("Ct", 180.0),
            ("Bt", 60.0),
            ("At", 30.0),
        ],
    ] {
        let machine = of_axes(axes);
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [
            ("EA0B", 40e-6),
            ("EX0B", 12e-3),
            ("EZ0A", 7e-3),
            ("EY0C", -9e-3),
            ("EZZ1", 30e-6),
        ] {
            assert!(
                errors.set(&machine, Parameter::parse(name).unwrap(), value),
                "{name}"
            );
        }
        for policy in [Policy::Orientation, Policy::Position] {
            at_their_points(&machine, &errors, policy);
        }
        if axes[0].0 == "Yw" {
            // The tool axis makes the denominator depend on two axes.
            let error = compile(&machine, &errors, &[], &options(Policy::default())).unwrap_err();
            assert!(matches!(error, SchemeError::NoClosedForm), "{error}");
            assert!(error.remedy().contains("--policy orientation"));
        }
    }
}

#[test]
fn what_cannot_be_says_what_would_work() {
    let (huron, errors) = huron();
    let options = options(Policy::Orientation);
    let all: Vec<Parameter> = errors.parameters.keys().copied().collect();
    let error = compile(&huron, &errors, &all, &options).unwrap_err();
    assert!(
        matches!(error, SchemeError::TooManyWeights { held: 16, .. }),
        "{error}"
    );
    let strange = compile(&huron, &errors, &parameters(&["EB0W"]), &options).unwrap_err();
    assert_eq!(
        strange.to_string(),
        "this machine has no error parameter EB0W"
    );
    // Z is mounted on the table that A tilts, so its correction is divided by cos A.
    let axes = [
        ("A", "workpiece"),
        ("Z", "workpiece"),
        ("X", "tool"),
        ("Y", "tool"),
        ("B", "tool"),
    ];
    let text = axes.map(|(name, branch)| {
        format!("[[axis]]\nname = \"{name}\"\nbranch = \"{branch}\"\nrange = [-30.0, 30.0]\n")
    });
    let tilted = format!(
        "name = \"tilted\"\n{}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -100.0]\n",
        text.concat()
    );
    let tilted = machine(&tilted);
    let mut leaning = ErrorModel::perfect(&tilted);
    assert!(leaning.set(&tilted, Parameter::parse("EZX1").unwrap(), 1e-5));
    let error = compile(&tilted, &leaning, &[], &options).unwrap_err();
    assert!(matches!(error, SchemeError::NoClosedForm), "{error}");
    assert!(error.remedy().contains("--scheme exact"));
    let mill = machine(include_str!("../../../../../examples/mill-21/machine.toml"));
    let error = compile(&mill, &ErrorModel::perfect(&mill), &[], &options).unwrap_err();
    assert!(
        matches!(
            error,
            SchemeError::Axes {
                linear: 3,
                rotary: 0,
                ..
            }
        ),
        "{error}"
    );
    assert!(error.remedy().contains("--scheme exact"));
}
