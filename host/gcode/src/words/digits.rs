//! Numbers as they stand in a line: the f64 that is nearest to their digits.

/// Powers of ten that f64 holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];

/// A number as it is written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number {
    pub value: f64,
    /// Behind its last digit.
    pub end: usize,
    /// Digits behind the point.
    pub decimals: usize,
    pub point: bool,
}

/// The number at a place, if there is one.
pub(super) fn number_at(line: &[u8], start: usize) -> Option<Number> {
    let mut at = start;
    let negative = match line.get(at) {
        Some(b'-') => {
            at += 1;
            true
        }
        Some(b'+') => {
            at += 1;
            false
        }
        _ => false,
    };
    let digits = at;
    let (mut mantissa, mut decimals, mut point) = (0_u64, 0, false);
    let mut read = |at: &mut usize| {
        let from = *at;
        for byte in &line[from..] {
            let digit = byte.wrapping_sub(b'0');
            if digit > 9 {
                break;
            }
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
            *at += 1;
        }
        *at - from
    };
    let mut count = read(&mut at);
    if line.get(at) == Some(&b'.') {
        at += 1;
        point = true;
        decimals = read(&mut at);
        count += decimals;
    }
    if count == 0 {
        return None;
    }
    // Both exact, so that one division rounds once.
    let magnitude = if count <= 15 && decimals < POWERS.len() {
        mantissa as f64 / POWERS[decimals]
    } else {
        let text = std::str::from_utf8(&line[digits..at]).ok()?;
        text.parse().ok()?
    };
    let value = if negative { -magnitude } else { magnitude };
    Some(Number {
        value,
        end: at,
        decimals,
        point,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_number_is_the_f64_nearest_to_its_digits(text in "[+-]?[0-9]{1,20}(\\.[0-9]{0,20})?") {
            let Number { value, end, .. } = number_at(text.as_bytes(), 0).unwrap();
            prop_assert_eq!(end, text.len());
            prop_assert_eq!(value, text.trim_end_matches('.').parse::<f64>().unwrap());
        }
    }
}
