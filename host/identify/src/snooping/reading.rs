//! What readings may be instead of what they are declared to be.

use super::CRITICAL;
use crate::instrument::Kind;

/// What readings are instead of what they are declared to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misread {
    /// What they are, as the end of a clause: `to be in mm instead of µm`.
    pub what: &'static str,
    /// What deviations in the file have to be multiplied by.
    pub factor: f64,
}

const fn misread(what: &'static str, factor: f64) -> Misread {
    Misread { what, factor }
}

pub(super) const OTHER_SIGN: Misread = misread("as if they count the other way", -1.0);
/// What displacements and angles may be instead.
const DISPLACEMENTS: [Misread; 4] = [
    OTHER_SIGN,
    misread("to be in mm instead of µm", 1e3),
    misread("to be in inches instead of µm", 25.4e3),
    misread("to be in nm instead of µm", 1e-3),
];
const ANGLES: [Misread; 4] = [
    OTHER_SIGN,
    misread("to be in arcseconds instead of µrad", 4.848_136_811),
    misread("to be in mrad instead of µrad", 1e3),
    misread("to be in degrees instead of µrad", 17_453.292_52),
];

impl Misread {
    /// The one that a measured factor with its standard uncertainty is, if it is any. Zero is the factor of errors that
    /// the model lacks.
    pub(super) fn of(kind: Kind, factor: f64, uncertainty: f64) -> Option<Self> {
        let all: &[Self] = match kind {
            Kind::Displacement | Kind::Surface => &DISPLACEMENTS,
            Kind::Angle => &ANGLES,
            Kind::Length => &DISPLACEMENTS[..1],
            Kind::Point => &[],
        };
        let is_clear = factor.abs() > CRITICAL * uncertainty;
        let is_near = |one: &&Self| (factor - one.factor).abs() < NEAR * one.factor.abs();
        all.iter().find(is_near).copied().filter(|_| is_clear)
    }
}

/// A measured factor is a known one if it is nearer to it than to 0. It is found too small rather than too large: smaller
/// readings have less noise, too, and with a small stated uncertainty the machine was fitted to them.
const NEAR: f64 = 0.5;
