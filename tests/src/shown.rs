//! Compares printed output with that shown in the manual.

/// Whether a printed number matches a shown one.
fn same_number(printed: &str, shown: &str, least: f64) -> bool {
    let (Ok(a), Ok(b)) = (printed.parse::<f64>(), shown.parse::<f64>()) else {
        return false;
    };
    let Some((_, decimals)) = shown.split_once('.') else {
        return false;
    };
    // One unit, plus a margin for the rounding of this subtraction.
    let unit = 10_f64.powi(-i32::try_from(decimals.len()).unwrap());
    (a - b).abs() <= (1.001 * unit).max(least)
}

/// Whether a printed line matches a shown one, ignoring spaces: words must be equal, numbers equal to a unit in the
/// last digit shown, or to `least`.
#[must_use]
pub fn same(printed: &str, shown: &str, least: f64) -> bool {
    let words = |line: &str| -> Vec<String> {
        let parts = line.split([' ', ',', '(', ')']);
        let parts = parts.filter(|part| !part.is_empty());
        parts.map(str::to_owned).collect()
    };
    let (printed, shown) = (words(printed), words(shown));
    printed.len() == shown.len()
        && printed
            .iter()
            .zip(&shown)
            .all(|(a, b)| a == b || same_number(a, b, least))
}
