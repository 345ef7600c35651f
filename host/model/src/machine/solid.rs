//! Simple solids: what the check of collisions knows of a machine.

use trueaxis_kinematics::Htm;

/// A convex part of the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Solid {
    /// Name, for messages.
    pub name: String,
    /// What carries it.
    pub carrier: Carrier,
    /// Shape of the convex part.
    pub shape: SolidShape,
    /// Own frame, at its centre, in the frame of its carrier (mm, rad).
    pub place: Htm,
}

/// What a solid is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carrier {
    /// The foundation frame.
    Foundation,
    /// The frame of an axis, which moves with it: its index in the machine.
    Axis(usize),
    /// The spindle frame; the solid does not turn with the spindle.
    Spindle,
    /// The workpiece frame.
    Workpiece,
}

/// A convex shape around the origin of its own frame (mm).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SolidShape {
    /// Half of its sizes along x, y and z.
    Box([f64; 3]),
    /// Around z.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Half of its length.
        half: f64,
    },
    /// All points this close to the centre.
    Sphere {
        /// Radius.
        radius: f64,
    },
    /// All points this close to a part of z.
    Capsule {
        /// Radius.
        radius: f64,
        /// Half of the distance between the centres of its ends.
        half: f64,
    },
}

impl SolidShape {
    /// Radius of the smallest sphere around the centre that contains it (mm).
    #[must_use]
    pub fn reach(&self) -> f64 {
        match *self {
            Self::Box([x, y, z]) => libm::hypot(libm::hypot(x, y), z),
            Self::Cylinder { radius, half } => libm::hypot(radius, half),
            Self::Sphere { radius } => radius,
            Self::Capsule { radius, half } => radius + half,
        }
    }
}
