//! `cargo xtask fuzz`: every fuzz target, started from real blobs.

use crate::process::{self, provide, root, target, works};
use std::fs;
use std::path::Path;
use std::process::Command;

const TARGETS: [&str; 5] = ["decode", "evaluate", "slots", "link", "gcode"];
/// Longest input, bytes: short ones are many times faster and reach every branch.
const MAX_LEN: u64 = 2048;

/// How long to run each target.
enum Length {
    Seconds(u64),
    Runs(u64),
}

/// # Errors
/// A missing tool, or a finding.
pub fn run(options: &[&str]) -> Result<(), String> {
    let length = read(options)?;
    provide("cargo-fuzz")?;
    if !works(Command::new("c++").arg("--version")) {
        return Err(
            "libFuzzer is built with a C++ compiler; install one, e.g. `apt install g++`"
                .to_owned(),
        );
    }
    let nightly = works(Command::new("cargo").args(["+nightly", "--version"]));
    if !nightly {
        println!("no nightly toolchain: using the unstable flags of the stable one");
    }
    let limit = match length {
        Length::Seconds(s) => format!("-max_total_time={s}"),
        Length::Runs(n) => format!("-runs={n}"),
    };
    for name in TARGETS {
        let corpus = root().join("fuzz/corpus").join(name);
        if name == "gcode" {
            seed_gcode(&corpus)?;
        } else {
            seed(name, &corpus)?;
        }
        if name == "link" {
            seed_link(&corpus)?;
        }
        let mut command = Command::new("cargo");
        command
            .current_dir(root().join("fuzz"))
            .env("CARGO_TARGET_DIR", target("fuzz"));
        // The variable CARGO would keep a proxy from choosing the toolchain.
        command.env_remove("CARGO").env_remove("RUSTUP_TOOLCHAIN");
        if nightly {
            command.arg("+nightly");
        } else {
            command.env("RUSTC_BOOTSTRAP", "1");
        }
        command.args([
            "fuzz",
            "run",
            name,
            "--",
            &limit,
            "-timeout=20",
            "-print_final_stats=1",
        ]);
        command.arg(format!("-max_len={MAX_LEN}"));
        process::run(&mut command)?;
    }
    println!("{} fuzz targets without a finding", TARGETS.len());
    Ok(())
}

fn read(options: &[&str]) -> Result<Length, String> {
    let number = |text: &str| text.parse().map_err(|_| format!("`{text}` is no number"));
    match options {
        [] => Ok(Length::Seconds(60)),
        ["--seconds", n] => Ok(Length::Seconds(number(n)?)),
        ["--runs", n] => Ok(Length::Runs(number(n)?)),
        other => Err(format!(
            "fuzz takes --seconds N or --runs N, not `{}`",
            other.join(" ")
        )),
    }
}

/// Puts a conversation into the corpus that reaches a change of compensation: see the target.
fn seed_link(corpus: &Path) -> Result<(), String> {
    // Three flags for the blob, the slot and force, and the request.
    let step = |request: u8| [1, 1, 1, request];
    for mode in [2, 3] {
        let mut bytes = vec![mode];
        bytes.extend(step(0));
        bytes.extend(step(4));
        bytes.push(40);
        for request in [0, 1, 2, 3, 5, 6, 7] {
            bytes.extend(step(request));
        }
        bytes.extend(0..40);
        let name = format!("change-{mode}");
        fs::write(corpus.join(name), bytes).map_err(|e| format!("seeds of link: {e}"))?;
    }
    Ok(())
}

/// Puts programs with words of every kind into the corpus, behind the byte that chooses the dialect.
fn seed_gcode(corpus: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("seeds of gcode: {error}");
    fs::create_dir_all(corpus).map_err(failed)?;
    let programs = [
        "G21 G90 G17\nG0 X10. Y-20. Z30. A5. C10.\nG1 X20. F600.\nA10. C-20.\nG93 G1 X15. C5. F10.\nG94 F100.\nM30\n",
        "G20 G91 G18\nG55 G1 X.5 Z.25 F10.\nG2 X.2 Z.2 I.1 K.1\nG3 X.1 R.5 Y.1\nG90 G17 G2 I1.\nG92 X0. Y0.\nX.1\nG92.1\nM2\n",
        "%\nG21 G90 G98 F200.\nG43 H1\nG81 X10. Y10. Z1. R5.\nX20.\nG83 X30. Z0. R4. Q1.\nG99 G82 X5. Z2. R3. P.1\nG80\nG10 L2 P1 X5.\nG53 G0 Z10.\nG28\n/M8\nM30\n%\n",
    ];
    for (number, program) in programs.iter().enumerate() {
        for mode in 0..3_u8 {
            let mut bytes = vec![mode];
            bytes.extend(program.as_bytes());
            fs::write(corpus.join(format!("program-{number}-{mode}")), bytes).map_err(failed)?;
        }
    }
    Ok(())
}

/// Puts the golden blobs into the corpus, behind the byte that chooses the mode.
fn seed(name: &str, corpus: &Path) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("seeds of {name}: {error}");
    fs::create_dir_all(corpus).map_err(failed)?;
    let golden = root().join("tests/golden/v1");
    for entry in fs::read_dir(&golden).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.extension().is_none_or(|e| e != "trax") {
            continue;
        }
        let blob = fs::read(&path).map_err(failed)?;
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        for mode in 0..=1_u8 {
            let mut bytes = vec![mode];
            bytes.extend(&blob);
            fs::write(corpus.join(format!("golden-{stem}-{mode}")), bytes).map_err(failed)?;
        }
    }
    Ok(())
}
