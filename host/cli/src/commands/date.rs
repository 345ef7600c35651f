//! The date on a page.

use super::bad_input::BadInput;
use std::time::{SystemTime, UNIX_EPOCH};

/// Variable with the time (s since 1970) that counts as now, for builds that give the same bytes each time:
/// <https://reproducible-builds.org/docs/source-date-epoch/>.
const VARIABLE: &str = "SOURCE_DATE_EPOCH";

/// The date as given; otherwise today (UTC) as `2026-11-28`.
pub fn given_or_today(given: Option<&str>) -> Result<String, BadInput> {
    if let Some(given) = given {
        return Ok(given.to_owned());
    }
    let seconds = match std::env::var(VARIABLE) {
        Ok(text) => text.parse().map_err(|_| {
            BadInput::new(
                format!("the environment variable {VARIABLE} is `{text}`, not seconds since 1970"),
                "unset it, or write a whole number",
            )
        })?,
        Err(_) => SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .map_or(0, |passed| passed.as_secs()),
    };
    Ok(day(seconds / 86_400))
}

/// A day after 1970-01-01 in the Gregorian calendar.
fn day(days: u64) -> String {
    // Years begin in March, so that the leap day is their last; 719 468 days from 0000-03-01 to 1970-01-01.
    let days = days + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let from_march = (5 * of_year + 2) / 153;
    let of_month = of_year - (153 * from_march + 2) / 5 + 1;
    let month = if from_march < 10 {
        from_march + 3
    } else {
        from_march - 9
    };
    let year = 400 * era + year + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::day;

    #[test]
    fn days_are_those_of_the_calendar() {
        // `date -u -d @… +%F`
        for (seconds, date) in [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_798_675_200, "2026-12-31"),
            (4_107_542_399, "2100-02-28"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(day(seconds / 86_400), date);
        }
    }
}
