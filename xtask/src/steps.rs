//! The steps of `cargo xtask test` and `cargo xtask test --all`, in their order.

use programs::process::{cargo, target};
use std::process::Command;

/// One check: its name in the summary, what cargo is given, and variables; a target folder is one in the usual one.
#[derive(Clone, Copy)]
pub struct Step {
    pub name: &'static str,
    words: &'static str,
    variables: &'static [(&'static str, &'static str)],
}

impl Step {
    /// `cargo` with its words and variables.
    pub fn command(&self) -> Command {
        let mut command = cargo();
        command.args(self.words.split_whitespace());
        for (key, value) in self.variables {
            match *key {
                "CARGO_TARGET_DIR" => command.env(key, target(value)),
                key => command.env(key, value),
            };
        }
        command
    }
}

/// Steps that mostly wait, or use one processor.
pub const BESIDE: [&str; 3] = [
    "LinuxCNC",
    "hardware in the loop",
    "the command for Windows",
];

/// A table: `NAME => WORDS, VARIABLE = VALUE…;`.
macro_rules! steps {
    (
        $(#[$about:meta])* $table:ident:
        $($name:expr => $words:expr $(, $key:ident = $value:literal)*;)*
    ) => {
        $(#[$about])*
        pub const $table: &[Step] = &[$(Step {
            name: $name,
            words: $words,
            variables: &[$((stringify!($key), $value)),*],
        }),*];
    };
}

/// Only the parts needed by this test, which saves minutes of building.
macro_rules! identical {
    ($further:literal) => {
        concat!(
            "test -q -p trueaxis-tests --no-default-features --test bit_identical",
            $further
        )
    };
}

/// A subcommand in the workspace of a board.
macro_rules! board {
    ($board:literal, $subcommand:literal, $further:literal) => {
        concat!(
            $subcommand,
            " --manifest-path firmware/boards/",
            $board,
            "/Cargo.toml ",
            $further
        )
    };
}

steps! {
    /// What runs anywhere, with nothing to install: minutes.
    USUAL:
    "formatting" => "fmt --all --check";
    "formatting of the module for Python" => "fmt --manifest-path python/Cargo.toml --check";
    "formatting of the laboratories" => "fmt --manifest-path lab/Cargo.toml --all --check";
    "formatting of the STM32F405" => board!("stm32f405", "fmt", "--check");
    "formatting of the instruction counts of the STM32F405" => board!("stm32f405/bench", "fmt", "--check");
    "formatting of the STM32H743" => board!("stm32h743", "fmt", "--check");
    "formatting of the program for every processor" => board!("portable", "fmt", "--check");
    "formatting of the runtime of boards" => board!("cortex-m", "fmt", "--check");
    "formatting of the board of QEMU" => board!("qemu", "fmt", "--check");
    "formatting of the example of generated code" => board!("generated", "fmt", "--check");
    "formatting of the example for RTIC" => board!("rtic", "fmt", "--check");
    "formatting of the example for embassy" => board!("embassy", "fmt", "--check");
    "lints" => "clippy -q --workspace --all-targets -- -D warnings";
    "lints of the laboratories" =>
        "clippy -q --manifest-path lab/Cargo.toml --workspace --all-targets -- -D warnings", CARGO_TARGET_DIR = "lab";
    // Includes the device in the loop on the desktop, and the kinematics with the platform's sine.
    "all tests" => "test -q --workspace --exclude trueaxis-reproduce --no-fail-fast";
    "tests of the laboratories" => "test -q --manifest-path lab/Cargo.toml --workspace", CARGO_TARGET_DIR = "lab";
    // In debug, it is among all tests.
    "bit identity, release" => identical!(" --release");
    // Evenly selected from three hundred, so that several kinds are included.
    "6 random machines" => "xtask random-machines 6 --quick";
    "documentation" => "doc -q --workspace --no-deps --document-private-items", RUSTDOCFLAGS = "-D warnings";
    "documentation of the laboratories" =>
        "doc -q --manifest-path lab/Cargo.toml --workspace --no-deps --document-private-items",
        RUSTDOCFLAGS = "-D warnings",
        CARGO_TARGET_DIR = "lab";
}

steps! {
    /// What needs emulators, LinuxCNC, a browser and compilers for other targets, which the steps install.
    FURTHER:
    "lints of the runtime with all its features" =>
        "clippy -q -p trueaxis --all-features --all-targets -- -D warnings";
    "formatting of the fuzz targets" => "fmt --manifest-path fuzz/Cargo.toml --check";
    "runtime that checks every index" => "test -q -p trueaxis --features encode,checked";
    // Of the whole workspace, whose features of dependencies are built by now.
    "the figures of the source document" =>
        "test -q --workspace --no-fail-fast --test manual --test oracle --test table_6_2";
    "a machine of each class of the arena" => "xtask arena 6 --check docs/evidence";
    "kinematics on the target" => "xtask bare";
    "C interface that catches panics" => "test -q -p trueaxis-capi --features std,model";
    "C interface from C and C++" => "xtask capi";
    "plugin for grblHAL" => "xtask grblhal";
    "LinuxCNC" => "xtask linuxcnc";
    "generated code" => "xtask generated 300000";
    "programs beside another interpreter" => "xtask gcode";
    "exports beside the firmware of printers" => "xtask printers";
    "reports in a browser" => "xtask report";
    "the command in browsers" => "xtask web --check";
    "the wheel for Python" => "xtask python";
    "examples for RTIC and embassy" => "xtask boards";
    "instructions, code and stack on the target" => "xtask bench-target";
    "hardware in the loop" => "xtask hil";
    "the command for Windows" => "xtask systems windows";
    "every kind of processor" => "xtask portable";
}

steps! {
    /// What a release needs beyond that: all values and all cases there are, other compilers and other features of crates,
    /// each a build of its own. Hours.
    PROVE:
    "the oldest supported compiler" => "xtask oldest";
    "lints of the fuzz targets" =>
        "clippy -q --manifest-path fuzz/Cargo.toml --locked -- -D warnings", CARGO_TARGET_DIR = "fuzz";
    "runtime without features" => "test -q -p trueaxis";
    "kinematics without features" => "test -q -p trueaxis-kinematics";
    "runtime that encodes" => "test -q -p trueaxis --features encode";
    // A separate build of the workspace, so that the default one stays warm.
    "bit identity, release for this processor" =>
        identical!(" --release"), CARGO_TARGET_DIR = "native", RUSTFLAGS = "-C target-cpu=native";
    "all cases of all tests" =>
        "test -q --workspace --exclude trueaxis-reproduce --no-fail-fast", TRUEAXIS_CASES = "all";
    "30 random machines" => "xtask random-machines 30 --quick";
    "every f32 and every short stream" =>
        "test -q --release -p trueaxis --features encode,link,exhaustive --lib exhaustive";
    "generated code" => "xtask generated 10000000";
}

steps! {
    /// What queries the advisory database, so it is not part of `test`.
    DENY:
    "licences, bans, sources" => "deny --all-features check licenses bans sources";
    "licences, bans, sources of the STM32F405" =>
        board!("stm32f405", "deny", "--all-features --config deny.toml check licenses bans sources");
    "licences, bans, sources of the STM32H743" =>
        board!("stm32h743", "deny", "--all-features --config deny.toml check licenses bans sources");
    "licences, bans, sources of the program for every processor" =>
        board!("portable", "deny", "--config deny.toml check licenses bans sources");
    "licences, bans, sources of the example of generated code" =>
        board!("generated", "deny", "--config deny.toml check licenses bans sources");
    "licences, bans, sources of the example for RTIC" =>
        board!("rtic", "deny", "--config deny.toml check licenses bans sources");
    "licences, bans, sources of the example for embassy" =>
        board!("embassy", "deny", "--config deny.toml check licenses bans sources");
    "licences, bans, sources of the module for Python" =>
        "deny --manifest-path python/Cargo.toml --config deny.toml check licenses bans sources";
    "licences, bans, sources of the laboratories" =>
        "deny --manifest-path lab/Cargo.toml --config deny.toml check licenses bans sources";
    "advisories" => "deny --all-features check advisories";
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::COMMANDS;

    #[test]
    fn every_command_that_is_a_step_is_in_the_table() {
        for step in [USUAL, FURTHER, PROVE].concat() {
            let mut words = step.words.split(' ');
            if words.next() == Some("xtask") {
                let name = words.next().unwrap_or_default();
                let is_known = COMMANDS.iter().any(|command| command.name() == name);
                assert!(is_known, "{}", step.name);
            }
        }
    }

    #[test]
    fn steps_that_run_beside_others_are_among_them() {
        let names: Vec<&str> = FURTHER.iter().map(|step| step.name).collect();
        assert!(BESIDE.iter().all(|name| names.contains(name)));
    }
}
