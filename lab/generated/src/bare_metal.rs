//! The examples of generated code on a Cortex-M4F, in Rust and in C, in QEMU: what they send to the drives is what the
//! example with a blob sends on this computer.

use lab_capi::{BuildCapacities, bare_library, linker};
use lab_processors::cross::{CORTEX_M, Cross};
use lab_processors::qemu;
use programs::packages;
use programs::process::{cargo, output, root, run, said, target};
use std::path::PathBuf;
use std::process::Command;

/// Clang for the target.
const CLANG: &str = "--target=thumbv7em-none-eabihf -mcpu=cortex-m4 -std=c99 -O2 -ffreestanding -fno-pic \
                     -Wall -Wextra -Werror -c";
/// Memory of the board for the linker script.
const MEMORY: [&str; 3] = ["CODE=0", "DATA=0x20000000", "STACK=0x20010000"];

/// # Errors
/// If an example does not build or run, or sends something else.
pub fn check() -> Result<(), String> {
    qemu::provide()?;
    packages::provide("clang", &["clang"], "generated C on a Cortex-M")?;
    let cross = Cross::provide(CORTEX_M)?;
    let with_blob = "run -q -p trueaxis --example first";
    let expected = output(cargo().args(with_blob.split(' ')))?;
    let rust = cross.build("generated", "build -q --release --locked")?;
    for (what, program) in [
        ("Rust", rust.join("release/generated")),
        ("C", in_c(&cross)?),
    ] {
        let said = said(&mut qemu::board(&program))?;
        // QEMU writes lines of the C example as errors.
        let sent = said.output + &said.errors;
        if sent != expected {
            return Err(format!(
                "the example of generated code in {what} sends\n{sent}not\n{expected}"
            ));
        }
        println!("generated {what} and a servo on a Cortex-M4F: the desktop's output with a blob");
    }
    Ok(())
}

/// Builds the example in C.
fn in_c(cross: &Cross) -> Result<PathBuf, String> {
    let capi = root().join("firmware/capi");
    let mut objects = Vec::new();
    for name in ["bare_metal", "generated/huron_13"] {
        let source = capi.join("examples").join(name).with_extension("c");
        let file = source.file_name().unwrap_or_default();
        let object = target("generated").join(file).with_extension("arm.o");
        let mut compile = Command::new("clang");
        compile
            .args(CLANG.split_whitespace())
            .arg(format!("-I{}", capi.display()))
            .arg(&source)
            .arg("-o")
            .arg(&object);
        run(&mut compile)?;
        objects.push(object);
    }
    let program = target("generated").join("bare_metal.elf");
    let mut link = linker()?;
    link.args(["-m", "armelf", "--gc-sections", "-T"])
        .arg(root().join("firmware/boards/portable/bare.x"))
        .args(MEMORY.map(|symbol| format!("--defsym={symbol}")))
        .args(&objects)
        .arg(bare_library(cross, "3", &BuildCapacities::USUAL)?)
        .arg("-o")
        .arg(&program);
    run(&mut link).map(|()| program)
}
