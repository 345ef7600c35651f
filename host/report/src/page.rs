//! The page: templates, figures and data in one file.

use super::certificate::{Certificate, Judged};
use super::observed::ShownRows;
use super::words::{figure, quantity, sensible};
use super::{PageModel, ReportFigures, figures};
use crate::picture::{Drawing, Picture};
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, Error, ErrorKind, Value, context};
use serde::Serialize;
use std::collections::BTreeSet;

/// Named parts of the page.
const TEMPLATES: [(&str, &str); 12] = [
    ("page.html", include_str!("page/page.html")),
    ("validation.html", include_str!("page/validation.html")),
    ("machine.html", include_str!("page/machine.html")),
    ("field.html", include_str!("page/field.html")),
    ("budget.html", include_str!("page/budget.html")),
    ("motions.html", include_str!("page/motions.html")),
    ("tests.html", include_str!("page/tests.html")),
    ("tables.html", include_str!("page/tables.html")),
    (
        "identification.html",
        include_str!("page/identification.html"),
    ),
    ("observed.html", include_str!("page/observed.html")),
    ("document.html", include_str!("page/document.html")),
    ("certificate.html", include_str!("page/certificate.html")),
];
const STYLE: &str = concat!(
    include_str!("page/style.css"),
    include_str!("page/view.css")
);
const CERTIFICATE_STYLE: &str = concat!(
    include_str!("page/style.css"),
    include_str!("page/certificate.css")
);
/// Scripts for computing and drawing.
const SCRIPTS: [&str; 7] = [
    include_str!("page/engine.js"),
    include_str!("page/scene.js"),
    include_str!("page/layout.js"),
    include_str!("page/machine.js"),
    include_str!("page/field.js"),
    include_str!("page/sliders.js"),
    include_str!("page/view.js"),
];

/// Unknowns of set-ups that are listed: on the page, and on a calibration report of four sheets.
const MOST_SETUPS: usize = 60;
const MOST_ON_PAPER: usize = 12;

/// Figures beside their data.
#[derive(Serialize)]
struct Motions<'a> {
    axis: &'a super::AxisMotions,
    figures: Vec<CaptionedFigure>,
    /// Names of the motions that are zero.
    none: Vec<String>,
}

/// A figure and its heading.
#[derive(Serialize)]
struct CaptionedFigure {
    name: String,
    words: String,
    svg: String,
}

/// The page of a report: one self-contained file.
///
/// # Errors
/// A wrong template, or data that cannot be written as JSON: a bug in the program.
pub fn page(report: &ReportFigures, model: &PageModel) -> Result<String, Error> {
    let environment = environment()?;
    let identification = report.identification.as_ref();
    environment.get_template("page.html")?.render(context! {
            report => Value::from(Serde(report)),
            style => Value::from_safe_string(STYLE.to_owned()),
            scripts => Value::from_safe_string(SCRIPTS.join("\n")),
            report_data => Value::from_safe_string(data(&without_samples(report))?),
            model_data => Value::from_safe_string(data(model)?),
            budget => named_once([true, false].map(|at_tip| figures::budget(&report.budget, &report.volumetric, at_tip))),
            motions => Value::from(Serde(motions(report))),
            circles => named_once(report.tests.circles.iter().map(|test| Some(figures::circle(test)))),
            diagonals => named_once(report.tests.diagonals.iter().map(|d| Some(figures::diagonal(d)))),
            positioning => named_once(report.tests.positioning.iter().map(|p| Some(figures::positioning(p, &report.axes)))),
            curves => named_once(report.tables.iter().flat_map(|t| &t.curves)
                .map(|c| Some(figures::curve(c, &report.axes)))),
            uses => named_once(report.tables.iter().flat_map(|t| &t.axes)
                .map(|used| figures::along(used, &report.axes))),
            checks => identification.map(|i| i.checks.iter().map(trueaxis_study::CheckRecord::words)
                .collect::<Vec<_>>()),
            counts => identification.map(super::Identification::counts),
            observed => observed(identification, MOST_SETUPS),
            balls => svg(identification.and_then(figures::balls)),
            validation => svg(report.validation.as_ref().map(figures::validation)),
            residuals => svg(identification.and_then(figures::residuals)),
    })
}

/// The page of a calibration report: one self-contained file without scripts.
///
/// # Errors
/// A wrong template: a bug in the program.
pub fn certificate_page(
    report: &ReportFigures,
    certificate: &Certificate,
) -> Result<String, Error> {
    let identification = report.identification.as_ref();
    environment()?
        .get_template("certificate.html")?
        .render(context! {
            report => Value::from(Serde(report)),
            certificate => Value::from(Serde(certificate)),
            judged => certificate.judged.iter().map(Judged::printed).collect::<Vec<_>>(),
            style => Value::from_safe_string(CERTIFICATE_STYLE.to_owned()),
            counts => identification.map(super::Identification::counts),
            observed => observed(identification, MOST_ON_PAPER),
            balls => svg(identification.and_then(figures::balls)),
            residuals => svg(identification.and_then(figures::residuals)),
        })
}

/// Instruments, drift and temperatures, if an identification has them, with at most so many unknowns of set-ups.
fn observed(found: Option<&super::Identification>, most: usize) -> Option<Value> {
    let found = found?;
    let shown = ShownRows::of(found.observed.as_ref(), found.temperatures.as_ref(), most)?;
    Some(Value::from(Serde(shown)))
}

/// The templates, and how they show numbers.
fn environment() -> Result<Environment<'static>, Error> {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_filter("figure", |value: f64| figure(value));
    environment.add_filter("sensible", |value: f64| sensible(value));
    environment.add_filter("coarse", |value: f64| crate::words::coarse(value));
    environment.add_filter("up", |value: f64| crate::words::rounded_up(value));
    environment.add_filter("css", css);
    environment.add_filter("plain", |value: f64| crate::picture::tick(value));
    environment.add_filter("plain1", |value: f64| decimals(value, 1));
    environment.add_filter("mm", |value: f64| decimals(value, 4));
    environment.add_filter("quantity", |name: &str, value: f64| quantity(name, value));
    for (name, text) in TEMPLATES {
        environment.add_template(name, text)?;
    }
    Ok(environment)
}

/// Text as the inside of a string of a style sheet: everything but letters and digits as its code point, so that nothing
/// ends the string.
fn css(text: &str) -> String {
    let mut safe = String::new();
    for c in text.chars() {
        match c.is_ascii_alphanumeric() {
            true => safe.push(c),
            false => safe += &format!("\\{:06x}", u32::from(c)),
        }
    }
    safe
}

/// A number with so many decimals and a true minus sign.
fn decimals(value: f64, count: i32) -> String {
    let unit = 10_f64.powi(count);
    // Avoids "-0.0".
    let rounded = (value * unit).round() / unit + 0.0;
    format!("{rounded:.*}", count as usize).replace('-', "−")
}

/// Pictures that stand together: the legend of each explains only what none before it does.
fn named_once<D: Drawing>(drawings: impl IntoIterator<Item = Option<D>>) -> Vec<Value> {
    let mut named = BTreeSet::new();
    let drawings = drawings.into_iter();
    drawings
        .map(|drawing| svg(drawing.map(|drawing| once(&mut named, drawing))))
        .collect()
}

/// A picture without the names in its legend that are in `named`, to which the others are added.
fn once(named: &mut BTreeSet<String>, mut drawing: impl Drawing) -> String {
    for name in drawing.legend() {
        if !named.insert(name.clone()) {
            name.clear();
        }
    }
    drawing.draw().inline()
}

fn motions(report: &ReportFigures) -> Vec<Motions<'_>> {
    let mut named = BTreeSet::new();
    report
        .axes
        .iter()
        .map(|axis| {
            let (motions, letter) = (&axis.motions, axis.axis);
            let figures = motions.iter().map(|motion| CaptionedFigure {
                name: motion.name.clone(),
                words: motion.words.clone(),
                svg: once(&mut named, figures::motion(axis, motion)),
            });
            let all = ['X', 'Y', 'Z', 'A', 'B', 'C'].map(|c| format!("E{c}{letter}"));
            let is_none = |name: &String| motions.iter().all(|motion| motion.name != *name);
            Motions {
                axis,
                figures: figures.collect(),
                none: all.into_iter().filter(is_none).collect(),
            }
        })
        .collect()
}

/// The report without the samples of its tables, which are half of it; the page has them in the data of its model.
fn without_samples(report: &ReportFigures) -> ReportFigures {
    let mut report = report.clone();
    for curve in report
        .tables
        .iter_mut()
        .flat_map(|tables| &mut tables.curves)
    {
        curve.at.clear();
        curve.values.clear();
    }
    report
}

/// Data for a `script` element of a page: JSON that cannot end the element or start another one.
fn data(value: &impl Serialize) -> Result<String, Error> {
    let json = serde_json::to_string(value)
        .map_err(|error| Error::new(ErrorKind::BadSerialization, error.to_string()))?;
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                safe += &format!("\\u{:04x}", u32::from(c));
            }
            c => safe.push(c),
        }
    }
    Ok(safe)
}

/// Pictures of a report for use elsewhere, with their names: the error budget and the circular tests.
#[must_use]
pub fn pictures(report: &ReportFigures) -> Vec<(String, Picture)> {
    let budget = [("tip", true), ("direction", false)];
    let budget = budget.into_iter().filter_map(|(name, at_tip)| {
        let bars = figures::budget(&report.budget, &report.volumetric, at_tip)?;
        Some((format!("budget-{name}"), bars.draw()))
    });
    let circles = report.tests.circles.iter();
    let circles = circles.map(|test| {
        (
            format!("circle-{}", test.plane),
            figures::circle(test).draw(),
        )
    });
    budget.chain(circles).collect()
}

fn svg(picture: Option<String>) -> Value {
    picture.map_or(Value::from(()), Value::from_safe_string)
}
