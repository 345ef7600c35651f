//! What is different on Windows: names of files, line ends, files that another program holds open, consoles, Ctrl-C,
//! serial ports.

use super::{TestPlace, words};
use programs::files;
use programs::process::{judged, root, run, target};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// The library for random numbers that Wine 8 lacks, beside the program.
pub fn provide_random_numbers(program: &Path) -> Result<(), String> {
    let library = program.with_file_name("bcryptprimitives.dll");
    compile(
        "bcryptprimitives.c",
        &library,
        &["-shared"],
        &["-ladvapi32"],
    )
}

/// A program of Wine, with a Windows of its own and without a screen.
///
/// # Errors
/// If there is no place for it.
pub fn wine(program: &str) -> Result<Command, String> {
    let mut wine = Command::new(program);
    wine.env("WINEPREFIX", files::folder(target("systems").join("wine"))?)
        .env("WINEDEBUG", "-all")
        .env("DISPLAY", "");
    Ok(wine)
}

/// Creates Wine's own Windows if it is missing: that takes seconds, and its messages would be compared otherwise.
///
/// # Errors
/// If it does not start.
pub fn start() -> Result<(), String> {
    keep_server()?;
    run(wine("wine")?.args(["wineboot", "--init"]))
}

/// Messages of a program without Wine's own: `wine: …`, `0024:fixme:…`.
pub fn without_own_lines(errors: &str) -> String {
    let is_own = |line: &&str| {
        let mut parts = line.split(':');
        let (first, second) = (parts.next(), parts.next());
        let is_thread = |name: &str| name.chars().all(|c| c.is_ascii_hexdigit());
        first == Some("wine")
            || first.is_some_and(is_thread) && matches!(second, Some("fixme" | "err" | "warn"))
    };
    errors
        .split_inclusive('\n')
        .filter(|l| !is_own(l))
        .collect()
}

/// Keeps Wine's server for the next command, which would start it for seconds; it ends a minute after the last. It
/// holds no pipe of this program, for whose end a reader would wait.
///
/// # Errors
/// If it does not start.
fn keep_server() -> Result<(), String> {
    let mut server = wine("wineserver")?;
    run(server
        .arg("-p60")
        .stdout(Stdio::null())
        .stderr(Stdio::null()))
}

fn compile(
    source: &str,
    output: &Path,
    options: &[&str],
    libraries: &[&str],
) -> Result<(), String> {
    run(Command::new("x86_64-w64-mingw32-gcc")
        .args(
            ["-O1", "-Wall", "-Werror", "-municode"]
                .iter()
                .filter(|_| options.is_empty()),
        )
        .args(options)
        .arg("-o")
        .args([output, &root().join("tests/windows").join(source)])
        .args(libraries))
}

/// Runs a job on a terminal, which Wine makes the program's console, and presses Ctrl-C as soon as the console says
/// `until`; returns all that it said.
fn on_console(place: &TestPlace, job: &str, mut until: Option<&str>) -> Result<String, String> {
    let words = ["wine", &place.program.to_string_lossy(), job].join(" ");
    let mut terminal = Command::new("script");
    for (key, value) in place.command()?.get_envs() {
        terminal.env(key, value.unwrap_or_default());
    }
    let mut running = terminal
        .args(["-q", "-c", &words, "/dev/null"])
        .current_dir(&place.folder)
        // The terminal shows any letter; the console itself keeps code page 437, in which UTF-8 would be other letters.
        .env("LC_ALL", "C.UTF-8")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .map_err(|error| format!("`script` does not start: {error}"))?;
    let (mut keys, mut screen) = (running.stdin.take(), running.stdout.take());
    let (mut said, mut buffer) = (Vec::new(), [0; 4096]);
    while let Some(screen) = &mut screen {
        let count = screen.read(&mut buffer).map_err(|e| e.to_string())?;
        said.extend_from_slice(buffer.get(..count).unwrap_or_default());
        if count == 0 {
            break;
        }
        if let (Some(text), Some(keys)) = (until, &mut keys)
            && String::from_utf8_lossy(&said).contains(text)
        {
            until = None;
            keys.write_all(b"\x03").map_err(|e| e.to_string())?;
        }
    }
    running.wait().map_err(|e| e.to_string())?;
    String::from_utf8(said).map_err(|_| "the console does not show UTF-8".to_owned())
}

/// A port `COM5` of Wine, with the controller of a board on the other end.
struct SerialPort {
    controller: Child,
}

impl SerialPort {
    fn open(here: &TestPlace) -> Result<Self, String> {
        let line = target("systems").join("line");
        let mut controller = here.command()?;
        controller
            .args(["simulate", "controller", "--port"])
            .arg(&line)
            .stdout(Stdio::piped());
        let mut controller = (controller.spawn()).map_err(|e| format!("{e}"))?;
        let mut first = String::new();
        if let Some(said) = controller.stdout.take() {
            // It is there now.
            BufReader::new(said)
                .read_line(&mut first)
                .map_err(|e| e.to_string())?;
        }
        let port = Self { controller };
        run(wine("wine")?
            .args([
                "reg",
                "add",
                r"HKLM\Software\Wine\Ports",
                "/f",
                "/v",
                "COM5",
            ])
            .arg("/d")
            .arg(&line))?;
        // Wine reads them when it starts.
        run(wine("wineserver")?.arg("-k"))?;
        run(wine("wineserver")?.arg("-w"))?;
        keep_server()?;
        Ok(port)
    }
}

impl Drop for SerialPort {
    fn drop(&mut self) {
        let _ = self.controller.kill();
        let _ = self.controller.wait();
    }
}

/// # Errors
/// The names of what is wrong.
pub fn check(here: &TestPlace, place: &TestPlace) -> Result<(), String> {
    let example = place.folder.join(EXAMPLE);
    let mut windows = WindowsCheck {
        place,
        right: files::read(&example.join("errors-13.trax"))?,
        wrong: Vec::new(),
    };
    windows.names_and_lines()?;
    windows.held_files()?;
    windows.console()?;
    windows.ports(here)?;
    judged(&windows.wrong)
}

/// The example that the checks compile.
const EXAMPLE: &str = "examples/huron-k2x8";

/// What has been found to be wrong.
struct WindowsCheck<'p> {
    place: &'p TestPlace,
    /// The compensation of the example.
    right: Vec<u8>,
    wrong: Vec<String>,
}

impl WindowsCheck<'_> {
    fn expect(&mut self, what: &str, holds: bool, said: &str) {
        if !holds {
            self.wrong.push(format!("{what}: {said}"));
        }
    }

    /// Whether a file has these bytes.
    fn is(&self, name: &str, bytes: &[u8]) -> bool {
        files::read(&self.place.folder.join(name)).is_ok_and(|found| found == bytes)
    }

    fn write(&self, name: &str, text: impl AsRef<[u8]>) -> Result<(), String> {
        files::write(&self.place.folder.join(name), text)
    }

    /// Names with backslashes, and files with the line ends of Windows.
    fn names_and_lines(&mut self) -> Result<(), String> {
        let said = self.place.does(&words(
            r"compile examples\huron-k2x8\machine.toml examples\huron-k2x8\errors-13.toml -o backslash.trax",
        ))?;
        let same = self.is("backslash.trax", &self.right);
        self.expect("names with backslashes", same, &said);
        for name in ["machine.toml", "errors-13.toml"] {
            let text = files::read_text(&self.place.folder.join(EXAMPLE).join(name))?;
            self.write(&format!("crlf-{name}"), text.replace('\n', "\r\n"))?;
        }
        let said = self.place.does(&words(
            "compile crlf-machine.toml crlf-errors-13.toml -o crlf.trax",
        ))?;
        let same = self.is("crlf.trax", &self.right);
        self.expect("files with CR LF", same, &said);
        Ok(())
    }

    /// Files that another program holds open.
    fn held_files(&mut self) -> Result<(), String> {
        let hold = target("systems").join("hold.exe");
        compile("hold.c", &hold, &[], &[])?;
        self.write("held.trax", "old")?;
        let holding = TestPlace {
            folder: self.place.folder.clone(),
            program: hold,
            system: self.place.system,
        };
        let inputs = ["machine.toml", "errors-13.toml"].map(|name| format!("{EXAMPLE}/{name}"));
        // Compiles while `file` is held.
        let compiled = |file: &str| {
            let program = self.place.program.to_string_lossy();
            let mut job = vec![file.to_owned(), "60".to_owned(), program.into_owned()];
            job.push("compile".to_owned());
            job.extend(inputs.clone());
            job.extend(words("-o held.trax"));
            holding.does(&job)
        };
        let output = compiled("held.trax")?;
        let is_kept = self.is("held.trax", b"old");
        let none = compiled("other.trax")?;
        let is_replaced = self.is("held.trax", &self.right);
        let input = compiled(&inputs[1])?;
        self.expect(
            "an output that another program holds open is refused by name, and kept",
            output.starts_with("exit code 2\n") && output.contains("held.trax") && is_kept,
            &output,
        );
        self.expect(
            "the same output, not held",
            none.starts_with("exit code 0\n") && is_replaced,
            &none,
        );
        self.expect(
            "an input that another program holds open is refused by name",
            input.starts_with("exit code 2\n") && input.contains("errors-13.toml"),
            &input,
        );
        let partial = files::list(&self.place.folder, "trueaxis-partial")?;
        let left = format!("{partial:?}");
        self.expect("no partial file is left", partial.is_empty(), &left);
        Ok(())
    }

    /// Letters on a console, and Ctrl-C.
    fn console(&mut self) -> Result<(), String> {
        let pose = "pose examples/kolibri/machine.toml examples/kolibri/errors-10.toml --at X=10";
        let said = on_console(self.place, pose, None)?;
        self.expect("a console shows µ", said.contains("(µm)"), &said);
        self.write("kept.trax", "old")?;
        // Takes seconds after it has said this.
        let long = "compile examples/hu40/machine.toml examples/hu40/errors-84.toml -o kept.trax";
        let said = on_console(self.place, long, Some("finding tables"))?;
        let is_kept = self.is("kept.trax", b"old");
        self.expect(
            "Ctrl-C ends it, and its output is as before",
            is_kept,
            &said,
        );
        Ok(())
    }

    /// A serial port with a controller on its other end, and one that is not there.
    fn ports(&mut self, here: &TestPlace) -> Result<(), String> {
        let port = SerialPort::open(here)?;
        let flash = format!("flash {EXAMPLE}/errors-13.trax --port COM5");
        let said = self.place.does(&words(&flash))?;
        self.expect(
            "a compensation goes through a serial port",
            said.starts_with("exit code 0\n") && said.contains("and verified"),
            &said,
        );
        drop(port);
        let said = self.place.does(&words("monitor --port COM77"))?;
        self.expect(
            "a serial port that is not there is refused by name",
            said.starts_with("exit code 2\n") && said.contains("COM77"),
            &said,
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::without_own_lines;

    #[test]
    fn what_wine_itself_says_is_no_message_of_a_program() {
        let said = "wine: could not open working directory L\"C:\\\\windows\", starting in the Windows directory.\n\
             0024:fixme:ver:GetFileVersion stub\nerror: missing.toml: cannot be read\nwinery: a name\nbad:err:or\n";
        let own = "error: missing.toml: cannot be read\nwinery: a name\n";
        assert_eq!(without_own_lines(said), own);
    }
}
