//! Commands from the motion side over SPI, and corrections back to it.
//!
//! This controller is the SPI master. In every servo period it exchanges one frame with the motion
//! side: it receives the command of this period while it sends the correction of the one before.
//! Both frames have the same length, 8 + 4 · axes bytes, little-endian:
//!
//! | offset | size | command | correction |
//! |---|---|---|---|
//! | 0 | 1 | `01` (version) | `01` |
//! | 1 | 1 | count: another one in every new command | count of the command that is answered |
//! | 2 | 2 | mask of referenced axes | [`Conditions`](trueaxis::Conditions) |
//! | 4 | 4 · axes | positions, f32, mm or degrees | corrections Δq, f32, mm or degrees |
//! | | 4 | CRC-32/ISO-HDLC of all before | the same |
//!
//! A frame that is damaged, or has the count of the one before, is no command.

use core::cell::Cell;

use embedded_hal::spi::SpiDevice;
use trueaxis::Correction;

use crate::device::{Command, CorrectionSink, PositionSource};

const VERSION: u8 = 1;
const HEAD: usize = 4;
const CHECK: usize = 4;
/// Bytes of the longest frame.
const MOST: usize = HEAD + 4 * trueaxis::link::MOST_AXES + CHECK;
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

/// The exchange with the motion side over an SPI device of its own.
#[derive(Debug)]
pub struct SpiMotion<D> {
    device: D,
    count: Option<u8>,
    /// Exchanges that gave no command: of the bus, the checksum, or without a new count.
    failures: u32,
    outgoing: Outgoing,
}

/// What is sent in the next period.
#[derive(Debug)]
struct Outgoing {
    frame: Cell<[u8; MOST]>,
    /// Count of the command last taken.
    count: Cell<u8>,
}

/// The commands of one period, see [`SpiMotion::ends`].
#[derive(Debug)]
pub struct Commands<'m, D> {
    device: &'m mut D,
    count: &'m mut Option<u8>,
    failures: &'m mut u32,
    outgoing: &'m Outgoing,
}

/// Where the correction of one period goes, see [`SpiMotion::ends`].
#[derive(Debug)]
pub struct Corrections<'m> {
    outgoing: &'m Outgoing,
}

impl<D: SpiDevice> SpiMotion<D> {
    /// Nothing is exchanged yet.
    pub const fn new(device: D) -> Self {
        Self {
            device,
            count: None,
            failures: 0,
            outgoing: Outgoing {
                frame: Cell::new([0; MOST]),
                count: Cell::new(0),
            },
        }
    }

    /// Source and sink of one [`tick`](crate::device::ServoSide::tick).
    pub fn ends(&mut self) -> (Commands<'_, D>, Corrections<'_>) {
        let commands = Commands {
            device: &mut self.device,
            count: &mut self.count,
            failures: &mut self.failures,
            outgoing: &self.outgoing,
        };
        let corrections = Corrections {
            outgoing: &self.outgoing,
        };
        (commands, corrections)
    }

    /// Exchanges that gave no command.
    pub const fn failures(&self) -> u32 {
        self.failures
    }
}

/// Where the checksum of a frame with so many axes begins.
const fn check_at(axes: usize) -> usize {
    HEAD + 4 * axes
}

/// A frame; `None` if there are more axes than fit.
fn put(count: u8, mask: u16, values: &[f32]) -> Option<[u8; MOST]> {
    let mut frame = [0; MOST];
    let [low, high] = mask.to_le_bytes();
    let (head, rest) = frame.split_first_chunk_mut::<HEAD>()?;
    *head = [VERSION, count, low, high];
    let places = rest.get_mut(..4 * values.len())?;
    for (place, value) in places.chunks_exact_mut(4).zip(values) {
        place.copy_from_slice(&value.to_le_bytes());
    }
    let at = check_at(values.len());
    let check = CRC.checksum(frame.get(..at)?);
    frame
        .get_mut(at..at + CHECK)?
        .copy_from_slice(&check.to_le_bytes());
    Some(frame)
}

/// Count, mask and values of a frame, if it is whole.
fn get<const AXES: usize>(frame: &[u8; MOST]) -> Option<(u8, u16, [f32; AXES])> {
    let at = check_at(AXES);
    let check = CRC.checksum(frame.get(..at)?).to_le_bytes();
    if frame.get(at..at + CHECK)? != check || frame[0] != VERSION {
        return None;
    }
    let mut values = [0.0; AXES];
    let places = frame.get(HEAD..at)?.chunks_exact(4);
    for (value, bytes) in values.iter_mut().zip(places) {
        *value = f32::from_le_bytes(bytes.try_into().ok()?);
    }
    Some((frame[1], u16::from_le_bytes([frame[2], frame[3]]), values))
}

impl<D: SpiDevice, const AXES: usize> PositionSource<[f32; AXES]> for Commands<'_, D> {
    fn take(&mut self) -> Option<Command<[f32; AXES]>> {
        let sent = self.outgoing.frame.get();
        let mut received = [0; MOST];
        let length = check_at(AXES) + CHECK;
        let exchanged = match (received.get_mut(..length), sent.get(..length)) {
            (Some(read), Some(write)) => self.device.transfer(read, write).is_ok(),
            _ => false,
        };
        let command = get::<AXES>(&received).filter(|(count, ..)| Some(*count) != *self.count);
        match command {
            Some((count, referenced, axes)) if exchanged => {
                *self.count = Some(count);
                self.outgoing.count.set(count);
                Some(Command { axes, referenced })
            }
            _ => {
                *self.failures = self.failures.wrapping_add(1);
                None
            }
        }
    }
}

impl<const AXES: usize> CorrectionSink<[f32; AXES]> for Corrections<'_> {
    fn give(&mut self, correction: &Correction<[f32; AXES]>) {
        let conditions = correction.status.conditions.0;
        if let Some(frame) = put(self.outgoing.count.get(), conditions, &correction.dq) {
            self.outgoing.frame.set(frame);
        }
    }
}

#[cfg(test)]
mod tests;
