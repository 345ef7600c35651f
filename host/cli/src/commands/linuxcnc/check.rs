//! `trueaxis linuxcnc check`

use super::configuration;
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files;
use crate::commands::output;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_linuxcnc::{Against, Configuration, Finding, Severity, check, unfit, unsuited};
use trueaxis_model::validate::Runtime;

/// Check whether a compensation fits the configuration of LinuxCNC
///
/// Reads the INI file and the HAL files that it names. Reports what must be changed and what should be checked:
/// joints that are compensated twice, limits, headroom of step generators, functions in the wrong order,
/// connections, axes and kinematics. Exits with 1 if something must be changed. Changes no files.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis linuxcnc check mill.ini mill.trax --machine machine.toml\n\n\
HAL files that are programs (.tcl) are refused, unless --running reads the HAL that runs."
)]
pub struct Arguments {
    /// The INI file of the machine
    #[arg(value_name = "MACHINE.ini")]
    ini: PathBuf,
    /// The compensation
    #[arg(value_name = "FILE.trax")]
    blob: PathBuf,
    /// Machine description from which it was compiled: compares its axis locations with the kinematics
    #[arg(long, value_name = "machine.toml")]
    machine: Option<PathBuf>,
    /// Read the HAL that runs instead of the HAL files: for those that are programs (.tcl)
    #[arg(long)]
    running: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct CheckAnswer<'a> {
    file: &'a Path,
    compensation: &'a Path,
    refused: usize,
    warnings: usize,
    findings: &'a [Finding],
    /// What to do next.
    next: String,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let Arguments {
        ini, blob: path, ..
    } = arguments;
    let configuration = configuration::read_running(ini, arguments.running)?;
    let findings = findings(ini, &configuration, path, arguments.machine.as_deref())?;
    let count = |severity| findings.iter().filter(|f| f.severity == severity).count();
    let (refused, warnings) = (count(Severity::Refused), count(Severity::Warning));
    let next = next(arguments, &configuration, refused);
    if arguments.json {
        output::print_json(&CheckAnswer {
            file: ini,
            compensation: path,
            refused,
            warnings,
            findings: &findings,
            next,
        })?;
    } else {
        let mut text = String::new();
        for finding in &findings {
            text += &format!("{finding}\n");
        }
        text += &format!(
            "{}: {refused} refused, {warnings} warnings{}\nnext: {next}\n",
            ini.display(),
            match findings.is_empty() {
                true => String::new(),
                false => format!("; {}", configuration::version()),
            }
        );
        output::print(&text)?;
    }
    Ok(match refused {
        0 => Outcome::Done,
        _ => Outcome::CheckFailed,
    })
}

/// Compares a configuration with a compensation, and with the machine for which it was compiled.
pub fn findings(
    ini: &Path,
    configuration: &Configuration,
    path: &Path,
    machine: Option<&Path>,
) -> Result<Vec<Finding>, BadInput> {
    let blob = files::read_blob(path)?;
    let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
    let machine = match machine {
        Some(path) => Some(files::read_machine(path)?),
        None => None,
    };
    let folder = configuration::folder(ini);
    let is_file = |named: &str| {
        let [a, b] = [folder.join(named), path.to_owned()].map(|p| p.canonicalize().ok());
        Some(a? == b?)
    };
    let against = Against {
        runtime: &runtime,
        is_file: &is_file,
        machine: machine.as_ref(),
    };
    Ok(check(configuration, against))
}

/// What to do after this check.
fn next(arguments: &Arguments, configuration: &Configuration, refused: usize) -> String {
    let Arguments { ini, blob, .. } = arguments;
    let again = |machine: Option<&Path>| {
        let machine = machine.map(|path| format!(" --machine {}", path.display()));
        let (ini, blob, machine) = (ini.display(), blob.display(), machine.unwrap_or_default());
        format!("trueaxis linuxcnc check {ini} {blob}{machine}")
    };
    let given = arguments.machine.as_deref();
    if let Some(unfit) = unfit(configuration).first() {
        return unfit.write.clone();
    }
    if !unsuited(configuration).is_empty() {
        return format!("correct the errors above, then {}", again(given));
    }
    if configuration.hal.load("trueaxis").is_none() {
        return match ini.with_file_name("trueaxis.hal").exists() {
            true => format!(
                "write HALFILE = trueaxis.hal below [HAL], then {}",
                again(given)
            ),
            false => format!(
                "trueaxis linuxcnc setup {} -o {} --install",
                ini.display(),
                configuration::folder(ini).display()
            ),
        };
    }
    if refused > 0 {
        return format!("correct the errors above, then {}", again(given));
    }
    let described = ini.with_file_name("machine.toml");
    if given.is_none() && described.exists() {
        return again(Some(&described));
    }
    let ini = ini.display();
    let enable = enable(configuration);
    format!("linuxcnc {ini}, home, look at the corrections, then {enable}")
}

/// How to switch the compensation on.
fn enable(configuration: &Configuration) -> &'static str {
    let mut commands = configuration.ini.all("DISPLAY", "EMBED_TAB_COMMAND");
    match commands.any(|entry| entry.value.contains("trueaxis-panel")) {
        true => "press Enable in the tab Compensation",
        false => "trueaxis control --hal enable",
    }
}
