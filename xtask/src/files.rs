//! Files; the message of a failure names the file.

use std::fs;
use std::path::Path;

fn named<T>(path: &Path, done: std::io::Result<T>) -> Result<T, String> {
    done.map_err(|error| format!("{}: {error}", path.display()))
}

pub fn read(path: &Path) -> Result<Vec<u8>, String> {
    named(path, fs::read(path))
}
