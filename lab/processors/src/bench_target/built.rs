//! The counting programs and their blobs, built.

use lab_processors::cross::Cross;
use lab_processors::elf::ElfProgram;
use programs::process::{root, run, target};
use programs::{files, trueaxis};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Scheme with five weights that can be set.
const WEIGHTS: &str = "fik --adjust EX0S,EZ0S,EXX1,EYY1,EZZ1";
const HURON: [&str; 2] = ["huron-k2x8", "errors-13"];
/// Machine and errors in `examples`, scheme, policy, and the name of the blob.
const COMPILED: [([&str; 2], &str, &str, &str); 5] = [
    (HURON, "exact", "orientation", "huron13"),
    (HURON, "exact", "direction", "huron13-direction"),
    (HURON, "fik", "orientation", "huron13-fik"),
    (HURON, WEIGHTS, "orientation", "huron13-fik-5"),
    (
        ["kolibri", "errors-10"],
        "exact",
        "direction",
        "kolibri10-direction",
    ),
];
/// Blobs whose generated code is counted as well.
const GENERATED: [&str; 4] = [
    "huron13",
    "huron13-direction",
    "kolibri10-direction",
    "document40",
];

/// Builds blobs and programs; returns the folder of the programs.
///
/// # Errors
/// If something does not build.
pub fn programs(cross: &Cross) -> Result<PathBuf, String> {
    let folder = files::folder(target("bench-blobs"))?;
    blobs(&folder)?;
    let build = |profile| {
        let words = format!("build -q --profile {profile} -p trueaxis-bench-target");
        let (mut command, programs) = cross.cargo("stm32f405", &words);
        run(command.env("TRUEAXIS_BENCH_BLOBS", &folder)).map(|()| programs)
    };
    build("fast")?;
    build("release")
}

fn blobs(folder: &Path) -> Result<(), String> {
    let trueaxis = trueaxis::build()?;
    for ([machine, errors], scheme, policy, blob) in COMPILED {
        let sources = ["machine", errors].map(|name| format!("examples/{machine}/{name}.toml"));
        let options = format!("--scheme {scheme} --policy {policy}");
        let blob = folder.join(blob).with_extension("trax");
        trueaxis::compile(&trueaxis, &sources, &options, &blob)?;
    }
    run(trueaxis::example("bench-blobs")
        .current_dir(root())
        .arg(folder))?;
    for name in GENERATED {
        let [blob, code] = ["trax", "rs"].map(|kind| folder.join(name).with_extension(kind));
        let mut generate = Command::new(&trueaxis);
        run(generate.arg("generate").arg(blob).arg("-o").arg(code))?;
    }
    Ok(())
}

/// Flash size of the firmware for the STM32F405, bytes.
///
/// # Errors
/// If it does not build.
pub fn image(cross: &Cross) -> Result<u32, String> {
    let folder = cross.build("stm32f405", "build -q --release")?;
    Ok(ElfProgram::read(&folder.join("release/stm32f405"))?.flash())
}
