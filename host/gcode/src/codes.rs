//! The words G and M that are known, and what each does.

use super::modal::{Distance, FeedMode, Motion, Plane, Retract, Spindle, Units};
use super::offsets::Number;

/// What a word G asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// G0 to G3 and canned cycles.
    Motion(Motion),
    /// G33, G33.1: motion with the spindle; tenths.
    Threading(u16),
    /// G38.2 to G38.5.
    Probe,
    /// G80.
    NoMotion,
    /// G4.
    Dwell,
    /// G10.
    Data,
    /// G28 (0), G30 (1).
    Home(usize),
    /// G28.1 (0), G30.1 (1).
    StoreHome(usize),
    /// G53.
    MachineCoordinates,
    /// G92 and G92.1, .2, .3 by its last digit.
    Shift(u8),
    /// G52.
    Local,
    /// G17 to G19.
    Plane(Plane),
    /// G20, G21.
    Units(Units),
    /// G90, G91.
    Distance(Distance),
    /// G90.1, G91.1.
    ArcDistance(Distance),
    /// G93 to G95.
    Feed(FeedMode),
    /// G40 (off), G41, G42, G41.1, G42.1.
    Cutter(bool),
    /// G43, G43.1 (true: from the words), G49.
    ToolLength(Length),
    /// G54 to G59.3; G54.1 comes with P.
    System(Number),
    /// G98, G99.
    Retract(Retract),
    /// G43.4.
    TipOn,
    /// G5, G5.1, G5.4, G8 of Fanuc's: the letter with its value 0 or this one only looks ahead.
    LookAhead(u8, u16),
    /// G61, G61.1, G64, G96, G97, G69: nothing that positions depend on.
    Neutral(Group),
}

/// What becomes of the tool offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// G43: that of the tool H.
    OfTool,
    /// G43.1: the words.
    OfWords,
    /// G49.
    Off,
}

/// Groups, of which a line may have one word each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Group 0: what holds in its line only.
    Once,
    /// Group 1.
    Motion,
    /// Group 2.
    Plane,
    /// Group 3.
    Distance,
    /// Group 4.
    ArcDistance,
    /// Group 5.
    Feed,
    /// Group 6.
    Units,
    /// Group 7.
    Cutter,
    /// Group 8.
    Length,
    /// Group 10.
    Retract,
    /// Group 12.
    System,
    /// Group 13.
    Path,
    /// Group 14.
    Spindle,
    /// Looking ahead.
    LookAhead,
    /// Rotation of coordinates.
    Turn,
}

impl Code {
    /// Group.
    #[must_use]
    pub fn group(self) -> Group {
        match self {
            Self::Motion(_) | Self::Threading(_) | Self::Probe | Self::NoMotion => Group::Motion,
            Self::Dwell
            | Self::Data
            | Self::Home(_)
            | Self::StoreHome(_)
            | Self::MachineCoordinates
            | Self::Shift(_)
            | Self::Local => Group::Once,
            Self::Plane(_) => Group::Plane,
            Self::Units(_) => Group::Units,
            Self::Distance(_) => Group::Distance,
            Self::ArcDistance(_) => Group::ArcDistance,
            Self::Feed(_) => Group::Feed,
            Self::Cutter(_) => Group::Cutter,
            Self::ToolLength(_) | Self::TipOn => Group::Length,
            Self::System(_) => Group::System,
            Self::Retract(_) => Group::Retract,
            Self::LookAhead(..) => Group::LookAhead,
            Self::Neutral(group) => group,
        }
    }
}

/// Number of a work coordinate system by its word in tenths: G54 to G59.3.
#[must_use]
pub fn system(tenths: u16) -> Option<Number> {
    match tenths {
        540 | 550 | 560 | 570 | 580 | 590 => Some(tenths / 10 - 53),
        591..=593 => Some(tenths - 584),
        _ => None,
    }
}

/// What a word G (in tenths) asks for in every dialect; `None` if that depends on the dialect.
#[must_use]
pub fn g(tenths: u16) -> Option<Code> {
    let code = match tenths {
        0 => Code::Motion(Motion::Rapid),
        10 => Code::Motion(Motion::Feed),
        20 => Code::Motion(Motion::Clockwise),
        30 => Code::Motion(Motion::Counterclockwise),
        40 => Code::Dwell,
        100 => Code::Data,
        170 => Code::Plane(Plane::Xy),
        180 => Code::Plane(Plane::Zx),
        190 => Code::Plane(Plane::Yz),
        200 => Code::Units(Units::Inch),
        210 => Code::Units(Units::Millimetre),
        280 => Code::Home(0),
        300 => Code::Home(1),
        400 => Code::Cutter(false),
        490 => Code::ToolLength(Length::Off),
        530 => Code::MachineCoordinates,
        540 | 550 | 560 | 570 | 580 | 590 => Code::System(tenths / 10 - 53),
        610 | 640 => Code::Neutral(Group::Path),
        800 => Code::NoMotion,
        900 => Code::Distance(Distance::Absolute),
        910 => Code::Distance(Distance::Incremental),
        911 => Code::ArcDistance(Distance::Incremental),
        920 => Code::Shift(0),
        921 => Code::Shift(1),
        930 => Code::Feed(FeedMode::InverseTime),
        940 => Code::Feed(FeedMode::PerMinute),
        _ => return None,
    };
    Some(code)
}

/// What a word M asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// M0, M1, M60: waits, after the motion of its line.
    Pause,
    /// M2, M30: the end, after the motion of its line.
    End,
    /// M6.
    ToolChange,
    /// M428 (true), M429 (false): tool-centre-point control.
    Tip(bool),
    /// M61 Q: another tool without a change.
    ToolNumber,
    /// Spindle, coolant, overrides, outputs: nothing that positions depend on; before the motion of its
    /// line.
    Neutral,
    /// M82, M83: what E counts from.
    Extruder(Distance),
    /// M5 and M9 where they wait for the end of the motion.
    After,
}

/// What the spindle does from a word M (in tenths) on, if that is another thing: `Some(None)`, it is not known.
#[must_use]
pub fn spindle(tenths: u16) -> Option<Option<Spindle>> {
    Some(match tenths {
        30 => Some(Spindle::Clockwise),
        40 => Some(Spindle::Counterclockwise),
        50 => Some(Spindle::Stands),
        // A tool change stops it or not, and then it is turned to an angle.
        60 | 190 => None,
        _ => return None,
    })
}

/// What a word M (in tenths) asks for in every dialect; `None` if that depends on the dialect.
#[must_use]
pub fn m(tenths: u16) -> Option<Machine> {
    Some(match tenths {
        0 | 10 | 600 => Machine::Pause,
        20 | 300 => Machine::End,
        30 | 40 | 70 | 80 => Machine::Neutral,
        60 => Machine::ToolChange,
        _ => return None,
    })
}
