//! The program that compares generated code with the general evaluation, as a project of cargo.

use crate::COMPILERS;
use programs::files;
use programs::process::root;
use std::fs;
use std::path::{Path, PathBuf};

/// What the comparing program has to know of one generated file.
pub struct GeneratedProgram {
    name: String,
    is_directional: bool,
    has_weights: bool,
}

impl GeneratedProgram {
    pub fn new(name: &str, rust: &str) -> Self {
        let has = |argument: &str| {
            rust.lines()
                .any(|line| line.starts_with("pub fn evaluate(") && line.contains(argument))
        };
        Self {
            name: name.to_owned(),
            is_directional: has("travel:"),
            has_weights: has("weights:"),
        }
    }

    /// The part of the comparing program that is about this file.
    fn lines(&self) -> String {
        let Self {
            name,
            is_directional,
            has_weights,
        } = self;
        let (mut c_types, mut arguments) = (String::new(), String::new());
        if *is_directional {
            c_types += ", _: *const i8";
            arguments += ", given.travel.as_ptr()";
        }
        if *has_weights {
            c_types += ", _: *const f32";
            arguments += ", given.weights.as_ptr()";
        }
        let each = |text: &dyn Fn(&str) -> String| -> String {
            COMPILERS.iter().map(|(.., kind)| text(kind)).collect()
        };
        let externs =
            each(&|kind| format!("    fn {name}_{kind}(_: *const f32{c_types}, _: *mut f32);\n"));
        let check_externs = each(&|kind| format!("    fn {name}_{kind}_check() -> i32;\n"));
        let checks = each(&|kind| format!("{name}_{kind}_check(), "));
        let calls = each(&|kind| {
            format!(
                "        (\"{kind}\", &|given, to| unsafe {{ \
                 {name}_{kind}(given.inputs.as_ptr(){arguments}, to.as_mut_ptr()) }}),\n"
            )
        });
        format!(
            "#[rustfmt::skip]\nmod {name};\nunsafe extern \"C\" {{\n{externs}{check_externs}    \
             static {name}_gcc_o2_generated: trueaxis_capi::Generated;\n}}\n\
             fn compare_{name}(count: u32) -> bool {{\n    \
             let behind = unsafe {{ &{name}_gcc_o2_generated }};\n    \
             let checks = unsafe {{ [{checks}] }};\n    \
             compare(\"{name}\", include_bytes!(\"../{name}.trax\"), &{name}::FACTS.0, \
             ({name}::corrections::<16>, {name}::check), &checks, &[\n{calls}    ], behind, count)\n}}\n"
        )
    }
}

/// Writes the project of the comparing program, linked with these objects.
pub fn write(
    folder: &Path,
    programs: &[GeneratedProgram],
    objects: &[PathBuf],
) -> Result<(), String> {
    let [shared, capi] = ["shared", "firmware/capi"].map(|path| root().join(path));
    let manifest = format!(
        "[package]\nname = \"generated\"\nversion = \"0.0.0\"\nedition = \"2024\"\nbuild = \"build.rs\"\n\n\
         [dependencies]\ntrueaxis = {{ path = {shared:?}, features = [\"encode\"] }}\n\
         trueaxis-capi = {{ path = {capi:?}, features = [\"std\"] }}\n\n[workspace]\n"
    );
    files::write(&folder.join("Cargo.toml"), manifest)?;
    let lock = root().join("Cargo.lock");
    fs::copy(&lock, folder.join("Cargo.lock"))
        .map_err(|error| format!("{}: {error}", lock.display()))?;
    let links: String = objects
        .iter()
        .map(|object| format!("    println!(\"cargo::rustc-link-arg={{}}\", {object:?});\n"))
        .collect();
    let build =
        format!("fn main() {{\n{links}    println!(\"cargo::rustc-link-arg=-lubsan\");\n}}\n");
    files::write(&folder.join("build.rs"), build)?;
    let parts: String = programs.iter().map(GeneratedProgram::lines).collect();
    let calls: String = programs
        .iter()
        .map(|program| format!("    all &= compare_{}(count);\n", program.name))
        .collect();
    let main = format!(
        "{COMPARE}\n{parts}\nfn main() {{\n    \
         let count = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1000);\n    \
         let mut all = true;\n{calls}    std::process::exit(if all {{ 0 }} else {{ 1 }});\n}}\n"
    );
    files::write(&folder.join("src/c_servo.rs"), C_SERVO)?;
    files::write(&folder.join("src/main.rs"), main)
}

/// The program that compares, but for its parts about each file.
const COMPARE: &str = include_str!("../compare/main.rs");
/// Part about the C interface.
const C_SERVO: &str = include_str!("../compare/c_servo.rs");
