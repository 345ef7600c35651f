//! LinuxCNC's stand-alone interpreter, as a process.

use super::source::Source;
use super::{ExpandError, failed, refusal};
use std::fs::File;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The program for the interpreter. No subroutine has this name, since O-words have no spaces.
pub const PROGRAM: &str = "the program.ngc";
/// Its parameters.
pub const PARAMETERS: &str = "parameters.var";
/// Its tools.
pub const TOOLS: &str = "tools.tbl";
/// A program that does nothing for so long does not end.
const PATIENCE: Duration = Duration::from_secs(20);
/// Most bytes of output: some three million motions, a minute.
const MOST: u64 = 256 << 20;

/// Runs the interpreter in a folder with its three files; where its output is.
pub fn run(
    folder: &Path,
    name: &str,
    block_delete: Option<bool>,
    source: &Source,
) -> Result<PathBuf, ExpandError> {
    let path = folder.join(name);
    let errors = folder.join("errors");
    let make = |path: &Path| File::create(path).map_err(failed("a temporary file cannot be made"));
    let mut command = Command::new("rs274");
    command.args(["-v", PARAMETERS, "-t", TOOLS, "-n", "2"]);
    if block_delete == Some(true) {
        command.arg("-b");
    }
    command.args(["-g", PROGRAM]).current_dir(folder);
    command.stdin(Stdio::null());
    command.stdout(make(&path)?).stderr(make(&errors)?);
    let mut child = command.spawn().map_err(|error| match error.kind() {
        ErrorKind::NotFound => ExpandError::NotInstalled,
        _ => failed("rs274 cannot be started")(error),
    })?;
    let (mut length, mut grown) = (0, Instant::now());
    let mut pause = Duration::from_millis(1);
    let status = loop {
        let ended = child.try_wait();
        if let Some(status) = ended.map_err(failed("rs274 cannot be waited for"))? {
            break status;
        }
        std::thread::sleep(pause);
        pause = (2 * pause).min(Duration::from_millis(50));
        let now = std::fs::metadata(&path).map_or(0, |m| m.len());
        if now > length {
            (length, grown) = (now, Instant::now());
        }
        if length > MOST || grown.elapsed() > PATIENCE {
            // It may have ended meanwhile.
            let _ = child.kill();
            let _ = child.wait();
            return Err(refusal(
                source.last_line_in(&path),
                "",
                "the program does not come to its end: it seems to repeat something for ever",
                "let its loops end, or use the compensation in the controller",
            )
            .into());
        }
    };
    if status.success() {
        return Ok(path);
    }
    let said = std::fs::read(&errors).unwrap_or_default();
    Err(source.said(&String::from_utf8_lossy(&said), &path).into())
}
