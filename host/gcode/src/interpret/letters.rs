//! Letters beside G and M: known ones, each of which a word of its line uses, with a point where that matters.

use super::{Asked, unknown};
use crate::axes;
use crate::codes::{Code, Group, Length, Machine};
use crate::dialect::Dialect;
use crate::fault::Fault;
use crate::modal::Motion;
use crate::state::State;
use crate::words::Word;

/// Letters that mean nothing by themselves.
const USED: &[u8] = b"DEHIJKLPQR";

impl State {
    /// Looks at all letters of a line.
    ///
    /// # Errors
    /// One that is not known, that nothing in the line uses, or that lacks a point.
    pub(super) fn letters(&self, asked: &Asked<'_>) -> Result<(), Fault> {
        for word in &asked.block.words {
            if axes::index(word.letter).is_some() {
                needs_point(asked, word, !is_time(asked, word))?;
                continue;
            }
            if USED.contains(&word.letter) {
                if !asked.passes {
                    self.letter_in_use(asked, word)?;
                }
                continue;
            }
            if !b"GMNFSTO".contains(&word.letter) {
                return Err(unknown(
                    word,
                    "no word that is known",
                    "write axes, G, M, F, S, T, D, H, I, J, K, L, P, Q, R or N",
                ));
            }
        }
        Ok(())
    }

    /// Exactly one word of the line must use a letter.
    fn letter_in_use(&self, asked: &Asked<'_>, word: &Word) -> Result<(), Fault> {
        let (cause, remedy) = match self.users(asked, word.letter) {
            1 => {
                let is_count = word.letter == b'K' && self.cycle_of(asked).is_some();
                let is_ahead = |word: &Word| matches!(asked.code(word), Some(Code::LookAhead(..)));
                let is_choice = is_count || asked.coded().iter().any(is_ahead);
                let is_length = b"IJKRQ".contains(&word.letter) && !is_choice;
                return needs_point(asked, word, is_length);
            }
            0 if word.letter == b'E' && asked.block.words.iter().any(|w| w.end == word.start) => (
                "an exponent: numbers of programs have none, and E begins another word",
                "write the number out with all its digits; for the program of a printer give --dialect printer",
            ),
            0 if word.letter == b'E' => (
                "E, which this dialect does not have",
                "for the program of a printer give --dialect printer",
            ),
            0 => (
                "a word that nothing in its line uses: its meaning is unknown",
                "check the G word of the line and --dialect, or take it out",
            ),
            _ => ("a word that two others of its line use", "write two lines"),
        };
        Err(word.fault(cause, remedy))
    }

    /// The cycle that the line does or goes on with.
    fn cycle_of(&self, asked: &Asked<'_>) -> Option<u16> {
        match self.motion_of(asked) {
            Some(Motion::Cycle(tenths)) if asked.free != 0 => Some(tenths),
            _ => None,
        }
    }

    /// How many words of the line use a letter; the motion that it goes on with is one of them.
    fn users(&self, asked: &Asked<'_>, letter: u8) -> usize {
        let dialect = asked.rules.dialect;
        let table = dialect.table();
        let turns = asked.free != 0 || asked.may_turn_fully();
        let by_motion = match self.motion_of(asked) {
            Some(Motion::Clockwise | Motion::Counterclockwise) if turns => match letter {
                b'I' | b'J' | b'K' | b'R' => true,
                // A full circle of a printer, as slicers lift by.
                b'P' if table.printer => {
                    let is_one = asked.word(b'P').is_some_and(|p| p.value == 1.0);
                    is_one && asked.free & 0b11 == 0
                }
                // Turns, which Fanuc's arcs have not.
                b'P' => table.arcs_have_turns,
                _ => false,
            },
            Some(Motion::Cycle(_)) if asked.free != 0 => match letter {
                b'L' | b'P' | b'Q' | b'R' => true,
                // How often.
                b'K' => table.repeats_by_k,
                _ => false,
            },
            _ => false,
        };
        // An offset that is chosen before it is used.
        let by_itself = table.chooses_d && letter == b'D' || table.printer && letter == b'E';
        if by_itself {
            return 1;
        }
        let of_code = |word: &&Word| {
            let code = asked.code(word);
            code.is_some_and(|code| code_uses(code, letter, dialect))
        };
        let words = asked.coded();
        let by_machine = words.iter().any(|word| machine_uses(word, letter, dialect));
        let others = usize::from(by_motion) + words.iter().filter(of_code).count();
        // Many words M may have a P, and few do.
        others.max(usize::from(by_machine))
    }
}

/// True if a word G uses a letter, other than one of an arc or a cycle.
fn code_uses(code: Code, letter: u8, dialect: Dialect) -> bool {
    let table = dialect.table();
    match code {
        Code::Dwell => letter == b'P',
        // R: a rotation, which others do not have.
        Code::Data => b"LP".contains(&letter) || table.systems_turn && letter == b'R',
        Code::Home(home) => table.homes_beside_motion && home == 1 && letter == b'P',
        Code::Threading(_) => letter == b'K',
        Code::Cutter(_) => letter == b'D' || table.cutter_has_l && letter == b'L',
        Code::ToolLength(Length::OfTool | Length::Off) | Code::TipOn => letter == b'H',
        Code::System(100) => letter == b'P',
        // G54 P is G54.1 P.
        Code::System(1) => table.further_systems && letter == b'P',
        // E: by how much a Haas may round corners.
        Code::Neutral(Group::Path) => {
            b"PQ".contains(&letter) || dialect == Dialect::Haas && letter == b'E'
        }
        Code::Neutral(Group::Spindle) => letter == b'D',
        // R: how smooth.
        Code::LookAhead(own, _) => letter == own || letter == b'R',
        _ => false,
    }
}

/// True if a word M uses a letter.
fn machine_uses(word: &Word, letter: u8, dialect: Dialect) -> bool {
    match word.machine(dialect) {
        Some(Machine::ToolNumber) => letter == b'Q',
        // Outputs, overrides, the angle at which the spindle stops.
        Some(Machine::Neutral) => b"ELPQR".contains(&letter),
        _ => false,
    }
}

/// True for a word of an axis that is the time of Fanuc's G4.
fn is_time(asked: &Asked<'_>, word: &Word) -> bool {
    matches!(asked.once, Some((Code::Dwell, _))) && matches!(word.letter, b'X' | b'U')
}

/// A length of Fanuc's must have a point, unless the setup says what one without counts.
fn needs_point(asked: &Asked<'_>, word: &Word, is_length: bool) -> Result<(), Fault> {
    let rules = asked.rules;
    let lacks = rules.dialect.table().needs_points
        && rules.setup.decimals.is_none()
        && !word.point
        && word.value != 0.0;
    match is_length && lacks {
        false => Ok(()),
        true => Err(word.fault("a length without a decimal point: Fanuc controllers take it for mm or for least \
             increments, as a parameter says",
            "write a decimal point, or give the setup decimals = \"calculator\" if X100 is 100 mm there, \"least\" if it is 0.1 mm",
        )),
    }
}
