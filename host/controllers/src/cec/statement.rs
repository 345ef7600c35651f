//! Splits a file with tables into statements.

use super::axes::is_name;
use super::reading::LengthUnit;
use std::ops::Range;
use trueaxis_model::source::FileError;

/// One statement.
#[derive(Clone, Debug, PartialEq)]
pub enum CecStatement<'t> {
    /// `$NAME[i,k]=value`: the name in capitals without its dollar sign, the value without parentheses or quotes.
    Assignment {
        name: String,
        indices: Vec<&'t str>,
        value: &'t str,
    },
    /// `METRIC`, `INCH`
    Units(LengthUnit),
    /// `%_N_…`, `CHANDATA(1)`: where the file belongs.
    Place,
    /// `…`: values were left out.
    Gap,
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
        let mut rest = LineCursor { text, at: next };
        next += line.len();
        let code = line.split(';').next().unwrap_or(line);
        let end = rest.at + code.trim_end().len();
        rest.skip(&text[..end], |c| c.is_whitespace() || c == '\u{feff}');
        let is_block_number = |word: &str| {
            let digits = word.strip_prefix(['N', 'n']);
            digits.is_some_and(|d| !d.is_empty() && d.bytes().all(|b| b.is_ascii_digit()))
        };
        let word = rest.word(end);
        if is_block_number(word) {
            rest.at += word.len();
        }
        loop {
            rest.skip(&text[..end], char::is_whitespace);
            if rest.at >= end {
                break;
            }
            found.push(rest.statement(end)?);
        }
    }
    Ok(found)
}

/// The unread part of a line.
struct LineCursor<'t> {
    text: &'t str,
    at: usize,
}

impl<'t> LineCursor<'t> {
    fn skip(&mut self, until: &str, is: impl Fn(char) -> bool) {
        let rest = until.get(self.at..).unwrap_or("");
        self.at += rest.len() - rest.trim_start_matches(is).len();
    }

    /// Letters, digits and characters that may be part of a word.
    fn word(&self, end: usize) -> &'t str {
        let rest = &self.text[self.at..end.max(self.at)];
        let is_part = |c: char| c.is_alphanumeric() || c == '_';
        rest.split(|c| !is_part(c)).next().unwrap_or("")
    }

    fn statement(&mut self, end: usize) -> Result<PlacedStatement<'t>, FileError> {
        let start = self.at;
        let rest = &self.text[start..end];
        let whole = start..end;
        let upper = rest.to_ascii_uppercase();
        let one_word = |statement| Ok((statement, whole.clone()));
        let all = self.at;
        self.at = end;
        match upper.as_str() {
            "METRIC" => return one_word(CecStatement::Units(LengthUnit::Metric)),
            "INCH" => return one_word(CecStatement::Units(LengthUnit::Inch)),
            "M17" | "M30" | "M2" | "M02" | "M0" | "M00" => return one_word(CecStatement::End),
            "..." | "…" => return one_word(CecStatement::Gap),
            _ => {}
        }
        if upper.strip_prefix("%_N_").is_some_and(is_name) {
            return one_word(CecStatement::Place);
        }
        if let Some(channel) = upper.strip_prefix("CHANDATA(") {
            let channel = channel.strip_suffix(')').unwrap_or("").trim();
            if channel.parse::<u8>().is_ok_and(|n| n > 0) {
                return one_word(CecStatement::Place);
            }
        }
        if !rest.starts_with('$') {
            return Err(FileError::at(
                whole,
                "this is not understood",
                "neither $AN_CEC… nor METRIC, INCH, CHANDATA or M17",
                "keep only the tables of the compensation in the file, and comments after a semicolon",
            ));
        }
        self.at = all;
        self.assignment(end)
    }

    /// `$NAME[i,k]=value`
    fn assignment(&mut self, end: usize) -> Result<PlacedStatement<'t>, FileError> {
        let start = self.at;
        let text = &self.text[..end];
        self.at += 1;
        let name = self.word(end);
        self.at += name.len();
        self.skip(text, char::is_whitespace);
        let Some(inside) = text[self.at..].strip_prefix('[') else {
            return Err(bad(
                self.at..end,
                "an index in brackets is missing",
                "like $AN_CEC[0,12]=0.005",
            ));
        };
        let Some((inside, _)) = inside.split_once(']') else {
            return Err(bad(
                self.at..end,
                "a bracket is not closed",
                "like $AN_CEC[0,12]=0.005; is the file cut off?",
            ));
        };
        let indices: Vec<&str> = inside.split([',', '.']).map(unwrapped).collect();
        self.at += inside.len() + 2;
        self.skip(text, char::is_whitespace);
        if !text[self.at..].starts_with('=') {
            return Err(bad(
                self.at..end,
                "an equals sign is missing",
                "like $AN_CEC[0,12]=0.005; is the file cut off?",
            ));
        }
        self.at += 1;
        self.skip(text, char::is_whitespace);
        let rest = &text[self.at..];
        let length = match rest.chars().next() {
            Some('(') => rest.find(')').map(|n| n + 1),
            Some('"') => rest[1..].find('"').map(|n| n + 2),
            _ => Some(
                rest.find(|c: char| c.is_whitespace() || c == '$')
                    .unwrap_or(rest.len()),
            ),
        };
        let value = &rest[..length.unwrap_or(0)];
        if value.is_empty() {
            return Err(bad(
                start..end,
                "nothing is assigned",
                "like $AN_CEC[0,12]=0.005; is the file cut off?",
            ));
        }
        self.at += value.len();
        let statement = CecStatement::Assignment {
            name: name.to_ascii_uppercase(),
            indices,
            value: unwrapped(value),
        };
        Ok((statement, start..self.at))
    }
}

fn bad(span: Range<usize>, message: &str, remedy: &str) -> FileError {
    FileError::at(span, message, "here", format!("write it {remedy}"))
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
            name: name.to_owned(),
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
        assert_eq!(statements("; only a comment\n\n   \n").unwrap(), []);
        assert_eq!(one("%_N_NC_CEC_INI"), CecStatement::Place);
        assert_eq!(one("chandata(1)"), CecStatement::Place);
        assert_eq!(one("INCH"), CecStatement::Units(LengthUnit::Inch));
        assert_eq!(one("..."), CecStatement::Gap);
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
        ] {
            let error = statements(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {}", error.message);
            assert_eq!(error.line(text), Some(line), "{text}");
        }
    }
}
