//! What there is to say first.

use super::words::{capital, figure};
use super::{Share, Volumetric};
use crate::validate::Quality;

/// Errors below this on average (µm, µrad) are none.
const NOTHING: f64 = 5e-5;

/// The verdict, a sentence each: what causes most, what the tables leave, how well it is known.
pub fn sentences(volumetric: &Volumetric, shares: &[Share]) -> Vec<String> {
    let before = &volumetric.before;
    if is_nothing(before) && shares.is_empty() {
        return vec!["No error of this machine is known: there is nothing to correct.".to_owned()];
    }
    let mut sentences = vec![cause(before, shares)];
    sentences.push(left(volumetric));
    sentences
}

fn is_nothing(quality: &Quality) -> bool {
    quality.translation_um.max < NOTHING && quality.direction_urad.max < NOTHING
}

/// Which parameter causes how much of the error: at the tip, or of the direction if there is none at the tip.
fn cause(before: &Quality, shares: &[Share]) -> String {
    let at_tip = before.translation_um.mean >= NOTHING;
    let mean = |quality: &Quality| match at_tip {
        true => quality.translation_um.mean,
        false => quality.direction_urad.mean,
    };
    let unit = match at_tip {
        true => "µm",
        false => "µrad of the tool's direction",
    };
    let most = shares.iter().max_by(|a, b| {
        let (a, b) = (mean(&a.alone), mean(&b.alone));
        a.total_cmp(&b)
    });
    let all = mean(before);
    match most {
        None => format!("The error is {} {unit} on average.", figure(all)),
        Some(_) if is_nothing(before) => {
            "The errors that are known change nothing at the tool.".to_owned()
        }
        Some(most) => {
            let (words, name) = (capital(&most.words), &most.name);
            let alone = mean(&most.alone);
            match alone <= all {
                true => format!(
                    "{words} ({name}) causes {} of {} {unit} on average.",
                    figure(alone),
                    figure(all)
                ),
                false => format!(
                    "{words} ({name}) by itself would cause {} {unit} on average; together with the others it is {}.",
                    figure(alone),
                    figure(all)
                ),
            }
        }
    }
}

/// What a correction leaves, and how well that is known.
fn left(volumetric: &Volumetric) -> String {
    let figures = |quality: &Quality| {
        format!(
            "{} µm and {} µrad on average ({} µm and {} µrad at most)",
            figure(quality.translation_um.mean),
            figure(quality.direction_urad.mean),
            figure(quality.translation_um.max),
            figure(quality.direction_urad.max)
        )
    };
    let left = match (&volumetric.after, &volumetric.kinematic) {
        (Some(after), _) => format!("These tables leave {}", figures(after)),
        (None, Some(best)) => format!(
            "Without tables all of it stays; the best correction would leave {}",
            figures(best)
        ),
        (None, None) => "Without tables all of it stays".to_owned(),
    };
    let known = match &volumetric.known {
        Some(known) => format!(
            "the parameters themselves are known to ±{} µm and ±{} µrad (95 %).",
            figure(known.band.translation_um.mean),
            figure(known.band.direction_urad.mean)
        ),
        None => "how well the parameters themselves are known is not said.".to_owned(),
    };
    format!("{left}; {known}")
}
