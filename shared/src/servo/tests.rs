use std::boxed::Box;
use std::sync::LazyLock;
use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use crate::handle::Handle;
use crate::specimen::{adjustable, bank, bare, limit, term};
use crate::*;

mod fades;
mod faults;
mod holds;
mod inputs;
mod lanes;
mod progress;
mod reload;
mod steps;
mod temperatures;

type Three = Holds<3, 8, 8, 16, 1>;
type C = Compensation<'static, Three>;
type S = Servo<&'static C>;

const DT: f32 = 0.001;
const ALL: u16 = 0b111;

/// X from X (with backlash) and C, Y from X·C, C from C by an adjustable weight. Y feeds nothing.
fn draft(scale: f32) -> Draft {
    let mut draft = bare();
    for (axis, (travel, value)) in
        draft
            .axes
            .iter_mut()
            .zip([(100.0, 0.1), (50.0, 0.2), (f32::MAX, 0.05)])
    {
        axis.travel = [-travel, travel];
        limit(axis, value * scale, 2.0, 0.4);
    }
    draft.axes[2].period = 360.0;
    draft.auxiliaries = specimen::everything().auxiliaries;
    draft.banks = vec![
        bank(
            0,
            -100.0,
            50.0,
            vec![
                vec![-0.05, 0.02, 0.06, 0.03, -0.02],
                vec![-1.0, -0.5, 0.0, 0.5, 1.0],
            ],
        ),
        DraftBank {
            modulo: true,
            ..bank(2, 0.0, 90.0, vec![vec![0.0, 0.02, 0.0, -0.02]])
        },
        DraftBank {
            direction: Direction::Positive,
            ..bank(0, -100.0, 200.0, vec![vec![0.01, 0.01]])
        },
        DraftBank {
            direction: Direction::Negative,
            ..bank(0, -100.0, 200.0, vec![vec![-0.01, -0.01]])
        },
    ];
    draft.terms = vec![
        term(0, scale, &[0]),
        term(0, scale, &[3]),
        term(0, scale, &[4]),
        term(1, 8.0 * scale, &[1, 2]),
        term(1, 0.05 * scale, &[]),
        adjustable(2, 1.0, [-2.0, 4.0], &[2]),
        term(2, 0.01, &[]),
    ];
    draft
}

fn leak(draft: &Draft) -> &'static C {
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft.encode().unwrap()));
    Box::leak(Box::new(C::from_blob(blob).unwrap()))
}

static A: LazyLock<&'static C> = LazyLock::new(|| leak(&draft(1.0)));
/// Other values, other bounds, and a tool length that A does not use.
static B: LazyLock<&'static C> = LazyLock::new(|| {
    let mut draft = draft(-1.5);
    for axis in &mut draft.axes {
        limit(axis, -axis.value_bound, 3.0, 0.3);
    }
    draft.banks.push(bank(3, 0.0, 100.0, vec![vec![0.0, 0.02]]));
    draft.terms.push(term(1, 1.0, &[5]));
    leak(&draft)
});

fn enabled(c: &'static C) -> S {
    let mut servo = S::new(c);
    servo.enable();
    servo
}

/// Three axes within these bounds.
fn limited(value: f32, rate: f32, ramp: f32) -> Draft {
    let mut draft = bare();
    for axis in &mut draft.axes {
        limit(axis, value, rate, ramp);
    }
    draft
}

fn at(x: f32, y: f32, c: f32) -> Inputs<[f32; 3]> {
    let mut inputs = Inputs::at([x, y, c]);
    inputs.auxiliaries[0] = 50.0;
    inputs
}

/// Forces the slow path everywhere in the next update.
fn look_closely(servo: &mut S) {
    servo.at_rest = false;
    servo.lanes.iter_mut().for_each(|lane| lane.look_closely());
}

/// Runs until everything has come to rest.
fn settle(servo: &mut S, inputs: &Inputs<[f32; 3]>) -> Correction<[f32; 3]> {
    for _ in 0..8000 {
        servo.update(inputs, ALL, DT);
    }
    servo.update(inputs, ALL, DT)
}

fn settled(inputs: &Inputs<[f32; 3]>) -> S {
    let mut servo = enabled(*A);
    let correction = settle(&mut servo, inputs);
    assert_eq!(correction.dq, correction.computed);
    assert_eq!(correction.status, Status::default());
    assert!(correction.dq.iter().all(|&v| v != 0.0));
    servo
}

#[test]
fn nothing_is_corrected_before_it_is_enabled() {
    let mut servo = S::new(*A);
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
    assert_ne!(correction.computed, [0.0; 3]);
    assert!(correction.status.is(Conditions::DISABLED));
    servo.enable();
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, correction.computed);
    servo.disable();
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
}

#[test]
fn a_dry_run_computes_and_outputs_zero() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    servo.dry_run(true);
    let correction = settle(&mut servo, &at(30.0, 10.0, 45.0));
    assert_eq!(correction.dq, [0.0; 3]);
    let travel = servo.travelling();
    let expected = A.evaluate(&at(30.0, 10.0, 45.0), &travel, &A.weights());
    assert_eq!(correction.computed, expected);
    assert!(correction.status.is(Conditions::DRY_RUN));
    servo.dry_run(false);
    let correction = settle(&mut servo, &at(30.0, 10.0, 45.0));
    assert_eq!(correction.dq, expected);
}

#[test]
fn the_ratio_of_the_corrections_holds_through_enable_and_disable() {
    let mut servo = S::new(*A);
    let inputs = at(20.0, 10.0, 45.0);
    let mut between = 0;
    for step in 0..2000 {
        if step < 1000 {
            servo.enable();
        } else {
            servo.disable();
        }
        let correction = servo.update(&inputs, ALL, DT);
        let s = servo.factor();
        assert_eq!(correction.dq, correction.computed.map(|v| s * v));
        between += u32::from(s > 0.0 && s < 1.0);
    }
    // 0.2 mm at 0.4 mm/s: half a second, plus 0.05 s for acceleration and braking, in both directions.
    assert!((1090..1110).contains(&between), "{between}");
}

#[test]
fn unusable_inputs_hold_the_correction_for_10_ms_and_then_ramp_it_to_zero() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut servo = settled(&at(20.0, 10.0, 45.0));
            let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
            let mut inputs = at(20.0, 10.0, 45.0);
            inputs.axes[axis] = bad;
            for _ in 0..9 {
                let correction = servo.update(&inputs, ALL, DT);
                assert_eq!(correction.dq, before.dq);
                let expected = Conditions::BAD_INPUT | Conditions::HELD;
                assert_eq!(correction.status.conditions, expected);
            }
            // The tenth is borderline: ten times 1 ms summed in f32 may exceed 10 ms.
            servo.update(&inputs, ALL, DT);
            let mut correction = servo.update(&inputs, ALL, DT);
            assert!(
                correction
                    .status
                    .is(Conditions::FROZEN | Conditions::RAMPING)
            );
            // Good again, elsewhere: the old vector still applies until s = 0.
            let mut last = servo.factor();
            while servo.factor() > 0.0 {
                correction = servo.update(&at(-60.0, 10.0, 200.0), ALL, DT);
                assert_eq!(correction.computed, before.computed);
                assert!(servo.factor() < last);
                last = servo.factor();
            }
            assert_eq!(correction.dq, [0.0; 3]);
            let correction = settle(&mut servo, &at(-60.0, 10.0, 200.0));
            assert_eq!(correction.dq, correction.computed);
            assert_ne!(correction.computed, before.computed);
        }
    }
}

#[test]
fn a_short_fault_is_over_with_the_next_usable_inputs() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    for _ in 0..9 {
        servo.update(&at(f32::NAN, 10.0, 45.0), ALL, DT);
    }
    let correction = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    assert_eq!(correction.status, Status::default());
    assert_eq!(servo.factor(), 1.0);
}

#[test]
fn a_position_beyond_8192_turns_is_unusable() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let limit = MOST_PERIODS * 360.0;
    let status = |servo: &mut S, c| servo.update(&at(20.0, 10.0, c), ALL, DT).status;
    assert!(!status(&mut servo, limit).is(Conditions::BAD_INPUT));
    assert!(status(&mut servo, limit + 1.0).is(Conditions::BAD_INPUT));
    assert!(!status(&mut servo, -limit).is(Conditions::BAD_INPUT));
    assert!(status(&mut servo, -limit - 1.0).is(Conditions::BAD_INPUT));
}

#[test]
fn periods_that_cannot_be_right_hold_the_correction() {
    for bad in [
        f32::NAN,
        f32::INFINITY,
        0.0,
        f32::from_bits(1),
        0.9e-6,
        -0.001,
        0.010_001,
        -f32::INFINITY,
    ] {
        let mut servo = settled(&at(20.0, 10.0, 45.0));
        let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
        let correction = servo.update(&at(20.5, 10.0, 45.0), ALL, bad);
        assert_eq!(correction.dq, before.dq);
        assert!(
            correction
                .status
                .is(Conditions::BAD_PERIOD | Conditions::HELD)
        );
        for _ in 0..2000 {
            servo.update(&at(20.5, 10.0, 45.0), ALL, bad);
        }
        assert_eq!(servo.factor(), 0.0);
    }
}

#[test]
fn without_a_reference_the_set_goes_to_zero_with_the_vector_it_had() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    for step in 0..2000 {
        // Homing sets other positions, including some beyond the travel of the other place.
        let x = if step < 100 {
            1000.0
        } else {
            step as f32 * 0.02
        };
        let correction = servo.update(&at(x, 10.0, 45.0), 0b110, DT);
        assert_eq!(correction.computed, before.computed);
        let s = servo.factor();
        assert_eq!(correction.dq, before.computed.map(|v| s * v));
        assert_eq!(correction.status.travel_limited, 0);
        assert!(
            correction
                .status
                .is(Conditions::UNREFERENCED | Conditions::FROZEN)
        );
    }
    assert_eq!(servo.factor(), 0.0);
    // Its direction is forgotten together with its position.
    assert_eq!(servo.travelling().0[0], Travel::Unknown);
    let correction = settle(&mut servo, &at(-60.0, 10.0, 45.0));
    assert_eq!(correction.dq, correction.computed);
}

#[test]
fn a_reference_that_comes_back_elsewhere_moves_no_limit_before_zero() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    servo.update(&at(20.0, 10.0, 45.0), 0b110, DT);
    while servo.factor() > 0.0 {
        let correction = servo.update(&at(1000.0, 10.0, 45.0), ALL, DT);
        let s = servo.factor();
        assert_eq!(correction.dq, before.computed.map(|v| s * v));
    }
}

#[test]
fn an_axis_that_only_receives_corrections_may_be_homed_with_the_others_in() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    for y in [10.0, 1000.0, 49.999] {
        let correction = servo.update(&at(20.0, y, 45.0), 0b101, DT);
        assert_eq!(correction.dq, before.dq);
        assert_eq!(correction.status, Status::default());
    }
    // Referenced at the end of its travel of 50 mm: there its correction goes to zero, but not at once.
    let (mut last, mut speed) = (before.dq[1], 0.0);
    assert!(last > 0.0);
    while last > 0.0 {
        let correction = servo.update(&at(20.0, 50.0, 45.0), ALL, DT);
        assert_eq!(correction.status.travel_limited, 0b010);
        let velocity = (f64::from(correction.dq[1]) - f64::from(last)) / f64::from(DT);
        // As in the test of backlash, with numbers below 1/8.
        let most = 2.0 / 0.01 * f64::from(DT) * 1.0001 + 2.0_f64.powi(-25) / f64::from(DT);
        assert!((velocity - speed).abs() <= most, "{speed} to {velocity}");
        (last, speed) = (correction.dq[1], velocity);
    }
    assert_eq!(settle(&mut servo, &at(20.0, 50.0, 45.0)).dq[1], 0.0);
}

#[test]
fn an_unusable_position_moves_no_limit() {
    // Modulo tables on a rotary axis with finite travel: beyond 8192 turns there are no valid positions.
    let mut draft = draft(1.0);
    (draft.axes[2].travel, draft.axes[2].period) = ([-400.0, 400.0], 0.0);
    let mut servo = enabled(leak(&draft));
    let before = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert!(before.dq.iter().all(|&dq| dq != 0.0));
    for _ in 0..9 {
        let correction = servo.update(&at(20.0, 10.0, 1e7), ALL, DT);
        assert_eq!(correction.dq, before.dq);
        assert_eq!(correction.status.travel_limited, 0);
    }
}

#[test]
fn a_tool_length_that_nobody_gave_is_a_fault_with_a_name() {
    let mut servo = enabled(*B);
    let correction = settle(&mut servo, &Inputs::at([20.0, 10.0, 45.0]));
    assert_eq!(correction.dq, [0.0; 3]);
    let expected = Conditions::BAD_INPUT | Conditions::BAD_AUXILIARY;
    assert!(correction.status.is(expected));
    let correction = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_eq!(correction.dq, correction.computed);
    assert_eq!(correction.status, Status::default());
    // A lost position is a different fault.
    let status = servo.update(&at(f32::NAN, 10.0, 45.0), ALL, DT).status;
    assert!(status.is(Conditions::BAD_INPUT) && !status.is(Conditions::BAD_AUXILIARY));
    // A does not depend on it.
    let mut servo = enabled(*A);
    let correction = settle(&mut servo, &Inputs::at([20.0, 10.0, 45.0]));
    assert_eq!(correction.status, Status::default());
}

/// Tool length and temperature move two axes whose corrections cancel each other.
fn lengths() -> &'static C {
    let mut draft = bare();
    draft.auxiliaries = specimen::everything().auxiliaries;
    draft.auxiliaries.push(Auxiliary {
        kind: AuxiliaryKind::Temperature,
        name: "bed".try_into().unwrap(),
        reference: 20.0,
        sensor: Sensor::USUAL,
    });
    draft.banks = vec![
        bank(3, 0.0, 500.0, vec![vec![0.0, 0.5]]),
        bank(4, -10.0, 20.0, vec![vec![-0.1, 0.1]]),
    ];
    draft.terms = vec![
        term(0, 1.0, &[0]),
        term(1, -0.5, &[0]),
        term(0, 1.0, &[1]),
        term(1, -0.5, &[1]),
    ];
    leak(&draft)
}

#[test]
fn another_tool_length_is_faded_like_a_weight_all_axes_together() {
    for length in [230.0, 80.001] {
        let mut servo = enabled(lengths());
        let mut inputs = at(1.0, 2.0, 3.0);
        inputs.auxiliaries = [80.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let before = settle(&mut servo, &inputs).dq;
        inputs.auxiliaries[0] = length;
        let (mut last, mut speed, mut between) = (before[0], 0.0, 0);
        loop {
            let correction = servo.update(&inputs, ALL, DT);
            let dq = correction.dq;
            // Both move together: each rounds below 0.5, with half of that in the ratio.
            assert!((dq[0] + 2.0 * dq[1]).abs() < 1e-7);
            assert_eq!(correction.status.rate_limited, 0);
            let velocity = (f64::from(dq[0]) - f64::from(last)) / f64::from(DT);
            let rounding = 2.0_f64.powi(-22) / f64::from(DT);
            assert!(velocity.abs() <= 0.5);
            let most = 10.0 * f64::from(DT) + rounding;
            assert!((velocity - speed).abs() <= most, "{speed} to {velocity}");
            (last, speed) = (dq[0], velocity);
            if correction.status == Status::default() {
                break;
            }
            assert_eq!(correction.status.conditions, Conditions::FADING);
            between += 1;
        }
        // From bound to bound (2 mm) at half of 0.5 mm/s, plus 0.05 s.
        assert!((8040..8070).contains(&between), "{between}");
        let expected = lengths().evaluate(&inputs, &servo.travelling(), &lengths().weights());
        assert_eq!(servo.update(&inputs, ALL, DT).dq, expected);
    }
}

#[test]
fn commands_that_change_nothing_change_nothing() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let before = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    for _ in 0..10 {
        servo.enable();
        servo.dry_run(false);
        servo.set_weight(5, 1.0).unwrap();
        servo.swap(*A).unwrap();
        assert!(!servo.is_swapping());
        // Nor do they cost time.
        assert!(servo.at_rest);
        assert_eq!(servo.update(&at(20.0, 10.0, 45.0), ALL, DT), before);
    }
    // A change that was undone before it began.
    servo.set_weight(5, 2.0).unwrap();
    servo.set_weight(5, 1.0).unwrap();
    assert_eq!(servo.update(&at(20.0, 10.0, 45.0), ALL, DT), before);
    // Changed weights of the compensation in use are faded back to the stored ones.
    servo.set_weight(5, 2.0).unwrap();
    let other = settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert_ne!(other.dq, before.dq);
    servo.swap(*A).unwrap();
    assert!(!servo.is_swapping());
    let correction = servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    assert!(correction.status.is(Conditions::FADING));
    assert_eq!(settle(&mut servo, &at(20.0, 10.0, 45.0)), before);
    let mut off = S::new(*A);
    off.disable();
    assert_eq!(off.update(&at(0.0, 0.0, 0.0), ALL, DT).dq, [0.0; 3]);
}

#[test]
fn the_direction_after_homing_can_be_said() {
    let c = backlash(0.0);
    let mut servo = enabled(c);
    assert_eq!(settle(&mut servo, &at(5.0, 0.0, 0.0)).dq[0], 0.0);
    servo.set_travel(0, Travel::Negative);
    let first = servo.update(&at(5.0, 0.0, 0.0), ALL, DT);
    assert_eq!((first.computed[0], first.status.rate_limited), (-0.05, 1));
    assert!(first.dq[0] > -1e-5);
    assert_eq!(settle(&mut servo, &at(5.0, 0.0, 0.0)).dq[0], -0.05);
    // An axis that does not exist has no direction.
    servo.set_travel(3, Travel::Positive);
    // Homing ends away from the last valid position, or there has been no valid position yet.
    for begin in [None, Some(5.0)] {
        for (travel, expected) in [(Travel::Negative, -0.05), (Travel::Positive, 0.05)] {
            let mut servo = enabled(c);
            if let Some(begin) = begin {
                settle(&mut servo, &at(begin, 0.0, 0.0));
            }
            for _ in 0..2000 {
                servo.update(&at(900.0, 0.0, 0.0), ALL & !1, DT);
            }
            servo.set_travel(0, travel);
            assert_eq!(settle(&mut servo, &at(250.0, 0.0, 0.0)).dq[0], expected);
        }
    }
}

/// Updates with these positions (from period 0 on). After the first, all updates are at rest except for positions, and
/// agree with the slow path.
fn stays_at_rest(c: &'static C, referenced: u16, positions: impl Fn(u16) -> Inputs<[f32; 3]>) {
    let (mut servo, mut twin) = (S::new(c), S::new(c));
    servo.enable();
    twin.enable();
    for period in 0..12_000 {
        let inputs = positions(period);
        servo.update(&inputs, referenced, DT);
        if period > 8000 {
            assert!(servo.at_rest, "period {period}");
            assert_ne!(servo.correction.dq, [0.0; 3]);
        }
        look_closely(&mut twin);
        assert_eq!(servo.correction, twin.update(&inputs, referenced, DT));
    }
}

#[test]
fn updates_stay_at_rest_past_tool_lengths_turns_ends_and_axes_without_a_reference() {
    // X does not reverse: it has backlash.
    let there = |period: u16| f32::from(period) * 0.002;
    // A tool length (B), followed by an auxiliary that was never set.
    stays_at_rest(*B, ALL, |p| at(there(p), 10.0, 45.0));
    // Y feeds nothing and may be anywhere; the endless C turns in both directions, reduced or not.
    stays_at_rest(*A, 0b101, |p| at(there(p), f32::from(p) * 1e3, 45.0));
    for turn in [0.1, -0.1, 3.7] {
        let c = |p: u16| f32::from(p) * turn;
        stays_at_rest(*A, ALL, |p| at(20.0, 10.0, c(p)));
        stays_at_rest(*A, ALL, |p| at(20.0, 10.0, c(p).rem_euclid(360.0)));
    }
    // At and near the end of the travel, where the limit cuts off the correction of Y but not of X.
    for (x, y) in [
        (100.0, 50.0),
        (-100.0, -50.0),
        (99.999, 49.999),
        (0.0, 49.9),
    ] {
        stays_at_rest(*A, ALL, |_| at(x, y, 45.0));
        stays_at_rest(*A, ALL, |p| at(x, y, there(p)));
    }
    // Y reaches its end and goes back, slowly enough for the rate bound.
    let to_and_fro = |p: u16| (f32::from(p % 2000) * 0.001 - 1.0).abs();
    stays_at_rest(*A, ALL, |p| at(20.0, 50.0 - to_and_fro(p), 45.0));
}

#[test]
fn an_auxiliary_that_feeds_nothing_may_change_in_front_of_one_that_does() {
    let mut draft = draft(1.0);
    draft.auxiliaries.push(draft.auxiliaries[0].clone());
    draft.banks.push(bank(4, 0.0, 100.0, vec![vec![0.0, 0.02]]));
    draft.terms.push(term(1, 1.0, &[5]));
    let c = leak(&draft);
    let with = |first: f32| {
        let mut inputs = at(20.0, 10.0, 45.0);
        inputs.auxiliaries[..2].copy_from_slice(&[first, 50.0]);
        inputs
    };
    stays_at_rest(c, ALL, |period| with(f32::from(period)));
    stays_at_rest(c, ALL, |_| with(f32::NAN));
}

#[test]
fn an_axis_that_feeds_no_table_need_not_be_referenced() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    let correction = servo.update(&at(20.0, 10.0, 45.0), 0b101, DT);
    assert_eq!(correction.status, Status::default());
}

#[test]
fn a_swap_fades_from_the_old_compensation_to_the_new() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    let old = servo.update(&inputs, ALL, DT).dq;
    servo.swap(*B).unwrap();
    assert!(servo.is_swapping());
    assert_eq!(servo.swap(*B).unwrap_err().why, Refused::Busy);
    let mut last = old;
    let travel = servo.travelling();
    let new = B.evaluate(&inputs, &travel, &B.weights());
    let mut steps = 0;
    while servo.is_swapping() {
        assert!(core::ptr::eq(servo.compensation(), *A));
        let dq = servo.update(&inputs, ALL, DT).dq;
        // On the line from old to new, and never back. Each blend rounds twice.
        let fraction = (dq[1] - old[1]) / (new[1] - old[1]);
        for k in 0..3 {
            assert!((dq[k] - old[k] - (new[k] - old[k]) * fraction).abs() < 1e-7);
            assert!((dq[k] - last[k]) * (new[k] - old[k]) >= -1e-9);
        }
        last = dq;
        steps += 1;
    }
    assert!(core::ptr::eq(servo.compensation(), *B));
    assert_eq!(settle(&mut servo, &inputs).dq, new);
    // 0.5 mm (both bounds of Y) at half of 0.3 mm/s, plus 0.05 s.
    assert!((3370..3400).contains(&steps), "{steps}");
}

#[test]
fn a_swap_waits_until_the_new_inputs_are_usable() {
    let mut inputs = at(20.0, 10.0, 45.0);
    inputs.auxiliaries[0] = f32::NAN;
    let mut servo = settled(&inputs);
    servo.swap(*B).unwrap();
    let correction = settle(&mut servo, &inputs);
    assert_eq!(correction.dq, correction.computed);
    assert_eq!(correction.status.conditions, Conditions::FADING);
    settle(&mut servo, &at(20.0, 10.0, 45.0));
    assert!(core::ptr::eq(servo.compensation(), *B));
}

#[test]
fn a_swap_while_nothing_is_output_is_immediate() {
    let mut servo = S::new(*A);
    servo.swap(*B).unwrap();
    servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    assert!(core::ptr::eq(servo.compensation(), *B));
    assert!(!servo.is_swapping());
}

#[test]
fn a_compensation_of_another_machine_is_refused() {
    let mut servo = S::new(*A);
    let changes: [fn(&mut [Axis]); 3] = [
        |axes| axes[1].name = b'Z',
        |axes| axes[1].travel[1] = 60.0,
        |axes| axes[2].period = 720.0,
    ];
    for change in changes {
        let mut other = draft(1.0);
        change(&mut other.axes);
        assert_eq!(servo.swap(leak(&other)).unwrap_err().why, Refused::Axes);
    }
}

#[test]
fn a_compensation_with_other_auxiliaries_is_refused() {
    let mut servo = S::new(*A);
    let mut refuses = |change: fn(&mut Vec<Auxiliary>)| {
        let mut other = draft(1.0);
        change(&mut other.auxiliaries);
        assert_eq!(
            servo.swap(leak(&other)).unwrap_err().why,
            Refused::Auxiliaries
        );
    };
    refuses(|all| all[0].kind = AuxiliaryKind::Temperature);
    refuses(|all| all[0].name = "other".try_into().unwrap());
    refuses(|all| all[0].reference += 0.5);
    refuses(Vec::clear);
    refuses(|all| all.push(all[0].clone()));
    servo.swap(*B).unwrap();
}

#[test]
fn weights_fade_in_and_later_ones_follow() {
    let inputs = at(20.0, 10.0, 45.0);
    let mut servo = settled(&inputs);
    assert_eq!(servo.set_weight(0, 1.0), Err(WeightError::NotAdjustable));
    assert!(servo.set_weight(5, 4.5).is_err());
    servo.set_weight(5, 2.0).unwrap();
    let before = servo.update(&inputs, ALL, DT);
    assert!(before.status.is(Conditions::FADING));
    servo.set_weight(5, 3.0).unwrap();
    assert_eq!(servo.wanted_weights().get(5), Some(3.0));
    let correction = settle(&mut servo, &inputs);
    let mut weights = A.weights();
    weights.set(5, 3.0).unwrap();
    let expected = A.evaluate(&inputs, &servo.travelling(), &weights);
    assert_eq!(correction.dq, expected);
    assert_eq!(correction.status, Status::default());
}

/// X with backlash of ±0.05 mm only, and the given slopes per mm on X and Y.
fn backlash(slope: f32) -> &'static C {
    let mut draft = limited(1.0, 2.0, 0.4);
    let end = 1000.0 * slope;
    draft.banks = vec![
        DraftBank {
            direction: Direction::Signed,
            ..bank(0, -1000.0, 2000.0, vec![vec![0.05, 0.05]])
        },
        bank(0, -1000.0, 2000.0, vec![vec![-end, end]]),
    ];
    draft.terms = vec![term(0, 1.0, &[0]), term(0, 1.0, &[1]), term(1, 1.0, &[1])];
    leak(&draft)
}

#[test]
fn a_backlash_step_is_worked_off_like_a_ramp_and_never_overshoots() {
    // The reversal threshold is 0.01 mm; these moves exceed it.
    for (x, dt) in [(-0.02, DT), (-0.02, 0.01), (-0.02, 5e-5)] {
        let mut servo = enabled(backlash(0.0));
        servo.update(&at(-1.0, 0.0, 0.0), ALL, DT);
        let last = settle(&mut servo, &at(0.0, 0.0, 0.0));
        assert_eq!(last.dq[0], 0.05);
        let (mut last, mut speed) = (last.dq[0], 0.0);
        let mut time = 0.0;
        while last != -0.05 {
            let correction = servo.update(&at(x, 0.0, 0.0), ALL, dt);
            assert_eq!(correction.computed[0], -0.05);
            let now = f64::from(correction.dq[0]);
            assert!(now <= f64::from(last) && now >= f64::from(-0.05_f32));
            assert_eq!(correction.dq[1..], [0.0; 2]);
            let limited = u16::from(correction.dq[0] != -0.05);
            assert_eq!(correction.status.rate_limited, limited);
            let velocity = (now - f64::from(last)) / f64::from(dt);
            // Corrections below 1/16 round by 2⁻²⁹, the remainder below 1/8 by 2⁻²⁸; four in all.
            let rounding = 6.0 * 2.0_f64.powi(-28) / f64::from(dt);
            assert!((velocity - speed).abs() <= 8.0 * f64::from(dt) * 1.0001 + rounding);
            assert!((f64::from(servo.velocity()[0]) - velocity).abs() < 1e-5);
            (last, speed) = (correction.dq[0], velocity);
            time += dt;
        }
        // 0.1 mm at 8 mm/s² never reaches 2 mm/s: twice √(0.1/8).
        let least = 2.0 * (0.1_f32 / 8.0).sqrt();
        assert!(
            time > 0.99 * least && time < 1.02 * least + 12.0 * dt,
            "{time} s"
        );
    }
}

#[test]
fn an_endless_axis_keeps_its_direction_over_the_turn_whatever_its_tables() {
    let backlash = DraftBank {
        direction: Direction::Signed,
        ..bank(2, 0.0, 360.0, vec![vec![0.02, 0.02]])
    };
    let mut alone = bare();
    (alone.axes[2].travel, alone.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    alone.banks = vec![backlash];
    alone.terms = vec![term(2, 1.0, &[0])];
    let mut with_a_plain_table = alone.clone();
    let plain = bank(2, 0.0, 180.0, vec![vec![0.0, 0.01, 0.0]]);
    with_a_plain_table.banks.push(plain);
    with_a_plain_table.terms.push(term(0, 1.0, &[1]));
    let mut with_a_third_of_a_turn = alone.clone();
    with_a_third_of_a_turn.banks.push(DraftBank {
        modulo: true,
        ..bank(2, 0.0, 60.0, vec![vec![0.0, 0.01]])
    });
    with_a_third_of_a_turn.terms.push(term(0, 1.0, &[1]));
    for draft in [alone, with_a_plain_table, with_a_third_of_a_turn] {
        let c = leak(&draft);
        for (step, travel, dq) in [
            (1_i16, Travel::Positive, 0.02),
            (-1, Travel::Negative, -0.02),
        ] {
            let mut servo = enabled(c);
            let mut tenths = 0_i16;
            for update in 0..8000 {
                tenths = (tenths + step).rem_euclid(3600);
                let correction = servo.update(&at(0.0, 0.0, f32::from(tenths) * 0.1), ALL, DT);
                if update > 0 {
                    assert_eq!(servo.travelling().0[2], travel, "at {tenths}");
                }
                if update > 4000 {
                    assert_eq!(correction.dq[2], dq, "at {tenths}");
                }
            }
        }
    }
}

#[test]
fn an_endless_axis_without_modulo_tables_has_8192_turns_too() {
    let mut draft = bare();
    (draft.axes[2].travel, draft.axes[2].period) = ([-f32::MAX, f32::MAX], 360.0);
    let c = leak(&draft);
    assert_eq!(c.farthest(0), Some(f32::MAX));
    assert_eq!(c.farthest(2), Some(MOST_PERIODS * 360.0));
    assert_eq!(c.farthest(3), None);
}

#[test]
fn a_servo_on_an_empty_compensation_says_so_and_its_factor_stays_0() {
    let mut empty = C::empty();
    assert!(empty.load(&[]).is_err());
    let empty: &'static C = Box::leak(Box::new(empty));
    let mut servo = enabled(empty);
    for _ in 0..100 {
        let correction = servo.update(&at(1.0, 2.0, 3.0), ALL, DT);
        assert_eq!(correction.dq, [0.0; 3]);
        assert_eq!(correction.status.conditions, Conditions::NOTHING_LOADED);
        assert_eq!(servo.factor(), 0.0);
    }
    assert_eq!(servo.swap(*A).unwrap_err().why, Refused::Axes);
}

#[derive(Clone, Copy, Debug)]
enum Event {
    Enable,
    Disable,
    DryRun(bool),
    Swap(bool),
    Weight(f32),
    Reference(u16),
    /// The axis loses its reference and is set to another position.
    Home(usize, f32),
    BadInput(usize, f32),
    BadPeriod(f32),
    Move([f32; 3]),
    Jump([f32; 3]),
    Length(f32),
    Rest,
}

fn not_a_position() -> impl Strategy<Value = f32> {
    prop_oneof![Just(f32::NAN), Just(f32::INFINITY), Just(f32::NEG_INFINITY)]
}

/// Transitions and faults while at rest.
fn transition() -> impl Strategy<Value = Event> {
    prop_oneof![
        3 => Just(Event::Enable),
        1 => Just(Event::Disable),
        1 => any::<bool>().prop_map(Event::DryRun),
        2 => any::<bool>().prop_map(Event::Swap),
        2 => (-2.5_f32..4.5).prop_map(Event::Weight),
        1 => (0_u16..8).prop_map(Event::Reference),
        2 => Just(Event::Reference(ALL)),
        // Not for Y, whose travel may limit its corrections; that has its own test.
        1 => (prop_oneof![Just(0_usize), Just(2)], -90.0_f32..90.0).prop_map(|(k, q)| Event::Home(k, q)),
        1 => (0.0_f32..300.0).prop_map(Event::Length),
        1 => (0..4_usize, not_a_position()).prop_map(|(k, v)| Event::BadInput(k, v)),
        // Beyond 8192 turns: a valid position for a linear axis, a fault for C.
        1 => prop_oneof![Just(3e38_f32), Just(-1e7)].prop_map(|v| Event::BadInput(2, v)),
        3 => Just(Event::Rest),
    ]
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        12 => transition(),
        1 => prop_oneof![not_a_position(), Just(0.0_f32), Just(-0.001), Just(0.02)].prop_map(Event::BadPeriod),
        1 => (0..4_usize, prop_oneof![Just(3e38_f32), Just(-1e7)]).prop_map(|(k, v)| Event::BadInput(k, v)),
        // Up to 300 mm/s: beyond the travel of 100 within a few hundred periods.
        6 => prop::array::uniform3(-300.0_f32..300.0).prop_map(Event::Move),
        1 => prop::array::uniform3(-120.0_f32..120.0).prop_map(Event::Jump),
        1 => (prop_oneof![Just(0_usize), Just(1)], -2000.0_f32..2000.0).prop_map(|(k, q)| Event::Home(k, q)),
    ]
}

/// The events that are calls of the servo.
fn command(servo: &mut S, event: &Event) {
    match *event {
        Event::Enable => servo.enable(),
        Event::Disable => servo.disable(),
        Event::DryRun(on) => servo.dry_run(on),
        Event::Swap(b) => match servo.swap(if b { *B } else { *A }) {
            Ok(_)
            | Err(NotTaken {
                why: Refused::Busy, ..
            }) => {}
            Err(refused) => panic!("{refused}"),
        },
        Event::Weight(weight) => {
            let _ = servo.set_weight(5, weight);
        }
        _ => {}
    }
}

/// A simulated machine around the servo.
struct Plant {
    servo: S,
    inputs: Inputs<[f32; 3]>,
    velocity: [f32; 3],
    referenced: u16,
}

impl Plant {
    fn new() -> Self {
        Self {
            servo: S::new(*A),
            inputs: at(0.0, 0.0, 0.0),
            velocity: [0.0; 3],
            referenced: ALL,
        }
    }

    /// Applies the lasting effects of an event; returns the others: an input and a period that replace ours.
    fn apply(&mut self, event: Event) -> (Option<(usize, f32)>, Option<f32>) {
        command(&mut self.servo, &event);
        match event {
            Event::Reference(mask) => self.referenced = mask,
            Event::Home(k, q) => {
                self.referenced &= !(1 << k);
                self.inputs.axes[k] = q;
            }
            Event::BadInput(k, v) => return (Some((k, v)), None),
            Event::BadPeriod(dt) => return (None, Some(dt)),
            Event::Move(velocity) => self.velocity = velocity,
            Event::Jump(position) => self.inputs.axes = position,
            Event::Length(length) => self.inputs.auxiliaries[0] = length,
            Event::Rest => self.velocity = [0.0; 3],
            _ => {}
        }
        (None, None)
    }

    fn travel_on(&mut self, dt: f32) {
        for (q, v) in self.inputs.axes.iter_mut().zip(&mut self.velocity) {
            *q += *v * dt;
            if *q > 110.0 || *q < -110.0 {
                *v = -*v;
            }
        }
    }
}

/// Whether an axis may be commanded to `q`: up to a tenth of its travel beyond the ends, and up to 8192 turns.
fn is_meant(axis: usize, q: f32) -> bool {
    let [low, high] = A.axes()[axis].travel.map(f64::from);
    let beyond = 0.1 * (high - low);
    let q = f64::from(q);
    q >= low - beyond && q <= high + beyond && q.abs() <= f64::from(A.farthest(axis).unwrap())
}

fn with(mut inputs: Inputs<[f32; 3]>, other: Option<(usize, f32)>) -> Inputs<[f32; 3]> {
    match other {
        Some((3, v)) => inputs.auxiliaries[0] = v,
        Some((k, v)) => inputs.axes[k] = v,
        None => {}
    }
    inputs
}

proptest! {
    // 3000 cases of 40 events on average: 120 000 events.
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_limits_hold(
        base in 1.0 / 8192.0_f32..0.01,
        plan in prop::collection::vec((event(), 1_usize..60, 0.1875_f32..1.0), 20..60),
    ) {
        let mut plant = Plant::new();
        let mut dq = [0.0_f32; 3];
        // The position that the travel check uses for each axis, and whether the axis is there.
        let mut place = [0.0_f32; 3];
        let mut lost = [true; 3];
        // The correction is outside because the axis is at another place after homing.
        let mut outside = [false; 3];
        let mut period = 0.0_f32;
        let mut twin = S::new(*A);
        for (event, steps, share) in plan {
            command(&mut twin, &event);
            let (other, wrong) = plant.apply(event);
            let mut held = false;
            for step in 0..steps {
                let dt = wrong.unwrap_or(base * share);
                if (SHORTEST_PERIOD..=LONGEST_PERIOD).contains(&dt) {
                    period = dt;
                } else if dt > LONGEST_PERIOD {
                    period = LONGEST_PERIOD;
                }
                plant.travel_on(base * share);
                let inputs = with(plant.inputs, other);
                let correction = plant.servo.update(&inputs, plant.referenced, dt);
                // The fast path agrees with the slow path in every bit.
                look_closely(&mut twin);
                let same = twin.update(&inputs, plant.referenced, dt);
                prop_assert_eq!(correction, same);
                prop_assert_eq!(plant.servo.travelling(), twin.travelling());
                prop_assert_eq!(plant.servo.velocity(), twin.velocity());
                let status = correction.status;
                let s = plant.servo.factor();
                prop_assert!((0.0..=1.0).contains(&s));
                for k in 0..3 {
                    let (now, before) = (correction.dq[k], dq[k]);
                    // Never NaN, never above the larger of both value bounds (B's).
                    let bound = B.axes()[k].value_bound;
                    prop_assert!(now.abs() <= bound, "{now} beyond {bound}");
                    prop_assert!(correction.computed[k].abs() <= bound);
                    let q = inputs.axes[k];
                    let mut moved = 0.0;
                    if plant.referenced & (1 << k) == 0 {
                        lost[k] = true;
                    } else if is_meant(k, q) {
                        if lost[k] {
                            (lost[k], outside[k]) = (false, true);
                        } else {
                            moved = (f64::from(q) - f64::from(place[k])).abs();
                        }
                        place[k] = q;
                    }
                    // The travel, without any tolerance: where it acts, end − q is below 0.3 at positions of at least
                    // 50, so neither that nor the sum in f64 rounds.
                    let [low, high] = A.axes()[k].travel.map(f64::from);
                    let (at, sum) = (f64::from(place[k]), f64::from(place[k]) + f64::from(now));
                    let inside = if at > high {
                        now <= 0.0
                    } else if at < low {
                        now >= 0.0
                    } else {
                        sum <= high && sum >= low
                    };
                    outside[k] &= !inside;
                    prop_assert!(
                        inside || (outside[k] && status.travel_limited & (1 << k) != 0),
                        "{at} + {now} leaves {low}..{high}"
                    );
                    // The rate bound (B's is the larger). At the end of the travel, the command's own speed if that is
                    // higher, but only for an axis that is referenced and at a permitted position. `last ± most` rounds
                    // by half an ulp of 0.3.
                    let mut most = 3.0 * f64::from(period);
                    if status.travel_limited & (1 << k) != 0 {
                        most = most.max(moved);
                    }
                    let change = (f64::from(now) - f64::from(before)).abs();
                    prop_assert!(change <= most * (1.0 + 1e-6) + 3e-8, "{change} beyond {most}: axis {k} at {q}, {correction:?}");
                }
                if status.rate_limited | status.travel_limited == 0 {
                    // No bound acts: exactly one factor for all axes.
                    prop_assert_eq!(correction.dq, correction.computed.map(|v| s * v));
                }
                let bad = Conditions::BAD_INPUT | Conditions::BAD_PERIOD;
                let fault = status.conditions.0 & bad.0 != 0;
                prop_assert!(!fault || status.is(Conditions::HELD));
                if step > 0 && held && s == 1.0 && dq == correction.computed && status.conditions == Conditions::HELD | Conditions::BAD_INPUT && status.travel_limited == 0 {
                    prop_assert_eq!(correction.dq, dq);
                }
                held = status.is(Conditions::HELD);
                dq = correction.dq;
            }
        }
        // And it always recovers.
        plant.velocity = [0.0; 3];
        plant.inputs.axes = [20.0, 10.0, 45.0];
        plant.servo.dry_run(false);
        plant.servo.enable();
        for _ in 0..3 {
            settle(&mut plant.servo, &plant.inputs);
        }
        let correction = plant.servo.update(&plant.inputs, ALL, DT);
        prop_assert_eq!(correction.dq, correction.computed);
        prop_assert_eq!(correction.status.conditions, Conditions::default());
        plant.servo.disable();
        prop_assert_eq!(settle(&mut plant.servo, &plant.inputs).dq, [0.0; 3]);
    }

    #[test]
    fn at_rest_no_transition_is_a_step_in_position_or_velocity(
        plan in prop::collection::vec((transition(), 1_usize..400), 10..30),
        x in -90.0_f32..90.0,
        c in -400.0_f32..400.0,
    ) {
        let mut plant = Plant::new();
        plant.inputs = at(x, 10.0, c);
        let mut dq = [0.0_f64; 3];
        let mut velocity = [0.0_f64; 3];
        for (event, steps) in plan {
            let (other, _) = plant.apply(event);
            for _ in 0..steps {
                let correction = plant.servo.update(&with(plant.inputs, other), plant.referenced, DT);
                // Both paces are at most those of A: A's ramp rate is the larger.
                let (ramp, dt) = (0.4, f64::from(DT));
                for k in 0..3 {
                    let now = f64::from(correction.dq[k]);
                    let speed = (now - dq[k]) / dt;
                    // s and f each round by 2⁻²⁴ (twice in a difference), products and the blend
                    // of values below 0.3 by six more halves of their ulp of 2⁻²⁵.
                    let rounding = 0.6 * 10.0 * 2.0_f64.powi(-24) / dt;
                    // s and f may move at once: s'·C + s·(b − a)·f', each then at half the ramp rate.
                    prop_assert!(speed.abs() <= ramp + rounding, "velocity {speed}");
                    // Together they may change by ramp/RISE, and their product by 2·s'·f'·(b − a),
                    // where s' is at most 0.2 / 0.2 per second.
                    let most = dt * (ramp / f64::from(RISE) + 2.0 * ramp);
                    let change = (speed - velocity[k]).abs();
                    prop_assert!(change <= most + 2.0 * rounding, "velocity changes by {change}, not {most}");
                    (dq[k], velocity[k]) = (now, speed);
                }
            }
        }
    }

    #[test]
    fn a_step_that_is_worked_off_is_no_step_of_the_velocity(
        slope in 0.0_f32..0.001,
        plan in prop::collection::vec((0_u8..6, -400.0_f32..400.0, 1_usize..300, -10.0_f32..0.0), 5..30),
        base in 1.0 / 8192.0_f32..0.01,
        // The number of long periods, and the number of short ones, in turn.
        (longs, shorts) in (1_usize..4, 1_usize..6),
    ) {
        let mut servo = enabled(backlash(slope));
        let mut q = 0.0_f64;
        let mut speed = 0.0_f64;
        let (mut dq, mut velocity, mut last_dt, mut second_last_dt) = ([0.0_f64; 3], [0.0_f64; 3], 0.0, 0.0);
        let mut referenced = ALL;
        let (mut s, mut ramped) = (0.0, false);
        // A hold and its end are made up with the acceleration that reaches the rate bound in 10 ms at most.
        let (mut held, mut stops, mut lands) = (false, [0; 2], [false; 2]);
        for (event, target, steps, share) in plan {
            let short = (base * share.exp2()).max(SHORTEST_PERIOD);
            for step in 0..steps {
                let dt = if step % (longs + shorts) < longs { base } else { short };
                let time = f64::from(dt);
                // At most 5 m/s² of the axis; this part of it passes through directly.
                let before = speed;
                speed += (f64::from(target) - speed).clamp(-5000.0 * time, 5000.0 * time);
                if q.abs() > 900.0 && q * speed > 0.0 {
                    speed = 0.0;
                }
                q += speed * time;
                let mut inputs = at(q as f32, 0.0, 0.0);
                match event {
                    // Faults, short and long, and lost references during motion.
                    0 => inputs.axes[2] = f32::NAN,
                    1 if step < 3 => inputs.axes[0] = f32::NAN,
                    2 => referenced = 0b110,
                    _ => referenced = ALL,
                }
                let correction = servo.update(&inputs, referenced, dt);
                let between = 0.5 * (time + last_dt);
                // While s moves, the accelerations of both add up. And a step hidden by the axis's own motion, of up to
                // that motion in one period, shows in the next period.
                let both = (2.0 * between).max(0.5 * second_last_dt + 2.0 * last_dt + 0.5 * time);
                let ramps = servo.factor() != s;
                s = servo.factor();
                let begins = correction.status.is(Conditions::HELD) != held;
                held = correction.status.is(Conditions::HELD);
                let shortest = if last_dt > 0.0 { time.min(last_dt) } else { time };
                for k in 0..2 {
                    // It lands in one period and is at rest in the next.
                    let limited = correction.status.rate_limited & (1 << k) != 0;
                    stops[k] = match stops[k] {
                        _ if begins => 2,
                        0 => 0,
                        left => if limited { 2 } else { left - 1 },
                    };
                    let hard = begins || stops[k] > 0 || lands[k];
                    lands[k] = stops[k] > 0;
                    let most = if hard { 2.0 / f64::from(PATIENCE) } else { 8.0 };
                    let most = most * if ramps || ramped { both } else { between };
                    let now = f64::from(correction.dq[k]);
                    let fast = (now - dq[k]) / time;
                    // Corrections below 1 round by 2⁻²⁵, positions below 1000 by 2⁻¹⁵ times the slope, each twice in a
                    // velocity and that twice in a change; the remainder adds as much again.
                    let rounding = 16.0 * (2.0_f64.powi(-25) + f64::from(slope) * 2.0_f64.powi(-15)) / shortest;
                    // While s moves at up to 0.4/s, its product with the contribution of the axis's own motion changes
                    // too, twice.
                    let own = f64::from(slope) * (speed - before).abs();
                    let product = 2.0 * 0.4 * f64::from(slope) * 400.0;
                    let most = most + product * between + own + rounding;
                    let change = (fast - velocity[k]).abs();
                    prop_assert!(change <= most * 1.001, "axis {k}: {} to {fast}, not {most}", velocity[k]);
                    (dq[k], velocity[k]) = (now, fast);
                }
                (second_last_dt, last_dt, ramped) = (last_dt, time, ramps);
            }
        }
    }
}
