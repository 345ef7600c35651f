//! `cargo xtask dist`: what a release consists of, in `target/release-VERSION`, with checksums and a list of components.
//! Each part does its main job where there is nothing else: programs and the C library in a bare root, the component in
//! LinuxCNC, the wheel in an environment of its own, the page in browsers. Of the firmware, QEMU runs the same source
//! built for the part that it has, and a model of the STM32F405 runs its image as it is (`cargo xtask hil`).

use crate::process::{NOT_RUN, cargo, has, is_root, output, provide, root, run, target, works};
use crate::{capi, cross, files, hil, linuxcnc, packages, python, web};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Without libraries of the system: the program runs under any Linux.
const STATIC: &str = "x86_64-unknown-linux-musl";
/// What these packages are built for, as Debian calls it.
const ARCHITECTURE: &str = "amd64";
const MAINTAINER: &str = "The trueaxis maintainers <trueaxis@users.noreply.github.com>";
const EXAMPLE: [&str; 2] = [
    "examples/huron-k2x8/machine.toml",
    "examples/huron-k2x8/errors-13.toml",
];

/// # Errors
/// If something cannot be installed or built, or a package does not work in a bare root.
pub fn execute() -> Result<(), String> {
    if !cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        return Err("releases are built on Linux, on x86-64".into());
    }
    packages::provide("dpkg-deb", &["dpkg"], "`dist`")?;
    let folder = target(&format!("release-{VERSION}"));
    let _ = fs::remove_dir_all(&folder);
    let folder = files::folder(folder)?;
    let program = folder.join(format!("trueaxis-{VERSION}-{STATIC}"));
    files::copy(&static_command()?, &program)?;
    let command = command_package(&program, &folder)?;
    let library = library_package(&folder)?;
    let component = linuxcnc::package()?;
    files::copy(&component, &in_folder(&folder, &component))?;
    let page = folder.join(format!("trueaxis-{VERSION}.html"));
    files::copy(&web::build()?, &page)?;
    let wheel = python::execute()?;
    if let Some(wheel) = &wheel {
        files::copy(wheel, &in_folder(&folder, wheel))?;
    }
    images(&folder)?;
    components(&folder)?;
    compiles_in_a_bare_root(&program)?;
    compiles_in_a_bare_root(&command)?;
    links_in_a_bare_root(&library)?;
    linuxcnc::package_corrects(&component)?;
    if let Some(wheel) = &wheel {
        python::alone(wheel, &EXAMPLE)?;
    }
    web::check(&page)?;
    sums(&folder)?;
    println!("the release is in {}", folder.display());
    Ok(())
}

fn in_folder(folder: &Path, file: &Path) -> PathBuf {
    folder.join(file.file_name().unwrap_or_default())
}

/// The command without shared libraries.
fn static_command() -> Result<PathBuf, String> {
    works(Command::new("rustup").args(["target", "add", STATIC]));
    let words = "build -q --profile dist -p trueaxis-cli --bin trueaxis --target";
    run(cargo().args(words.split(' ')).arg(STATIC))?;
    Ok(target(STATIC).join("dist/trueaxis"))
}

/// A package of the files below `staged`.
fn package(staged: &Path, name: &str, control: &str, folder: &Path) -> Result<PathBuf, String> {
    let documents = files::folder(staged.join("usr/share/doc").join(name))?;
    let licence =
        ["LICENSE-MIT", "LICENSE-APACHE"].map(|name| files::read_text(&root().join(name)));
    let [mit, apache] = licence;
    let copyright = format!(
        "MIT or Apache-2.0, at your option.\n\n{}\n\n{}",
        mit?, apache?
    );
    files::write(&documents.join("copyright"), copyright)?;
    let about = files::folder(staged.join("DEBIAN"))?;
    let fields = format!(
        "Package: {name}\nVersion: {VERSION}\nArchitecture: {ARCHITECTURE}\nPriority: optional\n\
         Maintainer: {MAINTAINER}\nHomepage: https://github.com/trueaxis/trueaxis\n{control}"
    );
    files::write(&about.join("control"), fields)?;
    let package = folder.join(format!("{name}_{VERSION}_{ARCHITECTURE}.deb"));
    run(Command::new("dpkg-deb")
        .args(["--build", "--root-owner-group"])
        .args([staged, &package]))?;
    Ok(package)
}

fn fresh(name: &str) -> Result<PathBuf, String> {
    let folder = target("dist-parts").join(name);
    let _ = fs::remove_dir_all(&folder);
    files::folder(folder)
}

/// The command, its manual pages and its completions.
fn command_package(program: &Path, folder: &Path) -> Result<PathBuf, String> {
    let staged = fresh("command")?;
    let programs = files::folder(staged.join("usr/bin"))?;
    files::copy(program, &programs.join("trueaxis"))?;
    let pages = files::folder(staged.join("usr/share/man/man1"))?;
    run(Command::new(program).arg("man").arg(&pages))?;
    run(Command::new("gzip")
        .args(["-9", "-n"])
        .args(files::list(&pages, "1")?))?;
    for (shell, place) in [
        ("bash", "bash-completion/completions/trueaxis"),
        ("zsh", "zsh/vendor-completions/_trueaxis"),
        ("fish", "fish/vendor_completions.d/trueaxis.fish"),
    ] {
        let file = staged.join("usr/share").join(place);
        files::folder(file.parent().unwrap_or(&staged).to_owned())?;
        let script = output(Command::new(program).args(["completions", shell]))?;
        files::write(&file, script)?;
    }
    let examples = files::folder(staged.join("usr/share/doc/trueaxis"))?;
    run(Command::new("cp")
        .arg("-r")
        .arg(root().join("examples"))
        .arg(&examples))?;
    let control = "Section: science\nDescription: machine tool compensation tables from measurements\n \
         From probings and runs of instruments to error parameters, from these to the\n \
         fewest tables that correct them, and onto the control.\n";
    package(&staged, "trueaxis", control, folder)
}

/// The C library.
fn library_package(folder: &Path) -> Result<PathBuf, String> {
    let staged = fresh("library")?;
    let prefix = files::folder(staged.join("usr"))?;
    capi::install(&["--prefix", &prefix.to_string_lossy()])?;
    let control = "Section: libdevel\nDepends: libc6\nDescription: machine tool compensation at servo rate, C library\n \
         Static and shared library, header and pkg-config file.\n";
    package(&staged, "libtrueaxis-dev", control, folder)
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
    provide("cargo-cyclonedx")?;
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
    capi::compilers("the C library")?;
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
    files::copy(
        &root().join(capi::BLOBS).join("huron-13.trax"),
        &bare.join("huron.trax"),
    )?;
    let Some(mut first) = inside(&bare, "/first") else {
        return Ok(());
    };
    println!("{}", output(first.arg("/huron.trax"))?);
    Ok(())
}
