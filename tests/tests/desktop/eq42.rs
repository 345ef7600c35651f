//! The closed forms of the source document compared with the general code: the control Jacobian of wCAYFXZt (Eq. 42),
//! its pseudo-inverse (Eq. 43) and the corrections of the 45° machine (Eq. 59), as printed where correct, and corrected
//! where misprinted.

use trueaxis_model::errors::{ErrorModel, Parameter, Situation};
use trueaxis_model::kinematics::{Kinematics, Linearised, Policy, Twist};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_tests::{Fixed, machine, read};

/// Rounding of a dozen operations in f64, relative to the largest entry.
const EXACT: f64 = 1e-12;

/// Axes in the order of the document.
const ORDER: [char; 5] = ['X', 'Y', 'Z', 'A', 'C'];

fn of(machine: &Machine, q: &PerAxis, letter: char) -> f64 {
    q[machine.index(letter).unwrap()]
}

/// The Kolibri as in Chapters 5 and 6: all frames aligned, the tip in the Z-axis frame.
fn aligned() -> Machine {
    let text = read("tests/golden/kolibri-10.machine.toml");
    Machine::from_toml(&text.replace("[0.0, 0.0, -74.0]", "[0.0, 0.0, 0.0]")).unwrap()
}

/// The correction that reverses an error: −J⁺·E.
fn correct(kinematics: &Kinematics<'_>, q: &PerAxis, error: &Twist) -> PerAxis {
    let jacobian = kinematics.jacobian(q, None);
    jacobian.solver(Policy::Orientation).unwrap().correct(error)
}

fn close(found: f64, expected: f64, scale: f64, what: &str) {
    let allowed = EXACT * scale.max(1.0);
    assert!(
        (found - expected).abs() <= allowed,
        "{what}: {found} instead of {expected}"
    );
}

#[test]
fn the_control_jacobian_is_that_of_eq_42() {
    let machine = aligned();
    let errors = ErrorModel::perfect(&machine);
    let kinematics = Kinematics::new(&machine, &errors);
    let mut random = Fixed::new(42);
    for _ in 0..200 {
        let q = random.position(&machine);
        let [x, y, z, a, _] = ORDER.map(|l| of(&machine, &q, l));
        let (s, c) = a.sin_cos();
        let expected = [
            [1.0, 0.0, 0.0, 0.0, s * z - c * y],
            [0.0, -1.0, 0.0, z, -c * x],
            [0.0, 0.0, 1.0, y, -s * x],
            [0.0, 0.0, 0.0, -1.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, s],
            [0.0, 0.0, 0.0, 0.0, -c],
        ];
        let jacobian = kinematics.jacobian(&q, None);
        for (k, letter) in ORDER.into_iter().enumerate() {
            let column = jacobian.column(machine.index(letter).unwrap());
            for (row, found) in column.into_iter().enumerate() {
                close(
                    found,
                    expected[row][k],
                    1e3,
                    &format!("row {row}, {letter}"),
                );
            }
        }
    }
}

#[test]
fn the_block_solution_is_the_pseudo_inverse_of_eq_43_with_two_entries_corrected() {
    let machine = aligned();
    let errors = ErrorModel::perfect(&machine);
    let kinematics = Kinematics::new(&machine, &errors);
    let mut random = Fixed::new(43);
    let mut misprints = [0.0_f64; 2];
    for _ in 0..200 {
        let q = random.position(&machine);
        let [x, y, z, a, _] = ORDER.map(|l| of(&machine, &q, l));
        let (s, c) = a.sin_cos();
        let lever = c * y - s * z;
        let mut expected = [
            [1.0, 0.0, 0.0, 0.0, s * lever, -c * lever],
            [0.0, -1.0, 0.0, -z, s * lever, c * c * x],
            [0.0, 0.0, 1.0, y, s * s * x, -c * s * x],
            [0.0, 0.0, 0.0, -1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, s, c],
        ];
        let printed = [expected[1][4], expected[4][5]];
        expected[1][4] = -c * s * x;
        expected[4][5] = -c;
        for (k, (p, e)) in printed
            .into_iter()
            .zip([expected[1][4], expected[4][5]])
            .enumerate()
        {
            misprints[k] = misprints[k].max((p - e).abs());
        }
        for column in 0..6 {
            let mut e = [0.0; 6];
            e[column] = 1.0;
            let error = Twist {
                t: [e[0], e[1], e[2]].into(),
                r: [e[3], e[4], e[5]].into(),
            };
            let correction = correct(&kinematics, &q, &error);
            for (row, letter) in ORDER.into_iter().enumerate() {
                let what = format!("{letter} for component {column}");
                close(
                    -of(&machine, &correction, letter),
                    expected[row][column],
                    1e3,
                    &what,
                );
            }
        }
    }
    assert!(
        misprints.iter().all(|m| *m > 0.1),
        "the printed entries are right after all"
    );
}

/// Position, tool length, and sine and cosine of A and of twice A.
#[derive(Clone, Copy)]
struct At {
    x: f64,
    y: f64,
    z: f64,
    t: f64,
    s: f64,
    c: f64,
    s2: f64,
    c2: f64,
}

const R: f64 = std::f64::consts::SQRT_2;

/// One line of Eq. 59, as printed: ΔX, ΔY, ΔZ, ΔA, ΔC per unit of the error.
type Line = fn(At) -> [f64; 5];

const EQ_59: [(&str, Line); 13] = [
    ("EC0X", |p| {
        [
            (p.y * (p.c2 - 3.0) + R * p.s2 * (p.z - p.t)) / 4.0,
            (p.c.powi(2) - 1.0) * (p.t - p.z - p.x) / 2.0,
            (p.y * (1.0 - p.c2) - R * p.x * p.s2) / 4.0,
            R / 2.0 * (p.c - 1.0),
            -p.c,
        ]
    }),
    ("EA0Z", |p| {
        [
            (p.y * (p.c2 - 1.0) + R * p.s2 * (p.t - p.z)) / 4.0,
            (1.0 - p.c.powi(2)) * (p.x + p.z - p.t) / 2.0,
            (p.y * (3.0 + p.c2) + R * p.x * p.s2) / 4.0,
            -R / 2.0 * (p.c + 1.0),
            p.c,
        ]
    }),
    ("EB0Z", |p| {
        [
            (-2.0 * p.c * (p.t - p.z) - R * p.y * p.s) / 4.0,
            p.s2 * (p.t - p.x - p.z) / 2.0,
            R * p.s * (p.y * p.c + R * p.x * p.s2) / 2.0,
            -p.s,
            R * p.s,
        ]
    }),
    ("EB0A", |p| {
        [
            p.c * (p.c * (p.t - p.z) - R * p.y * p.s) / 2.0,
            R * p.s2 * (p.x + p.z - p.t) / 4.0,
            p.c * (2.0 * p.x * p.c - R * p.y * p.s) / 2.0,
            p.s,
            -R * p.s,
        ]
    }),
    ("EC0A", |p| {
        [
            (-R * p.y * (p.c2 - 1.0) + 2.0 * p.s2 * (p.t - p.z)) / 4.0,
            -R * p.s.powi(2) * (p.x + p.z - p.t) / 2.0,
            (R * p.y * p.c.powi(2) + p.x * p.s2) / 2.0,
            -p.c,
            R * p.c,
        ]
    }),
    ("EY0C", |p| [R / 2.0 * p.s, p.c, -R / 2.0 * p.s, 0.0, 0.0]),
    ("EA0C", |_| [0.0, 0.0, 0.0, R, -1.0]),
    ("EB0C", |p| {
        [
            p.c * (p.t - p.z) - R / 2.0 * p.y * p.s,
            R / 2.0 * p.s * (p.x + p.z - p.t),
            p.x * p.c,
            0.0,
            0.0,
        ]
    }),
    ("EX0S", |_| [1.0, 0.0, 0.0, 0.0, 0.0]),
    ("EZ0S", |_| [0.0, -1.0, 0.0, 0.0, 0.0]),
    ("EXX1", |p| [p.x, 0.0, 0.0, 0.0, 0.0]),
    ("EYY1", |p| [0.0, p.y, 0.0, 0.0, 0.0]),
    ("EZZ1", |p| [0.0, 0.0, p.z, 0.0, 0.0]),
];

/// One entry, per unit of the error.
type Entry = fn(At) -> f64;

/// What is right in the place of the misprinted entries: the line, the place, and the entry.
const RIGHT: [(&str, usize, Entry); 10] = [
    ("EC0X", 0, |p| {
        (-p.y * (p.c2 + 3.0) + R * p.s2 * (p.z - p.t)) / 4.0
    }),
    ("EC0X", 1, |p| (1.0 - p.c.powi(2)) * (p.t - p.z - p.x) / 2.0),
    ("EB0Z", 0, |p| {
        p.c.powi(2) * (p.z - p.t) + R * p.y * p.s2 / 4.0
    }),
    ("EB0Z", 1, |p| R * p.s2 * (p.t - p.x - p.z) / 4.0),
    ("EB0Z", 2, |p| p.x * p.s.powi(2) + R * p.y * p.s2 / 4.0),
    ("EB0A", 0, |p| {
        p.c.powi(2) * (p.t - p.z) - R * p.y * p.s2 / 4.0
    }),
    ("EC0A", 0, |p| {
        (R * p.y * (p.c2 - 1.0) + 2.0 * p.s2 * (p.t - p.z)) / 4.0
    }),
    ("EC0A", 1, |p| R * p.s.powi(2) * (p.x + p.z - p.t) / 2.0),
    ("EC0A", 2, |p| (p.x * p.s2 - R * p.y * p.s.powi(2)) / 2.0),
    ("EB0C", 2, |p| p.x * p.c - R * p.y * p.s / 2.0),
];

#[test]
fn the_corrections_of_eq_59_agree_and_its_ten_misprints_do_not() {
    let machine = machine("tests/golden/huron-13.machine.toml");
    let errors = ErrorModel::perfect(&machine);
    let kinematics = Kinematics::new(&machine, &errors);
    let mut random = Fixed::new(59);
    let mut misprints = [0.0_f64; RIGHT.len()];
    for _ in 0..200 {
        let q = random.position(&machine);
        let [x, y, z, a, _] = ORDER.map(|l| of(&machine, &q, l));
        let ((s, c), (s2, c2)) = (a.sin_cos(), (2.0 * a).sin_cos());
        let at = At {
            x,
            y,
            z,
            t: machine.tip[1],
            s,
            c,
            s2,
            c2,
        };
        let linearised = Linearised::new(&kinematics, &q, &Situation::default());
        for (name, line) in EQ_59 {
            let error = linearised.column(Parameter::parse(name).unwrap()).unwrap();
            // Eq. 51: the motion equivalent to the error, +J⁺·E.
            let found = ORDER.map(|l| -of(&machine, &correct(&kinematics, &q, &error), l));
            let mut expected = line(at);
            for ((_, place, entry), most) in
                RIGHT.iter().zip(&mut misprints).filter(|r| r.0.0 == name)
            {
                let right = entry(at);
                *most = most.max((expected[*place] - right).abs());
                expected[*place] = right;
            }
            for place in 0..5 {
                let what = format!("{name}, Δ{}", ORDER[place]);
                close(found[place], expected[place], 1e3, &what);
            }
        }
    }
    // Hundreds of mm per rad or more, so not rounding.
    assert!(misprints.iter().all(|most| *most > 10.0), "{misprints:?}");
}
