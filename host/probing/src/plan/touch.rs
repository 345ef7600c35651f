//! The geometry of touches.

use trueaxis_model::machine::PerAxis;

/// Number of touches per ball.
pub(crate) const PER_BALL: usize = 5;

/// Latitudes (rad) of the touches around a ball that qualify a probe: low and high, so that what differs at the pole can be
/// told from where the ball is.
const LOW: f64 = std::f64::consts::PI / 18.0;
const HIGH: f64 = std::f64::consts::PI / 4.0;

/// Latitude (rad) of four of them above the equator of the ball, seen from the spindle. At the equator only the
/// touch at the pole would determine the height of the ball, and an error of it would not be noticed.
const LATITUDE: f64 = std::f64::consts::PI / 6.0;

/// Geometry of the touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Distance from the ball centre to the stylus centre at contact (mm): the sum of both radii.
    pub radius: f64,
    /// Radius of the stylus tip (mm).
    pub stylus: f64,
    /// Distance from the ball at which a touch begins (mm).
    pub clearance: f64,
    /// Search distance beyond the nominal surface (mm).
    pub search: f64,
    /// Largest angle between the stylus and the direction in which a ball stands off the table (rad).
    pub cone: f64,
    /// Distance that solids on the tool's side keep from those on the workpiece's (mm).
    pub keep: f64,
    /// Touch each ball this many times at a low latitude, and half as often at a high one, besides the pole: to qualify the
    /// probe. 0: five touches, which find its centre.
    pub around: usize,
    /// Refuse rows whose touches bring the stylus too close to another ball; with solids or posts that are described, all
    /// that come too close to anything are refused anyhow.
    pub keeps_clear: bool,
}

impl Default for Probe {
    /// A ball of 20 mm and a stylus tip of 6 mm, touches from 5 mm before to 3 mm beyond the surface, and the stylus
    /// up to 60° from the direction in which the ball stands off the table.
    fn default() -> Self {
        Self {
            radius: 13.0,
            stylus: 3.0,
            clearance: 5.0,
            search: 3.0,
            cone: 60.0_f64.to_radians(),
            keep: 1.0,
            around: 0,
            keeps_clear: false,
        }
    }
}

/// A touch, as axis positions (mm, deg).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Beside the ball, at the height of the approach.
    pub over: PerAxis,
    /// Where the touch begins.
    pub begin: PerAxis,
    /// Where the touch ends if there is no contact.
    pub end: PerAxis,
}

/// The probing of one ball, as axis positions (mm, deg).
#[derive(Clone, Debug, PartialEq)]
pub struct Touching {
    /// With the stylus centre at the ball centre.
    pub centre: PerAxis,
    /// As far from the ball along the stylus as the travel allows; axes turn there.
    pub away: PerAxis,
    /// Above the pole, where the touches begin and end.
    pub above: PerAxis,
    /// The touches: at the pole, then around the tool axis.
    pub touches: Vec<Touch>,
}

impl Probe {
    /// Number of touches per ball.
    #[must_use]
    pub fn per_ball(&self) -> usize {
        self.directions().len()
    }

    /// Angle around the tool axis and latitude (rad) of each touch; the pole comes first.
    pub(super) fn directions(&self) -> Vec<[f64; 2]> {
        let ring = |count: usize, latitude: f64| {
            (0..count).map(move |k| {
                let turn = (k as f64 + 0.5) * std::f64::consts::TAU / count as f64;
                [turn, latitude]
            })
        };
        let pole = [[0.0, std::f64::consts::FRAC_PI_2]];
        match self.around {
            0 => (pole.into_iter())
                .chain(ring(PER_BALL - 1, LATITUDE))
                .collect(),
            around => (pole.into_iter())
                .chain(ring(around, LOW))
                .chain(ring(around.div_ceil(2), HIGH))
                .collect(),
        }
    }
}

impl Touching {
    pub(super) fn positions(&self) -> impl Iterator<Item = &PerAxis> {
        let touches = self.touches.iter();
        let of = touches.flat_map(|t| [&t.over, &t.begin, &t.end]);
        of.chain([&self.above, &self.centre])
    }
}
