//! `trueaxis gcode`

#[cfg_attr(target_family = "wasm", path = "gcode/ahead_in_browser.rs")]
mod ahead;
mod arguments;
mod inlined;
mod scratch;
mod screen;

use super::Outcome;
use super::bad_input::BadInput;
use super::files;
use super::progress::ProgressBarOnScreen;
use super::replace;
use ahead::ahead;
pub use arguments::Arguments;
use scratch::Scratch;
use std::cell::RefCell;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use trueaxis_gcode::check::{self, Corrected, Exact};
use trueaxis_gcode::stream::{self, StreamError};
use trueaxis_gcode::{Corrector, Report, Tables, Tip};
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::Progress;
use trueaxis_tables::validate::Runtime;

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
        StreamError::Write(_) => {
            "give a name in an existing folder with write permission and room; an old file of this name is unchanged"
        }
    };
    BadInput::new(format!("{}: {error}", path.display()), remedy)
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    if files::is_screen(arguments.output()) {
        return Err(BadInput::new(
            "-o -: a program is read back and checked after it is written, and does not go to the screen",
            "give -o the name of a file",
        ));
    }
    files::prepare(arguments.output(), &arguments.inputs())?;
    let options = arguments.options()?;
    let blob = files::read_blob(&arguments.compensation)?;
    let runtime =
        Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, &arguments.compensation))?;
    let compensation = runtime.compensation();
    let tables = Tables::new(compensation).map_err(|cause| {
        BadInput::new(
            format!("{}: {cause}", arguments.compensation.display()),
            "use this compensation in the controller",
        )
    })?;
    let machine = match &arguments.machine {
        Some(path) => Some(files::read_machine(path)?),
        None => None,
    };
    if let (Some(machine), Some(path)) = (&machine, &arguments.machine) {
        fits(machine, compensation, path)?;
    }
    let tip = machine.as_ref().map(Tip::new);
    let no_tip = tip.as_ref().and_then(|tip| tip.as_ref().err().cloned());
    let tip = match (tip, arguments.tcp) {
        (Some(Err(cause)), true) => {
            return Err(BadInput::new(
                format!("--tcp: {cause}"),
                "describe the machine in the workpiece frame that the controller uses, or post the program without tool-centre-point control",
            ));
        }
        (Some(tip), _) => tip.ok(),
        (None, _) => None,
    };
    let mut rules = arguments.rules(arguments.read_setup()?, &tables);
    rules.has_machine = tip.is_some();
    rules.no_tip = no_tip;
    rules.machine = compensation.machine().to_owned();
    let bar = ProgressBarOnScreen::new();
    let inlined = inlined::Program::new(arguments, &rules)?;
    let program = match &inlined {
        Some(inlined) => inlined.path(),
        None => arguments.program.as_path(),
    };
    let bad_program = |error: &StreamError| {
        let refusal = match (&inlined, error) {
            (Some(inlined), StreamError::Refused(refusal)) => inlined.refusal(refusal),
            _ => return bad_program(&arguments.program, error),
        };
        bad_program(&arguments.program, &StreamError::Refused(refusal))
    };
    let bytes = std::fs::metadata(program).map_or(0, |m| m.len());
    // Where a program computes that is what is said of it, whatever else is refused before.
    let computes = || -> Result<(), BadInput> {
        let done = stream::look_for_computing(open(program)?, rules.dialect);
        done.map_err(|error| bad_program(&error))
    };
    let mark = arguments.mark(&blob, compensation, &tables)?;
    let mut corrector = match Corrector::new(&rules, &tables, tip.as_ref(), options, Some(mark)) {
        Ok(corrector) => corrector,
        Err(cause) => {
            computes()?;
            return Err(BadInput::new(
                cause,
                "see the setup in the example of trueaxis gcode --help",
            ));
        }
    };
    let errors = match (&arguments.errors, &machine) {
        (Some(path), Some(machine)) if arguments.check => Some(files::read_errors(path, machine)?),
        _ => None,
    };
    let exact = machine.as_ref().zip(errors.as_ref());
    let exact = exact.map(|(machine, errors)| Exact { machine, errors });
    bar.stage("MB corrected", (bytes >> 20) as usize);
    let reader = open(program)?;
    let map = match arguments.check {
        true => Some(Scratch::new().map_err(|error| {
            BadInput::new(
                format!("a temporary file cannot be made: {error}"),
                "check the folder of temporary files, or leave out --check",
            )
        })?),
        false => None,
    };
    let map = RefCell::new(map);
    let mut failed = None;
    let mut bad = None;
    let mut found = None;
    let mut seen = 0_u64;
    let write = |file: &mut replace::NewContent<'_>| {
        let (done, written) = ahead(file, |file| {
            let seen = |read| {
                if (seen + read) >> 20 != seen >> 20 {
                    bar.step();
                }
                seen += read;
            };
            match &mut *map.borrow_mut() {
                Some(map) => stream::correct(reader, file, map, &mut corrector, seen),
                None => stream::correct(reader, file, &mut std::io::sink(), &mut corrector, seen),
            }
        });
        let done = written.map_err(StreamError::Write).and(done);
        done.map_err(|error| {
            failed = Some(error);
            std::io::Error::other("the program is refused")
        })
    };
    let mut withheld = false;
    // What the check cannot make sense of never gets its name, nor the name of the program if the check fails.
    let accept = |corrected: &File| {
        let mut map = map.borrow_mut();
        let Some(map) = &mut *map else {
            return Ok(());
        };
        let map = map.read()?;
        let checked = open(program).and_then(|original| {
            let corrected = Corrected {
                text: BufReader::with_capacity(1 << 18, corrected),
                map,
            };
            let tip = tip.as_ref();
            check::check(original, corrected, &rules, &tables, tip, exact.as_ref(), options)
                .map_err(|error| {
                    BadInput::new(
                        format!("{}: {error}", arguments.output().display()),
                        "nothing is written; this is a mistake of trueaxis: please report it with the program",
                    )
                })
        });
        match checked {
            Ok(checked) => {
                withheld = arguments.in_place && !checked.holds(&options);
                found = Some(checked);
            }
            Err(error) => bad = Some(error),
        }
        match (&bad, withheld) {
            (None, false) => Ok(()),
            _ => Err(std::io::Error::other("the check fails")),
        }
    };
    let done = replace::replace_by(arguments.output(), write, accept);
    drop(bar);
    if let Some(error) = bad {
        return Err(error);
    }
    if let Some(error) = failed {
        if matches!(error, StreamError::Refused(_)) {
            computes()?;
        }
        return Err(bad_program(&error));
    }
    let done = if withheld { Ok(()) } else { done };
    done.map_err(|error| {
        BadInput::new(
            format!("{}: cannot be written: {error}", arguments.output().display()),
            "give a name in an existing folder with write permission and room; an old file of this name is unchanged",
        )
    })?;
    if arguments.check && found.is_none() {
        return Err(BadInput::new(
            format!(
                "--check: {} cannot be read back",
                arguments.output().display()
            ),
            "write into a file",
        ));
    }
    if let Some(inlined) = &inlined {
        inlined.relabel(&mut corrector.report, found.as_mut());
    }
    let report: &Report = &corrector.report;
    let holds = found.as_ref().is_none_or(|found| found.holds(&options));
    let lengths = screen::Lengths::new(report, &tables, machine.as_ref());
    if withheld {
        eprintln!(
            "warning: {}: the check fails, and the program is unchanged",
            arguments.output().display()
        );
    }
    if let Some(warning) = lengths.warning(found.as_ref()) {
        eprintln!("warning: {warning}");
    }
    if arguments.json {
        let answer = screen::Answer::new(
            arguments.output(),
            report,
            compensation,
            &lengths,
            found.as_ref(),
        );
        files::print_json(&answer)?;
    } else {
        if let Some(inlined) = &inlined {
            files::print(&inlined.note())?;
        }
        files::print(&screen::report(arguments.output(), report, &options))?;
        files::print(&lengths.note())?;
        if let Some(found) = &found {
            files::print(&screen::check(found, &options))?;
        }
    }
    Ok(match holds {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    })
}

/// The machine must be the one of the compensation.
fn fits(
    machine: &Machine,
    compensation: &trueaxis::Largest<'_>,
    path: &Path,
) -> Result<(), BadInput> {
    let same = machine.axes.len() == compensation.axes().len()
        && machine
            .axes
            .iter()
            .zip(compensation.axes())
            .all(|(a, b)| a.letter.char() as u8 == b.name)
        && machine.name == compensation.machine();
    if same {
        return Ok(());
    }
    Err(BadInput::new(
        format!(
            "{}: this is `{}`, the compensation is for `{}`, or their axes differ",
            path.display(),
            machine.name,
            compensation.machine()
        ),
        "give the machine file from which the compensation was compiled",
    ))
}
