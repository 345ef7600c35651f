//! Error motions that are solved for.

use std::collections::BTreeMap;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Table};
use trueaxis_model::machine::{Axis, Machine};

/// An error motion found from runs of the axis.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundMotion {
    /// The axis (by index).
    pub axis: usize,
    /// Component 0…5 of `[x y z a b c]`.
    pub component: usize,
    /// The targets (mm or rad).
    pub at: Vec<f64>,
    /// After positive travel, or in the only direction measured (mm or rad).
    pub positive: Vec<f64>,
    /// After negative travel, if both directions were measured.
    pub negative: Option<Vec<f64>>,
    /// Standard uncertainty (mm or rad) of a value, from the scatter of the runs, if there are several.
    pub uncertainty: Option<f64>,
    /// That of [`Self::backlash`].
    pub backlash_uncertainty: Option<f64>,
    /// The measurement (by index) that contributes most to it.
    pub from: usize,
}

impl FoundMotion {
    /// Name, `EXX`.
    #[must_use]
    pub fn name(&self, machine: &Machine) -> String {
        name(machine, self.axis, self.component)
    }

    /// The values of both directions of travel.
    pub fn all_values(&self) -> impl Iterator<Item = &f64> {
        self.positive.iter().chain(self.negative.iter().flatten())
    }

    /// Values for a direction of travel.
    pub(crate) fn values(&mut self, direction: f64) -> &mut Vec<f64> {
        match &mut self.negative {
            Some(negative) if direction < 0.0 => negative,
            _ => &mut self.positive,
        }
    }

    /// Half of the mean reversal value (mm or rad).
    #[must_use]
    pub fn backlash(&self) -> Option<f64> {
        let negative = self.negative.as_ref()?;
        let pairs = self.positive.iter().zip(negative);
        let sum: f64 = pairs.map(|(p, n)| 0.5 * (p - n)).sum();
        Some(sum / self.positive.len() as f64)
    }

    /// The motion as a table; that of an axis without limits covers the whole turn and is periodic.
    #[must_use]
    pub fn table(&self, axis: &Axis) -> Table {
        let values = |values: &[f64]| match axis.modulo {
            true => closed(&self.at, values, axis.travel.map(|t| axis.to_kinematic(t))),
            false => (self.at.clone(), values.to_vec()),
        };
        let (at, positive) = values(&self.positive);
        let negative = self.negative.as_ref().map(|n| values(n).1);
        Table {
            at,
            positive,
            negative,
        }
    }

    /// This motion with the mean of both directions and one number for the backlash.
    #[must_use]
    pub(crate) fn with_one_number(&self) -> Self {
        let negative = self.negative.as_ref().unwrap_or(&self.positive);
        let pairs = self.positive.iter().zip(negative);
        Self {
            positive: pairs.map(|(p, n)| 0.5 * (p + n)).collect(),
            negative: None,
            uncertainty: (self.uncertainty).map(|u| match self.negative {
                Some(_) => u / 2.0_f64.sqrt(),
                None => u,
            }),
            ..self.clone()
        }
    }
}

/// The name of a motion, `EXX`.
pub fn name(machine: &Machine, axis: usize, component: usize) -> String {
    let constant = Parameter {
        component,
        axis: machine.axes[axis].letter.char(),
        kind: ParameterKind::Degree(0),
    };
    constant.to_string()[..3].to_owned()
}

/// A target this close (rad) to the end of a turn counts as at the end.
const AT_END: f64 = 1e-9;

/// Values over a whole turn, equal at both ends: their mean if both were measured, otherwise interpolated linearly
/// over the seam.
fn closed(at: &[f64], values: &[f64], [low, high]: [f64; 2]) -> (Vec<f64>, Vec<f64>) {
    let (first, last) = (at[0], at[at.len() - 1]);
    let (v0, v1) = (values[0], values[values.len() - 1]);
    let (is_low, is_high) = (first <= low + AT_END, last >= high - AT_END);
    let seam = match (is_low, is_high) {
        (true, true) => 0.5 * (v0 + v1),
        (true, false) => v0,
        (false, true) => v1,
        // From the last target to the first one of the next turn.
        (false, false) => v1 + (v0 - v1) * (high - last) / (high - last + first - low),
    };
    let inner = at.iter().zip(values);
    let inner = inner.filter(|(a, _)| **a > low + AT_END && **a < high - AT_END);
    let ends = [(low, seam), (high, seam)];
    let inner = inner.map(|(a, v)| (*a, *v));
    std::iter::once(ends[0])
        .chain(inner)
        .chain([ends[1]])
        .unzip()
}

/// The known errors without locations and without the motions that were measured again; `reverses` says whether in
/// both directions.
pub fn without(
    known: &ErrorModel,
    machine: &Machine,
    motions: &[(usize, usize, bool)],
    locations: &[Parameter],
) -> ErrorModel {
    let anew = |axis: usize, component: usize| {
        let same = |m: &&(usize, usize, bool)| (m.0, m.1) == (axis, component);
        motions.iter().find(same)
    };
    let is_old = |p: &Parameter| {
        let motion = machine.index(p.axis).and_then(|i| anew(i, p.component));
        match p.kind {
            ParameterKind::Inter => locations.contains(p),
            ParameterKind::Backlash => motion.is_some_and(|(_, _, reverses)| *reverses),
            _ => motion.is_some(),
        }
    };
    let mut model = ErrorModel::perfect(machine);
    for (parameter, value) in known.parameters.iter().filter(|(p, _)| !is_old(p)) {
        model.set(machine, *parameter, *value);
    }
    let left = |of: &BTreeMap<Parameter, f64>| {
        let left = of.iter().filter(|(p, _)| !is_old(p));
        left.map(|(p, value)| (*p, *value)).collect()
    };
    model.standard_uncertainty = left(&known.standard_uncertainty);
    model.unseen = left(&known.unseen);
    model.misfit = known.misfit;
    model.misfit_of_direction = known.misfit_of_direction;
    for axis in 0..machine.axes.len() {
        for (component, motion) in known.motions[axis].iter().enumerate() {
            if let (Some(table), None) = (&motion.table, anew(axis, component)) {
                model.tabulate(axis, component, table.clone());
                let uncertain = known.table_uncertainty.get_key_value(&(axis, component));
                (model.table_uncertainty).extend(uncertain.map(|(of, u)| (*of, u.clone())));
            }
        }
        // Motions known before hold where they were known; if none remain, where the tables have points.
        let is_measured = motions.iter().any(|m| m.0 == axis);
        if !is_measured || model.motions[axis].iter().any(|m| !m.is_zero()) {
            model.calibrated[axis] = known.calibrated[axis];
        }
    }
    model
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_closed_with_what_was_measured_at_its_ends_or_next_to_them() {
        let turn = [0.0, 4.0];
        for (at, values, seam) in [
            // Both ends measured: their mean. One end: its value.
            (vec![0.0, 1.0, 4.0], vec![1.0, 5.0, 3.0], 2.0),
            (vec![0.0, 1.0, 3.0], vec![1.0, 5.0, 3.0], 1.0),
            (vec![1.0, 3.0, 4.0], vec![5.0, 1.0, 3.0], 3.0),
            // Neither: on the line from 3 at 3 to 6 at 4 + 0.5.
            (vec![0.5, 1.0, 3.0], vec![6.0, 5.0, 3.0], 5.0),
        ] {
            let (all, closed) = closed(&at, &values, turn);
            assert_eq!((all[0], all[all.len() - 1]), (0.0, 4.0));
            assert_eq!([closed[0], closed[closed.len() - 1]], [seam; 2], "{at:?}");
            let inner = at.iter().zip(&values);
            for (q, v) in inner.filter(|(q, _)| **q > 0.0 && **q < 4.0) {
                let k = all.iter().position(|a| a == q).unwrap();
                assert_eq!(closed[k], *v);
            }
        }
    }
}
