//! Packages of the distribution that the commands need.

use crate::process::{run, works};
use std::process::Command;

/// Installs packages with `apt-get`, as root or with `sudo`.
///
/// # Errors
/// Neither is possible; the message says what to install by hand.
pub fn install(packages: &[&str], what_for: &str) -> Result<(), String> {
    let names = packages.join(" ");
    let by_hand = format!("{what_for} needs the packages {names} (Debian's names); install them");
    if !works(Command::new("apt-get").arg("--version")) {
        return Err(by_hand);
    }
    eprintln!("{what_for} needs {names}: installing");
    let command = || {
        if works(Command::new("sh").args(["-c", "test $(id -u) = 0"])) {
            return Command::new("apt-get");
        }
        let mut sudo = Command::new("sudo");
        // A question for a password would stop a build that nobody watches.
        sudo.args(["-n", "apt-get"]);
        sudo
    };
    let by_hand = |cause: String| format!("{by_hand} ({cause})");
    // What is known of the packages may be older than what the mirror still has.
    run(command().args(["-q", "update"])).map_err(by_hand)?;
    let mut install = command();
    install
        .env("DEBIAN_FRONTEND", "noninteractive")
        .args(["-q", "install", "-y", "--no-install-recommends"])
        .args(packages);
    run(&mut install).map_err(by_hand)
}
