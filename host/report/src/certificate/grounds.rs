//! What a decision rests on: an interval from the model proves nothing where the measurements refute the model, or
//! where no length reference was measured.

use super::calibration::Calibration;
use super::limits::{Decision, Quantity};
use crate::identification::Identification;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;

/// What the decisions about all limits rest on.
pub(super) struct Grounds<'a> {
    machine: &'a Machine,
    errors: &'a ErrorModel,
    identification: Option<&'a Identification>,
    stated: &'a Calibration,
}

impl<'a> Grounds<'a> {
    pub fn new(
        machine: &'a Machine,
        errors: &'a ErrorModel,
        identification: Option<&'a Identification>,
        stated: &'a Calibration,
    ) -> Self {
        Self {
            machine,
            errors,
            identification,
            stated,
        }
    }

    /// The decision that an interval supports, and the reason if it would decide but its grounds do not.
    pub fn allow(&self, quantity: Quantity, of_interval: Decision) -> (Decision, Option<String>) {
        let doubt = match of_interval {
            Decision::NotDecided => None,
            Decision::Fail => self.doubt(quantity),
            // A wrong "fail" costs another measurement, a wrong "pass" the part.
            Decision::Pass => self.doubt(quantity).or_else(|| self.not_stated(quantity)),
        };
        match doubt {
            None => (of_interval, None),
            Some(why) => (Decision::NotDecided, Some(why)),
        }
    }

    /// Why the interval may be wrong.
    fn doubt(&self, quantity: Quantity) -> Option<String> {
        // A validation measures the result itself.
        if matches!(quantity, Quantity::Validation { .. }) {
            return None;
        }
        if self.identification.is_some_and(|found| !found.fits()) {
            return Some(
                "the residuals exceed the stated noise: the machine has errors that the model lacks"
                    .to_owned(),
            );
        }
        let missing = self.errors.missing_scales(self.machine);
        match &missing[..] {
            [scale, ..] if depends_on_length(quantity) => Some(format!(
                "no length reference: the scale of {} was not measured",
                scale.axis
            )),
            [a, b, ..] if matches!(quantity, Quantity::Circle('G', _)) => Some(format!(
                "the scales of {} and {} were not measured, not even relative to each other",
                a.axis, b.axis
            )),
            _ => None,
        }
    }

    /// Which statement a proof of conformity lacks.
    fn not_stated(&self, quantity: Quantity) -> Option<String> {
        let lacks = match () {
            () if self.stated.instruments.is_empty() => "no instrument is stated",
            () if self.stated.date.is_none() => "no date of the measurement is stated",
            () if self.identification.is_none()
                && !matches!(quantity, Quantity::Validation { .. }) =>
            {
                "no identification is given: whether the residuals fit is not known"
            }
            () if self.identification.is_some_and(|found| !found.is_judged())
                && !matches!(quantity, Quantity::Validation { .. }) =>
            {
                "no noise is stated and no place was measured twice: whether the residuals fit is not known"
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
