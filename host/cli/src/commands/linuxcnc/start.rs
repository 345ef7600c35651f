//! `trueaxis linuxcnc start`

mod asked;
mod written;

use super::configuration;
use super::setup::{Changed, name, on_table, with_lines};
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files::{self, Text};
use crate::commands::number::positive;
use crate::commands::output;
use asked::StartSensor;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_direct::{Single, simple_error_file, without_readings};
use trueaxis_linuxcnc::{
    Compensated, Configuration, Finding, Import, MachineFacts, SetupFiles, Severity, beforehand,
    remove, setup, unknown_pivot,
};
use written::StartFiles;

/// Ask for the machine and its measurements, and make a first compensation
///
/// Asks for the INI file, which axes move the table, and for readings of a glass scale, a square and a dial; an empty
/// answer means that there is none. Writes the HAL lines, machine.toml and errors.toml, compiles machine.trax, checks
/// it, writes the INI file last, and ends with the next command. If anything is refused, every file is as it was. Nothing
/// is replaced or written into the INI file before it has asked. Whatever an option says is not asked.
#[derive(Args)]
#[command(after_help = "Examples:\n  trueaxis linuxcnc start\n  \
trueaxis linuxcnc start mill.ini --table XY --scale X=2/100 --square XY=3/100 --dial X=-4 --install --yes\n\n\
Readings are in µm, travels in mm. They are positive where the tool is farther in the direction of a positive command,\n\
seen from the workpiece. X=2/100: a scale along X shows 2 µm too much at +100 mm. XY=3/100: with one leg of a square\n\
aligned with X, a dial moved along the other leg by Y reads 3 µm in the direction of X per 100 mm. X=-4: a dial\n\
reads 4 µm less after positive than after negative travel of X, as lost motion of 4 µm makes it.")]
pub struct Arguments {
    /// The INI file of the machine (default: asked for)
    #[arg(value_name = "MACHINE.ini")]
    ini: Option<PathBuf>,
    /// Linear axes that move the table ('' for none); the others move the spindle
    #[arg(long, value_name = "XY")]
    table: Option<String>,
    /// A glass scale or laser: deviation and travel
    #[arg(long, value_name = "X=µm/mm")]
    scale: Vec<String>,
    /// A square on the table: reading and travel
    #[arg(long, value_name = "XY=µm/mm")]
    square: Vec<String>,
    /// A dial: positive less negative travel
    #[arg(long, value_name = "X=µm", allow_hyphen_values = true)]
    dial: Vec<String>,
    /// A temperature sensor: its name, and the HAL pin with its temperature in °C
    #[arg(long, value_name = "NAME=PIN")]
    temperature: Vec<String>,
    /// Growth of the spindle: how much nearer the nose came to the table, while a sensor of --temperature rose by so much
    /// [from 20 °C]
    #[arg(long, value_name = "NAME=µm/K")]
    growth: Vec<String>,
    /// Balls on the table that can be probed
    #[arg(long, value_name = "artefact.toml")]
    balls: Option<PathBuf>,
    /// Switch the corrections on whenever the axes are homed (default: the operator does)
    #[arg(long)]
    enable_when_homed: bool,
    /// Head of a five-axis mill: from its pivot to the nose of its spindle, in mm
    #[arg(long, value_name = "mm", value_parser = positive)]
    pivot: Option<f64>,
    /// Read the HAL that runs instead of the HAL files: for those that are programs (.tcl)
    #[arg(long)]
    running: bool,
    /// Write the lines for component and panel into the INI file, and take out COMP_FILE and BACKLASH that are now in
    /// errors.toml
    #[arg(long)]
    install: bool,
    /// Take out of the INI file what --install wrote, and put back what it took out; other files stay
    #[arg(long, conflicts_with_all = ["install", "table", "scale", "square", "dial", "balls", "temperature", "growth", "pivot", "running", "enable_when_homed", "overwrite"])]
    remove: bool,
    /// Replace existing files; what they are now stays in ….before-trueaxis
    #[arg(long)]
    overwrite: bool,
    /// Ask nothing: what no option says is not there, existing files stay
    #[arg(long)]
    yes: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let ini = match &arguments.ini {
        Some(ini) => ini.clone(),
        None => arguments.ask_ini()?,
    };
    if arguments.remove {
        return removed(&ini);
    }
    let configuration = configuration::read_running(&ini, arguments.running)?;
    let is_installed = configuration.hal.load("trueaxis").is_some();
    let findings = match is_installed {
        true => Vec::new(),
        false => beforehand(&configuration),
    };
    if is_refused(&findings) {
        return refused(&ini, &findings);
    }
    let joints = configuration.axes();
    let letters: Vec<char> = joints.iter().map(|joint| joint.letter).collect();
    let given = arguments.given(&letters)?;
    let imports = match is_installed {
        true => Vec::new(),
        false => configuration::imported(&ini, &configuration)?,
    };
    let found = FoundConfiguration {
        ini: &ini,
        configuration: &configuration,
        imports: &imports,
        findings: &findings,
    };
    for single in &given {
        found.is_free(&letters, single, None)?;
    }
    arguments.steps(&found)
}

/// Takes the component out of an INI file.
fn removed(ini: &Path) -> Result<Outcome, BadInput> {
    output::prepare(ini, &[])?;
    let text = remove(&Text::read(ini)?.text, HAL).ok_or_else(|| {
        BadInput::new(
            format!("{}: it does not have what --install writes", ini.display()),
            format!("take `{HAL}` out of the file that names it"),
        )
    })?;
    output::write(ini, text.as_bytes())?;
    output::print(&format!(
        "{}: without component and panel; {HAL}, machine.toml, errors.toml and machine.trax are still there\n",
        ini.display()
    ))?;
    Ok(Outcome::Done)
}

/// The HAL lines of the component.
const HAL: &str = "trueaxis.hal";

/// What the configuration says, before anything is written.
struct FoundConfiguration<'f> {
    ini: &'f Path,
    configuration: &'f Configuration,
    imports: &'f [Import],
    findings: &'f [Finding],
}

impl FoundConfiguration<'_> {
    fn compensated(&self) -> Compensated<'_> {
        Compensated {
            configuration: self.configuration,
            imports: self.imports,
        }
    }

    /// Refuses a reading along an axis that is compensated already, also by the errors that are kept.
    fn is_free(
        &self,
        letters: &[char],
        single: &Single,
        kept: Option<&str>,
    ) -> Result<(), BadInput> {
        let Some(axis) = single.along() else {
            return Ok(());
        };
        let accepted = self.compensated().accepts_reading(letters[axis], kept);
        accepted.map_err(|error| BadInput::new(error.error, error.remedy))
    }

    /// The error file to which readings are added.
    fn to_keep(
        &self,
        made: Option<&SetupFiles>,
        old: Option<&Text>,
        errors: &Path,
    ) -> Result<Option<String>, BadInput> {
        let kept = self
            .compensated()
            .to_keep(made, old.map(|old| old.text.as_str()))
            .map_err(|error| {
                BadInput::new(format!("{}: {error}", errors.display()), error.remedy)
            })?;
        // A set-up that is made again has none.
        Ok(kept.map(|text| without_readings(&text)))
    }
}

fn is_refused(findings: &[Finding]) -> bool {
    findings.iter().any(|f| f.severity == Severity::Refused)
}

/// Says why nothing is written.
fn refused(ini: &Path, findings: &[Finding]) -> Result<Outcome, BadInput> {
    let lines: String = findings.iter().map(|f| format!("{f}\n")).collect();
    let (ini, version) = (ini.display(), configuration::version());
    output::print(&format!(
        "{lines}{ini}: every file is as it was; {version}\n"
    ))?;
    Ok(Outcome::CheckFailed)
}

impl Arguments {
    /// Everything after the first look at the configuration: asks, then writes, the INI file last.
    fn steps(&self, found: &FoundConfiguration<'_>) -> Result<Outcome, BadInput> {
        let files = [HAL, "machine.toml", "errors.toml", "machine.trax"]
            .map(|name| found.ini.with_file_name(name));
        let [hal, machine, errors, blob] = &files;
        let (sensors, growths) = self.temperatures()?;
        let made = self.made(found, [hal, machine, errors, blob], &sensors)?;
        let described = files::machine_in(&match &made {
            Some(made) => Text {
                name: machine.display().to_string(),
                text: made.machine.clone(),
            },
            None => Text::read(machine)?,
        })?;
        let old = errors.exists().then(|| Text::read(errors)).transpose()?;
        let kept = found.to_keep(made.as_ref(), old.as_ref(), errors)?;
        let (installs, writes) = self.installs(found, hal)?;
        let singles = self.singles(&described, found, kept.as_deref())?;
        let has_errors = !(singles.is_empty() && growths.is_empty() && found.imports.is_empty());
        let (mut balls, mut text) = (self.balls.clone(), None);
        if has_errors {
            let new = simple_error_file(&described, &singles, &growths, kept)
                .map_err(|error| BadInput::new(error.what, error.remedy))?;
            if made.is_none() {
                let differs = old.as_ref().is_some_and(|old| old.text != new);
                self.may_replace(errors, differs, blob)?;
            }
            text = Some(new);
        } else if balls.is_none() {
            balls = self.ask_balls()?;
        }
        // Nothing is asked from here on.
        let start = StartFiles {
            files: &files,
            made,
            errors: text,
            singles,
            installs,
            writes,
            balls,
        };
        self.write(found, &start)
    }

    /// The INI file with the component, if it is not there yet, and whether it is to be written.
    fn installs(
        &self,
        found: &FoundConfiguration<'_>,
        hal: &Path,
    ) -> Result<(Option<Changed>, bool), BadInput> {
        if found.configuration.hal.load("trueaxis").is_some() {
            return Ok((None, false));
        }
        // The error file has all of them.
        let lines = found
            .imports
            .iter()
            .flat_map(|i| i.lines(found.configuration));
        let taken_out: Vec<usize> = lines.collect();
        let changed = with_lines(found.ini, hal, &taken_out)?;
        let writes = match self.install {
            true => true,
            false => self.agrees(&format!(
                "Write the lines for component and panel into {0}? What it is now stays in {1}.",
                found.ini.display(),
                changed.copy.display()
            ))?,
        };
        Ok((Some(changed), writes))
    }

    /// Refuses to replace errors that differ, or a compensation, unless that is wanted.
    fn may_replace(&self, errors: &Path, differs: bool, blob: &Path) -> Result<(), BadInput> {
        let file = match (differs, blob.exists()) {
            (true, _) => errors.display(),
            (false, true) => blob.display(),
            (false, false) => return Ok(()),
        };
        match self.overwrite || self.agrees(&format!("{file} exists. Replace it?"))? {
            true => Ok(()),
            false => Err(BadInput::new(
                format!("{file} exists: it was not replaced, and nothing was compiled"),
                "give --overwrite, or compile errors.toml with `trueaxis compile` into another file",
            )),
        }
    }

    /// Whether HAL lines and a first machine file are to be written, because they are missing or may be replaced.
    fn replaces(
        &self,
        found: &FoundConfiguration<'_>,
        files: [&Path; 4],
    ) -> Result<bool, BadInput> {
        if found.configuration.hal.load("trueaxis").is_some() {
            return Ok(false);
        }
        let Some(first) = files.iter().find(|path| path.exists()) else {
            return Ok(true);
        };
        let question = format!(
            "{} exists. Replace it, and what belongs to it?",
            first.display()
        );
        if self.overwrite || self.agrees(&question)? {
            return Ok(true);
        }
        match files[0].exists() && files[1].exists() {
            true => Ok(false),
            false => Err(BadInput::new(
                format!("{} exists: nothing was written", first.display()),
                "move it away, or give --overwrite",
            )),
        }
    }

    /// HAL lines, a first machine file, and what LinuxCNC compensates, unless these files stay.
    fn made(
        &self,
        found: &FoundConfiguration<'_>,
        files: [&Path; 4],
        sensors: &[StartSensor],
    ) -> Result<Option<SetupFiles>, BadInput> {
        if !self.replaces(found, files)? {
            return match sensors.is_empty() {
                true => Ok(None),
                false => Err(BadInput::new(
                    format!("{}: it stays, and has no --temperature", files[0].display()),
                    "take the component out with --remove if it is in the INI file, then give --overwrite",
                )),
            };
        }
        let configuration = found.configuration;
        let answer = match &self.table {
            Some(table) => Some(table.clone()),
            None => {
                let which = "Which linear axes move the table (the others move the spindle; - for none)? [XY]";
                let answer = self.ask(which)?;
                (!answer.is_empty()).then(|| answer.replace('-', ""))
            }
        };
        let table = answer.map(|table| on_table(configuration, &table));
        let table = table.transpose()?;
        let pivot = self.pivot_of(configuration)?;
        let pins: Vec<String> = sensors.iter().map(|sensor| sensor.pin.clone()).collect();
        let known = MachineFacts {
            temperatures: &pins,
            name: &name(configuration, None),
            blob: "machine.trax",
            table: table.as_deref(),
            enabled: self.enable_when_homed,
            pivot,
        };
        let files = setup(configuration, known, found.imports, found.findings);
        Ok(Some(files))
    }

    /// The distance from pivot to nose, where the configuration has none.
    fn pivot_of(&self, configuration: &Configuration) -> Result<Option<f64>, BadInput> {
        let Some(unknown) = unknown_pivot(configuration) else {
            return Ok(None);
        };
        if self.pivot.is_some() {
            return Ok(self.pivot);
        }
        let question = format!("{unknown}.\nFrom the pivot to the nose of the spindle, mm:");
        let pivot = positive(&self.ask(&question)?);
        let pivot =
            pivot.map_err(|_| BadInput::new(unknown, "measure it, and give --pivot in mm"))?;
        Ok(Some(pivot))
    }
}
