//! The transport of the link in a browser: the file `/serial`, which the page connects with the port that its user has
//! chosen.

use crate::port::{BadPort, Port};
use std::fs::File;
use std::io::{self, Read, Write};
use std::time::{Duration, Instant};

/// Opens the port `/serial`; the page has set its baud rate.
///
/// # Errors
/// [`BadPort::Open`]: no port is connected.
pub fn open(name: &str, _baud: u32) -> Result<Box<dyn Port + Send>, BadPort> {
    match File::options().read(true).write(true).open(name) {
        Ok(file) => Ok(Box::new(Serial(file))),
        Err(error) => Err(BadPort::Open(name.to_owned(), error.to_string())),
    }
}

struct Serial(File);

impl Port for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        let end = Instant::now() + patience;
        loop {
            // The page waits some milliseconds for bytes. None is no end of the file.
            match self.0.read(buffer)? {
                0 if Instant::now() < end => {}
                count => return Ok(count),
            }
        }
    }
}
