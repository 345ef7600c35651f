//! `--expand`: the program as LinuxCNC's interpreter runs it.

use super::arguments::{Arguments, units_of};
use super::bad_program;
use super::scratch::Scratch;
use crate::commands::bad_input::BadInput;
use std::io::Write;
use std::path::Path;
use trueaxis_controllers::gcode::check::CheckResult;
use trueaxis_controllers::gcode::expand::{DECIMALS, ExpandError, Expanded, Given, expand};
use trueaxis_controllers::gcode::stream::StreamError;
use trueaxis_controllers::gcode::{Refusal, Report, Rules};

/// A flat program in a temporary file, and where its lines come from.
pub struct Program {
    file: Scratch,
    expanded: Expanded,
}

impl Program {
    /// Runs the interpreter.
    pub fn new(arguments: &Arguments, rules: &Rules) -> Result<Self, BadInput> {
        units_of(&rules.setup, "--expand")?;
        if rules.setup.wrapped.contains(&Some(true)) {
            return Err(BadInput::new(
                "--expand: a wrapped rotary axis, whose words the stand-alone interpreter does not have",
                "write the program out flat, or use the compensation in the controller",
            ));
        }
        let given = Given {
            setup: &rules.setup,
            axes: rules.axes,
            block_delete: rules.block_delete,
            subroutines: &arguments.subroutines,
        };
        let failed = |error: std::io::Error| {
            BadInput::new(
                format!("--expand: a temporary file: {error}"),
                "check the folder of temporary files",
            )
        };
        let mut file = Scratch::new().map_err(failed)?;
        let expanded = expand(&arguments.program, &given, &mut file);
        let expanded = expanded.map_err(|error| match error {
            ExpandError::Refused(refusal) => {
                bad_program(&arguments.program, &StreamError::Refused(refusal))
            }
            ExpandError::NotInstalled => BadInput::new(
                format!("--expand: {error}"),
                "install LinuxCNC (the package linuxcnc-uspace of Debian), or write the program out flat",
            ),
            ExpandError::Failed(..) => BadInput::new(
                format!("--expand: {error}"),
                "check the program's file and the folder of temporary files",
            ),
        })?;
        file.flush().map_err(failed)?;
        Ok(Self { file, expanded })
    }

    /// Where the flat program is.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Its number of lines.
    pub fn lines(&self) -> usize {
        self.expanded.written()
    }

    /// What is refused in the flat program, at the line of the original.
    pub fn refusal(&self, refusal: &Refusal) -> Refusal {
        Refusal {
            line: self.expanded.original(refusal.line),
            cause: format!("in the expanded program, {}", refusal.cause),
            ..refusal.clone()
        }
    }

    /// Puts lines of the original in place of those of the flat program.
    pub fn relabel(&self, report: &mut Report, found: Option<&mut CheckResult>) {
        let original = |line: &mut u64| *line = self.expanded.original(*line);
        report
            .largest
            .iter_mut()
            .for_each(|(_, line)| original(line));
        report
            .written_out
            .iter_mut()
            .for_each(|(line, _)| original(line));
        let Some(found) = found else {
            return;
        };
        for line in [
            &mut found.off_line,
            &mut found.hole_line,
            &mut found.length_line,
            &mut found.excess_line,
            &mut found.first_time_line,
        ] {
            original(line);
        }
        if let Some(path) = &mut found.tool_path {
            original(&mut path.worst_line);
        }
    }

    /// What people read.
    pub fn note(&self) -> String {
        let digit = 0.5 * 0.1_f64.powi(DECIMALS as i32) * 1e3;
        let (unit, factor) = if self.expanded.inches {
            ("inches", 25.4)
        } else {
            ("mm", 1.0)
        };
        format!(
            "expanded by LinuxCNC's interpreter to {} lines; cycles are single moves. It prints {DECIMALS} decimals, in {unit}: \
             up to {:.2} µm on each axis\n",
            self.lines(),
            digit * factor
        )
    }
}
