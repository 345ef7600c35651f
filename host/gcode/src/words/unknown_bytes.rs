//! Messages for bytes that are not words.

use crate::fault::{FLAT, Fault, Kind};

/// True for the first lines of a Heidenhain program in Klartext, with a line number or without.
pub(super) fn is_klartext(line: &[u8]) -> bool {
    let line = String::from_utf8_lossy(line).to_ascii_uppercase();
    let line = line.trim_start_matches(|c: char| c.is_ascii_digit() || c.is_whitespace());
    let mut words = line.split_whitespace();
    matches!(
        (words.next(), words.next()),
        (Some("BEGIN"), Some("PGM"))
            | (Some("BLK"), Some("FORM"))
            | (Some("TOOL"), Some("CALL" | "DEF"))
            | (Some("CYCL"), Some("DEF" | "CALL"))
    )
}

/// What to say of a byte that begins no word.
pub(super) fn strange(line: &[u8], at: usize) -> Fault {
    let span = at..line.len();
    match line[at] {
        b'#' => Fault::new(span, "a parameter: the program computes", FLAT).kind(Kind::Parameter),
        b'[' => {
            Fault::new(span, "an expression: the program computes", FLAT).kind(Kind::Expression)
        }
        b'@' | b'^' => match line.get(at + 1) {
            Some(b'#' | b'[') => strange(line, at + 1),
            _ => Fault::new(
                span,
                "polar coordinates (@, ^) are not followed",
                "write the program out with X and Y",
            )
            .kind(Kind::Word),
        },
        b'\r' if line[at..].iter().all(|b| *b == b'\r') => Fault::new(
            at..at + 1,
            "the line ends with CR CR LF: its line ends were converted twice",
            "end lines with LF or with CR LF",
        ),
        0 => Fault::new(
            at..at + 1,
            "a NUL byte: the file is UTF-16 or damaged",
            "save it as ASCII or UTF-8",
        ),
        0xFE | 0xFF if at == 0 => Fault::new(
            at..at + 1,
            "the file is UTF-16",
            "save it as ASCII, or as UTF-8 without a byte order mark",
        ),
        b'\r' => Fault::new(
            at..at + 1,
            "a carriage return within the line",
            "end lines with LF or with CR LF: the file has CR alone, as old Macintosh files do",
        ),
        0xEF if at == 0 => Fault::new(
            at..at + 1,
            "the file begins with a byte order mark",
            "save it as ASCII, or as UTF-8 without a byte order mark",
        ),
        b'$' | b'?' => Fault::new(
            span,
            "a command to Grbl's sender: it may home, unlock or set something",
            "take it out, and give it by hand before the program",
        )
        .kind(Kind::Word),
        b',' if matches!(line.get(at + 1), Some(b'A' | b'C' | b'R' | b'a' | b'c' | b'r')) => Fault::new(
            span,
            "a chamfer, a rounding or an angle (,C ,R ,A), from which the control computes the path: it is not followed",
            "post corners as moves: G1, G2 and G3",
        )
        .kind(Kind::Word),
        _ if is_klartext(line) => Fault::new(
            0..line.len(),
            "Heidenhain Klartext: this language is not read",
            "use the compensation in the control (trueaxis export heidenhain)",
        )
        .kind(Kind::Word),
        byte if byte.is_ascii_digit() || byte == b'.' || byte == b'-' || byte == b'+' => {
            Fault::new(
                span,
                "a number without a letter",
                "write a letter before it; spaces within a number are not read",
            )
        }
        _ => Fault::new(
            span,
            "this begins no word",
            "a line is words, each a letter and a number, with comments in ( ) or after ;",
        ),
    }
}
