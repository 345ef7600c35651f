//! The command as one file for Windows, for Linux on ARM and for macOS. That for Windows runs
//! under Wine, the one for ARM in QEMU: the same commands on all examples write the same bytes as the command of this
//! computer. The one for macOS is compiled, but not linked; LinuxCNC's component for ARM is linked, but not run.

mod windows;

use lab_processors::cross;
use programs::process::{NOT_RUN, cargo, joined, judged, output, root, run, said, target, works};
use programs::{files, packages, trueaxis};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::thread;

/// A system that the command is built for.
#[derive(Clone, Copy)]
pub enum TestedSystem {
    /// Windows on x86-64.
    Windows,
    /// Linux on ARM.
    Arm,
    /// macOS on ARM.
    Mac,
}
use TestedSystem::{Arm, Mac, Windows};

impl TestedSystem {
    /// All of them.
    pub const ALL: [Self; 3] = [Windows, Arm, Mac];

    /// Name of the system in the arguments of this laboratory.
    pub fn name(self) -> &'static str {
        match self {
            Windows => "windows",
            Arm => "arm",
            Mac => "macos",
        }
    }

    /// Rust's name of the target.
    pub fn target(self) -> &'static str {
        match self {
            Windows => "x86_64-pc-windows-gnu",
            Arm => "aarch64-unknown-linux-musl",
            Mac => "aarch64-apple-darwin",
        }
    }

    /// File name of the program.
    pub fn program(self) -> &'static str {
        match self {
            Windows => "trueaxis.exe",
            Arm | Mac => "trueaxis",
        }
    }

    /// Installs Rust's library and, for Windows, the linker.
    ///
    /// # Errors
    /// If the linker cannot be installed.
    pub fn provide(self) -> Result<(), String> {
        works(Command::new("rustup").args(["target", "add", self.target()]));
        match self {
            Windows => packages::provide(
                "x86_64-w64-mingw32-gcc",
                &["gcc-mingw-w64-x86-64"],
                "what is built for Windows",
            ),
            Arm | Mac => Ok(()),
        }
    }

    /// Builds the command with a profile; `None`, with a reason printed, if this computer cannot build it.
    ///
    /// # Errors
    /// If it does not build.
    pub fn build(self, profile: &str) -> Result<Option<PathBuf>, String> {
        self.provide()?;
        let words = format!(
            "-q -p trueaxis-cli --bin trueaxis --profile {profile} --target {}",
            self.target()
        );
        let mut build = cargo();
        match self {
            Windows => {}
            // Rust's own linker and C library: nothing of the system is needed.
            Arm => {
                build.env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_MUSL_LINKER", "rust-lld");
            }
            // Linking needs Apple's frameworks.
            Mac => {
                run(build.arg("check").args(words.split(' ')))?;
                eprintln!("{NOT_RUN}the command for macOS: compiled, but not linked");
                return Ok(None);
            }
        }
        run(build
            .arg("rustc")
            .args(words.split(' '))
            // A fifth of the size on Linux; panics name their place without symbols.
            .args(["--", "-C", "strip=symbols"])
            .env("TRUEAXIS_BUILD", build_name(profile)?))?;
        let folder = match profile {
            "dev" => "debug",
            _ => profile,
        };
        let built = target(self.target()).join(folder);
        Ok(Some(built.join(self.program())))
    }

    /// Builds the command and does with it what this computer's does.
    ///
    /// # Errors
    /// If it does not build, or differs from that of this computer.
    pub fn test(self) -> Result<(), String> {
        self.provide()?;
        if !cross::has_library(self.target()) {
            let target = self.target();
            eprintln!("{NOT_RUN}the command for {target}: `rustup` has no library for it here");
            return Ok(());
        }
        // As the command of this computer, which takes the least time to build.
        if let Some(program) = self.build("dev")? {
            check(self, &program)?;
        }
        match self {
            Arm => lab_linuxcnc::for_arm(),
            Windows | Mac => Ok(()),
        }
    }

    /// The command that runs this system's programs here.
    fn runner(self) -> Result<Option<Command>, String> {
        match self {
            Windows => {
                packages::provide("wine", &["wine64", "wine"], "programs for Windows")?;
                windows::wine("wine").map(Some)
            }
            Arm => {
                packages::provide("qemu-aarch64", &["qemu-user"], "programs for ARM")?;
                Ok(Some(Command::new("qemu-aarch64")))
            }
            Mac => Ok(None),
        }
    }
}

/// What `trueaxis --version` says of a build: profile and commit.
///
/// # Errors
/// Outside of a checkout.
pub fn build_name(profile: &str) -> Result<String, String> {
    let commit = output(
        Command::new("git")
            .args(["describe", "--always", "--dirty", "--abbrev=10"])
            .current_dir(root()),
    )?;
    Ok(format!("{profile}, commit {}", commit.trim_end()))
}

/// A program for all machines: a square with rounded corners.
const SQUARE: &str =
    "G21 G90 G94 G17\nG0 X10 Y10\nG1 X30 F600\nG3 X40 Y20 I0 J10\nG1 Y40\nX10\nY10\nM2\n";

/// Checks a program for a system: it says its version, and does the jobs of this computer's.
///
/// # Errors
/// If it does not, or writes other bytes.
pub fn check(system: TestedSystem, program: &Path) -> Result<(), String> {
    if system.runner()?.is_none() {
        println!("{}: built, not run", system.target());
        return Ok(());
    }
    let here = TestPlace::fresh("here", &trueaxis::build()?, None)?;
    let there = TestPlace::fresh(system.name(), program, Some(system))?;
    let jobs = jobs(&here.folder)?;
    let done = |place: &TestPlace| jobs.iter().map(|job| place.does(job)).collect();
    let (ours, theirs): (Vec<String>, Vec<String>) = thread::scope(|scope| {
        let ours = scope.spawn(|| done(&here));
        let theirs = done(&there)?;
        joined(ours).map(|ours| (ours, theirs))
    })?;
    let name = system.name();
    let answers = jobs.iter().zip(ours.iter().zip(&theirs));
    let answers = answers.filter(|(_, (ours, theirs))| ours != theirs);
    let mut wrong: Vec<String> = answers
        .map(|(job, (ours, theirs))| {
            format!("{name}: {}: {}", job.join(" "), difference(ours, theirs))
        })
        .collect();
    let (ours, theirs) = (files_of(&here.folder)?, files_of(&there.folder)?);
    let others = ours
        .iter()
        .filter(|(file, bytes)| theirs.get(*file) != Some(bytes));
    wrong.extend(others.map(|(file, _)| format!("{name}: {file} is not the same file")));
    judged(&wrong)?;
    println!(
        "{}: {} commands and {} files, the bytes of this computer",
        system.target(),
        jobs.len(),
        ours.len()
    );
    match system {
        Windows => windows::check(&here, &there),
        Arm | Mac => Ok(()),
    }
}

/// The first line that differs.
fn difference(ours: &str, theirs: &str) -> String {
    let (mut ours, mut theirs) = (ours.lines(), theirs.lines());
    loop {
        match (ours.next(), theirs.next()) {
            (None, None) => return "the ends of the lines differ".to_owned(),
            (ours, theirs) if ours == theirs => {}
            (ours, theirs) => {
                return format!(
                    "`{}` in place of `{}`",
                    theirs.unwrap_or("nothing"),
                    ours.unwrap_or("nothing")
                );
            }
        }
    }
}

/// A program and the folder that it works in, whose name is not plain.
struct TestPlace {
    folder: PathBuf,
    program: PathBuf,
    /// For a program of another system.
    system: Option<TestedSystem>,
}

impl TestPlace {
    fn fresh(name: &str, program: &Path, system: Option<TestedSystem>) -> Result<Self, String> {
        let folder = target("systems").join(name).join("Fräse 5 Achsen");
        let _ = fs::remove_dir_all(&folder);
        let folder = files::folder(folder)?;
        run(Command::new("cp")
            .arg("-r")
            .arg(root().join("examples"))
            .arg(&folder))?;
        files::write(&folder.join("square.ngc"), SQUARE)?;
        if matches!(system, Some(Windows)) {
            windows::provide_random_numbers(program)?;
            windows::start()?;
        }
        Ok(Self {
            folder,
            program: program.to_owned(),
            system,
        })
    }

    fn command(&self) -> Result<Command, String> {
        let runner = self.system.map_or(Ok(None), TestedSystem::runner)?;
        let mut command = match runner {
            None => Command::new(&self.program),
            Some(mut runner) => {
                runner.arg(&self.program);
                runner
            }
        };
        command
            .current_dir(&self.folder)
            .env("NO_COLOR", "1")
            // Pages have the date of the build otherwise, and midnight would lie between two of them.
            .env("SOURCE_DATE_EPOCH", "0");
        Ok(command)
    }

    /// Exit code, output and messages of a job.
    fn does(&self, job: &[String]) -> Result<String, String> {
        let said = said(self.command()?.args(job))?;
        let code = said.status.code().unwrap_or(-1);
        let errors = match self.system {
            Some(Windows) => windows::without_own_lines(&said.errors),
            _ => said.errors,
        };
        let text = format!("exit code {code}\n{}{errors}", said.output);
        // What Windows and its programs are called, and what they call a file that is not there.
        Ok(text
            .replace("trueaxis.exe", "trueaxis")
            .replace("File not found.", "No such file or directory"))
    }
}

/// The files below a folder, with their contents.
fn files_of(folder: &Path) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let list = output(
        Command::new("find")
            .args([".", "-type", "f"])
            .current_dir(folder),
    )?;
    list.lines()
        .map(|name| Ok((name.to_owned(), files::read(&folder.join(name))?)))
        .collect()
}

/// What is done with every example.
const JOBS: [&str; 8] = [
    "compile MACHINE ERRORS -o BLOB",
    "verify MACHINE ERRORS BLOB --random 2000",
    "inspect BLOB",
    "report MACHINE ERRORS BLOB -o STEM.html",
    "export cec BLOB -o STEM.cec",
    "export isg MACHINE ERRORS -o STEM.csv",
    "import isg STEM.csv --machine MACHINE -o STEM-isg.toml",
    "gcode square.ngc -o STEM.ngc --compensation BLOB --units mm",
];
/// With those of fewer than thirty parameters: minutes for the largest, and nothing that the others do not show.
const SMALL: [&str; 2] = [
    "generate BLOB -o STEM.rs --compared 10000",
    "generate BLOB -o STEM.c --compared 10000",
];
/// With a machine that is measured by balls.
const MEASURED: [&str; 2] = [
    "simulate probings FOLDER/machine.toml FOLDER/ERRORS --artefact FOLDER/artefact.toml --plan FOLDER/plan.csv \
     --noise 1 -o FOLDER/probings.csv",
    "identify FOLDER/machine.toml FOLDER/probings.csv --artefact FOLDER/artefact.toml -o FOLDER/found.toml",
];

/// What is done with the examples, and a mistake.
fn jobs(folder: &Path) -> Result<Vec<Vec<String>>, String> {
    let list = output(
        Command::new("find")
            .args(["examples", "-name", "errors*.toml"])
            .current_dir(folder),
    )?;
    let mut names: Vec<&str> = list.lines().collect();
    // Of every example the file with the fewest parameters: others take longer, and show nothing that these do not.
    names.sort_unstable_by_key(|name| (folder_of(name), name.len(), *name));
    names.dedup_by_key(|name| folder_of(name));
    let mut jobs = vec![words("compile missing.toml errors.toml -o missing.trax")];
    for errors in names {
        let machine = format!("{}/machine.toml", folder_of(errors));
        let blob = errors.replace(".toml", ".trax");
        let named = |word: &str| match word {
            "MACHINE" => machine.clone(),
            "ERRORS" => errors.to_owned(),
            "BLOB" => blob.clone(),
            _ => word.replace("STEM", errors.trim_end_matches(".toml")),
        };
        let small = SMALL.iter().filter(|_| !errors.contains("-30"));
        let lines = JOBS.iter().chain(small);
        jobs.extend(lines.map(|line| line.split(' ').map(named).collect()));
    }
    for (example, errors) in [("hu40", "errors-13.toml"), ("kolibri", "errors-12.toml")] {
        let folder = format!("examples/{example}");
        let named = |line: &str| line.replace("FOLDER", &folder).replace("ERRORS", errors);
        jobs.extend(MEASURED.map(|line| words(&named(line))));
    }
    Ok(jobs)
}

fn folder_of(name: &str) -> &str {
    name.rsplit_once('/').map_or(".", |(folder, _)| folder)
}

fn words(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}
