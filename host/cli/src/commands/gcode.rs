//! `trueaxis gcode`

#[cfg_attr(target_family = "wasm", path = "gcode/ahead_in_browser.rs")]
mod ahead;
mod arguments;
mod scratch;
mod screen;

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::output;
use super::progress::ProgressBarOnScreen;
use super::replace;
use ahead::ahead;
pub use arguments::Arguments;
use scratch::Scratch;
use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use trueaxis_gcode::check::{CheckResult, Corrected};
use trueaxis_gcode::stream::{self, StreamError};
use trueaxis_gcode::subprograms::{self, Inlined};
use trueaxis_gcode::{Corrector, Dialect, Job, JobMachine, Report};
use trueaxis_model::validate::Runtime;
use trueaxis_tables::compile::Progress;

fn open(path: &Path) -> Result<BufReader<File>, BadInput> {
    let file = File::open(path).map_err(|error| {
        BadInput::new(
            format!("{}: cannot be read: {error}", path.display()),
            "check the path; files are looked for from the current folder",
        )
    })?;
    Ok(BufReader::with_capacity(1 << 18, file))
}

/// Shows what is wrong with a program.
fn bad_program(path: &Path, error: &StreamError) -> BadInput {
    let remedy = match error {
        StreamError::Refused(refusal) => refusal.remedy.as_str(),
        StreamError::Read(_) => "give the path of a readable file",
        StreamError::Write(_) => WRITABLE,
    };
    BadInput::new(format!("{}: {error}", path.display()), remedy)
}

/// The remedy where a corrected program cannot be written.
const WRITABLE: &str = "give a name in an existing folder with write permission and room; an old file of this name is unchanged";

fn not_written(output: &Path, error: &std::io::Error) -> BadInput {
    let output = output.display();
    BadInput::new(format!("{output}: cannot be written: {error}"), WRITABLE)
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    arguments.prepare()?;
    let options = arguments.options()?;
    let blob = files::read_blob(&arguments.compensation)?;
    let runtime = Runtime::load(&blob);
    let runtime = runtime.map_err(|e| BadInput::in_blob(e, &arguments.compensation))?;
    let compensation = runtime.compensation();
    let machine = arguments.machine.as_deref().map(files::read_machine);
    let machine = machine.transpose()?;
    let errors = match (&arguments.errors, &machine) {
        (Some(path), Some(machine)) if arguments.check => Some(files::read_errors(path, machine)?),
        _ => None,
    };
    let setup = arguments.read_setup()?;
    let of = machine.as_ref().map(|machine| JobMachine {
        machine,
        errors: errors.as_ref(),
    });
    let job = Job::new(compensation, of, options, |tables| {
        arguments.rules(setup, tables)
    });
    let job = job.map_err(|error| arguments.bad_job(&error))?;
    let mark = arguments.mark(&blob, compensation, &job.tables)?;
    let program = ReadProgram {
        arguments,
        inlined: inlined(&arguments.program, job.rules.dialect)?,
        job,
    };
    let written = program.write(mark)?;
    let lengths = screen::Lengths::new(&written.report, &program.job.tables, machine.as_ref());
    program.show(&written, compensation, &lengths)?;
    let holds = written
        .found
        .as_ref()
        .is_none_or(|found| found.holds(&options));
    Ok(match holds {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

/// The program with the calls of its subprograms written out, if it has any.
fn inlined(path: &Path, dialect: Dialect) -> Result<Option<Inlined>, BadInput> {
    let unreadable = |error| bad_program(path, &StreamError::Read(error));
    if !dialect.table().calls || !subprograms::calls(open(path)?, dialect).map_err(unreadable)? {
        return Ok(None);
    }
    let mut text = Vec::new();
    open(path)?.read_to_end(&mut text).map_err(unreadable)?;
    let inlined = subprograms::inline(&text, dialect);
    inlined
        .map(Some)
        .map_err(|refusal| bad_program(path, &refusal.into()))
}

/// A program to be corrected.
struct ReadProgram<'a> {
    arguments: &'a Arguments,
    job: Job<'a>,
    /// Without the calls of its subprograms, if it has any.
    inlined: Option<Inlined>,
}

/// A program that has been corrected.
struct WrittenProgram {
    report: Report,
    /// What the check found, if one was asked for.
    found: Option<CheckResult>,
    /// The check failed, and the program is as it was.
    withheld: bool,
}

impl ReadProgram<'_> {
    /// The text without calls.
    fn open(&self) -> Result<Box<dyn BufRead + '_>, BadInput> {
        Ok(match &self.inlined {
            Some(inlined) => Box::new(inlined.text.as_slice()),
            None => Box::new(open(&self.arguments.program)?),
        })
    }

    /// What is wrong with the program, at its own lines.
    fn bad(&self, error: &StreamError) -> BadInput {
        let program = &self.arguments.program;
        match (&self.inlined, error) {
            (Some(inlined), StreamError::Refused(refusal)) => {
                bad_program(program, &inlined.refusal(refusal).into())
            }
            _ => bad_program(program, error),
        }
    }

    /// Refuses a program that computes: that is what is said of it, whatever else is refused before.
    fn computes(&self) -> Result<(), BadInput> {
        let done = stream::look_for_computing(self.open()?, self.job.rules.dialect);
        done.map_err(|error| self.bad(&error))
    }

    /// Why the program cannot be corrected.
    fn refused(&self, error: &StreamError) -> BadInput {
        match error {
            StreamError::Refused(_) => self.computes().err(),
            _ => None,
        }
        .unwrap_or_else(|| self.bad(error))
    }

    /// Corrects the program into its file, which gets its name once the check, if one was asked for, has passed.
    fn write(&self, mark: String) -> Result<WrittenProgram, BadInput> {
        let (arguments, output) = (self.arguments, self.arguments.output());
        let mut corrector = self.corrector(mark)?;
        let reader = self.open()?;
        let map = RefCell::new(self.map_of_lines()?);
        let refusal = RefCell::new(None);
        let (mut found, mut withheld) = (None, false);
        let write = |file: &mut replace::NewContent<'_>| {
            let done = self.correct(reader, file, map.borrow_mut().as_mut(), &mut corrector);
            let done = done.map_err(|error| self.refused(&error));
            done.and_then(|()| self.is_corrected(&corrector.report))
                .map_err(|error| {
                    refusal.replace(Some(error));
                    std::io::Error::other("the program is refused")
                })
        };
        // What the check cannot make sense of never gets its name, nor the name of the program if the check fails.
        let accept = |corrected: &File| {
            let mut map = map.borrow_mut();
            let Some(map) = &mut *map else {
                return Ok(());
            };
            match self.check(corrected, map.read()?) {
                Ok(checked) => {
                    withheld = arguments.in_place && !checked.holds(&self.job.options);
                    found = Some(checked);
                }
                Err(error) => _ = refusal.replace(Some(error)),
            }
            match withheld || refusal.borrow().is_some() {
                false => Ok(()),
                true => Err(std::io::Error::other("the check fails")),
            }
        };
        let done = replace::replace_by(output, write, accept);
        if let Some(refusal) = refusal.into_inner() {
            return Err(refusal);
        }
        if !withheld {
            done.map_err(|error| not_written(output, &error))?;
        }
        if arguments.check && found.is_none() {
            return Err(BadInput::new(
                format!("--check: {} cannot be read back", output.display()),
                "write into a file",
            ));
        }
        if let Some(inlined) = &self.inlined {
            inlined.relabel(&mut corrector.report, found.as_mut());
        }
        Ok(WrittenProgram {
            report: corrector.report,
            found,
            withheld,
        })
    }

    /// Refuses a program whose motions all pass without correction: it would be marked as corrected.
    fn is_corrected(&self, report: &Report) -> Result<(), BadInput> {
        if report.moves > 0 || report.passed.is_empty() {
            return Ok(());
        }
        let passed = report
            .passed
            .iter()
            .map(|(what, times)| format!("{what} ({times} times)"));
        let passed: Vec<String> = passed.collect();
        Err(BadInput::new(
            format!(
                "{}: nothing of it can be corrected: {}",
                self.arguments.program.display(),
                passed.join(", ")
            ),
            "check that machine and compensation are those of the program, or let it move all axes to a known position first",
        ))
    }

    fn corrector(&self, mark: String) -> Result<Corrector<'_>, BadInput> {
        self.job.corrector(mark).or_else(|cause| {
            self.computes()?;
            Err(BadInput::new(
                cause,
                "see the setup in the example of trueaxis gcode --help",
            ))
        })
    }

    /// Which lines of the corrected program belong to which of the program: the check needs it.
    fn map_of_lines(&self) -> Result<Option<Scratch>, BadInput> {
        let scratch = self.arguments.check.then(Scratch::new).transpose();
        scratch.map_err(|error| {
            BadInput::new(
                format!("a temporary file cannot be made: {error}"),
                "check the folder of temporary files, or leave out --check",
            )
        })
    }

    /// Corrects from one file into another, with the map of its lines.
    fn correct(
        &self,
        reader: Box<dyn BufRead + '_>,
        file: &mut replace::NewContent<'_>,
        map: Option<&mut Scratch>,
        corrector: &mut Corrector<'_>,
    ) -> Result<(), StreamError> {
        let bytes = match &self.inlined {
            Some(inlined) => inlined.text.len() as u64,
            None => std::fs::metadata(&self.arguments.program).map_or(0, |m| m.len()),
        };
        let bar = ProgressBarOnScreen::new();
        bar.stage("MB corrected", (bytes >> 20) as usize);
        let (done, written) = ahead(file, |file| {
            let mut before = 0_u64;
            let seen = |read| {
                if (before + read) >> 20 != before >> 20 {
                    bar.step();
                }
                before += read;
            };
            match map {
                Some(map) => stream::correct(reader, file, map, corrector, seen),
                None => stream::correct(reader, file, &mut std::io::sink(), corrector, seen),
            }
        });
        written.map_err(StreamError::Write).and(done)
    }

    fn check(&self, corrected: &File, map: impl Read) -> Result<CheckResult, BadInput> {
        let corrected = Corrected {
            text: BufReader::with_capacity(1 << 18, corrected),
            map,
        };
        self.job.check(self.open()?, corrected).map_err(|error| {
            BadInput::new(
                format!("{}: {error}", self.arguments.output().display()),
                "nothing is written; this is a mistake of trueaxis: please report it with the program",
            )
        })
    }

    /// Prints what was done.
    fn show(
        &self,
        written: &WrittenProgram,
        compensation: &trueaxis::Largest<'_>,
        lengths: &screen::Lengths,
    ) -> Result<(), BadInput> {
        let output = self.arguments.output();
        let (report, found) = (&written.report, written.found.as_ref());
        if written.withheld {
            eprintln!(
                "warning: {}: the check fails, and the program is unchanged",
                output.display()
            );
        }
        if let Some(warning) = lengths.warning(found) {
            eprintln!("warning: {warning}");
        }
        if self.arguments.json {
            let answer = screen::Answer::new(output, report, compensation, lengths, found);
            return output::print_json(&answer);
        }
        if let Some(inlined) = &self.inlined {
            output::print(&format!(
                "subprograms are written out where they are called: {} lines\n",
                inlined.lines()
            ))?;
        }
        output::print(&screen::report(output, report, &self.job.options))?;
        output::print(&lengths.note())?;
        match found {
            Some(found) => output::print(&screen::check(found, &self.job.options)),
            None => Ok(()),
        }
    }
}
