//! The controller's end of the link: bytes in, requests to the device, bytes out.
//!
//! It never waits for bytes, so the main loop calls [`Link::poll`] beside its other work. The protocol is that of
//! [`trueaxis::link`].
//!
//! **Panic contract.** Any byte sequence is either answered or dropped.

mod boot_nonce;
mod session;
#[cfg(test)]
mod tests;

use embedded_io::{Read, ReadReady, Write};
use trueaxis::link::{
    Framed, Header, Hello, MOST_BODY, MOST_WIRE, Received, Receiver, Refusal, Reply, Request,
    encode, encode_version_answer,
};

pub use boot_nonce::BootNonce;
use session::{Session, Turn};

/// The answer to a request.
#[derive(Clone, Debug, PartialEq)]
// Passed on, not stored.
#[allow(clippy::large_enum_variant)]
pub enum Answer<'a> {
    /// The answer.
    Now(Reply<'a>),
    /// The answer of [`Controller::motion_answer`], once the servo has taken all positions.
    Later,
}

/// Executes the host's requests: the [`Device`](crate::device::Device).
pub trait Controller {
    /// Identity of the controller.
    fn hello(&self, session: u32) -> Hello<'_>;

    /// Executes a request other than hello. `rows` has [`MOST_BODY`] bytes for corrections.
    ///
    /// A motion whose answer is still due is dropped, because a host that sends another request no longer waits for it.
    fn answer<'a>(&mut self, request: &Request<'_>, rows: &'a mut [u8]) -> Answer<'a>;

    /// The answer to a motion, once it is available.
    fn motion_answer<'a>(&mut self, rows: &'a mut [u8]) -> Option<Reply<'a>>;

    /// Drops the motion whose answer is due, including positions not taken yet.
    fn drop_motion(&mut self);

    /// One step of a lengthy operation.
    fn poll(&mut self);
}

/// Counts of the link since start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Complete frames with a correct checksum.
    pub frames: u32,
    /// Damaged or truncated frames, and other bytes.
    pub garbage: u32,
    /// Repeated requests that were answered from memory.
    pub repeated: u32,
    /// Errors reported by the serial driver.
    pub errors: u32,
}

/// One frame to send.
struct Outgoing {
    bytes: [u8; MOST_WIRE],
    length: usize,
}

impl Outgoing {
    const EMPTY: Self = Self {
        bytes: [0; MOST_WIRE],
        length: 0,
    };

    fn put(&mut self, header: Header, reply: &Reply<'_>, scratch: &mut [u8]) {
        // A test proves that all replies fit; one that did not would not be sent.
        self.length = encode(header, reply, scratch, &mut self.bytes).map_or(0, |sent| sent.len());
    }

    fn put_version(&mut self) {
        self.length = encode_version_answer(&mut self.bytes).map_or(0, |sent| sent.len());
    }

    fn send<P: Write>(&self, port: &mut P) -> Result<(), P::Error> {
        match self.bytes.get(..self.length) {
            Some(bytes) if !bytes.is_empty() => {
                port.write_all(bytes)?;
                port.flush()
            }
            _ => Ok(()),
        }
    }
}

/// The controller's end of the link.
///
/// # Memory
/// Five frames of 1 kB: for a `static`.
pub struct Link {
    receiver: Receiver,
    /// Nonce of this start; with `None` no session is opened.
    nonce: Option<u64>,
    session: Session,
    /// The answer to the last request, for its repetitions.
    answer: Outgoing,
    /// Answers to hello, and everything outside a session.
    aside: Outgoing,
    /// Header of a motion whose answer is due.
    waiting: Option<Header>,
    scratch: [u8; MOST_BODY],
    rows: [u8; MOST_BODY],
    counts: Counts,
}

impl Link {
    /// No session is open yet. `source` distinguishes its sessions from those of other starts.
    #[must_use]
    pub fn new(source: &mut impl BootNonce) -> Self {
        Self {
            receiver: Receiver::new(),
            nonce: source.boot_nonce(),
            session: Session::NONE,
            answer: Outgoing::EMPTY,
            aside: Outgoing::EMPTY,
            waiting: None,
            scratch: [0; MOST_BODY],
            rows: [0; MOST_BODY],
            counts: Counts {
                frames: 0,
                garbage: 0,
                repeated: 0,
                errors: 0,
            },
        }
    }

    /// Counts since start.
    #[must_use]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Processes received bytes, answers complete requests, and gives the controller a turn.
    ///
    /// Read errors (overrun, framing) are counted; the damaged frame fails its checksum.
    ///
    /// # Errors
    /// Errors of the port while writing.
    pub fn poll<P: Read + ReadReady + Write>(
        &mut self,
        port: &mut P,
        controller: &mut impl Controller,
    ) -> Result<(), P::Error> {
        let mut bytes = [0; 64];
        let received = match port.read_ready() {
            Ok(true) => port.read(&mut bytes),
            Ok(false) => Ok(0),
            Err(error) => Err(error),
        };
        match received {
            Ok(count) => {
                for &byte in bytes.iter().take(count) {
                    self.take(byte, port, controller)?;
                }
            }
            Err(_) => self.counts.errors = self.counts.errors.wrapping_add(1),
        }
        controller.poll();
        self.finish_motion(port, controller)
    }

    /// Processes one byte, as [`poll`](Self::poll) does for the bytes of a port.
    ///
    /// # Errors
    /// Errors of the port while writing.
    pub fn take<P: Write>(
        &mut self,
        byte: u8,
        port: &mut P,
        controller: &mut impl Controller,
    ) -> Result<(), P::Error> {
        match self.receiver.push(byte) {
            Received::Nothing => return Ok(()),
            Received::Garbage => {
                self.counts.garbage = self.counts.garbage.wrapping_add(1);
                return Ok(());
            }
            Received::Frame => self.counts.frames = self.counts.frames.wrapping_add(1),
        }
        let (header, body) = match self.receiver.frame() {
            Some(Framed::Message(header, body)) => (header, body),
            Some(Framed::OtherVersion(_)) => {
                self.aside.put_version();
                return self.aside.send(port);
            }
            // From another controller, or not a frame.
            Some(Framed::VersionAnswer(_)) | None => return Ok(()),
        };
        let request = postcard::from_bytes::<Request<'_>>(body);
        let scratch = &mut self.scratch;
        if let Ok(Request::Hello) = request {
            let Some(nonce) = self.nonce else {
                let reply = Reply::Refused(Refusal::NoNonce);
                self.aside.put(header, &reply, scratch);
                return self.aside.send(port);
            };
            let Some((session, new)) = self.session.open(nonce, header.session) else {
                return Ok(());
            };
            if new {
                self.waiting = None;
                controller.drop_motion();
            }
            let reply = Reply::Hello(controller.hello(session));
            self.aside.put(header, &reply, scratch);
            return self.aside.send(port);
        }
        match self.session.turn(header) {
            Turn::Next => {}
            Turn::Again if self.waiting == Some(header) => return Ok(()),
            Turn::Again => {
                self.counts.repeated = self.counts.repeated.wrapping_add(1);
                return self.answer.send(port);
            }
            Turn::Old => return Ok(()),
            Turn::NoSession => {
                let reply = Reply::Refused(Refusal::NoSession);
                self.aside.put(header, &reply, scratch);
                return self.aside.send(port);
            }
        }
        self.waiting = None;
        let reply = match request {
            Err(_) => Reply::Refused(Refusal::Unknown),
            Ok(request) => match controller.answer(&request, &mut self.rows) {
                Answer::Now(Reply::Health(mut health)) => {
                    health.garbled = self.counts.garbage;
                    Reply::Health(health)
                }
                Answer::Now(reply) => reply,
                Answer::Later => {
                    self.waiting = Some(header);
                    return Ok(());
                }
            },
        };
        self.answer.put(header, &reply, scratch);
        self.answer.send(port)
    }

    fn finish_motion<P: Write>(
        &mut self,
        port: &mut P,
        controller: &mut impl Controller,
    ) -> Result<(), P::Error> {
        let Some(header) = self.waiting else {
            return Ok(());
        };
        let Some(reply) = controller.motion_answer(&mut self.rows) else {
            return Ok(());
        };
        self.waiting = None;
        self.answer.put(header, &reply, &mut self.scratch);
        self.answer.send(port)
    }
}
