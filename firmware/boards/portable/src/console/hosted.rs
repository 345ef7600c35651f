//! With a C library.

use core::ffi::{c_int, c_void};

// The unwinding tables of 32-bit ARM refer to a function of GCC's library.
#[cfg_attr(target_arch = "arm", link(name = "gcc_s"))]
#[link(name = "c")]
unsafe extern "C" {
    fn write(file: c_int, bytes: *const c_void, count: usize) -> isize;
    safe fn exit(code: c_int) -> !;
}

// SAFETY: no other function has this name.
#[unsafe(no_mangle)]
extern "C" fn main() -> c_int {
    if crate::work::run().is_some() { 0 } else { 1 }
}

/// Writes results to the standard output.
pub fn put(mut bytes: &[u8]) {
    while !bytes.is_empty() {
        // SAFETY: reads only the bytes of the slice.
        let written = unsafe { write(1, bytes.as_ptr().cast(), bytes.len()) };
        match usize::try_from(written).ok().and_then(|n| bytes.get(n..)) {
            Some(rest) => bytes = rest,
            None => exit(2),
        }
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    exit(101)
}
