//! What differs between controllers: a table for each of them.

mod fanuc;
mod grbl;
mod grblhal;
mod haas;
mod linuxcnc;
mod printer;
mod siemens;

use super::axes::{self, NOTHING, PerLetter};
use super::codes::{self, Code, Group, Length, Machine};
use super::modal::{FeedMode, Motion, Retract};

/// Whose language a program is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Dialect {
    /// LinuxCNC.
    #[default]
    #[cfg_attr(feature = "clap", value(name = "linuxcnc", help = None))]
    LinuxCnc,
    /// Grbl.
    #[cfg_attr(feature = "clap", value(help = None))]
    Grbl,
    /// grblHAL: Grbl with canned cycles, tool lengths and feeds per revolution.
    #[cfg_attr(feature = "clap", value(name = "grblhal", help = None))]
    GrblHal,
    /// Fanuc and its kin.
    #[cfg_attr(feature = "clap", value(help = None))]
    Fanuc,
    /// Printers: Marlin, Prusa, Klipper, RepRapFirmware.
    #[cfg_attr(feature = "clap", value(help = None))]
    Printer,
    /// Haas.
    #[cfg_attr(feature = "clap", value(help = None))]
    Haas,
    /// Sinumerik in its own language.
    #[cfg_attr(feature = "clap", value(help = None))]
    Siemens,
}

/// In which unit an F counts that stands in a line with another unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedUnit {
    /// In the unit before the line.
    Before,
    /// In the unit of the line.
    After,
    /// Controllers differ.
    Unknown,
}

/// How words of a wrapped rotary axis turn it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrapping {
    /// There are no such axes.
    None,
    /// In the direction of the word's sign.
    Sign,
    /// The shorter way.
    Shorter,
}

/// What lines behind the end of a program are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AfterEnd {
    /// Not read.
    Nothing,
    /// Run like any other.
    Run,
    /// Another program, up to the last `%`.
    Another,
}

/// What a dialect means, beside what all of them mean.
#[derive(Debug)]
pub struct Table {
    /// Words G, in tenths.
    pub g: &'static [&'static [(u16, Code)]],
    /// Words G (in tenths) of how smoothly or exactly a path is followed.
    pub path: &'static [u16],
    /// Words M, in tenths.
    pub m: &'static [&'static [(u16, Machine)]],
    /// Words M (in tenths) that nothing depends on that is followed here.
    pub neutral: &'static [u16],
    /// Most bytes of a line.
    pub longest_line: usize,
    /// True if comments and spaces do not count towards them.
    pub counts_words_alone: bool,
    /// True if a length needs a point.
    pub needs_points: bool,
    /// Decimals of words in mm and degrees that the controller reads; inches have one more. `None`: any number.
    pub decimals: Option<usize>,
    /// The motion that holds before the first line, if that is the same on every machine.
    pub starts_in: Option<Motion>,
    /// F beside another unit.
    pub feed_unit: FeedUnit,
    /// True if lines may ask for settings: `$$`, `?`.
    pub asks: bool,
    /// True if M98 and M97 call subprograms that may stand in the file.
    pub calls: bool,
    /// True for the words of a Sinumerik that are no letter and number: `T="…"`, `CR=`, TRAORI.
    pub has_names: bool,
    /// True if `;` may end a block.
    pub semicolon_ends_block: bool,
    /// Lines behind the end.
    pub after_end: AfterEnd,
    /// True if F counts all axes that move, degrees as if they were mm; otherwise X, Y and Z if any of them moves,
    /// otherwise U, V and W, otherwise A, B and C.
    pub feed_counts_all: bool,
    /// How far the radii at both ends of an arc may differ (mm), in programs in mm and in inches.
    pub spiral: [f64; 2],
    /// True if P of an arc is how many turns it begins.
    pub arcs_have_turns: bool,
    /// Wrapped rotary axes.
    pub wrapping: Wrapping,
    /// True if an endless axis may be wrapped by a parameter.
    pub may_wrap: bool,
    /// True if coordinate systems have a rotation.
    pub systems_turn: bool,
    /// True if there are G54 P, G10 L20 P for further systems, and G10 is absolute or incremental with G90 and G91.
    pub further_systems: bool,
    /// True if G10 L1 sets a tool.
    pub sets_tools: bool,
    /// True if G52 is kept apart from G92.
    pub local_apart: bool,
    /// True if X or U may be the time of G4.
    pub dwells_by_axis: bool,
    /// True if G28 and G30 stand beside G0 and G1, and G30 has a P.
    pub homes_beside_motion: bool,
    /// True if G80 may stand beside a motion.
    pub g80_beside_motion: bool,
    /// True if cycles are a group of their own, after which the motion before them holds.
    pub cycles_apart: bool,
    /// True if R and the depth of a series are levels, under G91 too.
    pub keeps_levels: bool,
    /// True if K is how often a cycle is done.
    pub repeats_by_k: bool,
    /// True if G86 needs P.
    pub g86_waits: bool,
    /// True if G89 feeds out to the level where it ends, not to R.
    pub g89_feeds_to_level: bool,
    /// True if there are no cycles under G41 and G42.
    pub cycles_need_g40: bool,
    /// True if G41.1 and G42.1 have an L.
    pub cutter_has_l: bool,
    /// True if D stands alone, too.
    pub chooses_d: bool,
    /// True if G43 alone takes the tool in the spindle.
    pub g43_takes_spindle: bool,
    /// True if H0 is no offset.
    pub h0_is_none: bool,
    /// True if homing, G53 and M6 may cancel the tool offset, and another one may move the axis; G49 ends
    /// tool-centre-point control.
    pub doubts_tool_offset: bool,
    /// True if M6 moves axes where the setup does not say it.
    pub tool_change_moves: bool,
    /// True for printers: E belongs to moves, each line has its own motion word, and lines that move no axes are not read.
    pub printer: bool,
}

impl Table {
    /// What no dialect but some have, switched off.
    const PLAIN: Self = Self {
        g: &[],
        path: &[],
        m: &[],
        neutral: &[],
        longest_line: 255,
        counts_words_alone: false,
        needs_points: false,
        decimals: None,
        starts_in: None,
        feed_unit: FeedUnit::Unknown,
        asks: false,
        calls: false,
        has_names: false,
        semicolon_ends_block: false,
        after_end: AfterEnd::Nothing,
        feed_counts_all: true,
        spiral: [0.005; 2],
        arcs_have_turns: true,
        wrapping: Wrapping::None,
        may_wrap: false,
        systems_turn: false,
        further_systems: false,
        sets_tools: false,
        local_apart: false,
        dwells_by_axis: false,
        homes_beside_motion: false,
        g80_beside_motion: true,
        cycles_apart: false,
        keeps_levels: false,
        repeats_by_k: false,
        g86_waits: false,
        g89_feeds_to_level: false,
        cycles_need_g40: false,
        cutter_has_l: false,
        chooses_d: false,
        g43_takes_spindle: false,
        h0_is_none: false,
        doubts_tool_offset: false,
        tool_change_moves: false,
        printer: false,
    };
}

/// Positions that are stored, probing, and a tool offset by its words.
const STORED_AND_PROBED: &[(u16, Code)] = &[
    (281, Code::StoreHome(0)),
    (301, Code::StoreHome(1)),
    (382, Code::Probe),
    (383, Code::Probe),
    (384, Code::Probe),
    (385, Code::Probe),
    (431, Code::ToolLength(Length::OfWords)),
];
/// Systems behind G59.
const THREE_SYSTEMS: &[(u16, Code)] = &[
    (591, Code::System(7)),
    (592, Code::System(8)),
    (593, Code::System(9)),
];
/// Cycles, and tool offsets by their number.
const CYCLES: &[(u16, Code)] = &[
    (430, Code::ToolLength(Length::OfTool)),
    (730, Code::Motion(Motion::Cycle(730))),
    (810, Code::Motion(Motion::Cycle(810))),
    (820, Code::Motion(Motion::Cycle(820))),
    (830, Code::Motion(Motion::Cycle(830))),
    (850, Code::Motion(Motion::Cycle(850))),
    (860, Code::Motion(Motion::Cycle(860))),
    (890, Code::Motion(Motion::Cycle(890))),
    (980, Code::Retract(Retract::Initial)),
    (990, Code::Retract(Retract::Plane)),
];
/// Cycles that turn the spindle round.
const TAPPING: &[(u16, Code)] = &[
    (740, Code::Motion(Motion::Cycle(740))),
    (840, Code::Motion(Motion::Cycle(840))),
];
/// Feeds per revolution, and speeds of the spindle.
const SPINDLE: &[(u16, Code)] = &[
    (950, Code::Feed(FeedMode::PerRevolution)),
    (960, Code::Neutral(Group::Spindle)),
    (970, Code::Neutral(Group::Spindle)),
];
const CUTTER: &[(u16, Code)] = &[(410, Code::Cutter(true)), (420, Code::Cutter(true))];
/// G52, and what ends scaling, mirrors, polar coordinates, modal macros and rotations, none of which may have begun.
const LOCAL: &[(u16, Code)] = &[
    (520, Code::Local),
    (150, Code::Neutral(Group::Turn)),
    (500, Code::Neutral(Group::Turn)),
    (501, Code::Neutral(Group::Turn)),
    (670, Code::Neutral(Group::Turn)),
    (690, Code::Neutral(Group::Turn)),
];
/// M5 and M9 that wait for the end of the motion.
const WAITING: &[(u16, Machine)] = &[(50, Machine::After), (90, Machine::After)];
/// TRAORI and TRAFOOF.
const NAMED_TIP: &[(u16, Machine)] = &[(4289, Machine::Tip(true)), (4299, Machine::Tip(false))];
/// What a word (in tenths) means by the lists of a dialect.
fn own<T: Copy>(lists: &[&[(u16, T)]], tenths: u16) -> Option<T> {
    let mut words = lists.iter().copied().flatten();
    let found = words.find(|(own, _)| *own == tenths);
    found.map(|(_, meaning)| *meaning)
}

impl Dialect {
    /// What it means.
    #[must_use]
    pub fn table(self) -> &'static Table {
        match self {
            Self::LinuxCnc => &linuxcnc::TABLE,
            Self::Grbl => &grbl::TABLE,
            Self::GrblHal => &grblhal::TABLE,
            Self::Fanuc => &fanuc::TABLE,
            Self::Printer => &printer::TABLE,
            Self::Haas => &haas::TABLE,
            Self::Siemens => &siemens::TABLE,
        }
    }

    /// What a word G (in tenths) asks for; `None` if it is not known or not built.
    #[must_use]
    pub fn g(self, tenths: u16) -> Option<Code> {
        let table = self.table();
        let is_path = || table.path.contains(&tenths);
        let own =
            || own(table.g, tenths).or_else(|| is_path().then_some(Code::Neutral(Group::Path)));
        let everywhere = codes::g(tenths);
        // G58 and G59 of a Sinumerik move coordinates by the words of their line.
        let has_system = |code: &Code| !(table.has_names && matches!(code, Code::System(5 | 6)));
        everywhere.filter(has_system).or_else(own)
    }

    /// What a word M (in tenths) asks for; `None` if it is not known.
    #[must_use]
    pub fn m(self, tenths: u16) -> Option<Machine> {
        let table = self.table();
        let is_neutral = || table.neutral.contains(&tenths);
        codes::m(tenths)
            .or_else(|| own(table.m, tenths))
            .or_else(|| is_neutral().then_some(Machine::Neutral))
    }

    /// The length (mm, degrees) that a feed per minute counts, of a straight move by so much on each axis.
    #[must_use]
    pub fn length(self, by: &PerLetter) -> f64 {
        let moves = |d: &&f64| d.abs() >= NOTHING;
        let norm = |from: usize, to: usize| {
            let squares = by[from..to].iter().filter(moves).map(|d| d * d);
            squares.sum::<f64>().sqrt()
        };
        if self.table().feed_counts_all {
            return norm(0, axes::COUNT);
        }
        let mut lengths = [(0, 3), (6, 9), (3, 6)].into_iter();
        let length = lengths.find_map(|(from, to)| Some(norm(from, to)).filter(|l| *l > 0.0));
        length.unwrap_or(0.0)
    }

    /// Like `length`, of an arc or helix whose way in X, Y and Z is so long, while all axes together move by so much.
    #[must_use]
    pub(crate) fn arc_length(self, linear: f64, by: &PerLetter) -> f64 {
        match self.table().feed_counts_all {
            true => by[3..].iter().fold(linear, |sum, d| libm::hypot(sum, *d)),
            false => linear,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_table_has_a_word_twice_or_one_that_all_dialects_have() {
        for dialect in [
            Dialect::LinuxCnc,
            Dialect::Grbl,
            Dialect::GrblHal,
            Dialect::Fanuc,
            Dialect::Printer,
            Dialect::Haas,
            Dialect::Siemens,
        ] {
            let table = dialect.table();
            let path = table.path.iter();
            let path = path.map(|tenths| (*tenths, Code::Neutral(Group::Path)));
            let g: Vec<(u16, Code)> = table.g.concat().into_iter().chain(path).collect();
            for (k, (tenths, code)) in g.iter().enumerate() {
                assert!(g[..k].iter().all(|(other, _)| other != tenths));
                assert_eq!(dialect.g(*tenths), Some(*code));
            }
            let neutral = table.neutral.iter();
            let neutral = neutral.map(|tenths| (*tenths, Machine::Neutral));
            let m: Vec<(u16, Machine)> = table.m.concat().into_iter().chain(neutral).collect();
            for (k, (tenths, machine)) in m.iter().enumerate() {
                assert!(m[..k].iter().all(|(other, _)| other != tenths));
                assert_eq!(dialect.m(*tenths), Some(*machine));
            }
        }
    }
}
