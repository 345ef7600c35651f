//! Checks the joints of the INI file: compensated twice, limits, headroom.

use super::beforehand::{missing, wrong_kind};
use super::{CheckState, JointAxis};
use crate::configuration::Configuration;
use crate::formats::ini::{FileLocation, IniEntry};
use trueaxis::Direction;

/// `STEPGEN_MAXACCEL` beside `MAX_ACCELERATION` with backlash, as LinuxCNC's pncconf writes it.
const DOUBLE: f64 = 2.0;

impl CheckState<'_> {
    /// Checks the `[JOINT_N]` section of a joint with an axis of the compensation.
    pub(super) fn joint(&mut self, joint: JointAxis) {
        self.findings.extend(wrong_kind(self.configuration, joint));
        self.twice(joint);
        self.limits(joint);
        self.headroom(joint);
    }

    /// Whether the compensation corrects an axis at all, and whether depending on its own direction of travel.
    fn corrects(&self, index: usize) -> (bool, bool) {
        let compensation = self.against.runtime.compensation();
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
    fn twice(&mut self, joint: JointAxis) {
        let Some((index, _)) = self.axis(joint.letter) else {
            return;
        };
        let (corrected, reverses) = self.corrects(index);
        let JointAxis { number, letter } = joint;
        let kept = self.configuration.kept(letter);
        if !kept.is_empty() {
            let own = kept.iter().filter(|(of, _)| of.number == number);
            let own = own.filter(|_| reverses || corrected);
            return own.for_each(|(_, entry)| self.kept(joint, entry, reverses));
        }
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
        let Some(backlash) = self.configuration.compensated(number, "BACKLASH") else {
            return;
        };
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

    /// A compensation that stays with LinuxCNC beside tables, which may have directions of travel.
    fn kept(&mut self, JointAxis { number, letter }: JointAxis, entry: &IniEntry, reverses: bool) {
        let (key, place) = (&entry.key, entry.place.clone());
        if reverses {
            self.refuse(
                &place,
                format!("joint {number} is compensated twice: by {key}, which stays because the joints of {letter} differ, and by tables of {letter} for each direction of travel"),
                format!("nothing here: take E{letter}{letter}b out of the error file, and compile again"),
            );
        } else {
            self.warn(
                &place,
                format!("{key} of joint {number} stays with LinuxCNC, because the joints of {letter} differ: it is right only if the errors were measured with it"),
                format!("nothing, if {letter} was measured with it"),
            );
        }
    }

    /// Travel limits, which must be inside those of the compensation by its bound.
    fn limits(&mut self, joint: JointAxis) {
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
            let write = format!(
                "{key} = {}",
                inside((limit + inwards * bound) / unit, inwards)
            );
            let limit_of = self.configuration.limit(joint, key);
            let Some((value, entry)) = limit_of else {
                if self.configuration.is_endless(joint) {
                    self.turns_without_end(joint, &place, limit / unit);
                    return;
                }
                let Some(is) = missing(entry) else { continue };
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
            let place = entry.place.clone();
            let room = (value * unit - limit) * inwards;
            if room < 0.0 {
                self.refuse(
                    &place,
                    format!("{key} of joint {} is {value}, outside the travel of the compensation, which ends at {}: beyond, tables keep their end values", joint.number, limit / unit),
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

    /// A joint that turns without end, for a compensation that does not.
    fn turns_without_end(&mut self, joint: JointAxis, place: &FileLocation, limit: f64) {
        let JointAxis { number, letter } = joint;
        self.refuse(
            place,
            format!("joint {number} turns without end, and the compensation of {letter} ends at {limit}"),
            format!("range = [-180.0, 180.0] and modulo = true for {letter} in the machine file, and compile again"),
        );
    }

    /// Step generators, which must be faster than the joint by the rate of its correction.
    fn headroom(&mut self, joint: JointAxis) {
        let Some((_, axis)) = self.axis(joint.letter) else {
            return;
        };
        let configuration = self.configuration;
        let number = |key: &str| configuration.number(joint.number, key);
        let rate = f64::from(axis.rate_bound) / configuration.unit(joint);
        let Some(speed) = number("MAX_VELOCITY") else {
            if configuration
                .of_joint(joint.number, "MAX_VELOCITY")
                .is_none()
            {
                let place = configuration.section(&format!("JOINT_{}", joint.number));
                self.warn(
                    &place.clone(),
                    format!("joint {} has no MAX_VELOCITY: whether its drive has headroom for the correction is not checked", joint.number),
                    "MAX_VELOCITY = its speed".to_owned(),
                );
            }
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
            match entry.number() {
                Some((value, _)) if value >= least * (1.0 - 1e-9) => {}
                Some((value, _)) => self.refuse(
                    &entry.place.clone(),
                    format!("{key} of joint {} is {value}: {of} and the correction, at up to {} per s, need {}", joint.number, shown(rate), shown(least)),
                    write,
                ),
                // Reported by `readable`.
                None => {}
            }
        }
        self.faster(joint, speed * configuration.unit(joint));
        self.reversal(joint);
    }

    /// An axis that makes up its backlash faster than its step generator permits.
    fn reversal(&mut self, joint: JointAxis) {
        let configuration = self.configuration;
        let letter = joint.letter;
        let Some(reversal) = self.reversals.iter().find(|r| r.axis == letter) else {
            return;
        };
        let asked = reversal.acceleration / configuration.unit(joint);
        let Some(entry) = configuration.of_joint(joint.number, "MAX_ACCELERATION") else {
            return;
        };
        let number = |key: &str| configuration.number(joint.number, key);
        let Some(most) = number("MAX_ACCELERATION").filter(|most| *most > 0.0) else {
            return self.warn(
                &entry.place,
                format!("MAX_ACCELERATION of joint {} is `{}`, which cannot be compared with the reversals of {letter}", joint.number, entry.value),
                "MAX_ACCELERATION = a number".to_owned(),
            );
        };
        if let Some(entry) = configuration.of_joint(joint.number, "STEPGEN_MAXACCEL")
            && let Some(room) = number("STEPGEN_MAXACCEL").map(|value| value - most)
            && asked > room * (1.0 + 1e-6)
        {
            self.warn(
                &entry.place,
                format!("STEPGEN_MAXACCEL of joint {} leaves {} per s², and a reversal of {letter} takes {}: where it turns round at full acceleration, the drive lags", joint.number, shown(room), shown(asked)),
                format!("STEPGEN_MAXACCEL = {}", shown(most * DOUBLE)),
            );
        }
    }

    /// A joint that is faster (mm/s, deg/s) than the rate bound was made for.
    fn faster(&mut self, joint: JointAxis, speed: f64) {
        let configuration: &Configuration = self.configuration;
        let Some(machine) = self.against.machine else {
            return;
        };
        let Some(axis) = machine.index(joint.letter).map(|i| &machine.axes[i]) else {
            return;
        };
        // Joints of one axis move together, as the slowest of them can.
        let beside = configuration.axes().into_iter();
        let slower = beside
            .filter(|other| other.letter == joint.letter)
            .filter_map(|other| configuration.number(other.number, "MAX_VELOCITY"))
            .any(|other| other > 0.0 && other * configuration.unit(joint) < speed);
        if !slower
            && speed > axis.max_speed * (1.0 + 1e-9)
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

/// A limit rounded inwards (1 or -1), so that the value passes the check.
fn inside(limit: f64, inwards: f64) -> f64 {
    let step = 1e-4;
    ((limit * inwards / step).ceil() * step * inwards * 1e4).round() / 1e4
}

/// A number as text.
fn shown(value: f64) -> String {
    let text = format!("{value:.4}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
