//! The C boundary: functions called from C, and the conversion of pointers to references.
//!
//! The header states the caller's obligations: a pointer to an object is null or came from `…_new`, memory stays where
//! it is, only one thread uses a servo at a time, a blob stays unchanged while it is loaded. Null or misaligned
//! pointers are refused. Memory that this library has not written is never read.

mod held;
#[cfg(feature = "model")]
mod model;
mod servo;
mod tables;

pub use held::Held;
#[cfg(feature = "model")]
pub use model::*;
pub use servo::*;
pub use tables::*;

use crate::code::Code;
use crate::facts::TRUEAXIS_ALIGNMENT;
use crate::guarded::guarded;
use crate::text::Text;
use crate::{Servo, Tables};

/// Checks that a pointer is not null and is aligned.
fn check<T>(pointer: *const T) -> Result<(), Code> {
    if pointer.is_null() {
        Err(Code::NullPointer)
    } else if pointer.is_aligned() {
        Ok(())
    } else {
        Err(Code::Memory)
    }
}

/// The tables at `pointer`.
///
/// # Safety
/// Null, or made by `trueaxis_tables_new`.
unsafe fn tables<'a>(pointer: *const Tables) -> Result<&'a Tables, Code> {
    check(pointer)?;
    // SAFETY: not null, so `trueaxis_tables_new` has written all of it. Loading claims it first through its state,
    // which is atomic.
    Ok(unsafe { &*pointer })
}

/// The servo at `pointer`.
///
/// # Safety
/// Null, or made by `trueaxis_servo_new` in memory that has since held nothing else; no other thread uses it.
#[inline(always)]
unsafe fn servo<'a>(pointer: *mut Servo) -> Result<&'a mut Servo, Code> {
    check(pointer)?;
    // SAFETY: not null, so `trueaxis_servo_new` has written it, and a release leaves this flag in place.
    if unsafe { (*pointer).around.released } {
        return Err(Code::Released);
    }
    // SAFETY: made and not released; no other thread uses it.
    Ok(unsafe { &mut *pointer })
}

/// The servo at `pointer`, for reading.
///
/// # Safety
/// As for [`servo()`]; no other thread writes it meanwhile.
#[inline(always)]
unsafe fn servo_to_read<'a>(pointer: *const Servo) -> Result<&'a Servo, Code> {
    // SAFETY: guaranteed by the caller; it is only read.
    unsafe { servo(pointer.cast_mut()) }.map(|servo| &*servo)
}

/// One value per axis, for reading.
///
/// # Safety
/// Null, or `count` values.
#[inline(always)]
unsafe fn values<'a>(pointer: *const f64, count: usize) -> Result<&'a [f64], Code> {
    check(pointer)?;
    // SAFETY: the caller has this many values (already compared with the number of axes), aligned.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// Reads one value for each axis.
///
/// # Safety
/// Null, or this many values.
#[inline(always)]
unsafe fn take_values<T: Copy>(to: &mut [T], count: usize, from: *const T) -> Result<(), Code> {
    check(from)?;
    for (index, to) in to.iter_mut().enumerate().take(count) {
        // SAFETY: the caller has this many values (already compared with the number of axes), aligned.
        *to = unsafe { from.add(index).read() };
    }
    Ok(())
}

/// Writes one value for each axis.
///
/// # Safety
/// Null, or room for this many values.
#[inline(always)]
unsafe fn give_values<T: From<f32>>(to: *mut T, count: usize, from: &[f32]) -> Result<(), Code> {
    check(to)?;
    for (index, value) in from.iter().enumerate().take(count) {
        // SAFETY: the caller has room for this many values (already compared with the number of axes), aligned.
        unsafe { to.add(index).write(T::from(*value)) };
    }
    Ok(())
}

/// Writes a result to the caller's memory.
///
/// # Safety
/// Null, or room for one value.
unsafe fn give<T>(to: *mut T, value: T) -> Result<(), Code> {
    check(to)?;
    // SAFETY: not null and aligned, and the caller has room there.
    unsafe { to.write(value) };
    Ok(())
}

/// Bytes of a text, without the terminating zero.
///
/// # Safety
/// Null, or text terminated by a zero.
unsafe fn bytes<'a>(text: *const core::ffi::c_char) -> Result<&'a [u8], Code> {
    check(text)?;
    // SAFETY: not null, and the caller terminates it with a zero.
    Ok(unsafe { core::ffi::CStr::from_ptr(text) }.to_bytes())
}

/// Calls a function that writes a text into a buffer of the caller; returns its length without the terminating zero.
/// Where the function fails, nothing is written.
///
/// # Safety
/// Null, or room for `size` bytes.
unsafe fn give_text(
    buffer: *mut core::ffi::c_char,
    size: usize,
    write: impl FnOnce(&mut Text<'_>) -> Result<(), Code>,
) -> usize {
    let mut length = 0;
    guarded(|| {
        let room: &mut [u8] = if buffer.is_null() || isize::try_from(size).is_err() {
            &mut []
        } else {
            // SAFETY: the caller has room for this many bytes. Their previous contents do not matter because they are
            // only written; characters are bytes.
            unsafe { core::slice::from_raw_parts_mut(buffer.cast(), size) }
        };
        let mut text = Text::new(room);
        let written = write(&mut text);
        length = text.end();
        written
    });
    length
}

/// Checks that `size` bytes at `memory` can hold a `T`.
fn check_memory<T>(memory: *const core::ffi::c_void, size: usize) -> Result<(), Code> {
    if memory.is_null() {
        Err(Code::NullPointer)
    } else if size < size_of::<T>() || !memory.addr().is_multiple_of(TRUEAXIS_ALIGNMENT) {
        Err(Code::Memory)
    } else {
        Ok(())
    }
}
