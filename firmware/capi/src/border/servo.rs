//! The servo: `trueaxis_servo_…`.

use super::{
    Held, check_memory, give, give_text, give_values, guarded_length, servo_to_read, tables,
    take_values, values,
};
use crate::code::Code;
use crate::facts::StatusFacts;
use crate::guarded::guarded;
use crate::{Servo, Tables};
use core::ffi::{c_char, c_void};
use core::mem::ManuallyDrop;
use core::ptr::null_mut;
use trueaxis::{Conditions, Handle};

/// Bytes that a servo takes on this system: at most `TRUEAXIS_SERVO_SIZE`.
#[unsafe(no_mangle)]
pub extern "C" fn trueaxis_servo_size() -> usize {
    size_of::<Servo>()
}

/// Makes a servo with these tables, disabled, in `memory` of `size` bytes, and writes where it is to `made`.
/// It holds the tables from now on, until they have retired or it is released.
///
/// # Safety
/// `memory` has `size` bytes, and no servo that has not been released is there.
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
        // SAFETY: as the caller promises; tables stay where they are while a servo holds them.
        let held = unsafe { Held::new(tables) }?;
        let place = memory.cast::<Servo>();
        // SAFETY: aligned, of sufficient size, and nobody else's.
        let (around, inner) = unsafe { (&raw mut (*place).around, &raw mut (*place).servo) };
        let new = Servo::around(held.get());
        // SAFETY: the same.
        trueaxis::Servo::new_in(unsafe { &mut *inner.cast() }, held);
        // SAFETY: the same.
        unsafe { around.write(new) };
        // SAFETY: as the caller promises.
        unsafe { give(made, place) }
    })
}

/// Ends a servo: it holds no tables any more, and its memory is the caller's again. The corrections are gone
/// at once; disable it before and go on until the factor is 0 where that matters. Calls with this pointer are
/// refused (`TRUEAXIS_RESULT_RELEASED`) as long as nothing else is written to the memory.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_release(servo: *mut Servo) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let servo = unsafe { super::servo(servo) }?;
        servo.around.released = true;
        // SAFETY: it was made, and as it is released nobody gets at it again. Around it nothing is to be
        // dropped, so that the flag stays.
        unsafe { core::ptr::drop_in_place(&raw mut servo.servo) };
        Ok(())
    })
}

/// One period, in the real-time thread. `commands`: the *uncorrected* commands in machine coordinates, mm
/// and degrees, one for each of the `axes` axes, which must be as many as the tables have; axes without end
/// may have any number of turns. `referenced`: bit 0 for the first axis, cleared while it is not referenced
/// or is homing. `period`: of this call, s. To `corrections` it writes what is to be *added* to the commands;
/// that may be the array of the commands. After any other result than `TRUEAXIS_RESULT_OK` those are not written.
///
/// Faults of the inputs are no such result: see `trueaxis_servo_status`.
///
/// # Safety
/// The arrays have so many values; no other thread uses the servo.
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
        // SAFETY: as the caller promises.
        let servo = unsafe { super::servo(servo) }?;
        servo.check(axes)?;
        super::check(corrections)?;
        // SAFETY: as the caller promises.
        servo.take_commands(unsafe { values(commands, axes) }?);
        let dq = servo.advance(referenced, period as f32);
        // SAFETY: as the caller promises.
        unsafe { give_values(corrections, axes, dq) }
    })
}

/// As `trueaxis_servo_update`, in single precision throughout, for processors that compute doubles in
/// software. The positions of axes without end are within a turn, or some few beyond: a float of many turns is
/// coarse, and beyond 2¹³ of them it is a bad input. The corrections are those of `trueaxis_servo_update` for
/// the same positions, to the last bit.
///
/// # Safety
/// The arrays have so many values; no other thread uses the servo.
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
        // SAFETY: as the caller promises.
        let servo = unsafe { super::servo(servo) }?;
        servo.check(axes)?;
        super::check(corrections)?;
        // SAFETY: as the caller promises.
        unsafe { take_values(servo.commands(), axes, commands) }?;
        let dq = servo.advance(referenced, period);
        // SAFETY: as the caller promises.
        unsafe { give_values(corrections, axes, dq) }
    })
}

/// Lets the corrections in (`on` not 0) or takes them out, all by one common factor, over some time. In
/// every period if one likes: what changes nothing costs nothing.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_enable(servo: *mut Servo, on: i32) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        unsafe { super::servo(servo) }?.enable(on != 0);
        Ok(())
    })
}

/// Begins (`on` not 0) or ends a dry run: everything is computed and reported, the corrections go to zero.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_dry_run(servo: *mut Servo, on: i32) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        unsafe { super::servo(servo) }?.dry_run(on != 0);
        Ok(())
    })
}

/// Sets an auxiliary input by its number: a tool length in mm, a temperature in °C (its reference is
/// subtracted here). It holds from the next update on, and is faded in. What was never set, or is not a
/// number because its sensor is lost, is a fault if a correction depends on it, never 0.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_auxiliary(
    servo: *mut Servo,
    index: usize,
    value: f64,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { super::servo(servo) }?.set_auxiliary(index, value))
}

/// Sets the tool length, mm; `TRUEAXIS_RESULT_NAME` if the tables have no such input.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_tool_length(servo: *mut Servo, length: f64) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { super::servo(servo) }?.set_tool_length(length))
}

/// Sets the weight of an adjustable term of the tables last accepted; it is faded in.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_weight(
    servo: *mut Servo,
    term: usize,
    weight: f64,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { super::servo(servo) }?.set_weight(term, weight))
}

/// The weight asked for of an adjustable term of the tables last accepted.
///
/// # Safety
/// No other thread uses it; `weight` has room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_weight(
    servo: *const Servo,
    term: usize,
    weight: *mut f64,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(weight, servo_to_read(servo)?.weight(term)?) })
}

/// Says in which direction an axis last moved (1 positive, −1 negative, 0 not known), where the controller
/// knows: after homing, which ends with a move in a known direction.
///
/// # Safety
/// No other thread uses it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_set_travel(
    servo: *mut Servo,
    axis: usize,
    direction: i32,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { super::servo(servo) }?.set_travel(axis, direction))
}

/// Fades over to other tables of the same axes and auxiliary inputs, with their stored weights, as soon as
/// nothing else moves. The servo holds both until that is done; then `trueaxis_servo_take_retired` gives
/// those before back. To those in use: only their stored weights are faded in.
///
/// Tables that had retired before and were not taken back come back here in `retired` (null: none), whatever
/// the result; `retired` itself may be null. If it is not aligned nothing happens at all.
///
/// # Safety
/// No other thread uses the servo; `retired` has room if it is not null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_swap(
    servo: *mut Servo,
    to: *mut Tables,
    retired: *mut *mut Tables,
) -> Code {
    let mut back = null_mut();
    let code = guarded(|| {
        // Before anything is taken back: what cannot be given to the caller would be lost to it.
        if !retired.is_null() {
            super::check(retired)?;
        }
        // SAFETY: as the caller promises.
        let servo = unsafe { super::servo(servo) }?;
        // SAFETY: as the caller promises.
        unsafe { tables(to) }?;
        back = retire(servo);
        let current = servo.current();
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
        // What is refused is let go of; what had retired was taken back above.
        servo.swap(held).map(drop).map_err(|(code, _)| code)
    });
    if super::check(retired).is_ok() {
        // SAFETY: not null and aligned, and the caller has room there.
        unsafe { retired.write(back) };
    }
    code
}

/// Takes back tables that have retired; null if there are none.
fn retire(servo: &mut Servo) -> *mut Tables {
    let held = servo.take_retired();
    held.map_or(null_mut(), |held| held.pointer())
}

/// Gives the tables back that were in use before the last change, once that is finished: others can be loaded
/// into them. Given once; null if there are none.
///
/// # Safety
/// No other thread uses it; `retired` has room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_take_retired(
    servo: *mut Servo,
    retired: *mut *mut Tables,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let servo = unsafe { super::servo(servo) }?;
        super::check(retired)?;
        // SAFETY: as the caller promises.
        unsafe { give(retired, retire(servo)) }
    })
}

/// Measurement mode: from positions where the axes stand (a touch probe, the scales) to the commands that
/// lead there, the correction taken out as far as it is in. Directions of travel, weights and auxiliary
/// inputs are those of the last update. `TRUEAXIS_RESULT_MOVING` while something is ramped or faded: then subtract
/// the correction of the period in question. Four evaluations. The arrays may be the same.
///
/// # Safety
/// The arrays have so many values; no other thread uses the servo.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_measured(
    servo: *const Servo,
    measured: *const f64,
    axes: usize,
    commands: *mut f64,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        super::check(commands)?;
        // SAFETY: as the caller promises.
        let from = unsafe { values(measured, axes) }?;
        let dq = servo.measured(from)?;
        let mut found = [0.0; crate::capacities::TRUEAXIS_AXES];
        for ((to, from), dq) in found.iter_mut().zip(from).zip(dq) {
            *to = from - f64::from(dq);
        }
        for (index, value) in found.into_iter().enumerate().take(axes) {
            // SAFETY: the caller has room for so many values.
            unsafe { commands.add(index).write(value) };
        }
        Ok(())
    })
}

/// What held in the last period.
///
/// # Safety
/// No other thread uses it; `status` has room.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_status(
    servo: *const Servo,
    status: *mut StatusFacts,
) -> Code {
    // SAFETY: as the caller promises.
    guarded(|| unsafe { give(status, servo_to_read(servo)?.status()) })
}

/// The corrections of the last period as computed, within the value bounds, before the common factor,
/// travel and rate bounds: what a dry run would give.
///
/// # Safety
/// No other thread uses it; `computed` has room for so many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_computed(
    servo: *const Servo,
    computed: *mut f64,
    axes: usize,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        // SAFETY: as the caller promises.
        unsafe { give_values(computed, axes, &servo.computed()) }
    })
}

/// How fast the corrections changed in the last period, mm/s and degrees/s: to be added to the velocity
/// where drives take one as feed-forward.
///
/// # Safety
/// No other thread uses it; `velocity` has room for so many values.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trueaxis_servo_velocity(
    servo: *const Servo,
    velocity: *mut f64,
    axes: usize,
) -> Code {
    guarded(|| {
        // SAFETY: as the caller promises.
        let servo = unsafe { servo_to_read(servo) }?;
        servo.check(axes)?;
        // SAFETY: as the caller promises.
        unsafe { give_values(velocity, axes, &servo.velocity()) }
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
    // SAFETY: as the caller promises.
    guarded_length(|| unsafe {
        give_text(text, size, |text| {
            for (place, name) in Conditions(conditions).names().enumerate() {
                if place > 0 {
                    text.push(", ");
                }
                text.push(name);
            }
        })
    })
}
