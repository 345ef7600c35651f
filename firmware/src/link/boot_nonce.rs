//! What tells the sessions of one start from those of all others.

/// Where a board gets its boot nonce from: a hardware random number generator, or a counter that
/// survives restarts.
pub trait BootNonce {
    /// A number that no start before has had. `None` if there is none: then the link opens no session.
    ///
    /// Called once, at start. Two starts with the same number obey each other's recorded frames.
    fn boot_nonce(&mut self) -> Option<u64>;
}
