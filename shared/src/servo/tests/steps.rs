//! Which changes are steps to be caught up, and which are not.

use super::*;

/// X with backlash of ± this, mm.
fn small(backlash: f32) -> &'static C {
    let mut draft = limited(1.0, 2.0, 0.4);
    draft.banks = vec![DraftBank {
        direction: Direction::Signed,
        ..bank(0, -100.0, 200.0, vec![vec![backlash, backlash]])
    }];
    draft.terms = vec![term(0, 1.0, &[0])];
    leak(&draft)
}

#[test]
fn backlash_that_the_rate_bound_would_let_through_is_worked_off_all_the_same() {
    let mut servo = enabled(small(0.0005));
    servo.update(&at(-1.0, 0.0, 0.0), ALL, DT);
    assert_eq!(settle(&mut servo, &at(0.0, 0.0, 0.0)).dq[0], 0.0005);
    // 1 µm in this period, where 2 µm are permitted; at 8 mm/s² it begins with 4 nm.
    let mut last = 0.0005;
    let mut periods = 0;
    while last != -0.0005 {
        let correction = servo.update(&at(-1.0, 0.0, 0.0), ALL, DT);
        assert_eq!(correction.computed[0], -0.0005);
        let [dq, ..] = correction.dq;
        assert!(dq < last, "it does not stand still on the way");
        if periods == 0 {
            assert!(last - dq <= 8.0 * 0.5 * DT * DT * 1.001);
        }
        assert_eq!(correction.status.rate_limited, u16::from(dq != -0.0005));
        last = dq;
        periods += 1;
    }
    // 2·√(s/a), plus some periods for the slow final approach.
    assert!((22..40).contains(&periods), "{periods}");
}

#[test]
fn a_reversal_without_directional_tables_is_no_step() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    // C, whose tables are not directional, moves to and fro on the slow path; X, which has backlash, stands still.
    for period in 0..400 {
        let c = if period % 100 < 50 {
            period % 50
        } else {
            50 - period % 50
        };
        look_closely(&mut servo);
        let correction = servo.update(&at(20.0, 10.0, 45.0 + 0.125 * c as f32), ALL, DT);
        assert_eq!(correction.status, Status::default(), "period {period}");
        assert_eq!(correction.dq, correction.computed);
    }
}

#[test]
fn the_end_of_a_hold_is_worked_off_where_the_axis_has_gone_on() {
    let mut servo = enabled(backlash(0.001));
    let mut x = -5.0;
    for _ in 0..5000 {
        x += 0.001;
        servo.update(&at(x, 0.0, 0.0), ALL, DT);
    }
    // 1 mm/s along a slope of 1 µm per mm, with and without a jump during the hold.
    for jump in [0.0, 0.5] {
        for _ in 0..5 {
            x += 0.001 + jump / 5.0;
            let status = servo.update(&at(f32::NAN, 0.0, 0.0), ALL, DT).status;
            assert!(status.is(Conditions::HELD));
        }
        x += 0.001;
        let before = servo.correction.dq[0];
        let correction = servo.update(&at(x, 0.0, 0.0), ALL, DT);
        let change = correction.dq[0] - before;
        if jump > 0.0 {
            // 0.5 µm in one period: less than the 2 µm of the rate bound, more than the 0.1 µm with which 200 mm/s²
            // begin.
            assert!(correction.computed[0] - before > 4e-4);
            assert!(change < 1.01e-4, "{change}");
            assert_eq!(correction.status.rate_limited & 1, 1);
        }
        for _ in 0..200 {
            x += 0.001;
            servo.update(&at(x, 0.0, 0.0), ALL, DT);
        }
        assert_eq!(servo.correction.dq, servo.correction.computed);
    }
}

/// A constant of this size on X and half of it on Y, mm.
fn constant(value: f32) -> &'static C {
    let mut draft = bare();
    draft.terms = vec![term(0, value, &[]), term(1, 0.5 * value, &[])];
    leak(&draft)
}

#[test]
fn a_hold_that_begins_during_a_fade_or_a_ramp_leaves_the_axes_together() {
    let inputs = at(0.0, 0.0, 0.0);
    let hold = at(0.0, 0.0, f32::NAN);
    let mut servo = enabled(constant(-0.9));
    for _ in 0..3 {
        servo.update(&inputs, ALL, DT);
    }
    let correction = servo.update(&hold, ALL, DT);
    let held = Conditions::BAD_INPUT | Conditions::HELD;
    assert!(correction.status.is(held | Conditions::RAMPING));
    assert_eq!(correction.status.rate_limited, 0);
    let ramped = correction.computed.map(|dq| servo.factor() * dq);
    assert_eq!(correction.dq, ramped);

    settle(&mut servo, &inputs);
    servo.swap(constant(0.9)).unwrap();
    // A fade accelerates with half the acceleration; a period twice as long makes that visible.
    for _ in 0..3 {
        servo.update(&inputs, ALL, 2.0 * DT);
    }
    let correction = servo.update(&hold, ALL, DT);
    assert!(correction.status.is(held | Conditions::FADING));
    assert_eq!(correction.status.rate_limited, 0);
    assert_eq!(correction.dq, correction.computed);
}

#[test]
fn the_short_way_leaves_a_reversal_to_the_long_one_on_every_axis_with_backlash() {
    for axis in 0..3 {
        let mut draft = bare();
        draft.banks = vec![DraftBank {
            direction: Direction::Signed,
            ..bank(axis, -100.0, 200.0, vec![vec![0.0005, 0.0005]])
        }];
        draft.terms = vec![term(axis, 1.0, &[0])];
        let place = |q: f32| {
            let mut inputs = at(0.0, 0.0, 0.0);
            inputs.axes[usize::from(axis)] = q;
            inputs
        };
        let mut servo = enabled(leak(&draft));
        servo.update(&place(-1.0), ALL, DT);
        settle(&mut servo, &place(0.0));
        assert!(servo.at_rest);
        let correction = servo.update(&place(-1.0), ALL, DT);
        assert_eq!(correction.status.rate_limited, 1 << axis);
        // 1 µm, where 10 µm are permitted; 10 mm/s² remove 5 nm of it.
        assert!(correction.dq[usize::from(axis)] > 0.00049);
    }
}

#[test]
fn what_is_not_let_in_is_not_output_however_small_it_is() {
    let mut servo = S::new(small(0.0005));
    for dry_run in [false, true] {
        if dry_run {
            servo.dry_run(true);
            servo.enable();
        }
        for x in [-1.0, 0.0, 1.0, -1.0] {
            let correction = servo.update(&at(x, 0.0, 0.0), ALL, DT);
            assert_eq!(correction.dq, [0.0; 3]);
        }
        assert_eq!(servo.correction.computed[0], -0.0005);
    }
}
