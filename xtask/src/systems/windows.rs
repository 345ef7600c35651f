//! What is different on Windows: names of files, line ends, files that another program holds open, serial ports.

use super::{TestPlace, words};
use crate::files;
use crate::process::{judged, root, run, target};
use std::path::Path;
use std::process::Command;

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

/// Keeps Wine's server for the next command, which would start it for seconds; it ends a minute after the last.
///
/// # Errors
/// If it does not start.
pub fn keep_server() -> Result<(), String> {
    run(wine("wineserver")?.arg("-p60"))
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

/// # Errors
/// The names of what is wrong.
pub fn check(place: &TestPlace) -> Result<(), String> {
    let folder = &place.folder;
    let example = "examples/huron-k2x8";
    let right = files::read(&folder.join(example).join("errors-13.trax"))?;
    let mut wrong = Vec::new();
    let mut expect = |what: &str, holds: bool, said: &str| {
        if !holds {
            wrong.push(format!("{what}: {said}"));
        }
    };

    let said = place.does(&words(r"compile examples\huron-k2x8\machine.toml examples\huron-k2x8\errors-13.toml -o backslash.trax"))?;
    let same = files::read(&folder.join("backslash.trax")).is_ok_and(|bytes| bytes == right);
    expect("names with backslashes", same, &said);

    for name in ["machine.toml", "errors-13.toml"] {
        let text = files::read_text(&folder.join(example).join(name))?;
        files::write(
            &folder.join(format!("crlf-{name}")),
            text.replace('\n', "\r\n"),
        )?;
    }
    let said = place.does(&words(
        "compile crlf-machine.toml crlf-errors-13.toml -o crlf.trax",
    ))?;
    let same = files::read(&folder.join("crlf.trax")).is_ok_and(|bytes| bytes == right);
    expect("files with CR LF", same, &said);

    let hold = target("systems").join("hold.exe");
    compile("hold.c", &hold, &[], &[])?;
    files::write(&folder.join("held.trax"), "old")?;
    let inputs = [
        format!("{example}/machine.toml"),
        format!("{example}/errors-13.toml"),
    ];
    let holding = TestPlace {
        folder: folder.clone(),
        program: hold,
        system: place.system,
    };
    let program = place.program.to_string_lossy().into_owned();
    let compiled = |output: &str| -> Vec<String> {
        let mut job = words(&format!("{output} 60"));
        job.push(program.clone());
        job.push("compile".to_owned());
        job.extend(inputs.clone());
        job.extend(words("-o held.trax"));
        job
    };
    let said = holding.does(&compiled("held.trax"))?;
    let kept = files::read(&folder.join("held.trax"))? == b"old";
    expect(
        "an output that another program holds open is refused by name, and kept",
        said.starts_with("exit code 2\n") && said.contains("held.trax") && kept,
        &said,
    );
    let said = holding.does(&compiled("other.trax"))?;
    let replaced = files::read(&folder.join("held.trax"))? == right;
    expect(
        "the same output, not held",
        said.starts_with("exit code 0\n") && replaced,
        &said,
    );
    let said = holding.does(&compiled(&inputs[1]))?;
    expect(
        "an input that another program holds open is refused by name",
        said.starts_with("exit code 2\n") && said.contains("errors-13.toml"),
        &said,
    );
    let partial = files::list(folder, "trueaxis-partial")?;
    expect(
        "no partial file is left",
        partial.is_empty(),
        &format!("{partial:?}"),
    );

    let said = place.does(&words("monitor --port COM77"))?;
    expect(
        "a serial port that is not there is refused by name",
        said.starts_with("exit code 2\n") && said.contains("COM77"),
        &said,
    );
    judged(&wrong)
}
