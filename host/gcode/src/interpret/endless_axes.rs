//! Words of endless rotary axes, and the direction they mean.

use super::Asked;
use crate::axes;
use crate::dialect::{Dialect, Wrapping};
use crate::fault::Fault;
use crate::state::State;

/// Degrees that are no motion: what f64 loses between program and machine coordinates.
const NOTHING: f64 = 1e-7;

impl State {
    /// Where an absolute word of an axis leads (machine, mm or degrees).
    pub(super) fn absolute(&self, asked: &Asked<'_>, axis: usize) -> Result<f64, Fault> {
        let value = self.value(asked, axis)?;
        let as_written = self.offsets.machine_axis(axis, value);
        let Some(word) = asked.word(axes::LETTERS[axis]) else {
            return Ok(as_written);
        };
        let (rules, letter) = (asked.rules, axes::name(axis));
        if rules.setup.wrapped[axis] != Some(true) {
            let matters = rules.dialect.table().may_wrap
                && rules.setup.wrapped[axis].is_none()
                && rules.endless & (1 << axis) != 0
                && self.position.knows(axis)
                && (as_written - self.position.at[axis]).abs() > 180.0;
            return match matters {
                false => Ok(as_written),
                true => Err(word.fault(format!(
                        "{letter} turns for ever, and the shorter way is the other one: whether the controller takes it is a parameter"
                    ),
                    format!("say it in the setup: [axis.{letter}] wrapped = true, or false"),
                )),
            };
        }
        if !self.position.knows(axis) {
            return Err(self.not_known(asked.rules, word, axis));
        }
        let here = self.position.at[axis] - self.offsets.machine_axis(axis, 0.0);
        let there = wrapped(rules.dialect, value, here).map_err(|cause| {
            word.fault(
                cause,
                "write it as two moves, each of less than half a turn",
            )
        })?;
        Ok(self.offsets.machine_axis(axis, there))
    }
}

/// Where a word of a wrapped axis leads, in degrees that go on counting, and the cause where that is not known.
///
/// LinuxCNC (`WRAPPED_ROTARY`): to the angle, in the direction of the word's sign. Fanuc (roll-over): the shorter way.
/// Grbl has none.
pub fn wrapped(dialect: Dialect, word: f64, here: f64) -> Result<f64, String> {
    match dialect.table().wrapping {
        Wrapping::Sign => {
            if word.abs() >= 360.0 {
                return Err("a word of a wrapped axis that is a turn or more".to_owned());
            }
            let there = word.abs() + 360.0 * (here / 360.0).floor();
            let by = there - here;
            Ok(if (by.abs() + NOTHING).rem_euclid(360.0) < 2.0 * NOTHING {
                here
            } else if word.is_sign_negative() && by > 0.0 {
                there - 360.0
            } else if word.is_sign_positive() && by < 0.0 {
                there + 360.0
            } else {
                there
            })
        }
        Wrapping::Shorter => {
            let by = (word - here).rem_euclid(360.0);
            if (by - 180.0).abs() < NOTHING {
                return Err("half a turn of a wrapped axis: its direction is unknown".to_owned());
            }
            Ok(here + if by > 180.0 { by - 360.0 } else { by })
        }
        Wrapping::None => Ok(word),
    }
}

/// The word that turns a wrapped axis from here to there (degrees that go on counting), with so many decimals, and
/// where it leads; `None` if no word does.
pub(crate) fn word_of_wrapped(
    dialect: Dialect,
    here: f64,
    there: f64,
    decimals: usize,
) -> Option<(f64, f64)> {
    let last = 10_f64.powi(-(decimals as i32));
    let rounded = crate::number::rounded(there, decimals);
    let mut angle = crate::number::rounded(rounded.rem_euclid(360.0), decimals);
    if angle >= 360.0 {
        angle = 0.0;
    }
    if dialect.table().wrapping == Wrapping::Sign && there < here {
        // There is no −0 in words: the next angle.
        angle = if angle == 0.0 { -last } else { -angle };
    }
    let leads = wrapped(dialect, angle, here).ok()?;
    ((leads - there).abs() <= 1.6 * last).then_some((angle, leads))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_sign_is_the_direction_in_linuxcnc_and_fanuc_takes_the_shorter_way() {
        // What `rs274` answers with WRAPPED_ROTARY = 1.
        for (word, here, there) in [
            (90.0, 0.0, 90.0),
            (-90.0, 0.0, -270.0),
            (10.0, 350.0, 370.0),
            (-10.0, 20.0, 10.0),
            (350.0, 370.0, 710.0),
            (-350.0, 370.0, 350.0),
            (45.0, 45.0, 45.0),
            (-0.0, 90.0, 0.0),
            (0.0, 90.0, 360.0),
        ] {
            assert_eq!(
                wrapped(Dialect::LinuxCnc, word, here),
                Ok(there),
                "{word} {here}"
            );
        }
        assert!(wrapped(Dialect::LinuxCnc, 360.0, 0.0).is_err());
        for (word, here, there) in [
            (350.0, 10.0, -10.0),
            (10.0, 350.0, 370.0),
            (190.0, 0.0, -170.0),
            (170.0, 0.0, 170.0),
            (-170.0, 720.0, 550.0),
        ] {
            assert_eq!(
                wrapped(Dialect::Fanuc, word, here),
                Ok(there),
                "{word} {here}"
            );
        }
        assert!(wrapped(Dialect::Fanuc, 180.0, 0.0).is_err());
    }

    proptest! {
        #[test]
        fn a_word_leads_where_it_was_made_for(here in -800.0..800.0_f64, by in -179.0..179.0_f64) {
            for dialect in [Dialect::LinuxCnc, Dialect::Fanuc] {
                prop_assume!(by.abs() > 1e-4);
                let (word, leads) = word_of_wrapped(dialect, here, here + by, 5).unwrap();
                prop_assert_eq!(wrapped(dialect, word, here), Ok(leads));
                prop_assert!((leads - here - by).abs() < 1.6e-5);
            }
        }
    }
}
