//! What `cargo publish` would send of every crate, and the command installed from it: with no
//! file of this workspace and with cargo's own profile, as whoever runs `cargo install trueaxis-cli` gets it.

use programs::process::{cargo, output, root, run, target};
use programs::{VERSION, files, trueaxis};
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// How much slower the installed command may be than the shipped one, which is optimised across crates.
const SLOWER: f64 = 1.3;
/// Shortest of this many runs.
const RUNS: usize = 5;

/// # Errors
/// If a crate would not be accepted, or the command does not install, or is slow.
pub fn check() -> Result<(), String> {
    run(cargo().args(["publish", "--workspace", "--dry-run", "--allow-dirty"]))?;
    let folder = target("published");
    let _ = std::fs::remove_dir_all(&folder);
    let folder = files::folder(folder)?;
    let start = Instant::now();
    run(install(&folder)?
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .current_dir(&folder))?;
    let built = start.elapsed();
    let installed = folder.join("bin/trueaxis");
    println!("{}", output(Command::new(&installed).arg("--version"))?);
    let [own, shipped] = fastest([&installed, &trueaxis::shipped()?])?;
    let ratio = own.as_secs_f64() / shipped.as_secs_f64();
    println!(
        "installed in {} s; `compile` of the Huron takes {:.3} s, {ratio:.2} times the shipped command's",
        built.as_secs(),
        own.as_secs_f64()
    );
    if ratio > SLOWER {
        return Err(format!("more than {SLOWER} times"));
    }
    Ok(())
}

/// The command that installs what `cargo publish` has built and unpacked.
fn install(folder: &Path) -> Result<Command, String> {
    let mut install = Command::new("cargo");
    install.args(["install", "--quiet", "--root"]).arg(folder);
    let packages = std::fs::read_dir(target("package")).map_err(|e| e.to_string())?;
    for package in packages {
        let source = package.map_err(|e| e.to_string())?.path();
        let name = source.file_name().unwrap_or_default().to_string_lossy();
        let Some(name) = name.strip_suffix(&format!("-{VERSION}")) else {
            continue;
        };
        if name == "trueaxis-cli" {
            install.arg("--path").arg(&source);
        } else {
            // The registry that does not have it yet.
            let patch = format!("patch.crates-io.{name}.path={:?}", source.to_string_lossy());
            install.args(["--config", &patch]);
        }
    }
    Ok(install)
}

/// Shortest time that each command takes to compile the Huron, in turns: other work slows both alike.
fn fastest(programs: [&Path; 2]) -> Result<[Duration; 2], String> {
    let folder = files::folder(target("published").join("work"))?;
    let example = root().join("examples/huron-k2x8");
    let mut fastest = [Duration::MAX; 2];
    for _ in 0..RUNS {
        for (program, fastest) in programs.iter().zip(&mut fastest) {
            let mut compile = Command::new(program);
            compile
                .arg("compile")
                .args(["machine.toml", "errors-13.toml"].map(|name| example.join(name)))
                .args(["-o", "huron.trax"])
                .current_dir(&folder);
            let start = Instant::now();
            output(&mut compile)?;
            *fastest = (*fastest).min(start.elapsed());
        }
    }
    Ok(fastest)
}
