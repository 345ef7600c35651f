//! Programs whose subprograms stand in the same file: written out, with the lines that they come from.

use super::arguments::Arguments;
use super::scratch::Scratch;
use super::{bad_program, open};
use crate::commands::bad_input::BadInput;
use std::io::{Read, Write};
use std::path::Path;
use trueaxis_gcode::check::CheckResult;
use trueaxis_gcode::stream::StreamError;
use trueaxis_gcode::subprograms::{self, Inlined};
use trueaxis_gcode::{Refusal, Report, Rules};

/// A program without calls in a temporary file.
pub struct Program {
    file: Scratch,
    inlined: Inlined,
}

impl Program {
    /// `None` if the program calls nothing, or if its dialect has no calls.
    pub fn new(arguments: &Arguments, rules: &Rules) -> Result<Option<Self>, BadInput> {
        let path = &arguments.program;
        let unreadable = |error| bad_program(path, &StreamError::Read(error));
        if !rules.dialect.table().calls
            || !subprograms::calls(open(path)?, rules.dialect).map_err(unreadable)?
        {
            return Ok(None);
        }
        let mut text = Vec::new();
        open(path)?.read_to_end(&mut text).map_err(unreadable)?;
        let inlined = subprograms::inline(&text, rules.dialect);
        let mut inlined = inlined.map_err(|refusal| bad_program(path, &refusal.into()))?;
        let failed = |error: std::io::Error| {
            BadInput::new(
                format!("a temporary file for the subprograms: {error}"),
                "check the folder of temporary files",
            )
        };
        let mut file = Scratch::new().map_err(failed)?;
        file.write_all(&inlined.text).map_err(failed)?;
        file.flush().map_err(failed)?;
        inlined.text = Vec::new();
        Ok(Some(Self { file, inlined }))
    }

    /// Where the program without calls is.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// What is refused, at the line of the file.
    pub fn refusal(&self, refusal: &Refusal) -> Refusal {
        Refusal {
            line: self.inlined.original(refusal.line),
            ..refusal.clone()
        }
    }

    /// Puts lines of the file in place of those of the program without calls.
    pub fn relabel(&self, report: &mut Report, found: Option<&mut CheckResult>) {
        let largest = report.largest.iter_mut().map(|(_, line)| line);
        let written_out = report.written_out.iter_mut().map(|(line, _)| line);
        let found = found.map(|found| {
            let of_tool = found.tool_path.as_mut().map(|path| &mut path.worst_line);
            let lines = [
                &mut found.off_line,
                &mut found.hole_line,
                &mut found.length_line,
                &mut found.excess_line,
                &mut found.first_time_line,
            ];
            lines.into_iter().chain(of_tool)
        });
        for line in largest
            .chain(written_out)
            .chain(found.into_iter().flatten())
        {
            *line = self.inlined.original(*line);
        }
    }

    /// What people read.
    pub fn note(&self) -> String {
        format!(
            "subprograms are written out where they are called: {} lines\n",
            self.inlined.lines()
        )
    }
}
