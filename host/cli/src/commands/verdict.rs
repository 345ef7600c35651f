//! The last lines of `compile`, `verify` and `identify`: the report's verdict, and the largest contributions.

use std::io::IsTerminal;
use trueaxis_report::{ReportVerdict, Share, figure};

/// Number of parameters listed.
const NAMED: usize = 5;
/// Length of the longest bar, in characters.
const WIDE: f64 = 24.0;
/// Values below this (µm, µrad) count as zero.
const NOTHING: f64 = 5e-5;
/// Escape codes that switch the colour of a bar to blue and back.
const COLOUR: [&str; 2] = ["\x1b[34m", "\x1b[0m"];

/// The sentences, and bars of the largest parameters, coloured on a terminal.
pub fn lines(verdict: &ReportVerdict) -> String {
    text(verdict, is_coloured())
}

/// True if standard output is a terminal and `NO_COLOR` is not set.
fn is_coloured() -> bool {
    let asked_for_none = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    std::io::stdout().is_terminal() && !asked_for_none
}

/// The sentences, behind an empty line.
pub fn sentences(verdict: &ReportVerdict) -> String {
    let mut text = String::from("\n");
    for sentence in &verdict.sentences {
        text += &format!("{sentence}\n");
    }
    text
}

fn text(verdict: &ReportVerdict, coloured: bool) -> String {
    let mut text = sentences(verdict);
    let mean = |share: &Share| share.alone.translation_um.mean;
    let does = verdict.shares.iter().filter(|share| mean(share) >= NOTHING);
    let named: Vec<&Share> = does.take(NAMED).collect();
    let Some(most) = named.first().map(|share| mean(share)) else {
        return text;
    };
    let name = |share: &Share| share.name.chars().count();
    let wide = named.iter().map(|share| name(share)).max().unwrap_or(0);
    let [on, off] = if coloured { COLOUR } else { [""; 2] };
    for share in named {
        let length = (WIDE * mean(share) / most).round().max(1.0) as usize;
        let bar = "█".repeat(length) + &" ".repeat(WIDE as usize - length);
        let um = figure(mean(share));
        text += &format!(
            "  {:<wide$}  {on}{bar}{off} {um:>6} µm  {}\n",
            share.name, share.words
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueaxis_model::validate::{Quality, Statistics};
    use trueaxis_report::Volumetric;

    fn share(name: &str, mean: f64) -> Share {
        let translation_um = Statistics {
            mean,
            ..Statistics::default()
        };
        Share {
            name: name.to_owned(),
            words: "the scale of X".to_owned(),
            value: None,
            standard_uncertainty: None,
            alone: Quality {
                translation_um,
                ..Quality::default()
            },
            expanded_uncertainty_mean_um: None,
            expanded_uncertainty_max_um: None,
            expanded_uncertainty_mean_urad: None,
            expanded_uncertainty_max_urad: None,
            uncorrected_urad: None,
        }
    }

    #[test]
    fn five_bars_are_as_long_as_what_they_stand_for_and_plain_without_a_terminal() {
        let means = [8.0, 4.0, 2.0, 1.0, 0.01, 0.005];
        let shares = means.iter().map(|mean| share("EXX1", *mean));
        let verdict = ReportVerdict {
            sentences: vec!["So it is.".to_owned()],
            shares: shares.collect(),
            volumetric: Volumetric {
                positions: 0,
                before: Quality::default(),
                after: None,
                kinematic: None,
                difference_um: None,
                difference_urad: None,
                meets_tolerance: None,
                um_per_mm_of_tool_length: None,
                known: None,
            },
        };
        let plain = text(&verdict, false);
        let bars: Vec<usize> = plain
            .lines()
            .skip(2)
            .map(|l| l.matches('█').count())
            .collect();
        assert_eq!(bars, [24, 12, 6, 3, 1]);
        assert!(
            plain.starts_with("\nSo it is.\n") && !plain.contains('\x1b'),
            "{plain}"
        );
        assert_eq!(text(&verdict, true).matches("\x1b[34m").count(), 5);
    }
}
