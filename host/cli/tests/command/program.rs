//! Runs the command and captures its output.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use tempfile::TempDir;

/// A file from the examples.
pub fn example(path: &str) -> String {
    format!("{}/../../examples/{path}", env!("CARGO_MANIFEST_DIR"))
}

/// Files of one folder of the examples.
pub fn examples<const N: usize>(folder: &str, names: [&str; N]) -> [String; N] {
    names.map(|name| example(&format!("{folder}/{name}")))
}

/// Runs the command with arguments.
pub fn trueaxis(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueaxis"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs the command and returns standard output. Checks that it exits with `code`.
#[track_caller]
pub fn answer(code: i32, arguments: &[&str]) -> String {
    let output = trueaxis(arguments);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(code), "{said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Like [`answer`], of a command line that has no words with spaces in them.
#[track_caller]
pub fn says(code: i32, line: &str) -> String {
    answer(code, &split(line))
}

/// Like [`says`], of what must exit with 0.
#[track_caller]
pub fn done(line: &str) -> String {
    says(0, line)
}

/// Like `done`, of a command line with `--json`.
pub fn json(line: &str) -> Value {
    serde_json::from_str(&done(&format!("{line} --json"))).unwrap()
}

/// Like `refused`, of a command line.
pub fn refuses(line: &str, parts: &[&str]) {
    refused(&split(line), parts);
}

/// Runs a command line that has no words with spaces in them.
pub fn run(line: &str) -> Output {
    trueaxis(&split(line))
}

#[track_caller]
pub fn has(text: &str, part: &str) {
    assert!(text.contains(part), "`{part}` is not in\n{text}");
}

/// Runs the command. Checks that it exits with 2, prints all of `parts` on standard error, and nothing on standard
/// output.
pub fn refused(arguments: &[&str], parts: &[&str]) {
    let output = trueaxis(arguments);
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(output.stdout.is_empty());
    for part in parts.iter().chain(&["help:"]) {
        assert!(said.contains(part), "`{part}` is not in:\n{said}");
    }
}

/// The arguments of a line, which have no spaces in them.
pub fn split(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

/// The words separated by single spaces, without frames and line breaks.
pub fn plain(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let words = text
        .split_whitespace()
        .filter(|w| !["│", "·", "×"].contains(w));
    words.collect::<Vec<_>>().join(" ")
}

/// A folder for one test.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }
    /// Words of a command line, of which `@NAME` is a file from the examples and `%NAME` one in this folder.
    pub fn words(&self, line: &str) -> Vec<String> {
        let word = |word: &str| match word.split_at_checked(1) {
            Some(("@", name)) => example(name),
            Some(("%", name)) => self.at(name),
            _ => word.to_owned(),
        };
        line.split_whitespace().map(word).collect()
    }
    /// Runs the command with [`words`](Self::words).
    pub fn run(&self, line: &str) -> Output {
        let words = self.words(line);
        trueaxis(&words.iter().map(String::as_str).collect::<Vec<_>>())
    }
    /// Like [`answer`], with [`words`](Self::words), where the command succeeds.
    pub fn answer(&self, line: &str) -> String {
        let words = self.words(line);
        answer(0, &words.iter().map(String::as_str).collect::<Vec<_>>())
    }
    /// Like [`refused`], with [`words`](Self::words).
    pub fn refused(&self, line: &str, parts: &[&str]) {
        let words = self.words(line);
        refused(&words.iter().map(String::as_str).collect::<Vec<_>>(), parts);
    }
    /// The content of a file in it.
    pub fn text(&self, name: &str) -> String {
        std::fs::read_to_string(self.path().join(name)).unwrap()
    }
    pub fn path(&self) -> &Path {
        self.0.path()
    }
    /// The path of a file in it.
    pub fn at(&self, name: &str) -> String {
        self.path().join(name).to_str().unwrap().to_owned()
    }
    /// Writes a file in it with this content.
    pub fn file(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path().join(name), content).unwrap();
        self.at(name)
    }
    /// Names of all files in the folder.
    pub fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.path()).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }
}

/// Blobs shared by several tests, compiled once.
pub struct Blobs {
    folder: TempDir,
}

impl Blobs {
    fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

fn blobs() -> &'static Blobs {
    static BLOBS: OnceLock<Blobs> = OnceLock::new();
    BLOBS.get_or_init(|| {
        let blobs = Blobs {
            folder: tempfile::tempdir().unwrap(),
        };
        for (name, machine, errors) in [
            (
                "huron",
                "huron-k2x8/machine.toml",
                "huron-k2x8/errors-13.toml",
            ),
            (
                "length",
                "huron-k2x8/machine-tool-length.toml",
                "huron-k2x8/errors-13.toml",
            ),
            ("kolibri", "kolibri/machine.toml", "kolibri/errors-12.toml"),
            ("mill-21", "mill-21/machine.toml", "mill-21/errors-21.toml"),
            (
                "xyzac-trt",
                "linuxcnc-xyzac-trt/machine.toml",
                "linuxcnc-xyzac-trt/errors-11.toml",
            ),
        ] {
            let path = blobs.at(name);
            let path = path.to_str().unwrap();
            answer(
                0,
                &[
                    "compile",
                    &example(machine),
                    &example(errors),
                    "-o",
                    path,
                    "--random",
                    "200",
                ],
            );
        }
        blobs
    })
}

/// One of the blobs `huron`, `length` (the same with tool length), `kolibri` (with backlash), `mill-21`,
/// `xyzac-trt`.
pub fn blob(name: &str) -> String {
    blobs().at(name).to_str().unwrap().to_owned()
}
