//! Bytes waiting for a whole word.

use super::layout::WORD;

/// Bytes that do not fill a word of the flash yet.
#[derive(Clone, Copy, Debug)]
pub struct Tail {
    bytes: [u8; WORD],
    length: usize,
}

impl Tail {
    pub const EMPTY: Self = Self {
        bytes: [0xFF; WORD],
        length: 0,
    };

    pub fn held(&self) -> &[u8] {
        &self.bytes[..self.length]
    }

    /// Takes bytes until there are `word` of them; returns the rest.
    pub fn fill<'b>(&mut self, word: usize, bytes: &'b [u8]) -> &'b [u8] {
        let room = self.bytes.get_mut(self.length..word).unwrap_or_default();
        let taken = bytes.len().min(room.len());
        let (now, rest) = bytes.split_at(taken);
        for (place, byte) in room.iter_mut().zip(now) {
            *place = *byte;
        }
        self.length += taken;
        rest
    }

    /// The word of `word` bytes, padded with erased bytes.
    pub fn padded(&self, word: usize) -> &[u8] {
        &self.bytes[..word]
    }
}
