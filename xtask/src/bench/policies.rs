//! Cost of the policy `direction` compared with `orientation`: tables, terms, bytes, and the instructions of `compile`,
//! on every example with ten to thirteen errors.

use crate::callgrind;
use crate::process::{root, shipped_trueaxis, target};
use std::path::Path;
use std::process::Command;

/// Machine and errors in `examples`.
const EXAMPLES: [[&str; 2]; 8] = [
    ["huron-k2x8/machine", "huron-k2x8/errors-13"],
    ["huron-k2x8/machine-tool-length", "huron-k2x8/errors-13"],
    ["kolibri/machine", "kolibri/errors-10"],
    ["kolibri/machine", "kolibri/errors-12"],
    ["hu40/machine", "hu40/errors-13"],
    ["fork-head/machine", "fork-head/errors-13"],
    ["table-head/machine", "table-head/errors-13"],
    ["router/machine", "router/errors-10"],
];

/// Costs of one compilation.
struct CompilationCosts {
    tables: u64,
    terms: u64,
    bytes: u64,
    instructions: u64,
}

/// Prints them side by side.
///
/// # Errors
/// If a build or a compilation fails, or valgrind does not count.
pub fn run() -> Result<(), String> {
    let program = shipped_trueaxis()?;
    println!(
        "`direction` / `orientation` (compile in millions of instructions, callgrind, one thread):"
    );
    println!("  {:<33} tables   terms    bytes           compile", "");
    for [machine, errors] in EXAMPLES {
        let costs = |policy| of(&program, machine, errors, policy);
        let (direction, orientation) = (costs("direction")?, costs("orientation")?);
        let (machine, errors) = (name(machine), name(errors));
        println!(
            "  {:<33} {:>2} / {:<2}  {:>2} / {:<2}  {:>5} / {:<5}  {:>5} / {:<5} = {:.2}",
            format!("{machine}, {errors}"),
            direction.tables,
            orientation.tables,
            direction.terms,
            orientation.terms,
            direction.bytes,
            orientation.bytes,
            direction.instructions / 1_000_000,
            orientation.instructions / 1_000_000,
            direction.instructions as f64 / orientation.instructions as f64,
        );
    }
    Ok(())
}

/// Name of the folder, or more if the file requires it.
fn name(path: &str) -> String {
    match path.split_once('/') {
        Some((folder, "machine")) => folder.to_owned(),
        Some((_, file)) if file.starts_with("errors") => file.to_owned(),
        _ => path.replace("/machine", ""),
    }
}

fn of(
    program: &Path,
    machine: &str,
    errors: &str,
    policy: &str,
) -> Result<CompilationCosts, String> {
    let blob = target("policies.trax");
    let mut compile = Command::new(program);
    compile
        .current_dir(root().join("examples"))
        .env("RAYON_NUM_THREADS", "1")
        .args(["compile", "--json", "--allow-large", "--policy", policy])
        .args([format!("{machine}.toml"), format!("{errors}.toml")])
        .arg("-o")
        .arg(&blob);
    let (instructions, json) = callgrind::count(&compile, None)?;
    let number = |key: &str| {
        let rest = json.split(&format!("\n  \"{key}\": ")).nth(1)?;
        rest.split([',', '\n']).next()?.trim().parse().ok()
    };
    let missing = |key| format!("compile --json gives no `{key}`");
    let costs = CompilationCosts {
        tables: number("tables").ok_or_else(|| missing("tables"))?,
        terms: number("terms").ok_or_else(|| missing("terms"))?,
        bytes: number("bytes").ok_or_else(|| missing("bytes"))?,
        instructions,
    };
    let _ = std::fs::remove_file(blob);
    Ok(costs)
}
