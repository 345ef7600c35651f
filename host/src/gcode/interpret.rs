//! From a line to what it does: LinuxCNC's order of execution, which is that of RS274/NGC.

mod motion;
mod tool;

use super::axes::{self, COUNT};
use super::codes::{self, Code, Group, Machine};
use super::dialect::Dialect;
use super::fault::{Fault, Kind};
use super::modal::{FeedMode, Motion};
use super::moves::Move;
use super::offsets::{Number, System};
use super::state::{Rules, State};
use super::words::{Block, Word};

/// What a line does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// The motion that is corrected.
    pub motion: Option<Move>,
    /// Words of axes that say where the machine is: G92 (`None`), G10 L20 (the system).
    pub reference: Option<Option<Number>>,
    /// Motion that passes as it is: G28, G30, probing, a tool change that moves.
    pub passed: Option<&'static str>,
    /// Tool-centre-point control goes on or off, before the motion.
    pub tip: Option<bool>,
    /// Words that belong behind the motion: M0, M1, M60, M2, M30 …
    pub after: bool,
    /// It is the last line.
    pub ends: bool,
}

/// What stands in a line, before it is done.
#[derive(Default)]
struct Asked {
    motion: Option<(Code, usize)>,
    once: Option<(Code, usize)>,
    machine_coordinates: Option<usize>,
    units: Option<(Code, usize)>,
}

/// A word that cannot be done, or not yet.
fn unknown(word: &Word, text: &str, remedy: &str) -> Fault {
    Fault::new(word.span(), text, remedy).kind(Kind::Word)
}

impl State {
    /// Does a line.
    ///
    /// # Errors
    /// What cannot be done; the state is then of no use any more.
    pub fn step(&mut self, block: &Block, rules: &Rules) -> Result<Step, Fault> {
        let mut step = Step::default();
        if self.ended || block.words.is_empty() || block.percent {
            return Ok(step);
        }
        if block.deleted {
            match rules.block_delete {
                Some(true) => return Ok(step),
                Some(false) => {}
                None if is_neutral(block, rules) => {}
                None => {
                    return Err(Fault::new(
                        0..block.end,
                        "a line behind `/`: it is done or left out, as a switch of the controller says",
                        "say how the switch stands: --block-delete on or off",
                    ));
                }
            }
        }
        let mut asked = Asked::default();
        let mut groups = 0_u32;
        self.look_at_g(block, rules, &mut asked, &mut groups)?;
        self.look_at_letters(block, rules)?;
        self.feed_and_tool(block, rules, &mut step)?;
        self.set_modes(block, rules, &asked, &mut step)?;
        let axis_words = axis_words(block);
        if let Some((code, place)) = asked.once {
            self.do_once(block, rules, code, place, axis_words, &mut step)?;
        }
        let axes_taken = matches!(
            asked.once,
            Some((Code::Data | Code::Home(_) | Code::Shift(_), _))
        ) || asked_for_offset(block, rules);
        if axes_taken
            && let Some((Code::Motion(_) | Code::Probe | Code::Threading(_), place)) = asked.motion
            && axis_words != 0
        {
            return Err(Fault::new(
                block.words[place].span(),
                "two words in the line that take the axes",
                "write two lines",
            ));
        }
        let free = if axes_taken { 0 } else { axis_words };
        self.do_motion(block, rules, &asked, free, &mut step)?;
        step.ends = self.ends(block, rules);
        self.ended |= step.ends;
        Ok(step)
    }

    fn ends(&self, block: &Block, rules: &Rules) -> bool {
        let machine = |w: &Word| {
            w.letter == b'M'
                && w.tenths().and_then(|t| codes::m(t, rules.dialect)) == Some(Machine::End)
        };
        block.words.iter().any(machine)
    }

    /// Every word G: known, one of each group; modes that need no order are set.
    fn look_at_g(
        &mut self,
        block: &Block,
        rules: &Rules,
        asked: &mut Asked,
        groups: &mut u32,
    ) -> Result<(), Fault> {
        for (place, word) in block.words.iter().enumerate() {
            if word.letter != b'G' {
                continue;
            }
            let code = word.tenths().and_then(|t| codes::g(t, rules.dialect));
            let Some(code) = code else {
                if is_passed(word, rules) {
                    continue;
                }
                return Err(unknown(word, &unknown_g(word), &remedy_g(word)));
            };
            // G53 stands beside others of its group in LinuxCNC's order: it is none of what takes axes.
            if code == Code::MachineCoordinates {
                asked.machine_coordinates = Some(place);
                continue;
            }
            let bit = 1 << code.group() as u32;
            if *groups & bit != 0 {
                return Err(Fault::new(
                    word.span(),
                    match code.group() {
                        Group::Motion => "a second motion word in the line",
                        _ => "a second word of its group in the line",
                    },
                    "write two lines",
                ));
            }
            *groups |= bit;
            match code.group() {
                Group::Motion => asked.motion = Some((code, place)),
                Group::Once => asked.once = Some((code, place)),
                Group::Units => asked.units = Some((code, place)),
                _ => {}
            }
        }
        Ok(())
    }

    /// Letters that mean something here.
    fn look_at_letters(&self, block: &Block, rules: &Rules) -> Result<(), Fault> {
        for word in &block.words {
            match word.letter {
                b'G' | b'M' | b'N' | b'F' | b'S' | b'T' | b'H' | b'D' | b'P' | b'Q' | b'R'
                | b'L' | b'I' | b'J' | b'K' | b'E' => {}
                b'O' => {}
                letter => {
                    if axes::index(letter).is_none() {
                        return Err(unknown(
                            word,
                            "no word that is known",
                            "write axes, G, M, F, S, T, D, H, I, J, K, L, P, Q, R or N",
                        ));
                    }
                }
            }
            let needs_point = rules.dialect == Dialect::Fanuc
                && !rules.least_increments
                && !word.point
                && word.value != 0.0
                && (axes::index(word.letter).is_some() || b"IJKR".contains(&word.letter));
            if needs_point {
                return Err(Fault::new(
                    word.span(),
                    "a length without a decimal point: Fanuc controllers take it for mm or for least \
                     increments, as a parameter says",
                    "write a decimal point, or say --least-increment if such words count 1 µm",
                ));
            }
        }
        Ok(())
    }

    /// What stands before modes in the order of execution: F's mode, F, T, M.
    fn feed_and_tool(
        &mut self,
        block: &Block,
        rules: &Rules,
        step: &mut Step,
    ) -> Result<(), Fault> {
        for word in &block.words {
            if word.letter == b'G'
                && let Some(Code::Feed(mode)) =
                    word.tenths().and_then(|t| codes::g(t, rules.dialect))
                && mode != self.feed_mode
            {
                self.feed_mode = mode;
                self.feed = None;
            }
        }
        if self.feed_mode == FeedMode::InverseTime {
            // Every move needs its own.
            self.feed = None;
        }
        if let Some(word) = block.word(b'F') {
            if word.value < 0.0 {
                return Err(Fault::new(
                    word.span(),
                    "a negative feed",
                    "write F with a positive number",
                ));
            }
            self.feed = Some(word.value);
        }
        if let Some(word) = block.word(b'T') {
            self.next_tool = Some(whole(word)?);
        }
        let mut machine_words = 0;
        for word in block.words.iter().filter(|w| w.letter == b'M') {
            machine_words += 1;
            let Some(machine) = word.tenths().and_then(|t| codes::m(t, rules.dialect)) else {
                if is_passed(word, rules) {
                    continue;
                }
                return Err(unknown(
                    word,
                    "no M word that is known: it may move the machine",
                    &format!(
                        "pass it as it is with --pass M{}, if it moves nothing",
                        word.value
                    ),
                ));
            };
            if machine_words > 4 {
                return Err(Fault::new(
                    word.span(),
                    "more than four M words in a line",
                    "write two lines",
                ));
            }
            match machine {
                Machine::Pause | Machine::End | Machine::After => step.after = true,
                Machine::Neutral => {}
                Machine::ToolChange => self.change_tool(rules, step),
                Machine::ToolNumber => {
                    let number = block.word(b'Q').map(whole).transpose()?;
                    self.tool = number.or(self.tool);
                    self.length = None;
                }
                Machine::Tip(on) => {
                    if on && !rules.has_machine {
                        return Err(unknown(
                            word,
                            "tool-centre-point control: words are workpiece coordinates from here on",
                            "give the machine that turns them into axis positions: --machine machine.toml",
                        ));
                    }
                    step.tip = (on != self.tip).then_some(on);
                }
            }
        }
        Ok(())
    }

    /// Plane, units, cutter and tool offsets, systems, distances, retracting.
    fn set_modes(
        &mut self,
        block: &Block,
        rules: &Rules,
        asked: &Asked,
        step: &mut Step,
    ) -> Result<(), Fault> {
        if let Some((Code::Units(units), place)) = asked.units
            && self.units != Some(units)
        {
            if self.units.is_some() && block.word(b'F').is_some() {
                return Err(Fault::new(
                    block.words[place].span(),
                    "another unit and F in one line: controllers differ in the unit of that F",
                    "write the unit in a line before",
                ));
            }
            if self.units.is_some() && self.feed_mode != FeedMode::InverseTime {
                self.feed = None;
            }
            self.units = Some(units);
        }
        for word in block.words.iter().filter(|w| w.letter == b'G') {
            let Some(code) = word.tenths().and_then(|t| codes::g(t, rules.dialect)) else {
                continue;
            };
            match code {
                Code::Plane(plane) => self.plane = Some(plane),
                Code::Cutter(on) => self.cutter = on,
                Code::ToolLength(length) => self.tool_length_word(block, rules, word, length)?,
                Code::TipOn => {
                    if !rules.has_machine {
                        return Err(unknown(
                            word,
                            "tool-centre-point control: words are workpiece coordinates from here on",
                            "give the machine that turns them into axis positions: --machine machine.toml",
                        ));
                    }
                    self.tool_length_word(block, rules, word, codes::Length::OfTool)?;
                    step.tip = (!self.tip).then_some(true);
                }
                Code::System(100) => {
                    let p = block.word(b'P').map(whole).transpose()?;
                    let p = p.filter(|p| (1..=300).contains(p)).ok_or_else(|| {
                        Fault::new(
                            word.span(),
                            "G54.1 without P1 to P300",
                            "write the P of the system",
                        )
                    })?;
                    self.offsets.select(100 + p as u16);
                }
                Code::System(number) => self.offsets.select(number),
                Code::Distance(distance) => self.distance = Some(distance),
                Code::ArcDistance(distance) => self.arc_distance = distance,
                Code::Retract(retract) => self.retract = retract,
                _ => {}
            }
            if rules.dialect == Dialect::Fanuc
                && code == Code::ToolLength(codes::Length::Off)
                && self.tip
            {
                step.tip = Some(false);
            }
        }
        Ok(())
    }

    /// Words that hold in their line only.
    fn do_once(
        &mut self,
        block: &Block,
        rules: &Rules,
        code: Code,
        place: usize,
        axis_words: u16,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let word = &block.words[place];
        match code {
            Code::Data => self.set_data(block, rules, word, axis_words, step),
            Code::Home(home) => {
                self.not_with_tip(word)?;
                let moved = if axis_words == 0 {
                    rules.axes
                } else {
                    axis_words & rules.axes
                };
                let to = self.homes[home];
                for axis in bits(moved) {
                    match to.filter(|to| to.knows(axis)) {
                        Some(to) => self.position.set(axis, to.at[axis]),
                        None => self.position.forget(axis),
                    }
                }
                step.passed = Some("G28 and G30");
                Ok(())
            }
            Code::StoreHome(home) => {
                self.not_with_tip(word)?;
                self.homes[home] = Some(self.position);
                Ok(())
            }
            Code::Shift(0) => {
                if axis_words == 0 {
                    return Err(Fault::new(
                        word.span(),
                        "G92 without axes",
                        "write the axes",
                    ));
                }
                let at = self.offsets.program(&self.position.at);
                self.needs_system(word)?;
                let turned = self.offsets.is_turned() && axis_words & 0b11 != 0;
                let needed = axis_words | if turned { 0b11 } else { 0 };
                if let Some(axis) = self.position.missing(needed) {
                    return Err(not_known(word, axis));
                }
                for axis in bits(axis_words) {
                    let value = self.value(block, rules, axis)?;
                    self.offsets.g92[axis] += at[axis] - value;
                }
                // Machine = word + g92: the word is smaller by what the shift is larger.
                step.reference = Some(None);
                Ok(())
            }
            Code::Shift(1) => {
                self.offsets.g92 = [0.0; COUNT];
                self.offsets.g92_aside = [0.0; COUNT];
                Ok(())
            }
            Code::Shift(2) => {
                self.offsets.g92_aside = self.offsets.g92;
                self.offsets.g92 = [0.0; COUNT];
                Ok(())
            }
            Code::Shift(3) => {
                self.offsets.g92 = self.offsets.g92_aside;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// G10: offsets and tools that a program sets itself.
    fn set_data(
        &mut self,
        block: &Block,
        rules: &Rules,
        word: &Word,
        axis_words: u16,
        step: &mut Step,
    ) -> Result<(), Fault> {
        let kind = block.word(b'L').map(whole).transpose()?;
        let p = block.word(b'P').map(whole).transpose()?;
        let fanuc = rules.dialect == Dialect::Fanuc;
        let number = match (kind, p) {
            (Some(2 | 20), Some(p @ 1..=9)) if !fanuc => p as Number,
            (Some(2 | 20), Some(0)) if !fanuc => self.offsets.selected(),
            (Some(2), Some(p @ 1..=6)) if fanuc => p as Number,
            (Some(20), Some(p @ 1..=300)) if fanuc => 100 + p as Number,
            (Some(1), Some(tool)) if rules.dialect == Dialect::LinuxCnc => {
                return Err(unknown(
                    word,
                    &format!("G10 L1: the offsets of tool {tool} change within the program"),
                    "write them into the tool table or the setup instead",
                ));
            }
            _ => {
                return Err(unknown(
                    word,
                    "G10 that is not followed: only L2 and L20 with P are",
                    "set the offset in the setup instead",
                ));
            }
        };
        let here = kind == Some(20) && !fanuc;
        let known = self.offsets.systems.get(&number).copied();
        let relative = fanuc && self.distance != Some(super::modal::Distance::Absolute);
        if relative {
            return Err(unknown(word, "G10 under G91", "write G90 before it"));
        }
        // Axes that were not given keep what they had, which must be known.
        let all = rules.axes;
        if known.is_none() && axis_words & all != all {
            return Err(Fault::new(
                word.span(),
                format!(
                    "{} is set for some axes, and what it was for the others is not known",
                    super::offsets::system_name(number)
                ),
                format!(
                    "give the setup [offset.\"{}\"], or write all axes here",
                    super::offsets::system_name(number)
                ),
            ));
        }
        let mut system = known.unwrap_or_default();
        if let Some(rotation) = block.word(b'R') {
            system.rotation = rotation.value;
        }
        if here {
            self.not_with_tip(word)?;
            let mut trial = self.offsets.clone();
            let mut bare = system;
            bare.origin = [0.0; COUNT];
            trial.set(number, bare);
            trial.select(number);
            let turned = trial.is_turned() && axis_words & 0b11 != 0;
            if turned && axis_words & 0b11 != 0b11 {
                return Err(unknown(
                    word,
                    "G10 L20 of X or Y alone under a rotation",
                    "write both",
                ));
            }
            if let Some(axis) = self.position.missing(axis_words) {
                return Err(not_known(word, axis));
            }
            // origin = machine − tool − Rz · (word + g92)
            let mut words = [0.0; COUNT];
            for axis in bits(axis_words) {
                words[axis] = self.value(block, rules, axis)?;
            }
            let meant = trial.machine(&words);
            for axis in bits(axis_words) {
                system.origin[axis] = self.position.at[axis] - meant[axis];
            }
            step.reference = Some(Some(number));
        } else {
            for axis in bits(axis_words) {
                system.origin[axis] = self.value(block, rules, axis)?;
            }
        }
        self.offsets.set(number, system);
        Ok(())
    }

    fn not_with_tip(&self, word: &Word) -> Result<(), Fault> {
        if !self.tip {
            return Ok(());
        }
        Err(unknown(
            word,
            "this word under tool-centre-point control",
            "switch tool-centre-point control off before it",
        ))
    }
}

/// Bits that are set, as numbers.
pub(super) fn bits(mask: u16) -> impl Iterator<Item = usize> {
    (0..COUNT).filter(move |axis| mask & (1 << axis) != 0)
}

/// A position that is needed and not known.
pub(super) fn not_known(word: &Word, axis: usize) -> Fault {
    let letter = axes::name(axis);
    Fault::new(
        word.span(),
        format!("the position of {letter} is not known here"),
        format!("command {letter} before, or give it in the setup: [start] {letter} = …"),
    )
}

/// The axes that have words, a bit each.
fn axis_words(block: &Block) -> u16 {
    let mut mask = 0;
    for word in &block.words {
        if let Some(axis) = axes::index(word.letter) {
            mask |= 1 << axis;
        }
    }
    mask
}

/// True if G43.1 takes the axes.
fn asked_for_offset(block: &Block, rules: &Rules) -> bool {
    block.words.iter().any(|w| {
        w.letter == b'G'
            && w.tenths().and_then(|t| codes::g(t, rules.dialect))
                == Some(Code::ToolLength(codes::Length::OfWords))
    })
}

/// A whole number that is not negative.
pub(super) fn whole(word: &Word) -> Result<u32, Fault> {
    if word.value >= 0.0 && word.value.fract() == 0.0 && word.value < 1e6 {
        return Ok(word.value as u32);
    }
    Err(Fault::new(
        word.span(),
        "no whole number",
        "write one that is not negative",
    ))
}

fn is_passed(word: &Word, rules: &Rules) -> bool {
    let name = format!("{}{}", char::from(word.letter), word.value);
    rules
        .pass
        .iter()
        .any(|passed| passed.eq_ignore_ascii_case(&name))
}

/// True if nothing in the line moves anything or changes a mode.
fn is_neutral(block: &Block, rules: &Rules) -> bool {
    block.words.iter().all(|word| match word.letter {
        b'N' | b'S' => true,
        b'M' => word.tenths().and_then(|t| codes::m(t, rules.dialect)) == Some(Machine::Neutral),
        _ => false,
    })
}

fn unknown_g(word: &Word) -> String {
    match word.tenths() {
        Some(50..=59) => "splines (G5) are not corrected".to_owned(),
        Some(70 | 80) => "lathes (G7, G8) are not corrected".to_owned(),
        Some(680..=689) => "rotated coordinates (G68) are not followed".to_owned(),
        Some(870 | 880) => "cycles with a stopped spindle (G87, G88) are not corrected".to_owned(),
        Some(760) => "threading cycles of lathes (G76) are not corrected".to_owned(),
        _ => "no G word that is known in this dialect".to_owned(),
    }
}

fn remedy_g(word: &Word) -> String {
    match word.tenths() {
        Some(50..=59 | 680..=689 | 870 | 880 | 760) => {
            "write the program out with G0 to G3, or use the compensation in the controller"
                .to_owned()
        }
        _ => format!(
            "check --dialect; if it moves nothing and changes no coordinates, pass it with --pass G{}",
            word.value
        ),
    }
}

/// The system, where it must be known.
impl State {
    fn needs_system(&self, word: &Word) -> Result<&System, Fault> {
        self.offsets.active().ok_or_else(|| {
            let name = super::offsets::system_name(self.offsets.selected());
            Fault::new(
                word.span(),
                format!("the offset of {name} is not known"),
                format!("give it in the setup: [offset.\"{name}\"] X = …, Y = …, Z = …"),
            )
        })
    }

    /// The motion that words of axes go on with.
    fn motion_of(&self, asked: &Asked) -> Option<Motion> {
        match asked.motion {
            Some((Code::Motion(motion), _)) => Some(motion),
            Some(_) => None,
            None => self.motion,
        }
    }
}
