//! Text in a buffer of the caller.

use core::fmt;

/// Writes as many whole characters as fit into a buffer, and counts the length of the whole text.
pub(crate) struct Text<'b> {
    buffer: &'b mut [u8],
    written: usize,
    needed: usize,
}

impl<'b> Text<'b> {
    /// For a buffer that will be terminated by a zero.
    pub(crate) fn new(buffer: &'b mut [u8]) -> Self {
        Self {
            buffer,
            written: 0,
            needed: 0,
        }
    }

    /// Appends a text.
    pub(crate) fn push(&mut self, text: &str) {
        let whole = self.written == self.needed;
        self.needed = self.needed.saturating_add(text.len());
        if !whole {
            return;
        }
        for character in text.chars() {
            let mut bytes = [0; 4];
            let bytes = character.encode_utf8(&mut bytes).as_bytes();
            let end = self.written + bytes.len();
            // One byte is reserved for the zero.
            if end >= self.buffer.len() {
                return;
            }
            let Some(to) = self.buffer.get_mut(self.written..end) else {
                return;
            };
            to.copy_from_slice(bytes);
            self.written = end;
        }
    }

    /// Writes the zero; returns the length of the whole text in bytes without it.
    pub(crate) fn end(self) -> usize {
        if let Some(zero) = self.buffer.get_mut(self.written) {
            *zero = 0;
        }
        self.needed
    }
}

impl fmt::Write for Text<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.push(text);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_ends_with_a_zero_within_its_buffer_and_says_what_it_needs() {
        for (size, held) in [
            (0, ""),
            (1, ""),
            (2, "a"),
            (3, "a"),
            (4, "aµ"),
            (5, "aµ!"),
            (9, "aµ!"),
        ] {
            let mut buffer = [b'x'; 9];
            let mut text = Text::new(&mut buffer[..size]);
            text.push("aµ");
            text.push("!");
            assert_eq!(text.end(), 4);
            let expected = held.as_bytes();
            assert_eq!(&buffer[..expected.len()], expected, "{size}");
            if size > 0 {
                assert_eq!(buffer[expected.len()], 0);
            }
            assert!(buffer[size..].iter().all(|b| *b == b'x'));
        }
    }

    #[test]
    fn nothing_is_written_behind_a_gap() {
        let mut buffer = [b'x'; 3];
        let mut text = Text::new(&mut buffer);
        text.push("abc");
        text.push("");
        text.push("d");
        assert_eq!(text.end(), 4);
        assert_eq!(&buffer, b"ab\0");
    }
}
