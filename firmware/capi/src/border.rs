//! The border: functions that C calls, and how its pointers become references.
//!
//! The header states what the caller promises: a pointer to an object is null or came from `…_new`, memory
//! stays where it is, one thread uses a servo at a time, a blob stays as it is while it is loaded. Pointers
//! that are null or not aligned are refused. Nothing is read from memory that this library has not written.

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
use crate::{Servo, Tables};

/// Whether a pointer is not null and aligned.
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
    // SAFETY: not null, so `trueaxis_tables_new` has written all of it. Whoever loads has claimed it by its
    // state, which is atomic.
    Ok(unsafe { &*pointer })
}

/// The servo at `pointer`.
///
/// # Safety
/// Null, or made by `trueaxis_servo_new` in memory that has held nothing else since; no other thread uses it.
#[inline(always)]
unsafe fn servo<'a>(pointer: *mut Servo) -> Result<&'a mut Servo, Code> {
    check(pointer)?;
    // SAFETY: not null, so `trueaxis_servo_new` has written it, and a release has left this flag.
    if unsafe { (*pointer).around.released } {
        return Err(Code::Released);
    }
    // SAFETY: made and not released; no other thread uses it.
    Ok(unsafe { &mut *pointer })
}

/// The servo at `pointer`, to be read.
///
/// # Safety
/// As of [`servo()`]; no other thread writes it meanwhile.
#[inline(always)]
unsafe fn servo_to_read<'a>(pointer: *const Servo) -> Result<&'a Servo, Code> {
    // SAFETY: as the caller promises; it is only read.
    unsafe { servo(pointer.cast_mut()) }.map(|servo| &*servo)
}

/// As many values as there are axes, to be read.
///
/// # Safety
/// Null, or so many values.
#[inline(always)]
unsafe fn values<'a>(pointer: *const f64, count: usize) -> Result<&'a [f64], Code> {
    check(pointer)?;
    // SAFETY: the caller has so many (compared with the number of axes before), aligned.
    Ok(unsafe { core::slice::from_raw_parts(pointer, count) })
}

/// Takes one value for each axis.
///
/// # Safety
/// Null, or so many values.
#[inline(always)]
unsafe fn take_values<T: Copy>(to: &mut [T], count: usize, from: *const T) -> Result<(), Code> {
    check(from)?;
    for (index, to) in to.iter_mut().enumerate().take(count) {
        // SAFETY: the caller has so many (compared with the number of axes before), aligned.
        *to = unsafe { from.add(index).read() };
    }
    Ok(())
}

/// Gives one value for each axis out.
///
/// # Safety
/// Null, or room for so many values.
#[inline(always)]
unsafe fn give_values<T: From<f32>>(to: *mut T, count: usize, from: &[f32]) -> Result<(), Code> {
    check(to)?;
    for (index, value) in from.iter().enumerate().take(count) {
        // SAFETY: the caller has room for so many (compared with the number of axes before), aligned.
        unsafe { to.add(index).write(T::from(*value)) };
    }
    Ok(())
}

/// Writes a result where it is wanted.
///
/// # Safety
/// Null, or room for one.
unsafe fn give<T>(to: *mut T, value: T) -> Result<(), Code> {
    check(to)?;
    // SAFETY: not null and aligned, and the caller has room there.
    unsafe { to.write(value) };
    Ok(())
}

/// Bytes of a text, without the zero.
///
/// # Safety
/// Null, or text that ends with a zero.
unsafe fn bytes<'a>(text: *const core::ffi::c_char) -> Result<&'a [u8], Code> {
    check(text)?;
    // SAFETY: not null, and the caller ends it with a zero.
    Ok(unsafe { core::ffi::CStr::from_ptr(text) }.to_bytes())
}

/// Lets something write a text into a buffer of the caller; its length, without the zero.
///
/// # Safety
/// Null, or room for `size` bytes.
unsafe fn give_text(
    buffer: *mut core::ffi::c_char,
    size: usize,
    write: impl FnOnce(&mut crate::text::Text<'_>),
) -> usize {
    let room: &mut [u8] = if buffer.is_null() || isize::try_from(size).is_err() {
        &mut []
    } else {
        // SAFETY: the caller has room for so many bytes; what they were does not matter, for only
        // writing is done; characters are bytes.
        unsafe { core::slice::from_raw_parts_mut(buffer.cast(), size) }
    };
    let mut text = crate::text::Text::new(room);
    write(&mut text);
    text.end()
}

/// As [`give_text`], for what may fail: then nothing is written.
///
/// # Safety
/// Null, or room for `size` bytes.
unsafe fn give_text_of<T>(
    buffer: *mut core::ffi::c_char,
    size: usize,
    of: Result<T, Code>,
    write: impl FnOnce(T, &mut crate::text::Text<'_>),
) -> usize {
    // SAFETY: as the caller promises.
    unsafe {
        give_text(buffer, size, |text| {
            if let Ok(of) = of {
                write(of, text);
            }
        })
    }
}

/// Runs what gives a length out; 0 if it does not come to its end.
fn guarded_length(run: impl FnOnce() -> usize) -> usize {
    let mut length = 0;
    guarded(|| {
        length = run();
        Ok(())
    });
    length
}

/// Whether `size` bytes at `memory` hold a `T`.
fn check_memory<T>(memory: *const core::ffi::c_void, size: usize) -> Result<(), Code> {
    if memory.is_null() {
        Err(Code::NullPointer)
    } else if size < size_of::<T>() || !memory.addr().is_multiple_of(TRUEAXIS_ALIGNMENT) {
        Err(Code::Memory)
    } else {
        Ok(())
    }
}
