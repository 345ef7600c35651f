//! How much the library holds: options of its build, of which the header must be the same.

use crate::code::Code;

/// Grows whenever a program that was built with the header before could go wrong.
pub const TRUEAXIS_ABI: u32 = 2;
/// Most axes.
pub const TRUEAXIS_AXES: usize = number(option_env!("TRUEAXIS_AXES"), 8);
/// Most banks of tables.
pub const TRUEAXIS_BANKS: usize = number(option_env!("TRUEAXIS_BANKS"), 32);
/// Most tables, of all banks.
pub const TRUEAXIS_TABLES: usize = number(option_env!("TRUEAXIS_TABLES"), 96);
/// Most terms.
pub const TRUEAXIS_TERMS: usize = number(option_env!("TRUEAXIS_TERMS"), 256);
/// Most grids.
pub const TRUEAXIS_GRIDS: usize = number(option_env!("TRUEAXIS_GRIDS"), 2);

/// What tables have room for.
pub type Room =
    trueaxis::Holds<TRUEAXIS_AXES, TRUEAXIS_BANKS, TRUEAXIS_TABLES, TRUEAXIS_TERMS, TRUEAXIS_GRIDS>;

// What the runtime cannot number is an error of the build.
const _: usize = {
    <Room as trueaxis::Room>::AXES
        + <Room as trueaxis::Room>::BANKS
        + <Room as trueaxis::Room>::TABLES
        + <Room as trueaxis::Room>::TERMS
        + <Room as trueaxis::Room>::GRIDS
};

/// A capacity: the environment variable of its name when the library is built, or else the usual one.
const fn number(text: Option<&str>, usual: usize) -> usize {
    let Some(text) = text else { return usual };
    let digits = text.as_bytes();
    assert!(
        !digits.is_empty() && digits.len() <= 5,
        "a capacity is a number of one to five digits: TRUEAXIS_AXES=5"
    );
    let (mut at, mut value) = (0, 0);
    while at < digits.len() {
        assert!(
            digits[at].is_ascii_digit(),
            "a capacity is a number of one to five digits: TRUEAXIS_AXES=5"
        );
        value = 10 * value + (digits[at] - b'0') as usize;
        at += 1;
    }
    value
}

/// Where each number is in `TRUEAXIS_HEADER`, how many bits it has, and what is wrong if it is another.
const FIELDS: [(u32, u32, usize, Code); 6] = [
    (56, 8, TRUEAXIS_ABI as usize, Code::HeaderVersion),
    (48, 8, TRUEAXIS_AXES, Code::HeaderAxes),
    (40, 8, TRUEAXIS_BANKS, Code::HeaderBanks),
    (32, 8, TRUEAXIS_TABLES, Code::HeaderTables),
    (16, 16, TRUEAXIS_TERMS, Code::HeaderTerms),
    (0, 16, TRUEAXIS_GRIDS, Code::HeaderGrids),
];

/// What the header of this library says of itself: the macro of the same name.
pub const TRUEAXIS_HEADER: u64 = {
    let (mut header, mut place) = (0, 0);
    while place < FIELDS.len() {
        let (shift, bits, value, _) = FIELDS[place];
        assert!(value >> bits == 0);
        header |= (value as u64) << shift;
        place += 1;
    }
    header
};

/// A program was compiled for this library: otherwise its arrays and memory may be too small.
pub(crate) fn check(header: u64) -> Result<(), Code> {
    let other = header ^ TRUEAXIS_HEADER;
    let wrong = FIELDS
        .into_iter()
        .find(|(shift, bits, ..)| other >> shift & ((1 << bits) - 1) != 0);
    wrong.map_or(Ok(()), |(.., code)| Err(code))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_capacity_is_a_number() {
        assert_eq!(number(None, 8), 8);
        assert_eq!(number(Some("0"), 8), 0);
        assert_eq!(number(Some("65535"), 8), 65_535);
        for wrong in ["", "5 ", "-1", "five", "100000"] {
            let number = std::panic::catch_unwind(|| number(Some(wrong), 8));
            assert!(number.is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_header_of_other_capacities_is_refused_by_name() {
        assert_eq!(check(TRUEAXIS_HEADER), Ok(()));
        for (shift, bits, value, code) in FIELDS {
            for bit in 0..bits {
                assert_eq!(
                    check(TRUEAXIS_HEADER ^ 1 << (shift + bit)),
                    Err(code),
                    "{value}"
                );
            }
        }
    }
}
