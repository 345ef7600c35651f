//! Order of waiting fades, and joint speed limits of both factors.

use super::*;

/// The correction of A at the test position, with the adjustable weight.
fn with_weight(servo: &S, weight: f32) -> [f32; 3] {
    let mut weights = A.weights();
    weights.set(5, weight).unwrap();
    A.evaluate(&at(20.0, 10.0, 45.0), &servo.travelling(), &weights)
}

#[test]
fn the_common_factor_has_half_its_rate_during_a_fade() {
    let inputs = at(20.0, 10.0, 45.0);
    let double = leak(&draft(2.0));
    for (from, to) in [(double, *B), (*B, double)] {
        // Set by the slowest axis: the larger value bound at the smaller ramp rate.
        let both = from.axes().iter().zip(to.axes());
        let rates =
            both.map(|(a, b)| a.ramp_rate.min(b.ramp_rate) / a.value_bound.max(b.value_bound));
        let rate = rates.fold(f32::MAX, f32::min);
        let mut servo = enabled(from);
        settle(&mut servo, &inputs);
        servo.swap(to).unwrap();
        for _ in 0..100 {
            servo.update(&inputs, ALL, DT);
        }
        servo.disable();
        let (mut last, mut fastest) = (servo.factor(), 0.0_f32);
        for _ in 0..200 {
            servo.update(&inputs, ALL, DT);
            fastest = fastest.max((servo.factor() - last).abs() / DT);
            last = servo.factor();
        }
        assert!(servo.is_swapping());
        // Differences of numbers up to 1 round by 2⁻²⁴, over 1 ms.
        assert!(
            (fastest / (0.5 * rate) - 1.0).abs() < 0.001,
            "{fastest}, {rate}"
        );
    }
}

#[test]
fn a_fade_begins_from_rest() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    let before = servo.correction.computed;
    servo.swap(*B).unwrap();
    let begin = servo.update(&inputs, ALL, DT);
    assert_eq!(begin.computed, before);
    let moved = servo.update(&inputs, ALL, DT).computed;
    for k in 0..3 {
        let (a, b) = (&A.axes()[k], &B.axes()[k]);
        // From bound to bound no axis accelerates faster than to half its ramp rate within RISE. Numbers below 0.3
        // round by 2⁻²⁶, the blend three times.
        let most = 0.5 * 0.5 * a.ramp_rate.min(b.ramp_rate) / RISE * DT * DT;
        assert!((moved[k] - before[k]).abs() <= most + 3.0 * 2.0_f32.powi(-26));
    }
}

#[test]
fn a_fade_begins_only_when_the_common_factor_rests() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = enabled(*A);
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
    // Two fades, and the period between them, in which the second one waits.
    assert_eq!(1 + periods_of_fading(&mut servo), 2 * alone + 1);
    assert_eq!(servo.correction.dq, with_weight(&servo, 1.0));
    // A value that is already being faded in is not faded in again.
    servo.set_weight(5, 2.0).unwrap();
    servo.update(&inputs, ALL, DT);
    servo.set_weight(5, 3.0).unwrap();
    servo.set_weight(5, 2.0).unwrap();
    assert_eq!(1 + periods_of_fading(&mut servo), alone);
    assert_eq!(servo.correction.dq, with_weight(&servo, 2.0));
}

/// Updates until no fade is in progress; returns the number of periods with a fade.
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

#[test]
fn another_tool_length_does_not_take_the_place_of_a_compensation_that_waits() {
    // The waiting one depends on Y, which is not referenced yet; its own weights are 0.5.
    let mut other = draft(1.0);
    other.banks.push(bank(3, 0.0, 100.0, vec![vec![0.0, 0.02]]));
    other.terms.push(term(1, 1.0, &[5]));
    let c = leak(&other);
    other
        .banks
        .push(bank(1, -50.0, 100.0, vec![vec![0.0, 0.01]]));
    other.terms.push(term(0, 1.0, &[6]));
    other.terms[5].weight = 0.5;
    let to = leak(&other);
    let mut servo = enabled(c);
    let with = |length: f32| {
        let mut inputs = at(20.0, 10.0, 45.0);
        inputs.auxiliaries[0] = length;
        inputs
    };
    for _ in 0..8000 {
        servo.update(&with(50.0), 0b101, DT);
    }
    assert!(servo.at_rest);
    let weighted = servo.correction.computed[2];
    servo.swap(to).unwrap();
    for _ in 0..8000 {
        servo.update(&with(90.0), 0b101, DT);
    }
    // The length has been adopted, with the weights of the one in use, while the other still waits.
    assert_eq!(servo.inputs.auxiliaries[0], 90.0);
    assert_eq!(servo.correction.computed[2], weighted);
    assert!(servo.is_swapping() && core::ptr::eq(*servo.handle(), c));
    for _ in 0..8000 {
        servo.update(&with(90.0), ALL, DT);
    }
    assert!(!servo.is_swapping() && core::ptr::eq(*servo.handle(), to));
    assert_eq!(servo.wanted_weights().get(5), Some(0.5));
}
