//! Without an operating system: semihosting, through which QEMU writes to its own standard output.

use core::arch::global_asm;
use semihosting::io::{Write, stdout};
use semihosting::process;

global_asm!(include_str!(concat!("../start/", env!("START"))));

// SAFETY: no other function has this name.
#[unsafe(no_mangle)]
extern "C" fn bare_main() -> ! {
    process::exit(if crate::work::run().is_some() { 0 } else { 1 })
}

/// Writes results.
pub fn put(bytes: &[u8]) {
    let Ok(()) = stdout().and_then(|mut out| out.write_all(bytes)) else {
        process::exit(2)
    };
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    process::exit(101)
}
