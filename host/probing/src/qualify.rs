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

mod error;
mod fit;
mod outliers;
mod record;
mod tip;

use crate::probe_file::{Lobe, ProbeFile};
pub use error::QualifyError;
use fit::DistanceFit;
use nalgebra::{DMatrix, Vector3};
pub use outliers::TouchSuspect;
use outliers::outliers;
pub use record::{LobeRecord, QualifiedRecord};
use std::fmt;
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

/// Singular values below this, with columns of length 1, count as zero, as in `identify`.
const ZERO: f64 = 1e-4;
/// A tip is within this of its stated place, and a ball of its place, whatever the errors of the machine (mm).
const ELSEWHERE: f64 = 5.0;
/// The least noise (mm): probes repeat to 0.1 µm at best.
const LEAST: f64 = 1e-4;
/// Of equal ones the last is chosen.
const TIE: f64 = 1e-6;
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
        let too_few = || QualifyError::too_few(by.nrows(), by.ncols());
        return last.copied().map(Some).ok_or_else(too_few);
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
        .ok_or_else(QualifyError::no_sphere)
}

impl DistanceFit<'_> {
    /// The probe, as the touches determine it, and what they leave open.
    fn qualified(mut self, mut undetermined: Vec<ProbeUnknown>) -> Result<Qualified, QualifyError> {
        let (left, by) = self.equations();
        let free = self.touches.saturating_sub(by.ncols());
        if free == 0 {
            return Err(QualifyError::too_few(self.touches, by.ncols() + 1));
        }
        let noise = (left.norm_squared() / free as f64).sqrt();
        let inverse = (by.transpose() * &by).try_inverse();
        let inverse = inverse.ok_or_else(QualifyError::no_sphere)?;
        let of = |unknown: ProbeUnknown| -> Option<f64> {
            let column = self.unknowns.iter().position(|u| *u == unknown)?;
            Some(noise * inverse[(column, column)].max(0.0).sqrt())
        };
        let centres =
            (0..self.groups.len()).flat_map(|g| (0..3).map(move |k| ProbeUnknown::Centre(g, k)));
        let squares: f64 = centres.filter_map(&of).map(|u| u * u).sum();
        let of_centre = (squares / (3 * self.groups.len()) as f64).sqrt().max(LEAST);
        let rows: Vec<usize> = (self.unknowns.iter().enumerate())
            .filter(|(_, unknown)| matches!(unknown, ProbeUnknown::Centre(..)))
            .map(|(row, _)| row)
            .collect();
        let covariance = inverse.select_rows(&rows).select_columns(&rows) * (noise * noise);
        let tip = self.tip(of_centre, &covariance)?;
        self.has_stayed(tip.apart, of_centre)?;
        let outliers = outliers(&left, &by, &self.directions());
        let shift = tip.apart.and_then(|off| self.shift(off, of_centre));
        let offsets = tip.offset.iter().flatten().map(|(offset, _)| offset.abs());
        let off = offsets.chain(tip.apart).fold(0.0, f64::max);
        if off > ELSEWHERE {
            return Err(QualifyError::new(
                format!(
                    "the rotary positions do not see one ball: it, or the tip, would be {off:.1} mm from where it is stated"
                ),
                "give the log of touches of one ball; check tip_mm, and which way each rotary axis counts in the machine file",
            ));
        }
        undetermined.extend(
            (0..3)
                .filter(|k| tip.offset[*k].is_none())
                .map(ProbeUnknown::Tip),
        );
        let lobes = self.lobes(of);
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
    /// The touches of each rotary position, with the direction from the ball.
    fn directions(&self) -> Vec<Vec<(usize, Vector3<f64>)>> {
        let groups = self.groups.iter().map(|group| {
            let out = |point: &Vector3<f64>| (point - group.centre).normalize();
            let points = group.points.iter().map(|(touch, p)| (*touch, out(p)));
            points.collect()
        });
        groups.collect()
    }

    /// The lobes of which a coefficient was found, with the standard uncertainties of the unknowns.
    fn lobes(&self, of: impl Fn(ProbeUnknown) -> Option<f64>) -> Vec<Lobe> {
        let lobes = (2..=self.known.orders).filter_map(|order| {
            let [cosine, sine] =
                [false, true].map(|is_sine| of(ProbeUnknown::Lobe(order, is_sine)));
            let found = self.shape.lobes.iter().find(|lobe| lobe.order == order)?;
            (cosine.is_some() || sine.is_some()).then(|| Lobe {
                uncertainty: cosine.unwrap_or(0.0).max(sine.unwrap_or(0.0)),
                ..*found
            })
        });
        lobes.collect()
    }
}

#[cfg(test)]
mod tests;
