//! A temporary file, which is removed when it is no longer used.

use std::fs::{File, OpenOptions};
use std::io::{BufReader, BufWriter, ErrorKind, Result, Seek, Write};
use std::path::PathBuf;

/// What is written into it can be read again.
pub struct Scratch {
    path: PathBuf,
    file: BufWriter<File>,
}

impl Scratch {
    /// An empty one, in the folder of the system for such files.
    pub fn new() -> Result<Self> {
        for number in 0..u32::MAX {
            let name = format!("trueaxis-{}-{number}.map", std::process::id());
            let path = std::env::temp_dir().join(name);
            let mut options = OpenOptions::new();
            match options.read(true).write(true).create_new(true).open(&path) {
                Ok(file) => {
                    let file = BufWriter::new(file);
                    return Ok(Self { path, file });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    /// What was written, from its beginning.
    pub fn read(&mut self) -> Result<BufReader<&File>> {
        self.file.flush()?;
        self.file.get_ref().rewind()?;
        Ok(BufReader::new(self.file.get_ref()))
    }
}

impl Write for Scratch {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn what_was_written_is_read_and_nothing_is_left() {
        let mut scratch = Scratch::new().unwrap();
        let path = scratch.path.clone();
        scratch.write_all(b"lines").unwrap();
        let mut text = String::new();
        scratch.read().unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "lines");
        drop(scratch);
        assert!(!path.exists());
    }
}
