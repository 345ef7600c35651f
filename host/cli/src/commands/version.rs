//! `trueaxis --version`: what a report of a fault has to say.

use std::env::consts::{ARCH, OS};
use std::sync::LazyLock;

/// The version, the commit and profile that it was built from, the system that it was built for, and the versions of
/// formats and protocols.
pub fn all() -> &'static str {
    static ALL: LazyLock<String> = LazyLock::new(|| {
        format!(
            "{}\nbuild        {}\nsystem       {ARCH} {OS}\n.trax format {}\nlink         {}",
            env!("CARGO_PKG_VERSION"),
            // Set by whoever builds releases.
            option_env!("TRUEAXIS_BUILD").unwrap_or("own, from source"),
            trueaxis::VERSION,
            trueaxis::link::PROTOCOL,
        )
    });
    ALL.as_str()
}
