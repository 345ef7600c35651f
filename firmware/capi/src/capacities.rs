//! Capacities of the library: build options, which the header must match.

use crate::code::Code;

/// Incremented whenever a program built with an earlier header could fail.
pub const TRUEAXIS_ABI: u32 = 4;
/// Maximum number of axes.
pub const TRUEAXIS_AXES: usize = number(option_env!("TRUEAXIS_AXES"), 8);
/// Maximum number of banks of tables.
pub const TRUEAXIS_BANKS: usize = number(option_env!("TRUEAXIS_BANKS"), 32);
/// Maximum number of tables in all banks.
pub const TRUEAXIS_TABLES: usize = number(option_env!("TRUEAXIS_TABLES"), 96);
/// Maximum number of terms.
pub const TRUEAXIS_TERMS: usize = number(option_env!("TRUEAXIS_TERMS"), 256);
/// Maximum number of grids.
pub const TRUEAXIS_GRIDS: usize = number(option_env!("TRUEAXIS_GRIDS"), 2);

/// Capacities of tables.
pub type Room =
    trueaxis::Holds<TRUEAXIS_AXES, TRUEAXIS_BANKS, TRUEAXIS_TABLES, TRUEAXIS_TERMS, TRUEAXIS_GRIDS>;

// Capacities that the runtime cannot index are a build error.
const _: usize = {
    <Room as trueaxis::Room>::AXES
        + <Room as trueaxis::Room>::BANKS
        + <Room as trueaxis::Room>::TABLES
        + <Room as trueaxis::Room>::TERMS
        + <Room as trueaxis::Room>::GRIDS
};

/// A capacity: the environment variable of that name at build time, or else the default.
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

/// Position and width in bits of each number in `TRUEAXIS_HEADER`, its value, and the code if it differs.
const FIELDS: [(u32, u32, usize, Code); 6] = [
    (56, 8, TRUEAXIS_ABI as usize, Code::HeaderVersion),
    (48, 8, TRUEAXIS_AXES, Code::HeaderAxes),
    (40, 8, TRUEAXIS_BANKS, Code::HeaderBanks),
    (32, 8, TRUEAXIS_TABLES, Code::HeaderTables),
    (16, 16, TRUEAXIS_TERMS, Code::HeaderTerms),
    (0, 16, TRUEAXIS_GRIDS, Code::HeaderGrids),
];

/// The value of the macro of the same name in this library's header.
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

/// Checks that a program was compiled for this library; otherwise its arrays and memory may be too small.
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
