//! Refuses a compensation whose corrections could move faster than the machine file allows.

use crate::dynamics::dynamics;
use std::fmt;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;

/// A correction that can move faster, or change its speed faster, than its axis allows.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub struct TooFast {
    /// Number of the axis.
    pub axis: usize,
    /// True for the acceleration, false for the speed.
    pub is_acceleration: bool,
    /// What the blob allows (mm/s or deg/s, per s).
    pub found: f64,
    /// The limit.
    pub limit: f64,
    letter: char,
    unit: &'static str,
    /// The axis that contributes most, its top speed and its part.
    cause: (char, f64, f64),
    cause_unit: &'static str,
}

impl fmt::Display for TooFast {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            letter,
            unit,
            found,
            limit,
            cause: (cause, speed, part),
            cause_unit,
            ..
        } = self;
        let (what, per) = match self.is_acceleration {
            true => ("change its speed by", "s²"),
            false => ("move at", "s"),
        };
        write!(
            f,
            "the correction of {letter} can {what} {} {unit}/{per} while the axes run at top speed, more than {limit} \
             {unit}/{per}; {} of it from {cause} at {speed} {cause_unit}/s",
            rounded(*found),
            rounded(*part),
        )
    }
}

/// Three digits, the last one up.
fn rounded(value: f64) -> String {
    let unit = libm::pow(10_f64, libm::log10(value.abs().max(1e-9)).floor() - 2.0);
    let digits = (-libm::log10(unit)).round().max(0.0) as usize;
    format!("{:.digits$}", (value / unit).ceil() * unit)
}

impl TooFast {
    /// What to do about it.
    #[must_use]
    pub fn remedy(&self) -> &'static str {
        match self.is_acceleration {
            false => {
                "raise the limit if the drive follows, lower max_speed if the axes are slower, or check the errors"
            }
            true => {
                "give more --points, so that slopes change less at each, raise the limit if the drive follows, or lower max_speed if the axes are slower"
            }
        }
    }
}

/// Compares what the blob allows with the limits of every axis that has some.
///
/// # Errors
/// The first axis beyond one.
pub fn check(machine: &Machine, runtime: &Runtime<'_>) -> Result<(), TooFast> {
    let limits = &machine.correction_limits;
    if limits.iter().all(|of| *of == Default::default()) {
        return Ok(());
    }
    let found = dynamics(runtime.compensation(), &machine.axes, machine.servo_period);
    for (axis, (of, limits)) in found.iter().zip(limits).enumerate() {
        for (kind, found, limit) in [
            (0, of.speed, limits.speed),
            (1, of.acceleration, limits.acceleration),
        ] {
            let Some(limit) = limit.filter(|limit| found > *limit) else {
                continue;
            };
            let parts = of.parts.iter().enumerate();
            let most = parts.max_by(|(_, a), (_, b)| a[kind].total_cmp(&b[kind]));
            let (cause, part) = most.map_or((axis, 0.0), |(cause, part)| (cause, part[kind]));
            let [of_limit, of_cause] = [axis, cause].map(|k| &machine.axes[k]);
            return Err(TooFast {
                axis,
                is_acceleration: kind == 1,
                found,
                limit,
                letter: of_limit.letter.char(),
                unit: of_limit.unit(),
                cause: (of_cause.letter.char(), of_cause.max_speed, part),
                cause_unit: of_cause.unit(),
            });
        }
    }
    Ok(())
}
