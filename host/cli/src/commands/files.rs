//! Reading files.

use super::bad_input::BadInput;
use clap::Args;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use trueaxis::{AlignedBlob, LARGEST_BLOB};
use trueaxis_direct::counted_twice;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::{self, Observations};
use trueaxis_identify::formats::probings::{self, Probings};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::FileError;
use trueaxis_probing::probe_file::ProbeFile;
use trueaxis_report as report;

/// A text file with its name.
pub struct Text {
    /// The name as the user gave it.
    pub name: String,
    pub text: String,
}

impl Text {
    /// Reads a whole file.
    pub fn read(path: &Path) -> Result<Self, BadInput> {
        let name = path.display().to_string();
        let bytes = read_bytes(path)?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..valid]
                .iter()
                .filter(|b| **b == b'\n')
                .count()
                + 1;
            if error.as_bytes().starts_with(b"PK") || error.as_bytes().starts_with(b"\xD0\xCF") {
                return BadInput::new(
                    format!("{name} is a workbook of a spreadsheet program, or a packed file"),
                    "save the sheet as CSV, with commas between columns and decimal points",
                );
            }
            BadInput::new(
                format!("{name}, line {line}: this is not UTF-8 text"),
                "save the file as UTF-8 text",
            )
        })?;
        Ok(Self { name, text })
    }

    /// The path of a file that this one refers to.
    pub fn beside(&self, name: &str) -> String {
        let folder = Path::new(&self.name).parent().unwrap_or(Path::new(""));
        folder.join(name).display().to_string()
    }

    /// The file and line of an error.
    pub fn place(&self, error: &FileError) -> String {
        match error.line(&self.text) {
            Some(line) => format!("{}, line {line}", self.name),
            None => self.name.clone(),
        }
    }

    /// Shows an error at its place in this text, or in another file that this one refers to.
    pub fn bad(&self, error: FileError) -> BadInput {
        let within = error.within.as_deref().map(|other| Self {
            name: self.beside(&other.name),
            text: other.text.clone(),
        });
        let shown = within.as_ref().unwrap_or(self);
        let place = shown.place(&error);
        BadInput::in_text(error, &place, &shown.name, &shown.text)
    }
}

/// Largest input file, in bytes, that is read as a whole.
const LARGEST: u64 = LARGEST_BLOB as u64;

/// Reads a file. Fails with [`ErrorKind::FileTooLarge`] before reading if it has more than [`LARGEST`] bytes.
fn bounded(path: &Path) -> std::io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let mut bytes = Vec::new();
    // A pipe has no length.
    if file.metadata()?.len() <= LARGEST {
        file.take(LARGEST + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 <= LARGEST {
            return Ok(bytes);
        }
    }
    let most = format!("it is larger than {} MiB", LARGEST >> 20);
    Err(std::io::Error::new(ErrorKind::FileTooLarge, most))
}

/// Reads a whole file of at most [`LARGEST`] bytes.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, BadInput> {
    bounded(path).map_err(|error| {
        let remedy = match error.kind() {
            ErrorKind::NotFound => "check the path; files are looked for from the current folder",
            ErrorKind::PermissionDenied => "make the file readable",
            ErrorKind::FileTooLarge => "check that this is the right file; no input is that large",
            _ => "give the path of a readable file",
        };
        let cause = match missing_folder(path) {
            Some(folder) => format!("there is no folder {}", folder.display()),
            None => error.to_string(),
        };
        BadInput::new(
            format!("{}: cannot be read: {cause}", path.display()),
            remedy,
        )
    })
}

/// The folder of a path, if it does not exist.
pub fn missing_folder(path: &Path) -> Option<&Path> {
    let folder = path.parent()?;
    (!folder.as_os_str().is_empty() && !folder.exists()).then_some(folder)
}

/// Reads a blob into memory aligned as in flash.
pub fn read_blob(path: &Path) -> Result<AlignedBlob, BadInput> {
    Ok(AlignedBlob::from_bytes(&read_bytes(path)?))
}

/// An input file as listed in a report.
pub fn described(role: &str, path: &Path) -> Result<report::DescribedFile, BadInput> {
    let name = path.display().to_string();
    Ok(report::DescribedFile::new(role, &name, &read_bytes(path)?))
}

/// The two files that describe a machine.
#[derive(Args)]
pub struct MachineFiles {
    /// Machine description (machine.toml)
    pub machine: PathBuf,
    /// Error parameters (errors.toml)
    pub errors: PathBuf,
}

impl MachineFiles {
    /// Reads and validates both files.
    pub fn read(&self) -> Result<(Machine, ErrorModel), BadInput> {
        let machine = read_machine(&self.machine)?;
        let errors = read_errors(&self.errors, &machine)?;
        Ok((machine, errors))
    }
}

/// Reads and validates a machine description, and warns about unlikely values.
pub fn read_machine(path: &Path) -> Result<Machine, BadInput> {
    machine_in(&Text::read(path)?)
}

/// Like `read_machine`, of a text that may not be written yet.
pub fn machine_in(text: &Text) -> Result<Machine, BadInput> {
    let machine = Machine::from_toml(&text.text).map_err(|e| text.bad(e))?;
    for doubt in Machine::doubts(&text.text) {
        eprintln!("warning: {}: {}", text.place(&doubt), doubt.message);
        eprintln!("  {}", doubt.remedy);
    }
    Ok(machine)
}

/// Reads the positions of an artefact's balls.
pub fn read_artefact(path: &Path, machine: &Machine) -> Result<Artefact, BadInput> {
    let text = Text::read(path)?;
    Artefact::from_toml(&text.text, machine.tool_axis).map_err(|e| text.bad(e))
}

/// Reads a qualified probe.
pub fn read_probe(path: &Path, machine: &Machine) -> Result<ProbeFile, BadInput> {
    let text = Text::read(path)?;
    ProbeFile::from_toml(&text.text, machine).map_err(|e| text.bad(e))
}

/// Reads a plan: which ball is probed at which rotary positions.
pub fn read_plan(path: &Path, machine: &Machine) -> Result<Probings, BadInput> {
    let text = Text::read(path)?;
    probings::read(&text.text, machine, false).map_err(|e| text.bad(e))
}

/// Reads observations of any kind from several files; set-ups have the name of their file if it does not name them.
pub fn read_observations(paths: &[PathBuf], machine: &Machine) -> Result<Observations, BadInput> {
    of_instruments(paths, machine, observations::read)
}

/// Like `read_observations`, of plans, which may lack readings.
pub fn read_instruments(paths: &[PathBuf], machine: &Machine) -> Result<Observations, BadInput> {
    of_instruments(paths, machine, observations::read_plan)
}

fn of_instruments(
    paths: &[PathBuf],
    machine: &Machine,
    read: fn(&str, &str, &Machine) -> Result<Observations, FileError>,
) -> Result<Observations, BadInput> {
    let mut all = Observations::default();
    for path in paths {
        let text = Text::read(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let one = read(&text.text, &name, machine).map_err(|e| text.bad(e))?;
        all.add(one).map_err(|(message, remedy)| {
            BadInput::new(format!("{}: {message}", text.name), remedy)
        })?;
    }
    Ok(all)
}

/// The files that error files refer to, as far as these were read: tables that were measured, covariances.
static REFERRED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn referred() -> MutexGuard<'static, Vec<PathBuf>> {
    REFERRED.lock().unwrap_or_else(PoisonError::into_inner)
}

fn refers_to(path: &Path) {
    referred().extend(path.canonicalize());
}

/// True for a file that an error file refers to.
pub fn is_referred(path: &Path) -> bool {
    let real = path.canonicalize();
    real.is_ok_and(|path| referred().contains(&path))
}

/// Takes a file out of those that an error file refers to, because that error file is written anew together with it.
pub fn is_renewed(path: &Path) {
    let path = path.canonicalize().ok();
    referred().retain(|other| Some(other) != path.as_ref());
}

/// Reads and validates the errors of a machine, and warns about errors that are counted twice.
pub fn read_errors(path: &Path, machine: &Machine) -> Result<ErrorModel, BadInput> {
    let errors = read_known_errors(path, machine)?;
    let doubts = match errors.slopes_beside_squareness {
        true => Vec::new(),
        false => counted_twice(machine, &errors),
    };
    for doubt in doubts {
        eprintln!("warning: {}: {doubt}", path.display());
        eprintln!("  {}", doubt.remedy);
    }
    Ok(errors)
}

/// Like `read_errors`, without warnings, for callers that issue their own.
pub fn read_known_errors(path: &Path, machine: &Machine) -> Result<ErrorModel, BadInput> {
    let text = Text::read(path)?;
    let read = |name: &str| {
        let path = text.beside(name);
        refers_to(Path::new(&path));
        let measured = Text::read(Path::new(&path));
        measured
            .map(|measured| measured.text)
            .map_err(|bad| bad.to_string())
    };
    ErrorModel::with_files(&text.text, machine, &read).map_err(|e| text.bad(e))
}

/// Refuses to update an error file with thermal changes, which could not be written back.
pub fn to_update(errors: ErrorModel, path: &Path, verb: &str) -> Result<ErrorModel, BadInput> {
    let mut motions = errors.motions.iter().flatten();
    if motions.any(|m| !m.thermal.is_empty()) || !errors.inter_thermal.is_empty() {
        let what = "thermal changes cannot be kept by --update";
        return Err(BadInput::new(
            format!("{}: {what}", path.display()),
            format!("{verb} without --update, and copy what was written into the file"),
        ));
    }
    Ok(errors)
}
