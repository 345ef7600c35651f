//! The checksum of blobs, of frames and of what controllers store.

/// CRC-32/ISO-HDLC, as in zlib, over bytes that may come in pieces.
///
/// # Memory
/// A table of 64 bytes, where the usual one takes 1 kB of a controller's flash.
///
/// # Timing
/// Two look-ups for each byte.
#[derive(Clone, Copy, Debug)]
pub struct Checksum(u32);

impl Checksum {
    /// Of no bytes.
    #[must_use]
    pub const fn new() -> Self {
        Self(u32::MAX)
    }

    /// Of these bytes.
    #[must_use]
    pub fn of(bytes: &[u8]) -> u32 {
        let mut checksum = Self::new();
        checksum.add(bytes);
        checksum.value()
    }

    /// Continues with these bytes.
    #[inline(never)]
    pub fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 ^= u32::from(*byte);
            for _ in 0..2 {
                self.0 = (self.0 >> 4) ^ FOUR_BITS[(self.0 & 15) as usize];
            }
        }
    }

    /// The checksum of all bytes so far.
    #[must_use]
    pub const fn value(self) -> u32 {
        !self.0
    }
}

impl Default for Checksum {
    fn default() -> Self {
        Self::new()
    }
}

/// Four steps of the division for each value of the four lowest bits.
const FOUR_BITS: [u32; 16] = {
    /// The generator polynomial, its highest power in the lowest bit.
    const POLYNOMIAL: u32 = 0xEDB8_8320;
    let mut table = [0; 16];
    let mut bits = 0;
    while bits < 16 {
        let mut rest = bits as u32;
        let mut step = 0;
        while step < 4 {
            rest = (rest >> 1) ^ ((rest & 1) * POLYNOMIAL);
            step += 1;
        }
        table[bits] = rest;
        bits += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn it_is_that_of_the_crate_crc_in_one_piece_or_two(
            bytes in prop::collection::vec(any::<u8>(), 0..300),
            cut in any::<prop::sample::Index>(),
        ) {
            let expected = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&bytes);
            prop_assert_eq!(Checksum::of(&bytes), expected);
            let (first, second) = bytes.split_at(cut.index(bytes.len() + 1));
            let mut pieces = Checksum::new();
            pieces.add(first);
            pieces.add(second);
            prop_assert_eq!(pieces.value(), expected);
        }
    }
}
