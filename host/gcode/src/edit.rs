//! Changes of single words in a line, which leaves all other bytes as they are.

use std::ops::Range;

/// Changes of one line.
#[derive(Debug, Default)]
pub struct Edits {
    changes: Vec<(Range<usize>, Range<usize>)>,
    text: Vec<u8>,
}

impl Edits {
    /// Forgets all changes.
    pub fn clear(&mut self) {
        self.changes.clear();
        self.text.clear();
    }

    /// Puts what `write` writes in the place of some bytes.
    pub fn replace<T>(&mut self, span: Range<usize>, write: impl FnOnce(&mut Vec<u8>) -> T) -> T {
        let from = self.text.len();
        let done = write(&mut self.text);
        self.changes.push((span, from..self.text.len()));
        done
    }

    /// Takes a word away, with the spaces before it.
    pub fn remove(&mut self, line: &[u8], span: Range<usize>) {
        let spaces = line[..span.start].iter().rev();
        let spaces = spaces.take_while(|b| matches!(b, b' ' | b'\t')).count();
        // At the beginning of a line they stay: it may be indented.
        let from = match span.start == spaces {
            true => span.start,
            false => span.start - spaces,
        };
        self.changes.push((from..span.end, 0..0));
    }

    /// The line with all changes.
    pub fn apply(&mut self, line: &[u8], to: &mut Vec<u8>) {
        // Those at one place stay in their order.
        self.changes.sort_by_key(|(span, _)| (span.start, span.end));
        let mut at = 0;
        for (span, text) in &self.changes {
            to.extend_from_slice(&line[at..span.start.max(at)]);
            to.extend_from_slice(&self.text[text.clone()]);
            at = at.max(span.end);
        }
        to.extend_from_slice(&line[at..]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_other_bytes_stay() {
        let line = b"N10 G2  X1 Y2 I3 J4 (to here)";
        let mut edits = Edits::default();
        edits.replace(5..6, |to| to.push(b'1'));
        edits.replace(9..10, |to| to.extend_from_slice(b"1.5"));
        edits.remove(line, 14..16);
        edits.remove(line, 17..19);
        edits.replace(19..19, |to| to.extend_from_slice(b" Z9"));
        let mut changed = Vec::new();
        edits.apply(line, &mut changed);
        assert_eq!(changed, b"N10 G1  X1.5 Y2 Z9 (to here)");
    }
}
