//! The capacity of the controller that a compensation is made for.

mod file;

use crate::size::Size;
use serde::{Serialize, Serializer};
use trueaxis::SampleFormat;

/// Capacities of a controller: those of its [`Compensation`](trueaxis::Compensation)s, and the size of its table
/// slots.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Target {
    /// Name.
    pub name: String,
    /// Axes of a compensation.
    pub axes: usize,
    /// Banks: tables that share their points.
    pub banks: usize,
    /// Tables.
    pub tables: usize,
    /// Terms.
    pub terms: usize,
    /// Grids.
    pub grids: usize,
    /// Bytes of a blob that fit into a table slot; `None` if only memory limits it.
    pub bytes: Option<usize>,
    /// Preferred sample format.
    #[serde(serialize_with = "sample_format")]
    pub samples: SampleFormat,
}

fn sample_format<S: Serializer>(format: &SampleFormat, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(match format {
        SampleFormat::F32 => "f32",
        SampleFormat::I16 => "i16",
    })
}

/// A capacity that a compensation exceeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{needed} {what} are needed, there is room for {held}")]
pub struct Shortage {
    /// `axes`, `banks`, `tables`, `terms`, `grids` or `bytes`.
    pub what: &'static str,
    /// The number that the compensation needs.
    pub needed: usize,
    /// The number that the target holds.
    pub held: usize,
}

/// The used part of a capacity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, thiserror::Error)]
#[error("{used} of {held} {what}")]
pub struct Usage {
    /// `tables`, `terms` or `bytes`.
    pub what: &'static str,
    /// The number that the compensation uses.
    pub used: usize,
    /// The number that the target holds.
    pub held: usize,
}

impl Target {
    /// Names of the built-in targets.
    pub const NAMES: [&'static str; 2] = ["stm32f405", "desktop"];

    /// The built-in target with this name, one of [`Target::NAMES`].
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "stm32f405" => Some(Self::stm32f405()),
            "desktop" => Some(Self::desktop()),
            _ => None,
        }
    }

    /// The reference board, `firmware/boards/stm32f405`: slots of two sectors, minus the 384 bytes at their end
    /// (`docs/src/slots.md`).
    #[must_use]
    pub fn stm32f405() -> Self {
        Self {
            name: "stm32f405".to_owned(),
            axes: 8,
            banks: 32,
            tables: 96,
            terms: 256,
            grids: 2,
            // A slot reserves 128 bytes and four choices of 64.
            bytes: Some(256 * 1024 - 384),
            samples: SampleFormat::F32,
        }
    }

    /// A controller on a desktop computer, with the capacities of [`trueaxis::Largest`], the limits of the blob
    /// format.
    #[must_use]
    pub fn desktop() -> Self {
        Self {
            name: "desktop".to_owned(),
            axes: 16,
            banks: 255,
            tables: 255,
            terms: 4096,
            grids: 8,
            bytes: None,
            samples: SampleFormat::F32,
        }
    }

    /// The capacities that a compensation of this size exceeds; empty if it fits.
    #[must_use]
    pub fn shortages(&self, size: &Size) -> Vec<Shortage> {
        [
            ("axes", size.axes, Some(self.axes)),
            ("banks", size.banks, Some(self.banks)),
            ("tables", size.tables, Some(self.tables)),
            ("terms", size.terms, Some(self.terms)),
            ("grids", size.grids, Some(self.grids)),
            ("bytes", size.bytes, self.bytes),
        ]
        .into_iter()
        .filter_map(|(what, needed, held)| Some((what, needed, held?)))
        .filter(|(_, needed, held)| needed > held)
        .map(|(what, needed, held)| Shortage { what, needed, held })
        .collect()
    }

    /// The used part of those capacities that a finer tolerance needs more of.
    #[must_use]
    pub fn usage(&self, size: &Size) -> Vec<Usage> {
        [
            ("tables", size.tables, Some(self.tables)),
            ("terms", size.terms, Some(self.terms)),
            ("bytes", size.bytes, self.bytes),
        ]
        .into_iter()
        .filter_map(|(what, used, held)| {
            Some(Usage {
                what,
                used,
                held: held?,
            })
        })
        .collect()
    }
}

impl Default for Target {
    fn default() -> Self {
        Self::stm32f405()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_that_of_a_target() {
        for name in Target::NAMES {
            assert_eq!(Target::named(name).unwrap().name, name);
        }
        assert_eq!(Target::named("stm32f4"), None);
    }

    #[test]
    fn what_fits_exactly_fits_and_one_more_does_not() {
        let target = Target::stm32f405();
        let mut size = Size {
            axes: 8,
            tables: 96,
            banks: 32,
            terms: 256,
            grids: 2,
            samples: 0,
            bytes: 261_760,
        };
        assert_eq!(target.shortages(&size), []);
        size.terms += 1;
        size.bytes += 1;
        let short: Vec<String> = target
            .shortages(&size)
            .iter()
            .map(Shortage::to_string)
            .collect();
        assert_eq!(
            short,
            [
                "257 terms are needed, there is room for 256",
                "261761 bytes are needed, there is room for 261760"
            ]
        );
        size.bytes = usize::MAX;
        assert_eq!(Target::desktop().shortages(&size), []);
    }
}
