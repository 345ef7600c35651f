//! Checks the joints of the INI file: compensated twice, limits, headroom.

use super::{Checked, Joint};
use crate::linuxcnc::configuration::Configuration;
use trueaxis::Direction;

impl Checked<'_> {
    /// Checks the `[JOINT_N]` section of a joint with an axis of the compensation.
    pub(super) fn joint(&mut self, joint: Joint) {
        let configuration = self.configuration;
        let is_rotary = matches!(joint.letter, 'A' | 'B' | 'C');
        if let Some(kind) = configuration.of_joint(joint.number, "TYPE") {
            let expected = if is_rotary { "ANGULAR" } else { "LINEAR" };
            if !kind.value.eq_ignore_ascii_case(expected) {
                self.refuse(
                    &kind.place.clone(),
                    format!(
                        "joint {} has the axis {}, which is not {}",
                        joint.number, joint.letter, kind.value
                    ),
                    format!("TYPE = {expected}"),
                );
            }
        }
        self.twice(joint);
        self.limits(joint);
        self.headroom(joint);
    }

    /// Whether the compensation corrects an axis at all, and whether depending on its own direction of travel.
    fn corrects(&self, index: usize) -> (bool, bool) {
        let compensation = self.against.compensation;
        let mut terms = compensation.terms();
        let is = |output: &u8| usize::from(*output) == index;
        let corrected = terms.any(|term| is(&term.output))
            || compensation
                .grids()
                .iter()
                .any(|grid| grid.outputs.iter().any(is));
        let reverses = compensation
            .banks()
            .iter()
            .any(|bank| usize::from(bank.input) == index && bank.direction != Direction::Both);
        (corrected, reverses)
    }

    /// Screw error or backlash that LinuxCNC also compensates.
    fn twice(&mut self, joint: Joint) {
        let Some((index, _)) = self.axis(joint.letter) else {
            return;
        };
        let (corrected, reverses) = self.corrects(index);
        let Joint { number, letter } = joint;
        if let Some(file) = self.configuration.of_joint(number, "COMP_FILE")
            && !file.value.is_empty()
            && corrected
        {
            self.refuse(
                &file.place.clone(),
                format!("joint {number} is compensated twice: by COMP_FILE, and by the compensation of {letter}"),
                format!("# COMP_FILE = {}", file.value),
            );
        }
        let Some(backlash) = self.configuration.of_joint(number, "BACKLASH") else {
            return;
        };
        if backlash.value.parse() == Ok(0.0) {
            return;
        }
        let place = backlash.place.clone();
        if reverses {
            self.refuse(
                &place,
                format!("joint {number} is compensated twice: by BACKLASH, and by tables of {letter} for each direction of travel"),
                "BACKLASH = 0".to_owned(),
            );
        } else if corrected {
            self.warn(
                &place,
                format!("BACKLASH stays with LinuxCNC, for the compensation has none for {letter}: it is right only if the errors were measured with it"),
                format!("BACKLASH = 0, and E{letter}{letter}b in the error file"),
            );
        }
    }

    /// Travel limits, which must be inside those of the compensation by its bound.
    fn limits(&mut self, joint: Joint) {
        let Some((_, axis)) = self.axis(joint.letter) else {
            return;
        };
        if axis.period > 0.0 {
            return;
        }
        let unit = self.configuration.unit(joint);
        let bound = f64::from(axis.value_bound);
        for (key, limit, inwards) in [
            ("MIN_LIMIT", axis.travel[0], 1.0),
            ("MAX_LIMIT", axis.travel[1], -1.0),
        ] {
            let limit = f64::from(limit);
            let entry = self.configuration.of_joint(joint.number, key);
            let section = format!("JOINT_{}", joint.number);
            let place = entry
                .map_or(self.configuration.section(&section), |e| &e.place)
                .clone();
            let right = (limit + inwards * bound) / unit;
            // Rounded inwards, so that the value passes the check.
            let step = 1e-4;
            let right = ((right * inwards / step).ceil() * step * inwards * 1e4).round() / 1e4;
            let write = format!("{key} = {right}");
            let Some(value) = self.configuration.number(joint.number, key) else {
                let is = match entry {
                    Some(entry) => format!("is `{}`, no number", entry.value),
                    None => "is missing".to_owned(),
                };
                self.refuse(
                    &place,
                    format!(
                        "{key} of joint {} {is}, and the compensation of {} ends at {}",
                        joint.number,
                        joint.letter,
                        limit / unit
                    ),
                    write,
                );
                continue;
            };
            let room = (value * unit - limit) * inwards;
            if room < 0.0 {
                self.refuse(
                    &place,
                    format!("{key} of joint {} is {value}, outside the travel of the compensation, which ends at {}: beyond, tables hold their end values", joint.number, limit / unit),
                    write,
                );
            } else if room < bound * (1.0 - 1e-6) {
                self.warn(
                    &place,
                    format!("{key} of joint {} leaves less than the largest correction, {}, up to the end of the travel: a corrected command may go beyond it", joint.number, shown(bound / unit)),
                    write,
                );
            }
        }
    }

    /// Step generators, which must be faster than the joint by the rate of its correction.
    fn headroom(&mut self, joint: Joint) {
        let Some((_, axis)) = self.axis(joint.letter) else {
            return;
        };
        let configuration = self.configuration;
        let number = |key: &str| configuration.number(joint.number, key);
        let rate = f64::from(axis.rate_bound) / configuration.unit(joint);
        let Some(speed) = number("MAX_VELOCITY") else {
            return;
        };
        // While the joint accelerates along a slope of r/v, so does its correction.
        let share = rate / speed.max(f64::MIN_POSITIVE);
        let wanted = [
            ("STEPGEN_MAXVEL", "MAX_VELOCITY", speed + rate),
            (
                "STEPGEN_MAXACCEL",
                "MAX_ACCELERATION",
                number("MAX_ACCELERATION").map_or(0.0, |a| a * (1.0 + share)),
            ),
        ];
        for (key, of, least) in wanted {
            let Some(entry) = configuration.of_joint(joint.number, key) else {
                continue;
            };
            let write = format!("{key} = {}", (least * 1e3).ceil() / 1e3);
            match entry.value.parse::<f64>() {
                Ok(value) if value >= least * (1.0 - 1e-9) => {}
                Ok(value) => self.refuse(
                    &entry.place.clone(),
                    format!("{key} of joint {} is {value}: {of} and the correction, at up to {} per s, need {}", joint.number, shown(rate), shown(least)),
                    write,
                ),
                Err(_) => self.refuse(
                    &entry.place.clone(),
                    format!("{key} of joint {} is `{}`, no number", joint.number, entry.value),
                    write,
                ),
            }
        }
        self.faster(joint, speed * configuration.unit(joint));
    }

    /// A joint that is faster (mm/s, deg/s) than the rate bound was made for.
    fn faster(&mut self, joint: Joint, speed: f64) {
        let configuration: &Configuration = self.configuration;
        let Some(machine) = self.against.machine else {
            return;
        };
        let Some(axis) = machine.index(joint.letter).map(|i| &machine.axes[i]) else {
            return;
        };
        if speed > axis.max_speed * (1.0 + 1e-9)
            && let Some(entry) = configuration.of_joint(joint.number, "MAX_VELOCITY")
        {
            self.warn(
                &entry.place.clone(),
                format!("joint {} goes up to {} {}/s, the rate bound of {} was made for {}: at full speed corrections may lag", joint.number, shown(speed), axis.unit(), joint.letter, axis.max_speed),
                format!("max_speed = {speed:?} for {} in the machine file, and compile again", joint.letter),
            );
        }
    }
}

/// A number as text.
fn shown(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
