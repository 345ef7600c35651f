//! Debian packages of the command and of the C library.

use lab_capi::{BuildCapacities, install};
use programs::process::{output, root, run, target};
use programs::{VERSION, files};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

const MAINTAINER: &str = "The trueaxis maintainers <trueaxis@users.noreply.github.com>";

/// A package of the files below `staged`.
fn package(
    staged: &Path,
    name: &str,
    architecture: &str,
    control: &str,
    folder: &Path,
) -> Result<PathBuf, String> {
    let documents = files::folder(staged.join("usr/share/doc").join(name))?;
    files::write(&documents.join("copyright"), copyright()?)?;
    changelog(name, &documents)?;
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

/// The file `copyright` as Debian has it.
fn copyright() -> Result<String, String> {
    let mit = files::read_text(&root().join("LICENSE-MIT"))?;
    let mit: String = mit
        .lines()
        .map(|line| format!(" {}\n", if line.is_empty() { "." } else { line }))
        .collect();
    Ok(format!(
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\n\
         Files: *\nCopyright: The trueaxis contributors\nLicense: Expat or Apache-2.0\n\n\
         License: Expat\n{mit}\n\
         License: Apache-2.0\n On Debian systems the text is in /usr/share/common-licenses/Apache-2.0.\n"
    ))
}

/// Writes the file `changelog`, with the date of the last commit.
fn changelog(name: &str, documents: &Path) -> Result<(), String> {
    let date = output(
        Command::new("git")
            .args(["log", "-1", "--format=%aD"])
            .current_dir(root()),
    )?;
    let changes = documents.join("changelog");
    let text = format!(
        "{name} ({VERSION}) unstable; urgency=medium\n\n  * CHANGELOG.md of the source.\n\n -- {MAINTAINER}  {date}"
    );
    files::write(&changes, text)?;
    run(Command::new("gzip").args(["-9", "-n", "-f"]).arg(&changes))
}

/// An empty folder for a part of the release.
///
/// # Errors
/// If it cannot be made.
pub fn fresh(name: &str) -> Result<PathBuf, String> {
    let folder = target("dist-parts").join(name);
    let _ = fs::remove_dir_all(&folder);
    files::folder(folder)
}

/// Manual pages and completions, which are the same for every processor.
pub struct Documents {
    folder: PathBuf,
}

impl Documents {
    /// Written by the command itself.
    ///
    /// # Errors
    /// If it fails.
    pub fn of(program: &Path) -> Result<Self, String> {
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
pub fn command(
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
pub fn library(folder: &Path) -> Result<PathBuf, String> {
    let staged = fresh("library")?;
    let prefix = files::folder(staged.join("usr"))?;
    install::below(&prefix, &BuildCapacities::USUAL)?;
    let shared = prefix.join("lib").join(format!("libtrueaxis.so.{VERSION}"));
    run(Command::new("strip").arg("--strip-unneeded").arg(&shared))?;
    run(Command::new("chmod").arg("644").arg(&shared))?;
    let about = files::folder(staged.join("DEBIAN"))?;
    files::write(&about.join("shlibs"), "libtrueaxis 0 libtrueaxis-dev\n")?;
    files::write(&about.join("triggers"), "activate-noawait ldconfig\n")?;
    let control = "Section: libdevel\nDepends: libc6\nDescription: machine tool compensation at servo rate, C \
                   library\n \
         Static and shared library, header and pkg-config file.\n";
    package(&staged, "libtrueaxis-dev", "amd64", control, folder)
}
