//! Temperatures are followed at a bounded rate, and implausible readings are faults.

use super::*;

/// X and Y, which cancel each other, follow the temperature of the bed: 10 and −5 µm/K within ±10 K.
fn heated(sensor: Sensor) -> Draft {
    let mut draft = bare();
    draft.auxiliaries = vec![Auxiliary {
        kind: AuxiliaryKind::Temperature,
        name: "bed".try_into().unwrap(),
        reference: 20.0,
        sensor,
    }];
    draft.banks = vec![bank(3, -10.0, 20.0, vec![vec![-0.1, 0.1]])];
    draft.terms = vec![term(0, 1.0, &[0]), term(1, -0.5, &[0])];
    draft
}

const LAGGING: Sensor = Sensor {
    lag_rate: 0.05,
    ..Sensor::USUAL
};

fn warm(kelvin: f32) -> Inputs<[f32; 3]> {
    let mut inputs = at(1.0, 2.0, 3.0);
    inputs.auxiliaries[0] = kelvin;
    inputs
}

fn running(draft: &Draft, kelvin: f32) -> S {
    let mut servo = enabled(leak(draft));
    let correction = settle(&mut servo, &warm(kelvin));
    assert_eq!(correction.status, Status::default());
    servo
}

/// What X is corrected by at this temperature.
fn of(kelvin: f64) -> f64 {
    0.01 * kelvin
}

/// The rounding of a temperature to 2⁻¹⁷ K, twice, and of f32 corrections below 0.125 and their sums.
const ROUNDING: f64 = 0.01 * 2.0 / 131_072.0 + 4.0 * 7.5e-9;

#[test]
fn a_temperature_that_drifts_no_faster_than_its_rate_is_followed_at_once_without_a_fade() {
    let mut servo = running(&heated(Sensor::USUAL), 1.0);
    let mut kelvin = 1.0_f64;
    for _ in 0..20_000 {
        kelvin += 0.000_1;
        let correction = servo.update(&warm(kelvin as f32), ALL, DT);
        assert!((f64::from(correction.dq[0]) - of(kelvin)).abs() < ROUNDING);
        assert_eq!(correction.dq[1], -0.5 * correction.dq[0]);
        assert_eq!(correction.status, Status::default());
        assert!(servo.at_rest);
    }
}

#[test]
fn a_step_of_a_temperature_arrives_at_its_rate_whatever_the_period() {
    for (rate, dt) in [
        (0.1_f32, 0.01_f32),
        (0.1, 1e-3),
        (0.1, 5e-5),
        (0.01, 5e-5),
        (10.0, 1e-3),
    ] {
        let sensor = Sensor {
            rate,
            ..Sensor::USUAL
        };
        let mut servo = running(&heated(sensor), 1.0);
        let step = 0.5 * rate;
        let mut time = 0.0;
        while time < 0.6 {
            time += f64::from(dt);
            let correction = servo.update(&warm(1.0 + step), ALL, dt);
            let kelvin = 1.0 + (f64::from(rate) * time).min(f64::from(step));
            let off = (f64::from(correction.dq[0]) - of(kelvin)).abs();
            // Each period truncates less than 2⁻⁴⁸ K.
            assert!(
                off < ROUNDING + 0.01 * f64::from(rate) * 1e-6,
                "{off} at {time} s"
            );
            assert_eq!(correction.status, Status::default());
        }
    }
}

#[test]
fn a_lag_follows_what_is_followed_at_the_rate() {
    let mut servo = running(&heated(LAGGING), 2.0);
    let (mut reading, mut lagged) = (2.0_f64, 2.0_f64);
    for _ in 0..200_000 {
        reading = (reading + 0.1 * f64::from(DT)).min(8.0);
        lagged += (reading - lagged) * f64::from(0.05 * DT);
        let correction = servo.update(&warm(8.0), ALL, DT);
        // A lag sees its own value rounded by half a step, so it is off by up to that.
        let off = (f64::from(correction.dq[0]) - of(lagged)).abs();
        assert!(off < 2.0 * ROUNDING, "{off}");
        assert_eq!(correction.status, Status::default());
    }
    assert!(lagged > 7.9);
}

#[test]
fn positions_that_are_set_anew_leave_the_heat_where_it_is() {
    let mut servo = running(&heated(LAGGING), 2.0);
    for _ in 0..2000 {
        servo.update(&warm(8.0), ALL, DT);
    }
    let lagged = servo.auxiliaries()[0];
    assert!(lagged > 2.0 && lagged < 2.1, "{lagged}");
    servo.restart();
    assert_eq!(servo.correction().dq, [0.0; 3]);
    assert_eq!(servo.factor(), 0.0);
    // Still enabled: the corrections return, and the lag went on from where it was.
    let mut seconds = 0.001;
    while servo.factor() < 1.0 {
        servo.update(&warm(8.0), ALL, DT);
        seconds += 0.001;
    }
    let found = servo.auxiliaries()[0];
    assert!(found > lagged && found < lagged + 0.05 * 6.0 * seconds);
    // It would have started at the reading.
    let mut new = S::new(leak(&heated(LAGGING)));
    new.update(&warm(8.0), ALL, DT);
    assert_eq!(new.auxiliaries()[0], 8.0);
}

#[test]
fn time_that_passes_without_updates_counts_for_temperatures_and_moves_nothing() {
    let mut moving = running(&heated(LAGGING), 2.0);
    let mut resting = running(&heated(LAGGING), 2.0);
    for second in 0..90 {
        for _ in 0..1000 {
            moving.update(&warm(8.0), ALL, DT);
        }
        let before = resting.correction().dq;
        let aux = warm(8.0).auxiliaries;
        // In ten parts, one of which is neither a whole number of periods nor positive.
        (0..9).for_each(|_| resting.pass_time(&aux, 0.1));
        resting.pass_time(&aux, 0.0988);
        resting.pass_time(&aux, -1.0);
        resting.pass_time(&aux, f32::NAN);
        assert_eq!(resting.correction().dq, before);
        // What has changed comes in within the bounds.
        let change = resting.update(&warm(8.0), ALL, DT).dq[0] - before[0];
        assert!(
            change.abs() <= 1.000_01 * DT * bare().axes[0].rate_bound,
            "{second}"
        );
        for _ in 0..200 {
            resting.update(&warm(8.0), ALL, 1e-6);
        }
        // Steps of 10 instead of 1 ms: the error of Euler's method is half a step, 0.05/s · 6 K · 5 ms.
        let off = moving.auxiliaries()[0] - resting.auxiliaries()[0];
        assert!(off.abs() < 3e-3, "{off}");
    }
    assert!(moving.auxiliaries()[0] > 7.0);
    // A call takes no longer than ten seconds' worth.
    let lagged = resting.auxiliaries()[0];
    resting.pass_time(&warm(8.0).auxiliaries, f32::INFINITY);
    resting.update(&warm(8.0), ALL, DT);
    let left = 8.0 - resting.auxiliaries()[0];
    assert!((left / (8.0 - lagged) - 0.606_5).abs() < 1e-3);
}

#[test]
fn a_lost_or_implausible_reading_is_a_fault_and_is_not_followed() {
    // 5 to 120 °C, and the reference is 20 °C.
    for lost in [
        f32::NAN,
        f32::INFINITY,
        -293.15,
        -20.0,
        -15.01,
        100.01,
        2000.0,
    ] {
        let mut servo = running(&heated(LAGGING), 2.0);
        let before = servo.correction.dq;
        let held = std::format!("{:?}", servo.followers);
        for _ in 0..9 {
            let correction = servo.update(&warm(lost), ALL, DT);
            let fault = Conditions::BAD_INPUT | Conditions::BAD_AUXILIARY | Conditions::HELD;
            assert_eq!(correction.status.conditions, fault, "{lost}");
            assert_eq!(correction.dq, before);
        }
        assert_eq!(std::format!("{:?}", servo.followers), held);
        assert_eq!(servo.update(&warm(2.0), ALL, DT).status, Status::default());
    }
    for usable in [-15.0, 100.0] {
        let sensor = Sensor {
            rate: 10.0,
            ..Sensor::USUAL
        };
        let mut servo = S::new(leak(&heated(sensor)));
        let status = servo.update(&warm(usable), ALL, DT).status;
        assert!(!status.is(Conditions::BAD_AUXILIARY));
    }
}

#[test]
fn a_jump_is_a_fault_until_as_much_time_has_passed_as_a_plausible_change_takes() {
    // 10 K is 100 s at 0.1 K/s.
    let mut servo = running(&heated(Sensor::USUAL), -8.0);
    assert!(
        !servo
            .update(&warm(1.9), ALL, DT)
            .status
            .is(Conditions::BAD_AUXILIARY)
    );
    let mut servo = running(&heated(Sensor::USUAL), -8.0);
    let mut periods = 0_u32;
    while servo
        .update(&warm(8.0), ALL, 0.01)
        .status
        .is(Conditions::BAD_AUXILIARY)
    {
        periods += 1;
        if periods == 1000 {
            assert_eq!(servo.correction.dq, [0.0; 3]);
        }
    }
    // Six kelvin too many.
    assert!((5990..6010).contains(&periods), "{periods}");
    // While corrections are switched off, it starts anew.
    let mut servo = running(&heated(Sensor::USUAL), -8.0);
    servo.disable();
    settle(&mut servo, &warm(-8.0));
    assert!(
        !servo
            .update(&warm(8.0), ALL, DT)
            .status
            .is(Conditions::BAD_AUXILIARY)
    );
    let now = servo.update(&warm(8.0), ALL, DT).computed[0];
    assert!((now - 0.08).abs() < 1e-8);
}

#[test]
fn a_sensor_that_feeds_nothing_is_no_fault() {
    let mut draft = heated(Sensor::USUAL);
    draft.auxiliaries.insert(0, draft.auxiliaries[0].clone());
    draft.banks[0].input = 4;
    let mut servo = enabled(leak(&draft));
    let mut inputs = warm(f32::NAN);
    inputs.auxiliaries[1] = 2.0;
    let correction = settle(&mut servo, &inputs);
    assert_eq!(correction.status, Status::default());
    assert!(servo.at_rest);
}

#[test]
fn compensations_with_different_lags_do_not_replace_each_other_while_running() {
    let mut servo = running(&heated(LAGGING), 2.0);
    let refused = servo.swap(leak(&heated(Sensor::USUAL)));
    assert_eq!(
        refused.map_err(|refused| refused.why).err(),
        Some(Refused::Auxiliaries)
    );
    let other = Sensor {
        rate: 0.2,
        range: [0.0, 100.0],
        ..LAGGING
    };
    assert!(servo.swap(leak(&heated(other))).is_ok());
}

#[test]
fn a_temperature_beyond_its_tables_is_reported_for_as_long_as_it_lasts() {
    let draft = heated(LAGGING);
    let mut servo = running(&draft, 10.0);
    let border = servo.correction;
    let mut beyond = 0;
    for _ in 0..3000 {
        let correction = servo.update(&warm(12.0), ALL, DT);
        let reported = correction.status.is(Conditions::BEYOND_RANGE);
        beyond += u32::from(reported);
        assert_eq!(reported, servo.followed[0] > 10.0);
        assert_eq!(correction.dq, border.dq);
    }
    assert!(beyond > 2900);
    // The temperature with its lag counts, and is back within the range later.
    let reported = (0..60_000).filter(|_| {
        let conditions = servo.update(&warm(8.0), ALL, DT).status.conditions;
        conditions == Conditions::BEYOND_RANGE
    });
    assert!((500..20_000).contains(&reported.count()));
    assert_eq!(leak(&draft).range(0), Some([-10.0, 10.0]));
}

#[test]
fn tables_with_a_narrower_range_report_it_in_the_first_period_after_the_swap() {
    let wide = heated(Sensor::USUAL);
    let mut narrow = wide.clone();
    narrow.banks[0] = bank(3, -5.0, 10.0, vec![vec![-0.05, 0.05]]);
    for enabled in [false, true] {
        let mut servo = running(&wide, 8.0);
        if !enabled {
            servo.disable();
            settle(&mut servo, &warm(8.0));
        }
        let to = leak(&narrow);
        servo.swap(to).unwrap();
        let mut periods = 0;
        while servo.is_swapping() {
            assert!(!servo.correction.status.is(Conditions::BEYOND_RANGE));
            servo.update(&warm(8.0), ALL, DT);
            periods += 1;
            assert!(periods < 10_000);
        }
        for _ in 0..3 {
            let status = servo.update(&warm(8.0), ALL, DT).status;
            assert!(status.is(Conditions::BEYOND_RANGE));
        }
    }
}

#[test]
fn during_a_fade_both_compensations_have_the_same_temperature() {
    let mut other = heated(Sensor::USUAL);
    other.terms = vec![term(0, -1.0, &[0]), term(1, 0.5, &[0])];
    let mut servo = running(&heated(Sensor::USUAL), 2.0);
    servo.swap(leak(&other)).unwrap();
    let mut kelvin = 2.0_f64;
    while servo.is_swapping() {
        kelvin += 0.000_1;
        servo.update(&warm(kelvin as f32), ALL, DT);
        let f = f64::from(servo.blend.value());
        if servo.is_swapping() {
            let expected = of(kelvin) * (1.0 - 2.0 * f);
            let off = (f64::from(servo.correction.dq[0]) - expected).abs();
            assert!(off < 2.0 * ROUNDING, "{off} at {f}");
        }
    }
    assert!(kelvin > 2.5);
}
