//! Builds that would give other bits: generated C refuses them, when it is compiled or by its check.

use crate::CAPACITIES;
use programs::files;
use programs::process::{output, root};
use std::fs;
use std::path::Path;
use std::process::Command;

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
pub fn are_noticed(folder: &Path) -> Result<(), String> {
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
pub fn are_refused(folder: &Path) -> Result<(), String> {
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
