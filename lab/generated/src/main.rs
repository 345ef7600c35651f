//! Proves that what `trueaxis generate` writes gives the bits of the general evaluation, compiled with rustc, gcc and
//! clang, in servos, and on a Cortex-M4F.

mod bare_metal;
mod project;
mod wrong_builds;

use programs::process::{output, root, run, target};
use programs::{Failure, files, packages, trueaxis};
use project::GeneratedProgram;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// Examples: name, machine, errors, options of `compile`.
const EXAMPLES: &str = "\
huron13         | huron-k2x8/machine                 | huron-k2x8/errors-13         |
huron13_length  | huron-k2x8/machine-tool-length     | huron-k2x8/errors-13         |
huron13_weights | huron-k2x8/machine                 | huron-k2x8/errors-13         | --scheme fik --adjust EX0S,EZ0S,EXX1,EYY1,EZZ1
kolibri10       | kolibri/machine                    | kolibri/errors-10            |
hu40_13         | hu40/machine                       | hu40/errors-13               |
mill21_grid     | mill-21/machine                    | mill-21/errors-21            | --scheme grid3d
mill21          | mill-21/machine                    | mill-21/errors-21            |
five_axis_30    | five-axis-30/machine               | five-axis-30/errors-30       |
fork_head13     | fork-head/machine                  | fork-head/errors-13          |
router10        | router/machine                     | router/errors-10             |
xyzac_trt11     | linuxcnc-xyzac-trt/machine-endless | linuxcnc-xyzac-trt/errors-11 |";

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
/// One in so many inputs is also compared by `generate` itself, whose development build takes much longer for each.
const SHARE: u32 = 15;
const WARNINGS: &str = "-Wall -Wextra -Wconversion -pedantic -Werror";

fn main() -> ExitCode {
    programs::main(|words| {
        let count = match words {
            [] => 10_000_000,
            ["bare-metal"] => return Ok(bare_metal::check()?),
            [count] => count
                .parse()
                .map_err(|_| Failure::arguments(format!("`{count}` is not a number of inputs")))?,
            _ => {
                return Err(Failure::arguments(
                    "generated takes one number: how many inputs; or bare-metal",
                ));
            }
        };
        Ok(check(count)?)
    })
}

/// Builds and compares: a number of inputs of each compensation, and the examples on a Cortex-M4F.
///
/// # Errors
/// What does not compile, warns or differs.
fn check(count: u32) -> Result<(), String> {
    packages::provide("gcc", &["gcc", "libc6-dev"], "comparing generated C")?;
    packages::provide("clang", &["clang"], "comparing generated C")?;
    let trueaxis = trueaxis::build()?;
    let folder = files::folder(target("generated"))?;
    files::folder(folder.join("src"))?;
    let mut programs = Vec::new();
    let mut objects = Vec::new();
    for (name, blob) in blobs(&trueaxis, &folder)? {
        let [rust, c] = generated(&trueaxis, &folder, &name, &blob, count / SHARE)?;
        objects.extend(compiled(&folder, &name, &c)?);
        programs.push(GeneratedProgram::new(&name, &files::read_text(&rust)?));
    }
    wrong_builds::are_refused(&folder)?;
    wrong_builds::are_noticed(&folder)?;
    bare_metal::check()?;
    project::write(&folder, &programs, &objects)?;
    run(Command::new("cargo")
        .current_dir(&folder)
        .args(["run", "-q", "--release", "--", &count.to_string()])
        .envs(CAPACITIES)
        .env("CARGO_TARGET_DIR", folder.join("build")))
}

/// Compiles the examples and copies the committed blobs; returns them with their names.
fn blobs(trueaxis: &Path, folder: &Path) -> Result<Vec<(String, PathBuf)>, String> {
    let mut all = Vec::new();
    for line in EXAMPLES.lines() {
        let mut cells = line.split('|').map(str::trim);
        let [name, machine, errors, options] = [(); 4].map(|()| cells.next().unwrap_or_default());
        let blob = folder.join(name).with_extension("trax");
        let sources = [machine, errors].map(|path| format!("examples/{path}.toml"));
        trueaxis::compile(trueaxis, &sources, options, &blob)?;
        all.push((name.to_owned(), blob));
    }
    for golden in GOLDEN {
        let name = golden.replace('-', "_");
        let blob = folder.join(&name).with_extension("trax");
        files::copy(&lab_capi::blob(golden), &blob)?;
        all.push((name, blob));
    }
    Ok(all)
}

/// Generates Rust and C, with their servos.
fn generated(
    trueaxis: &Path,
    folder: &Path,
    name: &str,
    blob: &Path,
    compared: u32,
) -> Result<[PathBuf; 2], String> {
    let rust = folder.join("src").join(name).with_extension("rs");
    let c = folder.join(name).with_extension("c");
    for code in [&rust, &c] {
        let mut generate = Command::new(trueaxis);
        generate.arg("generate").arg(blob).arg("--servo");
        generate.args(["--compared", &compared.max(1).to_string()]);
        generate.arg("-o").arg(code);
        print!("{}", output(&mut generate)?);
    }
    Ok([rust, c])
}

/// Compiles generated C with all compilers, under a name for each; returns the objects.
fn compiled(folder: &Path, name: &str, c: &Path) -> Result<Vec<PathBuf>, String> {
    let code = files::read_text(c)?;
    let shape = shape(&code)?;
    let mut objects = Vec::new();
    for (compiler, options, kind) in COMPILERS {
        let object = folder.join(format!("{name}_{kind}.o"));
        let renamed = [
            (shape, ""),
            ("generated", "_generated"),
            ("check", "_check"),
        ];
        let mut compile = Command::new(compiler);
        compile
            .args(options.split_whitespace())
            .args(WARNINGS.split_whitespace())
            .arg(format!("-I{}", root().join("firmware/capi").display()))
            .args(renamed.map(|(from, to)| format!("-Dtrueaxis_evaluate_{from}={name}_{kind}{to}")))
            .args(CAPACITIES.map(|(name, value)| format!("-D{name}={value}")))
            .args(["-c", "-o"])
            .args([&object, c]);
        output(&mut compile)?;
        objects.push(object);
    }
    Ok(objects)
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
