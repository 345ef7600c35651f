//! Rounding of results and uncertainties, GUM (JCGM 100:2008) 7.2.6.

/// Part of an uncertainty by which rounding may lower it. The GUM names no number: it rounds 10.47 up to 11 (rounding
/// down would take 4.5 %) and 28.05 down to 28 (0.2 %).
const MAY_LOSE: f64 = 0.01;

/// A result and its expanded uncertainty as printed, with a true minus sign.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rounded {
    /// The result, to the last digit of the uncertainty.
    pub value: String,
    /// The uncertainty, to two significant digits.
    pub uncertainty: String,
}

/// Rounds the uncertainty to two significant digits, up unless that changes it by almost nothing, and the result to the
/// same digit. Both in the same unit; `None` if the uncertainty is not a positive number.
#[must_use]
pub fn rounded(value: f64, uncertainty: f64) -> Option<Rounded> {
    if !(uncertainty > 0.0 && uncertainty.is_finite() && value.is_finite()) {
        return None;
    }
    // Its last digit counts units of 10^place.
    let mut place = libm::log10(uncertainty).floor() as i32 - 1;
    let digits = uncertainty / 10_f64.powi(place);
    let below = digits.floor();
    let rest = digits - below;
    let mut digits = match rest >= 0.5 || rest > MAY_LOSE * digits {
        true => below + 1.0,
        false => below,
    };
    if digits >= 100.0 {
        (digits, place) = (10.0, place + 1);
    }
    let units = (value / 10_f64.powi(place)).round();
    Some(Rounded {
        value: decimal(units, place),
        uncertainty: decimal(digits, place),
    })
}

/// So many units of 10^place, with all zeros.
fn decimal(units: f64, place: i32) -> String {
    let decimals = usize::try_from(-place).unwrap_or(0);
    // Avoids "-0".
    let value = units * 10_f64.powi(place) + 0.0;
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn both(value: f64, uncertainty: f64) -> (String, String) {
        let rounded = rounded(value, uncertainty).unwrap();
        (rounded.value, rounded.uncertainty)
    }

    #[test]
    fn the_examples_of_the_gum_are_rounded_as_it_rounds_them() {
        // 7.2.6: 10.47 mΩ to 11 mΩ, 28.05 kHz to 28 kHz, 10.057 62 Ω with 27 mΩ to 10.058 Ω.
        assert_eq!(both(0.0, 10.47).1, "11");
        assert_eq!(both(0.0, 28.05).1, "28");
        assert_eq!(both(10.05762, 27e-3), ("10.058".into(), "0.027".into()));
        // 7.2.2: 100.021 47 g with 0.35 mg; 7.2.4: with 0.79 mg.
        assert_eq!(
            both(100.021_47, 0.35e-3),
            ("100.02147".into(), "0.00035".into())
        );
        assert_eq!(
            both(100.021_47, 0.79e-3),
            ("100.02147".into(), "0.00079".into())
        );
    }

    #[test]
    fn a_carry_keeps_two_digits_and_results_follow_the_uncertainty() {
        assert_eq!(both(-12.345, 0.999), ("−12.3".into(), "1.0".into()));
        assert_eq!(both(-12.345, 99.5), ("−10".into(), "100".into()));
        assert_eq!(both(55.6, 6.8), ("55.6".into(), "6.8".into()));
        assert_eq!(both(-0.004, 0.1), ("0.00".into(), "0.10".into()));
        assert_eq!(both(12_345.0, 2_301.0), ("12300".into(), "2300".into()));
        assert_eq!(both(12_345.0, 2_350.0), ("12300".into(), "2400".into()));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(rounded(1.0, bad), None);
        }
        assert_eq!(rounded(f64::NAN, 1.0), None);
    }

    #[test]
    fn an_uncertainty_never_loses_more_than_a_hundredth_nor_gains_more_than_a_tenth() {
        // Every uncertainty of five digits, over six decades; a step of the last digit is a tenth of 10 at most.
        for decade in -3..3 {
            for digits in 10_000..100_000 {
                let exact = f64::from(digits) * 10_f64.powi(decade - 4);
                let shown: f64 = both(0.0, exact).1.parse().unwrap();
                let ratio = shown / exact;
                assert!(
                    (0.99 - 1e-9..1.1 + 1e-9).contains(&ratio),
                    "{exact} {shown}"
                );
            }
        }
    }
}
