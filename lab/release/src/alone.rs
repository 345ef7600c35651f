//! Each part of a release does its main job where there is nothing else: programs and the C library in a bare root,
//! those for other systems in Wine and QEMU, the component in LinuxCNC, the wheel in an environment of its own, the
//! page in browsers. Of the firmware, QEMU runs the same source built for the part that it has, and a model of the
//! STM32F405 runs its image as it is (`cargo xtask hil`).

use crate::contents::{STATIC, page, program};
use crate::debian::fresh;
use lab_browser::web;
use lab_systems::TestedSystem;
use programs::process::{NOT_RUN, has, is_root, output, root, run, works};
use programs::{files, packages};
use std::path::{Path, PathBuf};
use std::process::Command;

const EXAMPLE: [&str; 2] = [
    "examples/huron-k2x8/machine.toml",
    "examples/huron-k2x8/errors-13.toml",
];

/// Does with each part what it is for.
///
/// # Errors
/// If a part is missing, or does not work where there is nothing else.
pub fn check(folder: &Path) -> Result<(), String> {
    packages::provide("lintian", &["lintian"], "`dist --check`")?;
    run(Command::new("sha256sum")
        .args(["--quiet", "--check", "SHA256SUMS"])
        .current_dir(folder))?;
    packages_work(folder)?;
    other_systems(folder)?;
    wheels(folder)?;
    web::check(&page(folder))
}

fn packages_work(folder: &Path) -> Result<(), String> {
    let packages = files::list(folder, "deb")?;
    run(Command::new("lintian")
        .args(["--fail-on", "error"])
        .args(&packages))?;
    compiles_in_a_bare_root(&program(folder, STATIC))?;
    for package in &packages {
        let name = package.file_name().unwrap_or_default().to_string_lossy();
        match name.split('_').next() {
            Some("trueaxis") if name.ends_with("_amd64.deb") => compiles_in_a_bare_root(package)?,
            Some("libtrueaxis-dev") => links_in_a_bare_root(package)?,
            Some("linuxcnc-trueaxis") => lab_linuxcnc::package_corrects(package)?,
            _ => {}
        }
    }
    Ok(())
}

/// The command for other systems.
fn other_systems(folder: &Path) -> Result<(), String> {
    for system in TestedSystem::ALL {
        // It cannot be linked here.
        if matches!(system, TestedSystem::Mac) {
            continue;
        }
        // As it is called once it is installed.
        let installed = fresh(system.target())?.join(system.program());
        files::copy(&program(folder, system.target()), &installed)?;
        lab_systems::check(system, &installed)?;
    }
    Ok(())
}

fn wheels(folder: &Path) -> Result<(), String> {
    for wheel in files::list(folder, "whl")? {
        match wheel.to_string_lossy().ends_with("win_amd64.whl") {
            true => eprintln!(
                "{NOT_RUN}{}: there is no Python for Windows here",
                wheel.display()
            ),
            false => lab_python::alone(&wheel, &EXAMPLE)?,
        }
    }
    Ok(())
}

/// An empty folder with a package unpacked, or with a program, and with the example.
fn bare_root(part: &Path) -> Result<PathBuf, String> {
    let name = part.file_name().unwrap_or_default().to_string_lossy();
    let bare = fresh(&format!("bare-{name}"))?;
    if name.ends_with(".deb") {
        run(Command::new("dpkg-deb").arg("-x").args([part, &bare]))?;
    } else {
        let programs = files::folder(bare.join("usr/bin"))?;
        files::copy(part, &programs.join("trueaxis"))?;
    }
    for (source, name) in EXAMPLE.into_iter().zip(["machine.toml", "errors.toml"]) {
        files::copy(&root().join(source), &bare.join(name))?;
    }
    Ok(bare)
}

/// A command that sees nothing but this folder.
fn inside(bare: &Path, program: &str) -> Option<Command> {
    let mut command;
    if is_root() && has("chroot") {
        command = Command::new("chroot");
        command.arg(bare);
    } else {
        if !works(Command::new("unshare").args(["--map-root-user", "true"])) {
            eprintln!("{NOT_RUN}packages in a bare root: neither root nor user namespaces");
            return None;
        }
        command = Command::new("unshare");
        command.arg("--map-root-user").arg("--root").arg(bare);
    }
    command.arg(program);
    Some(command)
}

/// The command compiles and proves the Huron where there is nothing else.
fn compiles_in_a_bare_root(part: &Path) -> Result<(), String> {
    let bare = bare_root(part)?;
    let Some(mut compile) = inside(&bare, "/usr/bin/trueaxis") else {
        return Ok(());
    };
    let inputs = ["/machine.toml", "/errors.toml"];
    run(compile
        .arg("compile")
        .args(inputs)
        .args(["-o", "/huron.trax"]))
}

/// A program in C, built with what the package contains, corrects where there is nothing else.
fn links_in_a_bare_root(package: &Path) -> Result<(), String> {
    let bare = bare_root(package)?;
    lab_capi::compilers("the C library")?;
    let (lib, include) = (bare.join("usr/lib"), bare.join("usr/include"));
    run(Command::new("gcc")
        .args(["-std=c99", "-static", "-o"])
        .arg(bare.join("first"))
        .arg(root().join("firmware/capi/examples/first.c"))
        .args([
            format!("-I{}", include.display()),
            format!("-L{}", lib.display()),
        ])
        .args(["-ltrueaxis", "-lpthread", "-ldl", "-lm"]))?;
    files::copy(&lab_capi::blob("huron-13"), &bare.join("huron.trax"))?;
    let Some(mut first) = inside(&bare, "/first") else {
        return Ok(());
    };
    println!("{}", output(first.arg("/huron.trax"))?);
    Ok(())
}
