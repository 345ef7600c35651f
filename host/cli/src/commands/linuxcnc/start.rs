//! `trueaxis linuxcnc start`

use super::check;
use super::configuration;
use super::setup::{Changed, kept_at, name, on_table, with_lines_without};
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
    Configuration, Finding, Import, MachineFacts, SetupFiles, Severity, beforehand, has_imported,
    is_imported, remove, setup, unknown_pivot,
};
use trueaxis_measure::direct::Single;
use trueaxis_model::errors::Parameter;
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
        free(&found, &letters, single)?;
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

/// Files that `start` may write, as they were before.
struct KeptFiles(Vec<(PathBuf, Option<Vec<u8>>)>);

impl KeptFiles {
    fn read<'p>(files: impl IntoIterator<Item = &'p Path>) -> Result<Self, BadInput> {
        let read = files.into_iter().map(|file| {
            let bytes = match file.exists() {
                true => Some(files::read_bytes(file)?),
                false => None,
            };
            Ok((file.to_owned(), bytes))
        });
        Ok(Self(read.collect::<Result<_, BadInput>>()?))
    }

    /// Copies of what will be replaced by something else: `written`, and what is compiled.
    fn copies(&self, written: &[(PathBuf, &str)]) -> Result<Vec<(PathBuf, &[u8])>, BadInput> {
        let is_same = |file: &Path, before: &[u8]| {
            let mut all = written.iter().filter(|(path, _)| path == file);
            all.any(|(_, text)| text.as_bytes() == before)
        };
        let replaced = self.0.iter().filter_map(|(file, before)| {
            let before = before.as_deref()?;
            (!is_same(file, before)).then_some((file, before))
        });
        replaced
            .map(|(file, before)| Ok((kept_at(file, before)?, before)))
            .collect()
    }

    /// Puts back what has changed.
    fn restore(&self) -> Result<(), BadInput> {
        for (file, before) in &self.0 {
            let now = std::fs::read(file).ok();
            match before {
                _ if now == *before => {}
                Some(bytes) => files::write(file, bytes)?,
                None => std::fs::remove_file(file).map_err(|error| {
                    BadInput::new(
                        format!("{} cannot be removed: {error}", file.display()),
                        "remove it",
                    )
                })?,
            }
        }
        Ok(())
    }
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

/// What LinuxCNC keeps, a line each.
fn staying(configuration: &Configuration) -> String {
    let mut letters: Vec<char> = configuration.axes().iter().map(|j| j.letter).collect();
    letters.sort_unstable();
    letters.dedup();
    let kept = letters
        .iter()
        .flat_map(|letter| configuration.kept(*letter));
    let lines = kept.map(|(joint, entry)| {
        format!(
            "{} = {} of joint {} stays in the INI file: the joints of {} differ\n",
            entry.key, entry.value, joint.number, joint.letter
        )
    });
    lines.collect()
}

/// The axis along which a reading is taken.
fn along(single: &Single) -> Option<usize> {
    match *single {
        Single::Scale { axis, .. } | Single::Reversal { axis, .. } => Some(axis),
        Single::Square { .. } => None,
    }
}

/// Refuses a reading along an axis that LinuxCNC compensates itself: what it shows depends on that.
fn free(found: &FoundConfiguration<'_>, letters: &[char], single: &Single) -> Result<(), BadInput> {
    let Some(axis) = along(single) else {
        return Ok(());
    };
    let letter = letters[axis];
    if let Some((joint, entry)) = found.configuration.kept(letter).first() {
        return Err(BadInput::new(
            format!(
                "a reading along {letter}: {} of joint {} stays with LinuxCNC, because the joints of {letter} differ",
                entry.key, joint.number
            ),
            format!(
                "correct COMP_FILE or BACKLASH of each joint of {letter} by what the reading shows"
            ),
        ));
    }
    match found
        .imports
        .iter()
        .find(|import| import.letter() == letter)
    {
        None => Ok(()),
        Some(import) => Err(BadInput::new(
            format!(
                "a reading along {}: the INI file already compensates {} ({})",
                import.letter(),
                import.letter(),
                import.source()
            ),
            "take COMP_FILE and BACKLASH of this axis out of the INI file, measure again, and start again",
        )),
    }
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
        let FoundConfiguration { ini, imports, .. } = *found;
        let files = [HAL, "machine.toml", "errors.toml", "machine.trax"];
        let [hal, machine, errors, blob] = files.map(|name| ini.with_file_name(name));
        let (sensors, growths) = self.temperatures()?;
        let made = match self.replaces(found, [&hal, &machine, &errors, &blob])? {
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
            None => Text::read(&machine)?,
        };
        let described = files::machine_in(&text)?;
        let old = match errors.exists() {
            true => Some(Text::read(&errors)?),
            false => None,
        };
        let base = base(found, made.as_ref(), old.as_ref(), &errors)?;
        let installs = match found.configuration.hal.load("trueaxis") {
            Some(_) => None,
            None => {
                // All of them are in `base`.
                let lines = imports.iter().flat_map(|i| i.lines(found.configuration));
                let taken_out: Vec<usize> = lines.collect();
                Some(with_lines_without(ini, &hal, &taken_out)?)
            }
        };
        let writes = match (&installs, self.install) {
            (None, _) => false,
            (Some(_), true) => true,
            (Some(changed), false) => self.agrees(&format!(
                "Write the lines for component and panel into {0}? What it is now stays in {1}.",
                ini.display(),
                changed.copy.display()
            ))?,
        };
        let installs_now = installs.as_ref().filter(|_| writes);
        let singles = self.singles(&described, found, base.as_deref())?;
        let has_errors = !(singles.is_empty() && growths.is_empty() && imports.is_empty());
        let (mut balls, mut text) = (self.balls.clone(), None);
        if has_errors {
            let new = error_file(&described, &singles, base)? + &thermal(&growths);
            let differs = |old: &Text| old.text != new;
            let replaced = match (old.as_ref().is_some_and(differs), blob.exists()) {
                _ if made.is_some() => None,
                (true, _) => Some(&errors),
                (false, true) => Some(&blob),
                (false, false) => None,
            };
            if let Some(file) = replaced.map(|file| file.display())
                && !self.overwrite
                && !self.agrees(&format!("{file} exists. Replace it?"))?
            {
                return Err(BadInput::new(
                    format!("{file} exists: it was not replaced, and nothing was compiled"),
                    "give --overwrite, or compile errors.toml with `trueaxis compile` into another file",
                ));
            }
            text = Some(new);
        } else if balls.is_none() {
            let answer =
                self.ask("Balls on the table that can be probed: artefact file (artefact.toml):")?;
            balls = Some(answer).filter(|a| !a.is_empty()).map(PathBuf::from);
        }
        // Nothing is asked from here on.
        let mut written: Vec<(PathBuf, &str)> = Vec::new();
        if let Some(made) = &made {
            written.push((hal, &made.hal));
            written.push((machine.clone(), &made.machine));
        }
        if let Some(text) = &text {
            written.push((errors.clone(), text));
        }
        let all = written.iter().map(|(file, _)| file.as_path());
        let compiled = has_errors.then_some(blob.as_path());
        let kept = KeptFiles::read(all.chain(compiled))?;
        let copies = kept.copies(&written)?;
        let mut beside: Vec<&Path> = copies.iter().map(|(copy, _)| copy.as_path()).collect();
        if let Some(changed) = installs_now {
            beside.extend([ini, &changed.copy]);
        }
        let made_beside = KeptFiles::read(beside)?;
        let mut stays = staying(found.configuration);
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
            if has_errors {
                return self.compiled(
                    ini,
                    [&machine, &errors, &blob],
                    &singles,
                    installs.as_ref().map(|changed| (changed, writes)),
                    &stays,
                );
            }
            if let Some(changed) = installs_now {
                changed.write(ini)?;
            }
            files::print(&stays)?;
            without(ini, [&machine, &errors, &blob], balls.as_deref())
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
        [machine, errors, blob]: [&Path; 3],
        singles: &[Single],
        installs: Option<(&Changed, bool)>,
        stays: &str,
    ) -> Result<Outcome, BadInput> {
        let [of_machine, of_errors, of_blob] =
            [machine, errors, blob].map(|path| path.display().to_string());
        let both = MachineFiles {
            machine: machine.to_owned(),
            errors: errors.to_owned(),
        };
        let compiled = compile::usual(&both, blob.to_owned(), Target::default())?;
        let Made::Verified(whole) = &compiled.made else {
            compiled.show()?;
            return Ok(Outcome::CheckFailed);
        };
        if !compiled.made.is_right() {
            compiled.show()?;
            return Ok(Outcome::CheckFailed);
        }
        // What LinuxCNC would read.
        let future = match installs {
            Some((Changed { text, .. }, _)) => Text {
                name: ini.display().to_string(),
                text: text.clone(),
            },
            None => Text::read(ini)?,
        };
        let future = configuration::read_future(future, ini, self.running)?;
        let findings = check::findings(ini, &future, blob, Some(machine))?;
        if is_refused(&findings) {
            return refused(ini, &findings);
        }
        let what = match singles.len() {
            0 if self.growth.is_empty() => "what LinuxCNC compensated".to_owned(),
            0 => "growth of the spindle".to_owned(),
            count_of => count(count_of, "reading"),
        };
        let mut lines = format!(
            "{of_errors}: {what}; to compare with your instruments: trueaxis explain {} {}\n",
            quoted(&of_machine),
            quoted(&of_errors)
        );
        lines += &format!("{of_blob}: {}\n", effect(&whole.best.verification));
        for finding in &findings {
            lines += &format!("{finding}\n");
        }
        lines += stays;
        let shown = quoted(ini.display());
        match installs {
            Some((changed, true)) => {
                changed.write(ini)?;
                lines += &format!(
                    "{}: with component and panel; a copy of the old file is in {}\n",
                    ini.display(),
                    changed.copy.display()
                );
            }
            Some(_) => {
                lines += &format!(
                    "{}: is as it was; what to write into it is at the head of {}\n",
                    ini.display(),
                    ini.with_file_name("trueaxis.hal").display()
                );
            }
            None => lines += &format!("{}: has the component already\n", ini.display()),
        }
        let switched_on = match self.enable_when_homed {
            true => "home: the corrections come in",
            false => {
                "home, look at the corrections (they are OFF), then press Enable in the tab Compensation"
            }
        };
        lines += &format!("next: linuxcnc {shown}, {switched_on}\n");
        if let Some(balls) = &self.balls {
            lines += &format!("then, with the balls: {}\n", calibrate(&of_machine, balls));
        }
        files::print(&lines)?;
        Ok(Outcome::Done)
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
        let growths = self.growth.iter().map(|text| growth(&sensors, text));
        let growths: Vec<Growth> = growths.collect::<Result<_, _>>()?;
        let at = |sensor: &StartSensor| {
            let mut names = growths.iter().map(|(name, _)| name);
            names
                .position(|name| *name == sensor.name)
                .unwrap_or(growths.len())
        };
        sensors.sort_by_key(at);
        Ok((sensors, growths))
    }

    /// What has been measured, from options; axes count as their letters do.
    fn given(&self, letters: &[char]) -> Result<Vec<Single>, BadInput> {
        let scales = self.scale.iter().map(|text| scale(letters, text));
        let squares = self.square.iter().map(|text| square(letters, text));
        let dials = self.dial.iter().map(|text| dial(letters, text));
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
        let free = |single: &Single| {
            free(found, &letters, single)?;
            free_beside(base, &letters, single)
        };
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
                       read: &dyn Fn(&str) -> Result<Single, BadInput>|
         -> Result<(), BadInput> {
            loop {
                let answer = self.ask(question)?;
                if answer.is_empty() {
                    return Ok(());
                }
                let read = |answer: &str| {
                    let single = read(answer)?;
                    free(&single).map(|()| single)
                };
                match read(&answer) {
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
                scale(&letters, &format!("{letter}={answer}"))
            })?;
        }
        for (k, a) in linear.iter().enumerate() {
            for b in &linear[k + 1..] {
                let question = format!(
                    "Square, one leg aligned with {a}; a dial moved by {b} along the other reads towards {a}: µm / mm (3/100):"
                );
                one(&question, &|answer| {
                    square(&letters, &format!("{a}{b}={answer}"))
                })?;
            }
        }
        for letter in &linear {
            let question = format!("Dial along {letter}: reading after + less after − travel, µm:");
            one(&question, &|answer| {
                dial(&letters, &format!("{letter}={answer}"))
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

/// The error file to which readings are added: it has all that LinuxCNC compensates, or did before the component came.
fn base(
    found: &FoundConfiguration<'_>,
    made: Option<&SetupFiles>,
    old: Option<&Text>,
    errors: &Path,
) -> Result<Option<String>, BadInput> {
    let refused = |what: &str, remedy: &str| {
        Err(BadInput::new(
            format!("{}: {what}", errors.display()),
            remedy.to_owned(),
        ))
    };
    let old = old.map(|old| old.text.replace("\r\n", "\n"));
    let old = old.filter(|text| is_imported(text));
    match (made, old) {
        (Some(made), _) if !found.imports.is_empty() => Ok(made.errors.clone()),
        (Some(_), Some(_)) => refused(
            "it has what LinuxCNC compensated, the INI file has not: replacing it would lose that",
            "put COMP_FILE and BACKLASH back into the INI file (--remove does); or, if they were wrong, move errors.toml away",
        ),
        (Some(_), None) => Ok(None),
        (None, old) => {
            let text = old.as_deref().unwrap_or_default();
            let missing = |import: &&Import| {
                !import.lines(found.configuration).is_empty() && !import.is_in(text)
            };
            if let Some(import) = found.imports.iter().find(missing) {
                return refused(
                    &format!(
                        "it does not have what LinuxCNC compensates: {}",
                        import.source()
                    ),
                    "give --overwrite: machine.toml, trueaxis.hal and errors.toml are made again from the INI file",
                );
            }
            let is_reading = |line: &str| {
                line.split_once("  # ")
                    .is_some_and(|(_, remark)| WORDS.iter().any(|words| remark.starts_with(words)))
            };
            Ok(old.map(|text| {
                let lines = text.split_inclusive('\n');
                lines.filter(|line| !is_reading(line)).collect()
            }))
        }
    }
}

/// Refuses a reading along an axis whose errors are in the file already: it was taken with or without them.
fn free_beside(base: Option<&str>, letters: &[char], single: &Single) -> Result<(), BadInput> {
    match (along(single).map(|axis| letters[axis]), base) {
        (Some(letter), Some(base)) if has_imported(base, letter) => Err(BadInput::new(
            format!(
                "a reading along {letter}: errors.toml already has what LinuxCNC compensated along {letter}"
            ),
            "take that out of errors.toml, measure again without compensation, and start again",
        )),
        _ => Ok(()),
    }
}

/// Name of a sensor, and how far the spindle grows with it (mm/K).
type Growth = (String, f64);

/// A temperature sensor.
struct StartSensor {
    name: String,
    /// Pin in HAL, °C.
    pin: String,
}

/// Reads `NAME=12/15`: the name of a sensor, and the growth of the spindle (mm/K).
fn growth(sensors: &[StartSensor], text: &str) -> Result<Growth, BadInput> {
    let parsed = text.split_once('=').and_then(|(name, reading)| {
        let (um, kelvin) = reading.split_once('/')?;
        let um: f64 = um.trim().parse().ok()?;
        let kelvin: f64 = kelvin.trim().parse().ok()?;
        let is_possible = kelvin > 0.0 && um.abs() <= 1000.0 && kelvin <= 200.0;
        let sensor = sensors.iter().find(|sensor| sensor.name == name.trim())?;
        is_possible.then(|| (sensor.name.clone(), um * 1e-3 / kelvin))
    });
    parsed.ok_or_else(|| {
        BadInput::new(
            format!("--growth: `{text}` is not bearing=12/15 with a sensor of --temperature"),
            "give the sensor, µm and K: --temperature bearing=PIN --growth bearing=12/15",
        )
    })
}

/// The section of an error file about growths of the spindle: a tool that is nearer to the table has moved in −z of the
/// spindle.
fn thermal(growths: &[Growth]) -> String {
    if growths.is_empty() {
        return String::new();
    }
    let entries = growths.iter().map(|(sensor, mm)| {
        format!(
            "    {{ per_kelvin = {:.6e}, sensor = {}, reference_celsius = 20.0 }},\n",
            -mm,
            toml::Value::from(sensor.as_str())
        )
    });
    let entries: String = entries.collect();
    format!("\n[thermal]\n# Growth of the spindle.\nEZ0S = [\n{entries}]\n")
}

/// An error file with what has been read, added to what LinuxCNC compensated.
fn error_file(
    machine: &Machine,
    singles: &[Single],
    imported: Option<String>,
) -> Result<String, BadInput> {
    let mut lines = String::new();
    let mut found: Vec<Parameter> = Vec::new();
    for single in singles {
        let words = words(machine, single);
        let (parameter, value) = single.parameter(machine).ok_or_else(|| {
            BadInput::new(
                format!("{words}: no parameter of this machine shows that alone"),
                "give the readings to `trueaxis measured`",
            )
        })?;
        if found.contains(&parameter) {
            return Err(BadInput::new(
                format!("{words}: {parameter} has been measured twice"),
                "give one of the readings",
            ));
        }
        // Readings have three digits.
        let value: f64 = format!("{value:.6e}").parse().unwrap_or(value);
        let _ = writeln!(lines, "{parameter} = {value:?}  # {words}");
        found.push(parameter);
    }
    Ok(match imported {
        Some(text) if singles.is_empty() => text,
        None => format!(
            "# As measured: `trueaxis explain` says what the instruments must have shown.\nmachine = {}\n\n[parameters]\n{lines}",
            toml::Value::from(machine.name.as_str())
        ),
        Some(text) if text.contains("[parameters]\n") => {
            text.replacen("[parameters]\n", &format!("[parameters]\n{lines}"), 1)
        }
        Some(text) => {
            let at = text
                .find("\n#")
                .filter(|at| text[..*at].contains("machine ="));
            let at = at.unwrap_or(text.len());
            format!("{}\n[parameters]\n{lines}{}", &text[..at], &text[at..])
        }
    })
}

/// How the remarks of readings begin.
const WORDS: [&str; 3] = ["scale along ", "dial along ", "square of "];

fn words(machine: &Machine, single: &Single) -> String {
    let letter = |axis: usize| machine.axes[axis].letter;
    let um = |slope: f64| slope * 1e5;
    match *single {
        Single::Scale { axis, slope } => {
            format!(
                "{}{}: {:+.1} µm at +100 mm",
                WORDS[0],
                letter(axis),
                um(slope)
            )
        }
        Single::Reversal { axis, difference } => format!(
            "{}{}: {:+.1} µm after positive less after negative travel",
            WORDS[1],
            letter(axis),
            difference * 1e3
        ),
        Single::Square {
            aligned,
            moved,
            slope,
        } => format!(
            "{}{} and {}: {:+.1} µm per 100 mm",
            WORDS[2],
            letter(aligned),
            letter(moved),
            um(slope)
        ),
    }
}

/// A linear axis, by its letter.
fn axis(letters: &[char], letter: char) -> Option<usize> {
    let letter = letter.to_ascii_uppercase();
    let is = |known: &char| *known == letter && !"ABC".contains(letter);
    letters.iter().position(is)
}

/// Reads `X=2/100`: axes and the slope.
fn sloped(
    known: &[char],
    text: &str,
    axes: usize,
    option: &str,
) -> Result<(Vec<usize>, f64), BadInput> {
    let wrong = || {
        let example = ["X=2/100", "XY=3/100"][axes - 1];
        BadInput::new(
            format!("--{option}: `{text}` is not of the form {example}"),
            match text.contains(',') {
                true => format!(
                    "write a decimal point: --{option} {}",
                    text.replace(',', ".")
                ),
                false => {
                    format!("give linear axes of the machine, µm and mm: --{option} {example}")
                }
            },
        )
    };
    let (letters, reading) = text.split_once('=').ok_or_else(wrong)?;
    let (um, mm) = reading.split_once('/').ok_or_else(wrong)?;
    let number = |text: &str| {
        text.trim()
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite())
    };
    let (um, mm) = number(um).zip(number(mm)).ok_or_else(wrong)?;
    let found: Option<Vec<usize>> = letters.trim().chars().map(|l| axis(known, l)).collect();
    let found = found
        .filter(|found| found.len() == axes)
        .ok_or_else(wrong)?;
    let slope = um * 1e-3 / mm;
    let is_possible = mm > 0.0 && slope.abs() < LARGEST && (axes == 1 || found[0] != found[1]);
    is_possible.then_some((found, slope)).ok_or_else(wrong)
}

/// The largest slope (mm per mm, rad), as error files permit.
const LARGEST: f64 = 0.1;

fn scale(letters: &[char], text: &str) -> Result<Single, BadInput> {
    let (axes, slope) = sloped(letters, text, 1, "scale")?;
    Ok(Single::Scale {
        axis: axes[0],
        slope,
    })
}

fn square(letters: &[char], text: &str) -> Result<Single, BadInput> {
    let (axes, slope) = sloped(letters, text, 2, "square")?;
    Ok(Single::Square {
        aligned: axes[0],
        moved: axes[1],
        slope,
    })
}

fn dial(letters: &[char], text: &str) -> Result<Single, BadInput> {
    let parsed = text.split_once('=').and_then(|(letter, um)| {
        let mut words = letter.trim().chars();
        let axis = axis(letters, words.next()?)?;
        let um: f64 = um.trim().parse().ok()?;
        (words.next().is_none() && um.is_finite() && um.abs() <= 1000.0).then_some((axis, um))
    });
    match parsed {
        Some((axis, um)) => Ok(Single::Reversal {
            axis,
            difference: um * 1e-3,
        }),
        None => Err(BadInput::new(
            format!("--dial: `{text}` is not X=4"),
            "give a linear axis of the machine and µm: --dial X=4",
        )),
    }
}
