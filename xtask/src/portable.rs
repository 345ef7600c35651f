//! `cargo xtask portable`: one program links for every kind of processor, and computes the desktop's bits wherever it
//! can run.

use crate::cross::Cross;
use crate::elf::ElfProgram;
use crate::figures::Figures;
use crate::process::{NOT_RUN, cargo, has, joined, judged, root, run, target};
use crate::{files, packages};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// A build target, and where it runs.
struct BuildTarget {
    name: &'static str,
    platform: Platform,
    /// Processors, and their emulators.
    processors: &'static [(&'static str, &'static str)],
}

/// Platform of a program.
enum Platform {
    /// Custom start-up code: the addresses of code and variables, and of the end of the stack.
    Bare([u32; 3]),
    /// A C library, with the names of its compiler and library in Debian.
    Linux(&'static str, &'static str),
    /// An engine for WebAssembly.
    Web,
}
use Platform::{Bare, Linux, Web};

const TARGETS: [BuildTarget; 9] = [
    of(
        "thumbv6m-none-eabi",
        Bare([0, 0x2000_0000, 0x2000_4000]),
        &[("Cortex-M0", "qemu-system-arm -machine microbit")],
    ),
    of(
        "thumbv7em-none-eabihf",
        Bare([0, 0x2000_0000, 0x2000_8000]),
        &[
            ("Cortex-M4", "qemu-system-arm -machine mps2-an386"),
            ("Cortex-M7", "qemu-system-arm -machine mps2-an500"),
        ],
    ),
    of(
        "thumbv8m.main-none-eabihf",
        Bare([0x1000_0000, 0x3000_0000, 0x3000_8000]),
        &[("Cortex-M33", "qemu-system-arm -machine mps2-an505")],
    ),
    // A board with memory at 0 that takes any processor.
    of(
        "armv7r-none-eabihf",
        Bare([0, 0x10_0000, 0x20_0000]),
        &[(
            "Cortex-R5F",
            "qemu-system-arm -machine integratorcp -cpu cortex-r5f",
        )],
    ),
    of(
        "riscv32imafc-unknown-none-elf",
        Bare([0x8000_0000, 0x8010_0000, 0x8020_0000]),
        &[("RV32IMAFC", "qemu-system-riscv32 -machine virt -bios none")],
    ),
    of(
        "riscv32imac-unknown-none-elf",
        Bare([0x8000_0000, 0x8010_0000, 0x8020_0000]),
        &[(
            "RV32IMAC",
            "qemu-system-riscv32 -machine virt -bios none -cpu rv32,f=off,d=off",
        )],
    ),
    of(
        "aarch64-unknown-linux-gnu",
        Linux("aarch64-linux-gnu", "arm64"),
        &[("AArch64", "qemu-aarch64")],
    ),
    of(
        "armv7-unknown-linux-gnueabihf",
        Linux("arm-linux-gnueabihf", "armhf"),
        &[("ARMv7-A", "qemu-arm")],
    ),
    of("wasm32-unknown-unknown", Web, &[("WebAssembly", "node")]),
];

const fn of(
    name: &'static str,
    platform: Platform,
    processors: &'static [(&'static str, &'static str)],
) -> BuildTarget {
    BuildTarget {
        name,
        platform,
        processors,
    }
}

/// Makes SysTick count instructions.
const BOARD: &str = "-nographic -monitor none -serial none -semihosting-config enable=on,target=native -icount shift=10";
const BUILD: &str = "build -q --release --locked";
/// Maximum run time, many times the actual one.
const LONGEST: Duration = Duration::from_secs(120);
/// Number of calls counted by the program.
const CALLS: u64 = 100;

/// Path of the program for each target.
type Programs = Vec<(&'static BuildTarget, PathBuf)>;

impl BuildTarget {
    fn linker(&self) -> Option<String> {
        match self.platform {
            Linux(gnu, _) => Some(format!("{gnu}-gcc")),
            Bare(_) | Web => None,
        }
    }

    /// Compiler flags.
    fn flags(&self) -> Vec<String> {
        let Bare([code, data, stack]) = self.platform else {
            return Vec::new();
        };
        let script = folder().join("bare.x");
        vec![
            format!("-Clink-arg=-T{}", script.display()),
            format!("-Clink-arg=--defsym=CODE={code}"),
            format!("-Clink-arg=--defsym=DATA={data}"),
            format!("-Clink-arg=--defsym=STACK={stack}"),
        ]
    }

    /// A compiler and its libraries, installed if they are missing.
    fn provide(&self) -> Result<Cross, String> {
        if let (Linux(gnu, debian), Some(linker)) = (&self.platform, self.linker()) {
            let library = Path::new("/usr").join(gnu).join("lib/libc.so");
            if !(has(&linker) && library.exists()) {
                let packages = [format!("gcc-{gnu}"), format!("libc6-dev-{debian}-cross")];
                packages::install(
                    &packages.each_ref().map(String::as_str),
                    "linking for Linux",
                )?;
            }
        }
        Cross::provide(self.name)
    }

    /// The command that runs the program.
    fn command(&self, emulator: &str, program: &Path) -> Result<Command, String> {
        let mut words = emulator.split(' ');
        let name = words.next().unwrap_or_default();
        let package = match name {
            "qemu-system-riscv32" => "qemu-system-misc",
            "qemu-system-arm" => name,
            "node" => "nodejs",
            _ => "qemu-user",
        };
        packages::provide(name, &[package], "running on other processors")?;
        let mut command = Command::new(name);
        command.args(words);
        match self.platform {
            Bare(_) => command.args(BOARD.split(' ')).arg("-kernel"),
            Linux(gnu, _) => command.args(["-L", &format!("/usr/{gnu}")]),
            Web => command.arg(folder().join("run.mjs")),
        };
        command.arg(program);
        Ok(command)
    }

    fn program(&self, folder: &Path) -> PathBuf {
        let name = match self.platform {
            Web => "portable.wasm",
            Bare(_) | Linux(..) => "portable",
        };
        folder.join(self.name).join("release").join(name)
    }
}

/// Output of the program: the bits of corrections, and the cost of calls.
struct TargetOutput {
    bits: Vec<u8>,
    /// Instructions of an evaluation, of one by generated code and of a servo update, if counted.
    instructions: Option<[u64; 3]>,
}

impl TargetOutput {
    fn split(mut bytes: Vec<u8>) -> Option<Self> {
        let figures = bytes.split_off(bytes.len().checked_sub(16)?);
        let mut figures = figures.chunks(4).map(|bytes| {
            let number = bytes.try_into().map(u32::from_le_bytes);
            number.map_or(0, u64::from)
        });
        let thousand = figures.next()?;
        let calls = [figures.next()?, figures.next()?, figures.next()?];
        let counted = |ticks| (ticks * 1000 + thousand * CALLS / 2) / (thousand * CALLS);
        Some(Self {
            bits: bytes,
            instructions: (thousand > 0).then(|| calls.map(counted)),
        })
    }

    /// Describes the first difference from the bits of `desktop`.
    fn difference(&self, desktop: &Self) -> Option<String> {
        if self.bits.len() != desktop.bits.len() {
            let [ours, theirs] = [self, desktop].map(|results| results.bits.len());
            return Some(format!("{ours} bytes instead of {theirs}"));
        }
        let mut numbers = self.bits.chunks(4).zip(desktop.bits.chunks(4));
        let place = numbers.position(|(ours, theirs)| ours != theirs)?;
        let [ours, theirs] = [self, desktop].map(|r| r.bits.chunks(4).nth(place));
        Some(format!(
            "number {place} has the bytes {ours:02X?} instead of {theirs:02X?}"
        ))
    }
}

/// # Errors
/// If something does not link, or computes other bits than the desktop.
pub fn execute() -> Result<(), String> {
    let mut not_run = Vec::new();
    let mut compilers = Vec::new();
    for target in &TARGETS {
        match target.provide() {
            Ok(compiler) => compilers.push((target, compiler)),
            Err(why) => not_run.push(format!("{}: {why}", target.name)),
        }
    }
    let results = files::folder(target("portable"))?;
    // Two compilers, each with its own folder.
    let (desktop, usual, source) = thread::scope(|scope| {
        let source = scope.spawn(|| build(&compilers, true));
        let desktop = desktop(&results.join("desktop"));
        let usual = build(&compilers, false);
        (desktop, usual, joined(source))
    });
    let desktop = desktop?;
    let mut runs = Vec::new();
    for (target, program) in [usual?, source?].concat() {
        for &(processor, emulator) in target.processors {
            match target.command(emulator, &program) {
                Ok(command) => runs.push((target, program.clone(), processor, command)),
                Err(why) => not_run.push(format!("{} on {processor}: {why}", target.name)),
            }
        }
    }

    let mut wrong = Vec::new();
    let mut figures = Figures::default();
    let blobs = bytes_of_blobs()?;
    println!(
        "{:44}{:>8}{:>12}{:>11}{:>14}",
        "", "bytes", "evaluation", "generated", "servo update"
    );
    thread::scope(|scope| {
        let started = runs
            .into_iter()
            .map(|(target, program, processor, command)| {
                let file = results.join(processor);
                let run = scope.spawn(move || finish(command, &file));
                (target, program, processor, run)
            });
        for (target, program, processor, run) in started.collect::<Vec<_>>() {
            let compared = joined(run).and_then(|found| match found.difference(&desktop) {
                None => Ok(found.instructions),
                Some(difference) => Err(difference),
            });
            let shown = match compared {
                Ok(instructions) => {
                    let bytes = match target.platform {
                        Bare(_) => {
                            ElfProgram::read(&program).map(|p| p.flash().saturating_sub(blobs))
                        }
                        Linux(..) | Web => Err(String::new()),
                    };
                    let bytes = bytes.map_or_else(|_| String::new(), |bytes| bytes.to_string());
                    let [evaluation, generated, update] = instructions
                        .map_or_else(Default::default, |counts| counts.map(|n| n.to_string()));
                    for (call, count) in ["evaluate", "generated", "servo"]
                        .iter()
                        .zip(instructions.into_iter().flatten())
                    {
                        figures.set(&format!("{processor}_{call}"), count);
                    }
                    format!(
                        "{bytes:>8}{evaluation:>12}{generated:>11}{update:>14}  the desktop's bits"
                    )
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
    files::write(&target("portable.json"), figures.to_json())?;
    for what in &not_run {
        eprintln!("{NOT_RUN}{what}");
    }
    judged(&wrong)
}

/// The folder of the program.
fn folder() -> PathBuf {
    root().join("firmware/boards/portable")
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
    finish(Command::new(target.join("release/portable")), file)
}

/// Runs a program to completion; returns its output, which is also stored in `file`.
fn finish(mut command: Command, file: &Path) -> Result<TargetOutput, String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn results(bits: [u32; 3]) -> TargetOutput {
        let figures = [16_416, 15_898_623, 8_208_000, 23_423_228];
        let numbers = bits.into_iter().chain(figures);
        TargetOutput::split(numbers.flat_map(u32::to_le_bytes).collect()).unwrap()
    }

    #[test]
    fn one_other_bit_is_a_difference_and_a_figure_is_none() {
        let desktop = results([1, 2, 3]);
        assert_eq!(desktop.difference(&desktop), None);
        let found = results([1, 2 | 1 << 31, 3]).difference(&desktop).unwrap();
        assert_eq!(
            found,
            "number 1 has the bytes Some([02, 00, 00, 80]) instead of Some([02, 00, 00, 00])"
        );
        let short = TargetOutput::split(vec![0; 24]).unwrap();
        let found = short.difference(&desktop).unwrap();
        assert_eq!(found, "8 bytes instead of 12");
        assert!(TargetOutput::split(vec![0; 15]).is_none());
    }

    #[test]
    fn ticks_become_instructions_of_one_call() {
        assert_eq!(results([0; 3]).instructions, Some([9685, 5000, 14_269]));
        let without = TargetOutput::split(vec![0; 20]).unwrap();
        assert_eq!(without.instructions, None);
    }
}
