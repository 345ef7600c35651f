//! What a blob says about the origin of its corrections: for people and hosts, not for controllers.

use alloc::string::String;
use alloc::vec::Vec;

use serde::{Deserialize, Serialize};

use crate::header::{Header, noted};

/// Where and how well the errors behind the corrections are known. The section at the end of a blob; a controller does
/// not read it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Notes {
    /// The ranges of the axes in which the error motions were measured: `[calibrated]` of the error file. An axis that
    /// is not listed has none.
    pub zone: Vec<Zone>,
    /// How far the measurements disagree with the error model beyond their noise, µm; `None` if it is not known.
    pub misfit_um: Option<f32>,
    /// Names of the error parameters that the measurements could not show: `[unseen]` of the error file.
    pub unseen: Vec<String>,
}

/// The calibrated range of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    /// Index of the axis.
    pub axis: u8,
    /// Ends, mm or degrees.
    pub range: [f32; 2],
}

impl Notes {
    /// Reads the notes of a blob that has been loaded. `None` if it has none, or none that this version can read.
    #[must_use]
    pub fn of(blob: &[u8]) -> Option<Self> {
        let length = Header::read(blob).ok()?.length as usize;
        let start = length.checked_sub(noted(blob).into())?;
        let notes = blob.get(start..length).filter(|notes| !notes.is_empty())?;
        postcard::from_bytes(notes).ok()
    }

    /// The section of a blob; empty if there is nothing to say.
    pub(crate) fn encode(&self) -> Result<Vec<u8>, postcard::Error> {
        if *self == Self::default() {
            return Ok(Vec::new());
        }
        postcard::to_allocvec(self)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use super::*;
    use crate::{Largest, specimen};

    #[test]
    fn notes_come_back_from_a_blob_and_change_no_correction() {
        let mut draft = specimen::everything();
        let plain = draft.encode().unwrap();
        assert_eq!(Notes::of(&plain), None);
        draft.notes = Notes {
            zone: vec![Zone {
                axis: 2,
                range: [-55.0, 55.0],
            }],
            misfit_um: Some(1.5),
            unseen: vec!["EX0S".into()],
        };
        let noted = draft.encode().unwrap();
        assert_eq!(Notes::of(&noted), Some(draft.notes));
        // Header, description and samples are the same but for lengths and checksum.
        assert_eq!(noted[HEADER..plain.len()], plain[HEADER..]);
        let c = Largest::from_blob(&noted).unwrap();
        assert_eq!(c.blob_len(), noted.len());
        // In a slot something else follows.
        let slot = [&noted[..], &[0xff; 40]].concat();
        assert_eq!(Notes::of(&slot), Notes::of(&noted));
        assert_eq!(Notes::of(&noted[..20]), None);
    }

    use crate::format::HEADER;
}
