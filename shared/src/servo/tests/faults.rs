//! Faults around a servo, and its response to them.

use super::*;
use crate::servo::state::Fading;

#[test]
fn a_command_that_cannot_be_meant_is_a_fault_and_moves_no_rail() {
    // Y has ±50 mm of travel, X ±100: a tenth of the full length beyond either end is still a valid command.
    for (axis, q, meant) in [
        (1, 60.0, true),
        (1, -60.0, true),
        (1, 60.001, false),
        (1, -60.001, false),
        (0, 120.0, true),
        (0, -120.001, false),
        (1, 1e30, false),
        (1, -f32::MAX, false),
    ] {
        let mut servo = settled(&at(20.0, 10.0, 45.0));
        let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
        let mut inputs = at(20.0, 10.0, 45.0);
        inputs.axes[axis] = q;
        for _ in 0..9 {
            let correction = servo.update(&inputs, ALL, DT);
            let fault = Conditions::BAD_INPUT | Conditions::HELD;
            assert_eq!(correction.status.is(fault), !meant, "axis {axis} at {q}");
            if !meant {
                assert_eq!(correction.dq, before.dq);
                assert_eq!(correction.status.travel_limited, 0);
            }
        }
        // The fault ends with the next usable command.
        if !meant {
            let correction = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
            assert_eq!(correction, before);
        }
    }
    // Nor is it a fault while the axis is not referenced, when any number may be commanded.
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let correction = servo.update(&at(20.0, 1e30, 45.0), 0b101, DT);
    assert_eq!(correction.status, Status::default());
}

#[test]
fn the_travel_holds_from_the_first_period_after_a_reference_has_come_back() {
    // X, with ±100 mm, has a correction of -0.02 + 0.01 at one end and of -0.05 - 0.01 at the other.
    for sense in [1.0, -1.0] {
        let mut servo = settled(&at(90.0 * sense, 10.0, 45.0));
        let inputs = |x: f32| at(x * sense, 10.0, 45.0);
        servo.update(&inputs(90.0), 0b110, DT);
        // Back, frozen, and on to its end at 500 mm/s.
        let mut x = 90.0;
        let mut limited = false;
        while servo.factor() > 0.0 {
            x = (x + 500.0 * DT).min(100.0);
            let correction = servo.update(&inputs(x), ALL, DT);
            let sum = f64::from(x * sense) + f64::from(correction.dq[0]);
            assert!(sum.abs() <= 100.0, "{sum}");
            limited |= correction.status.travel_limited & 1 != 0;
        }
        // The correction at the positive end points inwards.
        assert_eq!(limited, sense < 0.0);
    }
}

#[test]
fn patience_is_time_whatever_the_periods_before() {
    for before in [SHORTEST_PERIOD, DT, LONGEST_PERIOD] {
        for bad in [f32::NAN, 0.0, 0.02, 1.0, f32::INFINITY] {
            let mut servo = settled(&at(20.0, 10.0, 45.0));
            servo.update(&at(20.0, 10.0, 45.0), ALL, before);
            let first = servo.update(&at(20.0, 10.0, 45.0), ALL, bad);
            assert!(!first.status.is(Conditions::FROZEN));
            // With the second one, more than 10 ms have passed.
            let second = servo.update(&at(20.0, 10.0, 45.0), ALL, bad);
            assert!(second.status.is(Conditions::FROZEN | Conditions::RAMPING));
        }
        // Periods that are too long reach zero no later than the longest permitted period.
        let periods = |bad: f32| {
            let mut servo = settled(&at(20.0, 10.0, 45.0));
            servo.update(&at(20.0, 10.0, 45.0), ALL, before);
            let mut periods = 0;
            while servo.factor() > 0.0 {
                let mut inputs = at(20.0, 10.0, 45.0);
                if bad == LONGEST_PERIOD {
                    inputs.axes[0] = f32::NAN;
                }
                servo.update(&inputs, ALL, bad);
                periods += 1;
            }
            periods
        };
        assert!(periods(0.02) <= periods(LONGEST_PERIOD));
    }
}

#[test]
fn a_held_correction_runs_on_by_half_of_what_the_rate_bound_allows_in_a_rise_at_most() {
    // 0.05 to 2 mm/s of correction; the rate bound is 2 mm/s, five times the ramp rate.
    for share in [0.025, 0.5, 1.0] {
        let mut draft = limited(1.0, 2.0, 0.4);
        draft.banks = vec![bank(0, -200.0, 400.0, vec![vec![-1.0, 1.0]])];
        draft.terms = vec![term(0, 1.0, &[0])];
        draft.axes[0].travel = [-250.0, 250.0];
        let mut servo = enabled(leak(&draft));
        settle(&mut servo, &at(10.0, 0.0, 0.0));
        let speed = 400.0 * share;
        let mut x = 10.0;
        for _ in 0..400 {
            x += speed * DT;
            servo.update(&at(x, 0.0, 0.0), ALL, DT);
        }
        let held = servo.correction.dq[0];
        let most = 0.5 * f64::from(RISE) * 2.0 * f64::from(share);
        // It slows down from the first period on, with the acceleration that belongs to the rate bound, not to the ramp
        // rate.
        let held_first = servo.update(&at(f32::NAN, 0.0, 0.0), ALL, DT).dq[0];
        let first = (f64::from(held_first) - f64::from(held)) / f64::from(DT);
        // Half of that, because means over periods are compared; 1e-4 of it allows for rounding of both corrections.
        let slows = 0.5 * 2.0 / f64::from(RISE) * f64::from(DT);
        assert!(first <= 2.0 * f64::from(share) - slows + 1e-4, "{first}");
        let mut farthest = f64::from(held_first) - f64::from(held);
        for _ in 0..8 {
            let correction = servo.update(&at(f32::NAN, 0.0, 0.0), ALL, DT);
            farthest = farthest.max(f64::from(correction.dq[0]) - f64::from(held));
        }
        // The last part of the speed is lost in the period in which the hold begins. The fade factor, which begins to
        // move 10 ms later, only reduces the correction.
        for _ in 0..200 {
            let correction = servo.update(&at(f32::NAN, 0.0, 0.0), ALL, DT);
            farthest = farthest.max(f64::from(correction.dq[0]) - f64::from(held));
        }
        let step = 2.0 * f64::from(share) * f64::from(DT);
        assert!(farthest <= most + step, "{farthest} beyond {most}");
        assert!(
            farthest > 0.2 * most * f64::from(share),
            "{farthest}, {most}"
        );
    }
}

#[test]
fn after_a_swap_to_narrower_bounds_what_is_still_beyond_them_stays_within_the_travel() {
    let small = |bound: f32| {
        let mut draft = limited(0.5, 50.0, 5.0);
        draft.axes[0].travel = [-1.0, 1.0];
        draft.axes[0].value_bound = bound;
        draft.banks = vec![
            bank(0, -0.5, 1.0, vec![vec![-bound, bound]]),
            DraftBank {
                direction: Direction::Signed,
                ..bank(1, -100.0, 200.0, vec![vec![1e-4, 1e-4]])
            },
        ];
        draft.terms = vec![term(0, 1.0, &[0]), term(1, 1.0, &[1])];
        leak(&draft)
    };
    let mut servo = enabled(small(0.5));
    settle(&mut servo, &at(-0.5, 0.0, 0.0));
    settle(&mut servo, &at(-0.45, 10.0, 0.0));
    servo.disable();
    let mut x = -0.45;
    let mut correction = servo.correction;
    // The correction moves at nearly its rate bound until the backlash of Y ends this.
    while servo.factor() > 0.2 {
        correction = servo.update(&at(x, 10.0, 0.0), ALL, DT);
    }
    servo.swap(small(0.05)).unwrap();
    while x < 0.1 {
        x += 0.2;
        correction = servo.update(&at(x, 10.0, 0.0), ALL, DT);
    }
    while servo.is_swapping() {
        correction = servo.update(&at(x, 9.0, 0.0), ALL, DT);
    }
    // Far beyond the new bound, and moving.
    assert!(correction.dq[0] > 0.1);
    while x < 0.9 {
        x += 0.02;
        correction = servo.update(&at(x, 9.0, 0.0), ALL, DT);
        assert!(x + correction.dq[0] <= 1.0, "{x} {}", correction.dq[0]);
    }
}

#[test]
fn after_a_hold_the_correction_reaches_its_rate_bound_in_10_ms_at_the_soonest() {
    let mut draft = limited(1.0, 10.0, 0.4);
    draft.banks = vec![bank(0, -200.0, 400.0, vec![vec![-1.0, 1.0]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    let mut servo = enabled(leak(&draft));
    settle(&mut servo, &at(10.0, 0.0, 0.0));
    let mut x = 10.0;
    let mut speeds = [0.0_f32; 2];
    let acceleration = 10.0 / PATIENCE;
    for period in 0..300 {
        x += if period < 100 { 0.2 } else { 0.0 };
        // The correction is held for two periods while it moves; then the command is elsewhere.
        let held = (100..102).contains(&period);
        let q = if held { f32::NAN } else { x };
        servo.update(&at(q, 0.0, 0.0), ALL, DT);
        speeds = [speeds[1], servo.velocity()[0]];
        if period > 102 {
            let change = (speeds[1] - speeds[0]).abs();
            assert!(
                change <= 1.01 * acceleration * DT + 1e-3,
                "{period}: {change}"
            );
        }
        if period == 101 {
            x = -100.0;
        }
    }
}

#[test]
fn while_inputs_are_held_no_auxiliary_is_let_in_and_no_fade_begins() {
    let mut servo = enabled(lengths());
    let mut inputs = at(1.0, 2.0, 3.0);
    inputs.auxiliaries = [80.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let before = settle(&mut servo, &inputs);
    inputs.axes[0] = f32::NAN;
    for _ in 0..9 {
        // So slow that it would otherwise be followed at once.
        inputs.auxiliaries[1] += 0.0005;
        let correction = servo.update(&inputs, ALL, DT);
        assert!(correction.status.is(Conditions::HELD));
        assert_eq!(correction.dq, before.dq);
    }
    // A does not depend on the lost tool length.
    let good = at(20.0, 10.0, 45.0);
    let mut lost = good;
    lost.auxiliaries[0] = f32::NAN;
    let mut servo = enabled(*B);
    settle(&mut servo, &good);
    servo.swap(*A).unwrap();
    for _ in 0..9 {
        let correction = servo.update(&lost, ALL, DT);
        assert!(correction.status.is(Conditions::HELD));
        assert!(servo.fading == Fading::Nothing);
    }
    servo.update(&good, ALL, DT);
    servo.update(&good, ALL, DT);
    assert!(servo.fading == Fading::Compensation);
}

#[test]
fn a_ramp_begins_however_short_the_periods_are() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    servo.disable();
    // In one microsecond the fade factor initially changes by less than half of its last bit.
    for _ in 0..5000 {
        servo.update(&at(20.0, 10.0, 45.0), ALL, SHORTEST_PERIOD);
    }
    assert!(servo.factor() < 1.0);
}
