//! A servo is constructed in place, because it is larger than a stack frame should be.

use core::mem::MaybeUninit;

use super::lane::{Common, Lane};
use super::state::{Fading, Following, Servo, Values, Waiting};
use crate::description::AUXILIARIES;
use crate::handle::Handle;
use crate::inputs::{Inputs, Travelling};
use crate::lag::Follower;
use crate::pace::Pace;
use crate::ramp::Ramp;
use crate::room::{List, Room, Row};
use crate::status::{Conditions, Correction, Status};

/// Writes every field of a structure in turn; a missing one is a compile error.
macro_rules! write_fields {
    ($place:expr, $type:path { $($field:ident: $value:expr,)* }) => {{
        let _all = |whole: Self| {
            let $type { $($field: _,)* } = whole;
        };
        let place: *mut Self = $place;
        $(
            let value = $value;
            // SAFETY: the place has room for all fields.
            unsafe { (&raw mut (*place).$field).write(value) };
        )*
    }};
}

impl<H: Handle> Servo<H> {
    /// A disabled servo with all corrections zero.
    #[must_use]
    pub fn new(handle: H) -> Self {
        let mut place = MaybeUninit::uninit();
        Self::new_in(&mut place, handle);
        // SAFETY: `new_in` has written all of it.
        unsafe { place.assume_init() }
    }

    /// Like [`new`](Self::new), but in a permanent place: a servo takes about 2 kB, which then need not be on the
    /// stack.
    pub fn new_in(place: &mut MaybeUninit<Self>, handle: H) -> &mut Self {
        let weights = handle.get().weights();
        let zeros = Values::<H>::all(0.0);
        write_fields!(
            place.as_mut_ptr(),
            Servo {
                current: handle,
                weights: weights,
                other: None,
                waiting: Waiting::Nothing,
                fading: Fading::Nothing,
                beyond: false,
                bad_temperatures: 0,
                followed: [0.0; AUXILIARIES],
                followers: [Follower::NEW; AUXILIARIES],
                coming_auxiliaries: [0.0; AUXILIARIES],
                coming: weights,
                wanted: weights,
                switches: Conditions::DISABLED,
                factor: Ramp::ZERO,
                factor_pace: Pace::rising(1.0),
                blend: Ramp::ZERO,
                blend_pace: Pace::rising(1.0),
                lanes: <H::Room as Room>::AxisList::EMPTY,
                inputs: Inputs::at(zeros),
                travelling: Travelling::default(),
                correction: Correction {
                    dq: zeros,
                    computed: zeros,
                    status: Status::default(),
                },
                before: zeros,
                at_rest: false,
                // Until the first usable inputs.
                following: Following::Frozen,
                fault: 0.0,
                referenced: 0,
                common: Common::STILL,
            }
        );
        // SAFETY: all fields are written.
        let servo = unsafe { place.assume_init_mut() };
        servo.restart();
        servo
    }

    /// Begins again as after [`new`](Self::new), for a controller whose positions are set anew while nothing moves (after
    /// homing): every correction is zero at once, no axis is referenced, no direction of travel is known. What was
    /// switched on stays on, and so do the weights and the temperatures with their lags. A compensation or weights that
    /// were waiting are in use.
    pub fn restart(&mut self) {
        self.factor = Ramp::ZERO;
        self.take_at_zero();
        let zeros = Values::<H>::all(0.0);
        self.correction = Correction {
            dq: zeros,
            computed: zeros,
            status: Status::default(),
        };
        self.before = zeros;
        self.blend = Ramp::ZERO;
        self.inputs = Inputs::at(zeros);
        self.travelling = Travelling::default();
        self.at_rest = false;
        self.following = Following::Frozen;
        self.fault = 0.0;
        self.referenced = 0;
        self.common = Common::STILL;
        self.lanes = <H::Room as Room>::AxisList::EMPTY;
        for axis in 0..self.current.get().axes().len() {
            self.lanes.append(Lane::new(axis));
        }
        self.take_limits();
    }
}
