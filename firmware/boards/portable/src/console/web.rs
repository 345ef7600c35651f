//! In a WebAssembly engine driven by `run.mjs`.

#[link(wasm_import_module = "console")]
unsafe extern "C" {
    #[link_name = "put"]
    fn write(bytes: *const u8, count: usize);
}

// SAFETY: no other function has this name.
#[unsafe(no_mangle)]
extern "C" fn run() -> i32 {
    if crate::work::run().is_some() { 0 } else { 1 }
}

/// Writes results.
pub fn put(bytes: &[u8]) {
    // SAFETY: the engine reads only the bytes of the slice.
    unsafe { write(bytes.as_ptr(), bytes.len()) };
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
