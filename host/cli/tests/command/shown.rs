//! The output shown in the readme and the manual is what the command prints, on any machine.
//!
//! Words and counts must be identical. Figures with a decimal point may differ by one unit of their last digit: they
//! come from functions of the system's mathematical library, which are not identical to the last bit everywhere, and
//! for a value close to the middle between two printed ones that bit decides. Everything printed is rounded far
//! above that bit, except by `eval`, which prints every bit of the runtime; see [`EVAL`].

use crate::program::{Folder, example, trueaxis};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use trueaxis_tests::shown::same;

/// Permitted difference of corrections printed by `eval`, in mm or deg. Samples are f64 results rounded to f32, so
/// the last bit of each (4e-9 at 0.05 mm) may differ on another system, in each of up to five terms. This is a
/// hundredth of the difference from the reference correction that the tolerance permits.
const EVAL: f64 = 1e-7;

/// A command and the lines shown below it.
struct Shown {
    place: String,
    words: Vec<String>,
    lines: Vec<String>,
}

/// A file of the repository.
fn page(path: &str) -> String {
    let whole = format!("{}/../../{path}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(whole).unwrap()
}

/// The commands that a page shows with their output, in blocks that begin with `$ ` or that follow a block with only
/// a `cargo run` command.
fn shown(path: &str) -> Vec<Shown> {
    let text = page(path);
    let mut found: Vec<Shown> = Vec::new();
    let mut fence: Option<bool> = None;
    let mut from_cargo: Option<Shown> = None;
    for (number, line) in text.lines().enumerate() {
        let place = format!("{path}, line {}", number + 1);
        if let Some(language) = line.strip_prefix("```") {
            fence = match fence {
                Some(_) => None,
                None => {
                    let plain = language.is_empty();
                    if plain && let Some(command) = from_cargo.take() {
                        found.push(command);
                        Some(true)
                    } else {
                        Some(false)
                    }
                }
            };
            continue;
        }
        let words = |command: &str| command.split_whitespace().map(str::to_owned).collect();
        let new = |command: &str| Shown {
            place: place.clone(),
            words: words(command),
            lines: Vec::new(),
        };
        match fence {
            None => {}
            Some(shows) => {
                if let Some(command) = line.strip_prefix("$ ") {
                    found.push(new(command));
                    fence = Some(true);
                } else if shows {
                    found.last_mut().unwrap().lines.push(line.to_owned());
                } else if let Some((cargo, command)) = line.split_once(" -- ")
                    && cargo.starts_with("cargo run ")
                    && cargo.ends_with("--bin trueaxis")
                {
                    from_cargo = Some(new(&format!("trueaxis {command}")));
                }
            }
        }
    }
    found
}

/// A simulated controller, which runs beside the commands that follow it on its page.
struct Controller {
    child: Child,
    /// Port on the page, and the one that was free.
    ports: [String; 2],
}

impl Controller {
    /// Starts it; returns its first line as it would be with the page's port, too.
    fn start(arguments: &[&str]) -> (Self, String) {
        let at = arguments.iter().position(|word| *word == "--port").unwrap() + 1;
        let shown = arguments[at].to_owned();
        let mut arguments = arguments.to_vec();
        arguments[at] = "tcp:127.0.0.1:0";
        let mut command = Command::new(env!("CARGO_BIN_EXE_trueaxis"));
        let command = command.args(arguments).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut first = String::new();
        let mut out = BufReader::new(child.stdout.take().unwrap());
        out.read_line(&mut first).unwrap();
        // Its further lines are read by nobody, and must not stop it.
        std::thread::spawn(move || std::io::copy(&mut out, &mut std::io::sink()));
        let (free, _) = first.split_once(": ").unwrap();
        let ports = [shown, free.to_owned()];
        let line = first.replace(&ports[1], &ports[0]);
        (Self { child, ports }, line)
    }
}

impl Drop for Controller {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs the commands of a page, in a folder with the files of earlier commands.
#[track_caller]
fn check(
    folder: &Folder,
    controller: &mut Option<Controller>,
    shown: &Shown,
) -> Result<(), String> {
    let Shown {
        place,
        words,
        lines,
    } = shown;
    let (program, arguments) = words.split_first().unwrap();
    if program == "cat" {
        folder.file(&arguments[0], lines.join("\n") + "\n");
        return Ok(());
    }
    assert_eq!(program, "trueaxis", "{place}");
    let local = |word: &String| match word.strip_prefix("examples/") {
        Some(path) => example(path),
        None if word.parse::<f64>().is_ok() => word.clone(),
        None if word.starts_with("tcp:") => match &controller {
            Some(controller) if controller.ports[0] == *word => controller.ports[1].clone(),
            _ => word.clone(),
        },
        None if word.contains('.') && !word.starts_with('-') => folder.at(word),
        None => word.clone(),
    };
    let arguments: Vec<String> = arguments.iter().map(local).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let printed = if arguments[..2] == ["simulate", "controller"] {
        let (started, line) = Controller::start(&arguments);
        *controller = Some(started);
        line
    } else {
        let output = trueaxis(&arguments);
        let printed = match output.status.code() {
            Some(0) => output.stdout,
            _ => output.stderr,
        };
        String::from_utf8(printed).unwrap()
    };
    // Pages show files by their name only.
    let here = format!("{}/", folder.path().display());
    let mut printed = printed.replace(&here, "");
    if let Some(Controller { ports, .. }) = controller {
        printed = printed.replace(&ports[1], &ports[0]);
    }
    let printed = printed.replace(&example(""), "examples/");
    let least = if arguments[0] == "eval" { EVAL } else { 0.0 };
    let mut printed_lines = printed.trim_end().lines();
    let end = lines.iter().rposition(|line| !line.trim().is_empty());
    for line in &lines[..end.map_or(0, |end| end + 1)] {
        if line == "…" {
            return Ok(());
        }
        let found = printed_lines.next().unwrap_or("nothing");
        if !same(found, line, least) {
            return Err(format!(
                "{place} shows\n{line}\nbut it is\n{found}\nin\n{printed}"
            ));
        }
    }
    match printed_lines.next() {
        None => Ok(()),
        Some(more) => Err(format!("{place} does not show\n{more}")),
    }
}

#[test]
fn every_output_in_the_readme_and_the_manual_is_what_the_command_prints() {
    let mut pages = vec!["README.md".to_owned()];
    let manual = format!("{}/../../docs/src", env!("CARGO_MANIFEST_DIR"));
    for entry in std::fs::read_dir(manual).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name.ends_with(".md") {
            pages.push(format!("docs/src/{name}"));
        }
    }
    pages.sort();
    let mut count = 0;
    let mut wrong = Vec::new();
    for path in &pages {
        let folder = Folder::new();
        // The copy of an error file with a mistyped name in the manual.
        let errors = page("examples/huron-k2x8/errors-13.toml");
        folder.file("errors.toml", errors.replace("EA0Z", "EA0Q"));
        let commands = shown(path);
        count += commands.len();
        let mut controller = None;
        for command in &commands {
            wrong.extend(check(&folder, &mut controller, command).err());
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    // A change of the pages must not leave this test without anything to check.
    assert!(count >= 8, "only {count} outputs were found");
}

#[test]
fn every_program_in_the_readme_and_the_manual_is_in_its_file() {
    let mut count = 0;
    for path in [
        "README.md",
        "docs/src/runtime.md",
        "docs/src/c-interface.md",
    ] {
        let text = page(path);
        // A program is followed by the file that it is, or that it comes from.
        for (end, after) in text.match_indices("\n```\n\n(") {
            let fence = text[..end].rfind("\n```").unwrap();
            let (_, block) = text[fence + 1..=end].split_once('\n').unwrap();
            let (is, rest) = text[end + after.len()..].split_once('`').unwrap();
            let file = page(rest.split_once('`').unwrap().0);
            match is {
                "This is " => assert_eq!(block, file, "{path}"),
                "From " => assert!(file.contains(block), "{path}: elsewhere\n{block}"),
                other => panic!("{path}: {other}"),
            }
            count += 1;
        }
    }
    assert_eq!(count, 4);
}

#[test]
fn no_page_of_the_manual_includes_a_file() {
    // Sites that host code show the source of the manual, where an include is not executed.
    let manual = format!("{}/../../docs/src", env!("CARGO_MANIFEST_DIR"));
    for entry in std::fs::read_dir(manual).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "md") {
            let text = std::fs::read_to_string(&path).unwrap();
            assert!(!text.contains("{{#"), "{}", path.display());
        }
    }
}

#[test]
fn figures_may_differ_by_a_unit_of_their_last_digit_and_counts_by_nothing() {
    let shown = "Y 0.13014 mm, 16 tables (worst at 174.7, -8.8)";
    for (printed, is_same) in [
        ("Y  0.13015 mm, 16 tables (worst at 174.7, -8.9)", true),
        ("Y 0.13016 mm, 16 tables (worst at 174.7, -8.8)", false),
        ("Y 0.13014 mm, 17 tables (worst at 174.7, -8.8)", false),
        ("Y 0.13014 mm, 16 tables (worst at 174.7, 8.8)", false),
        ("Z 0.13014 mm, 16 tables (worst at 174.7, -8.8)", false),
        ("Y 0.13014 mm, 16 tables (worst at 174.7)", false),
    ] {
        assert_eq!(same(printed, shown, 0.0), is_same, "{printed}");
    }
}
