//! Special features of a drawing.

use super::Case;
use std::fmt;
use std::ops::AddAssign;
use trueaxis_model::errors::ParameterKind;
use trueaxis_tables::validate::is_partly_calibrated;

/// Number of drawings of each kind; 0 or 1 for a single drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kinds {
    /// Three rotary axes.
    pub three_rotary: usize,
    /// Two linear axes in the same direction.
    pub quill: usize,
    /// A rotary travel of at most ±10°.
    pub narrow: usize,
    /// Degree 3 in every motion of every axis that is not endless.
    pub degree_3: usize,
    /// An endless axis with harmonics.
    pub endless: usize,
    /// Measured points.
    pub tabulated: usize,
    /// Measured points for each direction of travel.
    pub reversal: usize,
    /// Errors that change with temperatures.
    pub thermal: usize,
    /// Motions that are unknown in part of the travel.
    pub partly: usize,
    /// The tool length is an input.
    pub length: usize,
}

impl Kinds {
    /// The kinds of one drawing.
    #[must_use]
    pub fn of(case: &Case) -> Self {
        let (machine, errors) = (&case.machine, &case.errors);
        let rotary = machine.axes.iter().filter(|a| a.letter.is_rotary());
        let has = |component: usize, axis: char, wanted: fn(ParameterKind) -> bool| {
            let of = |p: &&trueaxis_model::errors::Parameter| {
                (p.component, p.axis) == (component, axis) && wanted(p.kind)
            };
            errors.parameters.keys().any(|p| of(&p))
        };
        let degree_3 = |kind| kind == ParameterKind::Degree(3);
        let harmonic = |kind| matches!(kind, ParameterKind::Cosine(_) | ParameterKind::Sine(_));
        let limited = machine.axes.iter().filter(|a| !a.modulo);
        let mut endless = machine.axes.iter().filter(|a| a.modulo);
        let mut tables = errors
            .motions
            .iter()
            .flatten()
            .filter_map(|m| m.table.as_ref());
        Self {
            three_rotary: (rotary.clone().count() == 3).into(),
            quill: (machine.axes.len() - rotary.clone().count() > 3).into(),
            narrow: rotary
                .map(|a| a.travel[1] - a.travel[0])
                .any(|width| width <= 20.0)
                .into(),
            degree_3: limited
                .map(|a| a.letter.char())
                .all(|a| (0..6).all(|c| has(c, a, degree_3)))
                .into(),
            endless: endless
                .any(|a| (0..6).any(|c| has(c, a.letter.char(), harmonic)))
                .into(),
            tabulated: tables.clone().next().is_some().into(),
            reversal: tables.any(|t| t.negative.is_some()).into(),
            thermal: (!errors.sensors.is_empty()).into(),
            partly: is_partly_calibrated(machine, errors).into(),
            length: machine.length_range.is_some().into(),
        }
    }

    fn named(&self) -> [(&'static str, usize); 10] {
        [
            ("three rotary", self.three_rotary),
            ("quill", self.quill),
            ("narrow", self.narrow),
            ("degree 3", self.degree_3),
            ("endless", self.endless),
            ("tabulated", self.tabulated),
            ("reversal", self.reversal),
            ("thermal", self.thermal),
            ("partly", self.partly),
            ("length", self.length),
        ]
    }

    /// The names of the kinds present.
    #[must_use]
    pub fn names(&self) -> String {
        let names = self.named().into_iter().filter(|(_, count)| *count > 0);
        names.map(|(name, _)| name).collect::<Vec<_>>().join(", ")
    }
}

impl AddAssign for Kinds {
    fn add_assign(&mut self, other: Self) {
        self.three_rotary += other.three_rotary;
        self.quill += other.quill;
        self.narrow += other.narrow;
        self.degree_3 += other.degree_3;
        self.endless += other.endless;
        self.tabulated += other.tabulated;
        self.reversal += other.reversal;
        self.thermal += other.thermal;
        self.partly += other.partly;
        self.length += other.length;
    }
}

impl fmt::Display for Kinds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self.named().map(|(name, count)| format!("{count} {name}"));
        f.write_str(&words.join(", "))
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
        assert!(many.three_rotary >= 20, "{many}");
        assert!(many.quill >= 30, "{many}");
        assert!(many.narrow >= 60, "{many}");
        assert!(many.degree_3 >= 60, "{many}");
        assert!(many.endless >= 30, "{many}");
        assert!(many.tabulated >= 30, "{many}");
        for (name, count) in many.named() {
            assert!(count >= 20, "{name}: {count}");
        }
        for (name, count) in few.named() {
            assert!(count >= 1, "no {name} among every tenth");
        }
        let axes = all.iter().map(|c| c.machine.axes.len());
        for n in 3..=6 {
            assert!(axes.clone().any(|m| m == n), "no machine of {n} axes");
        }
    }
}
