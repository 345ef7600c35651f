//! What a decision rests on: an interval from the model proves nothing where the measurements refute the model, where no
//! length reference was measured, beyond the probed zone, or where an error that was not measured matters.

use super::calibration::CalibrationRecord;
use super::expected::matters;
use super::limits::{Decision, Quantity};
use crate::picture::tick;
use crate::{ReportFigures, Subject};
use trueaxis_model::errors::{Parameter, ParameterKind};
use trueaxis_model::validate::calibrated;

/// Rounding of probed ranges in error files (mm, deg).
const ROUNDED: f64 = 1e-3;

/// A parameter is one of the machine if it was measured along this part of the travel at least.
const HALF: f64 = 0.5;

/// What the decisions about all limits rest on.
pub(super) struct Grounds<'a> {
    subject: &'a Subject<'a>,
    report: &'a ReportFigures,
    stated: &'a CalibrationRecord,
}

impl<'a> Grounds<'a> {
    pub fn new(
        subject: &'a Subject<'a>,
        report: &'a ReportFigures,
        stated: &'a CalibrationRecord,
    ) -> Self {
        Self {
            subject,
            report,
            stated,
        }
    }

    /// The decision that an interval supports, and the reason if it would decide but its grounds do not.
    pub fn allow(&self, quantity: Quantity, of_interval: Decision) -> (Decision, Option<String>) {
        let doubt = match of_interval {
            Decision::NotDecided => None,
            Decision::Fail => self.doubt(quantity),
            // A wrong "fail" costs another measurement, a wrong "pass" the part.
            Decision::Pass => self
                .doubt(quantity)
                .or_else(|| self.not_stated(quantity))
                .or_else(|| self.between(quantity)),
        };
        match doubt {
            None => (of_interval, None),
            Some(why) => (Decision::NotDecided, Some(why)),
        }
    }

    /// Why a value has no interval.
    pub fn unknown(&self, quantity: Quantity) -> &'static str {
        match quantity {
            Quantity::Volumetric { at_tip: false, .. }
                if !self.subject.errors.is_direction_measured() =>
            {
                "directions were not measured: balls show only the tip"
            }
            _ => "its uncertainty is unknown",
        }
    }

    /// Why the interval may be wrong.
    fn doubt(&self, quantity: Quantity) -> Option<String> {
        // A validation measures the result itself.
        if matches!(quantity, Quantity::Validation { .. }) {
            return None;
        }
        let identification = self.report.identification.as_ref();
        if identification.is_some_and(|found| !found.fits()) {
            return Some(
                "the residuals exceed the stated noise: the machine has errors that the model lacks"
                    .to_owned(),
            );
        }
        let errors = self.subject.errors;
        let missing = errors.missing_scales(self.subject.machine);
        match &missing[..] {
            [scale, ..] if depends_on_length(quantity) => {
                return Some(format!(
                    "no length reference: the scale of {} was not measured",
                    scale.axis
                ));
            }
            [a, b, ..] if matches!(quantity, Quantity::Circle('G', _)) => {
                return Some(format!(
                    "the scales of {} and {} were not measured, not even relative to each other",
                    a.axis, b.axis
                ));
            }
            _ => {}
        }
        self.not_measured(quantity)
            .or_else(|| self.reversal(quantity))
            .or_else(|| self.beyond(quantity))
            .or_else(|| self.partly(quantity))
            .or_else(|| self.exact(quantity))
    }

    /// A parameter of which little of the travel shows: a bow or a yaw there is a squareness, too.
    fn partly(&self, quantity: Quantity) -> Option<String> {
        let Quantity::Parameter(parameter) = quantity else {
            return None;
        };
        let machine = self.subject.machine;
        let axis = &machine.axes[machine.index(parameter.axis)?];
        let travel = axis.travel[1] - axis.travel[0];
        // A turn is all that there is of a location.
        let whole = match axis.letter.is_rotary() {
            true if axis.modulo => 360.0,
            true => travel.min(360.0),
            false => travel,
        };
        let identification = self.report.identification.as_ref()?;
        let mut probed = identification.probed.iter();
        let [from, to] = probed.find(|one| one.axis == parameter.axis)?.range;
        (to - from < HALF * whole).then(|| {
            let [from, to] = [from, to].map(tick);
            format!("{} was measured only from {from} to {to}", parameter.axis)
        })
    }

    /// The first error that changes the quantity and counts as exact.
    fn exact(&self, quantity: Quantity) -> Option<String> {
        let (machine, errors) = (self.subject.machine, self.subject.errors);
        let covariance = errors.covariance();
        let parameters = errors.parameters.keys();
        let mut parameters = parameters.filter(|p| !covariance.parameters.contains(p));
        if let Some(one) = parameters.find(|p| matters(self.subject, **p, quantity)) {
            return Some(format!("{one} has no uncertainty"));
        }
        let indexed = errors.motions.iter().enumerate();
        let motions = indexed.flat_map(|(index, motions)| {
            let of_axis = motions.iter().enumerate();
            of_axis.map(move |(component, motion)| (index, component, motion))
        });
        let mut exact = motions.filter(|(index, component, motion)| {
            motion.table.is_some() && !errors.table_uncertainty.contains_key(&(*index, *component))
        });
        exact.find_map(|(index, component, _)| {
            let axis = machine.axes.get(index)?.letter.char();
            // A slope has no reversal.
            let kinds = [ParameterKind::Degree(1), ParameterKind::Backlash];
            let mut motions = kinds
                .map(|kind| Parameter {
                    component,
                    axis,
                    kind,
                })
                .into_iter();
            let motion = motions.find(|motion| matters(self.subject, *motion, quantity))?;
            let name = &motion.to_string()[..3];
            Some(format!("{name} has no uncertainty, as from a single run"))
        })
    }

    /// The first axis whose reversal is limited and whose backlash is not among the errors: without directions of travel in
    /// the file, nothing was measured of it.
    fn reversal(&self, quantity: Quantity) -> Option<String> {
        let (machine, errors) = (self.subject.machine, self.subject.errors);
        let axes = match quantity {
            Quantity::Positioning('B', axis) => vec![axis],
            Quantity::Circle('H', plane) => plane.to_vec(),
            _ => return None,
        };
        let is_known = |axis: &char| {
            let backlash = Parameter {
                kind: ParameterKind::Backlash,
                ..Parameter::scale(*axis)
            };
            errors.parameters.contains_key(&backlash) || errors.is_tabulated(machine, &backlash)
        };
        axes.into_iter().find(|axis| !is_known(axis)).map(backlash)
    }

    /// The first error that was not measured and changes the quantity. Scales have their own rule: what all axes have in
    /// common does not change form.
    fn not_measured(&self, quantity: Quantity) -> Option<String> {
        let unseen = self.subject.errors.unseen.keys();
        let mut unseen = unseen.filter(|p| **p != Parameter::scale(p.axis));
        let one = unseen.find(|p| matters(self.subject, **p, quantity))?;
        Some(match one.kind {
            ParameterKind::Backlash => backlash(one.axis),
            _ => format!("{one} was not measured"),
        })
    }

    /// The first axis whose use by the quantity is not within the probed range.
    fn beyond(&self, quantity: Quantity) -> Option<String> {
        let machine = self.subject.machine;
        let identification = self.report.identification.as_ref();
        let mut axes = machine.axes.iter().enumerate();
        axes.find_map(|(index, axis)| {
            let letter = axis.letter.char();
            let [from, to] = self.used(quantity, index)?;
            let [mut low, mut high] = calibrated(machine, self.subject.errors, index);
            // An error file states no range of an axis that stood still.
            let mut probed = identification.iter().flat_map(|found| &found.probed);
            let still =
                probed.find(|one| one.axis == letter && one.range[1] - one.range[0] < ROUNDED);
            if let Some(still) = still {
                [low, high] = still.range;
            }
            let is_whole_turn = axis.modulo && high - low >= 360.0 - ROUNDED;
            let is_within = from >= low - ROUNDED && to <= high + ROUNDED;
            (!is_within && !is_whole_turn).then(|| {
                let [from, to, low, high] = [from, to, low, high].map(tick);
                format!(
                    "it needs {letter} from {from} to {to}, and only {low} to {high} was probed"
                )
            })
        })
    }

    /// The first axis along which errors may repeat that no measured position shows, unless their size is stated.
    fn between(&self, quantity: Quantity) -> Option<String> {
        if self.stated.uncertainty.periodic_um.is_some() {
            return None;
        }
        let axes = self.subject.machine.axes.iter().enumerate();
        let mut moved = axes.filter(|(index, _)| {
            let used = self.used(quantity, *index);
            used.is_some_and(|[from, to]| to - from > ROUNDED)
        });
        let identification = self.report.identification.as_ref()?;
        moved.find_map(|(_, axis)| {
            let letter = axis.letter.char();
            let mut probed = identification.probed.iter();
            let probed = probed.find(|one| one.axis == letter)?;
            let changes = |name: &String| {
                Parameter::parse_motion(name).is_some_and(|(component, axis)| {
                    let kind = ParameterKind::Degree(1);
                    let motion = Parameter {
                        component,
                        axis,
                        kind,
                    };
                    matters(self.subject, motion, quantity)
                })
            };
            let Some(hidden) = &probed.hidden else {
                return Some(
                    "the identification is of an older version, which does not say what positions hide: run `identify` again"
                        .to_owned(),
                );
            };
            let mut hidden = hidden.iter();
            let hidden = hidden.find(|hidden| hidden.motions.iter().any(changes))?;
            Some(format!(
                "{}: measure at others, or state their size as periodic_um under [uncertainty]",
                hidden.sentence(letter)
            ))
        })
    }

    /// The range of an axis (mm, deg) that the quantity depends on; `None` if it is of no position.
    fn used(&self, quantity: Quantity, index: usize) -> Option<[f64; 2]> {
        let axis = &self.subject.machine.axes[index];
        let letter = axis.letter.char();
        let [low, high] = axis.travel;
        let middle = 0.5 * (low + high);
        let resting = match axis.letter.is_rotary() {
            true => 0.0_f64.clamp(low, high),
            false => middle,
        };
        let still = Some([resting, resting]);
        match quantity {
            Quantity::Parameter(_) | Quantity::Validation { .. } => None,
            Quantity::Volumetric {
                is_probed: true, ..
            } => Some(calibrated(self.subject.machine, self.subject.errors, index)),
            Quantity::Volumetric { .. } => Some(axis.travel),
            Quantity::Positioning(_, moved) if moved == letter => Some(axis.travel),
            Quantity::Diagonal(_) if "XYZ".contains(letter) => Some(axis.travel),
            Quantity::Circle(_, plane) if plane.contains(&letter) => {
                let plane: String = plane.iter().collect();
                let mut circles = self.report.tests.circles.iter();
                let radius = circles.find(|test| test.plane == plane)?.radius_mm;
                Some([middle - radius, middle + radius])
            }
            Quantity::Positioning(..) | Quantity::Diagonal(_) | Quantity::Circle(..) => still,
        }
    }

    /// Which statement a verification of conformity lacks.
    fn not_stated(&self, quantity: Quantity) -> Option<String> {
        let identification = self.report.identification.as_ref();
        let of_model = !matches!(quantity, Quantity::Validation { .. });
        let is_parameter = matches!(quantity, Quantity::Parameter(_));
        let lacks = match () {
            () if is_parameter && self.stated.uncertainty.combined_um() > 0.0 => {
                "the interval of a parameter does not include the uncertainties that are stated for readings"
            }
            () if self.stated.instruments.is_empty() => "no instrument is stated",
            () if self.stated.date.is_none() => "no date of the measurement is stated",
            () if identification.is_none() && of_model => {
                "no identification is given: whether the residuals fit is unknown"
            }
            () if identification.is_some_and(|found| !found.is_judged()) && of_model => {
                "no noise is stated for the readings that parameters were fitted to, and none of them repeats a place: whether the residuals fit is unknown"
            }
            // A single parameter does not depend on other errors.
            () if self.subject.errors.misfit.is_none() && of_model && !is_parameter => {
                "no misfit is stated: what errors that are not in the file do to the tip is unknown"
            }
            () if depends_on_length(quantity) && !self.stated.uncertainty.has_length() => {
                "the uncertainty of the length reference is not stated: artefact_um and expansion_um under [uncertainty]"
            }
            () => return None,
        };
        Some(lacks.to_owned())
    }
}

/// True if a scale that all axes have in common changes the quantity.
fn depends_on_length(quantity: Quantity) -> bool {
    match quantity {
        Quantity::Parameter(parameter) => parameter == Parameter::scale(parameter.axis),
        Quantity::Volumetric { at_tip, .. } => at_tip,
        // The radius deviates, the form does not.
        Quantity::Circle(what, _) => what == 'F',
        Quantity::Positioning(what, _) => what != 'B',
        Quantity::Diagonal(_) => true,
        Quantity::Validation { .. } => false,
    }
}

fn backlash(axis: char) -> String {
    format!("the backlash of {axis} was not measured")
}
