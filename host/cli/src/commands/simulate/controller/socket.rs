//! The other end of a port.

use crate::commands::bad_input::BadInput;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream, ToSocketAddrs};
use trueaxis_firmware::desktop::Line;

/// What a command with `--port` connects to.
pub enum Socket {
    /// One connection after the other.
    Tcp {
        listener: TcpListener,
        stream: Option<TcpStream>,
        name: String,
    },
    #[cfg(unix)]
    Pty(pty::Pty),
}

impl Socket {
    /// Opens `tcp:HOST:PORT` on this computer, or else makes a pseudo-terminal of this name.
    pub fn open(port: &str) -> Result<Self, BadInput> {
        match port.strip_prefix("tcp:") {
            Some(address) => Self::tcp(address),
            #[cfg(unix)]
            None => Ok(Self::Pty(pty::Pty::open(port)?)),
            #[cfg(not(unix))]
            None => Err(BadInput::new(
                format!("{port}: there are no pseudo-terminals on this system"),
                "give tcp:127.0.0.1:PORT, for example tcp:127.0.0.1:4444",
            )),
        }
    }

    fn tcp(address: &str) -> Result<Self, BadInput> {
        let bad = |why: String, remedy| BadInput::new(format!("tcp:{address}: {why}"), remedy);
        let form = "give tcp:127.0.0.1:PORT, for example tcp:127.0.0.1:4444";
        let addresses = address
            .to_socket_addrs()
            .map_err(|error| bad(error.to_string(), form))?;
        let addresses: Vec<_> = addresses.collect();
        // Whoever reaches it may change everything.
        if !addresses.iter().all(|address| address.ip().is_loopback()) {
            let why = "it would be reached from other computers";
            return Err(bad(why.to_owned(), form));
        }
        let failed = |error: std::io::Error| {
            let remedy = "choose another port: another program may use this one";
            bad(error.to_string(), remedy)
        };
        let listener = TcpListener::bind(&addresses[..]).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        // Port 0 is any free one.
        let name = format!("tcp:{}", listener.local_addr().map_err(failed)?);
        let stream = None;
        Ok(Self::Tcp {
            listener,
            stream,
            name,
        })
    }

    /// What to give as `--port`.
    pub fn name(&self) -> &str {
        match self {
            Self::Tcp { name, .. } => name,
            #[cfg(unix)]
            Self::Pty(pty) => pty.name(),
        }
    }

    /// Moves bytes both ways, as many as there are.
    pub fn exchange(&mut self, line: &mut Line) {
        match self {
            Self::Tcp {
                listener, stream, ..
            } => {
                if stream.is_none() {
                    *stream = accepted(listener);
                    // Answers to a connection that is gone.
                    line.outgoing.clear();
                }
                if stream.as_mut().is_some_and(|open| !exchange(open, line)) {
                    *stream = None;
                }
            }
            #[cfg(unix)]
            Self::Pty(pty) => pty.exchange(line),
        }
    }
}

/// The next connection, if there is one and it is still there.
fn accepted(listener: &TcpListener) -> Option<TcpStream> {
    let (stream, _) = listener.accept().ok()?;
    stream.set_nonblocking(true).ok()?;
    stream.set_nodelay(true).ok()?;
    Some(stream)
}

/// Moves bytes both ways; false if the other end is closed.
fn exchange(stream: &mut (impl Read + Write), line: &mut Line) -> bool {
    let later = [
        ErrorKind::WouldBlock,
        ErrorKind::TimedOut,
        ErrorKind::Interrupted,
    ];
    let mut buffer = [0; 4096];
    match stream.read(&mut buffer) {
        Ok(0) => return false,
        Ok(count) => line.incoming.extend(&buffer[..count]),
        Err(error) if later.contains(&error.kind()) => {}
        Err(_) => return false,
    }
    if line.outgoing.is_empty() {
        return true;
    }
    match stream.write(&line.outgoing) {
        Ok(count) => {
            line.outgoing.drain(..count);
            true
        }
        Err(error) => later.contains(&error.kind()),
    }
}

#[cfg(unix)]
mod pty {
    use super::{BadInput, Line, exchange};
    use serialport::{SerialPort, TTYPort};
    use std::fs::{self, File};
    use std::os::unix::fs::symlink;
    use std::path::Path;
    use std::time::Duration;

    /// A pseudo-terminal, with a link to it of the name that the user has given.
    pub struct Pty {
        master: TTYPort,
        /// The other end, open without reserving it, so that it lasts from one program that opens it to the next.
        _slave: File,
        name: String,
    }

    impl Pty {
        pub fn open(name: &str) -> Result<Self, BadInput> {
            let failed = |why: String| {
                let remedy =
                    "give another name, in a folder that can be written, or tcp:127.0.0.1:PORT";
                BadInput::new(format!("{name}: {why}"), remedy)
            };
            let (mut master, slave) = TTYPort::pair().map_err(|e| failed(e.to_string()))?;
            let wait = Duration::from_millis(1);
            master
                .set_timeout(wait)
                .map_err(|e| failed(e.to_string()))?;
            let device = SerialPort::name(&slave);
            let device = device.ok_or_else(|| failed("a pseudo-terminal without a name".into()))?;
            let link = Path::new(name);
            if let Ok(there) = fs::symlink_metadata(link) {
                // What a run before has left.
                let leads = fs::read_link(link).unwrap_or_default();
                if !(there.is_symlink() && leads.starts_with("/dev/pts")) {
                    return Err(failed("there is a file of this name".into()));
                }
                fs::remove_file(link).map_err(|e| failed(e.to_string()))?;
            }
            let open = File::open(&device).map_err(|e| failed(e.to_string()))?;
            symlink(&device, link).map_err(|e| failed(e.to_string()))?;
            Ok(Self {
                master,
                _slave: open,
                name: name.to_owned(),
            })
        }

        pub fn name(&self) -> &str {
            &self.name
        }

        pub fn exchange(&mut self, line: &mut Line) {
            exchange(&mut self.master, line);
        }
    }

    impl Drop for Pty {
        fn drop(&mut self) {
            let _ = fs::remove_file(&self.name);
        }
    }
}
