//! Writing files so that no reader ever sees half of one, and printing answers.

use super::bad_input::BadInput;
use super::{files, replace};
use serde::Serialize;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use trueaxis_report::picture::Picture;

/// Whether standard output belongs to the content that `-o -` sends there. What is otherwise printed there then goes to
/// standard error.
static IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// True for `-`, which is standard output in place of a file.
pub fn is_screen(output: &Path) -> bool {
    output == Path::new("-")
}

/// Called before the work begins: refuses an output that is also an input or whose folder does not exist, and
/// removes the partial file of an earlier run that was killed while writing.
pub fn prepare(output: &Path, inputs: &[&Path]) -> Result<(), BadInput> {
    if is_screen(output) {
        IS_TAKEN.store(true, Ordering::Relaxed);
        return Ok(());
    }
    if let Some(folder) = files::missing_folder(output) {
        return Err(BadInput::new(
            format!(
                "{}: cannot be written: there is no folder {}",
                output.display(),
                folder.display()
            ),
            "make the folder, or give -o a name in one that exists",
        ));
    }
    let real = |path: &Path| path.canonicalize().ok();
    let written = real(output);
    match inputs
        .iter()
        .find(|input| written.is_some() && real(input) == written)
    {
        Some(input) => Err(BadInput::new(
            format!(
                "the output {} is the input {}",
                output.display(),
                input.display()
            ),
            "give -o another name",
        )),
        None => {
            replace::tidy(output);
            Ok(())
        }
    }
}

/// Writes a whole file; see [`replace`]. If anything fails or the program is interrupted, the old file remains.
pub fn write(path: &Path, bytes: &[u8]) -> Result<(), BadInput> {
    if is_screen(path) {
        let text = std::str::from_utf8(bytes).map_err(|_| {
            BadInput::new(
                "this is not text, and is not written to the screen",
                "give -o the name of a file, or /dev/stdout",
            )
        })?;
        return sent(&mut std::io::stdout().lock(), text).map(|_| ());
    }
    may_be_new(path)?;
    replace::replace(path, bytes).map_err(|error| unwritable(path, &error))
}

/// Writes whole files; see [`write`]. None is new unless all of them are on the disk.
pub fn write_all(files: &[(PathBuf, String)]) -> Result<(), BadInput> {
    files.iter().try_for_each(|(path, _)| may_be_new(path))?;
    let Some(((path, text), rest)) = files.split_first() else {
        return Ok(());
    };
    if rest.iter().any(|(other, _)| replace::is_same(other, path)) && !is_screen(path) {
        return Err(BadInput::new(
            format!("{} would be written twice", path.display()),
            "give the results different names",
        ));
    }
    if is_screen(path) {
        write(path, text.as_bytes())?;
        return write_all(rest);
    }
    let mut others = None;
    let done = replace::replace_by(
        path,
        |file| file.write_all(text.as_bytes()),
        |_| {
            let written = others.insert(write_all(rest));
            written
                .as_ref()
                .map_err(|_| ErrorKind::Other.into())
                .copied()
        },
    );
    match others {
        Some(written) => written?,
        // A device takes what it gets.
        None if done.is_ok() => write_all(rest)?,
        None => {}
    }
    done.map_err(|error| unwritable(path, &error))
}

/// A file that the error file refers to stays as it is.
fn may_be_new(path: &Path) -> Result<(), BadInput> {
    if !files::is_referred(path) {
        return Ok(());
    }
    Err(BadInput::new(
        format!(
            "{}: not written, because the error file refers to it",
            path.display()
        ),
        "give -o another name or folder",
    ))
}

fn unwritable(path: &Path, error: &std::io::Error) -> BadInput {
    BadInput::new(
        format!("{}: cannot be written: {error}", path.display()),
        "give a name in an existing folder with write permission and room; an old file of this name is unchanged",
    )
}

/// Where a copy of a file can be kept: the first of the names that is free or has these contents, by their number from 1.
pub fn kept_at(bytes: &[u8], name: impl Fn(usize) -> PathBuf) -> Result<PathBuf, BadInput> {
    let mut number = 1;
    loop {
        let path = name(number);
        if path.symlink_metadata().is_err() || files::read_bytes(&path)? == bytes {
            return Ok(path);
        }
        number += 1;
    }
}

/// Makes a folder if it is missing; `option` is how another one is given.
pub fn make_folder(folder: &Path, option: &str) -> Result<(), BadInput> {
    std::fs::create_dir_all(folder).map_err(|error| {
        BadInput::new(
            format!("{} cannot be made: {error}", folder.display()),
            format!("give a folder that can be written to ({option})"),
        )
    })
}

/// Writes pictures into a folder, which is made if it is missing: each into its own file.
pub fn write_pictures(
    folder: &Path,
    pictures: impl IntoIterator<Item = (String, Picture)>,
) -> Result<(), BadInput> {
    make_folder(folder, "--pictures")?;
    for (name, picture) in pictures {
        let path = folder.join(format!("{name}.svg"));
        write(&path, picture.file().as_bytes())?;
    }
    Ok(())
}

/// Writes to standard output. A reader that has closed the pipe is not an error.
pub fn print(text: &str) -> Result<(), BadInput> {
    stream(text).map(|_| ())
}

/// Prints a part of the output; returns false if the reader has closed the pipe and nothing more need be written.
pub fn stream(text: &str) -> Result<bool, BadInput> {
    match IS_TAKEN.load(Ordering::Relaxed) {
        true => sent(&mut std::io::stderr().lock(), text),
        false => sent(&mut std::io::stdout().lock(), text),
    }
}

fn sent(out: &mut dyn Write, text: &str) -> Result<bool, BadInput> {
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(BadInput::new(
            format!("standard output cannot be written: {error}"),
            "check where it is redirected to",
        )),
    }
}

/// Writes a text to a file and prints the name of the file followed by `said`. Without a file, prints the text.
pub fn write_or_print(output: Option<&Path>, text: &str, said: &str) -> Result<(), BadInput> {
    let Some(path) = output else {
        return print(text);
    };
    write(path, text.as_bytes())?;
    print(&format!("{}: {said}\n", path.display()))
}

/// Prints JSON to standard output.
pub fn print_json(value: &impl Serialize) -> Result<(), BadInput> {
    print(&json(value)?)
}

/// Prints an answer for programs, or a text for people.
pub fn print_answer(
    is_json: bool,
    answer: &impl Serialize,
    text: impl FnOnce() -> String,
) -> Result<(), BadInput> {
    match is_json {
        true => print_json(answer),
        false => print(&text()),
    }
}

/// A word of a command line for a shell.
pub fn quoted(word: impl ToString) -> String {
    let word = word.to_string();
    let is_plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%~".contains(c);
    match !word.is_empty() && word.chars().all(is_plain) {
        true => word,
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

/// A value as JSON, with its line end.
pub fn json(value: &impl Serialize) -> Result<String, BadInput> {
    let text = serde_json::to_string_pretty(value).map_err(|error| {
        BadInput::new(
            format!("the answer cannot be written as JSON: {error}"),
            "leave out --json",
        )
    })?;
    Ok(text + "\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_several_files_none_is_new_unless_all_can_be() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("a"), "old").unwrap();
        let files = ["a", "b", "there/c"].map(|name| (at(name), name.to_owned()));
        let said = write_all(&files).unwrap_err();
        assert!(said.to_string().contains("there"), "{said}");
        assert_eq!(std::fs::read_to_string(at("a")).unwrap(), "old");
        assert!(!at("b").exists());
        std::fs::create_dir(at("there")).unwrap();
        write_all(&files).unwrap();
        for (path, text) in &files {
            assert_eq!(std::fs::read_to_string(path).unwrap(), *text);
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 3);
    }
}
