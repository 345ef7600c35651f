//! Tables: `trueaxis_tables_…`.

use super::{bytes, check_memory, give, give_text, tables};
use crate::Tables;
use crate::code::Code;
use crate::facts::{Adjustable, AuxiliaryFacts, AxisFacts, Facts, Generated, TRUEAXIS_ALIGNMENT};
use crate::guarded::guarded;
use crate::tables::About;
use crate::text::Text;
use core::ffi::{c_char, c_void};
use trueaxis::Compensation;

/// A result in words: English, UTF-8, never null, valid for ever.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_result_text(result: i32) -> *const c_char {
    Code::text(result).as_ptr()
}

/// Size of tables on this system in bytes: at most `TRUEAXIS_TABLES_SIZE`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_tables_size() -> usize {
    size_of::<Tables>()
}

/// Makes empty tables in `memory` of `size` bytes, and writes their address to `made`. The memory belongs to them for
/// as long as the program uses them, and must stay where it is; nothing needs to be freed. Its previous contents do not
/// matter.
///
/// `header` is `TRUEAXIS_HEADER`: a program compiled with the header of another version, or for other capacities than
/// the library, is refused (`TRUEAXIS_RESULT_HEADER_…`) before anything is written.
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
        // SAFETY: guaranteed by the caller.
        unsafe { give(made, place) }?;
        // SAFETY: aligned, of sufficient size, and used by nothing else.
        let (about, inner) = unsafe { (&raw mut (*place).about, &raw mut (*place).compensation) };
        // Written separately: an empty compensation is all zeros, so it takes no flash.
        // SAFETY: as above.
        unsafe { inner.write(Compensation::empty()) };
        // SAFETY: as above.
        unsafe { about.write(About::empty()) };
        Ok(())
    })
}

/// A blob whose samples are read in place.
///
/// # Safety
/// Null, or `length` bytes that stay unchanged.
pub(super) unsafe fn blob(blob: *const c_void, length: usize) -> Result<&'static [u8], Code> {
    if blob.is_null() {
        return Err(Code::NullPointer);
    }
    if isize::try_from(length).is_err() {
        return Err(Code::Memory);
    }
    // SAFETY: the caller has this many bytes, which stay there unchanged until the next load.
    Ok(unsafe { core::slice::from_raw_parts(blob.cast(), length) })
}

/// Loads a blob that was converted by [`blob`].
///
/// # Safety
/// Null, or memory for tables.
unsafe fn load(to: *mut Tables, blob: &'static [u8], slot: bool) -> Result<(), Code> {
    // SAFETY: guaranteed by the caller.
    unsafe { tables(to) }?.claim()?;
    // SAFETY: these are claimed tables: nothing else reads or writes more than their mark.
    unsafe { &mut *to }.load(blob, slot)
}

/// Loads a blob: the contents of a `.trax` file, aligned to 4 bytes. Its samples are read in place, so it must stay
/// there unchanged until other tables are loaded here. Everything is checked before a servo can use it. The time is
/// proportional to the length of the blob: not for a real-time thread.
///
/// If the blob is refused nothing is loaded, and `trueaxis_tables_reason` gives the reason.
///
/// # Safety
/// `blob` has `length` bytes, which stay in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load(
    tables: *mut Tables,
    blob: *const c_void,
    length: usize,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { load(tables, self::blob(blob, length)?, false) })
}

/// Like `trueaxis_tables_load`, from a region of `size` bytes in flash: bytes after the blob are ignored.
///
/// # Safety
/// `slot` has `size` bytes, which stay in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load_slot(
    tables: *mut Tables,
    slot: *const c_void,
    size: usize,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { load(tables, blob(slot, size)?, true) })
}

/// Like `trueaxis_tables_load`, using a copy: the blob may have any alignment and is not needed afterwards. The copy
/// goes to `copy`, which has `size` bytes, at least as many as the blob, aligned to 4; it must stay there unchanged
/// until other tables are loaded here.
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
        // SAFETY: guaranteed by the caller. Claimed first, because `copy` may be what is loaded there now.
        unsafe { super::tables(tables) }?.claim()?;
        // SAFETY: both have this many bytes; they may overlap.
        unsafe { core::ptr::copy(blob.cast::<u8>(), copy.cast::<u8>(), length) };
        // SAFETY: these are claimed tables; `copy` stays in place.
        unsafe { (*tables).load(core::slice::from_raw_parts(copy.cast(), length), false) }
    })
}

/// Like `trueaxis_tables_load`, for generated code: `trueaxis generate --servo` writes the code and a
/// `trueaxis_generated` into one file. A servo with these tables calls the code instead of reading tables; its
/// corrections are the same to the last bit; code that a compiler made otherwise is refused
/// (`TRUEAXIS_RESULT_OTHER_BITS`). Not for a real-time thread.
///
/// # Safety
/// `generated` is as it was generated; its facts and code stay in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_load_generated(
    tables: *mut Tables,
    generated: *const Generated,
) -> Code {
    guarded(|| {
        super::check(generated)?;
        // SAFETY: not null, and guaranteed by the caller.
        let generated = unsafe { *generated };
        let evaluate = generated.evaluate.ok_or(Code::NullPointer)?;
        let check = generated.check.ok_or(Code::NullPointer)?;
        // SAFETY: guaranteed by the caller.
        let facts = unsafe { blob(generated.facts, generated.size) }?;
        // SAFETY: guaranteed by the caller.
        if unsafe { check() } == 0 {
            return Err(Code::OtherBits);
        }
        // SAFETY: guaranteed by the caller.
        unsafe { super::tables(tables) }?.claim()?;
        let source = [generated.bytes, generated.checksum];
        // SAFETY: these are claimed tables: nothing else reads or writes more than their mark.
        unsafe { &mut *tables }.load_generated(facts, evaluate, source)
    })
}

/// Writes the reason why the last blob was refused, with the value found and the value required: at most `size` bytes
/// including the terminating zero. Returns the length of the whole text without the zero; 0 if nothing was refused, and
/// while tables are loaded. `text` may be null if `size` is 0.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_reason(
    tables: *const Tables,
    text: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: guaranteed by the caller.
    unsafe {
        give_text(text, size, |text| {
            super::tables(tables).map(|tables| tables.reason(text))
        })
    }
}

/// Writes the name of the machine, like `trueaxis_tables_reason`.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_machine(
    tables: *const Tables,
    text: *mut c_char,
    size: usize,
) -> usize {
    let machine = |text: &mut Text<'_>| {
        // SAFETY: guaranteed by the caller.
        text.push(unsafe { super::tables(tables) }?.loaded()?.machine());
        Ok(())
    };
    // SAFETY: guaranteed by the caller.
    unsafe { give_text(text, size, machine) }
}

/// Information about the loaded tables.
///
/// # Safety
/// `facts` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_facts(tables: *const Tables, facts: *mut Facts) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(facts, super::tables(tables)?.facts()?) })
}

/// Axis `index`, from 0. Positions and corrections are in the order of the axes.
///
/// # Safety
/// `axis` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_axis(
    tables: *const Tables,
    index: usize,
    axis: *mut AxisFacts,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(axis, super::tables(tables)?.axis(index)?) })
}

/// The index of the axis with this letter.
///
/// # Safety
/// `index` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_find_axis(
    tables: *const Tables,
    name: c_char,
    index: *mut usize,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(index, super::tables(tables)?.find_axis(name as u8)?) })
}

/// Auxiliary input `index`, from 0.
///
/// # Safety
/// `auxiliary` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_auxiliary(
    tables: *const Tables,
    index: usize,
    auxiliary: *mut AuxiliaryFacts,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(auxiliary, super::tables(tables)?.auxiliary(index)?) })
}

/// The index of the auxiliary input with this name.
///
/// # Safety
/// `name` is terminated by a zero; `index` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_find_auxiliary(
    tables: *const Tables,
    name: *const c_char,
    index: *mut usize,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let found = unsafe { super::tables(tables)?.find_auxiliary(bytes(name)?) }?;
        // SAFETY: guaranteed by the caller.
        unsafe { give(index, found) }
    })
}

/// The adjustable term number `index` among the adjustable terms, from 0.
///
/// # Safety
/// `adjustable` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_tables_adjustable(
    tables: *const Tables,
    index: usize,
    adjustable: *mut Adjustable,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(adjustable, super::tables(tables)?.adjustable(index)?) })
}

/// Required alignment of the memory for tables and servos in bytes: `TRUEAXIS_ALIGNMENT`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_alignment() -> usize {
    TRUEAXIS_ALIGNMENT
}
