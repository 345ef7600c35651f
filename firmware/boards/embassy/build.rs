//! Gives the linker the memory map of the reference target.

use std::path::PathBuf;
use std::{env, fs};

fn main() {
    let map = "../../../memory.x";
    println!("cargo:rerun-if-changed={map}");
    println!("cargo:rerun-if-env-changed=TRUEAXIS_BLOBS");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets it"));
    fs::copy(map, out.join("memory.x")).expect("the memory map can be copied");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
}
