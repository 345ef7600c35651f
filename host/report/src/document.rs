//! What a report says of itself: for whom it is a document.

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Serialize};
use trueaxis_model::machine::Machine;

/// A file that a report was made of.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct File {
    /// What it is for: machine, errors, compensation …
    pub role: String,
    /// Its name as it was given.
    pub name: String,
    /// Its length.
    pub bytes: usize,
    /// CRC-32 of its bytes (that of ISO-HDLC, zip and PNG), eight hexadecimal digits.
    pub crc32: String,
}

impl File {
    /// Of a file with these bytes.
    #[must_use]
    pub fn new(role: &str, name: &str, bytes: &[u8]) -> Self {
        Self {
            role: role.to_owned(),
            name: name.to_owned(),
            bytes: bytes.len(),
            crc32: format!("{:08x}", Crc::<u32>::new(&CRC_32_ISO_HDLC).checksum(bytes)),
        }
    }
}

/// What it is about, and from what it was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Name of the machine.
    pub machine: String,
    /// Its axes from the workpiece to the tool, F for the foundation: `wCAYFXZSt`.
    pub topology: String,
    /// The date that was given, as it was given.
    pub date: Option<String>,
    /// Version of the program.
    pub version: String,
    /// The files.
    pub files: Vec<File>,
    /// The position whose correction is left out, as it was given.
    pub reference_position: Option<String>,
    /// What rotary axes are corrected for.
    pub policy: String,
    /// The tolerance that tables are held to, at the tip.
    pub tolerance_um: f64,
    /// The same for the tool's direction or rotary axes.
    pub tolerance_urad: f64,
    /// Seed of the random positions.
    pub seed: u64,
}

impl Document {
    /// Of a machine, without date and files; made by this version.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        Self {
            machine: machine.name.clone(),
            topology: machine.topology(),
            date: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            files: Vec::new(),
            reference_position: None,
            policy: trueaxis_tables::policy::stored(Default::default()).to_string(),
            tolerance_um: 0.05,
            tolerance_urad: 1.0,
            seed: 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::File;

    #[test]
    fn checksums_are_those_of_other_programs() {
        // The check value of the algorithm's catalogue.
        assert_eq!(File::new("r", "n", b"123456789").crc32, "cbf43926");
    }
}
