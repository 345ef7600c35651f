//! The loop that a controller calls in every period.

use crate::Room;
use crate::border::Held;
use crate::capacities::TRUEAXIS_AXES;
use crate::code::Code;
use crate::facts::{ServoMemory, StatusFacts};
use trueaxis::{AuxiliaryKind, Compensation, Conditions, Handle, Inputs, Servo as Loop, Travel};

/// A servo: it holds tables and computes corrections.
pub struct Servo {
    pub(crate) around: Around,
    pub(crate) servo: Loop<Held>,
}

/// State around the loop.
pub(crate) struct Around {
    pub(crate) released: bool,
    axes: u32,
    /// Length of one turn of each endless axis; infinite for others.
    turns: [f64; TRUEAXIS_AXES],
    inputs: Inputs<[f32; TRUEAXIS_AXES]>,
}

/// Number of evaluations to convert a measured position: the remaining error is proportional to the fourth power of the
/// largest slope of the correction, which is 1e-3 on a bad machine.
const STEPS: u32 = 4;

const _: () = {
    assert!(
        size_of::<Servo>() <= size_of::<ServoMemory>(),
        "a servo has grown: raise TRUEAXIS_SERVO_WORDS in facts.rs"
    );
    assert!(align_of::<Servo>() <= align_of::<ServoMemory>());
};

/// Number of turns beyond which a double is too coarse for a position; this also limits the time of a reduction.
const MOST_TURNS: f64 = 4_294_967_296.0;

/// Reduces a position to one turn of its axis, without any loss beyond that in the double itself. Within the turn it is
/// unchanged; beyond [`MOST_TURNS`] it becomes NAN.
#[inline(always)]
fn within_turn(q: f64, turn: f64) -> f64 {
    // Positive doubles sort like their bits, and NAN is above infinity: a processor without double-precision hardware
    // compares integers in a few instructions.
    let within = |turn: f64| q.abs().to_bits() <= turn.to_bits();
    if within(turn) {
        q
    } else if within(turn * MOST_TURNS) {
        q % turn
    } else {
        f64::NAN
    }
}

impl Servo {
    /// State around the loop of a servo with these tables.
    pub(crate) fn around(compensation: &Compensation<'_, Room>) -> Around {
        let mut turns = [f64::INFINITY; TRUEAXIS_AXES];
        let axes = compensation.axes();
        for (turn, axis) in turns.iter_mut().zip(axes) {
            if axis.period > 0.0 {
                *turn = axis.period.into();
            }
        }
        Around {
            released: false,
            axes: axes.len() as u32,
            turns,
            inputs: Inputs::at([0.0; TRUEAXIS_AXES]),
        }
    }

    /// Checks that the length of an array is the number of axes.
    #[inline(always)]
    pub(crate) fn check(&self, count: usize) -> Result<(), Code> {
        if count == self.around.axes as usize {
            Ok(())
        } else {
            Err(Code::Count)
        }
    }

    /// Positions in the number type of the tables.
    #[inline(always)]
    fn positions(&self, from: &[f64]) -> [f32; TRUEAXIS_AXES] {
        let mut to = [0.0; TRUEAXIS_AXES];
        for ((to, q), turn) in to.iter_mut().zip(from).zip(&self.around.turns) {
            *to = within_turn(*q, *turn) as f32;
        }
        to
    }

    #[inline(always)]
    pub(crate) fn take_commands(&mut self, commands: &[f64]) {
        self.around.inputs.axes = self.positions(commands);
    }

    /// Storage for the commands of the next update, in the number type of the tables.
    #[inline(always)]
    pub(crate) fn commands(&mut self) -> &mut [f32; TRUEAXIS_AXES] {
        &mut self.around.inputs.axes
    }

    #[inline(always)]
    pub(crate) fn advance(&mut self, referenced: u32, period: f32) -> &[f32; TRUEAXIS_AXES] {
        let correction = self
            .servo
            .advance(&self.around.inputs, referenced as u16, period);
        &correction.dq
    }

    pub(crate) fn enable(&mut self, on: bool) {
        if on {
            self.servo.enable();
        } else {
            self.servo.disable();
        }
    }

    pub(crate) fn pass_time(&mut self, time: f64) {
        self.servo
            .pass_time(&self.around.inputs.auxiliaries, time as f32);
    }

    /// `value` in mm or °C. Inputs with the same name are one sensor with several lags, and are set together.
    pub(crate) fn set_auxiliary(&mut self, index: usize, value: f64) -> Result<(), Code> {
        let auxiliaries = self.servo.compensation().auxiliaries();
        let named = auxiliaries.get(index).ok_or(Code::Index)?;
        for (to, auxiliary) in (self.around.inputs.auxiliaries.iter_mut()).zip(auxiliaries) {
            if (auxiliary.kind, &auxiliary.name) != (named.kind, &named.name) {
                continue;
            }
            *to = match auxiliary.kind {
                AuxiliaryKind::ToolLength => value,
                AuxiliaryKind::Temperature => value - f64::from(auxiliary.reference),
            } as f32;
        }
        Ok(())
    }

    pub(crate) fn set_tool_length(&mut self, length: f64) -> Result<(), Code> {
        let auxiliaries = self.servo.compensation().auxiliaries().iter();
        let mut found = Err(Code::Name);
        for (to, auxiliary) in self.around.inputs.auxiliaries.iter_mut().zip(auxiliaries) {
            if auxiliary.kind == AuxiliaryKind::ToolLength {
                *to = length as f32;
                found = Ok(());
            }
        }
        found
    }

    pub(crate) fn set_weight(&mut self, term: usize, weight: f64) -> Result<(), Code> {
        Ok(self.servo.set_weight(term, weight as f32)?)
    }

    pub(crate) fn weight(&self, term: usize) -> Result<f64, Code> {
        let weight = self.servo.wanted_weights().get(term);
        Ok(weight.ok_or(Code::WeightFixed)?.into())
    }

    pub(crate) fn set_travel(&mut self, axis: usize, direction: i32) -> Result<(), Code> {
        if axis >= self.around.axes as usize {
            return Err(Code::Index);
        }
        let travel = match direction {
            0 => Travel::Unknown,
            1.. => Travel::Positive,
            _ => Travel::Negative,
        };
        self.servo.set_travel(axis, travel);
        Ok(())
    }

    /// Adopts other tables, or the stored weights of those in use; returns what it no longer holds.
    pub(crate) fn swap(&mut self, held: Held) -> Result<Option<Held>, (Code, Held)> {
        self.servo
            .swap(held)
            .map_err(|refused| (refused.why.into(), refused.handle))
    }

    pub(crate) fn status(&self) -> StatusFacts {
        let status = self.servo.correction().status;
        StatusFacts {
            conditions: status.conditions.0,
            saturated: status.saturated,
            rate_limited: status.rate_limited,
            travel_limited: status.travel_limited,
            factor: self.servo.factor(),
        }
    }

    /// The corrections contained in measured positions, to be subtracted.
    pub(crate) fn measured(&self, measured: &[f64]) -> Result<[f32; TRUEAXIS_AXES], Code> {
        let conditions = self.servo.correction().status.conditions.0;
        if conditions & (Conditions::RAMPING | Conditions::FADING).0 != 0 {
            return Err(Code::Moving);
        }
        if self.servo.factor() == 0.0 {
            return Ok([0.0; TRUEAXIS_AXES]);
        }
        let inputs = Inputs {
            axes: self.positions(measured),
            auxiliaries: *self.servo.auxiliaries(),
        };
        let (held, travel) = (self.servo.handle(), self.servo.travelling());
        Ok(held.measured(&inputs, &travel, self.servo.wanted_weights(), STEPS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_turns_lose_nothing_but_what_the_double_has_lost() {
        for turn in [360.0, 120.0, 0.1_f32] {
            let turn = f64::from(turn);
            for place in [0.0, 0.125, 0.5, 0.999_999] {
                for turns in [0.0, 1.0, 8192.0, 1e6, -1.0, -1e6] {
                    let wide = turns * turn + (place * turn).copysign(turns);
                    let found = within_turn(wide, turn);
                    // The sum and its parts each round once; the reduction is exact.
                    let lost = 2.0 * f64::EPSILON * wide.abs();
                    let off = (found - (place * turn).copysign(turns)).abs();
                    assert!(
                        off.min(turn - off) <= lost,
                        "{turns} turns of {turn}: {off}"
                    );
                }
            }
        }
    }

    #[test]
    fn within_one_turn_and_without_a_turn_a_position_stays_as_it_is() {
        for (q, turn) in [
            (359.9, 360.0),
            (-360.0, 360.0),
            (1e9, f64::INFINITY),
            (-0.0, 360.0),
        ] {
            assert_eq!(within_turn(q, turn).to_bits(), f64::to_bits(q));
        }
        for q in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!within_turn(q, 360.0).is_finite());
            assert!(!within_turn(q, f64::INFINITY).is_finite());
        }
        assert_eq!(within_turn(360.0 * MOST_TURNS, 360.0), 0.0);
        assert!(within_turn(360.1 * MOST_TURNS, 360.0).is_nan());
    }
}
