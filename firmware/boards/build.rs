//! Gives the linker the memory map of the board that is built: that of QEMU's board, its own, or that of the reference
//! target. No file in the folder of a board is called `memory.x`, because the linker would find that first.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let feature = |name: &str| env::var_os(format!("CARGO_FEATURE_{name}")).is_some();
    let package = env::var("CARGO_PKG_NAME").expect("cargo sets it");
    let map = match package.as_str() {
        "trueaxis-generated-example" => "../qemu/memory.x",
        _ if feature("QEMU") => "../qemu/memory.x",
        "trueaxis-stm32h743" => "stm32h743.x",
        _ => "../../../memory.x",
    };
    println!("cargo:rerun-if-changed={map}");
    println!("cargo:rerun-if-env-changed=TRUEAXIS_BLOBS");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    fs::copy(map, out.join("memory.x")).expect("the memory map can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if feature("LOG") || feature("QEMU") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    if package == "trueaxis-stm32f405" {
        // Functions with the same code are one: nothing compares their addresses.
        println!("cargo:rustc-link-arg-bins=--icf=all");
    }
}
