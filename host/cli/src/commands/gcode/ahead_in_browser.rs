//! A browser has one thread for a command: a file is written as it is computed.

use std::io::{Result, Write};

/// Fills a file; what `fill` returns. It has seen itself whether all is written.
pub fn ahead<T, F: Write>(file: &mut F, fill: impl FnOnce(&mut F) -> T) -> (T, Result<()>) {
    (fill(file), Ok(()))
}
