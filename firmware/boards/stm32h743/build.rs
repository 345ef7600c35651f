//! Gives the linker the memory map of the board that is built. No file in this folder is called `memory.x`, because the
//! linker would find that first.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let board = |name: &str| env::var_os(format!("CARGO_FEATURE_{name}")).is_some();
    let map = match (board("STM32H743"), board("QEMU")) {
        (true, false) => "stm32h743.x",
        (false, true) => "../qemu/memory.x",
        // Nothing is linked.
        _ => return,
    };
    println!("cargo:rerun-if-changed={map}");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    fs::copy(map, out.join("memory.x")).expect("the memory map can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    if board("LOG") || board("QEMU") {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
}
