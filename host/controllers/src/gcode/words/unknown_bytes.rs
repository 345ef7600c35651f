//! Messages for bytes that are not words.

use crate::gcode::fault::{FLAT, Fault, Kind};

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
