//! What a release consists of, in `target/release-VERSION`, with checksums and a list of components.

use crate::debian::{self, Documents, fresh};
use lab_browser::web;
use lab_processors::{cross, hil};
use lab_systems::TestedSystem;
use programs::packages::provide_subcommand;
use programs::process::{cargo, output, root, run, target, works};
use programs::{VERSION, files, packages};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Without libraries of the system: the program runs under any Linux.
pub const STATIC: &str = "x86_64-unknown-linux-musl";

/// Makes all parts, in this folder.
///
/// # Errors
/// If something cannot be installed or built.
pub fn make(folder: PathBuf) -> Result<(), String> {
    if !cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        return Err("releases are built on Linux, on x86-64".into());
    }
    packages::provide("dpkg-deb", &["dpkg"], "`dist`")?;
    let _ = fs::remove_dir_all(&folder);
    let folder = files::folder(folder)?;
    let command = program(&folder, STATIC);
    files::copy(&static_command()?, &command)?;
    let documents = Documents::of(&command)?;
    debian::command(&command, &documents, "amd64", &folder)?;
    for system in TestedSystem::ALL {
        if let Some(built) = system.build("dist")? {
            let program = program(&folder, system.target());
            files::copy(&built, &program)?;
            if matches!(system, TestedSystem::Arm) {
                debian::command(&program, &documents, "arm64", &folder)?;
            }
        }
    }
    debian::library(&folder)?;
    let component = lab_linuxcnc::package()?;
    files::copy(&component, &in_folder(&folder, &component))?;
    files::copy(&web::build()?, &page(&folder))?;
    for build in [lab_python::check, lab_python::for_windows] {
        if let Some(wheel) = build()? {
            files::copy(&wheel, &in_folder(&folder, &wheel))?;
        }
    }
    images(&folder)?;
    components(&folder)?;
    sums(&folder)?;
    println!("the release is in {}", folder.display());
    Ok(())
}

/// The command for a target, in the folder of the release.
pub fn program(folder: &Path, target: &str) -> PathBuf {
    let ending = if target.contains("windows") {
        ".exe"
    } else {
        ""
    };
    folder.join(format!("trueaxis-{VERSION}-{target}{ending}"))
}

/// The page for browsers, in the folder of the release.
pub fn page(folder: &Path) -> PathBuf {
    folder.join(format!("trueaxis-{VERSION}.html"))
}

fn in_folder(folder: &Path, file: &Path) -> PathBuf {
    folder.join(file.file_name().unwrap_or_default())
}

/// The command without shared libraries.
fn static_command() -> Result<PathBuf, String> {
    works(Command::new("rustup").args(["target", "add", STATIC]));
    let words = "rustc -q --profile dist -p trueaxis-cli --bin trueaxis --target";
    run(cargo()
        .args(words.split(' '))
        .args([STATIC, "--", "-C", "strip=symbols"])
        .env("TRUEAXIS_BUILD", lab_systems::build_name("dist")?))?;
    Ok(target(STATIC).join("dist/trueaxis"))
}

/// The firmware of the boards.
fn images(folder: &Path) -> Result<(), String> {
    let cortex_m = cross::Cross::provide(cross::CORTEX_M)?;
    for board in hil::boards() {
        let built = cortex_m
            .build(board, "build -q --release")?
            .join("release")
            .join(board);
        let image = folder.join(format!("trueaxis-{VERSION}-{board}.elf"));
        files::copy(&built, &image)?;
    }
    Ok(())
}

/// The components of the command and of the C library, and their licences: a CycloneDX file each.
fn components(folder: &Path) -> Result<(), String> {
    provide_subcommand("cargo-cyclonedx")?;
    // It writes beside every manifest: in a clone.
    let source = fresh("source")?;
    run(Command::new("git")
        .args(["clone", "-q", "--depth", "1"])
        .arg(format!("file://{}", root().display()))
        .arg(&source))?;
    let words = "cyclonedx -q --format json --override-filename components";
    run(cargo().args(words.split(' ')).current_dir(&source))?;
    for (manifest, name) in [("host/cli", "trueaxis"), ("firmware/capi", "libtrueaxis")] {
        let list = folder.join(format!("{name}-{VERSION}.cdx.json"));
        files::copy(&source.join(manifest).join("components.json"), &list)?;
    }
    Ok(())
}

fn sums(folder: &Path) -> Result<(), String> {
    let mut names: Vec<_> = fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| Ok(entry?.file_name())).collect())
        .map_err(|e| format!("{}: {e}", folder.display()))?;
    names.sort();
    let text = output(Command::new("sha256sum").args(names).current_dir(folder))?;
    files::write(&folder.join("SHA256SUMS"), text)
}
