//! What a calibration report lacks.

use super::calibration::{CalibrationRecord, InstrumentRecord};
use crate::ReportFigures;

/// What is missing, and what follows from that, one sentence each.
pub(super) fn missing(
    report: &ReportFigures,
    stated: &CalibrationRecord,
    is_validated: bool,
) -> Vec<String> {
    let mut all = circumstances(stated);
    all.extend(results(report, is_validated));
    all
}

/// What was not stated about the measurement.
fn circumstances(stated: &CalibrationRecord) -> Vec<String> {
    let texts = [
        ("serial number of the machine", &stated.serial_number),
        ("operator", &stated.operator),
        ("laboratory", &stated.laboratory),
        ("date of the measurement", &stated.date),
    ];
    let texts = texts.into_iter().filter(|(_, text)| text.is_none());
    let mut all: Vec<String> = texts
        .map(|(what, _)| format!("The {what} is not stated."))
        .collect();
    if stated.method.is_none() {
        all.push("The method is not described.".to_owned());
    }
    if stated.instruments.is_empty() {
        all.push("No instrument is stated: the results are not traceable.".to_owned());
    }
    let without = |is_missing: fn(&InstrumentRecord) -> bool| {
        let all = stated.instruments.iter();
        Some(all.filter(|one| is_missing(one)).count()).filter(|n| *n > 0)
    };
    all.extend(without(|one| one.certificate.is_none()).map(|n| {
        format!(
            "No certificate is stated for {n} of the instruments: their results are not traceable."
        )
    }));
    all.extend(
        without(|one| one.celsius.is_none())
            .map(|n| format!("No temperature is stated for {n} of the instruments.")),
    );
    if stated.temperatures.is_empty() {
        all.push("No temperature of the machine or its surroundings is stated.".to_owned());
    }
    all
}

/// What the results do without.
fn results(report: &ReportFigures, is_validated: bool) -> Vec<String> {
    let known = report.volumetric.known.as_ref();
    let exact = known.map_or(0, |known| known.exact);
    let of_exact =
        format!("{exact} of the error parameters have no uncertainty and count as exact.");
    let all = [
        (exact > 0, of_exact.as_str()),
        (
            known.is_none() && !report.budget.shares.is_empty(),
            "No error parameter has an uncertainty: nothing can be decided about expected values.",
        ),
        (
            report.identification.is_none(),
            "No identification is given: positions, places and residuals are not shown.",
        ),
        (
            report.tables.is_none(),
            "No compensation is given: all results are for the uncorrected machine.",
        ),
        (
            !is_validated,
            "The result was not validated by measurements: before and after are as expected.",
        ),
    ];
    let all = all.into_iter().filter(|(is_missing, _)| *is_missing);
    let all = all.map(|(_, sentence)| sentence.to_owned());
    let probed = report.identification.iter().flat_map(|found| &found.probed);
    let blind = probed.flat_map(|one| one.blind_to());
    all.chain(blind.map(|what| sentence(&what))).collect()
}

/// With a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_ascii_uppercase());
    first.into_iter().chain(letters).chain(['.']).collect()
}
