//! Changes since an older report.

use super::words::figure;
use super::{ReportFigures, Share};
use serde::{Deserialize, Serialize};
use trueaxis_model::numbers::by;
use trueaxis_model::validate::Quality;

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

impl ParameterChange {
    /// The change of a share, which may have existed in one of the reports only; `None` without a change.
    fn of(then: Option<&Share>, now: Option<&Share>) -> Option<Self> {
        if let (Some(a), Some(b)) = (then, now)
            && a.value == b.value
            && a.alone == b.alone
        {
            return None;
        }
        let any = now.or(then)?;
        let both = |of: fn(&Share) -> Option<f64>| [then, now].map(|share| share.and_then(of));
        let [old, new] = both(|share| share.value);
        let [before, after] = both(|share| share.standard_uncertainty);
        let apart = old.zip(new).map(|(a, b)| (a - b).abs());
        let unsure = before.zip(after).map(|(a, b)| libm::hypot(a, b));
        let [old_mean_um, new_mean_um] =
            [then, now].map(|share| share.map_or(0.0, |s| s.alone.translation_um.mean));
        Some(Self {
            name: any.name.clone(),
            words: any.words.clone(),
            old,
            new,
            old_mean_um,
            new_mean_um,
            is_significant: apart.zip(unsure).map(|(apart, u)| apart > EXPANDED * u),
        })
    }
}

/// Compares with an older report of the same machine.
#[must_use]
pub fn changes(old: &ReportFigures, new: &ReportFigures) -> ReportChanges {
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
        figures: figures(old, new),
        parameters,
    }
}

/// Means and maxima without tables, and with them.
fn figures(old: &ReportFigures, new: &ReportFigures) -> Vec<FigureChange> {
    type Of = fn(&Quality) -> f64;
    let of_tip: [(&str, Of); 2] = [
        ("mean at the tip", |q| q.translation_um.mean),
        ("maximum at the tip", |q| q.translation_um.max),
    ];
    let of_direction: [(&str, Of); 2] = [
        ("mean of direction", |q| q.direction_urad.mean),
        ("maximum of direction", |q| q.direction_urad.max),
    ];
    let change = |(name, of): (&str, Of), unit: &str, is_after: bool| {
        let value = |report: &ReportFigures| match is_after {
            true => report.volumetric.after.as_ref().map(of),
            false => Some(of(&report.volumetric.before)),
        };
        FigureChange {
            name: format!(
                "{name} {}",
                if is_after {
                    "with the tables"
                } else {
                    "before"
                }
            ),
            unit: unit.to_owned(),
            old: value(old),
            new: value(new),
        }
    };
    let of = |is_after: bool| {
        let tip = of_tip.map(|figure| change(figure, "µm", is_after));
        tip.into_iter()
            .chain(of_direction.map(|figure| change(figure, "µrad", is_after)))
    };
    // With tables the largest error of direction is not compared.
    of(false).chain(of(true).take(3)).collect()
}

/// Parameters whose value or effect has changed.
fn parameters(old: &[Share], new: &[Share]) -> Vec<ParameterChange> {
    fn find<'s>(all: &'s [Share], name: &str) -> Option<&'s Share> {
        all.iter().find(|s| s.name == name)
    }
    let mut names: Vec<&String> = new.iter().chain(old).map(|share| &share.name).collect();
    let mut seen = std::collections::BTreeSet::new();
    names.retain(|name| seen.insert(name.as_str()));
    let changes = names.into_iter();
    let changes = changes.filter_map(|name| ParameterChange::of(find(old, name), find(new, name)));
    let size = |change: &ParameterChange| (change.new_mean_um - change.old_mean_um).abs();
    by(changes.collect(), |change| -size(change))
}
