//! Hypotheses about more than one row.

use super::{OTHER_SIGN, OutlierKind, SAME};
use crate::instrument::{Kind, SettingPart};
use crate::rows::Problem;
use crate::rows::by_row;
use crate::{Unknown, root_mean_square};
use nalgebra::{DMatrix, Matrix3};
use std::ops::Range;
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::numbers::ascending;

/// Displacement of the tip in some of the places: a column for each unknown of a hypothesis.
pub(super) struct DisplacementGroup {
    pub kind: OutlierKind,
    /// Places in the order in which they were probed, or observations after them in the order of their files.
    pub places: Vec<usize>,
    /// The effect in each place: coordinates × unknowns, in mm.
    pub effects: Vec<DMatrix<f64>>,
    /// True if every tail of the places is a hypothesis of its own: a change from then on.
    pub is_from: bool,
}

/// All hypotheses about groups. `stylus` is the derivative of the tip by the stylus in each place.
pub(super) fn groups(problem: &Problem<'_>, stylus: &[Matrix3<f64>]) -> Vec<DisplacementGroup> {
    let places = &problem.places;
    let probed = by_row(places);
    let mut groups = DisplacementGroups {
        problem,
        probed: &probed,
        groups: Vec::new(),
    };
    for (ball, name) in problem.balls.iter().enumerate() {
        let rows = groups.of(&|i| places[i].ball == ball);
        let kind = OutlierKind::Ball(name.clone());
        groups.add(kind, rows, &|_| DMatrix::identity(3, 3), true);
    }
    for setup in 0..problem.observed.setups.len() {
        groups.add_setup(setup);
    }
    // The displacement that is missing at the tip.
    let at_stylus = |i: usize| -DMatrix::from_column_slice(3, 3, stylus[i].as_slice());
    groups.add(OutlierKind::Stylus, probed.clone(), &at_stylus, true);
    for i in 0..problem.machine.axes.len() {
        groups.add_positions(i);
    }
    let angles = values(probed.iter().map(|p| places[*p].spindle));
    for angle in angles.iter().skip(1) {
        let rows = groups.of(&|place| (places[place].spindle - angle).abs() < SAME);
        groups.add(OutlierKind::Spindle(*angle), rows, &at_stylus, false);
    }
    groups.groups
}

struct DisplacementGroups<'a> {
    problem: &'a Problem<'a>,
    /// Places in the order in which they were probed.
    probed: &'a [usize],
    groups: Vec<DisplacementGroup>,
}

impl DisplacementGroups<'_> {
    fn add(
        &mut self,
        kind: OutlierKind,
        places: Vec<usize>,
        effect: &dyn Fn(usize) -> DMatrix<f64>,
        is_from: bool,
    ) {
        if places.len() > 1 {
            self.groups.push(DisplacementGroup {
                effects: places.iter().map(|i| effect(*i)).collect(),
                kind,
                places,
                is_from,
            });
        }
    }

    /// Some of the probings.
    fn of(&self, is_in: &dyn Fn(usize) -> bool) -> Vec<usize> {
        let probed = self.probed.iter().copied();
        probed.filter(|i| is_in(*i)).collect()
    }

    /// A set-up that has moved, and one whose readings are something else.
    fn add_setup(&mut self, setup: usize) {
        let observed = &self.problem.observed;
        let (name, kind, _) = &observed.setups[setup];
        let first = self.problem.places.len();
        let own: Vec<usize> = (observed.rows.iter().enumerate())
            .filter(|(_, row)| row.setup == setup)
            .map(|(i, _)| i)
            .collect();
        let places: Vec<usize> = own.iter().map(|i| first + i).collect();
        let size = kind.dimension();
        let moved = OutlierKind::Setup(name.clone());
        let too_large = -DMatrix::identity(size, size);
        self.add(moved, places.clone(), &|_| too_large.clone(), true);
        if *kind == Kind::Point {
            return;
        }
        // The zero of an instrument says nothing, not even where it is known: deviations may be from any length.
        let mean = own.iter().map(|i| observed.rows[*i].read.x).sum::<f64>() / own.len() as f64;
        let read = |i: usize| observed.rows[i].read.x - mean;
        let spread = root_mean_square(own.iter().map(|i| read(*i)));
        let dead_length = Unknown::Setup(setup, SettingPart::Length);
        let is_zero_known = observed.known.iter().any(|(of, ..)| *of == dead_length);
        let columns = |place: usize| {
            let columns = [-read(place - first), -spread];
            let count = if is_zero_known { 2 } else { 1 };
            DMatrix::from_row_slice(1, count, &columns[..count])
        };
        let misread = OutlierKind::Reading(name.clone(), OTHER_SIGN);
        self.add(misread, places, &columns, false);
    }

    /// The positions of a rotary axis.
    fn add_positions(&mut self, i: usize) {
        let problem = self.problem;
        let axis = &problem.machine.axes[i];
        if !axis.letter.is_rotary() {
            return;
        }
        let commands = problem.commands().count();
        let all = self.probed.iter().copied();
        let all: Vec<usize> = all.chain(problem.places.len()..commands).collect();
        let positions: Vec<&PerAxis> = problem.commands().map(|(q, _)| q).collect();
        let blocks: Vec<Range<usize>> = problem.blocks().collect();
        let own = Unknown::Parameter(Parameter {
            component: axis.letter.component() + 3,
            axis: axis.letter.char(),
            kind: ParameterKind::Degree(0),
        });
        let turn = problem.derivatives(&[own], &problem.start(), &problem.unweighted(1.0));
        let turn = |i: usize| -turn.rows_range(blocks[i].clone()).into_owned();
        let position = |place: usize| digits(axis.to_command(positions[place][i]));
        for value in values(all.iter().map(|p| position(*p))) {
            let is_in = |place: &usize| (position(*place) - value).abs() < SAME;
            let rows: Vec<usize> = all.iter().copied().filter(is_in).collect();
            // Nothing is known about an axis that does not move.
            if rows.len() < all.len() {
                let kind = OutlierKind::Index(axis.letter.char(), value);
                self.add(kind, rows, &turn, false);
            }
        }
    }
}

/// A position rounded as in a file: without rounding errors from radians.
fn digits(position: f64) -> f64 {
    (position * 1e6).round() / 1e6
}

/// The distinct values.
fn values(all: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = all.collect();
    ascending(&mut values);
    values.dedup_by(|a, b| (*a - *b).abs() < SAME);
    values
}
