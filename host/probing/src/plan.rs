//! Plans which balls to probe at which rotary positions: what a plan will identify, alone or with what instruments
//! read, a better plan, and its touches.
//!
//! Equations and identifiability are those of [`identify`](fn@trueaxis_identify::identify).

mod band;
mod candidates;
mod collision;
mod compare;
mod course;
mod design;
mod exchange;
mod expected;
mod judge;
mod order;
mod program;
mod remedy;
mod scene;
mod sets;
mod simulated;
mod step;
mod steps;
mod summary;
mod task;
mod touch;
mod touches;
mod validation;

pub use band::{Band, UncertaintySpread};
pub use candidates::{Allowed, AllowedError, Setup};
pub use collision::{Collision, collision};
pub use compare::{AsGood, Ratios, as_good_as};
pub use design::{Criterion, DesignError, WantedDesign, design, needs_spindle};
pub use expected::{NoPlace, expected};
pub use judge::{JudgeError, Judgement, judge, placed};
pub use program::{Feeds, linuxcnc, table};
pub use remedy::{Remedy, added, would_show};
pub use sets::{Set, SetError, SetPositions, positions};
pub use simulated::{simulated_touches, touch_log};
pub use step::{AxisTargets, ProbingStep};
pub use steps::{NotTouched, steps};
pub use summary::Summary;
pub use task::{PlanError, Planned, PlannedRows, Task};
pub(crate) use touch::PER_BALL;
pub use touch::{Probe, Touch, Touching};
pub use touches::{Unreachable, touching};
pub use validation::validation;
