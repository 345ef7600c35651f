//! The program as it is given to the interpreter: each line with its number as block number, and looked through for
//! what canonical commands cannot say.

use super::canonical::Line;
use super::given::BEGIN;
use super::{ExpandError, FLAT, Given, failed, refusal};
use crate::gcode::axes;
use crate::gcode::fault::Refusal;
use crate::gcode::interpret::bits;
use crate::gcode::modal::Units;
use std::collections::BTreeSet;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

/// Block numbers of subroutines in other files begin at multiples of this.
const FILE: u64 = 1_000_000_000;
/// Longer lines get no block number, since the interpreter reads 255 bytes.
const LONGEST: usize = 240;
/// The comment before a line that calls a subroutine in another file.
pub const CALL: &str = "trueaxis: a call";
/// Parameters that hold offsets, positions and results of the machine.
const OF_MACHINE: std::ops::RangeInclusive<u32> = 5061..=5428;

const WAITS: &str = "M66 waits for an input of the machine";

/// A file: its name, the lines as they are, and as the interpreter gets them.
struct Text {
    name: String,
    lines: Vec<Vec<u8>>,
    copy: Vec<Vec<u8>>,
}

/// A program and the subroutines in other files that it calls.
pub struct Source {
    files: Vec<Text>,
    /// True if it begins with `%`.
    pub percent: bool,
    tools: BTreeSet<u32>,
    /// Lines of the program that call subroutines in other files.
    calls: BTreeSet<usize>,
}

/// A reason to refuse a line: where in it, cause and remedy.
type Bad = (String, String, String);

fn bad(word: &str, cause: impl Into<String>, remedy: impl Into<String>) -> Bad {
    (word.to_owned(), cause.into(), remedy.into())
}

/// What was found in lines.
struct Scan<'g> {
    given: &'g Given<'g>,
    tools: BTreeSet<u32>,
    defined: BTreeSet<String>,
    called: Vec<(String, usize)>,
    /// The first line that reads the diameter of the tool.
    diameter: Option<u64>,
    /// The first line with a parameter whose number is computed.
    computed: Option<u64>,
    /// The first number that may be one of [`OF_MACHINE`] without `#`.
    number: Option<(u64, u32)>,
}

impl Source {
    /// Reads a program, and the files of the subroutines that it calls.
    pub fn read(program: &Path, given: &Given<'_>) -> Result<Self, ExpandError> {
        let mut scan = Scan {
            given,
            tools: BTreeSet::new(),
            defined: BTreeSet::new(),
            called: Vec::new(),
            diameter: None,
            computed: None,
            number: None,
        };
        let mut source = Self {
            files: Vec::new(),
            percent: false,
            tools: BTreeSet::new(),
            calls: BTreeSet::new(),
        };
        source.add(program, &mut scan)?;
        let own = std::mem::take(&mut scan.called);
        let mut folders = vec![program.parent().unwrap_or(Path::new("")).to_path_buf()];
        folders.extend(given.subroutines.iter().cloned());
        let mut waiting: Vec<(String, Option<usize>)> = Vec::new();
        waiting.extend(own.into_iter().map(|(name, line)| (name, Some(line))));
        let mut seen = BTreeSet::new();
        while let Some((name, line)) = waiting.pop() {
            let file = format!("{name}.ngc");
            let found = folders.iter().map(|f| f.join(&file)).find(|f| f.is_file());
            let Some(path) = found.filter(|_| !scan.defined.contains(&name)) else {
                continue;
            };
            source.calls.extend(line);
            if seen.insert(name) {
                // What such a file defines is its own.
                let defined = scan.defined.clone();
                source.add(&path, &mut scan)?;
                scan.defined = defined;
                let called = std::mem::take(&mut scan.called);
                waiting.extend(called.into_iter().map(|(name, _)| (name, None)));
            }
        }
        if let (Some(_), Some((line, number))) = (scan.computed, scan.number) {
            let (line, name) = source.place(line, 1);
            let cause = format!(
                "a number of a parameter that belongs to the machine, in a program that computes numbers of parameters{name}"
            );
            let remedy = format!("write the parameter itself: #{number}");
            return Err(refusal(line, &number.to_string(), cause, remedy).into());
        }
        let setup = given.setup;
        let mut tools = scan.tools.iter().chain(setup.tools.keys());
        let missing = tools.find(|tool| !setup.diameters.contains_key(tool));
        if let (Some(line), Some(tool)) = (scan.diameter, missing) {
            let (line, name) = source.place(line, 1);
            let cause =
                format!("the diameter of the tool, and that of tool {tool} is not known{name}");
            let remedy = "give LinuxCNC's tool table: --tools FILE.tbl";
            return Err(refusal(line, "#5410", cause, remedy).into());
        }
        source.tools = scan.tools;
        Ok(source)
    }

    fn add(&mut self, path: &Path, scan: &mut Scan<'_>) -> Result<(), ExpandError> {
        let bytes = std::fs::read(path);
        let bytes = bytes.map_err(failed(format!("{} cannot be read", path.display())))?;
        let name = path.file_name().unwrap_or(path.as_os_str());
        let mut text = Text {
            name: name.to_string_lossy().into_owned(),
            lines: bytes.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect(),
            copy: Vec::new(),
        };
        let file = self.files.len() as u64;
        let mut ended = false;
        for (place, line) in text.lines.iter().enumerate() {
            let code = FILE * file + place as u64 + 1;
            let is_percent = line.trim_ascii() == b"%";
            let is_first = text.copy.iter().all(|l: &Vec<u8>| l.is_empty());
            if is_percent && is_first && file == 0 {
                self.percent = true;
                text.copy.push(Vec::new());
                continue;
            }
            // What comes after `%` is not read.
            ended |= is_percent && self.percent && file == 0;
            if ended || is_percent {
                text.copy.push(line.trim_ascii().to_vec());
                continue;
            }
            match scan.line(line, code) {
                Ok(copy) => text.copy.push(copy),
                Err((word, cause, remedy)) => {
                    self.files.push(text);
                    let (line, name) = self.place(code, 1);
                    return Err(refusal(line, &word, cause + &name, remedy).into());
                }
            }
        }
        self.files.push(text);
        Ok(())
    }

    /// Tools that the program names.
    pub fn tools(&self) -> &BTreeSet<u32> {
        &self.tools
    }

    /// The program for the interpreter, after a prelude.
    pub fn copy(&self, prelude: &str) -> Vec<u8> {
        let mut copy = Vec::new();
        if self.percent {
            copy.extend(b"%\n");
        }
        copy.extend(prelude.as_bytes());
        for (place, line) in self.files[0].copy.iter().enumerate() {
            if self.calls.contains(&(place + 1)) {
                copy.extend(format!("N{} ({CALL})\n", place + 1).bytes());
            }
            copy.extend(line);
            copy.push(b'\n');
        }
        copy
    }

    /// The other files for the interpreter, by their names.
    pub fn subroutines(&self) -> impl Iterator<Item = (String, Vec<u8>)> {
        let others = self.files.iter().skip(1);
        others.map(|text| (text.name.clone(), text.copy.join(&b'\n')))
    }

    /// The line of the program that a block comes from: for blocks of other files, and those without a number, `last`.
    pub fn line_of(&self, block: Option<u64>, last: u64) -> u64 {
        block.filter(|block| *block < FILE).unwrap_or(last)
    }

    /// The line of the program to name for a block, and the place in another file if it is there.
    pub fn place(&self, block: u64, last: u64) -> (u64, String) {
        let file = usize::try_from(block / FILE).unwrap_or(0);
        match self.files.get(file).filter(|_| file > 0) {
            None => (self.line_of(Some(block), last), String::new()),
            Some(text) => (last, format!(" (line {} of {})", block % FILE, text.name)),
        }
    }

    /// The last line of the program in the interpreter's output.
    pub fn last_line_in(&self, output: &Path) -> u64 {
        let mut text = Vec::new();
        let end = std::fs::File::open(output).and_then(|mut file| {
            let length = file.seek(SeekFrom::End(0))?;
            file.seek(SeekFrom::Start(length.saturating_sub(1 << 14)))?;
            file.read_to_end(&mut text)
        });
        let text = String::from_utf8_lossy(&text);
        let mut blocks = text.lines().filter_map(Line::parse).filter_map(|l| l.block);
        let last = blocks.rfind(|block| *block < FILE);
        end.ok().and(last).unwrap_or(1)
    }

    /// What the interpreter says of an error, as a refusal.
    pub fn said(&self, errors: &str, output: &Path) -> Refusal {
        let lines = errors.lines().map(str::trim);
        let mut lines = lines.filter(|l| !l.is_empty() && *l != "executing");
        let cause = lines.next().unwrap_or("it ends without a message");
        let last = self.last_line_in(output);
        let block = lines.next_back().and_then(|line| {
            let digits = line.trim_start_matches('/').strip_prefix(['N', 'n'])?;
            let end = digits.find(|c: char| !c.is_ascii_digit());
            digits[..end.unwrap_or(digits.len())].parse::<u64>().ok()
        });
        let (line, name) = self.place(block.unwrap_or(last), last);
        let word = match block {
            Some(block) if block < FILE => {
                let line = usize::try_from(block)
                    .ok()
                    .and_then(|b| self.files[0].lines.get(b - 1));
                line.map_or(String::new(), |l| String::from_utf8_lossy(l).into_owned())
            }
            _ => String::new(),
        };
        let sought = cause.split_once("seeking o-word: ").map(|(_, rest)| rest);
        if let Some(name) = sought.and_then(|rest| rest.split(' ').next()) {
            let of = |line: &Vec<u8>| String::from_utf8_lossy(line).contains(name);
            let found = self.files[0].copy.iter().position(of);
            return refusal(
                found.map_or(last, |place| place as u64 + 1),
                name,
                "a subroutine that is not found, or an O-word that does not end",
                "name the folder of the subroutine: --subroutines FOLDER",
            );
        }
        if cause.contains(WAITS) {
            return refusal(line, &word, format!("{WAITS}{name}"), FLAT);
        }
        let remedy = if cause.contains("not found in the tool table") {
            "give the tool in the setup: [tool.N] length = …, or LinuxCNC's tool table: --tools FILE.tbl"
        } else if cause.contains("no percent sign") {
            "end the program with M2, or put % into its first and last lines"
        } else if cause.starts_with("Bad character") {
            "the stand-alone interpreter has the axes X, Y, Z, A, B and C: write the program out flat"
        } else if cause.contains("nknown m code") || cause.contains("M-code greater") {
            "the stand-alone interpreter does not know the M words of a configuration: write the program out flat"
        } else {
            "correct the line as LinuxCNC asks, or use the compensation in the controller"
        };
        let cause = format!("LinuxCNC's interpreter refuses it: {cause}{name}");
        refusal(line, &word, cause, remedy)
    }
}

impl Scan<'_> {
    /// A line as the interpreter gets it.
    fn line(&mut self, line: &[u8], code: u64) -> Result<Vec<u8>, Bad> {
        let (words, comments) = parted(line);
        self.comment(&comments)?;
        let (slash, words) = match words.as_slice() {
            [b'/', rest @ ..] => (true, rest),
            rest => (false, rest),
        };
        if slash && self.given.block_delete.is_none() {
            return Err(bad(
                "/",
                "a line after `/`: a switch of the controller decides whether it runs",
                "pass the position of the switch: --block-delete on or off",
            ));
        }
        let words = match words {
            [b'n', rest @ ..] => {
                let is_number = |b: &u8| b.is_ascii_digit() || *b == b'.';
                let end = rest.iter().position(|b| !is_number(b));
                &rest[end.unwrap_or(rest.len())..]
            }
            rest => rest,
        };
        let mut copy = Vec::new();
        let words = self.words(words, code, &mut copy)?;
        if slash {
            copy.push(b'/');
        }
        if line.len() <= LONGEST && !(words.is_empty() && comments.is_empty()) {
            copy.extend(format!("N{code} ").bytes());
        }
        copy.extend(&words);
        copy.extend(&comments);
        Ok(copy)
    }

    /// Messages show parameters, and `py` runs Python.
    fn comment(&mut self, comments: &[u8]) -> Result<(), Bad> {
        let text = String::from_utf8_lossy(comments).to_lowercase();
        for comment in text.split('(').skip(1) {
            let comment = comment.trim_start();
            if comment.starts_with("py,") {
                return Err(bad("(py,", "a line in Python", FLAT));
            }
            if !["debug", "log,"]
                .iter()
                .any(|kind| comment.starts_with(kind))
            {
                continue;
            }
            for (at, _) in comment.match_indices('#') {
                let (number, _) = digits(&comment.as_bytes()[at + 1..]);
                if let Some(number) = number
                    && self.parameter(number)? != 1.0
                {
                    return Err(bad(
                        &format!("#{number}"),
                        "a message with a length in the units of the machine, which the stand-alone interpreter has in \
                         inches",
                        "take the parameter out of the message",
                    ));
                }
            }
        }
        Ok(())
    }

    /// Words without spaces and comments, in small letters, as the interpreter gets them.
    fn words(&mut self, words: &[u8], code: u64, guards: &mut Vec<u8>) -> Result<Vec<u8>, Bad> {
        let mut copy = Vec::new();
        let mut computed = None;
        let mut at = self.o_word(words, code);
        copy.extend(&words[..at]);
        let mut depth = 0_i32;
        while let Some(byte) = words.get(at) {
            let rest = &words[at + 1..];
            let before = at.checked_sub(1).map(|at| words[at]);
            match byte {
                b'#' => {
                    let (read, put) = self.number_of_parameter(rest, code)?;
                    copy.extend(put);
                    at += 1 + read;
                    continue;
                }
                b'[' => depth += 1,
                b']' => depth -= 1,
                b'm' if depth == 0 => match digits(rest) {
                    (Some(66), _) => {
                        return Err(bad("M66", WAITS, FLAT));
                    }
                    (Some(_), _) => {}
                    (None, _) => computed = Some(copy.len() + 1),
                },
                b'a'..=b'z' if depth == 0 => guard(&mut computed, &copy, code, guards),
                b'0'..=b'9'
                    if before
                        .is_none_or(|b| !b.is_ascii_alphanumeric() && !b"#.>".contains(&b)) =>
                {
                    let number = digits(&words[at..]).0.filter(|n| OF_MACHINE.contains(n));
                    // Those that are not lengths are as they are.
                    if let Some(number) = number.filter(|n| ![5210, 5220, 5400].contains(n)) {
                        self.number.get_or_insert((code, number));
                    }
                }
                _ => {}
            }
            if *byte == b't' && depth == 0 {
                self.tools.extend(digits(rest).0);
            }
            copy.push(*byte);
            at += 1;
        }
        guard(&mut computed, &copy, code, guards);
        Ok(copy)
    }

    /// Notes what an O-word at the beginning calls or defines; its length.
    fn o_word(&mut self, words: &[u8], code: u64) -> usize {
        let place = usize::try_from(code % FILE).unwrap_or(0);
        if let Some(at) = words.windows(4).position(|w| w == b"m98p") {
            let (number, _) = digits(&words[at + 4..]);
            self.called.extend(number.map(|n| (n.to_string(), place)));
        }
        let [b'o', rest @ ..] = words else {
            return 0;
        };
        let (name, end) = match rest {
            [b'<', name @ ..] => {
                let end = name.iter().position(|b| *b == b'>').unwrap_or(name.len());
                (&name[..end], (end + 3).min(words.len()))
            }
            _ => {
                let end = rest.iter().position(|b| !b.is_ascii_digit());
                let end = end.unwrap_or(rest.len());
                (&rest[..end], 1 + end)
            }
        };
        let name = String::from_utf8_lossy(name).into_owned();
        let what = &words[end..];
        if what.starts_with(b"call") {
            self.called.push((name, place));
        } else if what.starts_with(b"sub") || what.is_empty() {
            self.defined.insert(name);
        }
        end
    }

    /// What follows `#`: the length of its number, and the parameter as the interpreter gets it.
    fn number_of_parameter(&mut self, rest: &[u8], code: u64) -> Result<(usize, Vec<u8>), Bad> {
        let same = |length: usize| (length, [b"#", &rest[..length]].concat());
        if rest.first() == Some(&b'<') {
            let end = rest.iter().position(|b| *b == b'>');
            let length = end.map_or(rest.len(), |end| end + 1);
            let name = String::from_utf8_lossy(&rest[..length]).into_owned();
            return Ok(match self.named(&name)? {
                None => same(length),
                Some(value) => (
                    length,
                    value
                        .replace("LINE", &(code % FILE).to_string())
                        .into_bytes(),
                ),
            });
        }
        let (Some(number), length) = digits(rest) else {
            self.computed.get_or_insert(code);
            return Ok(same(0));
        };
        let assigned = rest.get(length) == Some(&b'=');
        if assigned && OF_MACHINE.contains(&number) {
            return Err(bad(
                &format!("#{number}="),
                "a parameter of the machine is set by its number",
                "set offsets with G10 L2, or in the setup",
            ));
        }
        if assigned {
            return Ok(same(length));
        }
        if number == 5410 {
            self.diameter.get_or_insert(code);
        }
        let factor = self.parameter(number)?;
        Ok(match factor == 1.0 {
            true => same(length),
            false => (length, format!("[#{number}*{factor}]").into_bytes()),
        })
    }

    /// What replaces a named parameter.
    fn named(&self, name: &str) -> Result<Option<String>, Bad> {
        let inner = name.trim_start_matches('<').trim_end_matches('>');
        let of_machine = |cause: &str| Err(bad(&format!("#{name}"), cause, FLAT));
        match inner {
            // Programs run, and are not shown.
            "_task" => Ok(Some("1".to_owned())),
            "_line" => Ok(Some("LINE".to_owned())),
            "_metric_machine" | "_imperial_machine" => {
                of_machine("the stand-alone interpreter does not know the units of the machine")
            }
            "_current_pocket" | "_selected_pocket" => {
                of_machine("a pocket of the tool changer: it is not in the setup")
            }
            "_current_tool" => self.parameter(5400).map(|_| None),
            _ if inner.starts_with("_hal[") => {
                of_machine("a pin of the machine, while the program runs")
            }
            _ if inner.starts_with("_ini[") => of_machine("an entry of the machine's INI file"),
            _ => {
                let axis = inner
                    .strip_prefix("_abs_")
                    .or_else(|| inner.strip_prefix('_'));
                let is_axis = |a: &str| a.len() == 1 && "xyzabcuvw".contains(a);
                match axis.is_some_and(is_axis) {
                    true => self.position(&format!("#{name}")).map(|()| None),
                    false => Ok(None),
                }
            }
        }
    }

    /// Whether the position that a program reads is known.
    fn position(&self, word: &str) -> Result<(), Bad> {
        let setup = self.given.setup;
        let missing = bits(self.given.axes).find(|axis| !setup.start.knows(*axis));
        if let Some(axis) = missing {
            let name = axes::name(axis);
            return Err(bad(
                word,
                format!("the position of the machine, and that of {name} is not known"),
                format!("give it in the setup: [start] {name} = …"),
            ));
        }
        if setup.tool_change.is_some() {
            return Err(bad(
                word,
                "the position of the machine, in a setup with tool changes that move it",
                FLAT,
            ));
        }
        Ok(())
    }

    /// What a parameter that is read must be multiplied by, for the interpreter has some in inches.
    fn parameter(&self, number: u32) -> Result<f64, Bad> {
        let setup = self.given.setup;
        let word = format!("#{number}");
        let refused = |cause: &str, remedy: &str| Err(bad(&word, cause, remedy));
        let place = |first: u32| {
            number
                .checked_sub(first)
                .filter(|p| *p < 9)
                .map(|p| p as usize)
        };
        let not_known = |what: String, remedy: String| {
            Err(bad(
                &word,
                format!("{what}, which is not known"),
                format!("give it in the setup: {remedy}"),
            ))
        };
        let axis = match number {
            5061..=5070 => {
                return refused("the result of probing, which only the machine has", FLAT);
            }
            5399 => return refused("the value of an input of the machine (M66)", FLAT),
            5400..=5406 | 5410 if setup.tool.is_none() => {
                return not_known(
                    "the tool in the spindle".to_owned(),
                    "[start] tool = …".to_owned(),
                );
            }
            5401..=5406 => place(5401),
            5407..=5409 | 5411..=5413 => {
                return refused(
                    "a number of the tool that the stand-alone interpreter does not have",
                    FLAT,
                );
            }
            5420..=5428 => {
                self.position(&word)?;
                None
            }
            5161..=5169 | 5181..=5189 => {
                let home = usize::from(number > 5180);
                let axis = place([5161, 5181][home]);
                let known = setup.homes[home]
                    .zip(axis)
                    .is_some_and(|(at, axis)| at.knows(axis));
                if !known {
                    let name = ["G28", "G30"][home];
                    return not_known(format!("where {name} goes"), format!("[home.{name}]"));
                }
                axis
            }
            5211..=5219 => place(5211),
            5221..=5390 => {
                let (system, axis) = ((number - 5201) / 20, (number - 5201) % 20);
                let is_one = (1..=9).contains(&system) && axis < 10;
                if is_one && !setup.systems.contains_key(&(system as u16)) {
                    let name = crate::gcode::offsets::system_name(system as u16);
                    return not_known(format!("the offset {name}"), format!("[offset.\"{name}\"]"));
                }
                Some(axis as usize).filter(|axis| is_one && *axis < 9)
            }
            _ => None,
        };
        let is_length = axis.is_some_and(|axis| !axes::is_rotary(axis));
        let in_mm = setup.units == Some(Units::Millimetre);
        Ok(if is_length && in_mm { 25.4 } else { 1.0 })
    }
}

/// Lines before a block with a computed M word, from its place to the end of what is written: M66 waits for an input,
/// and the interpreter prints nothing of it.
fn guard(computed: &mut Option<usize>, copy: &[u8], code: u64, guards: &mut Vec<u8>) {
    let Some(number) = computed.take().and_then(|start| copy.get(start..)) else {
        return;
    };
    let place = guards.len();
    for line in [
        format!(
            "o<trueaxis_{code}_{place}> if [{} EQ 66]\n",
            String::from_utf8_lossy(number)
        ),
        format!("N{code} (abort,{WAITS})\n"),
        format!("o<trueaxis_{code}_{place}> endif\n"),
    ] {
        guards.extend(line.bytes());
    }
}

/// The number at the beginning, and how many bytes it takes.
fn digits(text: &[u8]) -> (Option<u32>, usize) {
    let end = text.iter().position(|b| !b.is_ascii_digit());
    let end = end.unwrap_or(text.len());
    let number = std::str::from_utf8(&text[..end])
        .ok()
        .and_then(|t| t.parse().ok());
    (number, end)
}

/// Words without spaces in small letters, and the comments. What PRINT shows on a terminal becomes a comment, and text
/// after `;` is left out, as the interpreter does.
fn parted(line: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let (mut words, mut comments) = (Vec::new(), Vec::new());
    let mut inside = false;
    for byte in line {
        match byte {
            b'\r' => {}
            b'(' if !inside => {
                inside = true;
                comments.push(b'(');
            }
            _ if inside => {
                comments.push(*byte);
                inside = *byte != b')';
            }
            b';' => break,
            b' ' | b'\t' => {}
            other => words.push(other.to_ascii_lowercase()),
        }
    }
    let start = |comments: &[u8]| {
        let lower = String::from_utf8_lossy(comments).to_lowercase();
        lower.trim_start_matches(['(', ' ']).starts_with("print,")
    };
    if start(&comments)
        && let Some(comma) = comments.iter().position(|b| *b == b',')
    {
        comments[comma] = b' ';
    }
    // The marks of the copy are its own.
    if comments.windows(9).any(|w| w == b"trueaxis:")
        && [BEGIN, CALL]
            .iter()
            .any(|m| String::from_utf8_lossy(&comments).contains(m))
    {
        comments.clear();
    }
    (words, comments)
}
