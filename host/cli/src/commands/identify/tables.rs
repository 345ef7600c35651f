//! Error motions that runs show, which `trueaxis identify` keeps as tables.

use super::super::measured::motions;
use super::study::StudyOutcome;

/// The tables on the screen.
pub fn lines(text: &mut String, found: &StudyOutcome<'_>) {
    let Some(kept) = &found.kept else {
        return;
    };
    *text += "\nkept as tables\n";
    motions(text, found.machine, found.runs, kept);
}
