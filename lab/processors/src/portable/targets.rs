//! The table of targets, and the processors that run their programs here.

use lab_processors::cross::Cross;
use lab_processors::elf::ElfProgram;
use programs::packages;
use programs::process::{has, root};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A build target, and where it runs.
pub struct BuildTarget {
    /// Rust's name.
    pub name: &'static str,
    platform: Platform,
    /// Processors, and their emulators.
    pub processors: &'static [(&'static str, &'static str)],
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

pub const TARGETS: [BuildTarget; 9] = [
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
const BOARD: &str = "-nographic -monitor none -serial none -semihosting-config enable=on,target=native -icount \
                     shift=10";
/// The folder of the program.
pub fn folder() -> PathBuf {
    root().join("firmware/boards/portable")
}

impl BuildTarget {
    /// The linker of a C library.
    pub fn linker(&self) -> Option<String> {
        match self.platform {
            Linux(gnu, _) => Some(format!("{gnu}-gcc")),
            Bare(_) | Web => None,
        }
    }

    /// Compiler flags.
    pub fn flags(&self) -> Vec<String> {
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
    pub fn provide(&self) -> Result<Cross, String> {
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
    pub fn command(&self, emulator: &str, program: &Path) -> Result<Command, String> {
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

    /// The program among those of cargo.
    pub fn program(&self, folder: &Path) -> PathBuf {
        let name = match self.platform {
            Web => "portable.wasm",
            Bare(_) | Linux(..) => "portable",
        };
        folder.join(self.name).join("release").join(name)
    }

    /// Bytes of a program without its blobs, if it has start-up code of its own.
    pub fn bytes(&self, program: &Path, blobs: u32) -> Option<u32> {
        match self.platform {
            Bare(_) => Some(
                ElfProgram::read(program)
                    .ok()?
                    .flash()
                    .saturating_sub(blobs),
            ),
            Linux(..) | Web => None,
        }
    }
}
