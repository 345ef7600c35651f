//! One program links for every kind of processor, and computes the desktop's bits wherever it can run.

mod results;
mod targets;

use lab_processors::cross::Cross;
use lab_processors::figures::Figures;
use programs::files;
use programs::process::{NOT_RUN, cargo, joined, judged, root, run, target};
use results::TargetOutput;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use targets::{BuildTarget, TARGETS, folder};

const BUILD: &str = "build -q --release --locked";
/// Maximum run time, many times the actual one.
const LONGEST: Duration = Duration::from_secs(120);

/// Path of the program for each target.
type Programs = Vec<(&'static BuildTarget, PathBuf)>;

/// Links, runs and compares.
///
/// # Errors
/// If something does not link, or computes other bits than the desktop.
pub fn check() -> Result<(), String> {
    let mut not_run = Vec::new();
    let mut compilers = Vec::new();
    for target in &TARGETS {
        match target.provide() {
            Ok(compiler) => compilers.push((target, compiler)),
            Err(why) => not_run.push(format!("{}: {why}", target.name)),
        }
    }
    let folder = files::folder(target("portable"))?;
    // Two compilers, each with its own folder.
    let (desktop, usual, source) = thread::scope(|scope| {
        let source = scope.spawn(|| build(&compilers, true));
        let desktop = desktop(&folder.join("desktop"));
        let usual = build(&compilers, false);
        (desktop, usual, joined(source))
    });
    let desktop = desktop?;
    let mut runs = Vec::new();
    for (target, program) in [usual?, source?].concat() {
        for &(processor, emulator) in target.processors {
            match ProcessorRun::new(target, processor, emulator, &program) {
                Ok(run) => runs.push(run),
                Err(why) => not_run.push(format!("{} on {processor}: {why}", target.name)),
            }
        }
    }
    let (figures, wrong) = compared(runs, &desktop, &folder)?;
    files::write(&target("portable.json"), figures.to_json())?;
    for what in &not_run {
        eprintln!("{NOT_RUN}{what}");
    }
    judged(&wrong)
}

/// A run of the program on a processor.
struct ProcessorRun {
    target: &'static BuildTarget,
    processor: &'static str,
    program: PathBuf,
    command: Command,
}

impl ProcessorRun {
    fn new(
        target: &'static BuildTarget,
        processor: &'static str,
        emulator: &str,
        program: &Path,
    ) -> Result<Self, String> {
        Ok(Self {
            target,
            processor,
            program: program.to_owned(),
            command: target.command(emulator, program)?,
        })
    }
}

/// Runs all beside each other; prints a line for each, and returns the instructions and what is wrong.
fn compared(
    mut runs: Vec<ProcessorRun>,
    desktop: &TargetOutput,
    folder: &Path,
) -> Result<(Figures, Vec<String>), String> {
    let mut wrong = Vec::new();
    let mut figures = Figures::default();
    let blobs = bytes_of_blobs()?;
    println!(
        "{:44}{:>8}{:>12}{:>11}{:>14}",
        "", "bytes", "evaluation", "generated", "servo update"
    );
    thread::scope(|scope| {
        let started: Vec<_> = runs
            .iter_mut()
            .map(|run| {
                let file = folder.join(run.processor);
                let command = &mut run.command;
                let output = scope.spawn(move || finish(command, &file));
                (run.target, run.processor, &run.program, output)
            })
            .collect();
        for (target, processor, program, output) in started {
            let found = joined(output).and_then(|found| match found.difference(desktop) {
                None => Ok(found.instructions),
                Some(difference) => Err(difference),
            });
            let shown = match found {
                Ok(instructions) => {
                    set(&mut figures, processor, instructions);
                    shown(target.bytes(program, blobs), instructions)
                }
                Err(why) => {
                    wrong.push(format!("{} on {processor}: {why}", target.name));
                    "  FAILED".to_owned()
                }
            };
            println!("{:31}{processor:13}{shown}", target.name);
        }
    });
    println!(
        "bytes: code and constants without the tables; then instructions of one call, all built for size"
    );
    Ok((figures, wrong))
}

/// Takes the instructions of each call, if they were counted.
fn set(figures: &mut Figures, processor: &str, instructions: Option<[u64; 3]>) {
    let calls = ["evaluate", "generated", "servo"];
    for (call, count) in calls.iter().zip(instructions.into_iter().flatten()) {
        figures.set(&format!("{processor}_{call}"), count);
    }
}

/// The columns of a processor that computes the right bits.
fn shown(bytes: Option<u32>, instructions: Option<[u64; 3]>) -> String {
    let bytes = bytes.map_or_else(String::new, |bytes| bytes.to_string());
    let [evaluation, generated, update] =
        instructions.map_or_else(Default::default, |counts| counts.map(|n| n.to_string()));
    format!("{bytes:>8}{evaluation:>12}{generated:>11}{update:>14}  the desktop's bits")
}

/// Links the program for the targets whose compilers are `from_source` or not; returns the path for each.
fn build(
    compilers: &[(&'static BuildTarget, Cross)],
    from_source: bool,
) -> Result<Programs, String> {
    let chosen = |pair: &&(_, Cross)| pair.1.from_source == from_source;
    let Some((_, first)) = compilers.iter().find(chosen) else {
        return Ok(Vec::new());
    };
    // All together, so that cargo builds in parallel, and host programs only once.
    let (mut build, folder) = first.cargo_without_target("portable", BUILD);
    let mut programs = Vec::new();
    for (target, compiler) in compilers.iter().filter(chosen) {
        compiler.add_to(&mut build, target.linker().as_deref(), &target.flags());
        programs.push((*target, target.program(&folder)));
    }
    run(&mut build)?;
    Ok(programs)
}

/// Results of the program on this computer.
fn desktop(file: &Path) -> Result<TargetOutput, String> {
    let target = target("board");
    let mut build = cargo();
    build.current_dir(folder()).env("CARGO_TARGET_DIR", &target);
    run(build.args(BUILD.split(' ')))?;
    finish(&mut Command::new(target.join("release/portable")), file)
}

/// Runs a program to completion; returns its output, which is also stored in `file`.
fn finish(command: &mut Command, file: &Path) -> Result<TargetOutput, String> {
    let failed = |error: std::io::Error| format!("{}: {error}", file.display());
    let errors = file.with_extension("err");
    let mut child = command
        .stdin(Stdio::null())
        .stdout(File::create(file).map_err(failed)?)
        .stderr(File::create(&errors).map_err(failed)?)
        .spawn()
        .map_err(failed)?;
    let end = Instant::now() + LONGEST;
    let status = loop {
        match child.try_wait().map_err(failed)? {
            Some(status) => break status.to_string(),
            None if Instant::now() > end => {
                child.kill().map_err(failed)?;
                child.wait().map_err(failed)?;
                break format!("no end after {} s", LONGEST.as_secs());
            }
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    if status != "exit status: 0" {
        let said = fs::read_to_string(&errors).unwrap_or_default();
        return Err(format!("{status}\n{}", said.trim_end())
            .trim_end()
            .to_owned());
    }
    TargetOutput::split(fs::read(file).map_err(failed)?).ok_or_else(|| "too few results".to_owned())
}

/// Total size of the blobs in the program, bytes.
fn bytes_of_blobs() -> Result<u32, String> {
    let folder = root().join("tests/golden/v1");
    let mut bytes = 0;
    for blob in files::list(&folder, "trax")? {
        bytes += files::read(&blob)?.len() as u32;
    }
    Ok(bytes)
}
