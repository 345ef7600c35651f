//! Costs of the library on a Cortex-M4F: flash of a program with the functions needed by a loop, memory, and
//! instructions of an update, counted in QEMU.

use super::capacities::LEAST;
use lab_capi::{BuildCapacities, bare_library, link};
use lab_processors::cross::{CORTEX_M, Cross};
use lab_processors::figures::Figures;
use lab_processors::qemu;
use programs::process::{judged, run};

/// Functions linked by a program that loads tables and corrects, besides the update.
const LINKED: [&str; 5] = [
    "trueaxis_tables_new",
    "trueaxis_tables_load",
    "trueaxis_servo_new",
    "trueaxis_servo_enable",
    "trueaxis_servo_status",
];
/// Maximum size of its constants, bytes: they contain no image of an object.
const CONSTANTS: u32 = 4096;
/// Maximum instructions of an update in floats, in per cent of those of the Rust servo.
const SINGLE: u64 = 125;
/// Optimisation levels of the programs, and the corresponding profile in the board's workspace.
const OPTIMISED: [(&str, &str); 2] = [("s", "release"), ("3", "fast")];

/// Prints flash, instructions and memory.
///
/// # Errors
/// If something does not build or run, or constants or instructions exceed their limit.
pub fn print() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    let mut wrong = flash(&cross)?;
    wrong.extend(instructions(&cross)?);
    memory(&cross)?;
    judged(&wrong)
}

/// Prints the flash of programs; returns those with too many constants.
fn flash(cross: &Cross) -> Result<Vec<String>, String> {
    println!(
        "\non a Cortex-M4F (rustc {}), tables of huron-13\n\nbytes of flash {:>16} {:>9}",
        cross.version, "code", "constants"
    );
    let mut wrong = Vec::new();
    for (optimised, _) in OPTIMISED {
        let library = bare_library(cross, optimised, &BuildCapacities::USUAL)?;
        for (update, what) in [
            ("trueaxis_servo_update_f32", "floats"),
            ("trueaxis_servo_update", "doubles"),
        ] {
            let functions = LINKED.into_iter().chain([update]);
            let program = link(&library, functions, "capi-linked.elf")?;
            let code = program.code_size();
            let constants = program.flash() - code;
            println!("opt-level {optimised}, {what:<14} {code:>6} {constants:>9}");
            if constants > CONSTANTS {
                wrong.push(format!(
                    "{constants} bytes of constants, more than {CONSTANTS}"
                ));
            }
        }
    }
    Ok(wrong)
}

/// Prints the instructions of an update; returns the levels at which the interface costs too much.
fn instructions(cross: &Cross) -> Result<Vec<String>, String> {
    println!("\ninstructions of an update  typical    most");
    let mut wrong = Vec::new();
    for (optimised, profile) in OPTIMISED {
        let figures = measure(cross, profile, &BuildCapacities::USUAL)?;
        let get = |key: &str| figures.get(key).unwrap_or(0);
        for (key, what) in [
            ("rust", "Rust"),
            ("f32", "floats"),
            ("generated", "generated"),
            ("f64", "doubles"),
        ] {
            let most = get(&format!("{key}_max"));
            println!(
                "opt-level {optimised}, {what:<14} {:>6} {most:>7}",
                get(key)
            );
        }
        let (floats, rust) = (get("f32"), get("rust"));
        if floats * 100 > rust * SINGLE {
            wrong.push(format!(
                "opt-level {optimised}: an update in floats takes {floats} instructions, more than {SINGLE} % of {rust}"
            ));
        }
    }
    Ok(wrong)
}

/// Prints the memory of tables and servo.
fn memory(cross: &Cross) -> Result<(), String> {
    println!("\nbytes of memory             tables   servo  (of them used)");
    for capacities in [BuildCapacities::USUAL, LEAST] {
        let figures = measure(cross, "release", &capacities)?;
        let get = |key: &str| figures.get(key).unwrap_or(0);
        println!(
            "{:<26} {:>7} {:>7}  ({}, {})",
            capacities.0.map(|(_, number)| number.to_string()).join(" "),
            get("tables_memory"),
            get("servo_memory"),
            get("tables_size"),
            get("servo_size"),
        );
    }
    println!("(axes, banks, tables, terms, grids: the usual ones, and what these tables need)\n");
    Ok(())
}

/// Builds and runs the counting program.
fn measure(cross: &Cross, profile: &str, capacities: &BuildCapacities) -> Result<Figures, String> {
    let words = format!("build -q --profile {profile} -p trueaxis-bench-target --bin capi");
    let (mut build, folder) = cross.cargo("stm32f405", &words);
    capacities.build_with(&mut build);
    run(&mut build)?;
    Figures::counted(&folder.join(profile).join("capi"))
}
