//! `cargo xtask oldest`: checks what users build with the oldest supported compiler, the `rust-version` in `Cargo.toml`.

use crate::files;
use crate::process::{NOT_RUN, root, run, target, works};
use std::process::Command;

/// # Errors
/// If `Cargo.toml` names no version, or something does not build.
pub fn execute() -> Result<(), String> {
    let manifest = files::read_text(&root().join("Cargo.toml"))?;
    let mut lines = manifest.lines();
    let version = lines.find_map(|line| line.strip_prefix("rust-version = "));
    let version = version.ok_or("Cargo.toml has no rust-version")?;
    let version = version.trim_matches('"');
    // These variables would prevent the proxy from selecting the toolchain.
    let without = |program| {
        let mut command = Command::new(program);
        command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
        command.current_dir(root());
        command
    };
    let oldest = format!("+{version}");
    if !works(without("cargo").args([&oldest, "--version"])) {
        let install = format!("toolchain install {version} --profile minimal");
        works(without("rustup").args(install.split(' ')));
    }
    if !works(without("cargo").args([&oldest, "--version"])) {
        eprintln!("{NOT_RUN}the oldest compiler, {version}, which `rustup` cannot install here");
        return Ok(());
    }
    // What users build. Artefacts of two compilers in one folder would replace each other.
    run(without("cargo")
        .args([
            &oldest,
            "check",
            "-q",
            "-p",
            "trueaxis-cli",
            "-p",
            "trueaxis-capi",
            "-p",
            "trueaxis-firmware",
        ])
        .env("CARGO_TARGET_DIR", target("oldest")))
}
