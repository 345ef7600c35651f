//! The page: templates, figures and data in one file.

use super::words::figure;
use super::{Model, Report};
use crate::picture::{Bar, Bars, Ink};
use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment, Value, context};
use serde::Serialize;

/// Parts of the page by name.
const TEMPLATES: [(&str, &str); 3] = [
    ("page.html", include_str!("page/page.html")),
    ("machine.html", include_str!("page/machine.html")),
    ("field.html", include_str!("page/field.html")),
];
const STYLE: &str = concat!(
    include_str!("page/style.css"),
    include_str!("page/view.css")
);
/// What the page computes, and what it draws with that.
const SCRIPTS: [&str; 5] = [
    include_str!("page/engine.js"),
    include_str!("page/scene.js"),
    include_str!("page/machine.js"),
    include_str!("page/field.js"),
    include_str!("page/view.js"),
];

/// Bars in one picture.
const BARS: usize = 30;

/// The page of a report: one file that needs no other.
#[must_use]
pub fn page(report: &Report, model: &Model) -> String {
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_filter("figure", |value: f64| figure(value));
    for (name, text) in TEMPLATES {
        let added = environment.add_template(name, text);
        // The templates are part of the program: a test renders each of them.
        debug_assert!(added.is_ok(), "{added:?}");
    }
    let rendered = environment.get_template("page.html").and_then(|page| {
        page.render(context! {
            report => Value::from(Serde(report)),
            style => Value::from_safe_string(STYLE.to_owned()),
            scripts => Value::from_safe_string(SCRIPTS.join("\n")),
            report_data => Value::from_safe_string(data(report)),
            model_data => Value::from_safe_string(data(model)),
            budget_tip => svg(budget(report, true)),
            budget_direction => svg(budget(report, false)),
        })
    });
    debug_assert!(rendered.is_ok(), "{rendered:?}");
    rendered.unwrap_or_default()
}

/// Data for an element `script` of a page: as JSON in which nothing ends the element or begins another.
fn data(value: &impl Serialize) -> String {
    let json = serde_json::to_string(value).unwrap_or_default();
    let mut safe = String::with_capacity(json.len());
    for c in json.chars() {
        match c {
            '<' | '>' | '&' | '\u{2028}' | '\u{2029}' => {
                safe += &format!("\\u{:04x}", u32::from(c));
            }
            c => safe.push(c),
        }
    }
    safe
}

fn svg(picture: Option<String>) -> Value {
    picture.map_or(Value::from(()), Value::from_safe_string)
}

/// Bars of what each parameter does at the tip, or to the tool's direction.
fn budget(report: &Report, at_tip: bool) -> Option<String> {
    let mut bars: Vec<Bar> = (report.budget.shares.iter())
        .map(|share| {
            let (found, uncertainty) = match at_tip {
                true => (
                    share.alone.translation_um,
                    share.expanded_uncertainty_max_um,
                ),
                false => (
                    share.alone.direction_urad,
                    share.expanded_uncertainty_max_urad,
                ),
            };
            Bar {
                name: share.name.clone(),
                mean: found.mean,
                max: found.max,
                uncertainty,
            }
        })
        .filter(|bar| bar.max >= 1e-4)
        .collect();
    bars.sort_by(|a, b| b.mean.total_cmp(&a.mean));
    bars.truncate(BARS);
    let (what, unit) = match at_tip {
        true => ("at the tip", "µm"),
        false => ("of the tool's direction", "µrad"),
    };
    let bars = Bars {
        title: format!("Error budget: error {what} that each parameter makes by itself, in {unit}"),
        label: format!("error {what} by itself ({unit})"),
        legend: [
            "mean over the travel".to_owned(),
            "maximum".to_owned(),
            "uncertainty (95 %)".to_owned(),
        ],
        ink: Ink::Accent,
        bars,
    };
    (!bars.bars.is_empty()).then(|| bars.draw().inline())
}
