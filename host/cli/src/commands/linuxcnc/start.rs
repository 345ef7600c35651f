//! `trueaxis linuxcnc start`

use super::check;
use super::configuration;
use super::kept_files::KeptFiles;
use super::setup::{Changed, name, on_table, with_lines_without};
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::compile;
use crate::commands::files::{self, MachineFiles, Text};
use crate::commands::number::positive;
use crate::commands::quantity::count;
use clap::Args;
use std::fmt::Write;
use std::io::BufRead;
use std::path::{Path, PathBuf};
use trueaxis_controllers::linuxcnc::{
    Compensated, Configuration, Finding, Import, MachineFacts, SetupFiles, Severity, beforehand,
    remove, setup, unknown_pivot,
};
use trueaxis_measure::direct::{Growth, ReadingError, Single, simple_error_file, without_readings};
use trueaxis_model::machine::Machine;
use trueaxis_tables::compile::Proof;
use trueaxis_tables::made::Made;
use trueaxis_tables::target::Target;

/// Ask for the machine and its measurements, and make a first compensation
///
/// Asks for the INI file, which axes move the table, and for readings of a glass scale, a square and a dial; an empty
/// answer means that there is none. Writes the HAL lines, machine.toml and errors.toml, compiles machine.trax, checks
/// it, writes the INI file last, and ends with the next command. If anything is refused, every file is as it was. Nothing
/// is replaced or written into the INI file before it has asked. Whatever an option says is not asked.
#[derive(Args)]
#[command(after_help = "Examples:\n  trueaxis linuxcnc start\n  \
trueaxis linuxcnc start mill.ini --table XY --scale X=2/100 --square XY=3/100 --dial X=4 --install --yes\n\n\
Readings are in µm, travels in mm. They are positive where the tool is farther in the direction of a positive command,\n\
seen from the workpiece. X=2/100: a scale along X shows 2 µm too much at +100 mm. XY=3/100: with one leg of a square\n\
aligned with X, a dial moved along the other leg by Y reads 3 µm in the direction of X per 100 mm. X=4: a dial reads\n\
4 µm more after positive than after negative travel of X.")]
pub struct Arguments {
    /// The INI file of the machine (default: asked for)
    #[arg(value_name = "MACHINE.ini")]
    ini: Option<PathBuf>,
    /// Linear axes that move the table; the others move the spindle
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
    files::prepare(ini, &[])?;
    let text = remove(&Text::read(ini)?.text, HAL).ok_or_else(|| {
        BadInput::new(
            format!("{}: it does not have what --install writes", ini.display()),
            format!("take `{HAL}` out of the file that names it"),
        )
    })?;
    files::write(ini, text.as_bytes())?;
    files::print(&format!(
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
        let spoilt = self.compensated().spoils(letters[axis], kept);
        spoilt.map_err(|error| BadInput::new(error.to_string(), error.remedy()))
    }

    /// The error file to which readings are added.
    fn to_keep(
        &self,
        made: Option<&SetupFiles>,
        old: Option<&Text>,
        errors: &Path,
    ) -> Result<Option<String>, BadInput> {
        let of_setup = made.map(|made| made.errors.as_deref());
        let kept = self
            .compensated()
            .to_keep(of_setup, old.map(|old| old.text.as_str()))
            .map_err(|error| {
                BadInput::new(format!("{}: {error}", errors.display()), error.remedy())
            })?;
        // A set-up that is made again has none.
        Ok(kept.map(|text| without_readings(&text)))
    }
}

/// What is written, and where.
struct StartFiles<'s> {
    /// HAL lines, machine, errors, compensation.
    files: &'s [PathBuf; 4],
    /// HAL lines and machine, unless those that are there stay.
    made: Option<SetupFiles>,
    /// The error file, if there is anything to compensate.
    errors: Option<String>,
    singles: Vec<Single>,
    /// The INI file with the component, if it has none yet.
    installs: Option<Changed>,
    /// Whether that is written.
    writes: bool,
    balls: Option<PathBuf>,
}

/// A reading of an option that cannot be used.
fn reading(option: &str, error: ReadingError) -> BadInput {
    BadInput::new(format!("--{option}: {error}"), error.remedy)
}

fn is_refused(findings: &[Finding]) -> bool {
    findings.iter().any(|f| f.severity == Severity::Refused)
}

/// Says why nothing is written.
fn refused(ini: &Path, findings: &[Finding]) -> Result<Outcome, BadInput> {
    let lines: String = findings.iter().map(|f| format!("{f}\n")).collect();
    let (ini, version) = (ini.display(), configuration::version());
    files::print(&format!(
        "{lines}{ini}: every file is as it was; {version}\n"
    ))?;
    Ok(Outcome::CheckFailed)
}

fn calibrate(machine: &str, balls: &Path) -> String {
    let (machine, balls) = (quoted(machine), quoted(balls.display()));
    format!(
        "trueaxis linuxcnc calibrate {machine} --artefact {balls} --ball-diameter D --stylus-diameter D"
    )
}

/// The effect of a compensation in one line.
fn effect(verification: &Proof) -> String {
    let [before, after] = [&verification.travel.before, &verification.travel.after];
    let after = match after.translation_um.mean < 0.01 {
        true => "below 0.01".to_owned(),
        false => format!("{:.2}", after.translation_um.mean),
    };
    format!(
        "{:.1} µm at the tip become {after}, if the errors are as entered (mean over the travel)",
        before.translation_um.mean
    )
}

/// A word of a command line for a shell.
fn quoted(word: impl ToString) -> String {
    let word = word.to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%~".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// What an operator writes; empty at the end of the input.
fn answered(question: &str) -> Result<String, BadInput> {
    files::print(&format!("{question} "))?;
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line);
    read.map_err(|error| {
        BadInput::new(
            format!("the answer cannot be read: {error}"),
            "answer in UTF-8, or give options",
        )
    })?;
    Ok(line.trim().to_owned())
}

impl Arguments {
    /// Everything after the first look at the configuration: asks, then writes, the INI file last.
    fn steps(&self, found: &FoundConfiguration<'_>) -> Result<Outcome, BadInput> {
        let ini = found.ini;
        let files = [HAL, "machine.toml", "errors.toml", "machine.trax"];
        let files = files.map(|name| ini.with_file_name(name));
        let [hal, machine, errors, blob] = &files;
        let (sensors, growths) = self.temperatures()?;
        let made = match self.replaces(found, [hal, machine, errors, blob])? {
            true => Some(self.made(found, &sensors)?),
            false if sensors.is_empty() => None,
            false => {
                return Err(BadInput::new(
                    format!("{}: it stays, and has no --temperature", hal.display()),
                    "take the component out with --remove if it is in the INI file, then give --overwrite",
                ));
            }
        };
        let text = match &made {
            Some(made) => Text {
                name: machine.display().to_string(),
                text: made.machine.clone(),
            },
            None => Text::read(machine)?,
        };
        let described = files::machine_in(&text)?;
        let old = match errors.exists() {
            true => Some(Text::read(errors)?),
            false => None,
        };
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
            let answer =
                self.ask("Balls on the table that can be probed: artefact file (artefact.toml):")?;
            balls = Some(answer).filter(|a| !a.is_empty()).map(PathBuf::from);
        }
        // Nothing is asked from here on.
        self.write(
            found,
            &StartFiles {
                files: &files,
                made,
                errors: text,
                singles,
                installs,
                writes,
                balls,
            },
        )
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
        let changed = with_lines_without(found.ini, hal, &taken_out)?;
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

    /// Writes all files; if anything is refused, every file is as it was.
    fn write(
        &self,
        found: &FoundConfiguration<'_>,
        start: &StartFiles<'_>,
    ) -> Result<Outcome, BadInput> {
        let ini = found.ini;
        let [hal, machine, errors, blob] = start.files;
        let installs_now = start.installs.as_ref().filter(|_| start.writes);
        let mut written: Vec<(PathBuf, &str)> = Vec::new();
        if let Some(made) = &start.made {
            written.push((hal.clone(), &made.hal));
            written.push((machine.clone(), &made.machine));
        }
        if let Some(text) = &start.errors {
            written.push((errors.clone(), text));
        }
        let all = written.iter().map(|(file, _)| file.as_path());
        let compiled = start.errors.as_ref().map(|_| blob.as_path());
        let kept = KeptFiles::read(all.chain(compiled))?;
        let copies = kept.copies(&written)?;
        let mut beside: Vec<&Path> = copies.iter().map(|(copy, _)| copy.as_path()).collect();
        if let Some(changed) = installs_now {
            beside.extend([ini, &changed.copy]);
        }
        let made_beside = KeptFiles::read(beside)?;
        let mut stays = found.compensated().staying();
        if !copies.is_empty() {
            let names = copies.iter().map(|(copy, _)| copy.display().to_string());
            let names: Vec<String> = names.collect();
            let _ = writeln!(stays, "the old files are in {}", names.join(", "));
        }
        let write = || {
            for (copy, bytes) in &copies {
                files::write(copy, bytes)?;
            }
            for (file, text) in &written {
                files::prepare(file, &[ini])?;
                files::write(file, text.as_bytes())?;
            }
            if start.errors.is_some() {
                return self.compiled(ini, start, &stays);
            }
            if let Some(changed) = installs_now {
                changed.write(ini)?;
            }
            files::print(&stays)?;
            without(ini, [machine, errors, blob], start.balls.as_deref())
        };
        let done = write();
        if !matches!(done, Ok(Outcome::Done)) {
            kept.restore()?;
            made_beside.restore()?;
        }
        done
    }

    /// Compiles and checks what has been written, then writes the INI file, if that is wanted. `stays` says where what
    /// was replaced is.
    fn compiled(
        &self,
        ini: &Path,
        start: &StartFiles<'_>,
        stays: &str,
    ) -> Result<Outcome, BadInput> {
        let [_, machine, errors, blob] = start.files;
        let both = MachineFiles {
            machine: machine.clone(),
            errors: errors.clone(),
        };
        let compiled = compile::usual(&both, blob.clone(), Target::default())?;
        let whole = match &compiled.made {
            Made::Verified(whole) if compiled.made.is_right() => whole,
            _ => {
                compiled.show()?;
                return Ok(Outcome::CheckFailed);
            }
        };
        // What LinuxCNC would read.
        let future = match &start.installs {
            Some(changed) => Text {
                name: ini.display().to_string(),
                text: changed.text.clone(),
            },
            None => Text::read(ini)?,
        };
        let future = configuration::read_future(future, ini, self.running)?;
        let findings = check::findings(ini, &future, blob, Some(machine))?;
        if is_refused(&findings) {
            return refused(ini, &findings);
        }
        if let Some(changed) = start.installs.as_ref().filter(|_| start.writes) {
            changed.write(ini)?;
        }
        files::print(&self.ended(ini, start, &whole.best.verification, &findings, stays))?;
        Ok(Outcome::Done)
    }

    /// What has been done, and what comes next.
    fn ended(
        &self,
        ini: &Path,
        start: &StartFiles<'_>,
        verification: &Proof,
        findings: &[Finding],
        stays: &str,
    ) -> String {
        let [of_hal, of_machine, of_errors, of_blob] = start
            .files
            .each_ref()
            .map(|path| path.display().to_string());
        let what = match start.singles.len() {
            0 if self.growth.is_empty() => "what LinuxCNC compensated".to_owned(),
            0 => "growth of the spindle".to_owned(),
            count_of => count(count_of, "reading"),
        };
        let mut lines = format!(
            "{of_errors}: {what}; to compare with your instruments: trueaxis explain {} {}\n",
            quoted(&of_machine),
            quoted(&of_errors)
        );
        let _ = writeln!(lines, "{of_blob}: {}", effect(verification));
        for finding in findings {
            let _ = writeln!(lines, "{finding}");
        }
        lines += stays;
        let of_ini = ini.display();
        let _ = match (&start.installs, start.writes) {
            (Some(changed), true) => writeln!(
                lines,
                "{of_ini}: with component and panel; a copy of the old file is in {}",
                changed.copy.display()
            ),
            (Some(_), false) => writeln!(
                lines,
                "{of_ini}: is as it was; what to write into it is at the head of {of_hal}"
            ),
            (None, _) => writeln!(lines, "{of_ini}: has the component already"),
        };
        let switched_on = match self.enable_when_homed {
            true => "home: the corrections come in",
            false => {
                "home, look at the corrections (they are OFF), then press Enable in the tab Compensation"
            }
        };
        let _ = writeln!(lines, "next: linuxcnc {}, {switched_on}", quoted(of_ini));
        if let Some(balls) = &self.balls {
            let _ = writeln!(
                lines,
                "then, with the balls: {}",
                calibrate(&of_machine, balls)
            );
        }
        lines
    }

    /// An answer, or nothing if nothing is to be asked.
    fn ask(&self, question: &str) -> Result<String, BadInput> {
        match self.yes {
            true => Ok(String::new()),
            false => answered(question),
        }
    }

    fn agrees(&self, question: &str) -> Result<bool, BadInput> {
        let answer = self.ask(&format!("{question} [y/N]"))?;
        Ok(matches!(answer.as_str(), "y" | "Y" | "yes"))
    }

    fn ask_ini(&self) -> Result<PathBuf, BadInput> {
        let inis = std::fs::read_dir(".").into_iter().flatten().flatten();
        let inis = inis.map(|entry| PathBuf::from(entry.file_name()));
        let mut inis: Vec<PathBuf> = inis
            .filter(|path| path.extension().is_some_and(|e| e == "ini"))
            .collect();
        inis.sort();
        let proposed = match &inis[..] {
            [one] => format!(" [{}]", one.display()),
            _ => String::new(),
        };
        let answer = self.ask(&format!("INI file of the machine{proposed}:"))?;
        match (answer.is_empty(), &inis[..]) {
            (false, _) => Ok(answer.into()),
            (true, [one]) => Ok(one.clone()),
            (true, _) => Err(BadInput::new(
                "no INI file is given",
                "give the path of the INI file that LinuxCNC is started with",
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

    /// HAL lines, a first machine file, and what LinuxCNC compensates.
    fn made(
        &self,
        found: &FoundConfiguration<'_>,
        sensors: &[StartSensor],
    ) -> Result<SetupFiles, BadInput> {
        let configuration = found.configuration;
        let table = match &self.table {
            Some(table) => table.clone(),
            None => {
                self.ask("Which linear axes move the table (the others move the spindle)? [XY]")?
            }
        };
        let table = match table.is_empty() {
            true => None,
            false => Some(on_table(configuration, &table)?),
        };
        let pivot =
            match (unknown_pivot(configuration), self.pivot) {
                (None, _) => None,
                (_, Some(pivot)) => Some(pivot),
                (Some(unknown), None) => {
                    let question =
                        format!("{unknown}.\nFrom the pivot to the nose of the spindle, mm:");
                    let pivot = positive(&self.ask(&question)?);
                    Some(pivot.map_err(|_| {
                        BadInput::new(unknown, "measure it, and give --pivot in mm")
                    })?)
                }
            };
        let pins: Vec<String> = sensors.iter().map(|sensor| sensor.pin.clone()).collect();
        let known = MachineFacts {
            temperatures: &pins,
            name: &name(configuration, None),
            blob: "machine.trax",
            table: table.as_deref(),
            enabled: self.enable_when_homed,
            pivot,
        };
        Ok(setup(configuration, known, found.imports, found.findings))
    }

    /// The sensors, in the order in which the compensation has them: those of a growth first; and the growths.
    fn temperatures(&self) -> Result<(Vec<StartSensor>, Vec<Growth>), BadInput> {
        let mut sensors: Vec<StartSensor> = Vec::new();
        for text in &self.temperature {
            let (name, pin) = text
                .split_once('=')
                .map_or(("", ""), |(n, p)| (n.trim(), p.trim()));
            let is_other = sensors.iter().all(|sensor| sensor.name != name);
            if name.is_empty() || pin.is_empty() || pin.contains(char::is_whitespace) || !is_other {
                return Err(BadInput::new(
                    format!("--temperature: `{text}` is not NAME=PIN with a name of its own"),
                    "give a name and a HAL pin: --temperature bearing=hm2_7i76e.0.thermistor.00",
                ));
            }
            sensors.push(StartSensor {
                name: name.to_owned(),
                pin: pin.to_owned(),
            });
        }
        let names = || sensors.iter().map(|sensor| sensor.name.as_str());
        let growths = self.growth.iter().map(|text| Growth::parse(names(), text));
        let growths: Vec<Growth> = growths
            .collect::<Result<_, _>>()
            .map_err(|error| reading("growth", error))?;
        let at = |sensor: &StartSensor| {
            let mut growths_of = growths.iter();
            let first = growths_of.position(|growth| growth.sensor == sensor.name);
            first.unwrap_or(growths.len())
        };
        sensors.sort_by_key(at);
        Ok((sensors, growths))
    }

    /// What has been measured, from options; axes count as their letters do.
    fn given(&self, letters: &[char]) -> Result<Vec<Single>, BadInput> {
        let scale = |text| Single::scale(letters, text).map_err(|error| reading("scale", error));
        let square = |text| Single::square(letters, text).map_err(|error| reading("square", error));
        let dial = |text| Single::dial(letters, text).map_err(|error| reading("dial", error));
        let scales = self.scale.iter().map(|text| scale(text));
        let squares = self.square.iter().map(|text| square(text));
        let dials = self.dial.iter().map(|text| dial(text));
        scales.chain(squares).chain(dials).collect()
    }

    /// What has been measured, from options or by asking.
    fn singles(
        &self,
        machine: &Machine,
        found: &FoundConfiguration<'_>,
        base: Option<&str>,
    ) -> Result<Vec<Single>, BadInput> {
        let letters: Vec<char> = machine.axes.iter().map(|axis| axis.letter.char()).collect();
        let free = |single: &Single| found.is_free(&letters, single, base);
        let mut singles = self.given(&letters)?;
        singles.iter().try_for_each(free)?;
        if self.yes || !singles.is_empty() {
            return Ok(singles);
        }
        files::print(
            "\nWhat has been measured? Positive is where the tool is farther in the direction of a positive command.\n\
             An empty line where there is nothing.\n",
        )?;
        let linear: Vec<char> = (machine.axes.iter())
            .filter(|axis| !axis.letter.is_rotary())
            .map(|axis| axis.letter.char())
            .collect();
        // Asked again until it can be read.
        let mut one = |question: &str,
                       read: &dyn Fn(&str) -> Result<Single, ReadingError>|
         -> Result<(), BadInput> {
            loop {
                let answer = self.ask(question)?;
                if answer.is_empty() {
                    return Ok(());
                }
                let read = read(&answer).map_err(|error| BadInput::new(error.what, error.remedy));
                match read.and_then(|single| free(&single).map(|()| single)) {
                    Ok(single) => {
                        singles.push(single);
                        return Ok(());
                    }
                    Err(bad) => files::print(&format!("{bad}\n"))?,
                }
            }
        };
        for letter in &linear {
            let question = format!("Scale along {letter}: µm too much / mm of travel (2/100):");
            one(&question, &|answer| {
                Single::scale(&letters, &format!("{letter}={answer}"))
            })?;
        }
        for (k, a) in linear.iter().enumerate() {
            for b in &linear[k + 1..] {
                let question = format!(
                    "Square, one leg aligned with {a}; a dial moved by {b} along the other reads towards {a}: µm / mm (3/100):"
                );
                one(&question, &|answer| {
                    Single::square(&letters, &format!("{a}{b}={answer}"))
                })?;
            }
        }
        for letter in &linear {
            let question = format!("Dial along {letter}: reading after + less after − travel, µm:");
            one(&question, &|answer| {
                Single::dial(&letters, &format!("{letter}={answer}"))
            })?;
        }
        Ok(singles)
    }
}

/// Nothing has been measured with simple instruments.
fn without(
    ini: &Path,
    [machine, errors, blob]: [&Path; 3],
    balls: Option<&Path>,
) -> Result<Outcome, BadInput> {
    let (ini, machine) = (quoted(ini.display()), machine.display().to_string());
    let next = match (balls, errors.exists()) {
        (Some(balls), _) => format!("start LinuxCNC, then {}", calibrate(&machine, balls)),
        (None, true) => format!(
            "trueaxis compile {} {} -o {}",
            quoted(&machine),
            quoted(errors.display()),
            quoted(blob.display())
        ),
        (None, false) => format!("measure, then trueaxis linuxcnc start {ini}"),
    };
    files::print(&format!("next: {next}\n"))?;
    Ok(Outcome::Done)
}

/// A temperature sensor.
struct StartSensor {
    name: String,
    /// Pin in HAL, °C.
    pin: String,
}
