//! The controller that a compensation is made for: what it holds.

/// Capacities of a controller: the type parameters of its [`Compensation`](trueaxis::Compensation)
/// and the size of its table slots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// Its name.
    pub name: String,
    /// Axes of a compensation.
    pub axes: usize,
    /// Tables, and banks of them.
    pub tables: usize,
    /// Terms.
    pub terms: usize,
    /// Grids.
    pub grids: usize,
    /// Bytes of a blob that fit into a table slot; `None` where only memory limits them.
    pub bytes: Option<usize>,
}

impl Target {
    /// The reference board, `firmware/boards/stm32f405`: slots of two sectors, less the 128 bytes
    /// at their end (`docs/src/slots.md`).
    #[must_use]
    pub fn stm32f405() -> Self {
        Self {
            name: "stm32f405".to_owned(),
            axes: 8,
            tables: 96,
            terms: 256,
            grids: 2,
            bytes: Some(256 * 1024 - 128),
        }
    }
}

impl Default for Target {
    fn default() -> Self {
        Self::stm32f405()
    }
}
