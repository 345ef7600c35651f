//! Numbers as they are written.

use super::axes;
use super::modal::Units;

/// Decimals that a position needs: 0.1 µm, 1e-5 degrees (0.17 µrad), half of which is lost by rounding.
#[must_use]
pub fn decimals(axis: usize, units: Units) -> usize {
    match (axes::is_rotary(axis), units) {
        (true, _) => 5,
        (false, Units::Millimetre) => 4,
        (false, Units::Inch) => 6,
    }
}

/// Powers of ten, as many as numbers have decimals.
const POWERS: [f64; 16] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15,
];

/// Their last digits.
const LAST: [f64; 16] = [
    1e0, 1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 1e-14,
    1e-15,
];
/// Room for any number below 9e15.
const PLACES: usize = 32;

/// A number with so many decimals.
#[must_use]
pub fn rounded(value: f64, decimals: usize) -> f64 {
    let power = POWERS[decimals.min(15)];
    nearest(value * power) / power
}

/// The last of so many decimals.
#[must_use]
pub fn last_digit(decimals: usize) -> f64 {
    LAST[decimals.min(15)]
}

/// The least number with so many decimals that is not below, but for what f64 loses.
#[must_use]
pub fn up(value: f64, decimals: usize) -> f64 {
    let power = POWERS[decimals.min(15)];
    (value * power - 1e-5).ceil() / power
}

/// Half of the last digit, and a little more: what rounding can be off.
#[must_use]
pub fn finest(decimals: usize) -> f64 {
    0.6 * last_digit(decimals)
}

/// [`f64::round`] but for the sign of 0, which is a call where the processor is not known to have it.
fn nearest(value: f64) -> f64 {
    /// Just below a half: with a half itself the number before it would be rounded up.
    const HALF: f64 = 0.499_999_999_999_999_94;
    // Above, all numbers are whole.
    if value.abs() < 4e15 {
        (value + HALF.copysign(value)) as i64 as f64
    } else {
        value.round()
    }
}

/// A number with so many decimals at most, and so many at least; what it then is.
pub fn write(to: &mut Vec<u8>, value: f64, most: usize, least: usize, point: bool) -> f64 {
    let most = most.min(15);
    let scaled = nearest(value * POWERS[most]);
    if scaled.abs() >= 9e15 {
        // Far outside any travel.
        let text = format!("{value:.most$}");
        to.extend_from_slice(text.as_bytes());
        // What f64 writes f64 reads.
        return text.parse().unwrap_or(value);
    }
    let rounded = scaled / POWERS[most];
    let mut digits = scaled.abs() as u64;
    let mut count = most;
    while count > least && digits.is_multiple_of(10) {
        digits /= 10;
        count -= 1;
    }
    // From behind: 17 digits, a point and a sign at most, so no place is taken twice.
    let mut text = [0_u8; PLACES];
    let mut at = PLACES;
    let mut put = |byte| {
        at -= 1;
        text[at % PLACES] = byte;
    };
    for _ in 0..count {
        put(b'0' + (digits % 10) as u8);
        digits /= 10;
    }
    if count > 0 || point {
        put(b'.');
    }
    loop {
        put(b'0' + (digits % 10) as u8);
        digits /= 10;
        if digits == 0 {
            break;
        }
    }
    if scaled < 0.0 {
        put(b'-');
    }
    to.extend_from_slice(&text[at..]);
    rounded
}

/// A feed with six digits that count; what it then is.
pub(crate) fn write_feed(to: &mut Vec<u8>, value: f64, point: bool) -> f64 {
    let size = value.abs();
    // Not by a logarithm, which is computed where no feed is written too.
    let before_point = POWERS[1..=5].iter().filter(|power| size >= **power).count();
    let zeros = POWERS[..10]
        .iter()
        .filter(|power| size * **power < 1.0)
        .count();
    write(to, value, 5 - before_point + zeros, 0, point)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_number_is_rounded_as_the_library_does(whole in -1_000_000_000_i64..1_000_000_000, off in -3_i64..4, any in any::<f64>()) {
            // At a half, and next to it.
            let half = whole as f64 + 0.5;
            let next = f64::from_bits((half.to_bits() as i64 + off) as u64);
            for value in [next, any, half, whole as f64, 0.5, -0.5, 0.5 - f64::EPSILON / 4.0] {
                let expected = value.round();
                prop_assert!(nearest(value) == expected || expected.is_nan(), "{value}");
            }
        }
    }

    #[test]
    fn numbers_are_written_with_the_decimals_they_need() {
        let written = |value, most, least, point| {
            let mut text = Vec::new();
            let rounded = write(&mut text, value, most, least, point);
            let text = String::from_utf8(text).unwrap();
            assert_eq!(
                text.trim_end_matches('.').parse::<f64>().unwrap(),
                rounded,
                "{text}"
            );
            text
        };
        assert_eq!(written(10.01234, 4, 0, false), "10.0123");
        assert_eq!(written(10.0, 4, 0, false), "10");
        assert_eq!(written(10.0, 4, 0, true), "10.");
        assert_eq!(written(10.0, 4, 2, true), "10.00");
        assert_eq!(written(-0.00004, 4, 0, false), "0");
        assert_eq!(written(-0.0501, 4, 0, false), "-0.0501");
        assert_eq!(written(0.5, 4, 0, false), "0.5");
        assert_eq!(written(99.99996, 4, 0, false), "100");
        let mut text = Vec::new();
        assert_eq!(write_feed(&mut text, 0.012_345_678, false), 0.012_345_7);
        assert_eq!(write_feed(&mut text, 1234.5678, false), 1234.57);
        assert_eq!(write_feed(&mut text, 1.234_567_8e-8, false), 1.234_57e-8);
    }
}
