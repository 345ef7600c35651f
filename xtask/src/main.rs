//! `cargo xtask`: developer and CI commands.
fn main() {}
