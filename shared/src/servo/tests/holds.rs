//! What a short hold in motion leaves: how far off the correction is, and for how long.

use super::*;

/// X corrected by 10 µm per mm of X, at most 1 mm/s, with little value bound to spare.
fn sloped(rate_bound: f32, ramp_rate: f32) -> &'static C {
    let mut draft = limited(1.0, rate_bound, ramp_rate);
    draft.banks = vec![bank(0, -80.0, 160.0, vec![vec![-0.8, 0.8]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    leak(&draft)
}

/// A hold in a move at constant speed: how far the correction is off afterwards at most (mm), and how long after the end
/// of the hold (s) it is off.
fn after_a_hold(share: f32, periods: usize, dt: f32, late: bool) -> (f64, f64) {
    const RATE: f32 = 1.0;
    // Ramps are 40 times slower than the rate bound, as compiled tables have it.
    let mut servo = enabled(sloped(RATE, RATE / 40.0));
    let speed = f64::from(share * RATE / 0.01);
    let mut x = -60.0 * f64::from(share.signum());
    // It is all in at its value bound of 1 mm, at 0.0125 mm/s with half of it in a fade.
    for _ in 0..9000 {
        servo.update(&at(x as f32, 0.0, 0.0), ALL, 0.01);
    }
    for _ in 0..(0.1 / dt) as usize {
        x += speed * f64::from(dt);
        servo.update(&at(x as f32, 0.0, 0.0), ALL, dt);
    }
    assert_eq!(servo.correction.dq, servo.correction.computed);
    assert_eq!(servo.factor(), 1.0);
    for _ in 0..periods {
        x += speed * f64::from(dt);
        let (q, dt) = if late {
            (x as f32, 0.010_1)
        } else {
            (f32::NAN, dt)
        };
        let status = servo.update(&at(q, 0.0, 0.0), ALL, dt).status;
        assert!(status.is(Conditions::HELD) && !status.is(Conditions::FROZEN));
    }
    if late {
        x += speed * 0.010_1;
    }
    let (mut most, mut last, mut time) = (0.0_f64, 0.0, 0.0);
    for _ in 0..(0.2 / dt) as usize {
        x += speed * f64::from(dt);
        time += f64::from(dt);
        let [dq, ..] = servo.update(&at(x as f32, 0.0, 0.0), ALL, dt).dq;
        let off = (f64::from(dq) - 0.01 * x).abs();
        // Positions below 128 mm round by 2⁻¹⁸, of which there is 1 %; the fraction in the table by 2⁻²⁵ of 1.6 mm, three
        // times, and corrections by 2⁻²⁵.
        if off > 4e-7 {
            (most, last) = (most.max(off), time);
        }
    }
    (most, last)
}

/// The promise of `docs/src/runtime.md`.
#[test]
fn after_lost_cycles_the_correction_is_hardly_off_and_right_again_as_soon_as_the_hold_was_long() {
    for share in [0.02_f32, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8] {
        for sense in [1.0, -1.0] {
            for (periods, dt, late) in [
                (9, 1e-3_f32, false),
                (5, 1e-3, false),
                (2, 1e-3, false),
                (39, 2.5e-4, false),
                (190, 5e-5, false),
                (1, 1e-3, true),
                (1, 2.5e-4, true),
            ] {
                let (most, last) = after_a_hold(sense * share, periods, dt, late);
                let hold = if late {
                    0.010_1
                } else {
                    periods as f64 * f64::from(dt)
                };
                // While it is held its speed changes by the rate bound of 1 mm/s in 50 ms, afterwards in 10 ms.
                assert!(most <= 0.002_5, "{share} {periods} {dt}: {most}");
                // The faster the correction itself, the less of the rate bound is left.
                let longest = if share <= 0.65 { hold } else { 1.5 * hold };
                let longest = longest + 4.0 * f64::from(dt) + 1e-9;
                assert!(
                    last <= longest,
                    "{share} {periods} {dt}: {last} s after {hold} s"
                );
            }
        }
    }
}

/// A reversal made up at a rate and with an acceleration of its own.
fn reversing(reversal_rate: f32, reversal_acceleration: f32) -> &'static C {
    let mut draft = bare();
    for axis in &mut draft.axes {
        limit(axis, 0.1, 0.1, 0.1);
        axis.reversal_rate = reversal_rate;
        axis.reversal_acceleration = reversal_acceleration;
    }
    draft.banks = vec![DraftBank {
        direction: Direction::Signed,
        ..bank(0, -100.0, 200.0, vec![vec![0.015, 0.015]])
    }];
    draft.terms = vec![term(0, 1.0, &[0]), term(1, 0.5, &[])];
    leak(&draft)
}

#[test]
fn a_reversal_is_made_up_at_its_own_rate_and_acceleration_and_never_steps() {
    for (rate, acceleration) in [(8.0_f32, 500.0_f32), (0.5, 500.0), (0.05, 1.0), (8.0, 1e6)] {
        for dt in [1e-3_f32, 2.5e-4, 5e-5] {
            let mut servo = enabled(reversing(rate, acceleration));
            for k in 0..20_000_u16 {
                servo.update(&at(f32::from(k) * 1e-4, 0.0, 0.0), ALL, DT);
            }
            let [before, y, _] = servo.correction.dq;
            assert_eq!(before, 0.015);
            let (mut last, mut speed, mut time) = (f64::from(before), 0.0_f64, 0.0);
            while last != f64::from(-0.015_f32) {
                let correction = servo.update(&at(1.9, 0.0, 0.0), ALL, dt);
                time += f64::from(dt);
                let now = f64::from(correction.dq[0]);
                let velocity = (now - last) / f64::from(dt);
                // Corrections below 1/64 round by 2⁻³¹, twice in a speed.
                let rounding = 2.0_f64.powi(-29) / f64::from(dt);
                let most = f64::from(rate.max(0.1));
                assert!(velocity.abs() <= most + rounding, "{velocity}");
                let change = (velocity - speed).abs();
                let most = f64::from(acceleration) * f64::from(dt) * 1.001;
                assert!(change <= most + 2.0 * rounding, "{speed} to {velocity}");
                assert!(now >= f64::from(-0.015_f32), "it overshoots");
                // The other axis is not affected.
                assert_eq!(correction.dq[1], y);
                (last, speed) = (now, velocity);
                assert!(time < 10.0);
            }
            // 30 µm: at full rate, or accelerated and braked; and the periods of the slow final approach.
            let (rate, acceleration) = (f64::from(rate.max(0.1)), f64::from(acceleration));
            let at_rate = 0.03 / rate + rate / acceleration;
            let expected = at_rate.max(2.0 * (0.03 / acceleration).sqrt());
            assert!(
                time <= 1.05 * expected + 14.0 * f64::from(dt),
                "{time} {expected}"
            );
        }
    }
}

#[test]
fn a_jump_at_the_end_of_the_travel_leaves_little_of_its_speed_even_at_a_factor_of_zero() {
    // The correction is pushed inwards as fast as the command; what it keeps of that is at most the rate bound, which it
    // loses within 10 ms.
    let mut draft = limited(0.5, 2.0, 0.05);
    draft.axes[0].travel = [-100.0, 100.0];
    draft.banks = vec![
        bank(0, -100.0, 200.0, vec![vec![-0.4, 0.4]]),
        DraftBank {
            direction: Direction::Signed,
            ..bank(1, -100.0, 200.0, vec![vec![0.01, 0.01]])
        },
    ];
    draft.terms = vec![term(0, 1.0, &[0]), term(0, 1.0, &[1])];
    let c = leak(&draft);
    for (jump, step) in [(0.3_f32, false), (0.3, true), (0.05, true), (3.0, true)] {
        let mut servo = enabled(c);
        for k in 0..30_000_u16 {
            servo.update(&at(99.0, f32::from(k) * 1e-3, 0.0), ALL, DT);
        }
        servo.disable();
        while servo.factor() > 0.001 {
            servo.update(&at(99.0, 30.0, 0.0), ALL, DT);
        }
        let mut most = 0.0_f32;
        for k in 0..2000 {
            let x = if k < 2 { 100.0 } else { 100.0 - jump };
            let y = if step { 20.0 } else { 30.0 };
            let [dq, ..] = servo.update(&at(x, y, 0.0), ALL, DT).dq;
            most = most.max(dq.abs());
        }
        assert!(most <= 2.0 * 0.01, "{jump} {step}: {most}");
    }
}
