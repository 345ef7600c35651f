//! `trueaxis linuxcnc setup`

use super::configuration;
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::files::Text;
use crate::commands::number::positive;
use crate::commands::output;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};
use trueaxis_linuxcnc::{
    Configuration, Finding, MachineFacts, PANEL, SetupFiles, Severity, beforehand, install, setup,
    unknown_pivot,
};

/// Write HAL lines that install the component, and a first machine.toml
///
/// Reads the INI file and the HAL files that it names. LinuxCNC reads trueaxis.hal after them; it changes their
/// connections. machine.toml has the travels and what the kinematics define; CHECK marks what you must add. If the INI
/// file has COMP_FILE or BACKLASH, errors.toml has them as errors of the machine. Lists what must change in the INI
/// file; with --install, the lines for component and panel are written into it. Existing files are kept unless
/// --overwrite is given.
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis linuxcnc setup mill.ini -o . --install")]
pub struct Arguments {
    /// The INI file of the machine
    #[arg(value_name = "MACHINE.ini")]
    ini: PathBuf,
    /// Folder for trueaxis.hal and machine.toml
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Name of the machine (default: [EMC]MACHINE)
    #[arg(long)]
    name: Option<String>,
    /// Linear axes that move the table; the others move the spindle (default: the usual mill, to be checked)
    #[arg(long, value_name = "XY")]
    table: Option<String>,
    /// Head of a five-axis mill: from its pivot to the nose of its spindle, in mm (default: what the HAL files set)
    #[arg(long, value_name = "mm", value_parser = positive)]
    pivot: Option<f64>,
    /// Read the HAL that runs instead of the HAL files: for those that are programs (.tcl)
    #[arg(long)]
    running: bool,
    /// Path of the compensation as written in HAL, from the folder of the INI file
    #[arg(long, value_name = "FILE.trax", default_value = "machine.trax")]
    file: String,
    /// Switch the corrections on whenever the axes are homed (default: the operator does)
    #[arg(long)]
    enable_when_homed: bool,
    /// Write the lines for component and panel into the INI file; its old contents stay in MACHINE.ini.before-trueaxis
    #[arg(long)]
    install: bool,
    /// Replace existing files
    #[arg(long)]
    overwrite: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct SetupAnswer {
    files: Vec<PathBuf>,
    joints: String,
    /// Number of lines that the user must complete.
    to_check: usize,
    /// What speaks against a compensation in the INI file.
    findings: Vec<Finding>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let ini = &arguments.ini;
    let configuration = arguments.configuration()?;
    let findings = beforehand(&configuration);
    let letters = configuration.module.letters.clone();
    if findings.iter().any(|f| f.severity == Severity::Refused) {
        return arguments.refused(letters, findings);
    }
    let written = arguments.made(&configuration, &findings)?;
    arguments.prepare(&written)?;
    let changed = (arguments.install).then(|| with_lines(ini, &written[0].0, &[]));
    let changed = changed.transpose()?;
    // Without the explanation of the mark in the head.
    let to_check = written.iter().map(|(_, text)| marks(text)).sum::<usize>() - 1;
    for (file, text) in &written {
        output::write(file, text.as_bytes())?;
    }
    let files: Vec<PathBuf> = written.into_iter().map(|(file, _)| file).collect();
    if let Some(changed) = &changed {
        changed.write(ini)?;
    }
    let copy = changed.map(|changed| changed.copy);
    let mut answer = SetupAnswer {
        files,
        joints: letters,
        to_check,
        findings,
    };
    if arguments.json {
        answer.files.extend(copy);
        output::print_json(&answer)?;
        return Ok(Outcome::Done);
    }
    let mut shown = text(arguments, &answer, copy.as_deref());
    if let (Some(unknown), None) = (unknown_pivot(&configuration), arguments.pivot) {
        shown += &format!("{unknown}. Measure it, and give --pivot\n");
    }
    output::print(&shown)?;
    Ok(Outcome::Done)
}

/// Number of lines that the user must complete; a name that contains the mark is none.
fn marks(text: &str) -> usize {
    let is_marked = |line: &&str| line.contains("CHECK") && line.contains('#');
    text.lines().filter(is_marked).count()
}

impl Arguments {
    /// The configuration, if the component can be added to it.
    fn configuration(&self) -> Result<Configuration, BadInput> {
        let configuration = configuration::read_running(&self.ini, self.running)?;
        if self.file.is_empty() || self.file.contains(char::is_whitespace) {
            return Err(BadInput::new(
                format!(
                    "--file: `{}` has spaces, which HAL takes for separate words",
                    self.file
                ),
                "give it a path without spaces",
            ));
        }
        if configuration.hal.load("trueaxis").is_some() {
            return Err(BadInput::new(
                format!(
                    "{}: its HAL files load the component trueaxis already",
                    self.ini.display()
                ),
                "remove HALFILE = trueaxis.hal from the INI file first: this command connects to the configuration as it is without it",
            ));
        }
        Ok(configuration)
    }

    /// The files to write, with their texts.
    fn made(
        &self,
        configuration: &Configuration,
        findings: &[Finding],
    ) -> Result<Vec<(PathBuf, String)>, BadInput> {
        let imports = configuration::imported(&self.ini, configuration)?;
        let name = name(configuration, self.name.as_deref());
        let table = match &self.table {
            Some(table) => Some(on_table(configuration, table)?),
            None => None,
        };
        let known = MachineFacts {
            name: &name,
            blob: &self.file,
            table: table.as_deref(),
            enabled: self.enable_when_homed,
            pivot: self.pivot,
            temperatures: &[],
        };
        let SetupFiles {
            hal,
            machine,
            errors,
        } = setup(configuration, known, &imports, findings);
        let written = [
            ("trueaxis.hal", Some(hal)),
            ("machine.toml", Some(machine)),
            ("errors.toml", errors),
        ];
        let written = written
            .into_iter()
            .filter_map(|(name, text)| Some((self.output.join(name), text?)));
        Ok(written.collect())
    }

    /// Makes the folder; refuses files that are there already, unless they may be replaced.
    fn prepare(&self, written: &[(PathBuf, String)]) -> Result<(), BadInput> {
        output::make_folder(&self.output, "-o")?;
        for (file, _) in written {
            output::prepare(file, &[&self.ini])?;
            if !self.overwrite && file.symlink_metadata().is_ok() {
                return Err(BadInput::new(
                    format!("{} already exists: nothing was written", file.display()),
                    "give -o another folder, or --overwrite",
                ));
            }
        }
        Ok(())
    }
}

impl Arguments {
    /// Writes nothing.
    fn refused(&self, joints: String, findings: Vec<Finding>) -> Result<Outcome, BadInput> {
        if self.json {
            let (files, to_check) = (Vec::new(), 0);
            output::print_json(&SetupAnswer {
                files,
                joints,
                to_check,
                findings,
            })?;
        } else {
            let lines: String = findings.iter().map(|f| format!("{f}\n")).collect();
            let (ini, version) = (self.ini.display(), configuration::version());
            output::print(&format!("{lines}{ini}: nothing was written; {version}\n"))?;
        }
        Ok(Outcome::CheckFailed)
    }
}

/// Name of the machine: what is given, else what the INI file says.
pub fn name(configuration: &Configuration, given: Option<&str>) -> String {
    let named = configuration.ini.get("EMC", "MACHINE");
    let name = given.or(named.map(|entry| entry.value.as_str()));
    let name = name.filter(|name| !name.is_empty()).unwrap_or("machine");
    let end = (0..=64).rev().find(|end| name.is_char_boundary(*end));
    name.get(..end.unwrap_or(0)).unwrap_or(name).to_owned()
}

/// Letters of --table, in capitals.
pub fn on_table(configuration: &Configuration, table: &str) -> Result<String, BadInput> {
    let table = table.to_uppercase();
    let axes = configuration.axes();
    let linear = axes.iter().filter(|joint| !joint.is_rotary());
    let linear: Vec<char> = linear.map(|joint| joint.letter).collect();
    match table.chars().find(|letter| !linear.contains(letter)) {
        None => Ok(table),
        Some(other) => Err(BadInput::new(
            format!("--table: the machine has no linear axis {other}"),
            format!(
                "give some of {}, without spaces",
                linear.iter().collect::<String>()
            ),
        )),
    }
}

/// An INI file with the lines for component and panel.
pub struct Changed {
    /// What it was.
    before: String,
    /// Where that stays.
    pub copy: PathBuf,
    pub text: String,
}

impl Changed {
    /// Keeps the old contents, then writes the new ones.
    pub fn write(&self, ini: &Path) -> Result<(), BadInput> {
        output::write(&self.copy, self.before.as_bytes())?;
        output::write(ini, self.text.as_bytes())
    }
}

/// Adds the lines for component and panel, and makes comments of the lines `taken_out`.
pub fn with_lines(ini: &Path, hal: &Path, taken_out: &[usize]) -> Result<Changed, BadInput> {
    let before = Text::read(ini)?.text;
    let folder = configuration::folder(ini);
    // LinuxCNC looks from the folder of the INI file.
    let [within, absolute] =
        [&folder, hal].map(|path| std::path::absolute(path).unwrap_or_default());
    let named = absolute.strip_prefix(&within).unwrap_or(&absolute);
    let named = named.display().to_string();
    if named.contains(char::is_whitespace) {
        return Err(BadInput::new(
            format!("{named}: LinuxCNC reads no HAL file whose path has spaces"),
            "give -o the folder of the INI file",
        ));
    }
    let text = install(&before, &named, taken_out).map_err(|section| {
        BadInput::new(
            format!("{}: it has no [{section}] itself", ini.display()),
            "leave --install out, and write the lines that the head of trueaxis.hal shows into the file that has it",
        )
    })?;
    Ok(Changed {
        copy: kept_at(ini, before.as_bytes())?,
        before,
        text,
    })
}

/// Where the contents of a file stay when it is replaced; an older copy is never replaced itself.
pub fn kept_at(file: &Path, contents: &[u8]) -> Result<PathBuf, BadInput> {
    output::kept_at(contents, |number| {
        let mut copy = file.as_os_str().to_owned();
        copy.push(".before-trueaxis");
        if number > 1 {
            copy.push(format!("-{number}"));
        }
        copy.into()
    })
}

fn text(arguments: &Arguments, answer: &SetupAnswer, copy: Option<&Path>) -> String {
    let SetupAnswer {
        files,
        joints: letters,
        to_check,
        findings,
    } = answer;
    let ini = arguments.ini.display();
    let names: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    let (hal, machine) = (&names[0], &names[1]);
    let mut text = format!(
        "{hal}: joints {letters}\n{machine}: to be completed where it says CHECK ({to_check} in all files)\n"
    );
    let errors = names.get(2);
    text.extend(errors.map(|errors| {
        format!(
            "{errors}: what COMP_FILE and BACKLASH compensate, to be taken out of the INI file\n"
        )
    }));
    let errors = errors.map_or("errors.toml", String::as_str);
    text.extend(findings.iter().map(|finding| format!("{finding}\n")));
    if !findings.is_empty() {
        text += &format!("{}\n", configuration::version());
    }
    let blob = &arguments.file;
    text += &format!("next: trueaxis compile {machine} {errors} -o {blob}\n");
    if let Some(copy) = copy {
        let copy = copy.display();
        return text
            + &format!("{ini}: with component and panel; a copy of the old file is in {copy}\n");
    }
    text += &format!(
        "then below [HAL] of {ini}, after the other HALFILE lines: HALFILE = trueaxis.hal\n\
         for the panel, below [DISPLAY]:\n"
    );
    text.extend(PANEL.iter().map(|line| format!("  {line}\n")));
    text
}
