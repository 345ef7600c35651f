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

mod outliers;
mod record;

use crate::formats::probe::{Lobe, ProbeFile, Spherical};
use crate::identify::deviations;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
pub use outliers::TouchSuspect;
use outliers::outliers;
pub use record::{LobeRecord, QualifiedRecord};
use std::fmt;
use trueaxis_kinematics::Nominal;
use trueaxis_model::machine::{Machine, PerAxis};

/// What is known before.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbePriors {
    /// Radius of the ball (mm).
    pub radius: f64,
    /// Standard uncertainty (mm).
    pub radius_uncertainty: f64,
    /// Standard uncertainty of each coordinate of the ball's centre in the workpiece frame, and that centre (mm).
    pub place: Option<(Vector3<f64>, f64)>,
    /// Where the tip is about, in the spindle frame (mm).
    pub tip: Vector3<f64>,
    /// Nominal radius of the tip (mm), if it is stated.
    pub stylus: Option<f64>,
    /// Highest order of the lobes.
    pub orders: usize,
}

/// An unknown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProbeUnknown {
    /// A coordinate (0, 1, 2 for x, y, z) of the ball as seen at a rotary position.
    Centre(usize, usize),
    /// The radius r.
    Radius,
    /// The term of the pole, p.
    Pole,
    /// A coefficient of an order: of the cosine, or of the sine.
    Lobe(usize, bool),
    /// A coordinate of the tip in the spindle frame (0, 1, 2 for x, y, z).
    Tip(usize),
}

impl fmt::Display for ProbeUnknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |k: usize| ["x", "y", "z"][k];
        match *self {
            Self::Centre(_, k) => write!(f, "{} of the ball", name(k)),
            Self::Radius => f.write_str("the radius of the tip"),
            Self::Pole => f.write_str("what differs at the pole"),
            Self::Lobe(order, false) => write!(f, "the cosine of order {order}"),
            Self::Lobe(order, true) => write!(f, "the sine of order {order}"),
            Self::Tip(k) => write!(f, "{} of the tip", name(k)),
        }
    }
}

impl ProbeUnknown {
    /// Those that may stay at what they were taken for; balls have a place and a radius in any case.
    fn is_optional(self) -> bool {
        !matches!(self, Self::Centre(..) | Self::Radius)
    }
}

/// A qualified probe.
#[derive(Clone, Debug, PartialEq)]
pub struct Qualified {
    /// Values with their standard uncertainties.
    pub file: ProbeFile,
    /// Standard uncertainty of each coordinate of the tip (mm), where it was found: from the noise of touches, what is known
    /// of the ball, and how well the rotary positions agree.
    pub tip_uncertainty: [Option<f64>; 3],
    /// By how much the places of the ball disagree that are seen at the rotary positions (mm, root mean square), if there
    /// are enough of them: errors of the rotary axes.
    pub apart: Option<f64>,
    /// Number of rotary positions.
    pub positions: usize,
    /// Standard deviation of a touch (mm).
    pub noise: f64,
    /// Number of touches.
    pub touches: usize,
    /// What the touches do not determine.
    pub undetermined: Vec<ProbeUnknown>,
    /// The touch that fits least, counted from 0, and what it is off (mm).
    pub worst: (usize, f64),
    /// Touches that do not fit the others, and a ball that was moved.
    pub outliers: Vec<TouchSuspect>,
    /// The ball is seen elsewhere from one rotary position on, and the others agree.
    pub shift: Option<Shift>,
}

/// From some rotary position on, the ball is seen elsewhere: it was moved, or the machine has an error that begins to matter
/// there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shift {
    /// The first touch (by index) at that rotary position.
    pub touch: usize,
    /// How far (mm, workpiece frame).
    pub by: Vector3<f64>,
    /// How far the rotary positions are apart (mm, root mean square), with it and without.
    pub apart: [f64; 2],
}

/// Why touches qualify nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QualifyError {
    /// Fewer than unknowns.
    #[error("{touches} touches are too few for {unknowns} unknowns")]
    TooFew {
        /// Their number.
        touches: usize,
        /// Number of unknowns that must be found.
        unknowns: usize,
    },
    /// All in a plane, or the like.
    #[error("the touches do not show where the ball is: they are in a plane, or on one side of it")]
    NoSphere,
    /// Another ball, another machine, or a rotary axis that counts the other way.
    #[error(
        "the rotary positions do not see one ball: it, or the tip, would be {off:.1} mm from where it is stated"
    )]
    Elsewhere {
        /// The distance (mm).
        off: f64,
    },
    /// The ball was moved between rotary positions.
    #[error(
        "the centres of the ball at the rotary positions are {off:.2} mm apart, {rest:.3} mm without the one of touch {touch}: more than the errors of a working machine"
    )]
    Moved {
        /// Root mean square distance (mm) with all rotary positions.
        off: f64,
        /// Like `off`, without the one that does not fit.
        rest: f64,
        /// First touch, counted from 1.
        touch: usize,
    },
    /// The diameters of ball and tip are not those that were touched.
    #[error(
        "ball and tip measure {found:.3} mm together (both diameters), but {stated:.3} mm are stated: {}", if *.found > *.stated { "pre-travel makes them smaller, not larger" } else { "no pre-travel is as large" }
    )]
    OtherSize {
        /// Sum of the stated diameters (mm).
        stated: f64,
        /// Sum of the diameters found (mm).
        found: f64,
    },
    /// No touch is where the ball can be.
    #[error(
        "the touches are no part of a ball of {radius:.3} mm with the tip: one is off by {off:.3} mm"
    )]
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
/// An effective radius is within this (mm) of the nominal one, whatever the pre-travel of a probe for machine tools, and larger
/// by no more than this, whatever the scales of the machine.
const PRE_TRAVEL: f64 = 0.1;
const LARGER: f64 = 0.02;
/// Rotary positions that see the ball farther apart (mm, root mean square) than any errors of a working machine; the ball was
/// moved if one of them explains it down to this fraction.
const GROSS: f64 = 0.3;
const EXPLAINS: f64 = 0.2;
/// A ball that was moved leaves this fraction of how far rotary positions are apart, and chance gives that less than once in
/// two thousand (standard deviations of a normal distribution).
const APART: f64 = 0.2;
const CHANCE: f64 = 3.3;
/// A tip is within this of its stated place, and a ball of its place, whatever the errors of the machine (mm).
const ELSEWHERE: f64 = 5.0;
/// No step is as long (mm).
const FAR: f64 = 1e3;
/// The least noise (mm): probes repeat to 0.1 µm at best.
const LEAST: f64 = 1e-4;
/// Of equal ones the last is chosen.
const TIE: f64 = 1e-6;
/// Rotary positions that differ by less (deg) are the same.
const SAME: f64 = 1e-3;

/// Qualifies a probe from touches of one ball, with the spindle at 0: axis positions (mm, deg) on the nominal machine.
///
/// The ball may be elsewhere at each rotary position, as it is on a machine with errors; only the place of the tip rests on
/// its staying where it is.
///
/// # Errors
/// [`QualifyError`].
pub fn qualify(
    machine: &Machine,
    known: &ProbePriors,
    touches: &[PerAxis],
) -> Result<Qualified, QualifyError> {
    let mut fit = DistanceFit::new(machine, known, touches)?;
    let mut undetermined = Vec::new();
    loop {
        fit.solve()?;
        match confounded(&fit.equations().1, &fit.unknowns)? {
            None => break,
            Some(unknown) => {
                fit.drop(unknown);
                undetermined.push(unknown);
            }
        }
    }
    undetermined.reverse();
    fit.is_stated_size()?;
    fit.qualified(undetermined)
}

/// An unknown that cannot be told from others, of those that may stay as they are: the one that has most of it, a high order
/// before a low one.
fn confounded(
    by: &DMatrix<f64>,
    unknowns: &[ProbeUnknown],
) -> Result<Option<ProbeUnknown>, QualifyError> {
    if by.nrows() < by.ncols() {
        let last = unknowns.iter().rev().find(|u| u.is_optional());
        return last.copied().map(Some).ok_or(QualifyError::TooFew {
            touches: by.nrows(),
            unknowns: by.ncols(),
        });
    }
    let mut scaled = by.clone();
    for mut column in scaled.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let svd = scaled.svd(false, true);
    let Some(ways) = svd.v_t else { return Ok(None) };
    let (least, value) = svd.singular_values.argmin();
    if value > ZERO {
        return Ok(None);
    }
    let part = |i: usize| ways[(least, i)].abs();
    let optional = (0..unknowns.len()).filter(|i| unknowns[*i].is_optional() && part(*i) > ZERO);
    let weight = |i: usize| part(i) + TIE * i as f64;
    let most = optional.max_by(|a, b| weight(*a).total_cmp(&weight(*b)));
    most.map(|most| Some(unknowns[most]))
        .ok_or(QualifyError::NoSphere)
}

/// Touches at one rotary position.
struct TouchGroup {
    /// Orientation of the spindle in the workpiece frame.
    turn: Matrix3<f64>,
    /// Where the tip would be, with the touches by their number.
    points: Vec<(usize, Vector3<f64>)>,
    /// Where the ball seems to be.
    centre: Vector3<f64>,
}

/// Least squares of the distances.
struct DistanceFit<'a> {
    machine: &'a Machine,
    known: &'a ProbePriors,
    groups: Vec<TouchGroup>,
    touches: usize,
    unknowns: Vec<ProbeUnknown>,
    radius: f64,
    shape: Spherical,
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
    fn new(
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
                return Err(QualifyError::TooFew {
                    touches: points.len(),
                    unknowns: 4,
                });
            }
            let found = crate::spheres::start(&points).ok_or(QualifyError::NoSphere)?;
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
    fn equations(&self) -> (DVector<f64>, DMatrix<f64>) {
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
    fn solve(&mut self) -> Result<(), QualifyError> {
        for _ in 0..STEPS {
            let (left, by) = self.equations();
            let svd = by.svd(true, true);
            let largest = svd.singular_values.max();
            let step = svd.solve(&-&left, ZERO * largest);
            let step = step.map_err(|_| QualifyError::NoSphere)?;
            if step.iter().any(|v| !v.is_finite()) || step.norm() > FAR {
                return Err(QualifyError::NoSphere);
            }
            self.add(&step);
            if step.norm() < STILL {
                break;
            }
        }
        let off = self.equations().0.amax();
        match off > OFF || self.radius < -OFF {
            true => Err(QualifyError::NotTheBall {
                radius: self.known.radius + self.radius,
                off,
            }),
            false => Ok(()),
        }
    }

    /// Goes on without an unknown, which is what it was taken for.
    fn drop(&mut self, unknown: ProbeUnknown) {
        self.unknowns.retain(|u| *u != unknown);
        self.shape = Spherical::default();
    }

    fn qualified(mut self, mut undetermined: Vec<ProbeUnknown>) -> Result<Qualified, QualifyError> {
        let (left, by) = self.equations();
        let too_few = QualifyError::TooFew {
            touches: self.touches,
            unknowns: by.ncols() + 1,
        };
        let free = self
            .touches
            .checked_sub(by.ncols())
            .filter(|free| *free > 0);
        let noise = (left.norm_squared() / free.ok_or(too_few)? as f64).sqrt();
        let inverse = (by.transpose() * &by).try_inverse();
        let inverse = inverse.ok_or(QualifyError::NoSphere)?;
        let of = |unknown: ProbeUnknown| -> Option<f64> {
            let column = self.unknowns.iter().position(|u| *u == unknown)?;
            Some(noise * inverse[(column, column)].max(0.0).sqrt())
        };
        let centres =
            (0..self.groups.len()).flat_map(|g| (0..3).map(move |k| ProbeUnknown::Centre(g, k)));
        let squares: f64 = centres.filter_map(&of).map(|u| u * u).sum();
        let of_centre = (squares / (3 * self.groups.len()) as f64).sqrt().max(LEAST);
        let tip = self.tip(of_centre)?;
        self.has_stayed(tip.apart, of_centre)?;
        let groups: Vec<Vec<(usize, Vector3<f64>)>> = (self.groups.iter())
            .map(|group| {
                let out = |point: &Vector3<f64>| (point - group.centre).normalize();
                (group.points.iter())
                    .map(|(touch, p)| (*touch, out(p)))
                    .collect()
            })
            .collect();
        let outliers = outliers(&left, &by, &groups);
        let shift = tip.apart.and_then(|off| self.shift(off, of_centre));
        let offsets = tip.offset.iter().flatten().map(|(offset, _)| offset.abs());
        let off = offsets.chain(tip.apart).fold(0.0, f64::max);
        if off > ELSEWHERE {
            return Err(QualifyError::Elsewhere { off });
        }
        undetermined.extend(
            (0..3)
                .filter(|k| tip.offset[*k].is_none())
                .map(ProbeUnknown::Tip),
        );
        let lobes = (2..=self.known.orders).filter_map(|order| {
            let [cosine, sine] =
                [false, true].map(|is_sine| of(ProbeUnknown::Lobe(order, is_sine)));
            let found = self.shape.lobes.iter().find(|lobe| lobe.order == order)?;
            (cosine.is_some() || sine.is_some()).then(|| Lobe {
                uncertainty: cosine.unwrap_or(0.0).max(sine.unwrap_or(0.0)),
                ..*found
            })
        });
        let lobes: Vec<Lobe> = lobes.collect();
        let worst = left.icamax();
        let [radius, pole] =
            [ProbeUnknown::Radius, ProbeUnknown::Pole].map(|unknown| of(unknown).unwrap_or(0.0));
        self.shape.lobes = lobes;
        let tip_uncertainty = tip
            .offset
            .map(|found| found.map(|(_, uncertainty)| uncertainty));
        Ok(Qualified {
            file: ProbeFile {
                machine: self.machine.name.clone(),
                radius: self.radius,
                radius_uncertainty: libm::hypot(radius, self.known.radius_uncertainty),
                tip: std::array::from_fn(|k| Some(self.known.tip[k] + tip.offset[k]?.0)),
                tip_uncertainty: match self.known.place {
                    Some(_) => tip_uncertainty,
                    None => [None; 3],
                },
                pole_uncertainty: pole,
                shape: self.shape,
            },
            tip_uncertainty,
            apart: tip.apart,
            positions: self.groups.len(),
            noise,
            touches: self.touches,
            worst: (worst, left[worst]),
            outliers,
            shift,
            undetermined,
        })
    }

    /// Refuses diameters of ball and tip that are not the touched ones.
    fn is_stated_size(&self) -> Result<(), QualifyError> {
        let Some(stylus) = self.known.stylus else {
            return Ok(());
        };
        match self.radius > stylus + LARGER || self.radius < stylus - PRE_TRAVEL {
            true => Err(QualifyError::OtherSize {
                stated: 2.0 * (self.known.radius + stylus),
                found: 2.0 * (self.known.radius + self.radius),
            }),
            false => Ok(()),
        }
    }

    /// Refuses a ball that was moved between two rotary positions, farther than the errors of a machine do.
    fn has_stayed(&self, apart: Option<f64>, of_centre: f64) -> Result<(), QualifyError> {
        let Some(off) = apart.filter(|off| *off > GROSS) else {
            return Ok(());
        };
        let without = |number: usize| {
            let other = (self.groups.iter().enumerate()).filter(|(i, _)| *i != number);
            let groups: Vec<&TouchGroup> = other.map(|(_, group)| group).collect();
            let rest = self.tip_of(&groups, of_centre).ok()?.apart?;
            Some((rest, number))
        };
        let all = (0..self.groups.len()).filter_map(without);
        match all.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((rest, number)) if rest < EXPLAINS * off => Err(QualifyError::Moved {
                off,
                rest,
                touch: self.groups[number].points[0].0 + 1,
            }),
            _ => Ok(()),
        }
    }

    fn tip(&self, of_centre: f64) -> Result<QualifiedTip, QualifyError> {
        self.tip_of(&self.groups.iter().collect::<Vec<_>>(), of_centre)
    }

    /// The rotary position from which on the ball is seen elsewhere, if that explains beyond chance how far they are apart.
    fn shift(&self, off: f64, of_centre: f64) -> Option<Shift> {
        let all = (1..self.groups.len())
            .filter_map(|first| Some((self.stepped(first, of_centre)?, first)));
        let ((square, freedom, by), first) = all.min_by(|a, b| a.0.0.total_cmp(&b.0.0))?;
        let rest = square.sqrt();
        let whole = off * off * (freedom + 3) as f64;
        let explained = whole - square * freedom as f64;
        let ratio = explained / 3.0 / square.max(f64::MIN_POSITIVE);
        (rest < APART * off && deviations(ratio, 3, freedom) > CHANCE).then(|| Shift {
            touch: self.groups[first].points[0].0,
            by,
            apart: [off, rest],
        })
    }

    /// How far the rotary positions are apart (mm², mean square, and its degrees of freedom) with a ball that was moved before
    /// one of them, and by how much it was.
    fn stepped(&self, first: usize, of_centre: f64) -> Option<(f64, usize, Vector3<f64>)> {
        let rows = 3 * self.groups.len() + self.known.place.map_or(0, |_| 3);
        let mut all = DMatrix::zeros(rows, 9);
        let mut seen = DVector::zeros(rows);
        for (number, group) in self.groups.iter().enumerate() {
            let at = 3 * number;
            let unit = Matrix3::identity() / of_centre;
            seen.rows_mut(at, 3).copy_from(&(group.centre / of_centre));
            all.view_mut((at, 0), (3, 3)).copy_from(&unit);
            let turned = -group.turn / of_centre;
            all.view_mut((at, 3), (3, 3)).copy_from(&turned);
            if number >= first {
                all.view_mut((at, 6), (3, 3)).copy_from(&unit);
            }
        }
        if let Some((place, uncertainty)) = self.known.place {
            let unit = Matrix3::identity() / uncertainty;
            seen.rows_mut(rows - 3, 3).copy_from(&(place / uncertainty));
            all.view_mut((rows - 3, 0), (3, 3)).copy_from(&unit);
        }
        let svd = all.clone().svd(true, true);
        let least = ZERO * svd.singular_values.max();
        let rank = svd.rank(least);
        let found = svd.solve(&seen, least).ok()?;
        let left = (&seen - &all * &found).norm_squared();
        let free = rows.checked_sub(rank).filter(|free| *free > 0)?;
        let by = Vector3::new(found[6], found[7], found[8]);
        Some((left / free as f64 * of_centre * of_centre, free, by))
    }

    /// Where the tip is: the ball seems to be at c − R·δ where it is at c, and the tip δ from where it was taken to be.
    fn tip_of(&self, groups: &[&TouchGroup], of_centre: f64) -> Result<QualifiedTip, QualifyError> {
        let (seen, all) = self.tip_equations(groups, of_centre);
        let places = (0..3).map(|k| ProbeUnknown::Centre(0, k));
        let mut kept: Vec<ProbeUnknown> = places.chain((0..3).map(ProbeUnknown::Tip)).collect();
        let column = |unknown: &ProbeUnknown| match *unknown {
            ProbeUnknown::Tip(k) => 3 + k,
            ProbeUnknown::Centre(_, k) => k,
            _ => 0,
        };
        let by = loop {
            let columns: Vec<usize> = kept.iter().map(column).collect();
            let by = all.select_columns(&columns);
            match confounded(&by, &kept)? {
                None => break by,
                Some(unknown) => kept.retain(|u| *u != unknown),
            }
        };
        let inverse = (by.transpose() * &by).try_inverse();
        let inverse = inverse.ok_or(QualifyError::NoSphere)?;
        let found = &inverse * (by.transpose() * &seen);
        let left = &seen - &by * &found;
        let free = seen.len() - by.ncols();
        let square = left.norm_squared() / free.max(1) as f64;
        // Rotary axes that do not turn where they should make the ball wander: what is seen counts less then.
        let factor = match free {
            0 => 1.0,
            _ => square.max(1.0).sqrt(),
        };
        Ok(QualifiedTip {
            offset: std::array::from_fn(|k| {
                let at = kept.iter().position(|u| *u == ProbeUnknown::Tip(k))?;
                Some((found[at], factor * inverse[(at, at)].max(0.0).sqrt()))
            }),
            apart: (free > 0 && groups.len() > 1).then_some(square.sqrt() * of_centre),
        })
    }

    /// The centres that were seen, and the place of the tip if it is stated, by the place of the ball and that of the tip.
    fn tip_equations(
        &self,
        groups: &[&TouchGroup],
        of_centre: f64,
    ) -> (DVector<f64>, DMatrix<f64>) {
        let stated = self.known.place;
        let rows = 3 * groups.len() + stated.map_or(0, |_| 3);
        let mut seen = DVector::zeros(rows);
        let mut all = DMatrix::zeros(rows, 6);
        for (number, group) in groups.iter().enumerate() {
            let at = 3 * number;
            seen.rows_mut(at, 3).copy_from(&(group.centre / of_centre));
            let unit = Matrix3::identity() / of_centre;
            all.view_mut((at, 0), (3, 3)).copy_from(&unit);
            all.view_mut((at, 3), (3, 3))
                .copy_from(&(-group.turn / of_centre));
        }
        if let Some((place, uncertainty)) = stated {
            let at = rows - 3;
            seen.rows_mut(at, 3).copy_from(&(place / uncertainty));
            let unit = Matrix3::identity() / uncertainty;
            all.view_mut((at, 0), (3, 3)).copy_from(&unit);
        }
        (seen, all)
    }
}

/// Where the tip is.
struct QualifiedTip {
    /// From where it was taken to be, in the spindle frame, with the standard uncertainty (mm).
    offset: [Option<(f64, f64)>; 3],
    apart: Option<f64>,
}

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
                        libm::cos(height) * libm::cos(around),
                        libm::cos(height) * libm::sin(around),
                        libm::sin(height),
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

    fn known() -> ProbePriors {
        ProbePriors {
            radius: BALL,
            radius_uncertainty: 0.0,
            place: None,
            tip: Vector3::new(0.0, 0.0, -100.0),
            stylus: None,
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
        assert!(found.apart.unwrap() < 1e-8);
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
            let known = ProbePriors { place, ..known() };
            let (mut covered, mut all) = (0.0, 0.0);
            for seed in 0..150 {
                let touches = touches(&truth, positions, &LATITUDES, NOISE, seed);
                let found = qualify(&machine(), &known, &touches).unwrap();
                assert_eq!(found.undetermined, []);
                for (name, off, uncertainty) in pairs(&found, &truth) {
                    assert!(uncertainty > 0.0 && uncertainty < 0.01, "{name}");
                    // The place is off by less than a standard uncertainty, always the same; and where the ball seems to be
                    // scatters less than the noise at three positions.
                    if name.starts_with("tip") {
                        assert!(off.abs() < 4.0 * uncertainty, "{name}: {off} {uncertainty}");
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
                .all(|u| matches!(u, ProbeUnknown::Tip(_)))
        );
        assert_eq!(found.file.tip, [None; 3]);
        assert!((found.file.radius - truth.radius).abs() < 4.0 * found.file.radius_uncertainty);
        // C alone turns about the tool axis: the length is not seen.
        let about = touches(&truth, &[[0.0, 0.0], [0.0, 90.0]], &LATITUDES, NOISE, 1);
        let found = qualify(&machine(), &known(), &about).unwrap();
        assert_eq!(found.undetermined, [ProbeUnknown::Tip(2)]);
        // Two latitudes: the pole cannot be told from the height of the ball.
        let low = touches(&truth, &SEVERAL[..1], &[90.0, 10.0], NOISE, 1);
        let found = qualify(&machine(), &known(), &low).unwrap();
        assert!(
            found.undetermined.contains(&ProbeUnknown::Pole),
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
        let mut other = about.clone();
        for touch in &mut other[..25] {
            touch[4] += 20.0;
        }
        let refused = qualify(&machine(), &known(), &other);
        assert!(
            matches!(refused, Err(QualifyError::Elsewhere { .. })),
            "{refused:?}"
        );
        let few = qualify(&machine(), &known(), &one[..4]);
        assert!(matches!(few, Err(QualifyError::TooFew { .. })), "{few:?}");
    }

    #[test]
    fn a_touch_that_is_off_is_named_with_its_size() {
        let truth = truth();
        for seed in 0..20 {
            let mut touches = touches(&truth, &SEVERAL, &LATITUDES, NOISE, seed);
            let good = qualify(&machine(), &known(), &touches).unwrap();
            assert_eq!(good.outliers, [], "{seed}");
            // Touch 14 is the second at 45°, at 30° around; 0.030 mm farther out along X and Y.
            let out = 0.030 * libm::cos(45_f64.to_radians());
            touches[14][2] += out * libm::cos(30_f64.to_radians());
            touches[14][3] += out * libm::sin(30_f64.to_radians());
            touches[14][4] += out;
            let found = qualify(&machine(), &known(), &touches).unwrap();
            // 0.5 µm of noise.
            assert!(
                matches!(found.outliers[..], [TouchSuspect::Touch(14, off)] if (off - 0.030).abs() < 0.003),
                "{seed}: {:?}",
                found.outliers
            );
        }
    }

    #[test]
    fn a_ball_that_was_moved_is_named() {
        let truth = truth();
        let moved = Truth {
            centre: truth.centre + Vector3::new(0.03, 0.0, -0.02),
            ..self::truth()
        };
        let [before, after] = [&truth, &moved].map(|t| touches(t, &SEVERAL, &LATITUDES, NOISE, 3));
        // Within a rotary position: half of the touches around.
        let within = [&before[..8], &after[8..]].concat();
        let found = qualify(&machine(), &known(), &within).unwrap();
        let [TouchSuspect::Moved(first, by)] = found.outliers[..] else {
            panic!("{:?}", found.outliers)
        };
        assert!((7..=9).contains(&first), "{first}");
        assert!((by - Vector3::new(0.03, 0.0, -0.02)).norm() < 0.01, "{by}");
        // Between two rotary positions, by more than a machine may be off.
        let four = [[0.0, 0.0], [40.0, 0.0], [0.0, 120.0], [-30.0, 60.0]];
        let far = Truth {
            centre: truth.centre + Vector3::new(2.0, 1.0, 0.0),
            ..self::truth()
        };
        let [before, after] = [&truth, &far].map(|t| touches(t, &four, &LATITUDES, NOISE, 3));
        let between = [&before[..75], &after[75..]].concat();
        let refused = qualify(&machine(), &known(), &between);
        assert!(
            matches!(refused, Err(QualifyError::Moved { touch: 76, .. })),
            "{refused:?}"
        );
    }

    #[test]
    fn a_ball_that_was_moved_a_little_between_rotary_positions_is_named() {
        let five = [
            [0.0, 0.0],
            [40.0, 0.0],
            [0.0, 120.0],
            [-30.0, 60.0],
            [20.0, 200.0],
        ];
        let by = Vector3::new(0.03, 0.0, -0.02);
        for seed in 0..20 {
            let truth = truth();
            let moved = Truth {
                centre: truth.centre + by,
                ..self::truth()
            };
            let [before, after] =
                [&truth, &moved].map(|t| touches(t, &five, &LATITUDES, NOISE, seed));
            let still = qualify(&machine(), &known(), &before).unwrap();
            assert_eq!(still.shift, None, "{seed}");
            // 25 touches at each rotary position: before the fourth.
            let touched = [&before[..75], &after[75..]].concat();
            let found = qualify(&machine(), &known(), &touched).unwrap();
            let shift = found.shift.unwrap();
            assert_eq!(shift.touch, 75, "{seed}");
            assert!((shift.by - by).norm() < 0.003, "{seed}: {shift:?}");
        }
    }

    #[test]
    fn another_diameter_is_refused_if_that_of_the_tip_is_stated() {
        let truth = truth();
        let touches = touches(&truth, &SEVERAL, &LATITUDES, NOISE, 1);
        let of = |ball: f64, stylus: Option<f64>| {
            let known = ProbePriors {
                radius: ball / 2.0,
                stylus,
                ..known()
            };
            qualify(&machine(), &known, &touches)
        };
        assert!(of(20.0, Some(3.0)).is_ok());
        for ball in [19.8, 20.3, 25.0] {
            // Nothing else shows it.
            assert!(of(ball, None).is_ok());
            let refused = of(ball, Some(3.0));
            assert!(
                matches!(refused, Err(QualifyError::OtherSize { stated, found })
                    if (stated - ball - 6.0).abs() < 1e-9 && (found - 25.974).abs() < 0.01),
                "{refused:?}"
            );
        }
    }
}
