//! Frames: the envelope of a message, and how frames are found in a stream of bytes.
//!
//! Before COBS: `version · session · sequence · body · CRC-32`, little-endian. The version comes first and the CRC
//! last, so that every protocol version can read them.

use serde::Serialize;

use super::cobs::{Decoder, Encoder, encoded};
use crate::checksum::Checksum;

/// The protocol version that this build speaks.
pub const PROTOCOL: u8 = 1;
/// Takes the place of a version in a frame that states which versions the sender speaks. The layout of this frame never
/// changes.
pub const VERSION_ANSWER: u8 = 0;
/// Maximum length of a body in bytes.
pub const MOST_BODY: usize = 1024;
/// Maximum length of a frame on the wire in bytes, including the zero at its end.
pub const MOST_WIRE: usize = encoded(MOST_FRAME) + 1;
/// The byte that ends every frame. Sent before a frame, it also ends any garbage before it.
pub const END: u8 = 0;

const HEADER: usize = 7;
const CHECK: usize = 4;
const MOST_FRAME: usize = HEADER + MOST_BODY + CHECK;

/// Assigns a message to a session.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Header {
    /// Assigned in the answer to hello; in hello itself and in that answer, a random number of the host.
    pub session: u32,
    /// Counts the requests of a session; a reply repeats that of its request.
    pub sequence: u16,
}

/// Protocol versions that the other side speaks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct VersionAnswer {
    /// Lowest version.
    pub lowest: u8,
    /// Highest version.
    pub highest: u8,
}

/// Why a message could not be framed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameError {
    /// The body exceeds [`MOST_BODY`], or the frame exceeds its buffer ([`MOST_WIRE`] is always enough).
    TooLong,
}

impl core::fmt::Display for FrameError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("the message is too long for a frame")
    }
}

impl core::error::Error for FrameError {}

/// Frames a message; `scratch` has [`MOST_BODY`] bytes. Returns the bytes to send.
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

/// Builds the frame that states which versions this build speaks.
///
/// # Errors
/// [`FrameError::TooLong`]
pub fn encode_version_answer(out: &mut [u8]) -> Result<&[u8], FrameError> {
    encode_frame(&[VERSION_ANSWER, PROTOCOL, PROTOCOL], &[], out)
}

/// Builds a frame of any version: `head`, whose first byte is the version, and `body`, followed by their checksum.
///
/// # Errors
/// [`FrameError::TooLong`]
pub fn encode_frame<'o>(
    head: &[u8],
    body: &[u8],
    out: &'o mut [u8],
) -> Result<&'o [u8], FrameError> {
    let mut digest = Checksum::new();
    digest.add(head);
    digest.add(body);
    let check = digest.value().to_le_bytes();
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

/// A complete frame with a correct checksum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framed<'f> {
    /// A message in this version of the protocol.
    Message(Header, &'f [u8]),
    /// The versions that the other side speaks.
    VersionAnswer(VersionAnswer),
    /// A message in another version.
    OtherVersion(u8),
}

/// Result of processing one byte.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Received {
    /// Nothing yet.
    Nothing,
    /// A frame: see [`Receiver::frame`].
    Frame,
    /// Bytes that were not a frame, or a damaged frame. They are dropped.
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
    /// The frame was returned: the next byte begins a new one.
    done: bool,
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}

impl Receiver {
    /// Starts at the beginning of a stream, or in the middle of a frame, the rest of which is dropped.
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
        if Checksum::of(content) != u32::from_le_bytes(*check) {
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
