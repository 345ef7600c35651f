//! State that a servo keeps from period to period.

use super::lane::{Common, Lane};
use crate::description::AUXILIARIES;
use crate::handle::Handle;
use crate::inputs::{Inputs, Travel, Travelling};
use crate::lag::Follower;
use crate::pace::Pace;
use crate::ramp::Ramp;
use crate::room::Room;
use crate::status::{Conditions, Correction};
use crate::weights::Weights;

/// What is being faded in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Fading {
    Nothing,
    /// Weights or tool lengths of the compensation in use.
    Values,
    /// Another compensation.
    Compensation,
}

/// What waits to be faded in.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Waiting {
    Nothing,
    /// Weights of the compensation in use or of the one being faded in.
    Weights,
    /// Another compensation, with its weights.
    Compensation,
}

/// Whether the corrections follow the inputs.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Following {
    /// The corrections follow the inputs.
    Inputs,
    /// The corrections are those of the last usable inputs.
    Held,
    /// The corrections are held until the fade factor has reached 0.
    Frozen,
}

/// A number for each axis.
pub(super) type Values<H> = <<H as Handle>::Room as Room>::Axes<f32>;

/// A direction for each axis.
pub(super) type Travels<H> = <<H as Handle>::Room as Room>::Axes<Travel>;

/// One compensation in a control loop. See the head of `servo.rs` for the steps and their order.
///
/// `H` is how it holds compensations: by reference, or by an owning handle, which is returned when another compensation
/// has replaced it. That way a compensation can be reloaded in place while the servo runs:
///
/// ```
/// use trueaxis::{Compensation, Servo};
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/huron-13.trax");
/// # let blob: &'static [u8] = trueaxis::include_blob!(concat!(
/// #     env!("CARGO_MANIFEST_DIR"),
/// #     "/examples/huron-13.trax"
/// # ));
///
/// // Two places; on a controller they are statics.
/// let first: &'static mut _ = Box::leak(Box::new(Compensation::new()));
/// let second: &'static mut _ = Box::leak(Box::new(Compensation::new()));
/// first.load(blob)?;
/// second.load(blob)?;
/// let mut servo = Servo::new(first);
/// servo.swap(second)?;
/// # let commands = trueaxis::Inputs::default();
/// // In every servo period:
/// servo.update(&commands, 0b1_1111, 0.001);
/// // When the change is done the first place is back.
/// let vacant = servo.take_retired().expect("nothing had to be faded");
/// vacant.load(blob)?;
/// servo.swap(vacant)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
// In this order: what every update reads comes first, within the reach of load instructions.
#[repr(C)]
pub struct Servo<H: Handle> {
    pub(super) current: H,
    pub(super) common: Common,
    /// The axes that were referenced in the last period, bit 0 is the first.
    pub(super) referenced: u16,
    /// Nothing but positions can have changed since the last period, in which the corrections were fully in.
    pub(super) at_rest: bool,
    pub(super) following: Following,
    /// How long inputs have been unusable, s.
    pub(super) fault: f32,
    /// Correction of the last period.
    pub(super) correction: Correction<Values<H>>,
    /// Correction of the period before that.
    pub(super) before: Values<H>,
    /// One per axis.
    pub(super) lanes: <H::Room as Room>::AxisList<Lane>,
    /// Inputs of the computed correction: the positions of the last period that followed its inputs, and the
    /// auxiliaries adopted so far.
    pub(super) inputs: Inputs<Values<H>>,
    pub(super) travelling: Travelling<Travels<H>>,
    /// Weights in use; only their values matter.
    pub(super) weights: Weights,
    /// [`DISABLED`](crate::Conditions::DISABLED) and [`DRY_RUN`](crate::Conditions::DRY_RUN), as commanded.
    pub(super) switches: Conditions,
    /// s(t)
    pub(super) factor: Ramp,
    pub(super) factor_pace: Pace,
    /// f(t)
    pub(super) blend: Ramp,
    pub(super) blend_pace: Pace,
    /// While a compensation is waiting or being faded in, that one. Otherwise the one previously in use, until it is
    /// taken back.
    pub(super) other: Option<H>,
    pub(super) waiting: Waiting,
    pub(super) fading: Fading,
    /// The auxiliaries being faded in; temperatures are those in use.
    pub(super) coming_auxiliaries: [f32; AUXILIARIES],
    /// The weights being faded in; only their values matter.
    pub(super) coming: Weights,
    /// The weights requested last, for the compensation accepted last.
    pub(super) wanted: Weights,
    /// A temperature that matters is beyond its tables.
    pub(super) beyond: bool,
    /// Temperatures whose readings are faults, bit 0 is the first auxiliary.
    pub(super) bad_temperatures: u8,
    /// The temperatures as they are followed now.
    pub(super) followed: [f32; AUXILIARIES],
    /// How the temperatures are followed; all compensations of a servo share them.
    pub(super) followers: [Follower; AUXILIARIES],
}
