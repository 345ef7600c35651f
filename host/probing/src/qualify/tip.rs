//! Where the tip is, by where the ball is seen at the rotary positions, and whether the ball stayed.

use super::fit::{DistanceFit, TouchGroup};
use super::{ProbeUnknown, QualifyError, Shift, ZERO, confounded};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use trueaxis_identify::deviations;

/// Rotary positions that see the ball farther apart (mm, root mean square) than any errors of a working machine; the ball was
/// moved if one of them explains it down to this fraction.
const GROSS: f64 = 0.3;
const EXPLAINS: f64 = 0.2;
/// A ball that was moved leaves this fraction of how far rotary positions are apart, and chance gives that less than once in
/// two thousand (standard deviations of a normal distribution).
const APART: f64 = 0.2;
const CHANCE: f64 = 3.3;
/// Where the tip is.
pub struct QualifiedTip {
    /// From where it was taken to be, in the spindle frame, with the standard uncertainty (mm).
    pub offset: [Option<(f64, f64)>; 3],
    /// By how much the places of the ball disagree that are seen at the rotary positions (mm, root mean square).
    pub apart: Option<f64>,
}

impl DistanceFit<'_> {
    /// Refuses a ball that was moved between two rotary positions, farther than the errors of a machine do.
    pub fn has_stayed(&self, apart: Option<f64>, of_centre: f64) -> Result<(), QualifyError> {
        let Some(off) = apart.filter(|off| *off > GROSS) else {
            return Ok(());
        };
        let without = |number: usize| {
            let other = (self.groups.iter().enumerate()).filter(|(i, _)| *i != number);
            let groups: Vec<&TouchGroup> = other.map(|(_, group)| group).collect();
            let independent = DMatrix::identity(3 * groups.len(), 3 * groups.len());
            let rest = self.tip_of(&groups, of_centre, &independent).ok()?.apart?;
            Some((rest, number))
        };
        let all = (0..self.groups.len()).filter_map(without);
        match all.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((rest, number)) if rest < EXPLAINS * off => Err(QualifyError::new(
                format!(
                    "the centres of the ball at the rotary positions are {off:.2} mm apart, {rest:.3} mm without the one of touch {}: more than the errors of a working machine",
                    self.groups[number].points[0].0 + 1
                ),
                "look whether the ball is loose, and touch it again, or leave out the touches of that rotary position",
            )),
            _ => Ok(()),
        }
    }

    /// Where the tip is, by all rotary positions. `covariance` is that of the three coordinates (mm²) of each centre: what is
    /// off in the shape of the tip moves all centres in the same direction.
    pub fn tip(
        &self,
        of_centre: f64,
        covariance: &DMatrix<f64>,
    ) -> Result<QualifiedTip, QualifyError> {
        let groups: Vec<&TouchGroup> = self.groups.iter().collect();
        self.tip_of(&groups, of_centre, &(covariance / (of_centre * of_centre)))
    }

    /// The rotary position from which on the ball is seen elsewhere, if that explains beyond chance how far they are apart.
    pub fn shift(&self, off: f64, of_centre: f64) -> Option<Shift> {
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
        let groups: Vec<&TouchGroup> = self.groups.iter().collect();
        let (seen, all) = self.tip_equations(&groups, of_centre);
        let rows = all.nrows();
        let mut all = all.insert_columns(6, 3, 0.0);
        for number in first..groups.len() {
            let unit = Matrix3::identity() / of_centre;
            all.view_mut((3 * number, 6), (3, 3)).copy_from(&unit);
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
    /// `covariance` is that of the centres, in the unit of `of_centre`.
    fn tip_of(
        &self,
        groups: &[&TouchGroup],
        of_centre: f64,
        covariance: &DMatrix<f64>,
    ) -> Result<QualifiedTip, QualifyError> {
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
        let inverse = inverse.ok_or_else(QualifyError::no_sphere)?;
        let gains = &inverse * by.transpose();
        let found = &gains * &seen;
        let left = &seen - &by * &found;
        let free = seen.len() - by.ncols();
        let square = left.norm_squared() / free.max(1) as f64;
        // Rotary axes that do not turn where they should make the ball wander, independently at each position.
        let wander = match free {
            0 => 0.0,
            _ => (square - 1.0).max(0.0),
        };
        // A stated place is as good as its row says.
        let mut of_seen = DMatrix::identity(seen.len(), seen.len());
        let shape = covariance.shape();
        of_seen.view_mut((0, 0), shape).copy_from(covariance);
        Ok(QualifiedTip {
            offset: std::array::from_fn(|k| {
                let at = kept.iter().position(|u| *u == ProbeUnknown::Tip(k))?;
                let gain = gains.row(at);
                let variance = (gain * &of_seen).dot(&gain) + wander * inverse[(at, at)];
                Some((found[at], variance.max(0.0).sqrt()))
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
