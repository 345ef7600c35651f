//! Qualifies a touch probe: its effective tip radius by direction, and where its tip is, from touches on a ball.
//!
//! A probe trips after it has been deflected by its pre-travel, which depends on the direction from which it is touched.
//! What counts is the distance of the ball's centre from where the tip's centre is at that moment, less the radius of the
//! ball: the effective radius of the tip in that direction,
//!
//! ρ = r + p·sin²λ + cos λ · Σ (a_k·cos kφ + b_k·sin kφ), k = 2, 3, …
//!
//! where φ is the direction around the stylus and λ its height above the equator of the tip. Terms in sin λ, cos φ·cos λ and
//! sin φ·cos λ are those of another place of the tip, and are in it.

use crate::formats::probe::{Lobe, ProbeFile, Spherical};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::fmt;
use trueaxis_kinematics::Nominal;
use trueaxis_model::machine::{Machine, PerAxis};

/// What is known before.
#[derive(Clone, Debug, PartialEq)]
pub struct Known {
    /// Radius of the ball (mm).
    pub radius: f64,
    /// Its standard uncertainty (mm).
    pub radius_uncertainty: f64,
    /// Standard uncertainty of each coordinate of the ball's centre in the workpiece frame, and that centre (mm).
    pub place: Option<(Vector3<f64>, f64)>,
    /// Where the tip is about, in the spindle frame (mm).
    pub tip: Vector3<f64>,
    /// Highest order of the lobes.
    pub orders: usize,
}

/// An unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unknown {
    /// A coordinate of the ball's centre.
    Centre(usize),
    /// The radius r.
    Radius,
    /// A coordinate of the tip in the spindle frame (0, 1, 2 for x, y, z).
    Tip(usize),
    /// The term of the pole, p.
    Pole,
    /// A coefficient of an order: of the cosine, then of the sine.
    Lobe(usize, bool),
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |k: usize| ["x", "y", "z"][k];
        match *self {
            Self::Centre(k) => write!(f, "{} of the ball", name(k)),
            Self::Radius => f.write_str("the radius of the tip"),
            Self::Tip(k) => write!(f, "{} of the tip", name(k)),
            Self::Pole => f.write_str("what differs at the pole"),
            Self::Lobe(order, false) => write!(f, "the cosine of order {order}"),
            Self::Lobe(order, true) => write!(f, "the sine of order {order}"),
        }
    }
}

impl Unknown {
    /// Those that may stay at what they were taken for; balls have a place and a radius in any case.
    fn is_optional(self) -> bool {
        !matches!(self, Self::Centre(_) | Self::Radius)
    }
}

/// A qualified probe.
#[derive(Clone, Debug, PartialEq)]
pub struct Qualified {
    /// Values with their standard uncertainties.
    pub file: ProbeFile,
    /// Standard uncertainty of each coordinate of the tip (mm), from the noise of touches and what is known of the ball:
    /// errors of the rotary axes are not in it.
    pub tip_uncertainty: [Option<f64>; 3],
    /// Centre of the ball in the workpiece frame (mm).
    pub centre: Vector3<f64>,
    /// Standard deviation of a touch (mm).
    pub noise: f64,
    /// Number of touches.
    pub touches: usize,
    /// What the touches do not determine.
    pub undetermined: Vec<Unknown>,
    /// The touch that fits least, counted from 0, and what it is off (mm).
    pub worst: (usize, f64),
}

/// Why touches qualify nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QualifyError {
    /// Fewer than unknowns.
    #[error("{touches} touches are too few for {unknowns} unknowns")]
    TooFew {
        /// Their number.
        touches: usize,
        /// Number of unknowns that must be found, and one.
        unknowns: usize,
    },
    /// All in a plane, or the like.
    #[error("the touches do not show where the ball is: they are in a plane, or on one side of it")]
    NoSphere,
    /// No touch is where the ball can be.
    #[error("the touches are no part of a ball of {radius:.3} mm: one is off by {off:.3} mm")]
    NotTheBall {
        /// Radius of the ball and the tip (mm).
        radius: f64,
        /// The largest deviation (mm).
        off: f64,
    },
}

/// Largest number of Gauss–Newton steps, and the step (mm) at which they end.
const STEPS: usize = 40;
const STILL: f64 = 1e-10;
/// Singular values below this, with columns of length 1, count as zero, as in `identify`.
const ZERO: f64 = 1e-4;
/// A pre-travel is less than this (mm).
const OFF: f64 = 0.5;

/// Qualifies a probe from touches of one ball, with the spindle at 0: axis positions (mm, deg) on the nominal machine.
///
/// # Errors
/// [`QualifyError`].
pub fn qualify(
    machine: &Machine,
    known: &Known,
    touches: &[PerAxis],
) -> Result<Qualified, QualifyError> {
    let mut unknowns: Vec<Unknown> = (0..3).map(Unknown::Centre).collect();
    unknowns.push(Unknown::Radius);
    unknowns.extend((0..3).map(Unknown::Tip));
    unknowns.push(Unknown::Pole);
    for order in 2..=known.orders {
        unknowns.extend([Unknown::Lobe(order, false), Unknown::Lobe(order, true)]);
    }
    let mut fit = Fit::new(machine, known, touches, unknowns)?;
    let mut undetermined = Vec::new();
    loop {
        fit.solve()?;
        match fit.confounded()? {
            None => break,
            Some(unknown) => {
                fit.drop(unknown);
                undetermined.push(unknown);
            }
        }
    }
    undetermined.reverse();
    fit.qualified(undetermined)
}

/// Least squares of the distances.
struct Fit<'a> {
    machine: &'a Machine,
    known: &'a Known,
    /// Spindle in the workpiece frame at each touch.
    poses: Vec<(Matrix3<f64>, Vector3<f64>)>,
    unknowns: Vec<Unknown>,
    centre: Vector3<f64>,
    tip: Vector3<f64>,
    radius: f64,
    shape: Spherical,
}

impl<'a> Fit<'a> {
    fn new(
        machine: &'a Machine,
        known: &'a Known,
        touches: &[PerAxis],
        unknowns: Vec<Unknown>,
    ) -> Result<Self, QualifyError> {
        let nominal = Nominal::new(machine);
        let pose = |position: &PerAxis| {
            let carriers = nominal.carriers(&machine.to_kinematic(position));
            let spindle = carriers.workpiece.inverse() * carriers.spindle;
            (spindle.r, spindle.t)
        };
        let poses: Vec<_> = touches.iter().map(pose).collect();
        let least = unknowns.iter().filter(|u| !u.is_optional()).count() + 1;
        if touches.len() < least {
            return Err(QualifyError::TooFew {
                touches: touches.len(),
                unknowns: least,
            });
        }
        let points: Vec<Vector3<f64>> = poses.iter().map(|(r, t)| r * known.tip + t).collect();
        let (centre, radius) = crate::spheres::start(&points).ok_or(QualifyError::NoSphere)?;
        Ok(Self {
            machine,
            known,
            poses,
            unknowns,
            centre: known.place.map_or(centre, |(place, _)| place),
            tip: known.tip,
            radius: (radius - known.radius).max(0.0),
            shape: Spherical::default(),
        })
    }

    /// Residuals (mm) and their derivatives, touch by touch; then what is known of the place, in units of the noise.
    fn equations(&self, noise: f64) -> (DVector<f64>, DMatrix<f64>) {
        let stated = self.known.place;
        let rows = self.poses.len() + stated.map_or(0, |_| 3);
        let mut left = DVector::zeros(rows);
        let mut by = DMatrix::zeros(rows, self.unknowns.len());
        for (i, (r, t)) in self.poses.iter().enumerate() {
            let way = r * self.tip + t - self.centre;
            let out = way.normalize();
            let own = r.transpose() * out;
            let [around, height] = Spherical::direction(self.machine, &self.tip, &own);
            left[i] =
                way.norm() - self.known.radius - self.radius - self.shape.deviation(around, height);
            for (j, unknown) in self.unknowns.iter().enumerate() {
                by[(i, j)] = match *unknown {
                    Unknown::Centre(k) => -out[k],
                    Unknown::Radius => -1.0,
                    Unknown::Tip(k) => own[k],
                    Unknown::Pole => -height.sin().powi(2),
                    Unknown::Lobe(order, is_sine) => {
                        let angle = order as f64 * around;
                        -height.cos() * if is_sine { angle.sin() } else { angle.cos() }
                    }
                };
            }
        }
        if let Some((place, uncertainty)) = stated {
            let weight = noise / uncertainty;
            for k in 0..3 {
                let row = self.poses.len() + k;
                left[row] = (self.centre[k] - place[k]) * weight;
                for (j, unknown) in self.unknowns.iter().enumerate() {
                    by[(row, j)] = f64::from(u8::from(*unknown == Unknown::Centre(k))) * weight;
                }
            }
        }
        (left, by)
    }

    /// What is added to the unknowns.
    fn add(&mut self, step: &DVector<f64>) {
        for (unknown, step) in self.unknowns.iter().zip(step.iter()) {
            match *unknown {
                Unknown::Centre(k) => self.centre[k] += step,
                Unknown::Radius => self.radius += step,
                Unknown::Tip(k) => self.tip[k] += step,
                Unknown::Pole => self.shape.pole += step,
                Unknown::Lobe(order, is_sine) => {
                    let lobe = self.shape.lobe(order);
                    *(if is_sine {
                        &mut lobe.sine
                    } else {
                        &mut lobe.cosine
                    }) += step;
                }
            }
        }
    }

    /// Smallest changes that fit, from the nominal ones.
    fn solve(&mut self) -> Result<(), QualifyError> {
        let mut noise = USUAL;
        for _ in 0..STEPS {
            let (left, by) = self.equations(noise);
            let svd = by.svd(true, true);
            let largest = svd.singular_values.max();
            let step = svd.solve(&-&left, ZERO * largest);
            let step = step.map_err(|_| QualifyError::NoSphere)?;
            if step.iter().any(|v| !v.is_finite()) || step.norm() > FAR {
                return Err(QualifyError::NoSphere);
            }
            self.add(&step);
            noise = self.noise().max(LEAST);
            if step.norm() < STILL {
                break;
            }
        }
        let (left, _) = self.equations(noise);
        let off = left.rows(0, self.poses.len()).amax();
        match off > OFF {
            true => Err(QualifyError::NotTheBall {
                radius: self.known.radius + self.radius,
                off,
            }),
            false => Ok(()),
        }
    }

    /// Standard deviation of a touch (mm).
    fn noise(&self) -> f64 {
        let (left, by) = self.equations(USUAL);
        let touches = self.poses.len();
        let free = (by.nrows().saturating_sub(by.ncols())).max(1);
        (left.rows(0, touches).norm_squared() / free as f64).sqrt()
    }

    /// An unknown that cannot be told from others, of those that may stay as they are: the one that has most of it, a
    /// high order before a low one.
    fn confounded(&self) -> Result<Option<Unknown>, QualifyError> {
        let (_, mut by) = self.equations(self.noise().max(LEAST));
        if by.nrows() < by.ncols() {
            let last = self.unknowns.iter().rev().find(|u| u.is_optional());
            return Ok(last.copied());
        }
        for mut column in by.column_iter_mut() {
            let length = column.norm();
            if length > 0.0 {
                column /= length;
            }
        }
        let svd = by.svd(false, true);
        let Some(ways) = svd.v_t else { return Ok(None) };
        let (least, value) = svd.singular_values.argmin();
        if value > ZERO {
            return Ok(None);
        }
        let way = ways.row(least);
        let optional = (0..self.unknowns.len()).filter(|i| self.unknowns[*i].is_optional());
        let most = optional.max_by(|a, b| {
            (way[*a].abs() + TIE * *a as f64).total_cmp(&(way[*b].abs() + TIE * *b as f64))
        });
        match most.filter(|i| way[*i].abs() > ZERO) {
            Some(most) => Ok(Some(self.unknowns[most])),
            None => Err(QualifyError::NoSphere),
        }
    }

    /// Goes on without an unknown, which is what it was taken for.
    fn drop(&mut self, unknown: Unknown) {
        self.unknowns.retain(|u| *u != unknown);
        self.tip = self.known.tip;
        self.shape = Spherical::default();
    }

    fn qualified(mut self, undetermined: Vec<Unknown>) -> Result<Qualified, QualifyError> {
        let noise = self.noise();
        let (left, by) = self.equations(noise.max(LEAST));
        if by.nrows() <= by.ncols() {
            return Err(QualifyError::TooFew {
                touches: self.poses.len(),
                unknowns: by.ncols() + 1,
            });
        }
        let inverse = (by.transpose() * &by).try_inverse();
        let inverse = inverse.ok_or(QualifyError::NoSphere)?;
        let of = |unknown: Unknown| -> Option<f64> {
            let column = self.unknowns.iter().position(|u| *u == unknown)?;
            Some(noise * inverse[(column, column)].max(0.0).sqrt())
        };
        let worst = left.rows(0, self.poses.len()).icamax();
        let lobes = (2..=self.known.orders).filter_map(|order| {
            let [cosine, sine] = [false, true].map(|is_sine| of(Unknown::Lobe(order, is_sine)));
            let found = self.shape.lobes.iter().find(|lobe| lobe.order == order)?;
            (cosine.is_some() || sine.is_some()).then(|| Lobe {
                uncertainty: cosine.unwrap_or(0.0).max(sine.unwrap_or(0.0)),
                ..*found
            })
        });
        let lobes: Vec<Lobe> = lobes.collect();
        let tip_uncertainty = std::array::from_fn(|k| of(Unknown::Tip(k)));
        let file = ProbeFile {
            machine: self.machine.name.clone(),
            radius: self.radius,
            radius_uncertainty: of(Unknown::Radius)
                .unwrap_or(0.0)
                .hypot(self.known.radius_uncertainty),
            tip: std::array::from_fn(|k| tip_uncertainty[k].map(|_| self.tip[k])),
            tip_uncertainty: std::array::from_fn(|k| {
                self.known.place.and_then(|_| tip_uncertainty[k])
            }),
            pole_uncertainty: of(Unknown::Pole).unwrap_or(0.0),
            shape: {
                self.shape.lobes = lobes;
                self.shape
            },
        };
        Ok(Qualified {
            tip_uncertainty,
            centre: self.centre,
            noise,
            touches: self.poses.len(),
            worst: (worst, left[worst]),
            file,
            undetermined,
        })
    }
}

/// Noise (mm) that is expected before it is known, and the least: probes repeat to 0.1 µm at best.
const USUAL: f64 = 1e-3;
const LEAST: f64 = 1e-4;
/// No step is as long (mm).
const FAR: f64 = 1e3;
/// Of equal ones the last is chosen.
const TIE: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::normal;
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    const BALL: f64 = 10.0;
    const NOISE: f64 = 5e-4;

    /// Table A and C, spindle on X, Y, Z.
    fn machine() -> Machine {
        let axis = |name: &str, branch: &str| {
            format!("[[axis]]\nname = \"{name}\"\nbranch = \"{branch}\"\nrange = [-300.0, 300.0]\n")
        };
        let text = format!(
            "name = \"m\"\n{}{}{}{}{}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -100.0]\n",
            axis("A", "workpiece"),
            axis("C", "workpiece"),
            axis("X", "tool"),
            axis("Y", "tool"),
            axis("Z", "tool"),
        );
        Machine::from_toml(&text).unwrap()
    }

    struct Truth {
        tip: Vector3<f64>,
        centre: Vector3<f64>,
        radius: f64,
        shape: Spherical,
    }

    fn truth() -> Truth {
        let lobe = |order, cosine, sine| Lobe {
            order,
            cosine,
            sine,
            uncertainty: 0.0,
        };
        Truth {
            tip: Vector3::new(0.021, -0.013, -100.34),
            centre: Vector3::new(60.2, 20.1, 30.3),
            radius: 2.987,
            shape: Spherical {
                pole: -0.006,
                lobes: vec![lobe(2, 5e-4, 0.0), lobe(3, 4e-3, -2e-3)],
            },
        }
    }

    /// Touches of a ball at positions of A and C, at latitudes (deg), with 12 directions around; the linear axes are where
    /// the tip is at its effective radius from the ball.
    fn touches(
        truth: &Truth,
        positions: &[[f64; 2]],
        latitudes: &[f64],
        noise: f64,
        seed: u64,
    ) -> Vec<PerAxis> {
        let machine = machine();
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut all = Vec::new();
        for [a, c] in positions {
            let at = [*a, *c, 0.0, 0.0, 0.0, 0.0];
            let q = machine.to_kinematic(&at);
            let carriers = Nominal::new(&machine).carriers(&q);
            // The spindle does not turn, so that directions in its frame are those of the foundation.
            let place = carriers.workpiece.r * truth.centre + carriers.workpiece.t;
            for latitude in latitudes {
                let count = if *latitude == 90.0 { 1 } else { 12 };
                for k in 0..count {
                    let around = k as f64 * std::f64::consts::TAU / f64::from(count);
                    let height = latitude.to_radians();
                    let out = Vector3::new(
                        height.cos() * around.cos(),
                        height.cos() * around.sin(),
                        height.sin(),
                    );
                    let distance = BALL
                        + truth.radius
                        + truth.shape.deviation(around, height)
                        + noise * normal(&mut random);
                    let spindle = place + out * distance - truth.tip;
                    all.push([*a, *c, spindle.x, spindle.y, spindle.z, 0.0]);
                }
            }
        }
        all
    }

    fn known() -> Known {
        Known {
            radius: BALL,
            radius_uncertainty: 0.0,
            place: None,
            tip: Vector3::new(0.0, 0.0, -100.0),
            orders: 4,
        }
    }

    const SEVERAL: [[f64; 2]; 3] = [[0.0, 0.0], [40.0, 0.0], [0.0, 120.0]];
    const LATITUDES: [f64; 3] = [90.0, 10.0, 45.0];

    fn pairs(found: &Qualified, truth: &Truth) -> Vec<(String, f64, f64)> {
        let file = &found.file;
        let mut pairs = vec![
            (
                "radius".to_owned(),
                file.radius - truth.radius,
                file.radius_uncertainty,
            ),
            (
                "pole".to_owned(),
                file.shape.pole - truth.shape.pole,
                file.pole_uncertainty,
            ),
        ];
        for k in 0..3 {
            if let (Some(tip), Some(uncertainty)) = (file.tip[k], found.tip_uncertainty[k]) {
                pairs.push((format!("tip {k}"), tip - truth.tip[k], uncertainty));
            }
        }
        for lobe in &file.shape.lobes {
            let real = truth
                .shape
                .lobes
                .iter()
                .find(|real| real.order == lobe.order);
            let [cosine, sine] = real.map_or([0.0; 2], |real| [real.cosine, real.sine]);
            for (name, off) in [("cos", lobe.cosine - cosine), ("sin", lobe.sine - sine)] {
                pairs.push((format!("{name} {}", lobe.order), off, lobe.uncertainty));
            }
        }
        pairs
    }

    #[test]
    fn exact_touches_give_the_probe_itself() {
        let truth = truth();
        let touches = touches(&truth, &SEVERAL, &LATITUDES, 0.0, 1);
        let found = qualify(&machine(), &known(), &touches).unwrap();
        assert_eq!(found.undetermined, []);
        assert!((found.centre - truth.centre).norm() < 1e-8);
        let pairs = pairs(&found, &truth);
        assert_eq!(pairs.len(), 11);
        for (name, off, _) in pairs {
            // Rounding of 100 mm, times a hundred.
            assert!(off.abs() < 1e-9, "{name} {off}");
        }
        // What was written is read again.
        let text = found.file.to_toml();
        let read = ProbeFile::from_toml(&text, &machine()).unwrap();
        assert!((read.radius - found.file.radius).abs() < 1e-6);
        assert_eq!(read.shape.lobes.len(), 3);
        assert_eq!(read.to_toml(), text);
    }

    #[test]
    fn intervals_of_two_standard_uncertainties_cover() {
        let truth = truth();
        let place = truth.centre + Vector3::new(0.004, -0.003, 0.002);
        for (positions, place) in [(&SEVERAL[..], None), (&SEVERAL[..1], Some((place, 0.005)))] {
            let known = Known { place, ..known() };
            let (mut covered, mut all) = (0.0, 0.0);
            for seed in 0..150 {
                let touches = touches(&truth, positions, &LATITUDES, NOISE, seed);
                let found = qualify(&machine(), &known, &touches).unwrap();
                assert_eq!(found.undetermined, []);
                for (name, off, uncertainty) in pairs(&found, &truth) {
                    assert!(uncertainty > 0.0 && uncertainty < 0.01, "{name}");
                    // The place is off by less than a standard uncertainty, always the same.
                    if place.is_some() && name.starts_with("tip") {
                        assert!(off.abs() < 2.0 * uncertainty, "{name}: {off} {uncertainty}");
                        continue;
                    }
                    covered += f64::from(u8::from(off.abs() < 2.0 * uncertainty));
                    all += 1.0;
                }
            }
            // 95.4 % for a normal distribution, a little less for 60 degrees of freedom; 1200 and more independent pairs
            // scatter by 0.6 %.
            let part = covered / all;
            assert!((0.93..0.975).contains(&part), "{part}");
        }
    }

    #[test]
    fn what_touches_do_not_determine_is_named_and_left_as_it_was() {
        let truth = truth();
        // One position: where the ball is, or the tip?
        let one = touches(&truth, &SEVERAL[..1], &LATITUDES, NOISE, 1);
        let found = qualify(&machine(), &known(), &one).unwrap();
        assert_eq!(found.undetermined.len(), 3);
        assert!(
            found
                .undetermined
                .iter()
                .all(|u| matches!(u, Unknown::Tip(_)))
        );
        assert_eq!(found.file.tip, [None; 3]);
        assert!((found.file.radius - truth.radius).abs() < 4.0 * found.file.radius_uncertainty);
        // C alone turns about the tool axis: the length is not seen.
        let about = touches(&truth, &[[0.0, 0.0], [0.0, 90.0]], &LATITUDES, NOISE, 1);
        let found = qualify(&machine(), &known(), &about).unwrap();
        assert_eq!(found.undetermined, [Unknown::Tip(2)]);
        // Two latitudes: the pole cannot be told from the height of the ball.
        let low = touches(&truth, &SEVERAL[..1], &[90.0, 10.0], NOISE, 1);
        let found = qualify(&machine(), &known(), &low).unwrap();
        assert!(
            found.undetermined.contains(&Unknown::Pole),
            "{:?}",
            found.undetermined
        );
        // A circle is no sphere, and another ball is none of these.
        let flat = touches(&truth, &SEVERAL[..1], &[0.0], NOISE, 1);
        assert_eq!(
            qualify(&machine(), &known(), &flat),
            Err(QualifyError::NoSphere)
        );
        let mut wrong = one.clone();
        wrong[5][2] += 3.0;
        let refused = qualify(&machine(), &known(), &wrong);
        assert!(
            matches!(refused, Err(QualifyError::NotTheBall { .. })),
            "{refused:?}"
        );
        let few = qualify(&machine(), &known(), &one[..4]);
        assert!(matches!(few, Err(QualifyError::TooFew { .. })), "{few:?}");
    }
}
