//! Programs for a Cortex-M4F, linked.

use lab_processors::cross::library_folder;
use lab_processors::elf::ElfProgram;
use programs::process::{has, run, target};
use std::path::Path;
use std::process::Command;

/// Links a program with these functions and everything they reach.
///
/// # Errors
/// If there is no linker, or one of them is not in the library.
pub fn link<'f>(
    library: &Path,
    functions: impl IntoIterator<Item = &'f str>,
    name: &str,
) -> Result<ElfProgram, String> {
    let linked = target(name);
    let mut link = linker()?;
    // Older linkers do not search an archive for the requested symbols.
    link.args(["-m", "armelf", "--gc-sections"])
        .arg("-o")
        .arg(&linked);
    for (place, function) in functions.into_iter().enumerate() {
        if place == 0 {
            link.args(["-e", function]);
        }
        link.args(["-u", function]);
    }
    run(link.arg(library))?;
    ElfProgram::read(&linked)
}

/// The linker that comes with the compiler, or LLVM's.
///
/// # Errors
/// If there is none.
pub fn linker() -> Result<Command, String> {
    if has("ld.lld") {
        return Ok(Command::new("ld.lld"));
    }
    let linker = library_folder(&[])?.join("../bin/rust-lld");
    if !linker.is_file() {
        return Err(format!(
            "no linker: neither ld.lld nor {}",
            linker.display()
        ));
    }
    let mut command = Command::new(linker);
    command.args(["-flavor", "gnu"]);
    Ok(command)
}
