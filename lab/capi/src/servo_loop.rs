//! The library for a Cortex-M4F, linked: what a servo loop calls can reach no panic, and takes little stack.

use lab_capi::{BuildCapacities, FRAME, bare_library, link};
use lab_processors::cross::{CORTEX_M, Cross};
use lab_processors::elf::ElfProgram;
use programs::files;
use programs::process::{judged, root};

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
    let library = bare_library(&cross, "3", &BuildCapacities::USUAL)?;
    let functions = functions()?;
    let program = link(
        &library,
        functions.iter().map(String::as_str),
        "capi-bare.elf",
    )?;
    let mut frames = program.frames();
    frames.sort_unstable_by_key(|(_, bytes)| std::cmp::Reverse(*bytes));
    if !frames
        .iter()
        .any(|(name, _)| name == "trueaxis_servo_update")
    {
        return Err("the sizes of the frames are not known".to_owned());
    }
    let mut wrong = faults(&program, &functions)?;
    let large = frames.iter().filter(|(_, bytes)| *bytes > FRAME);
    wrong
        .extend(large.map(|(name, bytes)| {
            format!("{name} takes {bytes} bytes of stack, more than {FRAME}")
        }));
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

/// What functions of the loop can reach and must not.
fn faults(program: &ElfProgram, functions: &[String]) -> Result<Vec<String>, String> {
    let mut wrong = Vec::new();
    for function in functions {
        if !NOT_IN_THE_LOOP.contains(&function.as_str()) {
            let reach = program.reach_from(function)?;
            let reach = reach.may_call_through_a_pointer(CALLS_A_POINTER);
            wrong.extend(reach.faults(function));
        }
    }
    Ok(wrong)
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
