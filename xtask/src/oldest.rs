//! `cargo xtask oldest`: checks what users build with the oldest supported compiler, the `rust-version` in
//! `Cargo.toml`.

use programs::Failure;
use programs::files;
use programs::process::{NOT_RUN, cargo_of, root, run, target, works};
use std::process::Command;

/// What users build.
const CHECK: &str = "check -q -p trueaxis-cli -p trueaxis-capi -p trueaxis-firmware";

/// # Errors
/// If `Cargo.toml` names no version, or something does not build.
pub fn check(_: &[&str]) -> Result<(), Failure> {
    let manifest = files::read_text(&root().join("Cargo.toml"))?;
    let mut lines = manifest.lines();
    let version = lines.find_map(|line| line.strip_prefix("rust-version = "));
    let version = version
        .ok_or("Cargo.toml has no rust-version".to_owned())?
        .trim_matches('"');
    if !works(cargo_of(version).arg("--version")) {
        let install = format!("toolchain install {version} --profile minimal");
        works(Command::new("rustup").args(install.split(' ')));
    }
    if !works(cargo_of(version).arg("--version")) {
        eprintln!("{NOT_RUN}the oldest compiler, {version}, which `rustup` cannot install here");
        return Ok(());
    }
    // Artefacts of two compilers in one folder would replace each other.
    let mut check = cargo_of(version);
    run(check
        .args(CHECK.split(' '))
        .env("CARGO_TARGET_DIR", target("oldest")))?;
    Ok(())
}
