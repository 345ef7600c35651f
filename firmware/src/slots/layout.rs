//! The last bytes of a slot, see `docs/src/slots.md`.
//!
//! | from the end | bytes | |
//! |---|---|---|
//! | −128 | 64 | record: the announced blob, wear |
//! | −64 | 32 | mark: not blank as soon as the slot may be erased |
//! | −32 | 32 | commit: the sequence number |
//!
//! Before them the [`choices`](super::choices) grow downwards.
//!
//! Record and commit consist of their content and its complement. An interrupted write leaves bits set in both, so it
//! is always detected, whatever the order of the bits.

use core::ops::Range;

use trueaxis::Checksum;

use super::Damage;

/// Version of the layout.
pub const LAYOUT: u16 = 2;
/// Length of record, mark and commit together.
pub const TRAILER: usize = 128;
/// Length of a choice.
pub const CHOICE: usize = 64;
/// Number of choices that fit beside the largest blob.
const RESERVED: usize = 4;
/// Bytes at the end of a slot that are not available for the blob.
pub const NO_BLOB: usize = TRAILER + RESERVED * CHOICE;
/// Largest write size that the layout supports; every write size divides it. Flash is read in lines of this length.
pub const WORD: usize = 32;

const MAGIC: [u8; 4] = *b"TXSL";

/// Position of the record in a slot of `length` bytes.
pub const fn record_at(length: usize) -> Range<usize> {
    length - 128..length - 64
}

/// Position of the mark in a slot of `length` bytes.
pub const fn mark_at(length: usize) -> Range<usize> {
    length - 64..length - 32
}

/// Position of the commit in a slot of `length` bytes.
pub const fn commit_at(length: usize) -> Range<usize> {
    length - 32..length
}

/// Whether every byte is erased.
pub fn blank(bytes: &[u8]) -> bool {
    bytes.iter().all(|&byte| byte == 0xFF)
}

/// The record, written after the erase and before the first byte of the blob.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Record {
    /// Length of the blob in bytes.
    pub length: u32,
    /// CRC-32 in the header of the blob.
    pub crc: u32,
    /// Erase cycles of this slot.
    pub wear: u32,
    /// Erase cycles of the other slot at that time.
    pub other_wear: u32,
}

impl Record {
    fn content(&self) -> [u8; 32] {
        let mut content = [0; 32];
        content[..4].copy_from_slice(&MAGIC);
        content[4..6].copy_from_slice(&LAYOUT.to_le_bytes());
        content[8..12].copy_from_slice(&self.length.to_le_bytes());
        content[12..16].copy_from_slice(&self.crc.to_le_bytes());
        content[16..20].copy_from_slice(&self.wear.to_le_bytes());
        content[20..24].copy_from_slice(&self.other_wear.to_le_bytes());
        let check = Checksum::of(&content[..28]);
        content[28..].copy_from_slice(&check.to_le_bytes());
        content
    }

    /// The bytes of the record.
    pub fn encode(&self) -> [u8; 64] {
        doubled(&self.content())
    }

    /// Reads a record.
    pub fn decode(bytes: &[u8; 64]) -> Result<Self, Damage> {
        let (content, complement) = bytes.split_at(32);
        if content[..4] != MAGIC || !complementary(content, complement) {
            return Err(Damage::Record);
        }
        let found = u16::from_le_bytes([content[4], content[5]]);
        if found != LAYOUT {
            return Err(Damage::UnknownLayout { found });
        }
        let record = Self {
            length: word(content, 8),
            crc: word(content, 12),
            wear: word(content, 16),
            other_wear: word(content, 20),
        };
        if record.content() != content {
            return Err(Damage::Record);
        }
        Ok(record)
    }

    /// The commit word: `sequence`, tied to this record.
    pub fn commit(&self, sequence: u32) -> [u8; 32] {
        let mut digest = Checksum::new();
        digest.add(&self.content());
        digest.add(&sequence.to_le_bytes());
        let check = digest.value();
        let content = [sequence.to_le_bytes(), check.to_le_bytes(), [0; 4], [0; 4]];
        let mut bytes = [0; 32];
        let (plain, complement) = bytes.split_at_mut(16);
        let both = plain.iter_mut().zip(complement);
        for ((plain, not), byte) in both.zip(content.as_flattened()) {
            (*plain, *not) = (*byte, !byte);
        }
        bytes
    }

    /// The sequence number of a commit that belongs to this record.
    pub fn committed(&self, bytes: &[u8; 32]) -> Result<u32, Damage> {
        let sequence = word(bytes, 0);
        if *bytes == self.commit(sequence) {
            Ok(sequence)
        } else {
            Err(Damage::Commit)
        }
    }
}

/// A content and its complement.
pub fn doubled(content: &[u8; 32]) -> [u8; 64] {
    let mut bytes = [0; 64];
    let (plain, complement) = bytes.split_at_mut(32);
    plain.copy_from_slice(content);
    for (not, byte) in complement.iter_mut().zip(content) {
        *not = !byte;
    }
    bytes
}

fn complementary(content: &[u8], complement: &[u8]) -> bool {
    content.iter().zip(complement).all(|(&a, &b)| a == !b)
}

/// The little-endian number at `at`.
pub fn word(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}
