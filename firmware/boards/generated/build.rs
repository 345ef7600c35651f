//! Gives the linker the memory map of QEMU's board.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let map = "../qemu/memory.x";
    println!("cargo:rerun-if-changed={map}");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    fs::copy(map, out.join("memory.x")).expect("the memory map can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
}
