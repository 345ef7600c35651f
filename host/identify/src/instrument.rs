//! Instruments: what each reads of the tool, and how that depends on its set-up.
//!
//! An instrument stands on the workpiece and observes a point of the tool or the tool's orientation; a part that was cut
//! shows where the tool was. Each kind is one
//! file with its reading from exact poses, and one line of [`Kind::instrument`]. All readings are in mm; angles are
//! read over [`LEVER`], so that 1 µrad counts as 1 µm.

mod angle;
mod displacement;
mod length;
mod point;
mod start;
mod surface;

use nalgebra::{Matrix3, Rotation3, Vector3};
use std::fmt;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::{Bench, Sense};
use trueaxis_model::kinematics::Htm;
use trueaxis_model::machine::{Machine, PerAxis};

/// The lever (mm) over which an angle counts as a length: 1 µrad as 1 µm.
pub const LEVER: f64 = 1000.0;

/// A kind of observation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Distance from a point of the workpiece to a point of the tool: ball-bar, telescoping bar, tracking
    /// interferometer.
    Length,
    /// A point of the tool in the frame of the instrument: R-test, tracker, photogrammetry.
    Point,
    /// Deviation of the tool from its command along one direction: laser, straightedge, square, dial.
    Displacement,
    /// Deviation of the tool's orientation from its command about one axis: angle interferometer, level, calibrator.
    Angle,
    /// Deviation of a surface of a part along its normal: a part that the machine has cut, on a measuring machine.
    Surface,
}

/// How an instrument is set up. Each kind uses some of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// Place in the workpiece frame (mm).
    pub place: Vector3<f64>,
    /// Orientation: a rotation matrix.
    pub turn: Matrix3<f64>,
    /// Length (mm) that its readings lack; of a part, by how much the radius of its tool is too large.
    pub length: f64,
}

impl Default for Setting {
    fn default() -> Self {
        Self {
            place: Vector3::zeros(),
            turn: Matrix3::identity(),
            length: 0.0,
        }
    }
}

/// One unknown of a [`Setting`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum SettingPart {
    /// A coordinate (0, 1, 2) of its place (mm).
    Place(usize),
    /// A rotation (rad) about an axis (0, 1, 2), added to its orientation.
    Turn(usize),
    /// Length (mm).
    Length,
    /// The radius of the tool that cut a part, in excess of the program's (mm).
    Radius,
}

impl SettingPart {
    /// The size of a change of it by 1 rad (mm), or 1.
    fn lever(self) -> f64 {
        match self {
            Self::Turn(_) => LEVER,
            _ => 1.0,
        }
    }
}

/// Where an instrument with a frame of its own stands.
const FRAME: [SettingPart; 6] = [
    SettingPart::Place(0),
    SettingPart::Place(1),
    SettingPart::Place(2),
    SettingPart::Turn(0),
    SettingPart::Turn(1),
    SettingPart::Turn(2),
];

impl fmt::Display for SettingPart {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let coordinate = |i: &usize| ["x", "y", "z"][*i];
        match self {
            Self::Place(i) => write!(f, "place in {}", coordinate(i)),
            Self::Turn(i) => write!(f, "rotation about {}", coordinate(i)),
            Self::Length => write!(f, "dead length"),
            Self::Radius => write!(f, "radius of the tool"),
        }
    }
}

impl Setting {
    /// With a part changed (mm or rad).
    #[must_use]
    pub fn moved(mut self, part: SettingPart, change: f64) -> Self {
        match part {
            SettingPart::Place(k) => self.place[k] += change,
            SettingPart::Turn(k) => {
                let turn = Rotation3::from_scaled_axis(Vector3::ith(k, change));
                self.turn = turn.matrix() * self.turn;
            }
            SettingPart::Length | SettingPart::Radius => self.length += change,
        }
        self
    }
}

/// What was commanded, as far as readings depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Commanded {
    /// Nominal position of the tool point (mm, workpiece frame).
    pub point: Vector3<f64>,
    /// Like `point`, less that of the first observation with this set-up.
    pub travel: Vector3<f64>,
    /// Orthonormal directions of the linear axes (workpiece frame): the frame in which a direction of reading turns.
    pub ways: Matrix3<f64>,
    /// Direction along or about which a growing reading means that the tool has gone too far (workpiece frame).
    ///
    /// Of a [`Kind::Surface`] this is its normal, and both are in the coordinates of the part.
    pub along: Vector3<f64>,
    nominal: Matrix3<f64>,
}

impl Commanded {
    /// [`Self::along`] in the frame of the tool.
    pub(crate) fn about_tool(&self) -> Vector3<f64> {
        self.nominal.tr_mul(&self.along)
    }

    /// For a command `q` (mm, rad) with the tool point at `tip` (mm, spindle frame) turned by the spindle, and the
    /// direction of the reading with its sign.
    #[must_use]
    pub fn at(
        machine: &Machine,
        q: &PerAxis,
        tip: &Vector3<f64>,
        reads: Option<(Sense, f64)>,
    ) -> Self {
        let perfect = ErrorModel::perfect(machine);
        let bench = Bench::new(machine, &perfect, Default::default());
        let pose = bench.nominal(q);
        let along = reads.map_or(Vector3::zeros(), |(sense, sign)| {
            sign * match sense {
                Sense::In(axis) => bench.way(q, axis),
                Sense::About(axis) => bench.about(q, axis),
                Sense::From(a, b) => bench.way(q, a).cross(&bench.way(q, b)).normalize(),
            }
        });
        Self {
            point: pose.r * (tip - Vector3::from(machine.tip)) + pose.t,
            travel: Vector3::zeros(),
            ways: ways(&bench, q),
            along,
            nominal: pose.r,
        }
    }

    /// What an instrument sees of the actual tool, whose pose is given as by
    /// [`Kinematics::actual`](trueaxis_kinematics::Kinematics::actual).
    #[must_use]
    pub fn seen(&self, machine: &Machine, actual: &Htm, tip: &Vector3<f64>) -> Seen {
        let point = actual.r * (tip - Vector3::from(machine.tip)) + actual.t;
        self.seen_at(point, &actual.r)
    }

    /// Like `seen`, for a point (mm) and an orientation of the actual tool in the workpiece frame.
    #[must_use]
    pub(crate) fn seen_at(&self, point: Vector3<f64>, orientation: &Matrix3<f64>) -> Seen {
        Seen {
            point,
            turn: orientation * self.nominal.transpose(),
        }
    }

    /// Like `seen_at`, on a machine without errors.
    fn seen_nominally(&self) -> Seen {
        Seen {
            point: self.point,
            turn: Matrix3::identity(),
        }
    }
}

/// Rotation of the tool in the spindle frame by a spindle angle (deg).
pub fn turned(tool_axis: usize, degrees: f64) -> Matrix3<f64> {
    *Rotation3::from_axis_angle(&Vector3::ith_axis(tool_axis), degrees.to_radians()).matrix()
}

/// An orthonormal frame along the first three linear axes in the order of their letters; that of the workpiece if
/// they do not span space.
fn ways(bench: &Bench<'_>, q: &PerAxis) -> Matrix3<f64> {
    let mut linear: Vec<usize> = bench.linear().take(3).collect();
    linear.sort_by_key(|i| bench.machine.axes[*i].letter.component());
    let all: Vec<Vector3<f64>> = linear.into_iter().map(|i| bench.way(q, i)).collect();
    let [x, y, _] = all[..] else {
        return Matrix3::identity();
    };
    let y = (y - x * x.dot(&y)).try_normalize(1e-3);
    y.map_or(Matrix3::identity(), |y| {
        Matrix3::from_columns(&[x, y, x.cross(&y)])
    })
}

/// What there is to see of the tool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Point (mm, workpiece frame).
    pub point: Vector3<f64>,
    /// Rotation in excess of the commanded one (workpiece frame).
    pub turn: Matrix3<f64>,
}

/// One observation on a machine without errors, for a first set-up.
pub struct InitialSample {
    /// What was commanded.
    pub commanded: Commanded,
    /// What was read (mm).
    pub read: Vector3<f64>,
}

/// What is known about a set-up beforehand; what is `None` is found from the readings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SetupPriors {
    /// Place (mm, workpiece frame).
    pub place: Option<Vector3<f64>>,
    /// Orientation, and the standard uncertainty of each rotation (rad) if it is known.
    pub turn: Option<Matrix3<f64>>,
    /// See there.
    pub turn_sigma: Option<f64>,
    /// Dead length (mm), and the standard uncertainty of that (mm) if it was calibrated.
    pub length: Option<f64>,
    /// See there.
    pub length_sigma: Option<f64>,
}

impl SetupPriors {
    /// The standard uncertainty of a part (mm or rad), if it is known beforehand.
    #[must_use]
    pub fn sigma(&self, part: SettingPart) -> Option<f64> {
        match part {
            SettingPart::Place(_) | SettingPart::Radius => None,
            SettingPart::Turn(_) => self.turn_sigma,
            SettingPart::Length => self.length_sigma,
        }
    }

    /// The set-up as stated, with defaults.
    #[must_use]
    pub fn setting(&self) -> Setting {
        let usual = Setting::default();
        Setting {
            place: self.place.unwrap_or(usual.place),
            turn: self.turn.unwrap_or(usual.turn),
            length: self.length.unwrap_or(usual.length),
        }
    }
}

/// The reading of a kind of instrument, and its derivatives. A scalar is the first component; the others are 0.
pub trait Instrument: Sync {
    /// Unknowns, in order of preference where several have the same effect.
    fn parts(&self) -> &'static [SettingPart];

    /// The reading (mm).
    fn reads(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Vector3<f64>;

    /// Derivative with respect to the tool point: mm per mm.
    fn by_point(&self, commanded: &Commanded, setting: &Setting, seen: &Seen) -> Matrix3<f64>;

    /// The axis about which it reads a rotation of the tool, if it does: [`LEVER`] mm per rad.
    fn about(&self, _commanded: &Commanded) -> Option<Vector3<f64>> {
        None
    }

    /// The axis about which a rotation of the set-up turns.
    fn turn_axis(&self, _commanded: &Commanded, k: usize) -> Vector3<f64> {
        Vector3::ith(k, 1.0)
    }
    /// Derivative with respect to a part of the set-up: mm per mm or rad. Moving the set-up is moving the tool the other way.
    fn by_part(
        &self,
        commanded: &Commanded,
        setting: &Setting,
        seen: &Seen,
        part: SettingPart,
    ) -> Vector3<f64> {
        let by_point = self.by_point(commanded, setting, seen);
        match part {
            SettingPart::Place(k) => -by_point.column(k),
            SettingPart::Turn(k) => {
                let axis = self.turn_axis(commanded, k);
                let about = self.about(commanded).map_or(0.0, |m| LEVER * m.dot(&axis));
                -by_point * axis.cross(&(seen.point - setting.place)) - Vector3::x() * about
            }
            SettingPart::Length | SettingPart::Radius => -Vector3::x(),
        }
    }
    /// A first set-up, from what is given and from readings of a machine without errors.
    fn start(&self, given: &SetupPriors, _samples: &[InitialSample]) -> Setting {
        given.setting()
    }
}

/// The derivative of a scalar that grows along a direction.
fn along(direction: &Vector3<f64>) -> Matrix3<f64> {
    Vector3::x() * direction.transpose()
}

impl Kind {
    /// Every kind.
    pub const ALL: [Self; 5] = [
        Self::Length,
        Self::Point,
        Self::Displacement,
        Self::Angle,
        Self::Surface,
    ];

    /// Reading.
    #[must_use]
    pub fn instrument(self) -> &'static dyn Instrument {
        match self {
            Self::Length => &length::LengthReading,
            Self::Point => &point::Point,
            Self::Displacement => &displacement::Displacement,
            Self::Angle => &angle::Angle,
            Self::Surface => &surface::Surface,
        }
    }

    /// Name in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Length => "length",
            Self::Point => "point",
            Self::Displacement => "displacement",
            Self::Angle => "angle",
            Self::Surface => "surface",
        }
    }

    /// Name with an article.
    #[must_use]
    pub fn one(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Point => "a point",
            Self::Displacement => "a displacement",
            Self::Angle => "an angle",
            Self::Surface => "a surface",
        }
    }

    /// The columns of its reading in files, and the size of their unit in mm.
    #[must_use]
    pub fn columns(self) -> (&'static [&'static str], f64) {
        match self {
            Self::Length => (&["length_mm"], 1.0),
            Self::Point => (&["x_mm", "y_mm", "z_mm"], 1.0),
            Self::Displacement => (&["displacement_um"], 1e-3),
            Self::Angle => (&["angle_urad"], 1e-6 * LEVER),
            Self::Surface => (&["deviation_um"], 1e-3),
        }
    }

    /// Number of coordinates of a reading.
    #[must_use]
    pub fn dimension(self) -> usize {
        self.columns().0.len()
    }

    /// True if it reads along or about a direction that a file must name.
    #[must_use]
    pub(crate) fn has_direction(self) -> bool {
        matches!(self, Self::Displacement | Self::Angle)
    }

    /// The column of its standard uncertainty in files.
    #[must_use]
    pub fn sigma(self) -> &'static str {
        match self {
            Self::Angle => "sigma_urad",
            _ => "sigma_um",
        }
    }

    /// The unit in which its residuals are shown: µm, or µrad for angles.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Angle => "µrad",
            _ => "µm",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Something of everything, far from any symmetry.
    fn case(kind: Kind) -> (Commanded, Setting, Seen) {
        let turn =
            |x: f64, y: f64, z: f64| *Rotation3::from_scaled_axis(Vector3::new(x, y, z)).matrix();
        let commanded = Commanded {
            point: Vector3::new(120.0, -50.0, 80.0),
            travel: Vector3::new(40.0, 10.0, -30.0),
            ways: turn(0.2, -0.4, 0.7),
            along: Vector3::new(2.0, -1.0, 0.5).normalize(),
            nominal: turn(0.5, 0.1, 0.3),
        };
        let setting = Setting {
            place: Vector3::new(-30.0, 20.0, 10.0),
            // The twist that an angle reads has derivatives that are exact at zero only.
            turn: match kind {
                Kind::Angle => Matrix3::identity(),
                _ => turn(0.3, 0.2, -0.6),
            },
            length: 7.0,
        };
        let seen = Seen {
            point: Vector3::new(120.3, -50.2, 80.1),
            turn: Matrix3::identity(),
        };
        (commanded, setting, seen)
    }

    #[test]
    fn derivatives_are_those_of_the_reading() {
        let h = 1e-4;
        for kind in Kind::ALL {
            let (commanded, setting, seen) = case(kind);
            let instrument = kind.instrument();
            // Central differences: h² of third derivatives, and rounding of 1e-13 over 2 h. Angles are over a metre.
            let near = |exact: Vector3<f64>, ahead: Vector3<f64>, behind: Vector3<f64>| {
                let numeric = (ahead - behind) / (2.0 * h);
                let off = (exact - numeric).norm();
                assert!(
                    off < 1e-5 * (1.0 + exact.norm()),
                    "{kind:?}: {exact} {numeric}"
                );
            };
            for part in instrument.parts() {
                let at = |change: f64| {
                    instrument.reads(&commanded, &setting.moved(*part, change), &seen)
                };
                let exact = instrument.by_part(&commanded, &setting, &seen, *part);
                near(exact, at(h), at(-h));
            }
            let by_point = instrument.by_point(&commanded, &setting, &seen);
            for k in 0..3 {
                let at = |change: f64| {
                    let mut seen = seen;
                    seen.point[k] += change;
                    instrument.reads(&commanded, &setting, &seen)
                };
                near(by_point.column(k).into(), at(h), at(-h));
                let turned = |change: f64| {
                    let turn = Rotation3::from_scaled_axis(Vector3::ith(k, change));
                    let turn = turn.matrix() * seen.turn;
                    instrument.reads(&commanded, &setting, &Seen { turn, ..seen })
                };
                let about = instrument.about(&commanded).unwrap_or_default();
                near(
                    Vector3::new(about[k] * LEVER, 0.0, 0.0),
                    turned(h),
                    turned(-h),
                );
            }
        }
    }
}
