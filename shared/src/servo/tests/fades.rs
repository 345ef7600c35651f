//! What waits for what, and how fast both factors move together.

use super::*;

/// The correction of A at the place of the tests, with the adjustable weight.
fn with_weight(servo: &S, weight: f32) -> [f32; 3] {
    let mut weights = A.weights();
    weights.set(5, weight).unwrap();
    A.evaluate(&at(20.0, 10.0, 45.0), &servo.travelling(), &weights)
}

#[test]
fn the_common_factor_has_half_its_rate_during_a_fade() {
    let inputs = at(20.0, 10.0, 45.0);
    // The rate of the slowest axis, as far as the larger value bound goes at the smaller ramp rate.
    let both = A.axes().iter().zip(B.axes());
    let rates = both.map(|(a, b)| a.ramp_rate.min(b.ramp_rate) / a.value_bound.max(b.value_bound));
    let rate = rates.fold(f32::MAX, f32::min);
    for on in [false, true] {
        let mut servo = settled(&inputs);
        servo.swap(*B).unwrap();
        for _ in 0..100 {
            servo.update(&inputs, ALL, DT);
        }
        if on {
            // Back again before it is at zero.
            servo.disable();
            for _ in 0..500 {
                servo.update(&inputs, ALL, DT);
            }
            servo.enable();
        } else {
            servo.disable();
        }
        let (mut last, mut fastest) = (servo.factor(), 0.0_f32);
        for _ in 0..200 {
            servo.update(&inputs, ALL, DT);
            fastest = fastest.max((servo.factor() - last).abs() / DT);
            last = servo.factor();
        }
        assert!(servo.is_swapping());
        // Differences of numbers up to 1, by 1 ms.
        assert!(
            (fastest / (0.5 * rate) - 1.0).abs() < 0.001,
            "{fastest}, {rate}"
        );
    }
}

#[test]
fn a_fade_begins_only_when_the_common_factor_rests() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = S::new(*A);
    servo.enable();
    for _ in 0..100 {
        servo.update(&inputs, ALL, DT);
    }
    servo.swap(*B).unwrap();
    let mut ramping = 0;
    while servo.factor() < 1.0 {
        let correction = servo.update(&inputs, ALL, DT);
        assert_eq!(correction.computed, with_weight(&servo, 1.0));
        assert!(correction.status.is(Conditions::FADING));
        ramping += 1;
    }
    assert!(ramping > 100);
    for _ in 0..10 {
        servo.update(&inputs, ALL, DT);
    }
    assert_ne!(servo.correction.computed, with_weight(&servo, 1.0));
}

#[test]
fn a_weight_that_is_set_back_during_its_fade_comes_back_after_it() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    let alone = {
        let mut servo = settled(&inputs);
        servo.set_weight(5, 2.0).unwrap();
        periods_of_fading(&mut servo)
    };
    servo.set_weight(5, 2.0).unwrap();
    servo.update(&inputs, ALL, DT);
    servo.set_weight(5, 1.0).unwrap();
    // Two fades, and the period between them, in which the second waits.
    assert_eq!(1 + periods_of_fading(&mut servo), 2 * alone + 1);
    assert_eq!(servo.correction.dq, with_weight(&servo, 1.0));
    // One that is being faded in already is not faded in again.
    servo.set_weight(5, 2.0).unwrap();
    servo.update(&inputs, ALL, DT);
    servo.set_weight(5, 3.0).unwrap();
    servo.set_weight(5, 2.0).unwrap();
    assert_eq!(1 + periods_of_fading(&mut servo), alone);
    assert_eq!(servo.correction.dq, with_weight(&servo, 2.0));
}

/// Updates until nothing is faded in any more; how many periods something was.
fn periods_of_fading(servo: &mut S) -> u32 {
    let mut periods = 0;
    while servo
        .update(&at(20.0, 10.0, 45.0), ALL, DT)
        .status
        .is(Conditions::FADING)
    {
        periods += 1;
        assert!(periods < 20_000, "it ends");
    }
    periods
}

#[test]
fn weights_set_at_zero_hold_at_once_and_can_be_set_back() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = S::new(*A);
    servo.update(&inputs, ALL, DT);
    for weight in [2.0, 1.0, 2.0, 3.0] {
        servo.set_weight(5, weight).unwrap();
        let correction = servo.update(&inputs, ALL, DT);
        assert_eq!(correction.computed, with_weight(&servo, weight));
        assert!(!correction.status.is(Conditions::FADING));
    }
    servo.enable();
    settle(&mut servo, &inputs);
    assert_eq!(servo.correction.dq, with_weight(&servo, 3.0));
}
