//! Results of functions.

use core::ffi::CStr;
use trueaxis::{LoadError, Refused, WeightError};

/// Result of a function: 0, or the reason why it did nothing. `trueaxis_result_text` gives it in words.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Code {
    /// Done.
    Ok = 0,
    /// A pointer is null.
    NullPointer = 1,
    /// The memory is too small, or does not start at a multiple of the alignment.
    Memory = 2,
    /// The servo was released.
    Released = 3,
    /// A servo holds these tables, or another thread is loading them.
    InUse = 4,
    /// Nothing is loaded.
    NotLoaded = 5,
    /// The length of an array differs from the number of axes.
    Count = 6,
    /// There is no item with this index.
    Index = 7,
    /// There is no item with this name.
    Name = 8,
    /// The bytes are not a blob (`.trax`).
    NotABlob = 9,
    /// The blob has a format version that this library does not know.
    Version = 10,
    /// The bytes are damaged or incomplete: wrong length or checksum.
    Damaged = 11,
    /// The blob does not start at a multiple of 4 bytes.
    Misaligned = 12,
    /// The blob exceeds the capacities of this library.
    Capacity = 13,
    /// The contents of the blob are not valid.
    Contents = 14,
    /// The previous change of tables is not complete.
    Busy = 15,
    /// The axes differ in number, order, letter, travel or period.
    OtherAxes = 16,
    /// The auxiliary inputs differ in number, kind, name, reference or lag.
    OtherAuxiliaries = 17,
    /// This term does not exist or has a fixed weight.
    WeightFixed = 18,
    /// The weight is NAN or outside the limits of the term.
    WeightLimits = 19,
    /// The fade factor is ramping or a fade is in progress: there is no single correction to remove.
    Moving = 20,
    /// A bug in this library: please report it. The object must not be used any more.
    Broken = 21,
    /// The bytes are not a machine model as written by `trueaxis linuxcnc model`.
    NotAModel = 22,
    /// The program was compiled with the header of another version of this library.
    HeaderVersion = 23,
    /// The header has another `TRUEAXIS_AXES` than the library was built with.
    HeaderAxes = 24,
    /// The header has another `TRUEAXIS_BANKS` than the library was built with.
    HeaderBanks = 25,
    /// The header has another `TRUEAXIS_TABLES` than the library was built with.
    HeaderTables = 26,
    /// The header has another `TRUEAXIS_TERMS` than the library was built with.
    HeaderTerms = 27,
    /// The header has another `TRUEAXIS_GRIDS` than the library was built with.
    HeaderGrids = 28,
    /// The generated code was compiled with fused, reordered or wider floating-point operations: it does not give the
    /// bits of the compensation.
    OtherBits = 29,
}

/// In the order of [`Code`].
const TEXTS: [&CStr; 30] = [
    c"done",
    c"a pointer is null",
    c"the memory is too small or not aligned",
    c"the servo was released",
    c"these tables are in use",
    c"nothing is loaded",
    c"the array has not as many values as there are axes",
    c"there is none of this number",
    c"there is none of this name",
    c"not a compensation: it does not start with TRAX",
    c"a format version that this library does not know",
    c"the bytes are damaged or incomplete",
    c"the blob must start at a multiple of 4 bytes",
    c"the compensation needs more than this library holds",
    c"the contents of the blob are not valid",
    c"the previous change of tables is not finished",
    c"the axes differ in number, order, letter, travel or period",
    c"the auxiliary inputs differ in number, kind, name, reference or lag",
    c"this term does not exist or has a fixed weight",
    c"the weight must be a number within the limits of the term",
    c"the correction is on its way in or out",
    c"a mistake in this library: please report it",
    c"not a machine model: it does not start with TRAM",
    c"compiled with the header of another version of the library",
    c"TRUEAXIS_AXES of the header is not that of the library",
    c"TRUEAXIS_BANKS of the header is not that of the library",
    c"TRUEAXIS_TABLES of the header is not that of the library",
    c"TRUEAXIS_TERMS of the header is not that of the library",
    c"TRUEAXIS_GRIDS of the header is not that of the library",
    c"the generated code was compiled with fused, reordered or wider floating-point operations",
];

impl Code {
    /// A code in words.
    pub(crate) fn text(code: i32) -> &'static CStr {
        let found = usize::try_from(code).ok().and_then(|code| TEXTS.get(code));
        found.unwrap_or(&c"no code of this library")
    }
}

impl From<&LoadError> for Code {
    fn from(error: &LoadError) -> Self {
        match error {
            LoadError::NoHeader | LoadError::BadMagic => Self::NotABlob,
            LoadError::UnknownVersion { .. } => Self::Version,
            LoadError::WrongLength { .. } | LoadError::BadChecksum => Self::Damaged,
            LoadError::Misaligned => Self::Misaligned,
            LoadError::TooSmall { .. } => Self::Capacity,
            _ => Self::Contents,
        }
    }
}

impl From<Refused> for Code {
    fn from(refused: Refused) -> Self {
        match refused {
            Refused::Busy => Self::Busy,
            Refused::Axes => Self::OtherAxes,
            Refused::Auxiliaries => Self::OtherAuxiliaries,
        }
    }
}

impl From<WeightError> for Code {
    fn from(error: WeightError) -> Self {
        match error {
            WeightError::NotAdjustable => Self::WeightFixed,
            WeightError::OutsideLimits { .. } => Self::WeightLimits,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_has_a_text_of_its_own() {
        let unknown = Code::text(-1);
        for text in TEXTS {
            let same = TEXTS.into_iter().filter(|other| *other == text);
            assert!(same.count() == 1 && text != unknown);
        }
        for (code, text) in [
            (Code::Ok, c"done"),
            (
                Code::NotABlob,
                c"not a compensation: it does not start with TRAX",
            ),
            (Code::Moving, c"the correction is on its way in or out"),
            (
                Code::NotAModel,
                c"not a machine model: it does not start with TRAM",
            ),
        ] {
            assert_eq!(Code::text(code as i32), text);
        }
        assert_eq!(TEXTS.len(), Code::OtherBits as usize + 1);
        assert_eq!(Code::text(TEXTS.len() as i32), unknown);
    }
}
