//! Transports of the link: a serial device, a pseudo-terminal, or TCP.

use crate::port::{BadPort, Port};
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

/// Opens `tcp:host:port`, or else a serial device or pseudo-terminal, at `baud` bits per second.
///
/// # Errors
/// [`BadPort`]
pub fn open(name: &str, baud: u32) -> Result<Box<dyn Port + Send>, BadPort> {
    match name.strip_prefix("tcp:") {
        Some(address) => Ok(Box::new(Tcp::open(address)?)),
        None => Ok(Box::new(Serial::open(name, baud)?)),
    }
}

/// A TCP connection to an emulator or a device server.
pub struct Tcp(TcpStream);

impl Tcp {
    /// Connects to `host:port`.
    ///
    /// # Errors
    /// [`BadPort`]
    pub fn open(address: &str) -> Result<Self, BadPort> {
        let number = address
            .rsplit_once(':')
            .map(|(_, port)| port.parse::<u16>());
        if !matches!(number, Some(Ok(_))) {
            return Err(BadPort::Address(format!("tcp:{address}")));
        }
        let failed = |error: io::Error| BadPort::Open(format!("tcp:{address}"), error.to_string());
        let stream = TcpStream::connect(address).map_err(failed)?;
        // A request is one small packet, and its answer is awaited.
        stream.set_nodelay(true).map_err(failed)?;
        Ok(Self(stream))
    }
}

impl Port for Tcp {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.0.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        // Zero would mean no time limit.
        let patience = patience.max(Duration::from_millis(1));
        self.0.set_read_timeout(Some(patience))?;
        match self.0.read(buffer) {
            Ok(0) => Err(ErrorKind::ConnectionAborted.into()),
            other => nothing_is_zero(other),
        }
    }
}

/// A serial device or a pseudo-terminal: 8 data bits, no parity, 1 stop bit, no flow control.
pub struct Serial(Box<dyn serialport::SerialPort>);

impl Serial {
    /// Opens a device by its path or name.
    ///
    /// # Errors
    /// [`BadPort`]
    pub fn open(name: &str, baud: u32) -> Result<Self, BadPort> {
        let port = serialport::new(name, baud).open();
        port.map(Self)
            .map_err(|error| BadPort::Open(name.to_owned(), error.to_string()))
    }
}

impl Port for Serial {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        // Timeout for writing.
        self.0.set_timeout(Duration::from_secs(5))?;
        self.0.write_all(bytes)
    }

    fn receive(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<usize> {
        self.0.set_timeout(patience.max(Duration::from_millis(1)))?;
        match self.0.read(buffer) {
            Ok(0) => Err(ErrorKind::ConnectionAborted.into()),
            other => nothing_is_zero(other),
        }
    }
}

fn nothing_is_zero(read: io::Result<usize>) -> io::Result<usize> {
    match read {
        Err(error)
            if [
                ErrorKind::TimedOut,
                ErrorKind::WouldBlock,
                ErrorKind::Interrupted,
            ]
            .contains(&error.kind()) =>
        {
            Ok(0)
        }
        other => other,
    }
}
