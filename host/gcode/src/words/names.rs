//! Words of a Sinumerik that are more than a letter and a number.

use super::digits::{Number, number_at};
use super::{Block, TRANSFORMATIONS, Word};
use crate::axes;
use crate::fault::{FLAT, Fault, Kind};
use crate::modal::Distance;

/// Nothing that positions depend on: how smoothly it goes, messages, looking ahead, the spindle.
const NEUTRAL: &str = "MSG STOPRE SOFT BRISK FFWON FFWOF COMPCAD COMPON COMPCURV COMPOF COMPSURF CYCLE832 FIFOCTRL UPATH \
    SPATH SETMS SPOS SPOSA LIMS CFC CFIN CFTCP WORKPIECE ADIS ADISPOS ORIAXES ORISOF DYNNORM DYNPOS \
    DYNROUGH DYNSEMIFIN DYNFINISH DYNPREC CTOL OTOL ATOL FNORM RTLION RTLIOF CUT2D WALIMON WALIMOF";

/// Frames, which nothing but an end of them may name.
const FRAMES: &str = "TRANS ATRANS ROT AROT SCALE ASCALE MIRROR AMIRROR ROTS";

/// Corners, angles and poles, from which the controller computes the path.
const CORNERS: &str = "RND RNDM CHF CHR ANG AP RP";

/// Paths that are neither lines nor arcs by their end, moves that measure, and offsets of the path.
const PATHS: &str = "CIP CT TURN ASPLINE BSPLINE CSPLINE POLY INVCW INVCCW OFFN MEAS MEAW";

/// What computes or jumps.
const FLOW: &str = "DEF PROC EXTERN CALL PCALL MCALL IF ELSE ENDIF FOR ENDFOR WHILE ENDWHILE LOOP GOTO GOTOF GOTOB \
    REPEAT";

/// Names that are not followed, why, and what to post instead.
const UNFOLLOWED: [(&str, &str, &str); 4] = [
    (
        FRAMES,
        "a frame: coordinates that are moved, turned, scaled or mirrored are not followed",
        "post the part in G54 to G57 alone",
    ),
    (
        "CYCLE800 PLANE",
        "CYCLE800: a swivelled plane is not followed",
        "post the part with TRAORI, or as three-axis moves for each position of the rotary axes",
    ),
    (
        CORNERS,
        "the control computes the path from corners, angles or poles, and that is not followed",
        "post the path with G1, G2 and G3 and coordinates",
    ),
    (
        PATHS,
        "a path other than G0 to G3 is not followed",
        "post the path with G1, G2 and G3",
    ),
];

/// True for one of several names.
fn is_among(names: &str, name: &str) -> bool {
    names.split(' ').any(|one| one == name)
}

/// A tool's name as the number by which it is known here: beyond those that programs write.
#[must_use]
pub(crate) fn number_of_name(name: &str) -> u32 {
    // FNV-1a.
    let hash = name.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte.to_ascii_uppercase())).wrapping_mul(0x100_0000_01B3)
    });
    2_000_000 + (hash % 90_000_000) as u32
}

impl Block {
    /// A word at a letter, and where it ends.
    pub(super) fn named_word(&mut self, line: &[u8], start: usize) -> Result<usize, Fault> {
        let is_name = |b: &&u8| b.is_ascii_alphanumeric() || **b == b'_';
        let length = line[start..].iter().take_while(is_name).count();
        let name = String::from_utf8_lossy(&line[start..start + length]).to_ascii_uppercase();
        let after = skip_blanks(line, start + length);
        let assigns = line.get(after) == Some(&b'=');
        let mut letters = name.bytes().take_while(u8::is_ascii_alphabetic);
        let is_letter = letters.by_ref().count() == 1;
        if is_letter && name.starts_with('R') && (assigns || length > 1) {
            return Err(
                Fault::new(start..line.len(), "a parameter: the program computes", FLAT)
                    .kind(Kind::Parameter),
            );
        }
        if is_letter && !assigns {
            return self.word_at(line, start);
        }
        let value = skip_blanks(line, after + 1);
        if assigns && (is_letter || name == "CR") {
            let letter = match name.as_str() {
                "CR" => b'R',
                _ => name.as_bytes()[0],
            };
            return self.assigned(line, start..start + length, letter, value);
        }
        let end = match (assigns, line.get(after)) {
            (true, _) => number_at(line, value).map_or(value, |number| number.end),
            (false, Some(b'(')) => arguments(line, after)?,
            (false, _) => start + length,
        };
        if let Some((_, value)) = TRANSFORMATIONS.iter().find(|(turn, _)| *turn == name) {
            return self.add(Word::meant(b'M', *value, start, end));
        }
        match name.as_str() {
            "SUPA" => self.add(Word::meant(b'G', 53.0, start, start + length)),
            name if is_among(NEUTRAL, name) || self.ends_frame(name, &line[end..]) => {
                self.has_text = true;
                Ok(end)
            }
            name => {
                let is_label = line.get(after) == Some(&b':');
                Err(unfollowed(name, is_label, start..end.max(start + 1)))
            }
        }
    }

    /// True for the name of a frame alone in its line, whatever its number.
    fn ends_frame(&self, name: &str, behind: &[u8]) -> bool {
        let mut behind = behind.iter().take_while(|b| **b != b';');
        is_among(FRAMES, name)
            && behind.all(u8::is_ascii_whitespace)
            && self.words.iter().all(|w| w.letter == b'N')
    }

    /// `X=1.5`, `T="NAME"`, `S1=3000`, `CR=10`.
    fn assigned(
        &mut self,
        line: &[u8],
        name: std::ops::Range<usize>,
        letter: u8,
        value: usize,
    ) -> Result<usize, Fault> {
        let start = name.start;
        if letter == b'T' && line.get(value) == Some(&b'"') {
            return self.named_tool(line, start, value);
        }
        let indexed = name.len() > 1 && letter != b'R';
        if indexed && !matches!(letter, b'S' | b'M') {
            return Err(Fault::new(
                start..value,
                "an axis or a value with a number: it is not followed",
                "write the letter alone",
            )
            .kind(Kind::Word));
        }
        let is_place = axes::index(letter).is_some() || matches!(letter, b'I' | b'J' | b'K');
        let counts_from = own_distance(line, value).filter(|_| is_place);
        let value = counts_from.map_or(value, |(_, at)| at);
        let read = number_at(line, value);
        let closes = |number: &Number| counts_from.is_none() || line.get(number.end) == Some(&b')');
        let number = read.filter(closes).ok_or_else(|| {
            Fault::new(
                start..line.len(),
                "a value that is no number: DC, ACP, ACN, or an expression",
                "write numbers, absolute under G90 and incremental under G91, or in AC( ) and IC( )",
            )
            .kind(Kind::Expression)
        })?;
        self.add(Word {
            end: number.end + usize::from(counts_from.is_some()),
            distance: counts_from.map(|(distance, _)| distance),
            ..Word::with_number(letter, start, value, &number)
        })
    }

    /// `T="NAME"`, whose first quote is at `quote`.
    fn named_tool(&mut self, line: &[u8], start: usize, quote: usize) -> Result<usize, Fault> {
        let rest = &line[quote + 1..];
        let Some(length) = rest.iter().position(|b| *b == b'"') else {
            return Err(Fault::new(
                start..line.len(),
                "a name that does not end",
                "end it with \"",
            ));
        };
        let name = String::from_utf8_lossy(&rest[..length]).into_owned();
        let number = name.parse().unwrap_or_else(|_| number_of_name(&name));
        self.add(Word::meant(
            b'T',
            f64::from(number),
            start,
            quote + length + 2,
        ))
    }
}

/// Why a name cannot be read.
fn unfollowed(name: &str, is_label: bool, span: std::ops::Range<usize>) -> Fault {
    let mut known = UNFOLLOWED.into_iter();
    let known = known.find(|(names, ..)| is_among(names, name));
    let is_cycle = || {
        ["CYCLE", "POCKET", "HOLES"]
            .iter()
            .any(|cycle| name.starts_with(cycle))
    };
    let (cause, remedy) = match known {
        Some((_, cause, remedy)) => (cause, remedy),
        None if is_cycle() => (
            "a cycle of a Sinumerik is not read",
            "post cycles as single moves: G0 and G1",
        ),
        None if is_among(FLOW, name) || is_label => {
            let cause = "a jump, a loop or a subprogram: the program computes";
            return Fault::new(span, cause, FLAT).kind(Kind::Flow);
        }
        None => (
            "no word of a Sinumerik that is known",
            "check --dialect, or take it out if it moves nothing",
        ),
    };
    Fault::new(span, cause, remedy).kind(Kind::Word)
}

/// What a value counts from that stands in AC( ) or IC( ), and where its number begins.
fn own_distance(line: &[u8], at: usize) -> Option<(Distance, usize)> {
    let name = line.get(at..at + 2)?.to_ascii_uppercase();
    let distance = match name.as_slice() {
        b"AC" => Distance::Absolute,
        b"IC" => Distance::Incremental,
        _ => return None,
    };
    let open = skip_blanks(line, at + 2);
    (line.get(open) == Some(&b'(')).then(|| (distance, skip_blanks(line, open + 1)))
}

fn skip_blanks(line: &[u8], from: usize) -> usize {
    let rest = line.get(from..).unwrap_or_default();
    from + rest
        .iter()
        .take_while(|b| matches!(b, b' ' | b'\t'))
        .count()
}

/// Behind what stands in brackets, texts in quotes among it.
fn arguments(line: &[u8], open: usize) -> Result<usize, Fault> {
    let (mut depth, mut quoted) = (0, false);
    for (at, byte) in line.iter().enumerate().skip(open) {
        match byte {
            b'"' => quoted = !quoted,
            b'(' if !quoted => depth += 1,
            b')' if !quoted => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Ok(at + 1);
        }
    }
    Err(Fault::new(
        open..line.len(),
        "a bracket that does not end",
        "end it with `)` in the same line",
    ))
}

#[cfg(test)]
mod tests {
    use crate::Dialect;
    use crate::codes::Code;
    use crate::fault::Kind;
    use crate::words::Block;
    use proptest::prelude::*;

    fn scan(line: &str) -> Result<Block, Kind> {
        let mut block = Block::default();
        let done = block.scan(line.as_bytes(), Dialect::Siemens);
        done.map(|()| block).map_err(|fault| fault.kind)
    }

    #[test]
    fn names_and_assignments_are_words_of_a_letter_and_a_number() {
        let words = |line: &str| -> Vec<(char, f64)> {
            let block = scan(line).unwrap();
            let words = block.words.iter();
            words.map(|w| (char::from(w.letter), w.value)).collect()
        };
        assert_eq!(
            words("N10 G2 X=1.5 Y-2 CR=10.5 F=100 ; to (here"),
            [
                ('N', 10.0),
                ('G', 2.0),
                ('X', 1.5),
                ('Y', -2.0),
                ('R', 10.5),
                ('F', 100.0)
            ]
        );
        assert_eq!(
            words("G0 SUPA Z0 D0"),
            [('G', 0.0), ('G', 53.0), ('Z', 0.0), ('D', 0.0)]
        );
        let [supa, own] = ["SUPA Z0", "G153 Z0"].map(|line| scan(line).unwrap());
        for block in [supa, own] {
            let code = block.words[0].code(Dialect::Siemens);
            assert_eq!(code, Some(Code::MachineCoordinates));
        }
        assert_eq!(words("T=\"12\""), [('T', 12.0)]);
        assert_eq!(words("S1=3000 M1=3"), [('S', 3000.0), ('M', 3.0)]);
        assert_eq!(words("MSG(\"a ) b\") TRAORI(1)"), [('M', 428.9)]);
        assert_eq!(words("CYCLE832(0.01,_FINISH,1)"), []);
        assert_eq!(words("TRANS"), []);
    }

    #[test]
    fn what_is_not_followed_is_named() {
        assert_eq!(scan("R1=5").unwrap_err(), Kind::Parameter);
        for value in [
            "DC(5)", "ACP(5)", "AC(R1)", "IC(5", "AC(5+1)", "-IC(5)", "5*2",
        ] {
            assert!(scan(&format!("A={value}")).is_err(), "{value}");
        }
        assert_eq!(scan("A=DC(5)").unwrap_err(), Kind::Expression);
        assert_eq!(scan("CYCLE83(1,2)").unwrap_err(), Kind::Word);
        assert_eq!(scan("TRANS X10").unwrap_err(), Kind::Word);
        assert_eq!(scan("IF R1>5").unwrap_err(), Kind::Flow);
        assert_eq!(scan("AGAIN: X5").unwrap_err(), Kind::Flow);
        assert_eq!(scan("T=\"MILL").unwrap_err(), Kind::Other);
        for (line, cause) in [
            ("G1 X20 RND=2", "corners"),
            ("G1 X20 CHF=2", "corners"),
            ("CIP X30 Y10 I1=20 J1=20", "other than G0 to G3"),
            ("MEAS=1 G1 X20", "other than G0 to G3"),
            ("SETPIECE(1)", "no word of a Sinumerik"),
        ] {
            let fault = Block::default().scan(line.as_bytes(), Dialect::Siemens);
            let message = fault.unwrap_err().cause;
            assert!(message.contains(cause), "{line}: {message}");
        }
    }

    proptest! {
        #[test]
        fn no_line_makes_the_scanner_panic(line in proptest::collection::vec(any::<u8>(), 0..60), text in "[A-Z0-9=\"() ;_.]{0,40}") {
            let mut block = Block::default();
            let _ = block.scan(&line, Dialect::Siemens);
            let _ = block.scan(text.as_bytes(), Dialect::Siemens);
        }
    }
}
