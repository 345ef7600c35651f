//! From a machine to the positions at which tables are measured, with their reference corrections.

use crate::schemes::SchemeError;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::HashMap;
use std::sync::{Mutex, OnceLock, PoisonError};
use trueaxis::{AUXILIARIES, Travel};
use trueaxis_model::errors::Switches;
use trueaxis_model::kinematics::{Jacobian, Kinematics, NotConverged};
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::parallel;
use trueaxis_model::validate::{Command, Region, holds, random_commands};

/// Number of random positions at which tables are measured, and at which a good draft is confirmed.
const JUDGED: usize = 3000;
const CONFIRMED: usize = 8000;
/// Positions of rotary axes in their range at which a worse corner is searched, because sines may be largest anywhere.
const CLIMB_PARTS: [f64; 7] = [0.0, 1.0, 0.5, 0.25, 0.75, 0.125, 0.875];
/// Seed of the positions; a verification uses others.
pub const SEED: u64 = 0x6a75_6467;

/// Positions with their reference corrections. They do not depend on the tolerance.
pub struct Positions<'a> {
    pub kinematics: Kinematics<'a>,
    /// The correction at the zero position (mm, rad).
    pub zero: PerAxis,
    pub first: Vec<JudgedPosition>,
    /// Positions at which only drafts that are good so far are measured; drawn for the first such draft.
    pub others: OnceLock<Vec<JudgedPosition>>,
    /// Largest correction of each axis (mm, rad).
    pub largest: PerAxis,
    /// Positions reached by climbs; the next climb visits many of them again.
    climbed: Mutex<HashMap<Bits, JudgedPosition>>,
}

/// The bits of a command's numbers, and its directions of travel.
type Bits = ([u32; MAX_AXES], [u8; MAX_AXES], [u32; AUXILIARIES]);

/// A position with its reference correction.
#[derive(Clone)]
pub struct JudgedPosition {
    pub command: Command,
    /// The reference correction (mm, rad), minus that of the zero position.
    pub correction: PerAxis,
    /// Effect of the axes on the tool here.
    pub jacobian: Jacobian,
    /// True if a motion holds its end value here, at a bend that tables cannot follow.
    pub holds: bool,
}

impl<'a> Positions<'a> {
    /// Draws the positions: over the travel, and where no motion holds its end value. Half of them have axes at
    /// their ends, where most functions are largest.
    pub fn new(kinematics: &Kinematics<'a>, zero: PerAxis) -> Result<Self, SchemeError> {
        let first = places(kinematics, &zero, JUDGED, SEED)?;
        let largest = std::array::from_fn(|i| {
            let sizes = first.iter().map(|p| p.correction[i].abs());
            sizes.fold(0.0, f64::max)
        });
        Ok(Self {
            kinematics: kinematics.clone(),
            zero,
            first,
            others: OnceLock::new(),
            largest,
            climbed: Mutex::default(),
        })
    }

    /// The positions for confirmation, drawn on the first call only.
    pub fn others(&self) -> Result<&[JudgedPosition], SchemeError> {
        if self.others.get().is_none() {
            let drawn = places(&self.kinematics, &self.zero, CONFIRMED, !SEED)?;
            return Ok(self.others.get_or_init(|| drawn));
        }
        Ok(self.others.get().map_or(&[], Vec::as_slice))
    }

    /// The negligible fraction of a correction: a little of the tolerance relative to the largest correction.
    pub(crate) fn smallest_part(&self, tolerance: &PerAxis) -> f64 {
        let sizes = self.largest.iter().zip(tolerance).map(|(l, t)| l / t);
        0.02 / sizes.fold(1.0, f64::max)
    }

    /// [`JudgedPosition::inside`], computed once for each command.
    pub fn climbed_to(&self, command: Command) -> Result<JudgedPosition, NotConverged> {
        let bits = (
            command.axes.map(f32::to_bits),
            command.travel.map(|travel| travel as u8),
            command.auxiliaries.map(f32::to_bits),
        );
        let known = || self.climbed.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(place) = known().get(&bits) {
            return Ok(place.clone());
        }
        let place = JudgedPosition::inside(&self.kinematics, &self.zero, command)?;
        known().insert(bits, place.clone());
        Ok(place)
    }
}

/// Draws positions with their reference corrections: a quarter over the travel, the others where no motion holds its end
/// value. Half of them have axes at their ends, where most functions are largest.
pub fn places(
    kinematics: &Kinematics<'_>,
    zero: &PerAxis,
    count: usize,
    seed: u64,
) -> Result<Vec<JudgedPosition>, SchemeError> {
    let mut random = Pcg64Mcg::seed_from_u64(seed);
    let mut commands = Vec::new();
    for (region, count) in [(Region::Travel, count / 3), (Region::Inside, count)] {
        let drawn = random_commands(kinematics, region, count, seed ^ count as u64)?;
        commands.extend(drawn.into_iter().enumerate().map(|(number, mut command)| {
            // Some or all axes at an end; most contributions add up in corners.
            match number % 4 {
                0 => to_ends(kinematics, &mut command, region, &mut random, 4),
                1 => to_ends(kinematics, &mut command, region, &mut random, 2),
                _ => {}
            }
            (region, command)
        }));
    }
    let places = parallel::try_map(&commands, |(region, command)| match region {
        Region::Inside => JudgedPosition::inside(kinematics, zero, *command),
        _ => JudgedPosition::new(kinematics, zero, *command),
    })?;
    Ok(places)
}

impl JudgedPosition {
    fn new(
        kinematics: &Kinematics<'_>,
        zero: &PerAxis,
        command: Command,
    ) -> Result<Self, NotConverged> {
        let (q, situation) = command.kinematic(kinematics.machine);
        let exact = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
        Ok(Self {
            command,
            correction: std::array::from_fn(|i| exact[i] - zero[i]),
            jacobian: kinematics.jacobian(&q, situation.length),
            holds: holds(kinematics.machine, kinematics.errors, &q, &exact),
        })
    }

    /// If the correction at the end of an axis leads outside, uses a position just before the end, if possible.
    pub fn inside(
        kinematics: &Kinematics<'_>,
        zero: &PerAxis,
        mut command: Command,
    ) -> Result<Self, NotConverged> {
        let mut place = Self::new(kinematics, zero, command)?;
        for _ in 0..3 {
            if !place.holds {
                break;
            }
            draw_in(kinematics, &mut command, &place.correction, zero);
            place = Self::new(kinematics, zero, command)?;
        }
        Ok(place)
    }
}

/// The ranges from which inputs are drawn: axes (mm, deg) where no motion holds its end value or over their travel,
/// then tool length and temperatures.
fn ranges(kinematics: &Kinematics<'_>, region: Region) -> Vec<[f64; 2]> {
    let (machine, errors) = (kinematics.machine, kinematics.errors);
    let axis = |i: usize| {
        let [low, high] = machine.axes[i].travel;
        if region == Region::Inside && errors.motions[i].iter().any(|m| m.holds()) {
            let [from, to] = trueaxis_model::validate::calibrated(machine, errors, i);
            return [low.max(from), high.min(to)];
        }
        [low, high]
    };
    let kelvin = errors.sensors.iter().map(|s| s.range_kelvin);
    let others = machine.length_range.into_iter().chain(kelvin);
    (0..machine.axes.len()).map(axis).chain(others).collect()
}

/// The value of input number `input`; the first `axes` inputs are axes.
pub fn position(command: &mut Command, axes: usize, input: usize) -> &mut f32 {
    match input.checked_sub(axes) {
        None => &mut command.axes[input],
        Some(auxiliary) => &mut command.auxiliaries[auxiliary],
    }
}

/// A target position of an input.
#[derive(Clone, Copy)]
pub enum End {
    Position(f32),
    Travel(Travel),
}

/// Every input to each end of its range; rotary axes also to positions in between.
pub fn moves(kinematics: &Kinematics<'_>) -> Vec<(usize, End)> {
    let machine = kinematics.machine;
    let mut moves = Vec::new();
    let ranges = ranges(kinematics, Region::Inside);
    for (input, [low, high]) in ranges.into_iter().enumerate() {
        let axis = machine.axes.get(input);
        let turns = axis.is_some_and(|axis| axis.letter.is_rotary());
        let parts: &[f64] = if turns { &CLIMB_PARTS } else { &[0.0, 1.0] };
        let at = |part: &f64| End::Position((low + part * (high - low)) as f32);
        moves.extend(parts.iter().map(|part| (input, at(part))));
        if axis.is_some() && kinematics.errors.reverses(input) {
            let ways = [Travel::Negative, Travel::Positive];
            moves.extend(ways.map(|travel| (input, End::Travel(travel))));
        }
    }
    moves
}

/// Moves axes away from the ends of their ranges by a little more than their corrections.
fn draw_in(
    kinematics: &Kinematics<'_>,
    command: &mut Command,
    correction: &PerAxis,
    zero: &PerAxis,
) {
    let machine = kinematics.machine;
    let exact = std::array::from_fn(|i| 1.1 * (correction[i] + zero[i]).abs());
    let ways = machine.to_command(&exact);
    let ranges = ranges(kinematics, Region::Inside);
    for (i, way) in ways.iter().enumerate().take(machine.axes.len()) {
        let [low, high] = ranges[i];
        // Rounding towards the middle.
        let (low, high) = (
            ((low + way) as f32).next_up(),
            ((high - way) as f32).next_down(),
        );
        if low < high {
            command.axes[i] = command.axes[i].clamp(low, high);
        }
    }
}

/// Moves two in `of` of the axes, tool length and temperatures to an end of their range.
fn to_ends(
    kinematics: &Kinematics<'_>,
    command: &mut Command,
    region: Region,
    random: &mut Pcg64Mcg,
    of: u32,
) {
    let axes = kinematics.machine.axes.len();
    for (input, [low, high]) in ranges(kinematics, region).into_iter().enumerate() {
        match random.random_range(0..of) {
            0 => *position(command, axes, input) = low as f32,
            1 => *position(command, axes, input) = high as f32,
            _ => {}
        }
    }
}
