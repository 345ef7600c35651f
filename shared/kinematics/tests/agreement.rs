//! Compares both implementations of sine and cosine with the same stored corrections: with the feature `std`, which was
//! used to write them, and without.

use std::f64::consts::FRAC_PI_4;
use trueaxis_kinematics::{
    Axis, Branch, ErrorModel, Htm, Kinematics, Letter, Machine, Parameter, PerAxis, Policy,
    Situation, Switches, Table,
};

const GOLDEN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/golden/five-axis.csv");
const POSITIONS: usize = 500;

/// The Huron K2X8-Five: wCAYFXZSt, A tilted by 45°; here C is endless.
fn machine() -> Machine {
    let mut machine = Machine::new(&[
        Axis::new(Letter::Y, Branch::Workpiece, [-350.0, 350.0]),
        Axis::new(Letter::A, Branch::Workpiece, [-120.0, 120.0])
            .at([0.0, 0.0, 0.0, 0.0, -FRAC_PI_4, 0.0]),
        Axis {
            modulo: true,
            ..Axis::new(Letter::C, Branch::Workpiece, [-180.0, 180.0])
        },
        Axis::new(Letter::X, Branch::Tool, [-325.0, 325.0]),
        Axis::new(Letter::Z, Branch::Tool, [-100.0, 400.0]),
    ])
    .unwrap();
    machine.spindle = Htm::from_xyz_abc([0.0, 0.0, 0.0, -2.0 * FRAC_PI_4, 0.0, 0.0]);
    machine.tool_axis = 1;
    machine.tip = [0.0, 130.0, 0.0];
    machine.check().unwrap();
    machine
}

/// Thirteen published errors, and some of every other kind.
fn errors(machine: &Machine) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    for (name, value) in [
        ("EZ0S", 55.6e-3),
        ("EA0Z", 106.0e-6),
        ("EZZ1", 30.0e-6),
        ("EB0A", 39.1e-6),
        ("EA0C", 33.8e-6),
        ("EC0X", -32.0e-6),
        ("EB0Z", 22.0e-6),
        ("EB0C", -14.6e-6),
        ("EXX1", 25.9e-6),
        ("EX0S", -2.1e-3),
        ("EYY1", -14.3e-6),
        ("EC0A", 5.5e-6),
        ("EY0C", 1.0e-3),
        ("EYX3", 2e-10),
        ("EAY2", 3e-10),
        ("EXCc1", 2e-3),
        ("EZCs2", -1e-3),
        ("EBCc8", 8e-6),
        ("EXA2", 3e-3),
        ("EAAb", -13e-6),
    ] {
        let parameter = Parameter::parse(name).unwrap();
        assert!(errors.set(machine, parameter, value), "{name}");
    }
    let table = Table {
        at: &[-100.0, 150.0, 400.0][..],
        positive: &[0.002, 0.0, -0.003],
        negative: Some(&[-0.001, 0.0, -0.004]),
    };
    assert!(errors.tabulate(4, 1, table));
    errors
}

/// Corrections (mm, rad) at fixed positions, over the travel of every axis.
fn corrections() -> Vec<PerAxis> {
    let machine = machine();
    let errors = errors(&machine);
    let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Orientation);
    (1..=POSITIONS)
        .map(|number| {
            // Multiples of irrational numbers fill the travels evenly.
            let part = |k: usize| {
                let step = [
                    0.414_213_562,
                    0.732_050_808,
                    0.236_067_977,
                    0.645_751_311,
                    0.316_624_79,
                ];
                (number as f64 * step[k]).fract()
            };
            let mut q = [0.0; 5];
            let mut situation = Situation::default();
            for (k, axis) in machine.axes.iter().enumerate() {
                let [low, high] = axis.travel;
                q[k] = low + (high - low) * part(k);
                situation.sign[k] = if number >> k & 1 == 0 { 1.0 } else { -1.0 };
            }
            let q = machine.to_kinematic(&q);
            kinematics
                .correction(&q, &situation, &Switches::ALL)
                .unwrap()
                .dq
        })
        .collect()
}

#[test]
fn corrections_with_either_source_of_sine_agree() {
    // TRUEAXIS_WRITE_GOLDEN=1 rewrites them with the platform's sine.
    #[cfg(feature = "std")]
    if std::env::var_os("TRUEAXIS_WRITE_GOLDEN").is_some() {
        write();
    }
    let golden = std::fs::read_to_string(GOLDEN).unwrap();
    let golden: Vec<Vec<f64>> = golden
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|v| v.parse().unwrap()).collect())
        .collect();
    assert_eq!(golden.len(), POSITIONS);
    let mut worst = 0.0_f64;
    for (found, expected) in corrections().iter().zip(&golden) {
        for (f, e) in found.iter().zip(expected) {
            worst = worst.max((f - e).abs());
        }
    }
    println!("corrections agree to {worst:.1e} mm or rad");
    // Sines differ in the last place, 1e-16, at lever arms of half a metre, a dozen times.
    assert!(worst < 1e-12, "corrections differ by {worst:e} mm or rad");
}

#[cfg(feature = "std")]
fn write() {
    use std::fmt::Write;
    let mut csv = "dY,dA,dC,dX,dZ\n".to_owned();
    for dq in corrections() {
        let row: Vec<String> = dq[..5].iter().map(|d| format!("{d:e}")).collect();
        writeln!(csv, "{}", row.join(",")).unwrap();
    }
    std::fs::write(GOLDEN, csv).unwrap();
}
