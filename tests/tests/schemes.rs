//! The schemes of the source document against what is known of them from outside.

use trueaxis_host::compile::{self, Compiled};
use trueaxis_host::errors::{ErrorModel, Parameter};
use trueaxis_host::kinematics::Policy;
use trueaxis_host::machine::Machine;
use trueaxis_host::reproduce::{TABLE_6_2 as CASES, WITHOUT_REST as LINEAR};
use trueaxis_host::schemes::grid3d::Rms;
use trueaxis_host::schemes::{self, Scheme, SchemeError, grid3d, poly25, trigo23};
use trueaxis_host::target::Target;
use trueaxis_host::validate::Statistics;
use trueaxis_tests::{errors, machine};

/// The Kolibri, with A within so many degrees.
fn kolibri(a: f64) -> Machine {
    let mut machine = machine("examples/kolibri/machine.toml");
    let index = machine.index('A').unwrap();
    machine.axes[index].travel = [-a, a];
    machine
}

/// The same with the tip in the frame of Z, where the document has it.
fn without_tool(a: f64) -> Machine {
    let mut machine = kolibri(a);
    machine.tip = [0.0; 3];
    machine
}

fn alone(machine: &Machine, name: &str, value: f64) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    assert!(errors.set(machine, Parameter::parse(name).unwrap(), value));
    errors
}

/// As the document corrects, on a controller with room for all.
fn compiled(machine: &Machine, errors: &ErrorModel, scheme: Scheme, points: usize) -> Compiled {
    let options = compile::Options {
        scheme,
        tables: schemes::Options {
            policy: Policy::Orientation,
            points: Some(points),
            target: Target::desktop(),
            ..schemes::Options::default()
        },
        random: 4000,
        ..compile::Options::default()
    };
    compile::compile(machine, errors, &options, &()).unwrap()
}

/// The translation (µm) before and after.
fn translation(compiled: &Compiled) -> [Statistics; 2] {
    let travel = &compiled.proof.travel;
    [&travel.before, &travel.after].map(|quality| quality.translation_um)
}

fn trigo23(free: bool) -> Scheme {
    Scheme::Trigo23(trigo23::Wanted { free, nodes: 10 })
}

fn fik() -> Scheme {
    Scheme::Fik {
        adjustable: Vec::new(),
    }
}

#[test]
fn the_free_form_with_101_points_leaves_a_twentieth_of_a_micrometre_of_every_case() {
    let machine = kolibri(120.0);
    for (name, value) in CASES {
        let errors = alone(&machine, name, value);
        let compiled = compiled(&machine, &errors, trigo23(true), 101);
        assert_eq!(compiled.built.size.tables, 23);
        let [before, after] = translation(&compiled);
        assert!(before.mean > 3.0, "{name}: {before:?}");
        // 101 points of 240° leave 5.5e-4 of a sine in 2A: 0.05 µm of 80 µm.
        assert!(after.mean <= 0.05 && after.max <= 0.1, "{name}: {after:?}");
    }
}

#[test]
fn fik_leaves_a_twentieth_of_a_micrometre_of_every_case_with_101_points() {
    let machine = kolibri(120.0);
    for (name, value) in CASES {
        let errors = alone(&machine, name, value);
        let [_, left] = translation(&compiled(&machine, &errors, fik(), 101));
        println!(
            "{name}, 101 points: mean {:.4}, max {:.4} µm",
            left.mean, left.max
        );
        assert!(left.mean <= 0.05 && left.max <= 0.1, "{name}: {left:?}");
    }
}

#[test]
fn the_documents_ten_points_cost_fik_what_they_cost_a_sine() {
    let machine = kolibri(120.0);
    let step = 240_f64.to_radians() / 9.0;
    for (name, value) in CASES {
        let errors = alone(&machine, name, value);
        let [before, left] = translation(&compiled(&machine, &errors, fik(), 10));
        println!(
            "{name}, 10 points: mean {:.3}, max {:.3} of {:.1} µm",
            left.mean, left.max, before.max
        );
        // A chord is off by 1 − cos(h/2) of a sine, 2.7 %, and of twice the angle by 11 %: of the largest lever
        // (half of 420 mm, with 240 + 74 mm above it, and 130 mm aside) twice, in two outputs.
        let chord = 1.0 - step.cos();
        assert!(
            left.max <= 0.1 + chord * before.max * 2.0,
            "{name}: {left:?} {before:?}"
        );
        if name == "EB0C" {
            assert!(left.max > 1.0, "ten points are no hundred: {left:?}");
        }
    }
}

#[test]
fn the_printed_form_holds_all_cases_but_the_offset_of_a_rotary_axis() {
    let machine = without_tool(120.0);
    for (name, value) in CASES {
        let errors = alone(&machine, name, value);
        let [_, after] = translation(&compiled(&machine, &errors, trigo23(false), 1001));
        if name == "EY0C" {
            // No term of Eq. 44 turns with A but does not grow with a linear position.
            assert!(after.mean > 1.5 && after.max > 8.0, "{name}: {after:?}");
        } else {
            // The second order of 0.4 mrad at 400 mm is 0.064 µm.
            assert!(after.max < 0.064, "{name}: {after:?}");
        }
    }
}

#[test]
fn the_cubic_polynomials_leave_nothing_of_what_is_linear_and_much_of_the_rest() {
    let poly25 = |objective| {
        Scheme::Poly25(poly25::Wanted {
            objective,
            nodes: 10,
        })
    };
    let machine = kolibri(55.0);
    for (name, value) in CASES {
        let errors = alone(&machine, name, value);
        let scheme = poly25(poly25::Objective::Corrections);
        let compiled = compiled(&machine, &errors, scheme, 50);
        assert_eq!(compiled.built.size.tables, 25);
        let [before, after] = translation(&compiled);
        let left = after.mean / before.mean;
        if LINEAR.contains(&name) {
            // A cubic polynomial misses a cosine by 0.4 % over ±55°.
            assert!(left < 5e-3, "{name}: {left}");
        } else {
            // Found by another program: 34 to 87 % of the mean.
            assert!((0.335..0.875).contains(&left), "{name}: {left}");
        }
    }
    // The other objective, by the same program: 13 % of EB0C over ±55°, 65 % over ±120°, next to nothing of the other
    // four. Its tool and its travels are not known, and they count: without a tool it is 10 and 59 % here.
    for (range, expected, slack) in [(55.0, 0.13, 0.03), (120.0, 0.65, 0.06)] {
        let machine = kolibri(range);
        for name in ["EB0A", "EC0A", "EB0C", "EC0X", "EB0Z"] {
            let errors = alone(&machine, name, 0.4e-3);
            let scheme = poly25(poly25::Objective::Error);
            let [before, after] = translation(&compiled(&machine, &errors, scheme, 50));
            let left = after.mean / before.mean;
            match name {
                "EB0C" => assert!((left - expected).abs() < slack, "{range}: {left}"),
                _ => assert!(left < 0.01, "{range}, {name}: {left}"),
            }
        }
    }
}

fn sized(errors_file: &str, wanted: grid3d::Wanted) -> Result<([u32; 3], Compiled), SchemeError> {
    let machine = machine("examples/hu40/machine.toml");
    let mut errors = errors(errors_file, &machine);
    // The zone of the grid is that of the calibration in the document.
    for (calibrated, axis) in errors.calibrated.iter_mut().zip(&machine.axes) {
        *calibrated = axis.travel.map(|t| axis.to_kinematic(t));
    }
    let options = compile::Options {
        scheme: Scheme::Grid3d(wanted),
        tables: schemes::Options {
            policy: Policy::Position,
            ..schemes::Options::default()
        },
        random: 2000,
        allow_large: true,
        ..compile::Options::default()
    };
    let found = schemes::find(&machine, &errors, &options.scheme, &options.tables)?;
    let sizes: Vec<u32> = found.draft.grids[0].axes.iter().map(|a| a.points).collect();
    let compiled = compile::compile(&machine, &errors, &options, &()).unwrap();
    Ok((sizes.try_into().unwrap(), compiled))
}

#[test]
fn two_nodes_along_each_axis_are_enough_for_13_errors() {
    let (sizes, compiled) =
        sized("examples/hu40/errors-13.toml", grid3d::Wanted::default()).unwrap();
    assert_eq!(sizes, [2; 3]);
    let held = compiled.proof.held.as_ref().unwrap();
    assert_eq!(held.axes, [('B', 0.0), ('C', 0.0)]);
    assert!(held.found.before.translation_um.max > 20.0);
    assert!(held.found.after.translation_um.max < 0.01);
}

#[test]
fn the_84_coefficients_need_the_nodes_that_the_document_reports() {
    let errors = "examples/hu40/errors-84.toml";
    let (sizes, _) = sized(errors, grid3d::Wanted::default()).unwrap();
    // 14 and 19 in the document, for parameters and zones of its own; 12 and 15 by another program.
    assert!(sizes.iter().all(|n| (10..=25).contains(n)), "{sizes:?}");
    assert_eq!(sizes[0], sizes[1]);
    let wanted = |rms, per_axis| grid3d::Wanted {
        rms,
        per_axis,
        ..grid3d::Wanted::default()
    };
    let (by_axis, _) = sized(errors, wanted(Rms::Usual, true)).unwrap();
    assert!(by_axis.iter().zip(sizes).all(|(one, all)| *one <= all + 1));
    assert!(by_axis.iter().product::<u32>() < sizes.iter().product::<u32>());
    // As Eq. 12 is printed, the threshold is 45 times as coarse.
    let (printed, _) = sized(errors, wanted(Rms::Printed, false)).unwrap();
    assert!(printed[0] < sizes[0], "{printed:?}");
    let few = grid3d::Wanted {
        most: 9,
        ..grid3d::Wanted::default()
    };
    let error = sized(errors, few).unwrap_err();
    let SchemeError::Threshold { change_um, .. } = error else {
        panic!("{error}");
    };
    assert!(change_um > 0.1);
}

/// Machines of two rotary axes, with their errors.
const EXAMPLES: [(&str, &str); 10] = [
    ("five-axis-30/machine", "five-axis-30/errors-30"),
    ("fork-head/machine", "fork-head/errors-13"),
    ("hu40/machine", "hu40/errors-13"),
    ("hu40/machine", "hu40/errors-84"),
    ("huron-k2x8/machine", "huron-k2x8/errors-13"),
    ("huron-k2x8/machine-tool-length", "huron-k2x8/errors-13"),
    ("kolibri/machine", "kolibri/errors-12"),
    ("kolibri/machine", "kolibri/errors-81"),
    (
        "linuxcnc-xyzac-trt/machine-endless",
        "linuxcnc-xyzac-trt/errors-11",
    ),
    ("table-head/machine", "table-head/errors-13"),
];

#[test]
fn every_scheme_takes_every_machine_with_two_rotary_axes_under_every_policy() {
    for (machine_file, errors_file) in EXAMPLES {
        let machine = machine(&format!("examples/{machine_file}.toml"));
        let errors = errors(&format!("examples/{errors_file}.toml"), &machine);
        for policy in [Policy::default(), Policy::Orientation, Policy::Position] {
            for mut scheme in Scheme::every() {
                let name = scheme.name();
                let tables = match name.as_str() {
                    "grid3d" => 0,
                    "poly25" => 25,
                    "trigo23" | "trigo23:free" => 23,
                    _ => continue,
                };
                match &mut scheme {
                    Scheme::Grid3d(wanted) => wanted.threshold = 2e-3,
                    Scheme::Poly25(wanted) => wanted.nodes = 4,
                    Scheme::Trigo23(wanted) => wanted.nodes = 4,
                    _ => {}
                }
                let options = compile::Options {
                    scheme,
                    tables: schemes::Options {
                        policy,
                        target: Target::desktop(),
                        ..schemes::Options::default()
                    },
                    allow_large: true,
                    random: 200,
                    ..compile::Options::default()
                };
                let compiled = compile::compile(&machine, &errors, &options, &());
                let compiled = compiled.unwrap_or_else(|e| panic!("{errors_file}, {name}: {e}"));
                let found = compiled.built.size.tables;
                assert_eq!(found, tables, "{errors_file}, {name}");
                assert_eq!(compiled.proof.held.is_some(), name == "grid3d");
                if policy == Policy::Position {
                    for (axis, largest) in machine.axes.iter().zip(&compiled.proof.travel.largest) {
                        assert!(
                            !axis.letter.is_rotary() || *largest == 0.0,
                            "{errors_file}, {name}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn what_is_subtracted_at_a_position_is_subtracted_from_every_scheme() {
    let machine = machine("examples/huron-k2x8/machine.toml");
    let errors = errors("examples/huron-k2x8/errors-13.toml", &machine);
    for scheme in Scheme::every() {
        let [with, without] = [Some(vec![10.0, 20.0, 30.0, 40.0, 50.0]), None].map(|zero_at| {
            let options = compile::Options {
                scheme: scheme.clone(),
                tables: schemes::Options {
                    policy: Policy::Orientation,
                    zero_at,
                    ..schemes::Options::default()
                },
                random: 1000,
                ..compile::Options::default()
            };
            let compiled = compile::compile(&machine, &errors, &options, &()).unwrap();
            let inside = compiled.proof.inside();
            [inside.difference_um, inside.difference_urad]
        });
        // The same tables but for a constant: the same differences but for rounding of f32 and, of `exact`, its choice.
        for (with, without) in with.into_iter().zip(without) {
            let near = (with - without).abs() < 1e-3 || scheme.keeps_tolerance() && with < 0.05;
            assert!(near, "{}: {with} {without}", scheme.name());
        }
    }
}
