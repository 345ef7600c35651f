//! Numbers on the command line.

use std::ops::RangeInclusive;
use std::str::FromStr;

/// Larger numbers are mistakes in any of the units (µm, mm, mm/min, s).
const MOST: f64 = 1e6;

fn within<T: FromStr + PartialOrd>(
    text: &str,
    range: RangeInclusive<T>,
    wanted: &str,
) -> Result<T, String> {
    let value = text.parse().ok().filter(|value| range.contains(value));
    value.ok_or_else(|| format!("write {wanted}"))
}

pub fn positive(text: &str) -> Result<f64, String> {
    within(
        text,
        f64::MIN_POSITIVE..=MOST,
        "a number above 0, at most 1e6",
    )
}

/// A magnitude in µm or µrad.
pub fn size(text: &str) -> Result<f64, String> {
    within(text, 0.0..=MOST, "a number from 0 to 1e6")
}

pub fn percent(text: &str) -> Result<f64, String> {
    within(text, 0.0..=100.0, "a number from 0 to 100")
}

/// Half angle of a cone, in degrees.
pub fn cone(text: &str) -> Result<f64, String> {
    within(text, 0.0..=180.0, "a number from 0 to 180")
}

/// A damping that a blob can store.
pub fn damping(text: &str) -> Result<f32, String> {
    let range = trueaxis::Policy::LEAST_DAMPING..=1.0;
    within(text, range, "a number from 0.01 to 1")
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    within(text, f64::MIN..=f64::MAX, "a finite number")
}

/// Three numbers, or zeros if none are given.
pub fn three(values: &[f64], option: &str, unit: &str) -> Result<[f64; 3], super::BadInput> {
    match *values {
        [] => Ok([0.0; 3]),
        [x, y, z] => Ok([x, y, z]),
        _ => Err(super::BadInput::new(
            format!("{option} takes three numbers"),
            format!("write {option} 5,0,-3 in {unit}"),
        )),
    }
}

/// Two numbers.
pub fn two(values: &[f64], option: &str, unit: &str) -> Result<[f64; 2], super::BadInput> {
    match *values {
        [x, y] => Ok([x, y]),
        _ => Err(super::BadInput::new(
            format!("{option} takes two numbers"),
            format!("write {option} 0,25 in {unit}"),
        )),
    }
}
