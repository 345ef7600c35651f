//! The least squares of the distances between the tip and the ball.

use super::{ProbePriors, ProbeUnknown, QualifyError, ZERO};
use crate::probe_file::Spherical;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_kinematics::Nominal;
use trueaxis_model::machine::{Machine, PerAxis};

/// Largest number of Gauss–Newton steps, and the step (mm) at which they end.
const STEPS: usize = 40;
const STILL: f64 = 1e-10;
/// A pre-travel is less than this (mm).
const OFF: f64 = 0.5;
/// An effective radius is within this (mm) of the nominal one, whatever the pre-travel of a probe for machine tools, and larger
/// by no more than this, whatever the scales of the machine.
const PRE_TRAVEL: f64 = 0.1;
const LARGER: f64 = 0.02;
/// No step is as long (mm).
const FAR: f64 = 1e3;
/// Rotary positions that differ by less (deg) are the same.
const SAME: f64 = 1e-3;

/// Touches at one rotary position.
pub struct TouchGroup {
    /// Orientation of the spindle in the workpiece frame.
    pub turn: Matrix3<f64>,
    /// Where the tip would be, with the touches by their number.
    pub points: Vec<(usize, Vector3<f64>)>,
    /// Where the ball seems to be.
    pub centre: Vector3<f64>,
}

/// Least squares of the distances.
pub struct DistanceFit<'a> {
    pub machine: &'a Machine,
    pub known: &'a ProbePriors,
    pub groups: Vec<TouchGroup>,
    pub touches: usize,
    pub unknowns: Vec<ProbeUnknown>,
    pub radius: f64,
    pub shape: Spherical,
}

/// The touches at each rotary position.
fn grouped(machine: &Machine, known: &ProbePriors, touches: &[PerAxis]) -> Vec<TouchGroup> {
    let mut groups: Vec<(PerAxis, TouchGroup)> = Vec::new();
    let nominal = Nominal::new(machine);
    for (number, position) in touches.iter().enumerate() {
        let carriers = nominal.carriers(&machine.to_kinematic(position));
        let spindle = carriers.workpiece.inverse() * carriers.spindle;
        let point = (number, spindle.r * known.tip + spindle.t);
        let is_same = |other: &PerAxis| {
            (machine.axes.iter().zip(position.iter().zip(other)))
                .all(|(axis, (a, b))| !axis.letter.is_rotary() || (a - b).abs() < SAME)
        };
        match groups.iter_mut().find(|(other, _)| is_same(other)) {
            Some((_, group)) => group.points.push(point),
            None => groups.push((
                *position,
                TouchGroup {
                    turn: spindle.r,
                    points: vec![point],
                    centre: Vector3::zeros(),
                },
            )),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

impl<'a> DistanceFit<'a> {
    /// Where the ball and the tip are taken to be at first.
    pub fn new(
        machine: &'a Machine,
        known: &'a ProbePriors,
        touches: &[PerAxis],
    ) -> Result<Self, QualifyError> {
        let mut groups = grouped(machine, known, touches);
        let mut unknowns = Vec::new();
        let mut sum = 0.0;
        for (number, group) in groups.iter_mut().enumerate() {
            let points: Vec<Vector3<f64>> = group.points.iter().map(|(_, point)| *point).collect();
            if points.len() < 4 {
                return Err(QualifyError::too_few(points.len(), 4));
            }
            let found = crate::spheres::start(&points).ok_or_else(QualifyError::no_sphere)?;
            group.centre = found.0;
            sum += found.1;
            unknowns.extend((0..3).map(|k| ProbeUnknown::Centre(number, k)));
        }
        unknowns.extend([ProbeUnknown::Radius, ProbeUnknown::Pole]);
        for order in 2..=known.orders {
            unknowns.extend([
                ProbeUnknown::Lobe(order, false),
                ProbeUnknown::Lobe(order, true),
            ]);
        }
        Ok(Self {
            machine,
            known,
            radius: sum / groups.len() as f64 - known.radius,
            groups,
            touches: touches.len(),
            unknowns,
            shape: Spherical::default(),
        })
    }

    /// Residuals (mm) and their derivatives, touch by touch.
    pub fn equations(&self) -> (DVector<f64>, DMatrix<f64>) {
        let mut left = DVector::zeros(self.touches);
        let mut by = DMatrix::zeros(self.touches, self.unknowns.len());
        for (number, group) in self.groups.iter().enumerate() {
            for (row, point) in &group.points {
                let way = point - group.centre;
                let out = way.normalize();
                let own = group.turn.transpose() * out;
                let [around, height] = Spherical::direction(self.machine, &self.known.tip, &own);
                left[*row] = way.norm()
                    - self.known.radius
                    - self.radius
                    - self.shape.deviation(around, height);
                for (column, unknown) in self.unknowns.iter().enumerate() {
                    by[(*row, column)] = match *unknown {
                        ProbeUnknown::Centre(of, k) if of == number => -out[k],
                        ProbeUnknown::Centre(..) | ProbeUnknown::Tip(_) => 0.0,
                        ProbeUnknown::Radius => -1.0,
                        ProbeUnknown::Pole => -libm::sin(height).powi(2),
                        ProbeUnknown::Lobe(order, is_sine) => {
                            let angle = order as f64 * around;
                            -libm::cos(height)
                                * if is_sine {
                                    libm::sin(angle)
                                } else {
                                    libm::cos(angle)
                                }
                        }
                    };
                }
            }
        }
        (left, by)
    }

    fn add(&mut self, step: &DVector<f64>) {
        for (unknown, step) in self.unknowns.iter().zip(step.iter()) {
            match *unknown {
                ProbeUnknown::Centre(of, k) => self.groups[of].centre[k] += step,
                ProbeUnknown::Radius => self.radius += step,
                ProbeUnknown::Pole => self.shape.pole += step,
                ProbeUnknown::Lobe(order, is_sine) => {
                    let lobe = self.shape.lobe(order);
                    *(if is_sine {
                        &mut lobe.sine
                    } else {
                        &mut lobe.cosine
                    }) += step;
                }
                ProbeUnknown::Tip(_) => {}
            }
        }
    }

    /// The smallest changes that fit.
    pub fn solve(&mut self) -> Result<(), QualifyError> {
        for _ in 0..STEPS {
            let (left, by) = self.equations();
            let svd = by.svd(true, true);
            let largest = svd.singular_values.max();
            let step = svd.solve(&-&left, ZERO * largest);
            let step = step.map_err(|_| QualifyError::no_sphere())?;
            if step.iter().any(|v| !v.is_finite()) || step.norm() > FAR {
                return Err(QualifyError::no_sphere());
            }
            self.add(&step);
            if step.norm() < STILL {
                break;
            }
        }
        let off = self.equations().0.amax();
        match off > OFF || self.radius < -OFF {
            true => Err(QualifyError::new(
                format!(
                    "the touches are no part of a ball of {:.3} mm with the tip: one is off by {off:.3} mm",
                    self.known.radius + self.radius
                ),
                "give the log of touches of one ball, and its diameter; a touch of something else has to be taken out",
            )),
            false => Ok(()),
        }
    }

    /// Goes on without an unknown, which is what it was taken for.
    pub fn drop(&mut self, unknown: ProbeUnknown) {
        self.unknowns.retain(|u| *u != unknown);
        self.shape = Spherical::default();
    }

    /// Refuses diameters of ball and tip that are not the touched ones.
    pub fn is_stated_size(&self) -> Result<(), QualifyError> {
        let Some(stylus) = self.known.stylus else {
            return Ok(());
        };
        let why = match self.radius {
            radius if radius > stylus + LARGER => "pre-travel makes them smaller, not larger",
            radius if radius < stylus - PRE_TRAVEL => "no pre-travel is as large",
            _ => return Ok(()),
        };
        let [found, stated] = [self.radius, stylus].map(|tip| 2.0 * (self.known.radius + tip));
        Err(QualifyError::new(
            format!(
                "ball and tip measure {found:.3} mm together (both diameters), but {stated:.3} mm are stated: {why}"
            ),
            "correct --ball-diameter or --stylus-diameter",
        ))
    }
}
