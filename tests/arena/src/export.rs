//! The public part of a round, as a folder.

use crate::task::{Hidden, Task};
use std::fmt::Write;
use std::path::Path;
use std::{fs, io};

/// How the data are cited.
const CITATION: &str = include_str!("../CITATION.cff");

/// The mark of a round, which a submission repeats: scores with another seed would be those of other machines. It is
/// that of the public files of its first machine (FNV-1a).
#[must_use]
pub fn mark(first: &Task) -> String {
    let texts = first.measured.files().into_iter().map(|(_, text)| text);
    let bytes = texts
        .chain([first.machine_file.as_str()])
        .flat_map(str::bytes);
    let hash = bytes.fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    format!("{hash:016x}")
}

/// The folder of a machine in an exported round and in a submission.
#[must_use]
pub fn folder(number: usize) -> String {
    format!("{number:03}")
}

/// Positions to answer, as a file: the axes (mm, deg), and the time in the log of temperatures if there is one.
#[must_use]
pub fn positions(task: &Task) -> String {
    let axes = task.machine.axes.iter();
    let mut names: Vec<String> = axes.map(|a| a.letter.to_string()).collect();
    if task.warm.is_some() {
        names.push("time_s".to_owned());
    }
    let mut text = names.join(",") + "\n";
    for position in &task.positions {
        let axes = position.command.axes.iter().take(task.machine.axes.len());
        let mut cells: Vec<String> = axes.map(f32::to_string).collect();
        cells.extend(position.time.map(|time| time.to_string()));
        let _ = writeln!(text, "{}", cells.join(","));
    }
    text
}

/// The public files of a machine: names and contents.
#[must_use]
pub fn files(task: &Task) -> Vec<(&'static str, String)> {
    let asked: Vec<String> = task.asked.iter().map(|p| format!("{p}\n")).collect();
    let mut files = vec![
        ("machine.toml", task.machine_file.clone()),
        ("positions.csv", positions(task)),
        ("asked.csv", format!("parameter\n{}", asked.concat())),
    ];
    let measured = task.measured.files().into_iter();
    files.extend(measured.map(|(name, text)| (name, text.to_owned())));
    if let Some(warm) = &task.warm {
        files.push(("temperatures.csv", warm.measured_file.clone()));
        files.push(("temperatures-of-positions.csv", warm.unseen_file.clone()));
    }
    files
}

/// Writes the public part of the first `count` machines of a round into a new folder.
///
/// # Errors
/// If it cannot be written, or exists.
pub fn export(path: &Path, round: u64, count: usize) -> io::Result<()> {
    fs::create_dir(path)?;
    for number in 0..count {
        let task = Hidden::new(round, number).task;
        if number == 0 {
            fs::write(path.join("arena.toml"), heading(&mark(&task), count))?;
            fs::write(path.join("CITATION.cff"), CITATION)?;
        }
        let own = path.join(folder(number));
        fs::create_dir(&own)?;
        for (name, text) in files(&task) {
            fs::write(own.join(name), text)?;
        }
    }
    Ok(())
}

fn heading(mark: &str, count: usize) -> String {
    format!(
        "# A round of the trueaxis arena; the manual's page \"The arena\" describes the files.\n\
         round = \"{mark}\"\n\
         machines = {count}\n\
         licence = \"CC-BY-4.0\"  # https://creativecommons.org/licenses/by/4.0/legalcode; cite as in CITATION.cff\n"
    )
}
