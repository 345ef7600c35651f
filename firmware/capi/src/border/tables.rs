//! Tables: `trueaxis_tables_…`.

use super::{bytes, check_memory, give, give_text_of, guarded_length, tables};
use crate::Tables;
use crate::code::Code;
use crate::facts::{Adjustable, AuxiliaryFacts, AxisFacts, Facts, TRUEAXIS_ALIGNMENT};
use crate::guarded::guarded;
use crate::tables::About;
use core::ffi::{c_char, c_void};
use trueaxis::Compensation;

/// A result in words: English, UTF-8, never null, for ever.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_result_text(result: i32) -> *const c_char {
    Code::text(result).as_ptr()
}

/// Bytes that tables take on this system: at most `TRUEAXIS_TABLES_SIZE`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_tables_size() -> usize {
    size_of::<Tables>()
}

/// Makes tables, empty, in `memory` of `size` bytes, and writes where they are to `made`. The memory is
/// theirs until the program has no more use for them, and stays where it is; nothing needs to be given back.
/// What was in it does not matter.
///
/// `header` is `TRUEAXIS_HEADER`: a program that was compiled with the header of another version, or for
/// other capacities than the library, is refused (`TRUEAXIS_RESULT_HEADER_…`) before anything is written.
///
/// # Safety
/// `memory` has `size` bytes, and no servo holds tables there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_new(
    header: u64,
    memory: *mut c_void,
    size: usize,
    made: *mut *mut Tables,
) -> Code {
    guarded(|| {
        crate::capacities::check(header)?;
        check_memory::<Tables>(memory, size)?;
        let place = memory.cast::<Tables>();
        // SAFETY: as the caller promises.
        unsafe { give(made, place) }?;
        // SAFETY: aligned, of sufficient size, and nobody else's.
        let (about, inner) = unsafe { (&raw mut (*place).about, &raw mut (*place).compensation) };
        // One after the other: nothing in an empty compensation differs from 0, so that it takes no flash.
        // SAFETY: the same.
        unsafe { inner.write(Compensation::empty()) };
        // SAFETY: the same.
        unsafe { about.write(About::empty()) };
        Ok(())
    })
}

/// Where samples are read in place.
///
/// # Safety
/// Null, or so many bytes that stay as they are.
pub(super) unsafe fn blob(blob: *const c_void, length: usize) -> Result<&'static [u8], Code> {
    if blob.is_null() {
        return Err(Code::NullPointer);
    }
    if isize::try_from(length).is_err() {
        return Err(Code::Memory);
    }
    // SAFETY: the caller has so many bytes, which stay there and as they are until it loads again.
    Ok(unsafe { core::slice::from_raw_parts(blob.cast(), length) })
}

/// Loads what was read and checked where it is.
///
/// # Safety
/// Null, or memory for tables.
unsafe fn load(to: *mut Tables, blob: &'static [u8], slot: bool) -> Result<(), Code> {
    // SAFETY: as the caller promises.
    unsafe { tables(to) }?.claim()?;
    // SAFETY: these are tables, and claimed: nobody else reads or writes more than their mark.
    unsafe { &mut *to }.load(blob, slot)
}

/// Loads a blob: the bytes of a file `.trax`, at a multiple of 4 bytes. Its samples are read where they are:
/// it stays there and as it is until other tables are loaded here. Everything is checked before a servo can
/// take it. Takes as long as the blob has bytes: not for a real-time thread.
///
/// If it is refused nothing is loaded, and `trueaxis_tables_reason` says why.
///
/// # Safety
/// `blob` has `length` bytes, which stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load(
    tables: *mut Tables,
    blob: *const c_void,
    length: usize,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { load(tables, self::blob(blob, length)?, false) })
}

/// As `trueaxis_tables_load`, from a place of `size` bytes in flash: bytes after the blob are ignored.
///
/// # Safety
/// `slot` has `size` bytes, which stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load_slot(
    tables: *mut Tables,
    slot: *const c_void,
    size: usize,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { load(tables, blob(slot, size)?, true) })
}

/// As `trueaxis_tables_load`, of a copy: the blob may be anywhere and is not needed any more afterwards. The
/// copy goes to `copy`, which has `size` bytes, at least as many as the blob, at a multiple of 4; it stays
/// there and as it is until other tables are loaded here.
///
/// # Safety
/// `blob` has `length` bytes and `copy` has `size`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load_copy(
    tables: *mut Tables,
    blob: *const c_void,
    length: usize,
    copy: *mut c_void,
    size: usize,
) -> Code {
    guarded(|| {
        if blob.is_null() || copy.is_null() {
            return Err(Code::NullPointer);
        }
        if length > size {
            return Err(Code::Memory);
        }
        // SAFETY: as the caller promises. Claimed first: `copy` may be what is loaded there now.
        unsafe { super::tables(tables) }?.claim()?;
        // SAFETY: both have so many bytes; they may overlap.
        unsafe { core::ptr::copy(blob.cast::<u8>(), copy.cast::<u8>(), length) };
        // SAFETY: these are tables, and claimed; `copy` stays.
        unsafe { (*tables).load(core::slice::from_raw_parts(copy.cast(), length), false) }
    })
}

/// Writes why the last blob was refused, with what it has and what would be right: at most `size` bytes
/// with the zero at the end. Returns the length of the whole text without the zero; 0 if nothing was
/// refused. `text` may be null if `size` is 0.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_reason(
    tables: *const Tables,
    text: *mut c_char,
    size: usize,
) -> usize {
    guarded_length(|| {
        // SAFETY: as the caller promises.
        let of = unsafe { super::tables(tables) };
        // SAFETY: as the caller promises.
        unsafe { give_text_of(text, size, of, Tables::reason) }
    })
}

/// Writes the name of the machine, as `trueaxis_tables_reason` does.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_machine(
    tables: *const Tables,
    text: *mut c_char,
    size: usize,
) -> usize {
    guarded_length(|| {
        // SAFETY: as the caller promises.
        let of = unsafe { super::tables(tables) }.and_then(Tables::loaded);
        // SAFETY: as the caller promises.
        unsafe { give_text_of(text, size, of, |c, text| text.push(c.machine())) }
    })
}

/// What was loaded.
///
/// # Safety
/// `facts` has room for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_facts(tables: *const Tables, facts: *mut Facts) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(facts, super::tables(tables)?.facts()?) })
}

/// Axis `index`, from 0. Positions and corrections are in the order of the axes.
///
/// # Safety
/// `axis` has room for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_axis(
    tables: *const Tables,
    index: usize,
    axis: *mut AxisFacts,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(axis, super::tables(tables)?.axis(index)?) })
}

/// The number of the axis with this letter.
///
/// # Safety
/// `index` has room for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_find_axis(
    tables: *const Tables,
    name: c_char,
    index: *mut usize,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(index, super::tables(tables)?.find_axis(name as u8)?) })
}

/// Auxiliary input `index`, from 0.
///
/// # Safety
/// `auxiliary` has room for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_auxiliary(
    tables: *const Tables,
    index: usize,
    auxiliary: *mut AuxiliaryFacts,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(auxiliary, super::tables(tables)?.auxiliary(index)?) })
}

/// The number of the auxiliary input with this name.
///
/// # Safety
/// `name` ends with a zero; `index` has room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_find_auxiliary(
    tables: *const Tables,
    name: *const c_char,
    index: *mut usize,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let found = unsafe { super::tables(tables)?.find_auxiliary(bytes(name)?) }?;
        // SAFETY: as the caller promises.
        unsafe { give(index, found) }
    })
}

/// The term with an adjustable weight that is number `index` of them, from 0.
///
/// # Safety
/// `adjustable` has room for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_adjustable(
    tables: *const Tables,
    index: usize,
    adjustable: *mut Adjustable,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(adjustable, super::tables(tables)?.adjustable(index)?) })
}

/// What memory for tables and servos is aligned to: `TRUEAXIS_ALIGNMENT`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_alignment() -> usize {
    TRUEAXIS_ALIGNMENT
}
