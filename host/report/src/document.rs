//! Metadata of a report.

use crc::{CRC_32_ISO_HDLC, Crc};
use serde::{Deserialize, Serialize};
use trueaxis_model::machine::Machine;

/// A file from which a report was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DescribedFile {
    /// Role: machine, errors, compensation …
    pub role: String,
    /// Name as given.
    pub name: String,
    /// Length in bytes.
    pub bytes: usize,
    /// CRC-32 of its bytes (that of ISO-HDLC, zip and PNG), eight hexadecimal digits.
    pub crc32: String,
}

impl DescribedFile {
    /// Describes a file with these bytes.
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

/// The subject of a report and its sources.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Document {
    /// Name of the machine.
    pub machine: String,
    /// Axes from the workpiece to the tool, with F for the foundation: `wCAYFXZSt`.
    pub topology: String,
    /// The date as given.
    pub date: Option<String>,
    /// Version of the program.
    pub version: String,
    /// The files.
    pub files: Vec<DescribedFile>,
    /// The position whose correction is subtracted, as given.
    pub reference_position: Option<String>,
    /// What the rotary axes correct.
    pub policy: String,
    /// The tolerance of the tables, at the tip.
    pub tolerance_um: f64,
    /// Like `tolerance_um`, for the tool direction or rotary axes.
    pub tolerance_urad: f64,
    /// Seed of the random positions.
    pub seed: u64,
}

impl Document {
    /// Metadata for a machine, without date and files, and with the version of this program.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        Self {
            machine: machine.name.clone(),
            topology: machine.topology(),
            date: None,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            files: Vec::new(),
            reference_position: None,
            policy: trueaxis_model::policy::stored(Default::default()).to_string(),
            tolerance_um: 0.05,
            tolerance_urad: 1.0,
            seed: 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::DescribedFile;

    #[test]
    fn checksums_are_those_of_other_programs() {
        // The check value from the catalogue of CRC algorithms.
        assert_eq!(DescribedFile::new("r", "n", b"123456789").crc32, "cbf43926");
    }
}
