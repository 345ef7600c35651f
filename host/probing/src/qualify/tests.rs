use super::*;
use crate::probe_file::Spherical;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use trueaxis_kinematics::Nominal;
use trueaxis_model::numbers::normal;

const BALL: f64 = 10.0;
const NOISE: f64 = 5e-4;

/// Table A and C, spindle on X, Y, Z.
fn machine() -> Machine {
    let axis = |name: &str, branch: &str| {
        format!("[[axis]]\nname = \"{name}\"\nbranch = \"{branch}\"\nrange = [-300.0, 300.0]\n")
    };
    let text = format!(
        "name = \"m\"\n{}{}{}{}{}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -100.0]\n",
        axis("A", "workpiece"),
        axis("C", "workpiece"),
        axis("X", "tool"),
        axis("Y", "tool"),
        axis("Z", "tool"),
    );
    Machine::from_toml(&text).unwrap()
}

struct Truth {
    tip: Vector3<f64>,
    centre: Vector3<f64>,
    radius: f64,
    shape: Spherical,
}

fn truth() -> Truth {
    let lobe = |order, cosine, sine| Lobe {
        order,
        cosine,
        sine,
        uncertainty: 0.0,
    };
    Truth {
        tip: Vector3::new(0.021, -0.013, -100.34),
        centre: Vector3::new(60.2, 20.1, 30.3),
        radius: 2.987,
        shape: Spherical {
            pole: -0.006,
            lobes: vec![lobe(2, 5e-4, 0.0), lobe(3, 4e-3, -2e-3)],
        },
    }
}

/// Touches of a ball at positions of A and C, at latitudes (deg), with 12 directions around; the linear axes are where
/// the tip is at its effective radius from the ball.
fn touches(
    truth: &Truth,
    positions: &[[f64; 2]],
    latitudes: &[f64],
    noise: f64,
    seed: u64,
) -> Vec<PerAxis> {
    let machine = machine();
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut all = Vec::new();
    for [a, c] in positions {
        let at = [*a, *c, 0.0, 0.0, 0.0, 0.0];
        let q = machine.to_kinematic(&at);
        let carriers = Nominal::new(&machine).carriers(&q);
        // The spindle does not turn, so that directions in its frame are those of the foundation.
        let place = carriers.workpiece.r * truth.centre + carriers.workpiece.t;
        for latitude in latitudes {
            let count = if *latitude == 90.0 { 1 } else { 12 };
            for k in 0..count {
                let around = k as f64 * std::f64::consts::TAU / f64::from(count);
                let height = latitude.to_radians();
                let out = Vector3::new(
                    libm::cos(height) * libm::cos(around),
                    libm::cos(height) * libm::sin(around),
                    libm::sin(height),
                );
                let distance = BALL
                    + truth.radius
                    + truth.shape.deviation(around, height)
                    + noise * normal(&mut random);
                let spindle = place + out * distance - truth.tip;
                all.push([*a, *c, spindle.x, spindle.y, spindle.z, 0.0]);
            }
        }
    }
    all
}

fn known() -> ProbePriors {
    ProbePriors {
        radius: BALL,
        radius_uncertainty: 0.0,
        place: None,
        tip: Vector3::new(0.0, 0.0, -100.0),
        stylus: None,
        orders: 4,
    }
}

const SEVERAL: [[f64; 2]; 3] = [[0.0, 0.0], [40.0, 0.0], [0.0, 120.0]];
const LATITUDES: [f64; 3] = [90.0, 10.0, 45.0];

fn pairs(found: &Qualified, truth: &Truth) -> Vec<(String, f64, f64)> {
    let file = &found.file;
    let mut pairs = vec![
        (
            "radius".to_owned(),
            file.radius - truth.radius,
            file.radius_uncertainty,
        ),
        (
            "pole".to_owned(),
            file.shape.pole - truth.shape.pole,
            file.pole_uncertainty,
        ),
    ];
    for k in 0..3 {
        if let (Some(tip), Some(uncertainty)) = (file.tip[k], found.tip_uncertainty[k]) {
            pairs.push((format!("tip {k}"), tip - truth.tip[k], uncertainty));
        }
    }
    for lobe in &file.shape.lobes {
        let real = truth
            .shape
            .lobes
            .iter()
            .find(|real| real.order == lobe.order);
        let [cosine, sine] = real.map_or([0.0; 2], |real| [real.cosine, real.sine]);
        for (name, off) in [("cos", lobe.cosine - cosine), ("sin", lobe.sine - sine)] {
            pairs.push((format!("{name} {}", lobe.order), off, lobe.uncertainty));
        }
    }
    pairs
}

#[test]
fn exact_touches_give_the_probe_itself() {
    let truth = truth();
    let touches = touches(&truth, &SEVERAL, &LATITUDES, 0.0, 1);
    let found = qualify(&machine(), &known(), &touches).unwrap();
    assert_eq!(found.undetermined, []);
    assert!(found.apart.unwrap() < 1e-8);
    let pairs = pairs(&found, &truth);
    assert_eq!(pairs.len(), 11);
    for (name, off, _) in pairs {
        // Rounding of 100 mm, times a hundred.
        assert!(off.abs() < 1e-9, "{name} {off}");
    }
    // What was written is read again.
    let text = found.file.to_toml();
    let read = ProbeFile::from_toml(&text, &machine()).unwrap();
    assert!((read.radius - found.file.radius).abs() < 1e-6);
    assert_eq!(read.shape.lobes.len(), 3);
    assert_eq!(read.to_toml(), text);
}

#[test]
fn intervals_of_two_standard_uncertainties_cover() {
    let truth = truth();
    let place = truth.centre + Vector3::new(0.004, -0.003, 0.002);
    for (positions, place) in [(&SEVERAL[..], None), (&SEVERAL[..1], Some((place, 0.005)))] {
        let known = ProbePriors { place, ..known() };
        let (mut covered, mut all) = (0.0, 0.0);
        for seed in 0..150 {
            let touches = touches(&truth, positions, &LATITUDES, NOISE, seed);
            let found = qualify(&machine(), &known, &touches).unwrap();
            assert_eq!(found.undetermined, []);
            for (name, off, uncertainty) in pairs(&found, &truth) {
                assert!(uncertainty > 0.0 && uncertainty < 0.01, "{name}");
                // The place is off by less than a standard uncertainty, always the same.
                if name.starts_with("tip") && known.place.is_some() {
                    assert!(off.abs() < 4.0 * uncertainty, "{name}: {off} {uncertainty}");
                    continue;
                }
                covered += f64::from(u8::from(off.abs() < 2.0 * uncertainty));
                all += 1.0;
            }
        }
        // 95.4 % for a normal distribution, a little less for 60 degrees of freedom; 1200 and more independent pairs
        // scatter by 0.6 %.
        let part = covered / all;
        assert!((0.93..0.975).contains(&part), "{part}");
    }
}

#[test]
fn what_touches_do_not_determine_is_named_and_left_as_it_was() {
    let truth = truth();
    // One position: where the ball is, or the tip?
    let one = touches(&truth, &SEVERAL[..1], &LATITUDES, NOISE, 1);
    let found = qualify(&machine(), &known(), &one).unwrap();
    assert_eq!(found.undetermined.len(), 3);
    assert!(
        found
            .undetermined
            .iter()
            .all(|u| matches!(u, ProbeUnknown::Tip(_)))
    );
    assert_eq!(found.file.tip, [None; 3]);
    assert!((found.file.radius - truth.radius).abs() < 4.0 * found.file.radius_uncertainty);
    // C alone turns about the tool axis: the length is not seen.
    let about = touches(&truth, &[[0.0, 0.0], [0.0, 90.0]], &LATITUDES, NOISE, 1);
    let found = qualify(&machine(), &known(), &about).unwrap();
    assert_eq!(found.undetermined, [ProbeUnknown::Tip(2)]);
    // Two latitudes: the pole cannot be told from the height of the ball.
    let low = touches(&truth, &SEVERAL[..1], &[90.0, 10.0], NOISE, 1);
    let found = qualify(&machine(), &known(), &low).unwrap();
    assert!(
        found.undetermined.contains(&ProbeUnknown::Pole),
        "{:?}",
        found.undetermined
    );
    // A circle is no sphere, and another ball is none of these.
    let flat = touches(&truth, &SEVERAL[..1], &[0.0], NOISE, 1);
    let mut wrong = one.clone();
    wrong[5][2] += 3.0;
    let mut other = about.clone();
    for touch in &mut other[..25] {
        touch[4] += 20.0;
    }
    for (touches, part) in [
        (&flat[..], "do not show where the ball is"),
        (&wrong, "no part of a ball"),
        (&other, "do not see one ball"),
        (&one[..4], "too few"),
    ] {
        refused(touches, &known(), part);
    }
}

/// Checks that touches are refused with these words.
fn refused(touches: &[PerAxis], known: &ProbePriors, part: &str) {
    let said = qualify(&machine(), known, touches).unwrap_err().to_string();
    assert!(said.contains(part), "{said}");
}

#[test]
fn a_touch_that_is_off_is_named_with_its_size() {
    let truth = truth();
    for seed in 0..20 {
        let mut touches = touches(&truth, &SEVERAL, &LATITUDES, NOISE, seed);
        let good = qualify(&machine(), &known(), &touches).unwrap();
        assert_eq!(good.outliers, [], "{seed}");
        // Touch 14 is the second at 45°, at 30° around; 0.030 mm farther out along X and Y.
        let out = 0.030 * libm::cos(45_f64.to_radians());
        touches[14][2] += out * libm::cos(30_f64.to_radians());
        touches[14][3] += out * libm::sin(30_f64.to_radians());
        touches[14][4] += out;
        let found = qualify(&machine(), &known(), &touches).unwrap();
        // 0.5 µm of noise.
        assert!(
            matches!(found.outliers[..], [TouchSuspect::Touch(14, off)] if (off - 0.030).abs() < 0.003),
            "{seed}: {:?}",
            found.outliers
        );
    }
}

#[test]
fn a_ball_that_was_moved_is_named() {
    let truth = truth();
    let moved = Truth {
        centre: truth.centre + Vector3::new(0.03, 0.0, -0.02),
        ..self::truth()
    };
    let [before, after] = [&truth, &moved].map(|t| touches(t, &SEVERAL, &LATITUDES, NOISE, 3));
    // Within a rotary position: half of the touches around.
    let within = [&before[..8], &after[8..]].concat();
    let found = qualify(&machine(), &known(), &within).unwrap();
    let [TouchSuspect::Moved(first, by)] = found.outliers[..] else {
        panic!("{:?}", found.outliers)
    };
    assert!((7..=9).contains(&first), "{first}");
    assert!((by - Vector3::new(0.03, 0.0, -0.02)).norm() < 0.01, "{by}");
    // Between two rotary positions, by more than a machine may be off.
    let four = [[0.0, 0.0], [40.0, 0.0], [0.0, 120.0], [-30.0, 60.0]];
    let far = Truth {
        centre: truth.centre + Vector3::new(2.0, 1.0, 0.0),
        ..self::truth()
    };
    let [before, after] = [&truth, &far].map(|t| touches(t, &four, &LATITUDES, NOISE, 3));
    let between = [&before[..75], &after[75..]].concat();
    refused(&between, &known(), "without the one of touch 76");
}

#[test]
fn a_ball_that_was_moved_a_little_between_rotary_positions_is_named() {
    let five = [
        [0.0, 0.0],
        [40.0, 0.0],
        [0.0, 120.0],
        [-30.0, 60.0],
        [20.0, 200.0],
    ];
    let by = Vector3::new(0.03, 0.0, -0.02);
    for seed in 0..20 {
        let truth = truth();
        let moved = Truth {
            centre: truth.centre + by,
            ..self::truth()
        };
        let [before, after] = [&truth, &moved].map(|t| touches(t, &five, &LATITUDES, NOISE, seed));
        let still = qualify(&machine(), &known(), &before).unwrap();
        assert_eq!(still.shift, None, "{seed}");
        // 25 touches at each rotary position: before the fourth.
        let touched = [&before[..75], &after[75..]].concat();
        let found = qualify(&machine(), &known(), &touched).unwrap();
        let shift = found.shift.unwrap();
        assert_eq!(shift.touch, 75, "{seed}");
        assert!((shift.by - by).norm() < 0.003, "{seed}: {shift:?}");
    }
}

#[test]
fn another_diameter_is_refused_if_that_of_the_tip_is_stated() {
    let truth = truth();
    let touches = touches(&truth, &SEVERAL, &LATITUDES, NOISE, 1);
    let of = |ball: f64, stylus: Option<f64>| ProbePriors {
        radius: ball / 2.0,
        stylus,
        ..known()
    };
    let is_accepted = |known: &ProbePriors| qualify(&machine(), known, &touches).is_ok();
    assert!(is_accepted(&of(20.0, Some(3.0))));
    for (ball, stated) in [(19.8, "25.800"), (20.3, "26.300"), (25.0, "31.000")] {
        // Nothing else shows it.
        assert!(is_accepted(&of(ball, None)));
        refused(&touches, &of(ball, Some(3.0)), "ball and tip measure 25.97");
        refused(&touches, &of(ball, Some(3.0)), &format!("but {stated} mm"));
    }
}
