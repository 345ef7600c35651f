//! What the rotary axes correct: the policies of the kinematic correction, compared with cases computed by another
//! program, with the condition of their optimum, and with their guarantees.

use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, Policy, Twist};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_model::validate::holds;
use trueaxis_tests::random_machines::cases;
use trueaxis_tests::{Fixed, errors, machine, read};

const DIRECTION: Policy = Policy::Direction { damping: 0.1 };

/// Rotation perpendicular to the tool axis (rad).
fn direction(machine: &Machine, error: &Twist) -> f64 {
    let mut r = error.r;
    r[machine.tool_axis] = 0.0;
    r.norm()
}

/// The kinematic correction at a position, in the default situation.
fn correction(kinematics: &Kinematics<'_>, q: &PerAxis) -> PerAxis {
    let found = kinematics.correction(q, &Situation::default(), &Switches::ALL);
    found.unwrap_or_else(|e| panic!("{q:?}: {e}")).dq
}

fn error(kinematics: &Kinematics<'_>, q: &PerAxis, dq: &PerAxis) -> Twist {
    kinematics.volumetric_error(q, dq, &Situation::default())
}

fn example(name: &str, file: &str) -> (Machine, ErrorModel) {
    let machine = machine(&format!("examples/{name}/machine.toml"));
    let errors = errors(&format!("examples/{name}/{file}.toml"), &machine);
    (machine, errors)
}

/// Machines with errors, and what an independent program computed of them at forty positions (tests/golden/README.md).
#[test]
fn corrections_and_twists_agree_with_the_golden_cases() {
    for name in ["huron-13", "kolibri-10", "tilted-split"] {
        let file = |end: &str| format!("tests/golden/{name}.{end}");
        let machine = machine(&file("machine.toml"));
        let errors = errors(&file("errors.toml"), &machine);
        let n = machine.axes.len();
        let rows = |end: &str| -> Vec<Vec<f64>> {
            let csv = read(&file(end));
            let rows = csv.lines().skip(1);
            let rows = rows.map(|line| line.split(',').map(|f| f.parse().unwrap()).collect());
            rows.collect()
        };
        let (of_orientation, of_others) = (rows("csv"), rows("policies.csv"));
        assert_eq!([of_orientation.len(), of_others.len()], [40; 2]);
        let policies = [Policy::Orientation, DIRECTION, Policy::Position];
        let kinematics =
            policies.map(|policy| Kinematics::new(&machine, &errors).with_policy(policy));
        let (mut worst, mut twist, mut ratio) = ([0.0_f64; 3], 0.0_f64, 0.0_f64);
        for (one, others) in of_orientation.iter().zip(&of_others) {
            assert_eq!(one[..n], others[..n]);
            let q = machine.to_kinematic(&one[..n]);
            let expected = one[n..2 * n].chunks(n).chain(others[n..].chunks(n));
            for ((kinematics, expected), worst) in kinematics.iter().zip(expected).zip(&mut worst) {
                let dq = machine.to_command(&correction(kinematics, &q));
                for (d, e) in dq.iter().zip(expected) {
                    *worst = worst.max((d - e).abs());
                }
            }
            let before = error(&kinematics[0], &q, &PerAxis::default());
            for (e, expected) in before.to_array().iter().zip(&one[2 * n..]) {
                twist = twist.max((e - expected).abs());
            }
            let dq = correction(&kinematics[1], &q);
            for (dq, expected) in [PerAxis::default(), dq].iter().zip(&others[3 * n..]) {
                let found = direction(&machine, &error(&kinematics[1], &q, dq)) * 1e6;
                ratio = ratio.max((found / expected - 1.0).abs());
            }
        }
        println!("{name}: {worst:?} mm or deg, twists {twist:.1e}, directions {ratio:.1e}");
        assert!(worst.iter().all(|w| *w < 1e-9), "{name}: {worst:?}");
        // Directions are written with nine digits.
        assert!(twist < 1e-11 && ratio < 1e-8, "{name}: {twist} {ratio}");
    }
}

/// Largest residual of Jᵀ·P·r + λ²·Δ (rad), and the tip's largest error (mm).
fn optimum(kinematics: &Kinematics<'_>, damping: f64, q: &PerAxis) -> [f64; 2] {
    let machine = kinematics.machine;
    let dq = correction(kinematics, q);
    let left = error(kinematics, q, &dq);
    let mut r = left.r;
    r[machine.tool_axis] = 0.0;
    let jacobian = kinematics.jacobian(q, None);
    let rows = (0..machine.axes.len()).filter(|i| machine.axes[*i].letter.is_rotary());
    let rest = rows.map(|i| {
        let [.., a, b, c] = jacobian.column(i);
        (a * r.x + b * r.y + c * r.z + damping * damping * dq[i]).abs()
    });
    [rest.fold(0.0, f64::max), left.t.norm()]
}

#[test]
fn the_direction_is_at_its_optimum_and_the_tip_exact() {
    let mut random = Fixed::new(9);
    for damping in [0.01, 0.1, 0.4, 1.0] {
        for (name, file) in [("huron-k2x8", "errors-13"), ("kolibri", "errors-10")] {
            let (machine, errors) = example(name, file);
            let policy = Policy::Direction { damping };
            let kinematics = Kinematics::new(&machine, &errors).with_policy(policy);
            for _ in 0..500 {
                let q = random.position(&machine);
                let [rest, tip] = optimum(&kinematics, damping, &q);
                // The iteration ends with steps of 1e-12 or less; poses of 1 m are accurate to 1e-12 mm.
                assert!(rest < 1e-13 && tip < 1e-11, "{name}: {rest:e} {tip:e}");
            }
        }
    }
}

#[test]
fn rotary_axes_stay_and_the_tip_is_exact_for_the_position() {
    let mut random = Fixed::new(10);
    let (machine, errors) = example("kolibri", "errors-10");
    let kinematics = Kinematics::new(&machine, &errors).with_policy(Policy::Position);
    for _ in 0..500 {
        let q = random.position(&machine);
        let dq = correction(&kinematics, &q);
        for (axis, dq) in machine.axes.iter().zip(dq) {
            assert!(!axis.letter.is_rotary() || dq == 0.0);
        }
        assert!(error(&kinematics, &q, &dq).t.norm() < 1e-11);
    }
}

/// Mean direction error (µrad) without correction, for the orientation, and for the direction with a damping of 0.1, at
/// random positions where no error motion holds; and the number of positions that are worse than without correction,
/// for the orientation and for the direction.
fn means(machine: &Machine, errors: &ErrorModel) -> ([f64; 3], [usize; 2]) {
    const POSITIONS: usize = 2000;
    let mut random = Fixed::new(11);
    let both = [Policy::Orientation, DIRECTION]
        .map(|policy| Kinematics::new(machine, errors).with_policy(policy));
    let (mut sums, mut worse, mut count) = ([0.0; 3], [0; 2], 0);
    while count < POSITIONS {
        let mut q = random.position(machine);
        for (i, q) in q.iter_mut().enumerate().take(machine.axes.len()) {
            if errors.motions[i].iter().any(|m| m.holds()) {
                let [low, high] = errors.calibrated[i];
                *q = random.within(low, high);
            }
        }
        let dq = both.each_ref().map(|k| correction(k, &q));
        if holds(machine, errors, &q, &dq[1]) {
            continue;
        }
        count += 1;
        let before = direction(machine, &error(&both[0], &q, &PerAxis::default()));
        sums[0] += before;
        for k in 0..2 {
            let after = direction(machine, &error(&both[k], &q, &dq[k]));
            sums[k + 1] += after;
            worse[k] += usize::from(after > before);
        }
    }
    (sums.map(|s| s / POSITIONS as f64 * 1e6), worse)
}

#[test]
fn the_direction_gets_better_on_average_by_what_is_known_of_it_and_nowhere_worse() {
    // Means over 60 positions, computed by another program.
    for (name, file, known) in [
        ("huron-k2x8", "errors-13", [88.0, 58.0, 1.7]),
        ("hu40", "errors-13", [23.0, 8.0, 1.4]),
        ("hu40", "errors-84", [234.0, 1015.0, 7.5]),
        ("kolibri", "errors-10", [1111.0, 421.0, 78.0]),
        ("fork-head", "errors-13", [15.0, 10.0, 1.1]),
        ("table-head", "errors-13", [37.0, 10.0, 1.7]),
    ] {
        let (machine, errors) = example(name, file);
        let (found, worse) = means(&machine, &errors);
        println!("{name} {file}: {found:.1?} µrad, worse at {worse:?}");
        assert_eq!(worse[1], 0, "{name} {file}");
        for (found, known) in found.iter().zip(known) {
            // Errors scatter by about their own size: a mean of 60 is accurate to 1/√60 of it, and three times that is
            // 40 %.
            let ratio = found / known;
            assert!(
                (0.6..1.4).contains(&ratio),
                "{name} {file}: {found} {known}"
            );
        }
    }
}

/// Largest growth of |P·r| (rad) at random positions: due to the whole correction, and due to its rotary part alone.
fn growth(kinematics: &Kinematics<'_>, random: &mut Fixed) -> [f64; 2] {
    let machine = kinematics.machine;
    let mut most = [0.0_f64; 2];
    for _ in 0..300 {
        let q = random.position(machine);
        let dq = correction(kinematics, &q);
        let mut linear = dq;
        for (axis, dq) in machine.axes.iter().zip(&mut linear) {
            if axis.letter.is_rotary() {
                *dq = 0.0;
            }
        }
        let size = |dq: &PerAxis| direction(machine, &error(kinematics, &q, dq));
        let after = size(&dq);
        most[0] = most[0].max(after - size(&PerAxis::default()));
        most[1] = most[1].max(after - size(&linear));
    }
    most
}

#[test]
fn the_direction_gets_worse_on_no_machine() {
    // To first order |P·r| cannot grow, because leaving the rotary axes unchanged is among the candidates of the
    // optimum. Second-order effects: rotations add up only while they are small, which with a damping of 0.01 restricts
    // them to 7 mrad and more; and, without any rotary axis, linear axes with angular motions rotate the tool while
    // they make the tip exact.
    let mut random = Fixed::new(12);
    for case in cases(300) {
        for (damping, whole, turning) in [
            (0.01, 5e-6, 5e-6),
            (random.within(0.01, 0.1), 1e-6, 1e-6),
            (0.1, 1e-6, 2e-8),
            (1.0, 1e-6, 2e-8),
        ] {
            let kinematics = Kinematics::new(&case.machine, &case.errors);
            let kinematics = kinematics.with_policy(Policy::Direction { damping });
            let found = growth(&kinematics, &mut random);
            assert!(
                found[0] < whole && found[1] < turning,
                "{} with {damping}: {found:?} rad",
                case.seed
            );
        }
    }
}

/// Deviation of the correction at random rotary positions from an affine function of the linear axes (mm, rad).
fn bend(kinematics: &Kinematics<'_>, random: &mut Fixed) -> PerAxis {
    let machine = kinematics.machine;
    let q = random.position(machine);
    let linear: Vec<usize> = (0..machine.axes.len())
        .filter(|i| !machine.axes[*i].letter.is_rotary())
        .collect();
    let at = |fractions: &[f64]| {
        let mut q = q;
        for (i, f) in linear.iter().zip(fractions) {
            q[*i] = f * 300.0;
        }
        correction(kinematics, &q)
    };
    let fractions: Vec<f64> = linear.iter().map(|_| random.within(-1.0, 1.0)).collect();
    let origin = at(&vec![0.0; linear.len()]);
    let whole = at(&fractions);
    let mut sum = origin;
    for (k, f) in fractions.iter().enumerate() {
        let mut end = vec![0.0; linear.len()];
        end[k] = 1.0;
        let end = at(&end);
        for (s, (e, o)) in sum.iter_mut().zip(end.iter().zip(&origin)) {
            *s += f * (e - o);
        }
    }
    std::array::from_fn(|i| (whole[i] - sum[i]).abs())
}

#[test]
fn the_correction_is_affine_in_linear_axes_and_independent_of_the_table_s_own_turn() {
    let mut random = Fixed::new(13);
    let (machine, errors) = example("huron-k2x8", "errors-13");
    let kinematics = Kinematics::new(&machine, &errors).with_policy(DIRECTION);
    let (mut bends, mut turns) = ([0.0_f64; 2], [0.0_f64; 2]);
    let c = machine.index('C').unwrap();
    for _ in 0..500 {
        let bend = bend(&kinematics, &mut random);
        let mut q = random.position(&machine);
        let one = correction(&kinematics, &q);
        q[c] = random.within(-6.0, 6.0);
        let other = correction(&kinematics, &q);
        for (i, axis) in machine.axes.iter().enumerate() {
            let rotary = usize::from(axis.letter.is_rotary());
            bends[rotary] = bends[rotary].max(bend[i]);
            turns[rotary] = turns[rotary].max((one[i] - other[i]).abs());
        }
    }
    println!("{bends:?} {turns:?}");
    // Rounding alone: of angles, and of poses of half a metre, which are accurate to 6e-14 mm each.
    for [linear, rotary] in [bends, turns] {
        assert!(rotary < 1e-13, "{rotary:e} rad");
        assert!(linear < 1e-12, "{linear:e} mm");
    }
}
