//! The package: built like Debian does, installable, and with a component that LinuxCNC loads.

use super::bench::LinuxCncBench;
use super::halrun;
use lab_capi::{BuildCapacities, install};
use programs::process::{is_there, output, root, run, target};
use programs::{files, packages};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const FOLDER: &str = "linuxcnc-trueaxis";
/// The component in the package.
const MODULE: &str = "usr/lib/linuxcnc/modules/trueaxis.so";

/// # Errors
/// If something does not build, or is not in the package.
pub fn check(bench: &LinuxCncBench) -> Result<(), String> {
    lab_capi::leaves_out("linuxcnc")?;
    let around = target("linuxcnc").join("package");
    let package = build(&target("linuxcnc").join("prefix"), &around)?;
    let files = around.join("files");
    run(Command::new("dpkg-deb").arg("-x").arg(&package).arg(&files))?;
    for name in [
        "lib/linuxcnc/modules/trueaxis_model.so",
        "share/trueaxis/trueaxis_panel.py",
        "share/trueaxis/trueaxis-panel.ui",
        "share/man/man9/trueaxis.9.gz",
        "share/man/man9/trueaxis_model.9.gz",
        "share/doc/linuxcnc-trueaxis/copyright",
    ] {
        if !files.join("usr").join(name).exists() {
            return Err(format!("{name} is not in the package"));
        }
    }
    // It is only for the series of LinuxCNC with which it was built.
    let mut depends = Command::new("dpkg-deb");
    let depends = output(depends.arg("-f").arg(&package).arg("Depends"))?;
    if !depends.contains("linuxcnc-uspace (>= ") || !depends.contains("linuxcnc-uspace (<< ") {
        return Err(format!("the package depends on {depends}"));
    }
    // All its dependencies are available.
    run(Command::new("apt-get")
        .args(["-q", "-s", "install"])
        .arg(&package))?;
    let module = files.join(MODULE);
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

/// The component of a package corrects as `trueaxis eval` does, to the last bit.
///
/// # Errors
/// If something cannot be installed or built, or a correction differs.
pub fn corrects(package: &Path) -> Result<(), String> {
    let bench = LinuxCncBench::provide()?;
    let files = target("linuxcnc").join("unpacked");
    run(Command::new("dpkg-deb").arg("-x").arg(package).arg(&files))?;
    let module = files.join(MODULE);
    bench.with_module(&module, || halrun::check(&bench))
}

/// `cargo xtask linuxcnc-deb`: the package, in the target folder; returns its path.
///
/// # Errors
/// If something cannot be installed or built.
pub fn execute() -> Result<PathBuf, String> {
    super::bench::provide_linuxcnc()?;
    let folder = target("linuxcnc-deb");
    let prefix = folder.join("prefix");
    install::below(&prefix, &BuildCapacities::USUAL)?;
    let package = build(&prefix, &folder.join("package"))?;
    let name = package.file_name().unwrap_or_default().to_string_lossy();
    let result = target(&name);
    files::copy(&package, &result)?;
    println!("{0}\nsudo apt install {0}", result.display());
    Ok(result)
}

/// The component for Linux on ARM, where most small controllers run LinuxCNC: built by the cross compiler, not run.
///
/// # Errors
/// If something cannot be installed or built.
pub fn for_arm() -> Result<(), String> {
    super::bench::provide_linuxcnc()?;
    let what_for = "the component for ARM";
    let compiler = "aarch64-linux-gnu-gcc";
    packages::provide(
        compiler,
        &["gcc-aarch64-linux-gnu", "libc6-dev-arm64-cross"],
        what_for,
    )?;
    let folder = files::folder(target("linuxcnc-arm"))?;
    let prefix = folder.join("prefix");
    files::folder(prefix.join("lib"))?;
    files::folder(prefix.join("include"))?;
    files::copy(&lab_capi::arm_library()?, &prefix.join("lib/libtrueaxis.a"))?;
    let header = root().join("firmware/capi/trueaxis.h");
    files::copy(&header, &prefix.join("include/trueaxis.h"))?;
    let paths = arm_tools(folder.join("tools"))?;
    for (component, makefile) in [
        ("trueaxis", "Makefile"),
        ("trueaxis_model", "model/Makefile"),
    ] {
        let built = folder.join(component);
        let _ = fs::remove_dir_all(&built);
        let built = files::folder(built)?;
        run(Command::new("make")
            .arg("-f")
            .arg(root().join("firmware/linuxcnc").join(makefile))
            .arg(format!("TRUEAXIS={}", prefix.display()))
            .current_dir(&built)
            .env("PATH", &paths)
            .env_remove("MAKEFLAGS"))?;
        is_for_arm(&built.join(component).with_extension("so"))?;
    }
    Ok(())
}

/// Makes the cross tools available by the names that LinuxCNC's makefile has for its own; returns the path.
fn arm_tools(folder: PathBuf) -> Result<OsString, String> {
    let folder = files::folder(folder)?;
    for tool in ["gcc", "ld", "objcopy"] {
        let path = folder.join(tool);
        let script = format!("#!/bin/sh\nexec aarch64-linux-gnu-{tool} \"$@\"\n");
        files::write(&path, script)?;
        run(Command::new("chmod").arg("+x").arg(&path))?;
    }
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let paths = [folder].into_iter().chain(std::env::split_paths(&paths));
    std::env::join_paths(paths).map_err(|e| format!("PATH: {e}"))
}

fn is_for_arm(module: &Path) -> Result<(), String> {
    let mut readelf = Command::new("aarch64-linux-gnu-readelf");
    let said = output(readelf.arg("-hs").arg(module))?;
    if !said.contains("AArch64") || !said.contains("rtapi_app_main") {
        return Err(format!("{} is no component for ARM", module.display()));
    }
    println!("{}: built, not run", module.display());
    Ok(())
}

/// Builds the package in a copy of the source, in the folder `around`; `prefix` has the C library.
fn build(prefix: &Path, around: &Path) -> Result<PathBuf, String> {
    if !(is_there("dh") && is_there("dpkg-buildpackage")) {
        packages::install(&["debhelper", "dpkg-dev"], "the package for LinuxCNC")?;
    }
    let _ = fs::remove_dir_all(around);
    let around = files::folder(around.to_owned())?;
    run(Command::new("cp")
        .arg("-r")
        .arg(root().join("firmware/linuxcnc"))
        .arg(around.join(FOLDER)))?;
    run(Command::new("dpkg-buildpackage")
        .args(["-b", "--no-sign"])
        .current_dir(around.join(FOLDER))
        .env("TRUEAXIS", prefix)
        .env_remove("MAKEFLAGS"))?;
    built(&around)
}

/// The package of this version.
fn built(around: &Path) -> Result<PathBuf, String> {
    let start = format!("{FOLDER}_{}_", programs::VERSION);
    let is_it = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default();
        name.to_string_lossy().starts_with(&start)
    };
    let mut packages = files::list(around, "deb")?.into_iter();
    packages
        .find(is_it)
        .ok_or_else(|| format!("no {start}*.deb: is debian/changelog of this version?"))
}
