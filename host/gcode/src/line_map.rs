//! Which lines of a corrected program came from which line of the program.
//!
//! The writer says it of every line, and the check holds it against the text: one byte per written line, and eight
//! more where a motion is divided.

use std::io::{ErrorKind, Read, Result, Write};

/// What a written line is for the line of the program that it came from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Role {
    /// It moves nothing that is corrected: the line as it was, a comment, a mode, a dwell.
    Plain,
    /// It goes to the corrected path where the motion stands: at a reversal, or from where the machine was.
    Step,
    /// It moves along the motion up to here: 1 is its end. In a cycle its parts count, or its holes where it stays one.
    Until(f64),
}

/// A written line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// True for the first line that came from a line of the program.
    pub begins: bool,
    /// What it is.
    pub role: Role,
}

const BEGINS: u8 = 0x80;

impl Entry {
    /// Appends it to a map.
    ///
    /// # Errors
    /// Those of the writer.
    pub fn write(self, to: &mut impl Write) -> Result<()> {
        let begins = if self.begins { BEGINS } else { 0 };
        match self.role {
            Role::Plain => to.write_all(&[begins]),
            Role::Step => to.write_all(&[begins | 1]),
            Role::Until(1.0) => to.write_all(&[begins | 2]),
            Role::Until(part) => {
                to.write_all(&[begins | 3])?;
                to.write_all(&part.to_le_bytes())
            }
        }
    }
}

/// A map while it is read.
pub struct LineMap<R> {
    reader: R,
    next: Option<Entry>,
}

impl<R: Read> LineMap<R> {
    /// From its beginning.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn new(reader: R) -> Result<Self> {
        let mut map = Self { reader, next: None };
        map.next = map.read()?;
        Ok(map)
    }

    fn read(&mut self) -> Result<Option<Entry>> {
        let mut byte = [0];
        if self.reader.read(&mut byte)? == 0 {
            return Ok(None);
        }
        let role = match byte[0] & !BEGINS {
            0 => Role::Plain,
            1 => Role::Step,
            2 => Role::Until(1.0),
            3 => {
                let mut part = [0; 8];
                self.reader.read_exact(&mut part)?;
                Role::Until(f64::from_le_bytes(part))
            }
            _ => return Err(ErrorKind::InvalidData.into()),
        };
        Ok(Some(Entry {
            begins: byte[0] & BEGINS != 0,
            role,
        }))
    }

    /// What the next written lines are, up to the first one of the next line of the program.
    ///
    /// # Errors
    /// Those of the reader.
    pub fn group(&mut self, roles: &mut Vec<Role>) -> Result<()> {
        roles.clear();
        while let Some(entry) = self.next
            && (entry.begins == roles.is_empty())
        {
            roles.push(entry.role);
            self.next = self.read()?;
        }
        Ok(())
    }

    /// True if nothing is left.
    pub fn is_at_end(&self) -> bool {
        self.next.is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_read_as_they_were_written() {
        let groups = [
            vec![Role::Plain],
            vec![Role::Step, Role::Until(0.25), Role::Until(1.0)],
            vec![Role::Plain, Role::Until(3.0)],
        ];
        let mut bytes = Vec::new();
        for group in &groups {
            for (k, role) in group.iter().enumerate() {
                let begins = k == 0;
                Entry {
                    begins,
                    role: *role,
                }
                .write(&mut bytes)
                .unwrap();
            }
        }
        let mut map = LineMap::new(bytes.as_slice()).unwrap();
        let mut roles = Vec::new();
        for group in &groups {
            map.group(&mut roles).unwrap();
            assert_eq!(&roles, group);
        }
        assert!(map.is_at_end());
        map.group(&mut roles).unwrap();
        assert!(roles.is_empty());
    }
}
