//! `cargo xtask generated`: what `trueaxis generate` writes, compiled and compared with the general evaluation.

mod bare_metal;

use crate::process::{output, root, run, target, trueaxis};
use crate::{blob, files, packages};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Examples: the machine, its errors, options of `compile`.
const EXAMPLES: [(&str, &str, &str, &str); 11] = [
    ("huron13", "huron-k2x8/machine", "huron-k2x8/errors-13", ""),
    (
        "huron13_length",
        "huron-k2x8/machine-tool-length",
        "huron-k2x8/errors-13",
        "",
    ),
    (
        "huron13_weights",
        "huron-k2x8/machine",
        "huron-k2x8/errors-13",
        "--scheme fik --adjust EX0S,EZ0S,EXX1,EYY1,EZZ1",
    ),
    ("kolibri10", "kolibri/machine", "kolibri/errors-10", ""),
    ("hu40_13", "hu40/machine", "hu40/errors-13", ""),
    (
        "mill21_grid",
        "mill-21/machine",
        "mill-21/errors-21",
        "--scheme grid3d",
    ),
    ("mill21", "mill-21/machine", "mill-21/errors-21", ""),
    (
        "five_axis_30",
        "five-axis-30/machine",
        "five-axis-30/errors-30",
        "",
    ),
    (
        "fork_head13",
        "fork-head/machine",
        "fork-head/errors-13",
        "",
    ),
    ("router10", "router/machine", "router/errors-10", ""),
    (
        "xyzac_trt11",
        "linuxcnc-xyzac-trt/machine-endless",
        "linuxcnc-xyzac-trt/errors-11",
        "",
    ),
];
/// Committed blobs; the first has one of everything that the format has.
const GOLDEN: [&str; 2] = ["everything", "table-head-13"];

/// Compilers of C: their names, options, and what each is called here.
const COMPILERS: [(&str, &str, &str); 9] = [
    ("gcc", "-std=c99 -O1", "gcc_o1"),
    ("gcc", "-std=c99 -O2", "gcc_o2"),
    ("gcc", "-std=gnu11 -O3 -march=native", "gcc_o3_native"),
    (
        "gcc",
        "-std=gnu11 -O3 -march=native -ffp-contract=fast",
        "gcc_contraction",
    ),
    ("clang", "-std=c99 -O0", "clang_o0"),
    ("clang", "-std=c99 -O2", "clang_o2"),
    ("clang", "-std=gnu11 -O3 -march=native", "clang_o3_native"),
    // Clang does not report that it may reorder operations.
    (
        "clang",
        "-std=gnu11 -O3 -march=native -fassociative-math -fno-signed-zeros -fno-trapping-math",
        "clang_reordering",
    ),
    (
        "gcc",
        "-std=c99 -O0 -fsanitize=undefined -fno-sanitize-recover",
        "gcc_ubsan",
    ),
];
/// Capacities of the C interface, for all of these.
const CAPACITIES: [(&str, &str); 5] = [
    ("TRUEAXIS_AXES", "16"),
    ("TRUEAXIS_BANKS", "255"),
    ("TRUEAXIS_TABLES", "255"),
    ("TRUEAXIS_TERMS", "4096"),
    ("TRUEAXIS_GRIDS", "8"),
];
const WARNINGS: &str = "-Wall -Wextra -Wconversion -pedantic -Werror";

/// Builds and compares: a number of inputs of each compensation, and the examples on a Cortex-M4F; `bare-metal`: only
/// these.
///
/// # Errors
/// What does not compile, warns or differs.
pub fn execute(options: &[&str]) -> Result<(), String> {
    let count: u32 = match options {
        [] => 10_000_000,
        ["bare-metal"] => return bare_metal::check(),
        [count] => count
            .parse()
            .map_err(|_| format!("`{count}` is not a number of inputs"))?,
        _ => return Err("generated takes one number: how many inputs; or bare-metal".to_owned()),
    };
    packages::provide("gcc", &["gcc", "libc6-dev"], "comparing generated C")?;
    packages::provide("clang", &["clang"], "comparing generated C")?;
    let trueaxis = trueaxis()?;
    let folder = files::folder(target("generated"))?;
    let source = files::folder(folder.join("src"))?;
    let mut names = Vec::new();
    for (name, machine, errors, options) in EXAMPLES {
        let blob = folder.join(name).with_extension("trax");
        let sources = [machine, errors].map(|path| format!("examples/{path}.toml"));
        blob::compile(&trueaxis, &sources, options, &blob)?;
        names.push((name.to_owned(), blob));
    }
    for golden in GOLDEN {
        let committed = root()
            .join("tests/golden/v1")
            .join(golden)
            .with_extension("trax");
        let name = golden.replace('-', "_");
        let blob = folder.join(&name).with_extension("trax");
        fs::copy(&committed, &blob).map_err(|error| format!("{}: {error}", committed.display()))?;
        names.push((name, blob));
    }
    let mut programs = Vec::new();
    let mut objects = Vec::new();
    for (name, blob) in &names {
        let rust = source.join(name).with_extension("rs");
        let c = folder.join(name).with_extension("c");
        for code in [&rust, &c] {
            let mut generate = Command::new(&trueaxis);
            generate.arg("generate").arg(blob).arg("--servo");
            generate.arg("-o").arg(code);
            print!("{}", output(&mut generate)?);
        }
        let code = fs::read_to_string(&c).map_err(|e| e.to_string())?;
        let shape = shape(&code)?;
        for (compiler, options, kind) in COMPILERS {
            let object = folder.join(format!("{name}_{kind}.o"));
            let mut compile = Command::new(compiler);
            compile
                .args(options.split_whitespace())
                .args(WARNINGS.split_whitespace())
                .arg(format!("-I{}", root().join("firmware/capi").display()))
                .arg(format!("-Dtrueaxis_evaluate_{shape}={name}_{kind}"))
                .arg(format!(
                    "-Dtrueaxis_evaluate_generated={name}_{kind}_generated"
                ))
                .arg(format!("-Dtrueaxis_evaluate_check={name}_{kind}_check"))
                .args(CAPACITIES.map(|(name, value)| format!("-D{name}={value}")))
                .args(["-c", "-o"])
                .args([&object, &c]);
            output(&mut compile)?;
            objects.push(object);
        }
        programs.push(GeneratedProgram::new(
            name,
            &fs::read_to_string(&rust).map_err(|e| e.to_string())?,
        ));
    }
    refused_with_fast_math(&folder)?;
    wrong_builds_are_noticed(&folder)?;
    bare_metal::check()?;
    write_project(&folder, &programs, &objects)?;
    run(Command::new("cargo")
        .current_dir(&folder)
        .args(["run", "-q", "--release", "--", &count.to_string()])
        .envs(CAPACITIES)
        .env("CARGO_TARGET_DIR", folder.join("build")))
}

/// What the name of the linked function says about its arguments: `i5_t0_w0_c5`.
fn shape(code: &str) -> Result<&str, String> {
    let (_, rest) = code
        .split_once("void trueaxis_evaluate_")
        .ok_or("no function in the generated code")?;
    let (shape, _) = rest
        .split_once('(')
        .ok_or("no arguments in the generated code")?;
    Ok(shape)
}

/// Builds with fused or reordered operations: the compiler, its options, and what is taken out of the code so that it
/// does this. Those for the processor itself fuse only if it can.
const WRONG: [(&str, &str, &str); 4] = [
    ("clang", "-O2 -march=native -ffp-contract=fast", ""),
    ("clang", "-O3 -march=native -ffp-contract=fast", ""),
    (
        "gcc",
        "-O2 -march=native -ffp-contract=fast",
        "#pragma GCC optimize (\"fp-contract=off\")",
    ),
    (
        "clang",
        "-O2 -fassociative-math -fno-signed-zeros -fno-trapping-math",
        "#pragma clang fp reassociate(off)",
    ),
];

/// Whether this processor has fused operations.
fn fuses() -> bool {
    #[cfg(target_arch = "x86_64")]
    let fuses = std::arch::is_x86_feature_detected!("fma");
    #[cfg(not(target_arch = "x86_64"))]
    let fuses = true;
    fuses
}

/// The check in the code must refuse builds that give other bits, and only those.
fn wrong_builds_are_noticed(folder: &Path) -> Result<(), String> {
    let code = fs::read_to_string(folder.join("huron13.c")).map_err(|e| e.to_string())?;
    let caller = folder.join("wrong_main.c");
    let main =
        "#include \"huron13.h\"\nint main(void)\n{\n    return trueaxis_evaluate_check();\n}\n";
    files::write(&caller, main)?;
    for (compiler, options, without) in WRONG {
        let c = folder.join("wrong.c");
        files::write(&c, code.replace(without, ""))?;
        let program = folder.join("wrong");
        let mut compile = Command::new(compiler);
        compile
            .arg("-std=gnu11")
            .args(options.split_whitespace())
            .args(CAPACITIES.map(|(name, value)| format!("-D{name}={value}")))
            .arg(format!("-I{}", root().join("firmware/capi").display()))
            .arg("-o")
            .args([&program, &c, &caller]);
        output(&mut compile)?;
        let found = Command::new(&program).status();
        let found = found.map_err(|error| format!("{}: {error}", program.display()))?;
        let is_wrong = fuses() || !options.contains("-march=native");
        if found.code() != Some(i32::from(!is_wrong)) {
            let bits = if is_wrong { "other" } else { "the same" };
            return Err(format!(
                "{compiler} {options} gives {bits} bits, and the check ends with {found}"
            ));
        }
    }
    Ok(())
}

/// The C must not compile where the compiler may change the order of operations, at any level of optimization.
fn refused_with_fast_math(folder: &Path) -> Result<(), String> {
    let c = folder.join("huron13.c");
    let reordering = "-fassociative-math -fno-signed-zeros -fno-trapping-math";
    for (compiler, all) in [
        (
            "gcc",
            &[
                "-ffast-math",
                "-ffinite-math-only",
                "-freciprocal-math",
                reordering,
            ][..],
        ),
        ("clang", &["-ffast-math", "-ffinite-math-only"]),
    ] {
        for level in ["-O0", "-O1", "-O2", "-O3"] {
            for option in all {
                let mut compile = Command::new(compiler);
                compile.args(["-std=c99", level, "-fsyntax-only"]);
                compile.args(option.split(' '));
                compile
                    .arg(format!("-I{}", root().join("firmware/capi").display()))
                    .arg(&c);
                let refused = output(&mut compile).err().unwrap_or_default();
                if !refused.contains("compile without -ffast-math") {
                    let c = c.display();
                    return Err(format!(
                        "{compiler} {level} {option} compiles {c}: {refused}"
                    ));
                }
            }
        }
    }
    Ok(())
}

/// What the comparing program has to know of one generated file.
struct GeneratedProgram {
    name: String,
    is_directional: bool,
    has_weights: bool,
}

impl GeneratedProgram {
    fn new(name: &str, rust: &str) -> Self {
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
        let kinds = COMPILERS.map(|(.., kind)| kind);
        let externs: String = kinds
            .iter()
            .map(|kind| format!("    fn {name}_{kind}(_: *const f32{c_types}, _: *mut f32);\n"))
            .collect();
        let calls: String = kinds
            .iter()
            .map(|kind| {
                format!("        (\"{kind}\", &|given, to| unsafe {{ {name}_{kind}(given.inputs.as_ptr(){arguments}, to.as_mut_ptr()) }}),\n")
            })
            .collect();
        let check_externs: String = kinds
            .iter()
            .map(|kind| format!("    fn {name}_{kind}_check() -> i32;\n"))
            .collect();
        let checks = kinds
            .map(|kind| format!("{name}_{kind}_check()"))
            .join(", ");
        format!(
            "#[rustfmt::skip]\nmod {name};\nunsafe extern \"C\" {{\n{externs}{check_externs}    static {name}_gcc_o2_generated: trueaxis_capi::Generated;\n}}\n\
             fn compare_{name}(count: u32) -> bool {{\n    \
             let behind = unsafe {{ &{name}_gcc_o2_generated }};\n    \
             let checks = unsafe {{ [{checks}] }};\n    \
             compare(\"{name}\", include_bytes!(\"../{name}.trax\"), &{name}::FACTS.0, ({name}::corrections::<16>, {name}::check), &checks, &[\n{calls}    ], behind, count)\n}}\n"
        )
    }
}

fn write_project(
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
        "{COMPARE}\n{parts}\nfn main() {{\n    let count = std::env::args().nth(1).and_then(|n| n.parse().ok()).unwrap_or(1000);\n    let mut all = true;\n{calls}    std::process::exit(if all {{ 0 }} else {{ 1 }});\n}}\n"
    );
    files::write(&folder.join("src/c_servo.rs"), C_SERVO)?;
    files::write(&folder.join("src/main.rs"), main)
}

/// The program that compares, but for its parts about each file.
const COMPARE: &str = include_str!("generated/compare.rs");
/// Part about the C interface.
const C_SERVO: &str = include_str!("generated/c_servo.rs");
