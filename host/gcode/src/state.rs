//! Where a program is: everything that a line depends on.

use super::axes::{COUNT, PerLetter, Position};
use super::cycle::Sticky;
use super::dialect::Dialect;
use super::extruder::Extruder;
use super::modal::{Cutter, Distance, FeedMode, Motion, Plane, Retract, Spindle, Units};
use super::offsets::{Offsets, System};
use super::setup::{Decimals, Setup};
use super::words::Word;
use std::collections::BTreeMap;

/// What is the same for all lines.
#[derive(Clone, Debug, Default)]
pub struct Rules {
    /// Whose language it is.
    pub dialect: Dialect,
    /// What the program does not say.
    pub setup: Setup,
    /// The axes that may be commanded, one bit each: those of the compensation.
    pub axes: u16,
    /// Those that turn for ever, one bit each.
    pub endless: u16,
    /// Words that are passed although nobody knows them: `G187`, `M100`.
    pub pass: Vec<String>,
    /// Whether lines behind `/` are left out; `None`: not known.
    pub block_delete: Option<bool>,
    /// True if words are workpiece coordinates from the first line on.
    pub tip: bool,
    /// The machine that [`Self::axes`] are of, for messages.
    pub machine: String,
    /// True if there is a machine to turn workpiece coordinates into positions.
    pub has_machine: bool,
    /// Why the machine that is given does not.
    pub no_tip: Option<String>,
}

/// A motion to a place that is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lost {
    /// G28 (0), G30 (1).
    Home(usize),
    /// To where the probe touches.
    Probed,
    /// G28, G30 or probing under a rotation, where a word of X or Y moves both.
    Turned,
    /// As the maker of the machine has it.
    ToolChange,
    /// G30 with another P than 2, on Fanuc's controllers.
    Reference,
    /// A command of a printer that homes, probes or parks.
    Command,
    /// By another tool offset, or not: G43 and G49 without Z, on Fanuc's controllers.
    ToolOffset,
}

/// What holds at a line.
#[derive(Clone, Debug)]
pub struct State {
    /// G20, G21.
    pub units: Option<Units>,
    /// G90, G91.
    pub distance: Option<Distance>,
    /// G90.1, G91.1.
    pub arc_distance: Distance,
    /// G17 to G19.
    pub plane: Option<Plane>,
    /// G93 to G95.
    pub feed_mode: FeedMode,
    /// The motion that axes alone go on with.
    pub motion: Option<Motion>,
    /// What the last motion word other than a cycle was: it holds behind Fanuc's G80, whose cycles are a group of their
    /// own.
    pub before_cycles: Option<Motion>,
    /// Everything between words and positions.
    pub offsets: Offsets,
    /// F in units of the program.
    pub feed: Option<f64>,
    /// False if the last F had no decimal point, which counts another unit on some controllers.
    pub feed_has_point: bool,
    /// What one unit of an F in the last line is, in units of the program: 1, but beside another unit.
    pub feed_unit: f64,
    /// Where the axes are commanded to (mm, degrees); with [`Self::tip`] the tip.
    pub position: Position,
    /// Axes (bits) that absolute words of the program have brought where they are, since it began, or since something else
    /// moved them: the others stand where someone left them, and a word for them would drag them along.
    pub commanded: u16,
    /// The words of axes that the machine does not have: they may be there, as long as they are always the same.
    pub others: [Option<f64>; COUNT],
    /// True where Fanuc's controllers may have cancelled the tool offset, or not: behind G28, G30, G53 and M6.
    pub offset_in_doubt: bool,
    /// True where homing and the like may do so.
    pub doubts_tool_offset: bool,
    /// What has moved an axis to a place that is not known.
    pub lost: [Option<Lost>; COUNT],
    /// Offsets of tools that the program has set.
    pub tools: BTreeMap<u32, PerLetter>,
    /// The tool in the spindle.
    pub tool: Option<u32>,
    /// The tool that M6 takes.
    pub next_tool: Option<u32>,
    /// Length (mm) that G43 has taken, whose tool is in the spindle.
    pub length: Option<f64>,
    /// M3, M4, M5; `None`: not known.
    pub spindle: Option<Spindle>,
    /// G98, G99; `None`: not known.
    pub retract: Option<Retract>,
    /// G41, G42.
    pub cutter: bool,
    /// True from G40, G41 or G42 to the end of the next motion, along which the path gets its offset or loses it.
    pub cutter_changes: bool,
    /// How the last motion went.
    pub under: Cutter,
    /// True while words are workpiece coordinates.
    pub tip: bool,
    /// E of a printer.
    pub extruder: Extruder,
    /// Words that stay within a series of cycles.
    pub cycle: Option<Sticky>,
    /// Where G28 and G30 go.
    pub homes: [Option<Position>; 2],
    /// True behind the first line with words.
    pub begun: bool,
    /// True behind M2 or M30, or behind `%` at the end.
    pub ended: bool,
}

impl Rules {
    /// What one digit of a word of a length or an angle counts: 1, or a least increment where the word has no point.
    #[must_use]
    pub(crate) fn counts(&self, word: &Word, rotary: bool, units: Units) -> f64 {
        let least = self.setup.decimals == Some(Decimals::Least) && !word.point;
        match (least, rotary, units) {
            (false, ..) => 1.0,
            (true, false, Units::Inch) => 1e-4,
            (true, ..) => 1e-3,
        }
    }
}

impl State {
    /// Before the first line.
    #[must_use]
    pub fn new(rules: &Rules) -> Self {
        let setup = &rules.setup;
        // All begin with G54, unless LinuxCNC's parameters say otherwise.
        let mut offsets = Offsets::new(setup.systems.clone(), setup.selected.unwrap_or(1));
        let printer = rules.dialect.table().printer;
        if printer && setup.systems.is_empty() {
            // Words are positions of the machine.
            offsets.set(1, System::default());
        }
        offsets.g92 = setup.g92;
        offsets.g92_stored = setup.g92_stored;
        let starts_in = setup.motion.or(rules.dialect.table().starts_in);
        let mut position = Position::default();
        for axis in (0..COUNT).filter(|axis| setup.start.knows(*axis)) {
            position.set(axis, setup.start.at[axis]);
        }
        Self {
            units: setup.units.or(printer.then_some(Units::Millimetre)),
            distance: Some(setup.distance.unwrap_or(Distance::Absolute)),
            arc_distance: setup.arc_distance.unwrap_or(Distance::Incremental),
            plane: Some(setup.plane.unwrap_or(Plane::Xy)),
            feed_mode: setup.feed_mode.unwrap_or(FeedMode::PerMinute),
            motion: starts_in,
            before_cycles: starts_in,
            offsets,
            feed: None,
            feed_has_point: true,
            feed_unit: 1.0,
            position,
            commanded: 0,
            others: [None; COUNT],
            offset_in_doubt: false,
            doubts_tool_offset: rules.dialect.table().doubts_tool_offset,
            lost: [None; COUNT],
            tools: BTreeMap::new(),
            tool: setup.tool,
            next_tool: None,
            length: None,
            spindle: None,
            retract: setup.retract,
            cutter: false,
            cutter_changes: false,
            under: Cutter::Off,
            tip: rules.tip,
            extruder: Extruder::default(),
            cycle: None,
            homes: setup.homes,
            begun: false,
            ended: false,
        }
    }

    /// An axis has gone to a place that is not known.
    pub fn lose(&mut self, axis: usize, by: Lost) {
        self.position.forget(axis);
        self.commanded &= !(1 << axis);
        self.lost[axis] = Some(by);
    }

    /// Length of the tool (mm) for poses, and for a compensation that takes it in: while G43 holds, that of its tool, for
    /// controllers turn the part about the tip by it; `None`: that of the machine.
    #[must_use]
    pub(crate) fn field_length(&self, rules: &Rules, takes_length: bool) -> Option<f64> {
        match takes_length {
            true => self.tool_length(&rules.setup),
            false => self.length.filter(|_| self.offsets.tool[2] != 0.0),
        }
    }

    /// Length of the tool in the spindle (mm), if it is known.
    #[must_use]
    pub fn tool_length(&self, setup: &Setup) -> Option<f64> {
        let of_spindle = || {
            let tool = self.tool?;
            let offset = self.tools.get(&tool).or_else(|| setup.tools.get(&tool))?;
            length_of_tool(setup, tool, offset)
        };
        self.length.or_else(of_spindle)
    }
}

/// Length (mm) of a tool, by its number and its offset: an offset that is not positive, as of tools that were touched
/// off, is not a length.
#[must_use]
pub(crate) fn length_of_tool(setup: &Setup, tool: u32, offset: &PerLetter) -> Option<f64> {
    let length = setup.lengths.get(&tool).copied();
    length.or_else(|| Some(offset[2]).filter(|l| *l > 0.0))
}
