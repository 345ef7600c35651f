//! Resistances in published tables give the temperatures listed with them.

use proptest::prelude::*;

use crate::{Curve, Ntc, Platinum, SensorError};

/// IEC 60751, PT100: Ω every 10 °C from −200 to 850 °C.
#[rustfmt::skip]
const IEC_60751: [f32; 106] = [
    18.52, 22.83, 27.10, 31.34, 35.54, 39.72, 43.88, 48.00, 52.11, 56.19,
    60.26, 64.30, 68.33, 72.33, 76.33, 80.31, 84.27, 88.22, 92.16, 96.09,
    100.00, 103.90, 107.79, 111.67, 115.54, 119.40, 123.24, 127.08, 130.90, 134.71,
    138.51, 142.29, 146.07, 149.83, 153.58, 157.33, 161.05, 164.77, 168.48, 172.17,
    175.86, 179.53, 183.19, 186.84, 190.47, 194.10, 197.71, 201.31, 204.90, 208.48,
    212.05, 215.61, 219.15, 222.68, 226.21, 229.72, 233.21, 236.70, 240.18, 243.64,
    247.09, 250.53, 253.96, 257.38, 260.78, 264.18, 267.56, 270.93, 274.29, 277.64,
    280.98, 284.30, 287.62, 290.92, 294.21, 297.49, 300.75, 304.01, 307.25, 310.49,
    313.71, 316.92, 320.12, 323.30, 326.48, 329.64, 332.79, 335.93, 339.06, 342.18,
    345.28, 348.38, 351.46, 354.53, 357.59, 360.64, 363.67, 366.70, 369.71, 372.71,
    375.70, 378.68, 381.65, 384.60, 387.55, 390.48,
];

/// Vishay NTCLE100E3103 (10 kΩ, B(25/85) = 3977 K): Ω every 5 °C from −40 to 150 °C, computed with the equation for
/// R(T) of data sheet 29049; the test covers its equation for T(R).
const VISHAY: [f32; 39] = [
    332_094.0, 239_900.0, 175_200.0, 129_287.0, 96_358.0, 72_500.0, 55_046.0, 42_157.0, 32_554.0,
    25_339.0, 19_872.0, 15_698.0, 12_488.0, 10_000.0, 8_059.0, 6_535.0, 5_330.0, 4_372.0, 3_605.0,
    2_989.0, 2_490.0, 2_084.0, 1_753.0, 1_481.0, 1_256.0, 1_070.0, 915.4, 786.0, 677.3, 585.7,
    508.3, 442.6, 386.6, 338.7, 297.7, 262.4, 231.9, 205.5, 182.6,
];

/// Error due to f32, K: see the sweeps below.
const ROUNDING: f32 = 3e-4;

/// Ω of platinum in f64, R(0) = 1 Ω.
fn platinum(t: f64) -> f64 {
    let below = if t < 0.0 {
        -4.183e-12 * (t - 100.0) * t.powi(3)
    } else {
        0.0
    };
    1.0 + 3.9083e-3 * t - 5.775e-7 * t * t + below
}

#[test]
fn platinum_is_the_table_of_iec_60751() {
    for (number, ohms) in (0_u8..).zip(IEC_60751) {
        let celsius = f32::from(number) * 10.0 - 200.0;
        // The table is rounded to 0.01 Ω, so the temperature is between those for half a unit less and more.
        for (sensor, size) in [(Platinum::PT100, 1.0), (Platinum::PT1000, 10.0)] {
            let at = |ohms: f32| sensor.celsius(ohms * size).expect("in range");
            let (low, high) = (at(ohms - 0.005), at(ohms + 0.005));
            assert!(low <= celsius + ROUNDING, "{celsius}: {low}");
            assert!(high >= celsius - ROUNDING, "{celsius}: {high}");
            assert!(high - low < 0.04, "{celsius}: {low} {high}");
        }
    }
}

#[test]
fn platinum_in_f32_is_within_its_rounding() {
    let mut largest = 0.0_f64;
    for hundredth in -20_000..=85_000 {
        let celsius = f64::from(hundredth) * 0.01;
        let ohms = (100.0 * platinum(celsius)) as f32;
        let found = Platinum::PT100.celsius(ohms).expect("in range");
        largest = largest.max((f64::from(found) - celsius).abs());
    }
    assert!(largest < f64::from(ROUNDING), "{largest}");
}

#[test]
fn a_thermistor_is_the_table_of_its_maker() {
    for (number, ohms) in (0_u8..).zip(VISHAY) {
        let celsius = f32::from(number) * 5.0 - 40.0;
        let found = Ntc::VISHAY_10K_3977.celsius(ohms).expect("in range");
        // Four digits are 0.01 K, and the manufacturer computes the table with a different equation (R from T).
        assert!((found - celsius).abs() < 0.012, "{celsius}: {found}");
    }
}

#[test]
fn thermistors_in_f32_are_within_their_rounding() {
    let [a, b, c, d] = [3.354_016e-3, 2.569_850e-4, 2.620_131e-6, 6.383_091e-8];
    let mut largest = 0.0_f64;
    // From 170 Ω to 1 MΩ, slightly more than −55 … 150 °C.
    for step in 0..20_000 {
        let ohms = (170.0 * f64::exp(f64::from(step) * 4.2e-4)) as f32;
        let Ok(found) = Ntc::VISHAY_10K_3977.celsius(ohms) else {
            continue;
        };
        let l = (f64::from(ohms) / 1e4).ln();
        let celsius = 1.0 / (a + l * (b + l * (c + l * d))) - 273.15;
        largest = largest.max((f64::from(found) - celsius).abs());
    }
    assert!(largest > 0.0 && largest < f64::from(ROUNDING), "{largest}");
}

#[test]
fn the_constant_b_is_exact_where_it_was_measured() {
    let ntc = Ntc::beta(10_000.0, 3977.0);
    let at = |ohms| ntc.celsius(ohms).expect("in range");
    assert!((at(10_000.0) - 25.0).abs() < ROUNDING);
    // The table has four digits, B four: 0.01 K each.
    assert!((at(1_070.0) - 85.0).abs() < 0.02);
    // As documented, about 0.3 K in between; and 3 K at −40 °C.
    assert!((0.29..0.33).contains(&(55.0 - at(2_989.0))));
    assert!((2.9..3.1).contains(&(at(332_094.0) + 40.0)));
}

#[test]
fn steinhart_and_hart_is_through_its_three_points() {
    // Coefficients from 0, 25 and 50 °C of the table, in f64.
    let points = [(32_554.0_f64, 0.0), (10_000.0, 25.0), (3_605.0, 50.0)];
    let [(l1, y1), (l2, y2), (l3, y3)] =
        points.map(|(ohms, celsius): (f64, f64)| (ohms.ln(), 1.0 / (celsius + 273.15)));
    let (g2, g3) = ((y2 - y1) / (l2 - l1), (y3 - y1) / (l3 - l1));
    let c = (g3 - g2) / (l3 - l2) / (l1 + l2 + l3);
    let b = g2 - c * (l1 * l1 + l1 * l2 + l2 * l2);
    let a = y1 - (b + l1 * l1 * c) * l1;
    let ntc = Ntc::steinhart_hart(a as f32, b as f32, c as f32);
    for (ohms, celsius) in points {
        // ln R is 10 here and its cube 1000, which loses more digits than a ratio.
        let found = ntc.celsius(ohms as f32).expect("in range");
        assert!((found - celsius as f32).abs() < 5e-4, "{celsius}: {found}");
    }
    // Between them it is within the rounding of the table.
    let between = ntc.celsius(19_872.0).expect("in range");
    assert!((between - 10.0).abs() < 0.012, "{between}");
}

#[test]
fn what_no_temperature_has_is_open_or_shorted() {
    let pt100 = |ohms| Platinum::PT100.celsius(ohms);
    let ntc = |ohms| Ntc::VISHAY_10K_3977.celsius(ohms);
    for ohms in [0.0, 1.0, 18.4] {
        assert_eq!(pt100(ohms), Err(SensorError::Short));
    }
    for ohms in [390.6, 1e6, f32::INFINITY] {
        assert_eq!(pt100(ohms), Err(SensorError::Open));
    }
    for ohms in [0.0, 1e-30, 1.0, 178.0] {
        assert_eq!(ntc(ohms), Err(SensorError::Short), "{ohms}");
    }
    // −56 °C is 1.02 MΩ.
    for ohms in [1.1e6, 1e9, f32::INFINITY] {
        assert_eq!(ntc(ohms), Err(SensorError::Open), "{ohms}");
    }
    assert!(ntc(1.0e6).is_ok() && ntc(179.0).is_ok());
    for ohms in [-1e-30, -1.0, -1e30, f32::NEG_INFINITY, f32::NAN] {
        assert_eq!(pt100(ohms), Err(SensorError::Implausible));
        assert_eq!(ntc(ohms), Err(SensorError::Implausible));
    }
    // Impossible curves.
    for zero in [0.0, -100.0, f32::NAN] {
        assert!(Platinum::new(zero).celsius(100.0).is_err());
        assert!(Ntc::beta(zero, 3977.0).celsius(100.0).is_err());
    }
    for b in [0.0, f32::NAN] {
        assert!(Ntc::beta(10_000.0, b).celsius(100.0).is_err());
    }
}

proptest! {
    /// Any resistance gives a temperature in the sensor's range, or an error.
    #[test]
    fn no_resistance_is_an_impossible_temperature(bits in any::<u32>()) {
        let ohms = f32::from_bits(bits);
        for celsius in [
            Platinum::PT100.celsius(ohms),
            Platinum::PT1000.celsius(ohms),
        ].into_iter().flatten() {
            prop_assert!((-200.2..=850.2).contains(&celsius));
        }
        for celsius in [
            Ntc::VISHAY_10K_3977.celsius(ohms),
            Ntc::beta(1e4, 3380.0).celsius(ohms),
        ].into_iter().flatten() {
            prop_assert!((-56.01..=151.01).contains(&celsius));
        }
    }
}
