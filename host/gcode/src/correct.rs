//! A program corrected, line by line.

mod arc;
mod cycles;
mod feed;
mod given;
mod motion;
mod options;
mod pass;
mod piece;
mod runs;
mod straight;
mod write;

use super::axes::{self, COUNT, PerLetter};
use super::dialect::{AfterEnd, Wrapping};
use super::edit::Edits;
use super::fault::{Fault, Refusal};
use super::interpret::{Step, bits, is_neutral};
use super::line_map::{Entry, Role};
use super::offsets::system_name;
use super::report::Report;
use super::state::{Rules, State};
use super::tables::Tables;
use super::tip::Tip;
use super::trace::{Traced, Travels};
use super::travel_directions::TravelDirections;
use super::words::{Block, Word};
use given::Given;
pub use options::{Backlash, Options};
use piece::Piece;
use write::Extrusion;

/// Corrects a program.
pub struct Corrector<'a> {
    rules: &'a Rules,
    tables: &'a Tables<'a>,
    tip: Option<&'a Tip<'a>>,
    options: Options,
    /// What the program says.
    nominal: State,
    /// What the corrected program says.
    written: State,
    ways: TravelDirections,
    /// Directions before the motion that is looked at.
    start_travel: Travels,
    /// What was done so far.
    pub report: Report,
    line: u64,
    block: Block,
    edits: Edits,
    traced: Traced,
    /// A move by so much needs no cut, wherever it is (mm, degrees; commands of axes).
    uncut: PerLetter,
    ends: Vec<usize>,
    pieces: Vec<Piece>,
    /// What is written, until it is taken.
    out: Vec<u8>,
    check: Block,
    eol: &'static [u8],
    /// What the corrected program says before this line, while the modes of the line itself are in `written`.
    before_modes: Option<State>,
    /// What the written lines are, until they are taken.
    lines: Vec<Entry>,
    /// True until the first line is written that comes from the line that is read.
    begins: bool,
    /// True if the last line has no end.
    in_line: bool,
    /// How many lines `%` there are.
    percent: u64,
    /// True behind the last one.
    closed: bool,
    /// Lines after the end that no M99 has made a subprogram yet: what is refused if none does.
    after_end: Option<Refusal>,
    /// True where the corrected program stands at the corrected position of the program, and not elsewhere: behind what
    /// passes, or over a hole.
    joined: bool,
    /// E of the line that is written, if that is divided.
    extrusion: Option<Extrusion>,
    /// The first comment, until it is written.
    mark: Option<String>,
}

impl<'a> Corrector<'a> {
    /// `mark` is the first comment, without brackets.
    pub fn new(
        rules: &'a Rules,
        tables: &'a Tables<'a>,
        tip: Option<&'a Tip<'a>>,
        options: Options,
        mark: Option<String>,
    ) -> Result<Self, String> {
        fits_dialect(rules)?;
        let mut nominal = State::new(rules);
        let ways = TravelDirections::new(tables, &nominal.position, &rules.setup.travel);
        if rules.tip {
            let length = length_at_start(&nominal, rules, tables)?;
            if let Some(tip) = tip {
                nominal.position.at = tip.world(&nominal.position.at, length);
            }
        }
        Ok(Self {
            rules,
            tables,
            tip,
            options,
            written: nominal.clone(),
            nominal,
            start_travel: ways.travel,
            ways,
            report: Report::default(),
            line: 0,
            block: Block::default(),
            edits: Edits::default(),
            traced: Traced::default(),
            uncut: [0.0; COUNT],
            ends: Vec::new(),
            pieces: Vec::new(),
            out: Vec::new(),
            check: Block::default(),
            eol: b"\n",
            before_modes: None,
            lines: Vec::new(),
            begins: true,
            in_line: false,
            percent: 0,
            closed: false,
            after_end: None,
            joined: false,
            extrusion: None,
            mark,
        })
    }

    /// Corrects the next line; `eol` is how it ends. What is to be written goes to the end of `out`.
    ///
    /// # Errors
    /// What is refused; nothing that was written before is of use then.
    pub fn next(&mut self, line: &[u8], eol: &[u8], out: &mut Vec<u8>) -> Result<(), Refusal> {
        self.line += 1;
        std::mem::swap(&mut self.out, out);
        let done = self.do_line(line, eol);
        std::mem::swap(&mut self.out, out);
        done.map_err(|fault| {
            let after_end = self.after_end.take();
            let first = after_end.filter(|refusal| refusal.cause == fault.cause);
            first.unwrap_or_else(|| Refusal::at(fault, self.line, line))
        })
    }

    /// Writes what the lines are that were written since the last time.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn take_map(&mut self, to: &mut impl std::io::Write) -> std::io::Result<()> {
        self.lines.drain(..).try_for_each(|entry| entry.write(to))
    }

    /// A line is written.
    fn note(&mut self, role: Role) {
        self.report.lines[1] += 1;
        let begins = std::mem::take(&mut self.begins);
        self.lines.push(Entry { begins, role });
    }

    /// A line ends.
    fn end_line(&mut self, eol: &[u8], role: Role) {
        self.out.extend_from_slice(eol);
        self.note(role);
    }

    /// How far the lines that are written have come along the motion.
    fn progress(&self) -> f64 {
        let mut own = self.lines.iter().rev();
        let last = own.find_map(|entry| match entry.role {
            Role::Until(part) => Some(part),
            _ => None,
        });
        last.unwrap_or(0.0)
    }

    /// The end of the program.
    ///
    /// # Errors
    /// A program without any line, and one that seems to be cut off.
    pub fn finish(&mut self) -> Result<(), Refusal> {
        if let Some(refusal) = self.after_end.take() {
            return Err(refusal);
        }
        let (cause, remedy) = if self.line == self.percent {
            (
                "the program is empty",
                "give a program with at least one line, between lines % or without them",
            )
        } else if self.nominal.ended {
            return Ok(());
        } else if self.in_line && !self.rules.dialect.table().printer {
            (
                "the program ends within a line, and without M2, M30 or %: it may be cut off",
                "get the whole file; if this is all of it, end its last line, or end it with M2 or M30",
            )
        } else if self.percent > 0 && (self.percent < 2 || self.nominal.begun) {
            (
                "the program begins with % and ends without %, M2 or M30: it may be cut off",
                "get the whole file; if this is all of it, end it with %, M2 or M30",
            )
        } else {
            return Ok(());
        };
        Err(Refusal::at(
            Fault::new(0..0, cause, remedy),
            self.line.max(1),
            b"",
        ))
    }

    fn do_line(&mut self, line: &[u8], eol: &[u8]) -> Result<(), Fault> {
        self.report.lines[0] += 1;
        self.begins = true;
        if eol == b"\r\n" {
            self.eol = b"\r\n";
        }
        self.in_line = eol.is_empty();
        if self.nominal.ended {
            self.behind_the_end(line)?;
            self.out.extend_from_slice(line);
            self.end_line(eol, Role::Plain);
            return Ok(());
        }
        let mut block = std::mem::take(&mut self.block);
        block.scan(line, self.rules.dialect)?;
        if block.marked {
            return Err(Fault::new(
                0..line.len(),
                "the program is corrected already",
                "correct the program that its first comment names",
            ));
        }
        self.percent += u64::from(block.percent);
        self.closed |= block.percent && self.nominal.begun;
        self.begin(&block, line);
        let done = self.correct_block(&block, line, eol);
        let done = done.map_err(|fault| Fault {
            span: fault.span.or_else(|| Some(block.axis_span())),
            ..fault
        });
        self.block = block;
        done
    }

    /// Lines after the end are not part of the program, but Grbl runs whatever it is sent, and a file for Fanuc's
    /// controllers may have several programs, up to its last `%`. A subprogram among them is passed: its calls have been
    /// written out, and nothing runs it.
    fn behind_the_end(&mut self, line: &[u8]) -> Result<(), Fault> {
        let after_end = self.rules.dialect.table().after_end;
        let (cause, remedy) = match after_end {
            AfterEnd::Nothing => return Ok(()),
            AfterEnd::Another if self.closed => return Ok(()),
            AfterEnd::Another => (
                "a line after the end of the program: another program, which would not be corrected",
                "give each program in a file of its own",
            ),
            AfterEnd::Run => (
                "a line after the end of the program: Grbl runs it like any other",
                "take out M2, M30 or % before it, or the line",
            ),
        };
        self.block.scan(line, self.rules.dialect)?;
        self.closed |= self.block.percent;
        let is_return = |word: &Word| word.letter == b'M' && word.tenths() == Some(990);
        match self.block.words.first() {
            None if self.block.percent && self.after_end.is_some() => {
                Err(Fault::new(0..line.len(), cause, remedy))
            }
            None => Ok(()),
            Some(word) if self.rules.dialect.table().calls => {
                let fault = word.fault(cause, remedy);
                let is_open = self.after_end.is_some();
                if self.block.ends(self.rules.dialect) || is_open && word.letter == b'O' {
                    return Err(fault);
                }
                if self.block.words.iter().any(is_return) {
                    self.after_end = None;
                } else if !is_open {
                    self.after_end = Some(Refusal::at(fault, self.line, line));
                }
                Ok(())
            }
            // Spindle and coolant.
            Some(_) if after_end == AfterEnd::Run && is_neutral(&self.block, self.rules) => Ok(()),
            Some(word) => Err(word.fault(cause, remedy)),
        }
    }

    /// Writes the mark before the first line that may follow it.
    fn begin(&mut self, block: &Block, line: &[u8]) {
        if self.may_precede_mark(block, line) {
            return;
        }
        if let Some(mark) = self.mark.take() {
            let comment = match self.semicolons() {
                true => format!(";{mark}"),
                false => format!("({mark})"),
            };
            self.out.extend_from_slice(comment.as_bytes());
            self.end_line(self.eol, Role::Plain);
        }
    }

    /// True if comments begin with `;`, and `(` begins none.
    fn semicolons(&self) -> bool {
        let table = self.rules.dialect.table();
        table.has_names || table.printer
    }

    /// True for `%`, for the number of a program, and for the comments by which firmwares and hosts know a slicer.
    fn may_precede_mark(&self, block: &Block, line: &[u8]) -> bool {
        let table = self.rules.dialect.table();
        // Of a Sinumerik's file the second line says where it belongs.
        let is_path = table.has_names && line.starts_with(b";$PATH");
        let is_header = table.printer && block.words.is_empty() && block.command.is_none();
        block.percent || is_path || is_header || block.word(b'O').is_some()
    }

    fn correct_block(&mut self, block: &Block, line: &[u8], eol: &[u8]) -> Result<(), Fault> {
        let before = self.nominal.position;
        let enters = self.enter_tip(block)?;
        let mut step = Step::default();
        self.nominal.step_into(block, self.rules, &mut step)?;
        let others = bits(step.others).map(axes::name);
        self.report.other_axes.extend(others);
        let given = Given {
            line,
            eol,
            block,
            step: &step,
        };
        match step.tip {
            Some(_) if enters => {
                self.nominal.tip = true;
                self.written.tip = true;
            }
            Some(on) => self.switch_tip(&given, on)?,
            None => {}
        }
        match &step.motion {
            None => self.pass(&given, &before),
            Some(motion) => {
                self.report.moves += 1;
                self.motion(&given, motion)
            }
        }
    }
}

/// Values of the setup that controllers of the dialect do not have.
fn fits_dialect(rules: &Rules) -> Result<(), String> {
    let table = rules.dialect.table();
    let wrapped = rules.setup.wrapped.iter().position(|w| *w == Some(true));
    if let (Some(axis), Wrapping::None) = (wrapped, table.wrapping) {
        return Err(format!(
            "[axis.{0}] wrapped: this controller turns {0} as far as words say, so take it out of the setup",
            axes::name(axis)
        ));
    }
    let mut systems = rules.setup.systems.iter();
    let turned = systems.find(|(_, system)| system.rotation != 0.0);
    if let (Some((number, _)), false) = (turned, table.systems_turn) {
        return Err(format!(
            "[offset.{:?}] R: offsets have a rotation in LinuxCNC alone, so take it out of the setup",
            system_name(*number)
        ));
    }
    if rules.setup.decimals.is_some() && !table.needs_points {
        return Err(
            "decimals: words without a point count whole units in this dialect, so take it out of the setup"
                .to_owned(),
        );
    }
    Ok(())
}

/// The tool length of a program that begins under tool-centre-point control, if tables depend on it.
fn length_at_start(
    nominal: &State,
    rules: &Rules,
    tables: &Tables<'_>,
) -> Result<Option<f64>, String> {
    if let Some(axis) = nominal.position.missing(tables.axes) {
        return Err(format!(
            "the position of {} before the first line is unknown: give it in the setup under [start]",
            axes::name(axis)
        ));
    }
    let length = nominal.field_length(rules, tables.takes_length);
    if tables.takes_length && length.is_none() {
        return Err(
            "the compensation depends on the tool length, which is unknown before the first line: \
             give the setup [start] tool and the length of this tool"
                .to_owned(),
        );
    }
    Ok(length)
}
