//! File operations; the message of a failure names the file.

use std::fs;
use std::path::{Path, PathBuf};

fn named<T>(path: &Path, done: std::io::Result<T>) -> Result<T, String> {
    done.map_err(|error| format!("{}: {error}", path.display()))
}

/// The bytes of a file.
pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    named(path, fs::read(path))
}

/// The text of a file.
pub fn read_text(path: &Path) -> Result<String, String> {
    named(path, fs::read_to_string(path))
}

/// Writes a file, in place of one that is there.
pub fn write(path: &Path, contents: impl AsRef<[u8]>) -> Result<(), String> {
    named(path, fs::write(path, contents))
}

/// Creates a folder and its parents, unless it exists.
pub fn folder(path: PathBuf) -> Result<PathBuf, String> {
    named(&path, fs::create_dir_all(&path)).map(|()| path)
}

/// Copies a file. An existing file is replaced, not overwritten, so a running program keeps its version.
pub fn copy(from: &Path, to: &Path) -> Result<(), String> {
    let _ = fs::remove_file(to);
    let copied = fs::copy(from, to);
    copied.map_err(|e| format!("{} to {}: {e}", from.display(), to.display()))?;
    Ok(())
}

/// The files of a folder with this extension, in order.
pub fn list(folder: &Path, extension: &str) -> Result<Vec<PathBuf>, String> {
    let entries = named(folder, fs::read_dir(folder))?;
    let mut paths = Vec::new();
    for entry in entries {
        paths.push(named(folder, entry)?.path());
    }
    paths.retain(|path| path.extension().is_some_and(|e| e == extension));
    paths.sort();
    Ok(paths)
}
