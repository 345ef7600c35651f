//! Files that are changed in one place, and refused there.

use std::fmt::Debug;
use trueaxis_model::source::FileError;

/// Checks rows of `from | to | line | message`: the text with the first `from` replaced by `to` is refused at this line with
/// this message and a remedy. A line of `-` is none; `\n` ends a line.
#[track_caller]
pub fn are_refused<T: Debug>(text: &str, rows: &str, read: impl Fn(&str) -> Result<T, FileError>) {
    for row in rows.lines() {
        let row = row.replace("\\n", "\n");
        let cells: Vec<&str> = row.split('|').map(|cell| cell.trim_matches(' ')).collect();
        let [from, to, line, message] = cells[..] else {
            panic!("{row}");
        };
        assert!(text.contains(from), "{from}");
        let text = text.replacen(from, to, 1);
        let error = read(&text).unwrap_err();
        assert!(error.message.contains(message), "{row}: {error}");
        assert_eq!(error.line(&text), line.parse().ok(), "{row}: {error}");
        assert!(!error.remedy.is_empty());
    }
}
