//! Messages for bytes that are not words.

use crate::fault::{FLAT, Fault, Kind};

/// What to say of a line of a Heidenhain control that cannot be read as G-code.
pub(super) fn heidenhain(line: &[u8]) -> Option<Fault> {
    let cause = match line {
        _ if is_klartext(line) => "Heidenhain Klartext: this language is not read",
        _ if is_din_iso(line) => "DIN/ISO of a Heidenhain control: this language is not read",
        _ => return None,
    };
    let remedy = "use the compensation in the control (trueaxis export heidenhain)";
    Some(Fault::new(0..line.len(), cause, remedy).kind(Kind::Word))
}

/// True for lines that only a program in Klartext has, with a line number or without.
fn is_klartext(line: &[u8]) -> bool {
    let line = String::from_utf8_lossy(line).to_ascii_uppercase();
    let line = line.trim_start_matches(|c: char| c.is_ascii_digit() || c.is_whitespace());
    let words: Vec<&str> = line.split_whitespace().collect();
    let is_path = match words[..] {
        ["BEGIN" | "END", "PGM", ..] | ["BLK", "FORM", ..] | ["*", "-", ..] => true,
        ["TOOL" | "CYCL", "CALL" | "DEF", ..] | ["LBL", ..] | ["CALL", "LBL" | "PGM", ..] => true,
        ["L" | "LN" | "LP" | "C" | "CC" | "CP" | "CR", to, ..] => to.contains(['+', '-']),
        _ => false,
    };
    is_path || words.contains(&"FMAX")
}

/// True for a block of a program in DIN/ISO, which ends with `*`; the first one is `%NAME G71 *`.
pub(super) fn is_din_iso(line: &[u8]) -> bool {
    let Some((b'*', block)) = line.trim_ascii().split_last() else {
        return false;
    };
    let is_unit = |word: &[u8]| matches!(word, b"G70" | b"G71");
    match block.first() {
        Some(b'%') => block.split(u8::is_ascii_whitespace).any(is_unit),
        first => first.is_some_and(u8::is_ascii_alphanumeric),
    }
}

/// True for the digits of a checksum, at the end of a line.
fn is_checksum(rest: &[u8]) -> bool {
    let digits = rest.trim_ascii_end();
    !digits.is_empty() && digits.iter().all(u8::is_ascii_digit)
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
        b'*' if is_checksum(&line[at + 1..]) => Fault::new(
            span,
            "a checksum, which hosts add to the lines that they send to a printer",
            "take the checksums out, or give the program as it was before it was sent",
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
