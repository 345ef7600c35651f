//! A device in its own thread, reached by TCP or a pseudo-terminal.

use serialport::SerialPort;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::device::{Command, LinkOnly, NoClock, PositionSource};

/// Servo periods between two looks at the line.
const PERIODS: usize = 5;

/// A position that is always commanded.
struct Position([f32; 8]);

impl PositionSource<[f32; 8]> for Position {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        Some(Command::new(self.0, 0xff))
    }
}

/// A device that is served until it is taken back.
pub struct Served {
    /// Argument of `--port`.
    pub port: String,
    stop: Arc<AtomicBool>,
    thread: JoinHandle<Desktop>,
}

impl Served {
    /// Serves it by TCP, one connection after the other.
    pub fn tcp(desktop: Desktop) -> Self {
        Self::by_tcp(desktop, |_| ())
    }

    fn by_tcp(desktop: Desktop, mut each: impl FnMut(&mut Desktop) + Send + 'static) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = format!("tcp:{}", listener.local_addr().unwrap());
        listener.set_nonblocking(true).unwrap();
        let mut stream: Option<TcpStream> = None;
        Self::serve(port, desktop, move |desktop| {
            if let Ok((new, _)) = listener.accept() {
                new.set_nonblocking(true).unwrap();
                stream = Some(new);
            }
            if let Some(open) = &mut stream
                && !exchange(open, desktop)
            {
                stream = None;
            }
            each(desktop);
        })
    }

    /// Serves it by TCP, while a motion controller commands a position on referenced axes.
    pub fn moving(desktop: Desktop, position: [f32; 8]) -> Self {
        let mut source = Position(position);
        Self::by_tcp(desktop, move |desktop| {
            for _ in 0..PERIODS {
                desktop
                    .servo
                    .lock(|side| side.tick(&mut source, &mut LinkOnly, &NoClock));
            }
        })
    }

    /// Serves it by a pseudo-terminal.
    pub fn pty(desktop: Desktop) -> Self {
        let (mut master, slave) = serialport::TTYPort::pair().unwrap();
        let port = slave.name().unwrap();
        master.set_timeout(Duration::from_millis(1)).unwrap();
        Self::serve(port, desktop, move |desktop| {
            // Keep the other end open, so that it can be reopened.
            let _ = &slave;
            exchange(&mut master, desktop);
        })
    }

    fn serve(
        port: String,
        mut desktop: Desktop,
        mut exchange: impl FnMut(&mut Desktop) + Send + 'static,
    ) -> Self {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let thread = std::thread::spawn(move || {
            while !stopped.load(Ordering::SeqCst) {
                exchange(&mut desktop);
                let idle = desktop.line.incoming.is_empty();
                desktop.turn(1);
                if idle {
                    std::thread::sleep(Duration::from_micros(100));
                }
            }
            desktop
        });
        Self { port, stop, thread }
    }

    /// Stops serving and returns the device.
    pub fn take(self) -> Desktop {
        self.stop.store(true, Ordering::SeqCst);
        self.thread.join().unwrap()
    }
}

/// Moves bytes both ways; false when the other end is closed.
fn exchange(stream: &mut (impl Read + Write), desktop: &mut Desktop) -> bool {
    let mut buffer = [0; 4096];
    match stream.read(&mut buffer) {
        Ok(0) => return false,
        Ok(count) => desktop.line.incoming.extend(&buffer[..count]),
        Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => {}
        Err(_) => return false,
    }
    let mut sent = &desktop.line.outgoing[..];
    while !sent.is_empty() {
        match stream.write(sent) {
            Ok(count) => sent = &sent[count..],
            Err(error) if [ErrorKind::WouldBlock, ErrorKind::TimedOut].contains(&error.kind()) => {}
            Err(_) => break,
        }
    }
    desktop.line.outgoing.clear();
    true
}
