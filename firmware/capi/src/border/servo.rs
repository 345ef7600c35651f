//! The servo: `trueaxis_servo_…`.

use super::{
    Held, check_memory, give, give_text, give_values, servo_to_read, tables, take_values, values,
};
use crate::code::Code;
use crate::facts::StatusFacts;
use crate::guarded::guarded;
use crate::{Servo, Tables};
use core::ffi::{c_char, c_void};
use core::mem::ManuallyDrop;
use core::ptr::null_mut;
use trueaxis::{Conditions, Handle};

/// Size of a servo on this system in bytes: at most `TRUEAXIS_SERVO_SIZE`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_servo_size() -> usize {
    size_of::<Servo>()
}

/// Makes a disabled servo with these tables in `memory` of `size` bytes, and writes its address to `made`. It holds the
/// tables until they are retired or the servo is released.
///
/// # Safety
/// `memory` has `size` bytes, and contains no servo that has not been released.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_new(
    memory: *mut c_void,
    size: usize,
    tables: *mut Tables,
    made: *mut *mut Servo,
) -> Code {
    guarded(|| {
        check_memory::<Servo>(memory, size)?;
        super::check(made)?;
        // SAFETY: guaranteed by the caller; tables stay where they are while a servo holds them.
        let held = unsafe { Held::new(tables) }?;
        let place = memory.cast::<Servo>();
        // SAFETY: aligned, of sufficient size, and used by nothing else.
        let (around, inner) = unsafe { (&raw mut (*place).around, &raw mut (*place).servo) };
        let new = Servo::around(held.get());
        // SAFETY: as above.
        trueaxis::Servo::new_in(unsafe { &mut *inner.cast() }, held);
        // SAFETY: as above.
        unsafe { around.write(new) };
        // SAFETY: guaranteed by the caller.
        unsafe { give(made, place) }
    })
}

/// Ends a servo: it no longer holds tables, and its memory belongs to the caller again. The corrections disappear at
/// once; if that matters, disable it first and keep updating until the factor is 0. Further calls with this pointer are
/// refused (`TRUEAXIS_RESULT_RELEASED`) as long as the memory is not overwritten.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_release(servo: *mut Servo) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { super::servo(servo) }?;
        servo.around.released = true;
        // SAFETY: it was made, and once released it cannot be reached again. The parts around it need no drop, so the
        // flag remains.
        unsafe { core::ptr::drop_in_place(&raw mut servo.servo) };
        Ok(())
    })
}

/// One period, in the real-time thread. `commands`: the *uncorrected* commands in machine coordinates, mm and degrees,
/// one for each of the `axes` axes, whose number must be that of the tables; endless axes may have any number of turns.
/// `referenced`: bit 0 for the first axis, cleared while it is not referenced or is homing. `period`: of this call, s.
/// The values to be *added* to the commands are written to `corrections`, which may be the same array as `commands`.
/// They are written only if the result is `TRUEAXIS_RESULT_OK`.
///
/// Faults of the inputs do not change the result: see `trueaxis_servo_status`.
///
/// # Safety
/// The arrays have this many values; no other thread uses the servo.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_update(
    servo: *mut Servo,
    commands: *const f64,
    axes: usize,
    referenced: u32,
    period: f64,
    corrections: *mut f64,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { super::servo(servo) }?;
        servo.check(axes)?;
        super::check(corrections)?;
        // SAFETY: guaranteed by the caller.
        servo.take_commands(unsafe { values(commands, axes) }?);
        let dq = servo.advance(referenced, period as f32);
        // SAFETY: guaranteed by the caller.
        unsafe { give_values(corrections, axes, dq) }
    })
}

/// Like `trueaxis_servo_update`, in single precision throughout, for processors without double-precision hardware. Keep
/// the positions of endless axes within one turn or a few: a float with many turns is coarse, and more than 2¹³ turns
/// are a bad input. The corrections equal those of `trueaxis_servo_update` for the same positions in every bit.
///
/// # Safety
/// The arrays have this many values; no other thread uses the servo.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_update_f32(
    servo: *mut Servo,
    commands: *const f32,
    axes: usize,
    referenced: u32,
    period: f32,
    corrections: *mut f32,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { super::servo(servo) }?;
        servo.check(axes)?;
        super::check(corrections)?;
        // SAFETY: guaranteed by the caller.
        unsafe { take_values(servo.commands(), axes, commands) }?;
        let dq = servo.advance(referenced, period);
        // SAFETY: guaranteed by the caller.
        unsafe { give_values(corrections, axes, dq) }
    })
}

/// Ramps the corrections in (`on` not 0) or out, all by one fade factor. May be called in every period: a call that
/// changes nothing costs nothing.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_enable(servo: *mut Servo, on: i32) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        unsafe { super::servo(servo) }?.enable(on != 0);
        Ok(())
    })
}

/// Begins (`on` not 0) or ends a dry run: everything is computed and reported, while the corrections go to zero.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_dry_run(servo: *mut Servo, on: i32) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        unsafe { super::servo(servo) }?.servo.dry_run(on != 0);
        Ok(())
    })
}

/// Begins again as after `trueaxis_servo_new`, for a controller whose positions are set anew while nothing moves (after
/// homing): every correction is zero at once, no axis is referenced, no direction of travel is known. What was switched
/// on stays on, and so do the weights and the temperatures with their lags. Tables that were waiting are in use.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_restart(servo: *mut Servo) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        unsafe { super::servo(servo) }?.servo.restart();
        Ok(())
    })
}

/// Time (s) in which nothing is updated: temperatures are followed for so long, at most 10 s in a call, and corrections stay
/// as they are. For a controller that updates while it plans a move, at the periods of that move: what passes in
/// addition, at standstill or because the move is slower, has to be told.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_pass_time(servo: *mut Servo, time: f64) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        unsafe { super::servo(servo) }?.pass_time(time);
        Ok(())
    })
}

/// Sets an auxiliary input by its index: a tool length in mm, or a temperature in °C (its reference is subtracted
/// here). Inputs with the same name, one sensor with several lags, are set together; the servo applies the lags. Takes
/// effect at the next update, and is faded in. An input that was never set, or is NAN because its sensor
/// has failed, is a fault if a correction depends on it; it never counts as 0.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_auxiliary(
    servo: *mut Servo,
    index: usize,
    value: f64,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { super::servo(servo) }?.set_auxiliary(index, value))
}

/// Sets the tool length, mm; `TRUEAXIS_RESULT_NAME` if the tables have no such input.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_tool_length(servo: *mut Servo, length: f64) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { super::servo(servo) }?.set_tool_length(length))
}

/// Sets the weight of an adjustable term of the tables accepted last; the change is faded in.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_weight(
    servo: *mut Servo,
    term: usize,
    weight: f64,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { super::servo(servo) }?.set_weight(term, weight))
}

/// The requested weight of an adjustable term of the tables accepted last.
///
/// # Safety
/// No other thread uses it; `weight` has room for one value.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_weight(
    servo: *const Servo,
    term: usize,
    weight: *mut f64,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(weight, servo_to_read(servo)?.weight(term)?) })
}

/// Sets the direction in which an axis last moved (1 positive, −1 negative, 0 unknown), if the controller knows it:
/// homing, for example, ends with a move in a known direction.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_travel(
    servo: *mut Servo,
    axis: usize,
    direction: i32,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { super::servo(servo) }?.set_travel(axis, direction))
}

/// Fades over to other tables with the same axes and auxiliary inputs, with their stored weights, as soon as nothing
/// else is changing. The servo holds both until that is complete; then `trueaxis_servo_take_retired` returns the
/// previous ones. If `to` is already in use, only its stored weights are faded in.
///
/// Tables that were retired earlier and not taken back are returned in `retired` (null: none), whatever the result;
/// `retired` itself may be null. If it is misaligned, nothing happens at all.
///
/// # Safety
/// No other thread uses the servo; `retired` has room for a pointer if it is not null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_swap(
    servo: *mut Servo,
    to: *mut Tables,
    retired: *mut *mut Tables,
) -> Code {
    let mut back = null_mut();
    let code = guarded(|| {
        // Before anything is taken back, because tables that cannot be returned would be lost to the caller.
        if !retired.is_null() {
            super::check(retired)?;
        }
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { super::servo(servo) }?;
        // SAFETY: guaranteed by the caller.
        unsafe { tables(to) }?;
        back = retire(servo);
        let current = servo.servo.handle();
        if core::ptr::eq(current.pointer(), to) {
            let again = ManuallyDrop::into_inner(current.again());
            return match servo.swap(again) {
                Ok(same) => {
                    core::mem::forget(same);
                    Ok(())
                }
                Err((code, same)) => {
                    core::mem::forget(same);
                    Err(code)
                }
            };
        }
        // SAFETY: tables stay where they are while a servo holds them.
        let held = unsafe { Held::new(to) }?;
        if core::ptr::eq(back, to) {
            back = null_mut();
        }
        // Refused tables are released; retired ones were taken back above.
        servo.swap(held).map(drop).map_err(|(code, _)| code)
    });
    if super::check(retired).is_ok() {
        // SAFETY: not null and aligned, and the caller has room there.
        unsafe { retired.write(back) };
    }
    code
}

/// Takes back retired tables; null if there are none.
fn retire(servo: &mut Servo) -> *mut Tables {
    let held = servo.servo.take_retired();
    held.map_or(null_mut(), |held| held.pointer())
}

/// Returns the tables that were in use before the last change, once that is complete, so that others can be loaded into
/// them. Returned once; null if there are none.
///
/// # Safety
/// No other thread uses it; `retired` has room for a pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_take_retired(
    servo: *mut Servo,
    retired: *mut *mut Tables,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { super::servo(servo) }?;
        super::check(retired)?;
        // SAFETY: guaranteed by the caller.
        unsafe { give(retired, retire(servo)) }
    })
}

/// Measurement mode: converts measured axis positions (a touch probe, the scales) to the commands that lead there,
/// removing the correction to the extent that it is in. Uses the directions of travel, weights, tool length and
/// temperatures (as they were followed) of the last update. Returns `TRUEAXIS_RESULT_MOVING` during a ramp or fade: subtract the correction of the period in
/// question instead. Takes four evaluations. The arrays may be the same.
///
/// # Safety
/// The arrays have this many values; no other thread uses the servo.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_measured(
    servo: *const Servo,
    measured: *const f64,
    axes: usize,
    commands: *mut f64,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        super::check(commands)?;
        // SAFETY: guaranteed by the caller.
        let from = unsafe { values(measured, axes) }?;
        let dq = servo.measured(from)?;
        let mut found = [0.0; crate::capacities::TRUEAXIS_AXES];
        for ((to, from), dq) in found.iter_mut().zip(from).zip(dq) {
            *to = from - f64::from(dq);
        }
        for (index, value) in found.into_iter().enumerate().take(axes) {
            // SAFETY: the caller has room for this many values.
            unsafe { commands.add(index).write(value) };
        }
        Ok(())
    })
}

/// Status of the last period.
///
/// # Safety
/// No other thread uses it; `status` has room for one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_status(
    servo: *const Servo,
    status: *mut StatusFacts,
) -> Code {
    // SAFETY: guaranteed by the caller.
    guarded(|| unsafe { give(status, servo_to_read(servo)?.status()) })
}

/// The computed corrections of the last period, within the value bounds, before the fade factor, travel and rate
/// bounds: what a dry run would apply.
///
/// # Safety
/// No other thread uses it; `computed` has room for this many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_computed(
    servo: *const Servo,
    computed: *mut f64,
    axes: usize,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        // SAFETY: guaranteed by the caller.
        unsafe { give_values(computed, axes, &servo.servo.correction().computed) }
    })
}

/// Rate of change of the corrections in the last period, mm/s and degrees/s. Add it to the velocity for drives that
/// take velocity feed-forward.
///
/// # Safety
/// No other thread uses it; `velocity` has room for this many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_velocity(
    servo: *const Servo,
    velocity: *mut f64,
    axes: usize,
) -> Code {
    guarded(|| {
        // SAFETY: guaranteed by the caller.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        // SAFETY: guaranteed by the caller.
        unsafe { give_values(velocity, axes, &servo.servo.velocity()) }
    })
}

/// Writes conditions in words (`bad input, held`), as `trueaxis_tables_reason` does.
///
/// # Safety
/// `text` has room for `size` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_conditions_text(
    conditions: u16,
    text: *mut c_char,
    size: usize,
) -> usize {
    // SAFETY: guaranteed by the caller.
    unsafe {
        give_text(text, size, |text| {
            for (place, name) in Conditions(conditions).names().enumerate() {
                if place > 0 {
                    text.push(", ");
                }
                text.push(name);
            }
            Ok(())
        })
    }
}
