//! A calibration report: who measured what with which instruments, the error parameters with their expanded
//! uncertainties, before and after, and which limits the machine keeps. It prints to four A4 pages at most.

mod calibration;
mod expected;
mod grounds;
mod limits;
mod missing;
mod rounding;
mod sources;

pub use calibration::{
    CalibrationRecord, CalibrationTemperature, InstrumentRecord, StatedUncertainty,
};
pub use limits::{Decision, Limit, Quantity};
pub use rounding::{Rounded, rounded};
pub use sources::{Sources, UncertaintySource};

use super::words::{coarse, in_unit, rounded_down, rounded_up};
use super::{ReportError, ReportFigures, ReportedCompensation, Share, Subject};
use expected::expected;
use grounds::Grounds;
use serde::Serialize;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_study::Identification;
use trueaxis_study::validation::Validation;

/// Coverage factor of expanded uncertainties.
const EXPANDED: f64 = 2.0;
/// Most parameters, places and sentences about outliers on a calibration report; the files have all of them.
const MOST_PARAMETERS: usize = 102;
const MOST_PLACES: usize = 12;
const MOST_OUTLIERS: usize = 5;

/// Smallest expanded uncertainty that is printed (µm, µrad, µm/m): no machine is known to a nanometre.
const LEAST_PRINTED: f64 = 0.1;

/// The contents of a calibration report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Certificate {
    /// The circumstances, as stated.
    pub calibration: CalibrationRecord,
    /// What is missing, and what follows from that, one sentence each.
    pub missing: Vec<String>,
    /// The result of all limits, in one sentence.
    pub conformity: String,
    /// Each limit.
    pub judged: Vec<Judged>,
    /// Error parameters; the one with the largest effect at the tip first.
    pub parameters: Vec<Ranked>,
    /// Number of parameters, and largest mean effect (µm) of one, that are not in the list.
    pub unlisted: Option<(usize, f64)>,
    /// Balls and stylus.
    pub places: Vec<FoundPlace>,
    /// Number of places that are not in the list.
    pub unlisted_places: usize,
    /// Rows that do not fit the others, one sentence each.
    pub outliers: Vec<String>,
    /// Number of such sentences that are not in the list.
    pub unlisted_outliers: usize,
    /// Where the uncertainty of the tip comes from.
    pub sources: Sources,
    /// Measured without and with the compensation, if it was.
    pub validation: Option<Validation>,
    /// Number of machines drawn with the uncertainties of the parameters for what is expected.
    pub draws: usize,
}

/// A limit, and what is decided about it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Judged {
    /// The limit.
    pub limit: Limit,
    /// Quantity in words of the limit.
    pub words: String,
    /// `measured`, `identified` or `expected`.
    pub source: &'static str,
    /// The value, in the unit of the limit.
    pub value: Option<f64>,
    /// Contains the true value with about 95 %.
    pub interval: Option<[f64; 2]>,
    /// The decision.
    pub decision: Decision,
    /// Why nothing could be decided, if it is not the uncertainty.
    pub why: Option<String>,
}

/// An error parameter as printed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// Name.
    pub name: String,
    /// Description.
    pub words: String,
    /// Value.
    pub value: String,
    /// Expanded uncertainty, k = 2, if known.
    pub expanded_uncertainty: Option<String>,
    /// The unit of both.
    pub unit: String,
    /// Mean effect at the tip if it alone is wrong.
    pub mean_um: f64,
}

/// A place found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundPlace {
    /// Name of the place found.
    pub what: String,
    /// Where it was found.
    pub found_mm: [f64; 3],
    /// Where it was stated to be.
    pub stated_mm: Option<[f64; 3]>,
    /// The difference.
    pub off_mm: Option<[f64; 3]>,
}

/// Makes a calibration report from the figures of a report and the inputs from which they were computed.
///
/// # Errors
/// [`ReportError`] if expected values cannot be computed.
pub fn certificate(
    machine: &Machine,
    errors: &ErrorModel,
    compensation: Option<ReportedCompensation<'_>>,
    report: &ReportFigures,
    calibration: CalibrationRecord,
) -> Result<Certificate, ReportError> {
    let validation = report.validation.clone();
    let subject = Subject::new(machine, errors, compensation, report.document.seed);
    let grounds = Grounds::new(&subject, report, &calibration);
    let judged = judged(
        &subject,
        report,
        &grounds,
        &calibration,
        validation.as_ref(),
    )?;
    let shares = &report.budget.shares;
    let listed = shares.len().min(MOST_PARAMETERS);
    let (found, outliers) = match &report.identification {
        Some(found) => (places(found), outliers(found)),
        None => Default::default(),
    };
    Ok(Certificate {
        missing: missing::missing(report, &calibration, validation.is_some()),
        conformity: conformity(&judged),
        judged,
        parameters: shares[..listed].iter().map(ranked).collect(),
        unlisted: (shares.get(listed))
            .map(|next| (shares.len() - listed, next.alone.translation_um.mean)),
        unlisted_places: found.len().saturating_sub(MOST_PLACES),
        places: found.into_iter().take(MOST_PLACES).collect(),
        unlisted_outliers: outliers.len().saturating_sub(MOST_OUTLIERS),
        outliers: outliers.into_iter().take(MOST_OUTLIERS).collect(),
        sources: sources::sources(&subject, report, &calibration)?,
        calibration,
        validation,
        draws: expected::DRAWS,
    })
}

impl Certificate {
    /// True if all limits are kept, and that is verified; also if there are none.
    #[must_use]
    pub fn conforms(&self) -> bool {
        let mut all = self.judged.iter();
        all.all(|judged| judged.decision == Decision::Pass)
    }
}

/// A parameter, rounded.
fn ranked(share: &Share) -> Ranked {
    let (factor, unit) = in_unit(&share.name).unwrap_or((1.0, String::new()));
    let shown = |value: f64| format!("{:.2}", value * factor + 0.0).replace('-', "−");
    let both = share.value.zip(share.standard_uncertainty);
    let least = match unit.as_str() {
        "µm" | "µrad" | "µm/m" => LEAST_PRINTED,
        _ => 0.0,
    };
    let both = both.and_then(|(v, u)| rounded(v * factor, (EXPANDED * u * factor).max(least)));
    Ranked {
        name: share.name.clone(),
        words: share.words.clone(),
        value: match (&both, share.value) {
            (Some(both), _) => both.value.clone(),
            (None, Some(value)) => shown(value),
            (None, None) => "measured".to_owned(),
        },
        expanded_uncertainty: both.map(|both| both.uncertainty),
        unit,
        mean_um: share.alone.translation_um.mean,
    }
}

fn places(found: &Identification) -> Vec<FoundPlace> {
    let all = found.places.iter();
    all.map(|place| FoundPlace {
        what: place.what.clone(),
        found_mm: place.found_mm,
        stated_mm: place.stated_mm,
        off_mm: (place.stated_mm)
            .map(|stated| std::array::from_fn(|k| place.found_mm[k] - stated[k])),
    })
    .collect()
}

fn outliers(found: &Identification) -> Vec<String> {
    let all = found.outliers.iter();
    all.map(|one| one.sentence.clone()).collect()
}

/// Decides about each limit.
fn judged(
    subject: &Subject<'_>,
    report: &ReportFigures,
    grounds: &Grounds<'_>,
    stated: &CalibrationRecord,
    validation: Option<&Validation>,
) -> Result<Vec<Judged>, ReportError> {
    let limits = &stated.limits;
    let mut quantities: Vec<Quantity> = limits.iter().map(|limit| limit.quantity).collect();
    quantities.retain(|q| !matches!(q, Quantity::Parameter(_) | Quantity::Validation { .. }));
    let expected = match quantities.is_empty() {
        true => Vec::new(),
        false => expected(subject, &quantities, stated.uncertainty.combined_um())?,
    };
    let mut expected = expected.into_iter();
    let mut next = || match expected.next().flatten() {
        None => Err("the machine has no room for this test"),
        Some(found) => Ok((found.value, found.interval)),
    };
    let all = limits.iter().map(|limit| match limit.quantity {
        Quantity::Parameter(_) => decided(grounds, limit, "identified", identified(report, limit)),
        Quantity::Validation { is_rms } => {
            decided(grounds, limit, "measured", measured(validation, is_rms))
        }
        _ => decided(grounds, limit, "expected", next()),
    });
    Ok(all.collect())
}

/// The decision about a limit, from a value and its interval.
fn decided(
    grounds: &Grounds<'_>,
    limit: &Limit,
    source: &'static str,
    found: FoundValue,
) -> Judged {
    let (value, interval) = found.map_or((None, None), |(value, all)| (Some(value), all));
    let of_interval = interval.map_or(Decision::NotDecided, |all| Decision::of(all, limit.at_most));
    let (decision, doubt) = grounds.allow(limit.quantity, of_interval);
    Judged {
        words: limit.quantity.words(),
        source,
        value,
        interval,
        decision,
        why: match (found, interval) {
            (Err(why), _) => Some(why.to_owned()),
            (Ok(_), None) => Some(grounds.unknown(limit.quantity).to_owned()),
            _ => doubt,
        },
        limit: limit.clone(),
    }
}

/// A value with its 95 % interval, or why there is none.
type FoundValue = Result<(f64, Option<[f64; 2]>), &'static str>;

/// The amount of a parameter.
fn identified(report: &ReportFigures, limit: &Limit) -> FoundValue {
    let name = limit.quantity.name();
    let share = report.budget.shares.iter().find(|share| share.name == name);
    let share = share.ok_or("it was not identified")?;
    let factor = in_unit(&name).map_or(1.0, |(factor, _)| factor);
    let amount = share.value.ok_or("it has no single value")?.abs() * factor;
    let around = |u: f64| [(amount - u).max(0.0), amount + u];
    let expanded = share.standard_uncertainty.map(|u| EXPANDED * u * factor);
    Ok((amount, expanded.map(around)))
}

/// What a validation measured with the compensation. Probing scatters by itself, with s in each of three coordinates. Over
/// n rows that adds 3s² to the mean square m², which has a standard uncertainty of s·√(6s² + 4m²)/√n at most. Of n rows the
/// largest may be the one that probing made so: all are within k·s with 95 % if k = √(4 + 2 ln n). The upper end keeps
/// what probing adds; the lower end of the largest leaves out k·s in each coordinate.
fn measured(validation: Option<&Validation>, is_rms: bool) -> FoundValue {
    let validation = validation.ok_or("no validation was given")?;
    let n = validation.probings.max(1) as f64;
    let s = validation.probing_um / 3.0_f64.sqrt();
    let (value, low, high) = match is_rms {
        true => {
            let m = validation.after.rms_um;
            let square = m * m - 3.0 * s * s;
            let unsure = s * (6.0 * s * s + 4.0 * m * m).sqrt() / n.sqrt();
            let low = (square - EXPANDED * unsure).max(0.0).sqrt();
            (m, low, m + EXPANDED * s / n.sqrt())
        }
        false => {
            let largest = validation.after.largest_um;
            let expanded = s * (4.0 + 2.0 * libm::log(n)).sqrt();
            let low = (largest - 3.0_f64.sqrt() * expanded).max(0.0);
            (largest, low, largest + expanded)
        }
    };
    Ok((value, Some([low, high])))
}

/// The result of all limits.
fn conformity(judged: &[Judged]) -> String {
    let count = |decision| judged.iter().filter(|j| j.decision == decision).count();
    let [pass, fail, open] = [Decision::Pass, Decision::Fail, Decision::NotDecided].map(count);
    let limits = match judged.len() {
        1 => "the stated limit".to_owned(),
        n => format!("the {n} stated limits"),
    };
    match (judged.len(), fail, open) {
        (0, ..) => "No limits are stated: nothing is said about conformity.".to_owned(),
        (_, 0, 0) => format!("PASS: conformity with {limits} is verified."),
        (_, 0, _) => format!("NOT DECIDED: of {limits}, {pass} passed, {open} not decided."),
        _ => format!("FAIL: of {limits}, {fail} failed, {pass} passed, {open} not decided."),
    }
}

impl Judged {
    /// Value and interval as printed; the interval is rounded outward.
    #[must_use]
    pub fn printed(&self) -> [String; 2] {
        let value = self.value.map(coarse);
        let interval = self
            .interval
            .map(|[low, high]| format!("{} to {}", rounded_down(low), rounded_up(high)));
        [value, interval].map(|text| text.unwrap_or_else(|| "–".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_study::validation::Scatter;

    fn validation(probings: usize, rms_um: f64, largest_um: f64, probing_um: f64) -> Validation {
        let after = Scatter { rms_um, largest_um };
        Validation {
            probings,
            before: after,
            after,
            probing_um,
            coverage_um: 1.0,
            expected_um: 2.0,
            unseen: Vec::new(),
            is_kept: true,
        }
    }

    #[test]
    fn what_probing_adds_proves_nothing() {
        // s = 1 µm in each coordinate, 16 rows: 2·1/√16 = 0.5 µm above; below, 3² − 3 without probing's own scatter, less
        // 2·√(6 + 4·9)/√16.
        let own = 3.0_f64.sqrt();
        let (value, interval) = measured(Some(&validation(16, 3.0, 5.0, own)), true).unwrap();
        let [low, high] = interval.unwrap();
        assert_eq!(value, 3.0);
        let square = 6.0 - 0.5 * 42.0_f64.sqrt();
        assert!((high - 3.5).abs() < 1e-12 && (low - square.sqrt()).abs() < 1e-12);
        // One row: 2 s along the deviation, and in all three coordinates if that is all there is.
        let (_, interval) = measured(Some(&validation(1, 5.0, 5.0, own)), false).unwrap();
        let [low, high] = interval.unwrap();
        assert!((low - (5.0 - 2.0 * own)).abs() < 1e-12 && (high - 7.0).abs() < 1e-12);
        assert!(measured(None, true).is_err());
    }

    #[test]
    fn the_true_scatter_is_in_the_interval_as_often_as_promised() {
        // Machines that are off by 0, 1 and 5 µm in each of ten rows, probed with a scatter of 1 µm in each coordinate.
        use rand::SeedableRng;
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(5);
        let (rows, times) = (10, 2000);
        for off in [0.0, 1.0, 5.0] {
            let mut above = [0; 2];
            let mut below = [0; 2];
            for _ in 0..times {
                let mut row = || {
                    let mut part = || trueaxis_model::numbers::normal(&mut random);
                    libm::hypot(libm::hypot(off + part(), part()), part())
                };
                let found: Vec<f64> = (0..rows).map(|_| row()).collect();
                let mean_square = found.iter().map(|v| v * v).sum::<f64>() / f64::from(rows);
                let largest = found.iter().fold(0.0, |most: f64, v| v.max(most));
                let probing = 3.0_f64.sqrt();
                let found = validation(rows as usize, mean_square.sqrt(), largest, probing);
                for (k, is_rms) in [true, false].into_iter().enumerate() {
                    let (_, interval) = measured(Some(&found), is_rms).unwrap();
                    let [low, high] = interval.unwrap();
                    below[k] += u32::from(off < low);
                    above[k] += u32::from(off > high);
                }
            }
            // At most 2.5 % at each end, of which 2000 times know ± 0.7 %.
            for count in below.into_iter().chain(above) {
                assert!(count < times * 32 / 1000, "{off}: {below:?} {above:?}");
            }
        }
    }

    #[test]
    fn one_exceeded_limit_is_a_failure_and_an_open_one_no_pass() {
        let one = |decision| Judged {
            limit: Limit {
                test: None,
                quantity: Quantity::Validation { is_rms: true },
                at_most: 1.0,
                unit: "µm",
            },
            words: String::new(),
            source: "measured",
            value: None,
            interval: None,
            decision,
            why: None,
        };
        use Decision::{Fail, NotDecided, Pass};
        for (all, start) in [
            (&[][..], "No limits are stated"),
            (&[Pass, Pass], "PASS: conformity with the 2 stated limits"),
            (&[Pass], "PASS: conformity with the stated limit is"),
            (
                &[Pass, NotDecided],
                "NOT DECIDED: of the 2 stated limits, 1 passed, 1 not decided.",
            ),
            (
                &[Pass, Fail, NotDecided],
                "FAIL: of the 3 stated limits, 1 failed, 1 passed, 1 not decided.",
            ),
        ] {
            let judged: Vec<Judged> = all.iter().map(|d| one(*d)).collect();
            assert!(
                conformity(&judged).starts_with(start),
                "{}",
                conformity(&judged)
            );
        }
    }
}
