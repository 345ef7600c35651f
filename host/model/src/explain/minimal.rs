//! How many constants describe a machine: Everett's minimal number of parameters (source document, Eq. 1).

use crate::machine::Machine;
use std::fmt;

/// The number of independent constants of a chain of axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MinimalParameters {
    /// Number of rotary axes.
    pub rotary: usize,
    /// Number of linear axes.
    pub linear: usize,
}

impl MinimalParameters {
    /// For a machine without parallel rotary axes.
    #[must_use]
    pub fn of(machine: &Machine) -> Self {
        let axes = machine.axes.iter();
        let rotary = axes.filter(|axis| axis.letter.is_rotary()).count();
        Self {
            rotary,
            linear: machine.axes.len() - rotary,
        }
    }

    /// N = 4R + 2P + 6 (Eq. 1): a rotary axis has two angles and two offsets, a linear axis two angles, the tool a place and
    /// an orientation.
    #[must_use]
    pub fn all(&self) -> usize {
        4 * self.rotary + 2 * self.linear + 6
    }

    /// The location errors among them: without the six by which a workpiece is set up and the six of the tool.
    ///
    /// What moves workpiece and tool alike counts once: without a rotary axis a shift in all three directions, with one
    /// a shift along it, with two or more nothing. A machine without a rotary axis shows no orientation of its tool, so
    /// the rotations of workpiece and tool are not the same unknowns.
    #[must_use]
    pub fn locations(&self) -> usize {
        let both = match self.rotary {
            0 => 3,
            1 => 1,
            _ => 0,
        };
        (self.all() + both).saturating_sub(12)
    }
}

impl fmt::Display for MinimalParameters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} rotary and {} linear axes have N = 4R + 2P + 6 = {} independent constants: {} location errors; the others set up workpiece and tool",
            self.rotary,
            self.linear,
            self.all(),
            self.locations()
        )
    }
}
