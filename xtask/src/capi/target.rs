//! Costs of the library on a Cortex-M4F: flash of a program with the functions needed by a loop, memory, and
//! instructions of an update, counted in QEMU.

use super::bare::link;
use super::build::{self, BuildCapacities};
use super::capacities::LEAST;
use crate::cross::{CORTEX_M, Cross};
use crate::figures::Figures;
use crate::process::{judged, run};
use crate::qemu;

/// Functions linked by a program that loads tables and corrects.
const LINKED: [&str; 6] = [
    "trueaxis_tables_new",
    "trueaxis_tables_load",
    "trueaxis_servo_new",
    "trueaxis_servo_enable",
    "trueaxis_servo_update_f32",
    "trueaxis_servo_status",
];
/// Maximum size of its constants, bytes: they contain no image of an object.
const CONSTANTS: u32 = 4096;
/// Maximum instructions of an update in floats, in per cent of those of the Rust servo.
const SINGLE: u64 = 125;
/// Optimisation levels of the programs, and the corresponding profile in the board's workspace.
const OPTIMISED: [(&str, &str); 2] = [("s", "release"), ("3", "fast")];

/// # Errors
/// If something does not build or run, or constants or instructions exceed their limit.
pub fn print() -> Result<(), String> {
    let cross = Cross::provide(CORTEX_M)?;
    qemu::provide()?;
    let mut wrong = Vec::new();
    println!(
        "\non a Cortex-M4F (rustc {}), tables of huron-13\n\nbytes of flash {:>16} {:>9}",
        cross.version, "code", "constants"
    );
    for (optimised, _) in OPTIMISED {
        let library = build::bare_library(&cross, optimised, &BuildCapacities::USUAL)?;
        for (update, what) in [("_f32", "floats"), ("", "doubles")] {
            let update = format!("trueaxis_servo_update{update}");
            let functions = LINKED.map(|name| match name {
                "trueaxis_servo_update_f32" => &*update,
                name => name,
            });
            let program = link(&library, functions, "capi-linked.elf")?;
            let (all, code) = (program.flash(), program.code_size());
            println!(
                "opt-level {optimised}, {what:<14} {code:>6} {:>9}",
                all - code
            );
            if all - code > CONSTANTS {
                wrong.push(format!(
                    "{} bytes of constants, more than {CONSTANTS}",
                    all - code
                ));
            }
        }
    }
    println!("\ninstructions of an update  typical    most");
    for (optimised, profile) in OPTIMISED {
        let figures = measure(&cross, profile, &BuildCapacities::USUAL)?;
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
        if get("f32") * 100 > get("rust") * SINGLE {
            wrong.push(format!(
                "opt-level {optimised}: an update in floats takes {} instructions, more than {SINGLE} % of {}",
                get("f32"),
                get("rust")
            ));
        }
    }
    println!("\nbytes of memory             tables   servo  (of them used)");
    for capacities in [BuildCapacities::USUAL, LEAST] {
        let figures = measure(&cross, "release", &capacities)?;
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
    judged(&wrong)
}

/// Builds and runs the counting program.
fn measure(cross: &Cross, profile: &str, capacities: &BuildCapacities) -> Result<Figures, String> {
    let words = format!("build -q --profile {profile} -p trueaxis-bench-target --bin capi");
    let (mut build, folder) = cross.cargo("stm32f405", &words);
    capacities.build_with(&mut build);
    run(&mut build)?;
    Figures::counted(&folder.join(profile).join("capi"))
}
