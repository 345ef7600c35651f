//! Changes since an older report.

use super::words::figure;
use super::{ReportFigures, Share};
use serde::{Deserialize, Serialize};

/// Coverage factor: larger changes are significant (95 %).
const EXPANDED: f64 = 2.0;

/// The differences between two reports.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportChanges {
    /// The date of the older report, if it has one.
    pub since: Option<String>,
    /// A summary.
    pub sentence: String,
    /// Files whose content has changed.
    pub files: Vec<String>,
    /// Overall figures.
    pub figures: Vec<FigureChange>,
    /// Parameters that have changed; the largest change at the tip first.
    pub parameters: Vec<ParameterChange>,
}

/// A figure, old and new.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FigureChange {
    /// Name of the figure.
    pub name: String,
    /// `µm` or `µrad`.
    pub unit: String,
    /// The old value; `None` if there were no tables.
    pub old: Option<f64>,
    /// The new value.
    pub new: Option<f64>,
}

/// A parameter, old and new.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterChange {
    /// Name of the parameter.
    pub name: String,
    /// Description of the parameter.
    pub words: String,
    /// The old value (mm, rad, per mm or rad to the power of its degree); `None` if it did not exist.
    pub old: Option<f64>,
    /// The new value.
    pub new: Option<f64>,
    /// Old mean effect at the tip.
    pub old_mean_um: f64,
    /// New mean effect at the tip.
    pub new_mean_um: f64,
    /// True if it has changed by more than its uncertainties explain (95 %); `None` if they are unknown.
    pub is_significant: Option<bool>,
}

/// Compares with an older report of the same machine.
#[must_use]
pub fn changes(old: &ReportFigures, new: &ReportFigures) -> ReportChanges {
    let figure_of =
        |name: &str, unit: &str, of: &dyn Fn(&ReportFigures) -> Option<f64>| FigureChange {
            name: name.to_owned(),
            unit: unit.to_owned(),
            old: of(old),
            new: of(new),
        };
    let after = |report: &ReportFigures| report.volumetric.after;
    let figures = vec![
        figure_of("mean at the tip before", "µm", &|r| {
            Some(r.volumetric.before.translation_um.mean)
        }),
        figure_of("maximum at the tip before", "µm", &|r| {
            Some(r.volumetric.before.translation_um.max)
        }),
        figure_of("mean of direction before", "µrad", &|r| {
            Some(r.volumetric.before.direction_urad.mean)
        }),
        figure_of("maximum of direction before", "µrad", &|r| {
            Some(r.volumetric.before.direction_urad.max)
        }),
        figure_of("mean at the tip with the tables", "µm", &|r| {
            after(r).map(|q| q.translation_um.mean)
        }),
        figure_of("maximum at the tip with the tables", "µm", &|r| {
            after(r).map(|q| q.translation_um.max)
        }),
        figure_of("mean of direction with the tables", "µrad", &|r| {
            after(r).map(|q| q.direction_urad.mean)
        }),
    ];
    let parameters = parameters(&old.budget.shares, &new.budget.shares);
    let since = match &old.document.date {
        Some(date) => format!("Since {date}"),
        None => "Since the older report".to_owned(),
    };
    let [then, now] = [old, new].map(|r| figure(r.volumetric.before.translation_um.mean));
    let sentence = match parameters.first() {
        None => format!("{since} no parameter has changed; {now} µm on average without tables."),
        Some(most) => format!(
            "{since} the mean error without tables has gone from {then} to {now} µm; most at {} ({} to {} µm by itself).",
            most.name,
            figure(most.old_mean_um),
            figure(most.new_mean_um)
        ),
    };
    let files = new.document.files.iter().filter(|file| {
        let mut same = old.document.files.iter().filter(|f| f.role == file.role);
        same.next()
            .is_none_or(|f| f.crc32 != file.crc32 || f.bytes != file.bytes)
    });
    ReportChanges {
        since: old.document.date.clone(),
        sentence,
        files: files.map(|file| file.role.clone()).collect(),
        figures,
        parameters,
    }
}

fn parameters(old: &[Share], new: &[Share]) -> Vec<ParameterChange> {
    let find = |all: &[Share], name: &str| all.iter().find(|s| s.name == name).cloned();
    let mut names: Vec<&String> = new.iter().chain(old).map(|share| &share.name).collect();
    let mut seen = std::collections::BTreeSet::new();
    names.retain(|name| seen.insert(name.as_str()));
    let mut changes: Vec<ParameterChange> = (names.into_iter())
        .filter_map(|name| {
            let (then, now) = (find(old, name), find(new, name));
            let same = match (&then, &now) {
                (Some(a), Some(b)) => a.value == b.value && a.alone == b.alone,
                _ => false,
            };
            if same {
                return None;
            }
            let mean =
                |share: &Option<Share>| share.as_ref().map_or(0.0, |s| s.alone.translation_um.mean);
            let value = |share: &Option<Share>| share.as_ref().and_then(|s| s.value);
            let known = |share: &Option<Share>| share.as_ref().and_then(|s| s.standard_uncertainty);
            let apart = value(&then).zip(value(&now)).map(|(a, b)| (a - b).abs());
            let unsure = known(&then)
                .zip(known(&now))
                .map(|(a, b)| libm::hypot(a, b));
            Some(ParameterChange {
                name: name.clone(),
                words: now
                    .as_ref()
                    .or(then.as_ref())
                    .map_or(String::new(), |s| s.words.clone()),
                old: value(&then),
                new: value(&now),
                old_mean_um: mean(&then),
                new_mean_um: mean(&now),
                is_significant: apart.zip(unsure).map(|(apart, u)| apart > EXPANDED * u),
            })
        })
        .collect();
    let size = |change: &ParameterChange| (change.new_mean_um - change.old_mean_um).abs();
    changes.sort_by(|a, b| size(b).total_cmp(&size(a)));
    changes
}
