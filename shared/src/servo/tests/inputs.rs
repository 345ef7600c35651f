//! Which inputs matter, and how long they may be unusable.

use super::*;

/// X from X, and with `more` also from the tool length; Y with backlash; and C, with modulo.
fn machine(more: bool) -> &'static C {
    let mut draft = bare();
    draft.auxiliaries = specimen::everything().auxiliaries;
    draft.banks = vec![bank(0, -100.0, 200.0, vec![vec![0.02, 0.04]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    if more {
        draft.banks.extend([
            bank(3, 0.0, 100.0, vec![vec![0.0, 0.02]]),
            DraftBank {
                direction: Direction::Signed,
                ..bank(1, -100.0, 200.0, vec![vec![0.01, 0.01]])
            },
            DraftBank {
                modulo: true,
                ..bank(2, 0.0, 90.0, vec![vec![0.0, 0.02, 0.0, -0.02]])
            },
        ]);
        let terms = [term(0, 1.0, &[1]), term(1, 1.0, &[2]), term(2, 1.0, &[3])];
        draft.terms.extend(terms);
    }
    draft.axes[2].travel = [-1e7, 1e7];
    leak(&draft)
}

#[test]
fn during_a_fade_the_inputs_of_both_compensations_matter() {
    let good = at(20.0, 10.0, 45.0);
    for more in [false, true] {
        let (from, to) = (machine(more), machine(!more));
        let update = |inputs: &Inputs<[f32; 3]>, referenced| {
            let mut servo = enabled(from);
            settle(&mut servo, &good);
            servo.swap(to).unwrap();
            for _ in 0..100 {
                let status = servo.update(&good, ALL, DT).status;
                assert_eq!(status.conditions, Conditions::FADING);
            }
            servo.update(inputs, referenced, DT).status
        };
        let mut inputs = good;
        inputs.auxiliaries[0] = f32::NAN;
        let status = update(&inputs, ALL);
        assert!(status.is(Conditions::BAD_AUXILIARY | Conditions::HELD));
        // Farther than the modulo table can resolve, and not as far.
        let most = MOST_PERIODS * 360.0;
        assert!(update(&at(20.0, 10.0, most + 1.0), ALL).is(Conditions::BAD_INPUT));
        assert!(!update(&at(20.0, 10.0, most), ALL).is(Conditions::BAD_INPUT));
        assert!(update(&good, 0b101).is(Conditions::UNREFERENCED));
        assert!(!update(&good, ALL).is(Conditions::UNREFERENCED));
        // The backlash of Y is being caught up, even though only little of it is left.
        assert_eq!(update(&at(20.0, 9.0, 45.0), ALL).rate_limited, 0b010);
    }
}

#[test]
fn an_axis_that_does_not_matter_may_be_anywhere_but_at_no_number() {
    let mut draft = bare();
    (draft.axes[2].travel, draft.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    draft.banks = vec![bank(0, -100.0, 200.0, vec![vec![0.02, 0.04]])];
    draft.terms = vec![term(0, 1.0, &[0])];
    let c = leak(&draft);
    // On the fast and on the slow path.
    for long in [false, true] {
        let status = |place: f32, referenced| {
            let mut servo = enabled(c);
            for _ in 0..8000 {
                servo.update(&at(20.0, 10.0, 45.0), referenced, DT);
            }
            if long {
                look_closely(&mut servo);
            }
            servo.update(&at(20.0, 10.0, place), referenced, DT).status
        };
        assert_eq!(status(1e7, 0b011), Status::default());
        assert!(status(1e7, ALL).is(Conditions::BAD_INPUT));
        for no_number in [f32::NAN, f32::INFINITY] {
            assert!(status(no_number, 0b011).is(Conditions::BAD_INPUT));
        }
    }
}

#[test]
fn what_is_over_after_exactly_10_ms_was_only_held() {
    let good = at(20.0, 10.0, 45.0);
    let mut servo = settled(&good);
    let before = servo.update(&good, ALL, PATIENCE);
    let held = Conditions::BAD_INPUT | Conditions::HELD;
    let status = servo
        .update(&at(f32::NAN, 10.0, 45.0), ALL, PATIENCE)
        .status;
    assert_eq!(status.conditions, held);
    assert_eq!(servo.update(&good, ALL, PATIENCE), before);
    servo.update(&at(f32::NAN, 10.0, 45.0), ALL, PATIENCE);
    let status = servo
        .update(&at(f32::NAN, 10.0, 45.0), ALL, SHORTEST_PERIOD)
        .status;
    assert!(status.is(held | Conditions::FROZEN));
}

/// A constant on X, and half of it on Y.
fn constant(value: f32) -> &'static C {
    let mut draft = bare();
    draft.terms = vec![term(0, value, &[]), term(1, -0.5 * value, &[])];
    leak(&draft)
}

#[test]
fn corrections_end_at_the_value_bound_and_say_so() {
    // The bound is 1 mm.
    for (value, x, y, saturated) in [
        (1.0, 1.0, -0.5, 0),
        (-1.5, -1.0, 0.75, 0b01),
        (2.0, 1.0, -1.0, 0b01),
        (-2.5, -1.0, 1.0, 0b11),
    ] {
        let mut servo = enabled(constant(value));
        let correction = settle(&mut servo, &at(0.0, 0.0, 0.0));
        assert_eq!(correction.computed, [x, y, 0.0]);
        assert_eq!(correction.dq, correction.computed);
        assert_eq!(correction.status.saturated, saturated);
        // Of both, while one fades into the other.
        servo.swap(constant(0.5)).unwrap();
        servo.update(&at(0.0, 0.0, 0.0), ALL, DT);
        let correction = servo.update(&at(0.0, 0.0, 0.0), ALL, DT);
        assert_eq!(correction.status.saturated, saturated);
        assert!(correction.computed[0].abs() <= 1.0);
    }
}

#[test]
fn an_endless_axis_that_goes_back_over_zero_has_reversed() {
    let mut draft = bare();
    (draft.axes[2].travel, draft.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    let c = leak(&draft);
    for long in [false, true] {
        for (there, back, travel) in [
            (0.05, 359.9, Travel::Negative),
            (359.95, 0.1, Travel::Positive),
        ] {
            let mut servo = enabled(c);
            let before = if travel == Travel::Negative {
                359.5
            } else {
                0.5
            };
            settle(&mut servo, &at(0.0, 0.0, before));
            for place in [there, back] {
                if long {
                    look_closely(&mut servo);
                }
                assert_ne!(servo.travelling().0[2], travel);
                servo.update(&at(0.0, 0.0, place), ALL, DT);
            }
            assert_eq!(servo.travelling().0[2], travel);
        }
    }
}

#[test]
fn after_a_swap_the_new_value_bound_holds_on_an_axis_without_a_reference_too() {
    // Y only receives corrections. The second compensation exceeds its bound, by less than the rate bound permits per
    // period.
    let of = |bound: f32| {
        let mut draft = limited(bound, 2.0, 0.4);
        draft.terms = vec![term(1, 0.2, &[])];
        leak(&draft)
    };
    for referenced in [ALL, 0b101] {
        let mut servo = enabled(of(0.5));
        let inputs = at(20.0, 10.0, 45.0);
        let update = |servo: &mut S| servo.update(&inputs, referenced, DT);
        for _ in 0..5000 {
            update(&mut servo);
        }
        assert_eq!(update(&mut servo).dq[1], 0.2);
        servo.swap(of(0.199)).unwrap();
        for _ in 0..9000 {
            update(&mut servo);
        }
        assert!(servo.at_rest && !servo.is_swapping());
        let correction = update(&mut servo);
        assert_eq!(correction.dq[1], 0.199);
        assert_eq!(correction.status.saturated, 0b010);
    }
}

#[test]
fn an_axis_that_stands_beyond_the_reach_of_what_is_taken_at_zero_is_a_fault() {
    let fine = |modulo| {
        let mut draft = bare();
        draft.banks = vec![DraftBank {
            modulo,
            ..bank(0, 0.0, 0.005, vec![vec![0.0, 0.02, 0.0, -0.02]])
        }];
        draft.terms = vec![term(0, 1.0, &[0])];
        leak(&draft)
    };
    // 8192 periods of 0.02 mm are 164 mm.
    let inputs = at(500.0, 10.0, 45.0);
    let mut servo = S::new(fine(false));
    settle(&mut servo, &inputs);
    servo.swap(fine(true)).unwrap();
    servo.enable();
    let correction = settle(&mut servo, &inputs);
    assert!(correction.status.is(Conditions::BAD_INPUT));
    assert_eq!(servo.factor(), 0.0);
}

#[test]
fn a_smaller_reversal_threshold_counts_before_the_next_move() {
    let with = |reversal_threshold| {
        let mut draft = bare();
        draft.axes[0].reversal_threshold = reversal_threshold;
        leak(&draft)
    };
    let mut servo = S::new(with(0.1));
    for x in [0.0, 10.0, 9.95] {
        servo.update(&at(x, 0.0, 0.0), ALL, DT);
    }
    assert_eq!(servo.travelling().0[0], Travel::Positive);
    servo.swap(with(0.01)).unwrap();
    // It comes back from the extreme by more than that, and then moves on by more than that.
    for (x, expected) in [
        (9.95, Travel::Positive),
        (9.95, Travel::Negative),
        (9.98, Travel::Positive),
    ] {
        servo.update(&at(x, 0.0, 0.0), ALL, DT);
        assert_eq!(servo.travelling().0[0], expected, "{x}");
    }
}
