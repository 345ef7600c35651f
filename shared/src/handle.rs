//! How a servo holds its compensations.

use crate::compensation::Compensation;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::room::{Room, Row};
use crate::weights::Weights;

type Axes<H, T> = <<H as Handle>::Room as Room>::Axes<T>;

/// A pointer to a compensation: a reference (`&Compensation`, `&'static mut Compensation`), a `Box` or an `Arc`
/// (feature `encode`, which needs a heap), a compensation itself, or a custom type, such as the lease of a pool.
///
/// It must always return the same compensation, with unchanged contents.
pub trait Handle {
    /// Capacities of the compensation.
    type Room: Room;

    /// The compensation.
    fn get(&self) -> &Compensation<'_, Self::Room>;

    /// Corrections, see [`Compensation::evaluate_into`]; [`Generated`] computes them by code of its own.
    #[inline(always)]
    fn evaluate_into(
        &self,
        inputs: &Inputs<Axes<Self, f32>>,
        travel: &Travelling<Axes<Self, Travel>>,
        weights: &Weights,
        corrections: &mut Axes<Self, f32>,
    ) {
        self.get()
            .evaluate_into(inputs, travel, weights, corrections);
    }

    /// The correction that belongs to a measured position, see [`Compensation::measured`].
    fn measured(
        &self,
        measured: &Inputs<Axes<Self, f32>>,
        travel: &Travelling<Axes<Self, Travel>>,
        weights: &Weights,
        steps: u32,
    ) -> Axes<Self, f32> {
        let mut at = *measured;
        let mut dq = Axes::<Self, f32>::all(0.0);
        self.evaluate_into(&at, travel, weights, &mut dq);
        for _ in 1..steps {
            let axes = at.axes.as_mut().iter_mut();
            for ((q, measured), dq) in axes.zip(measured.axes.as_ref()).zip(dq.as_ref()) {
                *q = measured - dq;
            }
            self.evaluate_into(&at, travel, weights, &mut dq);
        }
        dq
    }
}

impl<C: Room> Handle for Compensation<'_, C> {
    type Room = C;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, C> {
        self
    }
}

macro_rules! through {
    ($($pointer:ty)*) => {$(
        impl<H: Handle> Handle for $pointer {
            type Room = H::Room;

            #[inline(always)]
            fn get(&self) -> &Compensation<'_, H::Room> {
                (**self).get()
            }

            #[inline(always)]
            fn evaluate_into(
                &self,
                inputs: &Inputs<Axes<Self, f32>>,
                travel: &Travelling<Axes<Self, Travel>>,
                weights: &Weights,
                corrections: &mut Axes<Self, f32>,
            ) {
                (**self).evaluate_into(inputs, travel, weights, corrections);
            }
        }
    )*}
}

through!(&H &mut H);
#[cfg(feature = "encode")]
through!(alloc::boxed::Box<H> alloc::sync::Arc<H>);

/// A compensation that is evaluated by generated code (`trueaxis generate`), not by its tables.
///
/// The compensation has the axes, bounds, auxiliaries and weights, but no samples: `trueaxis generate --servo` writes it
/// into the same file as the code.
#[derive(Clone, Copy, Debug)]
pub struct Generated<H, F> {
    compensation: H,
    evaluate: F,
}

/// Generated code does not give the bits of its compensation: the compiler fused, reordered or rounded otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct OtherBits;

impl core::fmt::Display for OtherBits {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(
            "the generated code does not give the bits of its compensation: compile it without fused, reordered or wider \
             floating-point operations",
        )
    }
}

impl core::error::Error for OtherBits {}

impl<H: Handle, F> Generated<H, F>
where
    F: Fn(&Inputs<Axes<H, f32>>, &Travelling<Axes<H, Travel>>, &Weights, &mut Axes<H, f32>),
{
    /// Of both. `check` is the function of this name in the generated file.
    ///
    /// # Errors
    /// [`OtherBits`] if the check fails.
    pub fn new(compensation: H, evaluate: F, check: fn() -> bool) -> Result<Self, OtherBits> {
        match check() {
            true => Ok(Self {
                compensation,
                evaluate,
            }),
            false => Err(OtherBits),
        }
    }
}

impl<H: Handle, F> Handle for Generated<H, F>
where
    F: Fn(&Inputs<Axes<H, f32>>, &Travelling<Axes<H, Travel>>, &Weights, &mut Axes<H, f32>),
{
    type Room = H::Room;

    #[inline(always)]
    fn get(&self) -> &Compensation<'_, H::Room> {
        self.compensation.get()
    }

    #[inline(always)]
    fn evaluate_into(
        &self,
        inputs: &Inputs<Axes<H, f32>>,
        travel: &Travelling<Axes<H, Travel>>,
        weights: &Weights,
        corrections: &mut Axes<H, f32>,
    ) {
        (self.evaluate)(inputs, travel, weights, corrections);
    }
}
