//! Selects the start-up code of a target without an operating system.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let target = std::env::var("TARGET").unwrap_or_default();
    let start = match target.split('-').next() {
        // No stable `cfg` distinguishes a Cortex-M from a Cortex-R.
        Some(architecture) if architecture.starts_with("thumb") => "cortex_m",
        Some(architecture) if architecture.starts_with("armv7r") => "cortex_r",
        Some(architecture) if architecture.starts_with("riscv32") => "risc_v",
        _ => return,
    };
    println!("cargo:rustc-env=START={start}.s");
    if start == "cortex_m" {
        println!("cargo:rustc-cfg=cortex_m");
    }
}
