//! Packages of the distribution, and subcommands of cargo, installed if they are missing.

use crate::process::{cargo, has, is_root, output, run, target, works};
use std::fs::File;
use std::process::Command;

/// What the steps of `cargo xtask test --all` install. [`install_all`] fetches them while tests are compiled; a step still
/// installs what it misses.
const OF_STEPS: &[&str] = &[
    "binaryen",
    "chromium",
    "clang",
    "debhelper",
    "dpkg-dev",
    "firefox-esr",
    "fonts-dejavu-core",
    "gcc-aarch64-linux-gnu",
    "gcc-arm-linux-gnueabihf",
    "gcc-mingw-w64-x86-64",
    "imagemagick",
    "libc6-dbg",
    "libc6-dev-arm64-cross",
    "libc6-dev-armhf-cross",
    "linuxcnc-uspace",
    "linuxcnc-uspace-dev",
    "poppler-utils",
    "python3-venv",
    "qemu-system-arm",
    "qemu-system-misc",
    "qemu-user",
    "valgrind",
    "wine",
    "wine64",
    "xdotool",
    "xfonts-base",
    "xvfb",
    "zopfli",
];

/// Installs what the steps of `cargo xtask test --all` need. What fails here is left to the steps.
pub fn install_all() {
    if !are_whole(OF_STEPS)
        && let Err(cause) = install(OF_STEPS, "`test --all`")
    {
        eprintln!("{cause}");
    }
}

/// Installs packages unless a program reports its version.
///
/// # Errors
/// As for [`install`].
pub fn provide(program: &str, packages: &[&str], what_for: &str) -> Result<(), String> {
    // A program may be there before what it needs, while another step installs it.
    drop(locked());
    match has(program) {
        true => Ok(()),
        false => install(packages, what_for),
    }
}

/// Installs packages with `apt-get`, as root or with `sudo`.
///
/// # Errors
/// If neither is possible; the message says what to install by hand.
pub fn install(packages: &[&str], what_for: &str) -> Result<(), String> {
    let names = packages.join(" ");
    let by_hand = format!("{what_for} needs the packages {names} (Debian's names); install them");
    if !has("apt-get") {
        return Err(by_hand);
    }
    eprintln!("{what_for} needs {names}: installing");
    let by_hand = |cause: String| format!("{by_hand} ({cause})");
    let _lock = locked().map_err(|e| by_hand(e.to_string()))?;
    // The local package list may be older than the contents of the mirror.
    run(as_root("apt-get").args(["-q", "update"])).map_err(by_hand)?;
    let install = |options: &[&str]| {
        let mut install = as_root("apt-get");
        install
            // Another installation may be in progress, such as automatic updates.
            .args(["-o", "DPkg::Lock::Timeout=120"])
            .args(["-q", "install", "-y", "--no-install-recommends"])
            .args(options)
            .args(packages);
        run(&mut install)
    };
    if install(&[]).is_ok() && are_whole(packages) {
        return Ok(());
    }
    // An interrupted installation (power loss, time limit) must be completed before any other. Its half-unpacked
    // packages count as installed until they are installed again.
    run(as_root("dpkg").args(["--configure", "-a"])).map_err(by_hand)?;
    install(&["--reinstall"]).map_err(by_hand)
}

/// Steps that run beside each other install one after the other; the lock ends with the file.
fn locked() -> std::io::Result<File> {
    let lock = File::create(target("packages.lock"))?;
    lock.lock()?;
    Ok(lock)
}

/// Installs a cargo subcommand that comes as a package, if it is missing.
///
/// # Errors
/// If the installation fails.
pub fn provide_subcommand(package: &str) -> Result<(), String> {
    let subcommand = package.trim_start_matches("cargo-");
    if works(cargo().args([subcommand, "--version"])) {
        return Ok(());
    }
    eprintln!("{package} is not installed: building it, once (a few minutes)");
    // Beside the other builds, so that an interrupted one is continued.
    run(cargo()
        .args(["install", package, "--locked"])
        .env("CARGO_TARGET_DIR", target("tools")))
}

/// Whether packages are unpacked and configured.
fn are_whole(packages: &[&str]) -> bool {
    let mut query = Command::new("dpkg-query");
    let states = output(query.args(["-W", "-f=${Status}\n"]).args(packages));
    states.is_ok_and(|states| {
        states.lines().count() >= packages.len()
            && states.lines().all(|line| line == "install ok installed")
    })
}

/// A command that runs as root without prompting.
fn as_root(program: &str) -> Command {
    let quietly = ["DEBIAN_FRONTEND=noninteractive", program];
    let mut command;
    if is_root() {
        command = Command::new("env");
    } else {
        command = Command::new("sudo");
        // A password prompt would stop an unattended build.
        command.args(["-n", "env"]);
    }
    command.args(quietly);
    command
}
