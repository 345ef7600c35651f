//! The number that distinguishes the sessions of one start from those of all others.

/// Source of a board's boot nonce: a hardware random number generator, or a counter that survives restarts.
pub trait BootNonce {
    /// A number that no earlier start has used. If it returns `None`, the link opens no session.
    ///
    /// Called once, at start. With equal nonces, frames recorded during one start would be accepted in another.
    fn boot_nonce(&mut self) -> Option<u64>;
}
