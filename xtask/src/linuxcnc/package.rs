//! The package: built as Debian builds it, installable, and with a component that LinuxCNC loads.

use super::bench::Bench;
use crate::packages;
use crate::process::{cargo, root, run, target, works};
use std::fs;
use std::path::PathBuf;
use std::process::Command;

const FOLDER: &str = "linuxcnc-trueaxis";

/// # Errors
/// What does not build, or is not in the package.
pub fn check(bench: &Bench) -> Result<(), String> {
    no_part_of_a_crate()?;
    if !works(Command::new("dh").arg("--version")) {
        packages::install(&["debhelper", "dpkg-dev"], "the package for LinuxCNC")?;
    }
    let around = target("linuxcnc").join("package");
    let _ = fs::remove_dir_all(&around);
    fs::create_dir_all(&around).map_err(|e| format!("{}: {e}", around.display()))?;
    run(Command::new("cp")
        .arg("-r")
        .arg(root().join("firmware/linuxcnc"))
        .arg(around.join(FOLDER)))?;
    run(Command::new("dpkg-buildpackage")
        .args(["-b", "--no-sign"])
        .current_dir(around.join(FOLDER))
        .env("TRUEAXIS", target("linuxcnc").join("prefix"))
        .env_remove("MAKEFLAGS"))?;
    let package = built(&around)?;
    let files = around.join("files");
    run(Command::new("dpkg-deb").arg("-x").arg(&package).arg(&files))?;
    for name in [
        "lib/linuxcnc/modules/trueaxis_model.so",
        "share/man/man9/trueaxis.9.gz",
        "share/man/man9/trueaxis_model.9.gz",
        "share/doc/linuxcnc-trueaxis/copyright",
    ] {
        if !files.join("usr").join(name).exists() {
            return Err(format!("{name} is not in the package"));
        }
    }
    // It is for the series of LinuxCNC that it was built with, and for no other.
    let depends = Command::new("dpkg-deb")
        .args(["-f"])
        .arg(&package)
        .arg("Depends")
        .output()
        .map_err(|e| e.to_string())?;
    let depends = String::from_utf8_lossy(&depends.stdout).into_owned();
    if !depends.contains("linuxcnc-uspace (>= ") || !depends.contains("linuxcnc-uspace (<< ") {
        return Err(format!("the package depends on {depends}"));
    }
    // Everything that it depends on is there.
    run(Command::new("apt-get")
        .args(["-q", "-s", "install"])
        .arg(&package))?;
    let module = files.join("usr/lib/linuxcnc/modules/trueaxis.so");
    let said = bench.with_module(&module, || {
        bench.halrun("loadrt trueaxis file=/tmp/none.trax axes=XYZ units=mm\nshow funct\n")
    })?;
    if said.contains("trueaxis.write") && said.contains("/tmp/none.trax: No such file") {
        println!("package: {}", package.display());
        Ok(())
    } else {
        Err(format!(
            "the component of the package does not load:\n{said}"
        ))
    }
}

/// The crate beside it has nothing of it.
fn no_part_of_a_crate() -> Result<(), String> {
    let mut list = cargo();
    list.args([
        "package",
        "-q",
        "-p",
        "trueaxis-firmware",
        "--list",
        "--allow-dirty",
    ]);
    let listed = list.output().map_err(|e| e.to_string())?;
    let files = String::from_utf8_lossy(&listed.stdout).into_owned();
    match files.lines().find(|f| f.contains("linuxcnc")) {
        None if files.contains("src/lib.rs") => Ok(()),
        found => Err(format!(
            "the crate trueaxis-firmware has {found:?} among\n{files}"
        )),
    }
}

/// The one of this version.
fn built(around: &std::path::Path) -> Result<PathBuf, String> {
    let start = format!("{FOLDER}_{}_", env!("CARGO_PKG_VERSION"));
    let entries = fs::read_dir(around).map_err(|e| format!("{}: {e}", around.display()))?;
    let mut paths = entries.flatten().map(|e| e.path());
    paths
        .find(|p| {
            let name = p
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            name.starts_with(&start) && p.extension().is_some_and(|e| e == "deb")
        })
        .ok_or_else(|| format!("no {start}*.deb: is debian/changelog of this version?"))
}
