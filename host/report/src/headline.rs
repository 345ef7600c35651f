//! The first line of a report: how large the error was, how large it is with the tables, and what that rests on.

use super::Volumetric;
use super::words::{rounded_up, sensible};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::validate::{Quality, Statistics};

/// Errors below this (µm, µrad) count as zero.
const NOTHING: f64 = 5e-5;

/// One sentence, for someone with no time. Figures are those that 95 % of positions do not exceed; with uncertainties, the
/// second holds with 95 % probability, and is a limit if the tip was measured in space and no error was left out.
pub fn headline(volumetric: &Volumetric, errors: &ErrorModel) -> String {
    let tip = |quality: &Quality| quality.translation_um;
    let direction = |quality: &Quality| quality.direction_urad;
    let is_bound = errors.bounds_the_tip();
    match &volumetric.before {
        before if tip(before).max >= NOTHING => said(volumetric, is_bound, "Tip error", "µm", tip),
        before if direction(before).max >= NOTHING => said(
            volumetric,
            is_bound && errors.is_direction_measured(),
            "Tool direction error",
            "µrad",
            direction,
        ),
        _ => "No error is known: there is nothing to correct".to_owned(),
    }
}

fn said(
    volumetric: &Volumetric,
    is_limit: bool,
    what: &str,
    unit: &str,
    of: impl Fn(&Quality) -> Statistics,
) -> String {
    let before = sensible(of(&volumetric.before).p95);
    let measured = match is_limit {
        true => "",
        false => ", as far as it was measured",
    };
    match (&volumetric.after, &volumetric.known) {
        (None, None) => format!("{what} {before} {unit}, if the errors are as entered"),
        (None, Some(_)) => format!("{what} {before} {unit}{measured}"),
        (Some(after), None) => format!(
            "{what} {before} → {} {unit} with the tables, if the errors are as entered",
            sensible(of(after).p95)
        ),
        (Some(after), Some(known)) => {
            let most = rounded_up(of(&known.with_tables(after)).p95);
            let zone = match known.is_of_zone {
                true => " in the probed zone",
                false => "",
            };
            match is_limit {
                true => {
                    format!("{what} {before} → at most {most} {unit} with the tables{zone} (95 %)")
                }
                false => format!(
                    "{what} {before} → about {most} {unit} with the tables{zone}, by the errors that were measured (95 %)"
                ),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::ErrorKnowledge;
    use super::*;

    fn quality(tip: f64, direction: f64) -> Quality {
        let all = |v: f64| Statistics {
            mean: v,
            rms: v,
            p95: v,
            max: v,
        };
        Quality {
            translation_um: all(tip),
            direction_urad: all(direction),
        }
    }

    fn found(before: Quality, after: Option<Quality>, band: Option<Quality>) -> Volumetric {
        Volumetric {
            positions: 1,
            before,
            after,
            kinematic: None,
            difference_um: None,
            difference_urad: None,
            meets_tolerance: None,
            um_per_mm_of_tool_length: None,
            known: band.map(|at_most| ErrorKnowledge {
                at_most,
                ..ErrorKnowledge::default()
            }),
        }
    }

    #[test]
    fn before_after_and_what_it_rests_on_stand_in_one_line() {
        let text = include_str!("../../../examples/huron-k2x8/machine.toml");
        let machine = trueaxis_model::machine::Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        let before = quality(68.3, 90.0);
        let after = Some(quality(0.002, 0.1));
        let said = |after, band, errors: &ErrorModel| headline(&found(before, after, band), errors);
        assert_eq!(
            said(None, None, &errors),
            "Tip error 68 µm, if the errors are as entered"
        );
        assert_eq!(
            said(after, None, &errors),
            "Tip error 68 → below 0.01 µm with the tables, if the errors are as entered"
        );
        let band = Some(quality(9.1, 5.0));
        let about =
            "Tip error 68 → about 9.2 µm with the tables, by the errors that were measured (95 %)";
        assert_eq!(said(after, band, &errors), about);
        errors.misfit = Some(1e-4);
        assert_eq!(
            said(after, band, &errors),
            "Tip error 68 → at most 9.2 µm with the tables (95 %)"
        );
        let whole = errors.clone();
        let unseen = trueaxis_model::errors::Parameter::parse("EXX1").unwrap();
        errors.unseen.insert(unseen, 4.0);
        assert_eq!(said(after, band, &errors), about);
        let mut probed = found(before, after, band);
        probed.known.as_mut().unwrap().is_of_zone = true;
        assert_eq!(
            headline(&probed, &whole),
            "Tip error 68 → at most 9.2 µm with the tables in the probed zone (95 %)"
        );
        assert_eq!(
            headline(&found(quality(0.0, 30.0), None, None), &errors),
            "Tool direction error 30 µrad, if the errors are as entered"
        );
    }
}
