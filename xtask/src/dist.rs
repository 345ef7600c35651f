//! `cargo xtask dist`: what a release consists of, in `target/release-VERSION`, with checksums and a list of components.
//!
//! `cargo xtask dist --check`: each part of that does its main job where there is nothing else: programs and the C library in
//! a bare root, those for other systems in Wine and QEMU, the component in LinuxCNC, the wheel in an environment of its own,
//! the page in browsers. Of the firmware, QEMU runs the same source built for the part that it has, and a model of the
//! STM32F405 runs its image as it is (`cargo xtask hil`).

use crate::process::{NOT_RUN, cargo, has, is_root, output, provide, root, run, target, works};
use crate::systems::{self, TestedSystem};
use crate::{capi, cross, files, hil, linuxcnc, packages, python, web};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Without libraries of the system: the program runs under any Linux.
const STATIC: &str = "x86_64-unknown-linux-musl";
const MAINTAINER: &str = "The trueaxis maintainers <trueaxis@users.noreply.github.com>";
const EXAMPLE: [&str; 2] = [
    "examples/huron-k2x8/machine.toml",
    "examples/huron-k2x8/errors-13.toml",
];

/// # Errors
/// If something cannot be installed or built, or with `--check`, if a part is missing or does not work where there is nothing
/// else.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let folder = target(&format!("release-{VERSION}"));
    match options {
        [] => make(folder),
        ["--check"] => check(&folder),
        _ => Err("write `cargo xtask dist`, with --check or nothing".into()),
    }
}

fn make(folder: PathBuf) -> Result<(), String> {
    if !cfg!(all(target_arch = "x86_64", target_os = "linux")) {
        return Err("releases are built on Linux, on x86-64".into());
    }
    packages::provide("dpkg-deb", &["dpkg"], "`dist`")?;
    let _ = fs::remove_dir_all(&folder);
    let folder = files::folder(folder)?;
    let command = program(&folder, STATIC);
    files::copy(&static_command()?, &command)?;
    let documents = Documents::of(&command)?;
    command_package(&command, &documents, "amd64", &folder)?;
    for system in TestedSystem::ALL {
        if let Some(built) = system.build("dist")? {
            let program = program(&folder, system.target());
            files::copy(&built, &program)?;
            if matches!(system, TestedSystem::Arm) {
                command_package(&program, &documents, "arm64", &folder)?;
            }
        }
    }
    library_package(&folder)?;
    let component = linuxcnc::package()?;
    files::copy(&component, &in_folder(&folder, &component))?;
    files::copy(&web::build()?, &page(&folder))?;
    for build in [python::execute, python::for_windows] {
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

fn check(folder: &Path) -> Result<(), String> {
    packages::provide("lintian", &["lintian"], "`dist --check`")?;
    run(Command::new("sha256sum")
        .args(["--quiet", "--check", "SHA256SUMS"])
        .current_dir(folder))?;
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
            Some("linuxcnc-trueaxis") => linuxcnc::package_corrects(package)?,
            _ => {}
        }
    }
    for system in TestedSystem::ALL {
        // It cannot be linked here.
        if matches!(system, TestedSystem::Mac) {
            continue;
        }
        // As it is called once it is installed.
        let installed = fresh(system.target())?.join(system.program());
        files::copy(&program(folder, system.target()), &installed)?;
        systems::check(system, &installed)?;
    }
    for wheel in files::list(folder, "whl")? {
        match wheel.to_string_lossy().ends_with("win_amd64.whl") {
            true => eprintln!(
                "{NOT_RUN}{}: there is no Python for Windows here",
                wheel.display()
            ),
            false => python::alone(&wheel, &EXAMPLE)?,
        }
    }
    web::check(&page(folder))
}

/// The command for a target, in the folder of the release.
fn program(folder: &Path, target: &str) -> PathBuf {
    let ending = if target.contains("windows") {
        ".exe"
    } else {
        ""
    };
    folder.join(format!("trueaxis-{VERSION}-{target}{ending}"))
}

fn page(folder: &Path) -> PathBuf {
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
        .env("TRUEAXIS_BUILD", systems::build_name("dist")?))?;
    Ok(target(STATIC).join("dist/trueaxis"))
}

/// A package of the files below `staged`.
fn package(
    staged: &Path,
    name: &str,
    architecture: &str,
    control: &str,
    folder: &Path,
) -> Result<PathBuf, String> {
    let documents = files::folder(staged.join("usr/share/doc").join(name))?;
    let mit = files::read_text(&root().join("LICENSE-MIT"))?;
    let mit: String = mit
        .lines()
        .map(|line| format!(" {}\n", if line.is_empty() { "." } else { line }))
        .collect();
    let copyright = format!(
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\n\
         Files: *\nCopyright: The trueaxis contributors\nLicense: Expat or Apache-2.0\n\n\
         License: Expat\n{mit}\n\
         License: Apache-2.0\n On Debian systems the text is in /usr/share/common-licenses/Apache-2.0.\n"
    );
    files::write(&documents.join("copyright"), copyright)?;
    let date = output(
        Command::new("git")
            .args(["log", "-1", "--format=%aD"])
            .current_dir(root()),
    )?;
    let changes = documents.join("changelog");
    files::write(
        &changes,
        format!(
            "{name} ({VERSION}) unstable; urgency=medium\n\n  * CHANGELOG.md of the source.\n\n -- {MAINTAINER}  {date}"
        ),
    )?;
    run(Command::new("gzip").args(["-9", "-n", "-f"]).arg(&changes))?;
    let about = files::folder(staged.join("DEBIAN"))?;
    let fields = format!(
        "Package: {name}\nVersion: {VERSION}\nArchitecture: {architecture}\nPriority: optional\n\
         Maintainer: {MAINTAINER}\nHomepage: https://github.com/trueaxis/trueaxis\n{control}"
    );
    files::write(&about.join("control"), fields)?;
    let package = folder.join(format!("{name}_{VERSION}_{architecture}.deb"));
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

/// Manual pages and completions, which are the same for every processor.
struct Documents {
    folder: PathBuf,
}

impl Documents {
    fn of(program: &Path) -> Result<Self, String> {
        let folder = fresh("documents")?;
        let pages = files::folder(folder.join("share/man/man1"))?;
        run(Command::new(program).arg("man").arg(&pages))?;
        run(Command::new("gzip")
            .args(["-9", "-n"])
            .args(files::list(&pages, "1")?))?;
        for (shell, place) in [
            ("bash", "bash-completion/completions/trueaxis"),
            ("zsh", "zsh/vendor-completions/_trueaxis"),
            ("fish", "fish/vendor_completions.d/trueaxis.fish"),
        ] {
            let file = folder.join("share").join(place);
            files::folder(file.parent().unwrap_or(&folder).to_owned())?;
            let script = output(Command::new(program).args(["completions", shell]))?;
            files::write(&file, script)?;
        }
        Ok(Self { folder })
    }
}

/// The command, its manual pages and its completions.
fn command_package(
    program: &Path,
    pages: &Documents,
    architecture: &str,
    folder: &Path,
) -> Result<PathBuf, String> {
    let staged = fresh(&format!("command-{architecture}"))?;
    let programs = files::folder(staged.join("usr/bin"))?;
    files::copy(program, &programs.join("trueaxis"))?;
    run(Command::new("cp")
        .arg("-r")
        .arg(pages.folder.join("share"))
        .arg(staged.join("usr")))?;
    // It runs on any Linux because it needs no library.
    let overrides = files::folder(staged.join("usr/share/lintian/overrides"))?;
    files::write(
        &overrides.join("trueaxis"),
        "trueaxis: statically-linked-binary [usr/bin/trueaxis]\n",
    )?;
    let examples = files::folder(staged.join("usr/share/doc/trueaxis"))?;
    run(Command::new("cp")
        .arg("-r")
        .arg(root().join("examples"))
        .arg(&examples))?;
    let control = "Section: science\nDescription: machine tool compensation tables from measurements\n \
         From probings and runs of instruments to error parameters, from these to the\n \
         fewest tables that correct them, and onto the control.\n";
    package(&staged, "trueaxis", architecture, control, folder)
}

/// The C library.
fn library_package(folder: &Path) -> Result<PathBuf, String> {
    let staged = fresh("library")?;
    let prefix = files::folder(staged.join("usr"))?;
    capi::install(&["--prefix", &prefix.to_string_lossy()])?;
    let shared = prefix.join("lib").join(format!("libtrueaxis.so.{VERSION}"));
    run(Command::new("strip").arg("--strip-unneeded").arg(&shared))?;
    run(Command::new("chmod").arg("644").arg(&shared))?;
    let about = files::folder(staged.join("DEBIAN"))?;
    files::write(&about.join("shlibs"), "libtrueaxis 0 libtrueaxis-dev\n")?;
    files::write(&about.join("triggers"), "activate-noawait ldconfig\n")?;
    let control = "Section: libdevel\nDepends: libc6\nDescription: machine tool compensation at servo rate, C library\n \
         Static and shared library, header and pkg-config file.\n";
    package(&staged, "libtrueaxis-dev", "amd64", control, folder)
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
