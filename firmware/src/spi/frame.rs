//! The bytes of both frames.

use trueaxis::{Checksum, Conditions};

use crate::device::{Command, Enabling};

/// Version of the frame format.
pub const VERSION: u8 = 2;
const HEAD: usize = 12;
const CHECK: usize = 4;

/// Length of the longest frame in bytes.
pub const MOST: usize = length(trueaxis::link::MOST_AXES);

/// Length in bytes of a frame with this number of axes, in either direction.
#[must_use]
pub const fn length(axes: usize) -> usize {
    HEAD + 4 * axes + CHECK
}

/// Flag of a command: the tool length is valid.
const TOOL_LENGTH: u8 = 1 << 2;
/// Flag of an answer: it answers a command.
const ANSWERS: u8 = 1;
/// Flag of an answer: there is no fault.
const HEALTHY: u8 = 1 << 1;

/// Why bytes are not a valid frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum NoFrame {
    /// The length is wrong for this number of axes.
    Length,
    /// The checksum is wrong.
    Check,
    /// Another version, another number of axes, or an undefined flag.
    Unknown,
}

/// The motion side's frame of one period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommandFrame<A> {
    /// Counter, incremented modulo 256 with every new command.
    pub count: u8,
    /// The command.
    pub command: Command<A>,
}

/// The controller's answer in the next period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer<A> {
    /// Counter of the last processed command; `None` before the first.
    pub count: Option<u8>,
    /// No fault; the fault pin shows the same.
    pub healthy: bool,
    /// Conditions of the servo.
    pub conditions: Conditions,
    /// Periods without a new frame, plus frames without a period of their own; wraps.
    pub irregular: u16,
    /// Corrections Δq, mm or degrees.
    pub dq: A,
}

/// A checked frame, without its checksum.
struct Parts<'a> {
    count: u8,
    mask: u16,
    flags: u8,
    number: u16,
    value: f32,
    rows: &'a [u8],
}

impl Parts<'_> {
    fn get(bytes: &[u8], axes: usize) -> Result<Parts<'_>, NoFrame> {
        let (body, check) = bytes.split_last_chunk::<CHECK>().ok_or(NoFrame::Length)?;
        if bytes.len() != length(axes) {
            return Err(NoFrame::Length);
        }
        if Checksum::of(body) != u32::from_le_bytes(*check) {
            return Err(NoFrame::Check);
        }
        let (head, rows) = body.split_first_chunk::<HEAD>().ok_or(NoFrame::Length)?;
        let [version, count, m0, m1, flags, of, n0, n1, value @ ..] = *head;
        if version != VERSION || usize::from(of) != axes {
            return Err(NoFrame::Unknown);
        }
        Ok(Parts {
            count,
            mask: u16::from_le_bytes([m0, m1]),
            flags,
            number: u16::from_le_bytes([n0, n1]),
            value: f32::from_le_bytes(value),
            rows,
        })
    }

    fn values<const AXES: usize>(&self) -> [f32; AXES] {
        let mut values = [0.0; AXES];
        for (value, bytes) in values.iter_mut().zip(self.rows.chunks_exact(4)) {
            if let Some(bytes) = bytes.first_chunk() {
                *value = f32::from_le_bytes(*bytes);
            }
        }
        values
    }
}

/// Writes a frame; returns the bytes written, or `None` if there is no room.
fn put<'a>(
    [count, flags]: [u8; 2],
    [mask, number]: [u16; 2],
    value: f32,
    values: &[f32],
    out: &'a mut [u8],
) -> Option<&'a [u8]> {
    let axes = u8::try_from(values.len()).ok()?;
    let frame = out.get_mut(..length(values.len()))?;
    let (body, check) = frame.split_last_chunk_mut::<CHECK>()?;
    let (head, rows) = body.split_first_chunk_mut::<HEAD>()?;
    let [m0, m1] = mask.to_le_bytes();
    let [n0, n1] = number.to_le_bytes();
    let [v0, v1, v2, v3] = value.to_le_bytes();
    *head = [VERSION, count, m0, m1, flags, axes, n0, n1, v0, v1, v2, v3];
    for (place, value) in rows.chunks_exact_mut(4).zip(values) {
        place.copy_from_slice(&value.to_le_bytes());
    }
    *check = Checksum::of(body).to_le_bytes();
    Some(frame)
}

impl<const AXES: usize> CommandFrame<[f32; AXES]> {
    /// Writes it, on the motion side; `None` if there is no room.
    pub fn put<'a>(&self, out: &'a mut [u8]) -> Option<&'a [u8]> {
        let Command {
            axes,
            referenced,
            enabling,
            tool_length,
        } = self.command;
        let enabling = match enabling {
            Enabling::Host => 0,
            Enabling::On => 1,
            Enabling::Off => 2,
        };
        let given = if tool_length.is_some() {
            TOOL_LENGTH
        } else {
            0
        };
        let flags = enabling | given;
        let length = tool_length.unwrap_or(0.0);
        put([self.count, flags], [referenced, 0], length, &axes, out)
    }

    /// Reads it, on the controller.
    ///
    /// # Errors
    /// See [`NoFrame`].
    pub fn get(bytes: &[u8]) -> Result<Self, NoFrame> {
        let parts = Parts::get(bytes, AXES)?;
        let enabling = match parts.flags & !TOOL_LENGTH {
            0 => Enabling::Host,
            1 => Enabling::On,
            2 => Enabling::Off,
            _ => return Err(NoFrame::Unknown),
        };
        if parts.number != 0 {
            return Err(NoFrame::Unknown);
        }
        let given = parts.flags & TOOL_LENGTH != 0;
        Ok(Self {
            count: parts.count,
            command: Command {
                axes: parts.values(),
                referenced: parts.mask,
                enabling,
                tool_length: given.then_some(parts.value),
            },
        })
    }
}

impl<const AXES: usize> Answer<[f32; AXES]> {
    /// Before anything has been computed: answers no command.
    pub const NOTHING: Self = Self {
        count: None,
        healthy: false,
        conditions: Conditions::DISABLED,
        irregular: 0,
        dq: [0.0; AXES],
    };

    /// Writes it, on the controller; `None` if there is no room.
    pub fn put<'a>(&self, out: &'a mut [u8]) -> Option<&'a [u8]> {
        let answers = if self.count.is_some() { ANSWERS } else { 0 };
        let healthy = if self.healthy { HEALTHY } else { 0 };
        let bytes = [self.count.unwrap_or(0), answers | healthy];
        let words = [self.conditions.0, self.irregular];
        put(bytes, words, 0.0, &self.dq, out)
    }

    /// Reads it, on the motion side.
    ///
    /// # Errors
    /// See [`NoFrame`].
    pub fn get(bytes: &[u8]) -> Result<Self, NoFrame> {
        let parts = Parts::get(bytes, AXES)?;
        if parts.flags & !(ANSWERS | HEALTHY) != 0 {
            return Err(NoFrame::Unknown);
        }
        let answers = parts.flags & ANSWERS != 0;
        Ok(Self {
            count: answers.then_some(parts.count),
            healthy: parts.flags & HEALTHY != 0,
            conditions: Conditions(parts.mask),
            irregular: parts.number,
            dq: parts.values(),
        })
    }
}
