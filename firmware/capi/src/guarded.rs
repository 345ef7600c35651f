//! No panic crosses the C boundary.

use crate::code::Code;

/// Runs code behind the C boundary. With `std` a panic becomes [`Code::Broken`]; without it a panic could not be
/// handled, and `cargo xtask capi` checks that there is none.
#[inline(always)]
pub(crate) fn guarded(run: impl FnOnce() -> Result<(), Code>) -> Code {
    #[cfg(feature = "std")]
    let result = match std::panic::catch_unwind(core::panic::AssertUnwindSafe(run)) {
        Ok(result) => result,
        Err(payload) => {
            // Dropping the panic payload may panic again.
            core::mem::forget(payload);
            Err(Code::Broken)
        }
    };
    #[cfg(not(feature = "std"))]
    let result = run();
    match result {
        Ok(()) => Code::Ok,
        Err(code) => code,
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_code() {
        let nothing: [u8; 0] = [];
        let index = core::hint::black_box(3);
        let code = guarded(|| {
            assert_eq!(nothing[index], 0);
            Ok(())
        });
        assert_eq!(code, Code::Broken);
    }
}
