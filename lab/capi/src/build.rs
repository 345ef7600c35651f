//! Builds the library for this computer and for a Cortex-M4F, with its capacities.

use lab_processors::cross::Cross;
use programs::process::{cargo, root, run, target, works};
use std::path::PathBuf;
use std::process::Command;

/// Linux on 64-bit ARM, as Debian has it.
const ARM: &str = "aarch64-unknown-linux-gnu";

/// Capacities of the library, by the name of their environment variable and macro.
#[derive(Clone, Copy)]
pub struct BuildCapacities(pub [(&'static str, u32); 5]);

impl BuildCapacities {
    /// As in the committed header.
    pub const USUAL: Self = Self::of([8, 32, 96, 256, 2]);

    /// Axes, banks, tables, terms and grids.
    pub const fn of([axes, banks, tables, terms, grids]: [u32; 5]) -> Self {
        Self([
            ("TRUEAXIS_AXES", axes),
            ("TRUEAXIS_BANKS", banks),
            ("TRUEAXIS_TABLES", tables),
            ("TRUEAXIS_TERMS", terms),
            ("TRUEAXIS_GRIDS", grids),
        ])
    }

    /// Sets the number of an option: `--axes` for `TRUEAXIS_AXES`.
    ///
    /// # Errors
    /// If there is no such option, or it is not a number.
    pub fn set(&mut self, option: &str, number: &str) -> Result<(), String> {
        let known = self
            .0
            .iter_mut()
            .find(|(name, _)| self::option(name) == option);
        let (_, value) = known.ok_or_else(|| format!("there is no option `{option}`"))?;
        *value = number
            .parse()
            .map_err(|_| format!("{option} takes a number, not `{number}`"))?;
        Ok(())
    }

    /// Sets up a command to build a library with these capacities.
    pub fn build_with(&self, command: &mut Command) {
        for (name, value) in self.0 {
            command.env(name, value.to_string());
        }
    }

    /// The header with these capacities instead of the defaults.
    ///
    /// # Errors
    /// If it does not define one of them as expected.
    pub fn header(&self, committed: &str) -> Result<String, String> {
        let mut header = committed.to_owned();
        for ((name, value), (_, usual)) in self.0.into_iter().zip(Self::USUAL.0) {
            let line = format!("#define {name} {usual} ");
            if header.matches(&line).count() != 1 {
                return Err(format!("the header does not say `{line}` once"));
            }
            header = header.replace(&line, &format!("#define {name} {value} "));
        }
        Ok(header)
    }
}

/// The option that sets a capacity: `--axes` for `TRUEAXIS_AXES`.
fn option(capacity: &str) -> String {
    let name = capacity.trim_start_matches("TRUEAXIS_").to_lowercase();
    format!("--{name}")
}

/// Builds the static and the shared library for this computer; returns their folder.
///
/// # Errors
/// If they do not build.
pub fn libraries(capacities: &BuildCapacities) -> Result<PathBuf, String> {
    let folder = target("capi");
    let mut build = cargo();
    build
        .args("rustc -q --profile dist -p trueaxis-capi --lib".split(' '))
        .args(["--features", "std,model"])
        .args(["--crate-type", "staticlib,cdylib"])
        .args(["--", "-C", "link-arg=-Wl,-soname,libtrueaxis.so.0"])
        .env("CARGO_TARGET_DIR", &folder);
    capacities.build_with(&mut build);
    run(&mut build)?;
    Ok(folder.join("dist"))
}

/// Builds the static library for Linux on ARM; returns its path.
///
/// # Errors
/// If it does not build.
pub fn arm_library() -> Result<PathBuf, String> {
    works(Command::new("rustup").args(["target", "add", ARM]));
    let folder = target("capi");
    let words = "rustc -q --profile dist -p trueaxis-capi --lib --features std,model --crate-type staticlib --target";
    run(cargo()
        .args(words.split(' '))
        .arg(ARM)
        .env("CARGO_TARGET_DIR", &folder))?;
    Ok(folder.join(ARM).join("dist/libtrueaxis_capi.a"))
}

/// Builds the static library for a Cortex-M4F, optimised for size (`s`) or for speed (`3`); returns its path.
///
/// # Errors
/// If it does not build.
pub fn bare_library(
    cross: &Cross,
    optimised: &str,
    capacities: &BuildCapacities,
) -> Result<PathBuf, String> {
    let words = "rustc -q --profile dist --lib --features halt";
    let (mut build, folder) = cross.cargo("stm32f405", words);
    build
        .args(["--crate-type", "staticlib", "--manifest-path"])
        .arg(root().join("firmware/capi/Cargo.toml"))
        .env("CARGO_PROFILE_DIST_OPT_LEVEL", optimised)
        // Stack sizes of functions are only written by an unstable option.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("RUSTFLAGS", "-Zemit-stack-sizes");
    capacities.build_with(&mut build);
    run(&mut build)?;
    Ok(folder.join("dist/libtrueaxis_capi.a"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use programs::files;

    #[test]
    fn a_header_has_the_capacities_of_its_library() {
        let committed = files::read_text(&root().join("firmware/capi/trueaxis.h")).unwrap();
        assert_eq!(
            BuildCapacities::USUAL.header(&committed),
            Ok(committed.clone())
        );
        let mut some = BuildCapacities::USUAL;
        assert_eq!(some.set("--axes", "5"), Ok(()));
        assert_eq!(some.set("--grids", "0"), Ok(()));
        assert!(some.set("--axes", "five").is_err() && some.set("--rows", "5").is_err());
        let header = some.header(&committed).unwrap();
        assert!(header.contains("#define TRUEAXIS_AXES 5 "));
        assert!(header.contains("#define TRUEAXIS_BANKS 32 "));
        assert!(header.contains("#define TRUEAXIS_GRIDS 0 "));
        assert!(some.header("#define TRUEAXIS_AXES 8\n").is_err());
    }
}
