//! Observations of instruments in the output of `trueaxis identify`.

use super::super::quantity::{EXPANDED, count};
use trueaxis_identify::FoundSetup;
use trueaxis_study::StudyOutcome;

/// What was measured, in words.
pub fn counts(found: &StudyOutcome<'_>) -> String {
    let (probed, observed) = (&found.probings.rows, &found.observations.rows);
    let balls = count(found.probings.balls.len(), "ball");
    let mut setups: Vec<usize> = observed.iter().map(|row| row.setup).collect();
    setups.sort_unstable();
    setups.dedup();
    let setups = format!(
        "{} with {}",
        count(observed.len(), "observation"),
        count(setups.len(), "set-up")
    );
    let runs = match found.runs.len() {
        0 => String::new(),
        1 => ", beside 1 file of runs".to_owned(),
        files => format!(", beside {files} files of runs"),
    };
    let counts = match (probed.len(), observed.len()) {
        (probings, 0) => format!("{probings} probings of {balls}"),
        (0, _) => setups,
        (probings, _) => format!("{probings} probings of {balls} and {setups}"),
    };
    counts + &runs
}

/// The noise of each source, if there are others than probings.
pub fn noise(text: &mut String, found: &StudyOutcome<'_>) {
    if found.observations.rows.is_empty() {
        return;
    }
    *text += "\nsource             rows         noise   of stated   degrees of freedom\n";
    for one in &found.identified.components {
        let factor = one.of_stated.map_or("-".to_owned(), |f| format!("{f:.2}"));
        *text += &format!(
            "  {:<15}{:>6}{:>9.2} {:<4}{factor:>12}{:>21.1}\n",
            one.source.name(),
            one.rows,
            one.noise * 1e3,
            one.source.unit(),
            one.freedom
        );
    }
}

/// Set-ups as found, and drift.
pub fn setups(text: &mut String, found: &StudyOutcome<'_>) {
    let has_parts = |setup: &&FoundSetup| !setup.parts.is_empty();
    let setups: Vec<_> = found.identified.setups.iter().filter(has_parts).collect();
    let longest = setups.iter().map(|setup| setup.name.chars().count()).max();
    let width = longest.map_or(0, |longest| longest.max(13) + 1);
    if !setups.is_empty() {
        *text += &format!("\n{:<width$}{:>33}   expanded (k = 2)\n", "set-up", "found");
    }
    let number = |v: f64| (v * 1e4).round() / 1e4 + 0.0;
    for setup in setups {
        for part in &setup.parts {
            let (factor, unit) = part.shown();
            let prior = part.prior.map_or(String::new(), |prior| {
                let z = prior.z.map_or("nothing else shows it".to_owned(), |z| {
                    format!("|z| = {:.1}", z.abs())
                });
                let (stated, sigma) = (number(prior.value * factor), prior.sigma * factor);
                format!(", stated as {stated:.4} ± {sigma:.4} ({z})")
            });
            *text += &format!(
                "  {:<width$}{:<20}{:>12.4}{:>12.4} {unit}{prior}\n",
                setup.name,
                part.what,
                // Avoids -0.
                number(part.value * factor),
                EXPANDED * part.uncertainty * factor
            );
        }
    }
    if !found.identified.drift.is_empty() {
        *text += "\ndrift, found together with the parameters (k = 2)\n";
    }
    for drift in &found.identified.drift {
        *text += &format!("  {}\n", drift);
    }
}
