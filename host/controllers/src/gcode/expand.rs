//! Programs that compute, written out flat: LinuxCNC's stand-alone interpreter, `rs274 -g`, runs a program, and its
//! canonical commands become a program again.
//!
//! The interpreter runs a copy of the program in which block numbers are line numbers (`source`), after a prelude that
//! sets position, offsets and modes as the setup states them (`given`). Every canonical command is either carried out
//! or refused (`canonical`, `flat`). Values that the setup does not give are replaced by the huge number `UNKNOWN`, so
//! that motions that depend on them can be refused. A second run gives other values to all parameters that the program
//! did not set; if its motions differ, the program is refused.

mod canonical;
mod flat;
mod given;
mod interpreter;
mod source;

use super::fault::{Kind, Refusal};
use super::setup::Setup;
use std::fs::File;
use std::io::{BufRead, BufReader, Error, Write};
use std::path::{Path, PathBuf};

/// Positions and offsets beyond this (mm, degrees) contain [`UNKNOWN`].
const KNOWN: f64 = 1e6;
/// Stands for a position or an offset that the setup does not give (mm, degrees), far beyond every machine.
const UNKNOWN: f64 = 4e6;
/// The advice for what only the machine can do.
const FLAT: &str =
    "write that part of the program out flat, or use the compensation in the controller";
/// Digits of the interpreter's numbers after the point.
pub const DECIMALS: usize = 4;

/// What the interpreter is given beside the program.
#[derive(Clone, Copy, Debug)]
pub struct Given<'a> {
    /// Offsets, tools and the place of the machine; its units must be known.
    pub setup: &'a Setup,
    /// The axes of the machine, one bit each.
    pub axes: u16,
    /// Whether lines after `/` are left out; `None`: not known.
    pub block_delete: Option<bool>,
    /// Folders of subroutines, after that of the program.
    pub subroutines: &'a [PathBuf],
}

/// What a program became.
#[derive(Debug, Default)]
pub struct Expanded {
    /// The line of the original that each line comes from.
    lines: Vec<u32>,
    /// True if some of it is in inches.
    pub inches: bool,
}

impl Expanded {
    /// The line of the original that a line of the expanded program comes from.
    #[must_use]
    pub fn original(&self, line: u64) -> u64 {
        let place = usize::try_from(line).unwrap_or(0).checked_sub(1);
        place.map_or(line, |place| {
            self.lines
                .get(place)
                .or(self.lines.last())
                .map_or(line, |l| u64::from(*l))
        })
    }

    /// Lines of the expanded program.
    #[must_use]
    pub fn written(&self) -> usize {
        self.lines.len()
    }
}

/// Why a program was not expanded.
#[derive(Debug, thiserror::Error)]
pub enum ExpandError {
    /// What is refused.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// There is no interpreter.
    #[error("LinuxCNC's interpreter, rs274, is not installed")]
    NotInstalled,
    /// The interpreter cannot be run, or a file cannot be read or written.
    #[error("{0}: {1}")]
    Failed(String, Error),
}

fn failed(what: impl Into<String>) -> impl FnOnce(Error) -> ExpandError {
    let what = what.into();
    |error| ExpandError::Failed(what, error)
}

/// Whether a line of the original has a cause to be refused.
fn refusal(line: u64, word: &str, cause: impl Into<String>, remedy: impl Into<String>) -> Refusal {
    let mut short: String = word.trim().chars().take(60).collect();
    if short.len() < word.trim().len() {
        short.push('…');
    }
    Refusal {
        line,
        word: short,
        kind: Kind::Other,
        cause: cause.into(),
        remedy: remedy.into(),
    }
}

/// Writes a program out flat, in LinuxCNC's words.
///
/// # Errors
/// See [`ExpandError`]; what was written by then is of no use.
pub fn expand(
    program: &Path,
    given: &Given<'_>,
    out: &mut impl Write,
) -> Result<Expanded, ExpandError> {
    let source = source::Source::read(program, given)?;
    let folder = tempfile::tempdir().map_err(failed("a temporary folder cannot be made"))?;
    let folder = folder.path();
    let put = |name: &str, contents: &[u8]| {
        let written = std::fs::write(folder.join(name), contents);
        written.map_err(failed("a temporary file cannot be written"))
    };
    put(interpreter::PROGRAM, &source.copy(&given::prelude(given)))?;
    for (name, text) in source.subroutines() {
        put(&name, &text)?;
    }
    put(
        interpreter::TOOLS,
        given::tools(given, source.tools()).as_bytes(),
    )?;
    put(
        interpreter::PARAMETERS,
        given::parameters(given, None).as_bytes(),
    )?;
    let first = interpreter::run(folder, "canonical", given.block_delete, &source)?;
    let after = std::fs::read_to_string(folder.join(interpreter::PARAMETERS)).map_err(failed(
        "the parameters that the interpreter leaves cannot be read",
    ))?;
    let others = given::parameters(given, Some(7.8125));
    put(interpreter::PARAMETERS, others.as_bytes())?;
    let second = interpreter::run(folder, "canonical-2", given.block_delete, &source);
    depends(&first, second, &source)?;
    let reader = BufReader::new(File::open(&first).map_err(failed("the interpreter's output"))?);
    let mut flat = flat::Flat::new(given, &source);
    flat.read(reader, out)?;
    flat.finish(&after, out)
}

/// Refuses a program whose commands depend on parameters that it did not set.
fn depends(
    first: &Path,
    second: Result<PathBuf, ExpandError>,
    source: &source::Source,
) -> Result<(), ExpandError> {
    let refused = |line: u64| {
        refusal(
            line,
            "",
            "what the program does depends on a parameter that it reads and never sets: another program, or probing, \
             left its value",
            "set the parameter in the program, or give LinuxCNC's parameters: --var FILE.var",
        )
    };
    let second = match second {
        Ok(second) => second,
        Err(ExpandError::Refused(other)) => return Err(refused(other.line).into()),
        Err(other) => return Err(other),
    };
    let open = |path: &Path| File::open(path).map(BufReader::new);
    let lines = |path: &Path| open(path).map_err(failed("the interpreter's output"));
    let (mut first, mut second) = (lines(first)?.lines(), lines(&second)?.lines());
    let mut line = 1;
    loop {
        let next = (first.next().transpose(), second.next().transpose());
        let (Ok(a), Ok(b)) = next else {
            return Err(refused(line).into());
        };
        let command = a.as_deref().and_then(canonical::Line::parse);
        let other = b.as_deref().and_then(canonical::Line::parse);
        line = command.map_or(line, |command| source.line_of(command.block, line));
        // Messages and logs move nothing.
        if let (Some(command), Some(other)) = (command, other)
            && command.name == other.name
            && ["MESSAGE", "LOG"].contains(&command.name)
        {
            continue;
        }
        match (a, b) {
            (None, None) => return Ok(()),
            (a, b) if a == b => {}
            _ => return Err(refused(line).into()),
        }
    }
}
