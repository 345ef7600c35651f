//! Lines of a printer's program. Only those that move the axes or say how are read as words; all others pass as they are:
//! words M with text after them, words T, macros of Klipper.

use super::digits::number_at;
use super::{Block, Word};
use crate::axes;
use crate::codes::{self, Code};
use crate::fault::{Fault, Kind};
use std::ops::Range;

/// What a line that is not read does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// It leaves the axes where they are, or brings them back.
    Stays,
    /// It homes, probes or parks: where the axes are then is not known.
    Moves,
    /// It brings back a position and modes that were stored.
    Restores,
}

/// Words G (in tenths) that do not move the axes, or bring them back: retractions of the firmware, a stored position.
const STAY: [u16; 5] = [100, 110, 220, 230, 600];
/// Words G (in tenths) that home, probe, level, clean or park.
const MOVE: [u16; 21] = [
    120, 260, 270, 290, 291, 292, 300, 320, 330, 340, 350, 380, 381, 382, 383, 384, 385, 760, 800,
    810, 4250,
];
/// The word G, in tenths, that homes.
const HOME: u16 = 280;
/// Goes to a stored position.
const STORED: u16 = 610;
/// G53, which stands before the move that it holds for.
const MACHINE: u16 = 530;
/// Words M (in tenths) with names of files, messages and passwords, in which letters and digits mean nothing.
const TEXT: [u16; 16] = [
    160, 230, 280, 300, 320, 330, 360, 370, 380, 1170, 1180, 4860, 5500, 5510, 5870, 9280,
];

impl Block {
    /// Reads a line that is not read as words.
    ///
    /// # Errors
    /// A program that is not text, and a command that corrects the axes a second time.
    pub(super) fn scan_printer(&mut self, line: &[u8]) -> Result<bool, Fault> {
        let blanks = line.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let start = behind_number(line, blanks);
        let rest = &line[start..];
        if rest.starts_with(b"GCDE") {
            return Err(Fault::new(
                0..4,
                "binary G-code",
                "switch binary G-code off in the slicer, in the settings of the printer",
            ));
        }
        let is_name = |b: &&u8| b.is_ascii_alphabetic() || **b == b'_';
        let name = &rest[..rest.iter().take_while(is_name).count()];
        let number = match name {
            [_] => number_at(line, start + 1),
            _ => None,
        };
        let tenths = number.as_ref().and_then(|number| {
            let word = Word::with_number(b'G', start, start + 1, number);
            word.tenths().map(|tenths| (word, tenths))
        });
        let span = start..line.len();
        let command = match (name, tenths) {
            ([b'G' | b'g'], Some((word, HOME))) => {
                self.home(line, word);
                return Ok(true);
            }
            ([b'G' | b'g'], Some((_, tenths))) => command_g(tenths, rest, span)?,
            ([b'M' | b'm'], Some((_, tenths))) => command_m(tenths, rest, span)?,
            ([b'T' | b't'], _) => Some(Command::Stays),
            ([] | [_], _) => None,
            (name, _) => Some(command_by_name(name, rest, span)?),
        };
        let Some(command) = command else {
            return Ok(false);
        };
        if matches!(name, [b'M' | b'm'])
            && let Some((word, tenths)) = tenths
            && !TEXT.contains(&tenths)
            && let Some(at) = second_command(line, word.end)
        {
            return Err(several(at..line.len()));
        }
        self.command = Some(command);
        self.has_text = true;
        self.end = line.len();
        Ok(true)
    }

    /// A line of words has one command, which comes first; words of axes stand beside moves and G92 alone.
    ///
    /// # Errors
    /// A line that firmwares read differently.
    pub(super) fn one_command(&self) -> Result<(), Fault> {
        let mut words = self.words.iter().filter(|word| word.letter != b'N');
        let is_command = |word: &&Word| matches!(word.letter, b'G' | b'M');
        let mut first = words.next();
        if first.is_some_and(|word| is_command(&word) && word.tenths() == Some(MACHINE)) {
            first = words.next();
        }
        if let Some(second) = words.find(is_command) {
            return Err(several(second.start..self.end));
        }
        let takes_axes = |word: &Word| match word.letter {
            b'G' => match word.tenths().and_then(codes::g) {
                Some(code) => matches!(code, Code::Motion(_) | Code::Shift(0)),
                // It is refused by its own name.
                None => true,
            },
            // A line that goes on with the last move.
            letter => letter != b'M',
        };
        let axis = |word: &&Word| axes::index(word.letter).is_some();
        match self.words.iter().find(axis) {
            Some(axis) if !first.is_some_and(takes_axes) => Err(axis.fault(
                "an axis beside a command that moves none: firmwares do not move it",
                "write the move in a line of its own, with G0 or G1",
            )),
            _ => Ok(()),
        }
    }

    /// G28: its axes are letters alone, and others of its letters mean other things.
    fn home(&mut self, line: &[u8], word: Word) {
        let mut at = word.end;
        self.push(word);
        self.has_text = true;
        while let Some(&byte) = line.get(at) {
            let letter = byte.to_ascii_uppercase();
            match letter {
                b';' | b'(' => break,
                b'X'..=b'Z' if self.word(letter).is_none() => self.push(Word {
                    number: at + 1,
                    ..Word::meant(letter, 0.0, at, at + 1)
                }),
                _ => {}
            }
            at += 1;
        }
        self.end = line.len();
    }
}

/// What a word G does in the firmware; `None`: it is read as a word.
fn command_g(tenths: u16, rest: &[u8], span: Range<usize>) -> Result<Option<Command>, Fault> {
    Ok(match tenths {
        STORED => Some(Command::Restores),
        100 if has_axis(&rest[1..]) => return Err(shifts(span)),
        tenths if STAY.contains(&tenths) => Some(Command::Stays),
        tenths if MOVE.contains(&tenths) => Some(Command::Moves),
        _ => None,
    })
}

/// What a word M does in the firmware; `None`: it is read as a word.
fn command_m(tenths: u16, rest: &[u8], span: Range<usize>) -> Result<Option<Command>, Fault> {
    Ok(match tenths {
        820 | 830 => None,
        // Pops the modes in RepRapFirmware.
        1210 => Some(Command::Restores),
        5560 | 8520 => return Err(corrects(span)),
        2060 if has_axis(&rest[1..]) => return Err(shifts(span)),
        4280 => return Err(shifts(span)),
        _ => Some(Command::Stays),
    })
}

/// What a macro of Klipper does, and words with which RepRapFirmware computes.
fn command_by_name(name: &[u8], rest: &[u8], span: Range<usize>) -> Result<Command, Fault> {
    match name.to_ascii_uppercase().as_slice() {
        b"RESTORE_GCODE_STATE" => Ok(Command::Restores),
        b"SET_SKEW" | b"SKEW_PROFILE" if !clears(rest) => Err(corrects(span)),
        // Around lines that move.
        b"IF" | b"ELIF" | b"ELSE" | b"WHILE" => Err(Fault::new(
            span,
            "a condition or a loop: the program computes",
            "take it out, or move it with its lines into a macro of the firmware",
        )
        .kind(Kind::Flow)),
        b"SET_KINEMATIC_POSITION" => Err(shifts(span)),
        b"SET_GCODE_OFFSET" if offsets_xy(rest) => Err(shifts(span)),
        _ => Ok(Command::Stays),
    }
}

/// Behind the number of a line, N, and the blanks after it.
fn behind_number(line: &[u8], start: usize) -> usize {
    let is_number = matches!(line.get(start), Some(b'N' | b'n'));
    let Some(number) = is_number.then(|| number_at(line, start + 1)).flatten() else {
        return start;
    };
    let blanks = line[number.end..].iter();
    number.end + blanks.take_while(|b| b.is_ascii_whitespace()).count()
}

/// Where another word G or M begins, texts in quotes and comments aside.
fn second_command(line: &[u8], from: usize) -> Option<usize> {
    let mut quoted = false;
    let code = line.iter().enumerate().skip(from);
    let mut code = code.take_while(|(_, byte)| !b";(".contains(byte));
    let found = code.find(|(at, byte)| {
        quoted ^= **byte == b'"';
        !quoted
            && matches!(byte, b'G' | b'g' | b'M' | b'm')
            && !line[at - 1].is_ascii_alphabetic()
            && line.get(at + 1).is_some_and(u8::is_ascii_digit)
    });
    found.map(|(at, _)| at)
}

/// Firmwares differ in what they do with a second command.
fn several(span: std::ops::Range<usize>) -> Fault {
    Fault::new(
        span,
        "a second command in the line: RepRapFirmware does it, Marlin and Klipper leave it out",
        "write a line for each command",
    )
}

/// True for a command that switches Klipper's skew correction off, or stores it.
fn clears(line: &[u8]) -> bool {
    let line = line.to_ascii_uppercase();
    let has = |text: &[u8]| line.windows(text.len()).any(|part| part == text);
    has(b"CLEAR=1") || has(b"SAVE=") || has(b"REMOVE=")
}

/// True if letters of X, Y or Z follow, comments aside.
fn has_axis(rest: &[u8]) -> bool {
    let mut code = rest.iter().take_while(|b| !b";(".contains(b));
    code.any(|b| b"XYZ".contains(&b.to_ascii_uppercase()))
}

/// True for an offset of Klipper's in X or Y that may be another than zero; Z has one for the first layer.
fn offsets_xy(line: &[u8]) -> bool {
    let line = String::from_utf8_lossy(line).to_ascii_uppercase();
    let code = line.split([';', '#']).next().unwrap_or_default();
    code.split_whitespace().any(|part| {
        let Some((name, value)) = part.split_once('=') else {
            return false;
        };
        matches!(name, "X" | "Y" | "X_ADJUST" | "Y_ADJUST") && value.parse() != Ok(0.0_f64)
    })
}

/// Words would mean other places than those where the correction is looked up.
fn shifts(span: std::ops::Range<usize>) -> Fault {
    Fault::new(
        span,
        "the command moves the coordinates in the firmware, and that is not followed",
        "take the line out, and slice the part where it is to be printed, or shift it with G92",
    )
}

/// The firmware would correct what is corrected here.
fn corrects(span: std::ops::Range<usize>) -> Fault {
    Fault::new(
        span,
        "the program sets the skew correction of the firmware, and the axes would be corrected twice",
        "take the line out, and switch that correction off: SET_SKEW CLEAR=1, M852 I0 J0 K0, M556 S1 X0 Y0 Z0",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dialect::Dialect;

    fn read(line: &str) -> Block {
        let mut block = Block::default();
        block.scan(line.as_bytes(), Dialect::Printer).unwrap();
        block
    }

    fn letters(line: &str) -> String {
        let words = read(line).words;
        words.iter().map(|w| char::from(w.letter)).collect()
    }

    #[test]
    fn a_line_has_one_command() {
        let cause = |line: &str| {
            let done = Block::default().scan(line.as_bytes(), Dialect::Printer);
            done.err().map(|fault| fault.cause)
        };
        for line in [
            "G90 G1 X5",
            "G1 X5 M2",
            "A5M2C-20",
            "X5 G1",
            "M104 S200 G1 X5",
            "N4 M106 S0 m83 ; E",
            "M204 S500G0X1",
            "G21 G90",
        ] {
            assert!(cause(line).unwrap().contains("a second command"), "{line}");
        }
        for line in ["G90 X5", "M83 X5", "N3 G4 X1"] {
            assert!(cause(line).unwrap().contains("beside a command"), "{line}");
        }
        for line in [
            "N7 G1 X5 F60",
            "X5",
            "G53 G0 X5",
            "G92 X0 E0",
            "M117 G1 X5 M2",
            "M104 S200 ; G1",
            "M862.3 P \"M3 G1\"",
            "M32 G0.gcode",
            "M109 T0 S210",
        ] {
            assert_eq!(cause(line), None, "{line}");
        }
        // The number of a line changes nothing in what it is.
        assert_eq!(read("N5 M2").command, read("M2").command);
    }

    #[test]
    fn lines_that_move_are_words_and_others_are_commands() {
        assert_eq!(letters("G1 X1 Y2 E.5 F1800 ; wall"), "GXYEF");
        assert_eq!(letters("g1x1e-.5"), "GXE");
        assert_eq!(letters("M83"), "M");
        assert_eq!(letters("G28 W ; home all"), "G");
        assert_eq!(letters("G28 X Y0"), "GXY");
        for (line, command) in [
            ("M117 Layer 3 (of 40", Command::Stays),
            ("M862.3 P \"MK3S\"", Command::Stays),
            ("T?", Command::Stays),
            ("T1", Command::Stays),
            ("EXCLUDE_OBJECT_START NAME=cube_id_0", Command::Stays),
            ("START_PRINT BED_TEMP=60", Command::Stays),
            ("G10", Command::Stays),
            ("SET_SKEW CLEAR=1", Command::Stays),
            ("G10 P0 S205 R140 ; X", Command::Stays),
            ("M206", Command::Stays),
            ("SET_GCODE_OFFSET Z_ADJUST=.02 MOVE=1", Command::Stays),
            ("SET_GCODE_OFFSET X=0 Y=0.0", Command::Stays),
            ("G29 P1", Command::Moves),
            ("G80", Command::Moves),
            ("RESTORE_GCODE_STATE NAME=a MOVE=1", Command::Restores),
        ] {
            assert_eq!(read(line).command, Some(command), "{line}");
            assert!(read(line).words.is_empty());
        }
        assert_eq!(read("; comment").command, None);
        assert_eq!(read("").command, None);
        let mut block = Block::default();
        for line in [
            "SKEW_PROFILE LOAD=a",
            "M852 I.001",
            "GCDE\u{1}",
            "G10 L2 P1 X50",
            "g10p1x0y-9",
            "M206 X5",
            "M428",
            "SET_GCODE_OFFSET Y=1.5",
            "set_gcode_offset x_adjust=0.1 z=0",
            "SET_KINEMATIC_POSITION X=0",
            "while iterations < 3",
            "  if move.axes[0].homed",
        ] {
            assert!(block.scan(line.as_bytes(), Dialect::Printer).is_err());
        }
    }
}
