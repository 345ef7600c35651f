//! Consistent overhead byte stuffing (Cheshire and Baker, 1999): encoded data contains no zeros, so a zero marks the
//! end of a frame wherever reception begins.

/// Decodes byte by byte.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decoder {
    /// Bytes until the next code byte.
    left: u8,
    /// A zero follows the block that ends there.
    zero: bool,
    /// No code byte has arrived yet.
    first: bool,
}

impl Decoder {
    pub(super) const NEW: Self = Self {
        left: 0,
        zero: false,
        first: true,
    };

    /// Takes a byte other than 0; returns the byte it decodes to, if any.
    pub(super) fn push(&mut self, byte: u8) -> Option<u8> {
        if self.left > 0 {
            self.left -= 1;
            return Some(byte);
        }
        let zero = self.zero && !self.first;
        self.first = false;
        self.left = byte.wrapping_sub(1);
        self.zero = byte != 0xFF;
        zero.then_some(0)
    }

    /// Whether nothing has arrived yet.
    pub(super) fn is_new(&self) -> bool {
        self.first
    }

    /// Whether a frame may end here.
    pub(super) fn is_whole(&self) -> bool {
        self.left == 0 && !self.first
    }
}

/// Maximum encoded size of `length` bytes, without the zero at the end.
pub(super) const fn encoded(length: usize) -> usize {
    length + length / 254 + 1
}

/// Encodes into a slice.
pub(super) struct Encoder<'o> {
    out: &'o mut [u8],
    /// Index of the code byte of the current block.
    code_at: usize,
    /// Index of the next byte.
    at: usize,
    code: u8,
}

impl<'o> Encoder<'o> {
    pub(super) fn new(out: &'o mut [u8]) -> Self {
        Self {
            out,
            code_at: 0,
            at: 1,
            code: 1,
        }
    }

    /// `None` when `out` is full.
    pub(super) fn put(&mut self, bytes: &[u8]) -> Option<()> {
        for &byte in bytes {
            if self.code == 0xFF {
                self.end_block()?;
            }
            if byte == 0 {
                self.end_block()?;
            } else {
                *self.out.get_mut(self.at)? = byte;
                self.at += 1;
                self.code += 1;
            }
        }
        Some(())
    }

    fn end_block(&mut self) -> Option<()> {
        *self.out.get_mut(self.code_at)? = self.code;
        self.code_at = self.at;
        self.at += 1;
        self.code = 1;
        Some(())
    }

    /// Ends the frame with a zero; returns the number of bytes written.
    pub(super) fn finish(mut self) -> Option<usize> {
        self.end_block()?;
        // `code_at` is where the code byte of another block would go.
        *self.out.get_mut(self.code_at)? = 0;
        Some(self.code_at + 1)
    }
}
