//! Special features of a drawing.

use super::Case;
use std::fmt;
use std::ops::AddAssign;
use trueaxis_model::errors::ParameterKind;
use trueaxis_model::machine::Axis;
use trueaxis_model::validate::is_partly_calibrated;

/// What a drawing may have, in the order of [`Kinds`].
const NAMES: [&str; 10] = [
    "three rotary",
    // Two linear axes in the same direction.
    "quill",
    // A rotary travel of at most ±10°.
    "narrow",
    // In every motion of every axis that is not endless.
    "degree 3",
    // An endless axis with harmonics.
    "endless",
    // Measured points.
    "tabulated",
    // Measured points for each direction of travel.
    "reversal",
    // Errors that change with temperatures.
    "thermal",
    // Motions that are unknown in part of the travel.
    "partly",
    // The tool length is an input.
    "length",
];

/// Number of drawings of each kind; 0 or 1 for a single drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds([usize; NAMES.len()]);

impl Kinds {
    /// The kinds of one drawing.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let (machine, errors) = (&case.machine, &case.errors);
        let rotary = machine.axes.iter().filter(|a| a.letter.is_rotary());
        let count = rotary.clone().count();
        let mut widths = rotary.map(|a| a.travel[1] - a.travel[0]);
        let has = |axis: &Axis, component: usize, wanted: fn(ParameterKind) -> bool| {
            let place = (component, axis.letter.char());
            let mut parameters = errors.parameters.keys();
            parameters.any(|p| (p.component, p.axis) == place && wanted(p.kind))
        };
        let degree_3 = |kind| kind == ParameterKind::Degree(3);
        let harmonic = |kind| matches!(kind, ParameterKind::Cosine(_) | ParameterKind::Sine(_));
        let mut limited = machine.axes.iter().filter(|a| !a.modulo);
        let mut endless = machine.axes.iter().filter(|a| a.modulo);
        let motions = errors.motions.iter().flatten();
        let mut tables = motions.filter_map(|m| m.table.as_ref());
        let kinds = [
            count == 3,
            machine.axes.len() - count > 3,
            widths.any(|width| width <= 20.0),
            limited.all(|a| (0..6).all(|c| has(a, c, degree_3))),
            endless.any(|a| (0..6).any(|c| has(a, c, harmonic))),
            tables.clone().next().is_some(),
            tables.any(|t| t.negative.is_some()),
            !errors.sensors.is_empty(),
            is_partly_calibrated(machine, errors),
            machine.length_range.is_some(),
        ];
        Self(kinds.map(usize::from))
    }

    /// True if there are drawings of this kind.
    #[must_use]
    pub fn has(&self, kind: &str) -> bool {
        self.named().any(|(name, count)| name == kind && count > 0)
    }

    fn named(&self) -> impl Iterator<Item = (&'static str, usize)> {
        NAMES.into_iter().zip(self.0)
    }

    /// The names of the kinds present.
    #[must_use]
    pub fn names(&self) -> String {
        let names = self.named().filter(|(_, count)| *count > 0);
        names.map(|(name, _)| name).collect::<Vec<_>>().join(", ")
    }
}

impl AddAssign for Kinds {
    fn add_assign(&mut self, other: Self) {
        for (sum, count) in self.0.iter_mut().zip(other.0) {
            *sum += count;
        }
    }
}

impl fmt::Display for Kinds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.named().map(|(name, count)| format!("{count} {name}"));
        f.write_str(&words.collect::<Vec<_>>().join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ALL, cases};
    use super::*;

    #[test]
    fn there_are_enough_of_every_kind_and_every_tenth_has_all_kinds() {
        let all = cases(ALL);
        let (mut many, mut few) = (Kinds::default(), Kinds::default());
        for (number, case) in all.iter().enumerate() {
            let kinds = Kinds::of(case);
            many += kinds;
            if number % 10 == 0 {
                few += kinds;
            }
        }
        println!("{many}\n{few}");
        for ((name, many), (_, few)) in many.named().zip(few.named()) {
            let least = match name {
                "narrow" | "degree 3" => 60,
                "quill" | "endless" | "tabulated" => 30,
                _ => 20,
            };
            assert!(
                many >= least && few >= 1,
                "{name}: {many}, every tenth: {few}"
            );
        }
        let axes = all.iter().map(|c| c.machine.axes.len());
        for n in 3..=6 {
            assert!(axes.clone().any(|m| m == n), "no machine of {n} axes");
        }
    }
}
