//! Splits a file with tables into statements.

use super::axes::is_name;
use super::reading::LengthUnit;
use std::ops::Range;
use trueaxis_model::source::FileError;

/// One statement.
#[derive(Clone, Debug, PartialEq)]
pub enum CecStatement<'t> {
    /// `$NAME[i,k]=value`: the name in capitals, the value without parentheses or quotes.
    Assignment {
        name: String,
        indices: Vec<&'t str>,
        value: &'t str,
    },
    /// `METRIC`, `INCH`
    Units(LengthUnit),
    /// `%_N_…`, `CHANDATA(1)`: where the file belongs.
    Place,
    /// `M17`, `M30`, `M2`, `M0`
    End,
}

/// A statement with its bytes in the file.
pub type PlacedStatement<'t> = (CecStatement<'t>, Range<usize>);

/// All statements of a file.
///
/// # Errors
/// [`FileError`] at the first text that is not a statement.
pub fn statements(text: &str) -> Result<Vec<PlacedStatement<'_>>, FileError> {
    let mut found = Vec::new();
    let mut next = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split(';').next().unwrap_or(line);
        let own = without_block_number(code);
        let mut at = next + code.len() - own.len();
        next += line.len();
        // A word, then any number of assignments, each of which a word may follow.
        for (number, part) in own.split('$').enumerate() {
            let start = at.saturating_sub(usize::from(number > 0));
            let span = start..at + part.trim_end().len();
            at += part.len() + 1;
            let word = match (number, part.trim()) {
                (0, word) => word,
                (_, part) => {
                    let (assigned, word) = assignment(part).map_err(|(message, remedy)| {
                        FileError::here(span.clone(), message, format!("write it {remedy}"))
                    })?;
                    found.push((assigned, span.clone()));
                    word
                }
            };
            if !word.is_empty() {
                let statement = one_word(word).ok_or_else(|| not_understood(word, span.clone()))?;
                found.push((statement, span));
            }
        }
    }
    Ok(found)
}

/// Also without spaces and a byte order mark at the start.
fn without_block_number(code: &str) -> &str {
    let code = code.trim_start_matches(|c: char| c.is_whitespace() || c == '\u{feff}');
    let digits = code.strip_prefix(['N', 'n']).unwrap_or("");
    let rest = digits.trim_start_matches(|c: char| c.is_ascii_digit());
    let is_number = rest.len() < digits.len() && !rest.starts_with(char::is_alphanumeric);
    if is_number { rest.trim_start() } else { code }
}

fn one_word<'t>(word: &str) -> Option<CecStatement<'t>> {
    let upper = word.to_ascii_uppercase();
    let channel = upper.strip_prefix("CHANDATA(");
    let channel = channel.and_then(|c| c.strip_suffix(')')?.trim().parse::<u8>().ok());
    match upper.as_str() {
        "METRIC" => Some(CecStatement::Units(LengthUnit::Metric)),
        "INCH" => Some(CecStatement::Units(LengthUnit::Inch)),
        "M17" | "M30" | "M2" | "M02" | "M0" | "M00" => Some(CecStatement::End),
        _ if channel.is_some_and(|number| number > 0) => Some(CecStatement::Place),
        _ if upper.strip_prefix("%_N_").is_some_and(is_name) => Some(CecStatement::Place),
        _ => None,
    }
}

fn not_understood(word: &str, span: Range<usize>) -> FileError {
    if ["...", "…"].contains(&word) {
        return FileError::at(
            span,
            "values are left out",
            "left out here",
            "write the value of every point",
        );
    }
    FileError::at(
        span,
        "this is not understood",
        "neither $AN_CEC… nor METRIC, INCH, CHANDATA or M17",
        "keep only the tables of the compensation in the file, and comments after a semicolon",
    )
}

/// `NAME[i,k]=value`, and the text after it; otherwise a message and how to write it.
fn assignment(text: &str) -> Result<(CecStatement<'_>, &str), (&'static str, &'static str)> {
    const LIKE: &str = "like $AN_CEC[0,12]=0.005; is the file cut off?";
    let (name, rest) = (text.split_once('[')).ok_or((
        "an index in brackets is missing",
        "like $AN_CEC[0,12]=0.005",
    ))?;
    let (indices, rest) = rest
        .split_once(']')
        .ok_or(("a bracket is not closed", LIKE))?;
    let value = rest.trim_start().strip_prefix('=');
    let value = value.ok_or(("an equals sign is missing", LIKE))?.trim();
    let (value, rest) = match value.starts_with(['(', '"']) {
        true => (value, ""),
        false => value.split_once(char::is_whitespace).unwrap_or((value, "")),
    };
    let value = unwrapped(value);
    if value.is_empty() || value.starts_with(['(', '"']) {
        return Err(("nothing is assigned", LIKE));
    }
    let assigned = CecStatement::Assignment {
        name: format!("${}", name.trim().to_ascii_uppercase()),
        indices: indices.split([',', '.']).map(unwrapped).collect(),
        value,
    };
    Ok((assigned, rest.trim()))
}

/// Removes spaces, and surrounding parentheses or quotes.
fn unwrapped(text: &str) -> &str {
    let text = text.trim();
    for (open, close) in [('(', ')'), ('"', '"')] {
        let inside = text.strip_prefix(open).and_then(|t| t.strip_suffix(close));
        if let Some(inside) = inside {
            return inside.trim();
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(line: &str) -> CecStatement<'_> {
        let mut found = statements(line).unwrap();
        assert_eq!(found.len(), 1, "{line}");
        found.remove(0).0
    }

    fn assignment<'t>(name: &str, indices: &[&'t str], value: &'t str) -> CecStatement<'t> {
        CecStatement::Assignment {
            name: format!("${name}"),
            indices: indices.to_vec(),
            value,
        }
    }

    #[test]
    fn statements_are_read_however_they_are_written() {
        let points = assignment("AN_CEC", &["0", "12"], "-0.005");
        for line in [
            "$AN_CEC[0,12]=-0.005",
            " n10 $an_cec [ 0 , 12 ] = -0.005 ; comment",
            "$AN_CEC[0.12]=(-0.005)\r\n",
            "\u{feff}$AN_CEC[0,12]=-0.005",
        ] {
            assert_eq!(one(line), points, "{line}");
        }
        for value in ["AX3", "(AX3)", "\"AX3\"", "( AX3 )"] {
            let line = format!("$AN_CEC_INPUT_AXIS[3]={value}");
            assert_eq!(one(&line), assignment("AN_CEC_INPUT_AXIS", &["3"], "AX3"));
        }
        assert_eq!(statements("$A[0]=1 $B[1]=2$C[2]=3").unwrap().len(), 3);
        let ends = statements("$A[0]=1 M17").unwrap();
        assert_eq!((ends.len(), &ends[1].0), (2, &CecStatement::End));
        assert_eq!(statements("; only a comment\n\n   \n").unwrap(), []);
        assert_eq!(one("%_N_NC_CEC_INI"), CecStatement::Place);
        assert_eq!(one("chandata(1)"), CecStatement::Place);
        assert_eq!(one("INCH"), CecStatement::Units(LengthUnit::Inch));
        assert_eq!(one("N99 M17"), CecStatement::End);
    }

    #[test]
    fn what_is_no_statement_is_named_with_its_line() {
        for (text, line, message) in [
            ("METRIC\nG0 X0", 2, "not understood"),
            ("$AN_CEC", 1, "index in brackets"),
            ("$AN_CEC[0,1", 1, "not closed"),
            ("\n\n$AN_CEC[0,1]", 3, "equals sign"),
            ("$AN_CEC[0,1]=", 1, "nothing is assigned"),
            ("$AN_CEC[0,1]=(AX1", 1, "nothing is assigned"),
            ("CHANDATA(0)", 1, "not understood"),
            ("%_N_", 1, "not understood"),
            ("äöü", 1, "not understood"),
            ("METRIC\n...", 2, "values are left out"),
            ("$AN_CEC[0,1]=0 1", 1, "not understood"),
        ] {
            let error = statements(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {}", error.message);
            assert_eq!(error.line(text), Some(line), "{text}");
        }
    }
}
