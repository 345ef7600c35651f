//! What `linuxcnc start` writes: all of its files, or none.

use super::{Arguments, FoundConfiguration, is_refused, refused};
use crate::commands::Outcome;
use crate::commands::bad_input::BadInput;
use crate::commands::compile;
use crate::commands::files::{MachineFiles, Text};
use crate::commands::linuxcnc::kept_files::KeptFiles;
use crate::commands::linuxcnc::setup::Changed;
use crate::commands::linuxcnc::{check, configuration};
use crate::commands::output;
use crate::commands::output::quoted;
use crate::commands::quantity::count;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use trueaxis_direct::Single;
use trueaxis_linuxcnc::{Finding, SetupFiles};
use trueaxis_tables::compile::Proof;
use trueaxis_tables::made::Made;
use trueaxis_tables::target::Target;

/// What is written, and where.
pub(super) struct StartFiles<'s> {
    /// HAL lines, machine, errors, compensation.
    pub(super) files: &'s [PathBuf; 4],
    /// HAL lines and machine, unless those that are there stay.
    pub(super) made: Option<SetupFiles>,
    /// The error file, if there is anything to compensate.
    pub(super) errors: Option<String>,
    pub(super) singles: Vec<Single>,
    /// The INI file with the component, if it has none yet.
    pub(super) installs: Option<Changed>,
    /// Whether that is written.
    pub(super) writes: bool,
    pub(super) balls: Option<PathBuf>,
}

impl StartFiles<'_> {
    /// The files that are written before anything is compiled, with their content.
    fn written(&self) -> Vec<(PathBuf, &str)> {
        let [hal, machine, errors, _] = self.files;
        let made = self.made.as_ref();
        let all = [
            made.map(|made| (hal.clone(), made.hal.as_str())),
            made.map(|made| (machine.clone(), made.machine.as_str())),
            (self.errors.as_deref()).map(|text| (errors.clone(), text)),
        ];
        all.into_iter().flatten().collect()
    }

    /// The INI file with the component, if it is written.
    fn installs_now(&self) -> Option<&Changed> {
        self.installs.as_ref().filter(|_| self.writes)
    }

    /// What has become of the INI file.
    fn fate_of_ini(&self) -> String {
        match (&self.installs, self.writes) {
            (Some(changed), true) => format!(
                "with component and panel; a copy of the old file is in {}",
                changed.copy.display()
            ),
            (Some(_), false) => format!(
                "is as it was; what to write into it is at the head of {}",
                self.files[0].display()
            ),
            (None, _) => "has the component already".to_owned(),
        }
    }
}

impl Arguments {
    /// Writes all files; if anything is refused, every file is as it was.
    pub(super) fn write(
        &self,
        found: &FoundConfiguration<'_>,
        start: &StartFiles<'_>,
    ) -> Result<Outcome, BadInput> {
        let ini = found.ini;
        let [_, machine, errors, blob] = start.files;
        let installs_now = start.installs_now();
        let written = start.written();
        let all = written.iter().map(|(file, _)| file.as_path());
        let compiled = start.errors.as_ref().map(|_| blob.as_path());
        let kept = KeptFiles::read(all.chain(compiled))?;
        let copies = kept.copies(&written)?;
        let mut beside: Vec<&Path> = copies.iter().map(|(copy, _)| copy.as_path()).collect();
        if let Some(changed) = installs_now {
            beside.extend([ini, &changed.copy]);
        }
        let made_beside = KeptFiles::read(beside)?;
        let stays = found.compensated().staying() + &where_old_files_are(&copies);
        let write = || {
            for (copy, bytes) in &copies {
                output::write(copy, bytes)?;
            }
            for (file, text) in &written {
                output::prepare(file, &[ini])?;
                output::write(file, text.as_bytes())?;
            }
            if start.errors.is_some() {
                return self.compiled(ini, start, &stays);
            }
            if let Some(changed) = installs_now {
                changed.write(ini)?;
            }
            output::print(&stays)?;
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
        if let Some(changed) = start.installs_now() {
            changed.write(ini)?;
        }
        output::print(&self.ended(ini, start, &whole.best.verification, &findings, stays))?;
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
        let [of_machine, of_errors, of_blob] =
            [1, 2, 3].map(|k| start.files[k].display().to_string());
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
        let _ = writeln!(lines, "{of_ini}: {}", start.fate_of_ini());
        let switched_on = match self.enable_when_homed {
            true => "home: the corrections come in",
            false => {
                "home, look at the corrections (they are OFF), then press Enable in the tab Compensation"
            }
        };
        let first = match (&start.installs, start.writes) {
            (Some(_), false) => format!("write that into {of_ini}, then "),
            _ => String::new(),
        };
        let _ = writeln!(
            lines,
            "next: {first}linuxcnc {}, {switched_on}",
            quoted(&of_ini)
        );
        if let Some(balls) = &self.balls {
            let then = calibrate(&of_machine, balls);
            let _ = writeln!(lines, "then, with the balls: {then}");
        }
        lines
    }
}

fn where_old_files_are(copies: &[(PathBuf, &[u8])]) -> String {
    let names = copies.iter().map(|(copy, _)| copy.display().to_string());
    match names.collect::<Vec<String>>() {
        none if none.is_empty() => String::new(),
        names => format!("the old files are in {}\n", names.join(", ")),
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
    output::print(&format!("next: {next}\n"))?;
    Ok(Outcome::Done)
}
