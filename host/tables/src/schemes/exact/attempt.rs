//! One choice of functions, tables and terms.

use super::basis::{Basis, Choice};
use super::core;
use super::cover::{Cover, Minimize};
use super::limits::BASIS_SHARE;
use super::sampling::{Component, Sampler};
use super::structure::Structure;
use super::tables::Decomposition;
use crate::target::Target;
use trueaxis_model::kinematics::{NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::parallel;

/// Bases and terms for one limit on what may be left out.
pub struct Attempt {
    bases: Vec<Basis>,
    pub structure: Structure,
    /// True if more terms or tables are needed than the target holds.
    pub is_full: bool,
    /// What was left out, in units of the tolerance.
    pub left_out: f64,
}

impl Attempt {
    /// The functions of every variable.
    pub fn bases(&self) -> &[Basis] {
        &self.bases
    }

    /// The same, with everything that its tables are sampled from.
    pub fn found<'a>(
        &'a self,
        sampler: &'a Sampler<'a>,
        components: &'a [Component],
        tolerance: &'a PerAxis,
    ) -> Decomposition<'a> {
        Decomposition {
            sampler,
            components,
            bases: &self.bases,
            tolerance,
            structure: &self.structure,
        }
    }
}

/// Finds the functions of every variable, if the structure may leave out `share` of the tolerance.
pub fn bases(
    sampler: &Sampler<'_>,
    components: &[Component],
    tolerance: &PerAxis,
    minimize: Minimize,
    share: f64,
) -> Result<Vec<Basis>, NotConverged> {
    let choice = Choice {
        degree: if minimize == Minimize::Tables { 5 } else { 4 },
        leave: BASIS_SHARE * share,
    };
    let variables: Vec<_> = sampler.variables.iter().enumerate().collect();
    parallel::try_map(&variables, |(v, variable)| match variable.is_rich() {
        true => Basis::find(*v, sampler, components, tolerance, choice),
        false => Ok(Basis::of_lever(variable)),
    })
}

/// True if the target holds the terms that leave out no more than `share` of the tolerance.
pub fn fits(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: &[Basis],
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
) -> Result<bool, NotConverged> {
    let entries = core::entries(sampler, components, bases, tolerance, 0.0)?;
    let cover = Cover::new(&entries, &sampler.variables, bases, minimize);
    Ok(cover
        .choose(share, target.tables * 2 / 3, target.terms)
        .is_some_and(|structure| structure.count() <= target.tables))
}

/// Finds terms that leave out no more than `share` of the tolerance, or as little as the target allows. `before` is the
/// part that an earlier attempt had to leave out.
pub fn attempt(
    sampler: &Sampler<'_>,
    components: &[Component],
    bases: Vec<Basis>,
    tolerance: &PerAxis,
    (minimize, target): (Minimize, &Target),
    share: f64,
    before: f64,
) -> Result<Attempt, NotConverged> {
    let entries = core::entries(sampler, components, &bases, tolerance, before)?;
    let direction = matches!(sampler.kinematics.policy, Policy::Direction { .. });
    let cover = Cover::new(&entries, &sampler.variables, &bases, minimize).pruned(direction);
    let choose = |share: f64| {
        let structure = cover.choose(share, target.tables * 2 / 3, target.terms);
        structure.filter(|s| s.count() <= target.tables)
    };
    let (mut structure, mut left_out) = (choose(share), share);
    let is_full = structure.is_none();
    if is_full {
        // Leave out the smallest entries that the target cannot hold; verification shows the effect. With everything
        // left out it certainly fits: bisect on a logarithmic scale.
        let (mut too_little, mut enough) = (share, cover.share_of_nothing().max(share));
        for _ in 0..8 {
            let between = (too_little * enough).sqrt();
            match choose(between) {
                None => too_little = between,
                fits => (enough, structure) = (between, fits),
            }
        }
        left_out = enough;
    }
    let structure = structure.unwrap_or_default();
    Ok(Attempt {
        bases,
        structure,
        is_full,
        left_out,
    })
}
