//! A simulated machine: `trueaxis_model_…`.

use super::{check, check_memory, give, give_text, values};
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

/// Makes an empty model in `memory` of `size` bytes, and writes its address to `made`. A model simulates a real
/// machine: it computes the position of the tool with known errors. The memory must stay where it is; nothing needs to
/// be freed. `header` is `TRUEAXIS_HEADER`, as for `trueaxis_tables_new`.
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
        // SAFETY: guaranteed by the caller.
        unsafe { give(made, place) }?;
        // SAFETY: aligned, of sufficient size, and used by nothing else.
        unsafe { place.write(Model::empty()) };
        Ok(())
    })
}

/// Loads the contents of a file written by `trueaxis linuxcnc model`, aligned to 8 bytes. Measured values are read in
/// place: the bytes must stay there unchanged until another file is loaded. If the file is refused, nothing is loaded.
/// Not for a real-time thread.
///
/// # Safety
/// `file` has `length` bytes, which stay in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_load(
    model: *mut Model,
    file: *const c_void,
    length: usize,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let model = unsafe { self::model(model) }?;
        // SAFETY: guaranteed by the caller.
        model.load(unsafe { super::tables::blob(file, length) }?)
    })
}

/// Writes the letters of the axes in order, `YXZ`: at most `size` bytes including the terminating zero. Returns the
/// number of letters; 0 if nothing is loaded.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_axes(
    model: *mut Model,
    text: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: guaranteed by the caller.
    unsafe {
        give_text(text, size, |text| {
            self::model(model).map(|model| model.axes(text))
        })
    }
}

/// Lets the errors of a model follow temperatures for `seconds`, each with the lag of the error file: the next
/// `trueaxis_model_pose` without temperatures has them. `celsius` has `sensors` temperatures in the order in which the
/// error file names sensors; NAN, or a missing one, leaves a temperature as it is, at first at its reference. Suitable
/// for a real-time thread.
///
/// # Safety
/// The array has this many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_model_warm(
    model: *mut Model,
    celsius: *const f64,
    sensors: usize,
    seconds: f64,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let model = unsafe { self::model(model) }?;
        if sensors > trueaxis_kinematics::MAX_SENSORS {
            return Err(Code::Count);
        }
        let celsius = match sensors {
            0 => &[],
            // SAFETY: guaranteed by the caller.
            _ => unsafe { values(celsius, sensors) }?,
        };
        model.warm(celsius, seconds)
    })
}

/// The position of the tool relative to the workpiece: the actual one, with all errors at `positions`, and the nominal
/// one, without errors at `commands`. Both arrays have `count` axes in the order of the model, in mm and degrees. The
/// directions of travel, for backlash, follow the commands from call to call. `tool_length` is in mm along the tool
/// axis from the spindle frame; NAN selects the machine's own tool. `celsius` has `sensors` temperatures in the order in
/// which the error file names sensors, which act at once; missing ones are taken at their reference. Without any
/// (`sensors` 0), the temperatures are those of `trueaxis_model_warm`. Suitable for a real-time thread: no heap, no
/// lock, no system call.
///
/// # Safety
/// The arrays have this many values, `pose` has room for one.
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
        // SAFETY: guaranteed by the caller.
        let model = unsafe { self::model(model) }?;
        if model.count()? != count || sensors > trueaxis_kinematics::MAX_SENSORS {
            return Err(Code::Count);
        }
        // SAFETY: guaranteed by the caller, and as many as there are axes.
        let (commands, positions) =
            unsafe { (values(commands, count)?, values(positions, count)?) };
        let celsius = match sensors {
            0 => &[],
            // SAFETY: guaranteed by the caller.
            _ => unsafe { values(celsius, sensors) }?,
        };
        let found = model.pose(commands, positions, tool_length, celsius)?;
        // SAFETY: guaranteed by the caller.
        unsafe { give(pose, found) }
    })
}
