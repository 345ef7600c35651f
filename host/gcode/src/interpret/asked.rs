//! What the words of a line ask for, before anything is done.

use super::unknown;
use crate::codes::{Code, Group, Length};
use crate::fault::Fault;
use crate::modal::{Motion, Units};
use crate::state::Rules;
use crate::words::{Block, Word};

/// A line whose words G and letters are all known, at most one of each group.
pub(super) struct Asked<'l> {
    /// The line.
    pub block: &'l Block,
    /// What is the same for all lines.
    pub rules: &'l Rules,
    /// Group 1.
    pub motion: Option<(Code, &'l Word)>,
    /// Group 0.
    pub once: Option<(Code, &'l Word)>,
    /// G80 where cycles are a group of their own.
    pub cancels: Option<&'l Word>,
    /// G53.
    pub machine_coordinates: Option<&'l Word>,
    /// G20, G21.
    pub units: Option<(Units, &'l Word)>,
    /// Axes that have words, a bit each.
    pub axes: u16,
    /// Those that are left for the motion.
    pub free: u16,
    /// True if a word is passed although nobody knows it: letters may belong to it.
    pub passes: bool,
}

impl<'l> Asked<'l> {
    /// # Errors
    /// A word that is not known, or a second one of a group.
    pub fn read(block: &'l Block, rules: &'l Rules) -> Result<Self, Fault> {
        let mut asked = Self {
            block,
            rules,
            motion: None,
            once: None,
            cancels: None,
            machine_coordinates: None,
            units: None,
            axes: block.axes(),
            free: 0,
            passes: false,
        };
        if block.has_codes {
            asked.look_at_g()?;
            if !rules.dialect.table().cycles_apart && asked.motion.is_none() {
                // No other motion holds then.
                asked.motion = asked.cancels.take().map(|word| (Code::NoMotion, word));
            }
            asked.passes |= block.words.iter().any(|word| {
                word.letter == b'M'
                    && word.machine(rules.dialect).is_none()
                    && is_passed(word, rules)
            });
        }
        asked.free = asked.axes_of_motion()?;
        Ok(asked)
    }

    /// Axes (bits) that no word but that of motion takes.
    fn axes_of_motion(&self) -> Result<u16, Fault> {
        let (once, lengths) = self.takers();
        if let (true, Some(word)) = (once, lengths) {
            return Err(second_taker(word));
        }
        let takes_modal = once || self.machine_coordinates.is_some();
        if takes_modal && let Some(word) = self.block.words.iter().find(|w| w.distance.is_some()) {
            return Err(word.fault(
                "AC or IC beside a word that is no move in the workpiece",
                "write the number alone",
            ));
        }
        Ok(match once || lengths.is_some() {
            true => 0,
            false => self.axes,
        })
    }

    /// What is wrong with the motion of the line.
    pub fn fault(&self, cause: impl Into<String>, remedy: impl Into<String>) -> Fault {
        self.block.fault(cause, remedy)
    }

    /// The word of a letter other than G and M.
    pub fn word(&self, letter: u8) -> Option<&'l Word> {
        self.block.word(letter)
    }

    /// The words, if there are any of G or M among them.
    pub(crate) fn coded(&self) -> &'l [Word] {
        match self.block.has_codes {
            true => &self.block.words,
            false => &[],
        }
    }

    /// What a word G asks for.
    pub fn code(&self, word: &Word) -> Option<Code> {
        word.code(self.rules.dialect)
    }

    /// True with G0 or G1.
    pub(crate) fn cuts_or_positions(&self) -> bool {
        matches!(
            self.motion,
            Some((Code::Motion(Motion::Rapid | Motion::Feed), _))
        )
    }

    /// Refuses a motion beside another word that takes the axes, except G0 or G1 as the mode of G28 and G30.
    pub(super) fn refuse_motion(&self) -> Result<(), Fault> {
        let goes_home = matches!(self.once, Some((Code::Home(_), _)));
        let beside = self.rules.dialect.table().homes_beside_motion;
        let is_mode = beside && goes_home && self.cuts_or_positions();
        match self.motion {
            Some((Code::Motion(_) | Code::Probe | Code::Threading(_), word)) if !is_mode => {
                Err(second_taker(word))
            }
            _ => Ok(()),
        }
    }

    /// True if the line may be a full turn, which needs no words of axes.
    pub(super) fn may_turn_fully(&self) -> bool {
        b"IJKR".iter().any(|l| self.word(*l).is_some()) && self.once.is_none()
    }

    /// True if the line has words that only a cycle of a lathe takes.
    fn takes_a_cycle(&self) -> bool {
        let table = self.rules.dialect.table();
        let letters: &[u8] = if table.chooses_d { b"QP" } else { b"QPDUW" };
        letters.iter().any(|letter| self.word(*letter).is_some())
    }

    /// What takes the axes other than a word of motion: true for one that acts once, and the word of G43.1.
    fn takers(&self) -> (bool, Option<&'l Word>) {
        let once = match self.once {
            Some((Code::Data | Code::Home(_) | Code::Shift(_) | Code::Local, _)) => true,
            // Its time may be X.
            Some((Code::Dwell, _)) => self.rules.dialect.table().dwells_by_axis,
            _ => false,
        };
        let of_words = |word: &&Word| self.code(word) == Some(Code::ToolLength(Length::OfWords));
        (once, self.coded().iter().find(of_words))
    }

    fn look_at_g(&mut self) -> Result<(), Fault> {
        let mut groups = 0_u32;
        for word in self.block.words.iter().filter(|w| w.letter == b'G') {
            let Some(code) = self.code(word) else {
                self.pass_unknown(word)?;
                continue;
            };
            if let Code::LookAhead(letter, most) = code {
                self.looks_ahead(word, letter, most)?;
            }
            // Inches and mm of Mach and Sinumerik; with words of their own they are cycles of lathes.
            if let (Some(700 | 710), true) = (word.tenths(), self.takes_a_cycle()) {
                return Err(unknown_g(word, Unfollowed::of(word)));
            }
            // G53 stands beside others of its group in LinuxCNC's order: it is none of what takes axes.
            if code == Code::MachineCoordinates {
                self.machine_coordinates = Some(word);
                continue;
            }
            if code == Code::NoMotion && self.rules.dialect.table().g80_beside_motion {
                self.cancels = Some(word);
                continue;
            }
            let bit = 1 << code.group() as u32;
            if groups & bit != 0 {
                return Err(second_of_group(word, code.group()));
            }
            groups |= bit;
            match code {
                Code::Units(units) => self.units = Some((units, word)),
                code if code.group() == Group::Motion => self.motion = Some((code, word)),
                code if code.group() == Group::Once => self.once = Some((code, word)),
                _ => {}
            }
        }
        Ok(())
    }

    /// A word G that is not known may be passed in a line without axes.
    fn pass_unknown(&mut self, word: &Word) -> Result<(), Fault> {
        let other = Unfollowed::of(word);
        if !is_passed(word, self.rules) || other.is_some_and(|other| !other.passes) {
            return Err(unknown_g(word, other));
        }
        self.passes = true;
        if self.axes == 0 {
            return Ok(());
        }
        Err(word.fault(
            "axes in a line with a G word that is passed on: their meaning is unknown",
            "write two lines",
        ))
    }
}

impl Asked<'_> {
    /// Fanuc's words that only look ahead have a 0 or one value; others make a path of the controller's own.
    fn looks_ahead(&self, word: &Word, letter: u8, most: u16) -> Result<(), Fault> {
        let value = self.word(letter).map(|word| word.value);
        let only = value.is_some_and(|value| value == 0.0 || value == f64::from(most));
        if (only || is_passed(word, self.rules)) && self.axes == 0 {
            return Ok(());
        }
        let (name, letter) = (word.value, char::from(letter));
        Err(unknown(
            word,
            "a path that the controller smooths by itself, or a stored one: only looking ahead is followed",
            &format!(
                "write G{name} {letter}{most} in a line without axes, and G{name} {letter}0 to end it"
            ),
        ))
    }
}

fn second_of_group(word: &Word, group: Group) -> Fault {
    let cause = match group {
        Group::Motion => "a second motion word in the line",
        _ => "a second word of its group in the line",
    };
    word.fault(cause, "write two lines")
}

fn second_taker(word: &Word) -> Fault {
    word.fault(
        "two words in the line that take the axes",
        "write two lines",
    )
}

/// True if a word is passed although nobody knows it.
pub(super) fn is_passed(word: &Word, rules: &Rules) -> bool {
    let name = format!("{}{}", char::from(word.letter), word.value);
    rules
        .pass
        .iter()
        .any(|passed| passed.eq_ignore_ascii_case(&name))
}

/// A G word of some controllers that is not followed.
#[derive(Clone, Copy)]
struct Unfollowed {
    cause: &'static str,
    remedy: &'static str,
    /// True if it may be passed all the same: it does nothing itself, or nothing that is seen here.
    passes: bool,
}

impl Unfollowed {
    fn of(word: &Word) -> Option<Self> {
        const FLAT: &str =
            "write the program out with G0 to G3, or use the compensation in the controller";
        const MOVES: &str =
            "a G word that moves the machine or changes coordinates, and is not followed";
        let tenths = word.tenths()?;
        let cause = match tenths {
            50..=59 => "splines (G5) are not corrected",
            70 | 80 => "lathes (G7, G8) are not corrected",
            150 | 160 => "polar coordinates (G15, G16) are not followed",
            330..=339 | 3310 | 3320 => "threads (G33, G331, G332) are not corrected",
            435 => "tool directions as vectors (G43.5) are not followed",
            500 | 501 | 510 | 511 => "scaled and mirrored coordinates (G50, G51) are not followed",
            650 | 660..=669 => "macro calls (G65, G66) compute",
            680..=689 => "rotated coordinates (G68) are not followed",
            700 | 710 => {
                "finishing and roughing cycles of lathes (G70, G71) are not corrected; inches and mm are G20 and G21"
            }
            760 => "threading cycles of lathes, or fine boring (G76), are not corrected",
            870 | 880 => "cycles with a stopped spindle (G87, G88) are not corrected",
            // Cylinders, pockets, skipping, a negative offset.
            71 | 120..=139 | 310..=319 | 440 => MOVES,
            // Reference and fixed points of a Sinumerik, and its ways to and from a contour.
            740 | 750 | 1470 | 1480 | 2470 | 2480 | 3470 | 3480 => MOVES,
            580 | 590 => "offsets that the program adds (G58, G59 of a Sinumerik) are not followed",
            5000 | 5050..=5990 => "offsets beyond G57 (G500, G505 to G599) are not followed",
            // One direction, further offsets, a pocket, planes and tool directions.
            600 | 1100..=1299 | 1500 | 2340 | 2540 => MOVES,
            _ => return None,
        };
        Some(Self {
            cause,
            remedy: match cause {
                MOVES => "write the program out with G0 to G3 and G54 to G59",
                _ => FLAT,
            },
            // What ends a mode that never began, and macros of which the user says that they move nothing.
            passes: matches!(tenths, 80 | 150 | 500 | 501 | 650),
        })
    }
}

fn unknown_g(word: &Word, other: Option<Unfollowed>) -> Fault {
    match other {
        Some(other) => unknown(word, other.cause, other.remedy),
        None => unknown(
            word,
            "no G word that is known in this dialect",
            &format!(
                "check --dialect; if it moves nothing and changes no coordinates, pass it with --pass G{}",
                word.value
            ),
        ),
    }
}
