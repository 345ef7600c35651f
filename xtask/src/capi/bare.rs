//! The library for a Cortex-M4F, linked and analysed.

use super::FRAME;
use super::build::{self, BuildCapacities};
use crate::cross::{CORTEX_M, Cross, library_folder};
use crate::elf::ElfProgram;
use crate::files;
use crate::process::{has, judged, root, run, target};
use std::path::Path;
use std::process::Command;

/// Functions not intended for the servo loop: they read a whole blob, or write texts.
const NOT_IN_THE_LOOP: [&str; 6] = [
    "trueaxis_tables_load",
    "trueaxis_tables_load_generated",
    "trueaxis_tables_load_slot",
    "trueaxis_tables_load_copy",
    "trueaxis_tables_reason",
    "trueaxis_tables_machine",
];
/// Calls the generated code of a compensation, which this check does not see.
const CALLS_A_POINTER: &str = "generated_code";

/// # Errors
/// If it does not build, a function of the loop can panic or calls through a pointer, or a frame is too large.
pub fn check() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    let library = build::bare_library(&cross, "3", &BuildCapacities::USUAL)?;
    let functions = functions()?;
    let program = link(
        &library,
        functions.iter().map(String::as_str),
        "capi-bare.elf",
    )?;
    let mut wrong = Vec::new();
    for function in &functions {
        if NOT_IN_THE_LOOP.contains(&function.as_str()) {
            continue;
        }
        let reach = program.reach_from(function)?;
        let reach = reach.may_call_through_a_pointer(CALLS_A_POINTER);
        wrong.extend(reach.faults(function));
    }
    let mut frames = program.frames();
    frames.sort_unstable_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    if !frames
        .iter()
        .any(|(name, _)| name == "trueaxis_servo_update")
    {
        return Err("the sizes of the frames are not known".to_owned());
    }
    for (name, bytes) in frames.iter().filter(|(_, bytes)| *bytes > FRAME) {
        wrong.push(format!(
            "{name} takes {bytes} bytes of stack, more than {FRAME}"
        ));
    }
    println!(
        "{} functions of the C interface, {} bytes",
        functions.len(),
        program.flash()
    );
    for (name, bytes) in frames.iter().take(3) {
        println!("stack frame of {bytes:>5} bytes: {name}");
    }
    judged(&wrong)?;
    println!("nothing that a servo loop calls can reach a panic");
    Ok(())
}

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

/// Names of all functions in the header except those of simulated machines.
fn functions() -> Result<Vec<String>, String> {
    let path = root().join("firmware/capi/trueaxis.h");
    let text = files::read_text(&path)?;
    let calls = text.match_indices("trueaxis_").filter_map(|(place, _)| {
        let rest = &text[place..];
        let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))?;
        // A declaration: its line begins with the return type.
        let line = text[..place].rsplit('\n').next()?;
        let declares = rest[end..].starts_with('(') && !line.starts_with([' ', '*', '/', '#']);
        // Functions of the feature `model` are for desktops.
        let declares = declares && !rest.starts_with("trueaxis_model_");
        declares.then(|| rest[..end].to_owned())
    });
    let found: Vec<String> = calls.collect();
    if found.len() < 20 {
        return Err(format!(
            "{}: only {} functions",
            path.display(),
            found.len()
        ));
    }
    Ok(found)
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
