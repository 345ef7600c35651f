//! A simulated machine: `trueaxis_model_…`.

use super::{check, check_memory, give, give_text_of, guarded_length, values};
use crate::Model;
use crate::code::Code;
use crate::guarded::guarded;
use crate::model::ModelPose;
use core::ffi::{c_char, c_void};

/// The model at `pointer`.
///
/// # Safety
/// Null, or made by `trueaxis_model_new`; no other thread uses it.
unsafe fn model<'a>(pointer: *mut Model) -> Result<&'a mut Model, Code> {
    check(pointer)?;
    // SAFETY: not null, so `trueaxis_model_new` has written all of it; no other thread uses it.
    Ok(unsafe { &mut *pointer })
}

/// Makes a model, empty, in `memory` of `size` bytes, and writes where it is to `made`. A model plays a real
/// machine: it says where the tool is with known errors. The memory stays where it is; nothing needs to be
/// given back. `header` is `TRUEAXIS_HEADER`, as for `trueaxis_tables_new`.
///
/// # Safety
/// `memory` has `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_new(
    header: u64,
    memory: *mut c_void,
    size: usize,
    made: *mut *mut Model,
) -> Code {
    guarded(|| {
        crate::capacities::check(header)?;
        check_memory::<Model>(memory, size)?;
        let place = memory.cast::<Model>();
        // SAFETY: as the caller promises.
        unsafe { give(made, place) }?;
        // SAFETY: aligned, of sufficient size, and nobody else's.
        unsafe { place.write(Model::empty()) };
        Ok(())
    })
}

/// Loads the bytes of a file that `trueaxis linuxcnc model` has written, at a multiple of 8 bytes. Measured
/// values are read where they are: the bytes stay there and as they are until another file is loaded. If it
/// is refused nothing is loaded. Not for a real-time thread.
///
/// # Safety
/// `file` has `length` bytes, which stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_load(
    model: *mut Model,
    file: *const c_void,
    length: usize,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let model = unsafe { self::model(model) }?;
        // SAFETY: as the caller promises.
        model.load(unsafe { super::tables::blob(file, length) }?)
    })
}

/// Writes the letters of the axes in order, `YXZ`: at most `size` bytes with the zero at the end. Returns how
/// many there are; 0 if nothing is loaded.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_axes(
    model: *mut Model,
    text: *mut c_char,
    size: usize,
) -> usize {
    guarded_length(|| {
        // SAFETY: as the caller promises.
        let of = unsafe { self::model(model) };
        // SAFETY: as the caller promises.
        unsafe { give_text_of(text, size, of, |model, text| model.axes(text)) }
    })
}

/// Where the tool is, seen from the workpiece: as it is, with all errors at `positions`, and as it should be,
/// without errors at `commands`; both of `count` axes in the order of the model, in mm and degrees. The
/// directions of travel, for backlash, are those of the commands from call to call. `tool_length` is in mm
/// along the tool axis from the spindle frame; NAN for the machine's own tool. `celsius` has `sensors`
/// temperatures in the order of the error file; those that are missing are at their reference. Meant to be
/// called in a real-time thread: no heap, no lock, no system call.
///
/// # Safety
/// The arrays have so many values, `pose` has room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_pose(
    model: *mut Model,
    commands: *const f64,
    positions: *const f64,
    count: usize,
    tool_length: f64,
    celsius: *const f64,
    sensors: usize,
    pose: *mut ModelPose,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let model = unsafe { self::model(model) }?;
        if model.count()? != count || sensors > trueaxis_kinematics::MAX_SENSORS {
            return Err(Code::Count);
        }
        // SAFETY: as the caller promises, and as many as there are axes.
        let (commands, positions) =
            unsafe { (values(commands, count)?, values(positions, count)?) };
        let celsius = match sensors {
            0 => &[],
            // SAFETY: as the caller promises.
            _ => unsafe { values(celsius, sensors) }?,
        };
        let found = model.pose(commands, positions, tool_length, celsius)?;
        // SAFETY: as the caller promises.
        unsafe { give(pose, found) }
    })
}
