//! The nine axes of a program, and positions of them.

use trueaxis_model::machine::Letter;

/// How many letters of axes there are.
pub const COUNT: usize = 9;

/// The letters, in the order of every [`PerLetter`].
pub const LETTERS: [u8; COUNT] = *b"XYZABCUVW";

/// One value per letter: mm, of A, B and C degrees.
pub type PerLetter = [f64; COUNT];

/// What f64 loses between words and positions (mm, degrees): no motion.
pub const NOTHING: f64 = 1e-9;

/// The largest number (mm, degrees) of a program and of its setup. Of larger ones f64 does not hold the digits that
/// matter: at 1e8 sums are rounded by 1.5e-8, far below the resolution of words.
pub const LARGEST: f64 = 1e8;

/// False for what is larger than [`LARGEST`], for infinities and NaN.
#[must_use]
pub(crate) fn can_be(value: f64) -> bool {
    value.abs() <= LARGEST
}

/// The place of a letter in a [`PerLetter`].
#[must_use]
pub fn index(letter: u8) -> Option<usize> {
    let place = match letter {
        b'X'..=b'Z' => letter - b'X',
        b'A'..=b'C' => letter - b'A' + 3,
        b'U'..=b'W' => letter - b'U' + 6,
        _ => return None,
    };
    Some(usize::from(place))
}

/// The place of an axis of a machine: machines and programs have the same nine letters.
#[must_use]
pub fn of_machine(letter: Letter) -> usize {
    match letter.char() {
        'X' => 0,
        'Y' => 1,
        'Z' => 2,
        'A' => 3,
        'B' => 4,
        'C' => 5,
        'U' => 6,
        'V' => 7,
        _ => 8,
    }
}

/// True for A, B and C.
#[must_use]
pub fn is_rotary(axis: usize) -> bool {
    (3..6).contains(&axis)
}

/// Letter, for messages.
#[must_use]
pub fn name(axis: usize) -> char {
    char::from(LETTERS[axis])
}

/// Commanded positions (mm, degrees), each of which may be unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// Where; 0 where it is not known.
    pub at: PerLetter,
    /// One bit per letter whose position is known.
    pub known: u16,
}

impl Position {
    /// True if an axis' position is known.
    #[must_use]
    pub fn knows(&self, axis: usize) -> bool {
        self.known & (1 << axis) != 0
    }

    /// Gives an axis a position.
    pub fn set(&mut self, axis: usize, value: f64) {
        self.at[axis] = value;
        self.known |= 1 << axis;
    }

    /// Forgets where an axis is.
    pub(crate) fn forget(&mut self, axis: usize) {
        self.at[axis] = 0.0;
        self.known &= !(1 << axis);
    }

    /// The first of these axes (bits) that is not known.
    #[must_use]
    pub fn missing(&self, axes: u16) -> Option<usize> {
        let missing = axes & !self.known;
        (missing != 0).then(|| missing.trailing_zeros() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_of_a_machine_has_the_place_of_its_letter() {
        for (place, letter) in LETTERS.iter().enumerate() {
            let of_machine = Letter::new(char::from(*letter)).map(of_machine);
            assert_eq!(of_machine, Some(place));
        }
        let others = (b'A'..=b'Z').filter(|l| index(*l).is_none());
        for letter in others.map(char::from) {
            assert_eq!(Letter::new(letter), None);
        }
    }
}
