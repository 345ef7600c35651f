//! The receiving end of a serial line.

use heapless::spsc::Consumer;

/// Reads bytes received by an interrupt. Blocks for the first byte, as `embedded_io` requires, by calling `wait`, which
/// returns after an interrupt.
pub fn received(bytes: &mut Consumer<'_, u8>, buffer: &mut [u8], mut wait: impl FnMut()) -> usize {
    let mut count = 0;
    while let Some(place) = buffer.get_mut(count) {
        match bytes.dequeue() {
            Some(byte) => {
                *place = byte;
                count += 1;
            }
            None if count > 0 => break,
            None => wait(),
        }
    }
    count
}

#[cfg(test)]
mod tests;
