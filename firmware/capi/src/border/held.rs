//! A servo's hold on tables.

use crate::capacities::TRUEAXIS_AXES;
use crate::code::Code;
use crate::facts::Evaluate;
use crate::{Room, Tables};
use core::ptr::NonNull;
use trueaxis::{Compensation, Handle, Inputs, Travel, Travelling, Weights};

/// A hold on tables: they cannot be loaded until it is dropped.
pub struct Held {
    tables: NonNull<Tables>,
    /// Computes the corrections instead of the tables.
    evaluate: Option<Evaluate>,
}

impl Held {
    /// Takes hold of tables that are loaded and that no servo holds.
    ///
    /// # Safety
    /// Null, or memory for tables that outlives this.
    pub(super) unsafe fn new(pointer: *mut Tables) -> Result<Self, Code> {
        // SAFETY: guaranteed by the caller.
        let held = unsafe { super::tables(pointer) }?;
        held.hold()?;
        // The original pointer: the caller may load through it once it is returned.
        let tables = NonNull::new(pointer).ok_or(Code::NullPointer)?;
        let evaluate = held.evaluate();
        Ok(Self { tables, evaluate })
    }

    /// A second hold on tables that the servo holds; must not be dropped.
    pub(super) fn again(&self) -> core::mem::ManuallyDrop<Self> {
        core::mem::ManuallyDrop::new(Self { ..*self })
    }

    /// Address of the tables.
    pub(super) fn pointer(&self) -> *mut Tables {
        self.tables.as_ptr()
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: as in `get`.
        unsafe { self.tables.as_ref() }.release();
    }
}

impl Handle for Held {
    type Room = Room;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, Room> {
        // SAFETY: the creator guaranteed that they stay there, and held tables are never written.
        unsafe { self.tables.as_ref() }.held()
    }

    #[inline(always)]
    fn evaluate_into(
        &self,
        inputs: &Inputs<[f32; TRUEAXIS_AXES]>,
        travel: &Travelling<[Travel; TRUEAXIS_AXES]>,
        weights: &Weights,
        corrections: &mut [f32; TRUEAXIS_AXES],
    ) {
        match self.evaluate {
            None => (self.get()).evaluate_into(inputs, travel, weights, corrections),
            Some(evaluate) => generated_code(evaluate, inputs, travel, weights, corrections),
        }
    }
}

/// Calls generated code: the only call through a pointer.
#[inline(never)]
fn generated_code(
    evaluate: Evaluate,
    inputs: &Inputs<[f32; TRUEAXIS_AXES]>,
    travel: &Travelling<[Travel; TRUEAXIS_AXES]>,
    weights: &Weights,
    corrections: &mut [f32; TRUEAXIS_AXES],
) {
    // SAFETY: whoever loaded the code guaranteed that it reads one value for each axis, auxiliary input and adjustable
    // term of its facts, and writes one for each axis. There are as many of each, or more; a direction is an `i8`.
    unsafe {
        evaluate(
            inputs.axes.as_ptr(),
            inputs.auxiliaries.as_ptr(),
            travel.0.as_ptr().cast(),
            weights.as_slice().as_ptr(),
            corrections.as_mut_ptr(),
        );
    }
}
