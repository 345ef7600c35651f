//! A divider returns the resistance, independent of the reference; impossible ratios give an error.

use crate::{Divider, Ntc, Resistive, SensorError, Side};

/// Ratio of a sensor, as measured by a converter.
fn ratio(ohms: f32, divider: Divider) -> f32 {
    match divider.sensor {
        Side::Low => ohms / (ohms + divider.resistor),
        Side::High => divider.resistor / (ohms + divider.resistor),
    }
}

const SIDES: [Divider; 2] = [
    Divider {
        resistor: 4_700.0,
        sensor: Side::Low,
    },
    Divider {
        resistor: 4_700.0,
        sensor: Side::High,
    },
];

#[test]
fn a_divider_gives_the_resistance_of_either_side() {
    for divider in SIDES {
        for ohms in [47.0, 470.0, 4_700.0, 10_000.0, 100_000.0] {
            let found = divider.ohms(ratio(ohms, divider)).expect("within");
            // A ratio near 0 or 1 has fewer digits left: 100 of 2^-24.
            assert!((found / ohms - 1.0).abs() < 6e-6, "{ohms} {found}");
        }
    }
    assert_eq!(SIDES[0].ohms(0.25), Ok(4_700.0 * (0.25 / 0.75)));
    assert_eq!(SIDES[1].ohms(0.25), Ok(4_700.0 * 3.0));
}

#[test]
fn the_ends_are_open_and_shorted_and_nothing_is_beyond() {
    let [low, high] = SIDES;
    assert_eq!(low.ohms(0.0), Err(SensorError::Short));
    assert_eq!(low.ohms(1.0), Err(SensorError::Open));
    assert_eq!(high.ohms(0.0), Err(SensorError::Open));
    assert_eq!(high.ohms(1.0), Err(SensorError::Short));
    for divider in SIDES {
        for ratio in [-1e-30, -1.0, 1.000_001, f32::INFINITY, f32::NAN] {
            assert_eq!(divider.ohms(ratio), Err(SensorError::Implausible));
        }
    }
    for resistor in [0.0, -1.0, f32::INFINITY, f32::NAN] {
        let divider = Divider { resistor, ..low };
        assert_eq!(divider.ohms(0.5), Err(SensorError::Implausible));
    }
}

#[test]
fn a_converter_that_has_nothing_or_fails_is_passed_on() {
    let mut script = [
        Ok(None),
        Err(SensorError::Converter),
        Ok(Some(0.5)),
        Ok(Some(0.0)),
        Ok(Some(4095.0 / 4096.0)),
        Ok(Some(f32::NAN)),
    ]
    .into_iter();
    let divider = Divider {
        resistor: 10_000.0,
        sensor: Side::Low,
    };
    let ratio = || script.next().expect("one each");
    let mut sensor = Resistive::new(ratio, divider, Ntc::VISHAY_10K_3977);
    assert_eq!(sensor.celsius(), Ok(None));
    assert_eq!(sensor.celsius(), Err(SensorError::Converter));
    let celsius = sensor.celsius().expect("a reading").expect("a reading");
    // Error due to f32.
    assert!((celsius - 25.0).abs() < 2e-4, "{celsius}");
    assert_eq!(sensor.celsius(), Err(SensorError::Short));
    // The last count of 12 bits: 41 MΩ.
    assert_eq!(sensor.celsius(), Err(SensorError::Open));
    assert_eq!(sensor.celsius(), Err(SensorError::Implausible));
}

#[test]
fn an_error_says_whether_the_sensor_is_open_or_shorted() {
    for (error, open, short, words) in [
        (SensorError::Open, true, false, "open"),
        (SensorError::Short, false, true, "shorted"),
        (SensorError::Converter, false, false, "the converter failed"),
    ] {
        assert_eq!((error.is_open(), error.is_short()), (open, short));
        assert_eq!(std::format!("{error}"), words);
    }
}
