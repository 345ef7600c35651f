//! Frames: what surrounds a message, and how it is found in a stream of bytes.
//!
//! Before COBS: `version · session · sequence · body · CRC-32`, little-endian. The version and the
//! CRC at the end stand where every version of the protocol can read them.

use serde::Serialize;

use super::cobs::{Decoder, Encoder, encoded};

/// The protocol version that this build speaks.
pub const PROTOCOL: u8 = 1;
/// In place of a version: a frame that says which versions the sender speaks. Its shape is fixed
/// for all times.
pub const VERSION_ANSWER: u8 = 0;
/// Most bytes of a body.
pub const MOST_BODY: usize = 1024;
/// Most bytes of a frame as sent, with the zero at its end.
pub const MOST_WIRE: usize = encoded(MOST_FRAME) + 1;
/// The byte that ends every frame. Before a frame it ends whatever garbage came before.
pub const END: u8 = 0;

const HEADER: usize = 7;
const CHECK: usize = 4;
const MOST_FRAME: usize = HEADER + MOST_BODY + CHECK;

/// CRC-32/ISO-HDLC, as of blobs.
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// To which conversation a message belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// From the answer to hello; in hello itself and in that answer a random number of the host.
    pub session: u32,
    /// Counts the requests of a session; a reply has that of its request.
    pub sequence: u16,
}

/// Which versions the other side speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VersionAnswer {
    /// Lowest.
    pub lowest: u8,
    /// Highest.
    pub highest: u8,
}

/// Why a message could not be put into a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// The body exceeds [`MOST_BODY`], or the frame its buffer ([`MOST_WIRE`] always suffices).
    TooLong,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the message is too long for a frame")
    }
}

impl core::error::Error for FrameError {}

/// Puts a message into a frame; `scratch` has [`MOST_BODY`] bytes. Returns the bytes to send.
///
/// # Errors
/// [`FrameError::TooLong`]
pub fn encode<'o>(
    header: Header,
    message: &impl Serialize,
    scratch: &mut [u8],
    out: &'o mut [u8],
) -> Result<&'o [u8], FrameError> {
    let body = postcard::to_slice(message, scratch).map_err(|_| FrameError::TooLong)?;
    let mut head = [PROTOCOL; HEADER];
    head[1..5].copy_from_slice(&header.session.to_le_bytes());
    head[5..].copy_from_slice(&header.sequence.to_le_bytes());
    encode_frame(&head, body, out)
}

/// The frame that says which versions this build speaks.
///
/// # Errors
/// [`FrameError::TooLong`]
pub fn encode_version_answer(out: &mut [u8]) -> Result<&[u8], FrameError> {
    encode_frame(&[VERSION_ANSWER, PROTOCOL, PROTOCOL], &[], out)
}

/// A frame of any version: `head`, whose first byte is the version, and `body`, with their checksum.
///
/// # Errors
/// [`FrameError::TooLong`]
pub fn encode_frame<'o>(
    head: &[u8],
    body: &[u8],
    out: &'o mut [u8],
) -> Result<&'o [u8], FrameError> {
    let mut digest = CRC.digest();
    digest.update(head);
    digest.update(body);
    let check = digest.finalize().to_le_bytes();
    let fitting = body.len() <= MOST_BODY;
    let write = |out: &mut [u8]| {
        let mut encoder = Encoder::new(out);
        encoder.put(head)?;
        encoder.put(body)?;
        encoder.put(&check)?;
        encoder.finish()
    };
    let length = write(out).filter(|_| fitting).ok_or(FrameError::TooLong)?;
    out.get(..length).ok_or(FrameError::TooLong)
}

/// A whole frame with a right checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framed<'f> {
    /// A message in this version of the protocol.
    Message(Header, &'f [u8]),
    /// The other side names its versions.
    VersionAnswer(VersionAnswer),
    /// A message in another version.
    OtherVersion(u8),
}

/// What a byte has completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing yet.
    Nothing,
    /// A frame: see [`Receiver::frame`].
    Frame,
    /// Bytes that were no frame, or a damaged one. They are dropped.
    Garbage,
}

/// Finds frames in a stream of bytes.
///
/// # Memory
/// One frame.
pub struct Receiver {
    buffer: [u8; MOST_FRAME],
    length: usize,
    decoder: Decoder,
    overrun: bool,
    /// The frame was handed out: the next byte begins another one.
    done: bool,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// At the start of a stream, or in the midst of a frame whose rest is then dropped.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            buffer: [0; MOST_FRAME],
            length: 0,
            decoder: Decoder::NEW,
            overrun: false,
            done: false,
        }
    }

    /// Takes the next byte of the stream.
    pub fn push(&mut self, byte: u8) -> Received {
        if self.done {
            self.clear();
        }
        if byte != END {
            if let Some(decoded) = self.decoder.push(byte) {
                match self.buffer.get_mut(self.length) {
                    Some(place) => {
                        *place = decoded;
                        self.length += 1;
                    }
                    None => self.overrun = true,
                }
            }
            return Received::Nothing;
        }
        if self.decoder.is_new() {
            // Zeros between frames.
            return Received::Nothing;
        }
        if !self.overrun && self.decoder.is_whole() && self.frame().is_some() {
            self.done = true;
            Received::Frame
        } else {
            self.clear();
            Received::Garbage
        }
    }

    /// The frame, after [`Received::Frame`] and before the next byte.
    #[must_use]
    pub fn frame(&self) -> Option<Framed<'_>> {
        let (content, check) = self
            .buffer
            .get(..self.length)?
            .split_last_chunk::<CHECK>()?;
        if CRC.checksum(content) != u32::from_le_bytes(*check) {
            return None;
        }
        match *content {
            [VERSION_ANSWER, lowest, highest, ..] => {
                Some(Framed::VersionAnswer(VersionAnswer { lowest, highest }))
            }
            [PROTOCOL, a, b, c, d, e, f, ref body @ ..] => {
                let header = Header {
                    session: u32::from_le_bytes([a, b, c, d]),
                    sequence: u16::from_le_bytes([e, f]),
                };
                Some(Framed::Message(header, body))
            }
            [PROTOCOL | VERSION_ANSWER, ..] | [] => None,
            [other, ..] => Some(Framed::OtherVersion(other)),
        }
    }

    fn clear(&mut self) {
        self.length = 0;
        self.decoder = Decoder::NEW;
        self.overrun = false;
        self.done = false;
    }
}
