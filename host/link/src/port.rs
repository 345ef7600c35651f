//! What the link needs of a transport.

use std::io;
use std::time::Duration;

/// Bytes to and from a controller.
pub trait Port {
    /// Sends all bytes.
    ///
    /// # Errors
    /// The other end is disconnected.
    fn send(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns received bytes as soon as there are any, or 0 after `patience`.
    ///
    /// # Errors
    /// The other end is disconnected.
    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize>;

    /// Lets time pass.
    fn wait(&mut self, time: Duration) {
        std::thread::sleep(time);
    }
}

impl<P: Port + ?Sized> Port for Box<P> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        (**self).send(bytes)
    }
    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        (**self).receive(buffer, patience)
    }
    fn wait(&mut self, time: Duration) {
        (**self).wait(time);
    }
}

/// Why a port cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum BadPort {
    /// `tcp:` is not followed by a host and a port number.
    #[error("`{0}` is not a `tcp:host:port`")]
    Address(String),
    /// It cannot be opened.
    #[error("{0}: cannot be opened: {1}")]
    Open(String, String),
}

impl BadPort {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Address(_) => "give tcp:HOST:PORT, for example tcp:localhost:4444",
            Self::Open(..) => {
                "check that the controller is connected, that the name is right and that no other program has the port open"
            }
        }
    }
}
