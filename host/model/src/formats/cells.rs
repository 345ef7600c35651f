//! Lines and cells of CSV.

use crate::source::FileError;
use std::ops::Range;

/// One cell: its text and where it stands in the file.
pub type Cell<'t> = (&'t str, Range<usize>);

/// The cells of a line that starts at byte `start`. Numbers need no quotes; names may have them.
pub fn cells(line: &str, start: usize) -> Vec<Cell<'_>> {
    let mut at = start;
    line.split(',')
        .map(|cell| {
            let inner = cell.trim();
            let from = at + (cell.len() - cell.trim_start().len());
            at += cell.len() + 1;
            let bare = inner
                .strip_prefix('"')
                .and_then(|c| c.strip_suffix('"'))
                .map_or(inner, str::trim);
            (bare, from..from + inner.len())
        })
        .collect()
}

/// Lines that are not empty, with the byte they start at.
pub fn lines(text: &str) -> impl Iterator<Item = (&str, usize)> {
    let mut next = 0;
    text.split_inclusive('\n')
        .map(move |line| {
            let start = next;
            next += line.len();
            (line.trim_end_matches(['\n', '\r']), start)
        })
        .map(|(line, start)| match line.strip_prefix('\u{feff}') {
            Some(rest) if start == 0 => (rest, '\u{feff}'.len_utf8()),
            _ => (line, start),
        })
        .filter(|(line, _)| !line.trim().is_empty())
}

/// What is wrong with a line whose columns are separated by something else.
pub fn separated(line: &str, start: usize) -> Option<FileError> {
    let (mark, name) = [(';', "semicolons"), ('\t', "tabs")]
        .into_iter()
        .find(|(mark, _)| line.contains(*mark))?;
    let at = start + line.find(mark)?;
    Some(FileError::at(
        at..at + 1,
        format!("the columns are separated by {name}"),
        "here",
        "separate the columns with commas, and write numbers with a decimal point: 12.5,-3",
    ))
}
