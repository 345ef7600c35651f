//! Compilers for controllers.
//!
//! The default one with `rustup target add` if that works. Otherwise that of the distribution, which comes with the
//! source of its library, so the library is built as well (`-Zbuild-std`, an unstable option, hence `RUSTC_BOOTSTRAP`).

use programs::packages::install;
use programs::process::{has, output, root, run, target, works};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Cortex-M4F and Cortex-M7.
pub const CORTEX_M: &str = "thumbv7em-none-eabihf";
/// Location of Debian's compiler, independent of the path.
const RUSTC: &str = "/usr/bin/rustc";
const CARGO: &str = "/usr/bin/cargo";
const SOURCE: &str = "/usr/lib/rustlib/src/rust/library/core/src/lib.rs";
/// The `rust-version` of the workspace.
const MINOR: u32 = 89;

/// A compiler for a target.
pub struct Cross {
    /// Rust's name of the target.
    pub target: &'static str,
    /// That of the distribution, with the library built from source.
    pub from_source: bool,
    /// Version, e.g. `1.95.0`.
    pub version: String,
}

impl Cross {
    /// Finds a compiler, or installs missing components.
    ///
    /// # Errors
    /// If something could not be installed.
    pub fn provide(target: &'static str) -> Result<Self, String> {
        if !has_library(target) {
            eprintln!("the target {target} is not installed: trying rustup");
            works(Command::new("rustup").args(["target", "add", target]));
        }
        if has_library(target) {
            let version = version("rustc").ok_or("rustc does not say its version")?;
            return Ok(Self {
                target,
                from_source: false,
                version,
            });
        }
        if !has_source() {
            install(
                &["rustc-web", "cargo-web", "rust-web-src", "lld"],
                "building for a controller (rustup has no target for it)",
            )?;
        }
        match version(RUSTC) {
            Some(version) if has_source() => Ok(Self {
                target,
                from_source: true,
                version,
            }),
            _ => Err(format!(
                "no compiler for {target}: neither did `rustup target add {target}` work, nor is \
                 there {RUSTC} 1.{MINOR} or newer with {SOURCE}"
            )),
        }
    }

    /// `cargo WORDS` in the workspace of a board, and the folder that contains a folder of programs for each profile.
    pub fn cargo(&self, board: &str, words: &str) -> (Command, PathBuf) {
        let (mut command, folder) = self.cargo_without_target(board, words);
        self.add_to(&mut command, None, &[]);
        (command, folder.join(self.target))
    }

    /// Builds with these arguments for cargo; returns the same folder.
    ///
    /// # Errors
    /// If it does not build.
    pub fn build(&self, board: &str, words: &str) -> Result<PathBuf, String> {
        let (mut build, folder) = self.cargo(board, words);
        run(&mut build).map(|()| folder)
    }

    /// This command without targets, which are [added](Self::add_to) for this compiler; the folder has one
    /// subfolder for each of them.
    pub fn cargo_without_target(&self, board: &str, words: &str) -> (Command, PathBuf) {
        // Programs with the same name, and flags that would each trigger a full rebuild.
        let processor = match board {
            "stm32h743" => "-m7",
            _ => "",
        };
        let source = if self.from_source { "-source" } else { "" };
        let folder = target(&format!("board{processor}{source}"));
        let mut command = if self.from_source {
            let mut command = Command::new(CARGO);
            command.env("RUSTC", RUSTC).env("RUSTC_BOOTSTRAP", "1");
            command
        } else {
            Command::new("cargo")
        };
        // Flags for the desktop, which would replace those for the target.
        command
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_ENCODED_RUSTFLAGS");
        command
            .current_dir(root().join("firmware/boards").join(board))
            .env("CARGO_TARGET_DIR", &folder)
            .args(words.split(' '));
        if self.from_source {
            command.arg("-Zbuild-std=core");
        }
        (command, folder)
    }

    /// Adds the target to `cargo`, with its `linker` and further compiler flags.
    pub fn add_to(&self, cargo: &mut Command, linker: Option<&str>, flags: &[String]) {
        // The default compiler has its own linker for targets without an operating system.
        let linker = linker.or(match self.target {
            _ if !self.from_source => None,
            web if web.starts_with("wasm") => Some("wasm-ld"),
            _ => Some("ld.lld"),
        });
        let mut set = |key: &str, value: &dyn std::fmt::Debug| {
            let setting = format!("target.{}.{key}={value:?}", self.target);
            cargo.args(["--config", &setting]);
        };
        // In addition to the flags of the board's own configuration.
        set("rustflags", &[short_paths(), flags.to_vec()].concat());
        if let Some(linker) = linker {
            set("linker", &linker);
        }
        cargo.args(["--target", self.target]);
    }
}

/// Flags that make panics name their file relative to this project, or to the folder of a registry: otherwise the size
/// of a program depends on the length of these paths.
fn short_paths() -> Vec<String> {
    let home = std::env::var_os("HOME").map(|home| Path::new(&home).join(".cargo"));
    let downloaded = std::env::var_os("CARGO_HOME").map(PathBuf::from).or(home);
    let sources = downloaded.map(|home| home.join("registry/src"));
    let registries = sources
        .iter()
        .filter_map(|sources| fs::read_dir(sources).ok());
    let registries = registries
        .flatten()
        .flatten()
        .map(|registry| registry.path());
    let mut folders: Vec<PathBuf> = sources.iter().cloned().chain(registries).collect();
    // The same order in every run, so that nothing is built again; the last one that matches is used.
    folders.sort();
    folders.push(root());
    let shortened = |folder: PathBuf| format!("--remap-path-prefix={}=", folder.display());
    folders.into_iter().map(shortened).collect()
}

/// Whether the default compiler has the library of a target.
pub fn has_library(target: &str) -> bool {
    library_folder(&["--target", target]).is_ok_and(|folder| folder.is_dir())
}

/// Folder of the default compiler's libraries, for this computer or a target, if known.
///
/// # Errors
/// If the compiler does not report it.
pub fn library_folder(target: &[&str]) -> Result<PathBuf, String> {
    let mut rustc = Command::new("rustc");
    let folder = output(rustc.args(["--print", "target-libdir"]).args(target))?;
    Ok(PathBuf::from(folder.trim()))
}

/// Whether the distribution's compiler is installed, new enough, and has the source of its library.
fn has_source() -> bool {
    let minor = |version: String| version.split('.').nth(1)?.parse::<u32>().ok();
    Path::new(SOURCE).is_file()
        && Path::new(CARGO).is_file()
        && has("ld.lld")
        && version(RUSTC).and_then(minor).is_some_and(|m| m >= MINOR)
}

/// The version of a compiler, e.g. `1.95.0`.
fn version(rustc: &str) -> Option<String> {
    let text = output(Command::new(rustc).arg("--version")).ok()?;
    Some(text.split_whitespace().nth(1)?.to_owned())
}
