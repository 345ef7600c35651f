//! The effect of tables on a machine, measured independently of the scheme, at separate positions.

use super::Case;
use crate::Fixed;
use trueaxis::{Draft, Travel};
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::{Kinematics, NotConverged, Policy};
use trueaxis_model::machine::PerAxis;
use trueaxis_model::validate::{Command, Runtime, calibrated, holds, is_near_point};

/// Number of positions for each way of choosing them.
const EACH: usize = 900;
/// Distance that an axis keeps from an end of its known range, in units of its correction, so that it is still inside
/// when corrected.
const STAYS: f64 = 1.3;

/// How the position of each axis is chosen.
#[derive(Clone, Copy)]
enum Way {
    /// Anywhere.
    Inner,
    /// At ends or anywhere.
    Ends,
    /// At ends, one axis anywhere.
    Edge,
    /// At ends.
    Corner,
}

/// Positions with their reference corrections.
pub struct Places<'a> {
    case: &'a Case,
    places: Vec<Place>,
    /// Largest reference correction of each axis (mm, rad).
    largest: PerAxis,
}

struct Place {
    command: Command,
    /// Reference correction (mm, rad).
    correction: PerAxis,
    /// No motion holds its end value.
    is_inside: bool,
    /// An axis is within its correction of a measured point: the tolerance does not apply here.
    is_near: bool,
}

/// The measured result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Largest deviation (µm, µrad) from the reference correction where no motion holds, farther than one correction from
    /// measured points.
    pub reached: f64,
    /// Like `reached`, within one correction of a measured point; 0 if there is no such position.
    pub near: f64,
    /// Largest deviation of each axis anywhere in the travel (µm, µrad).
    pub anywhere: PerAxis,
    /// Largest reference correction of each axis (µm, µrad).
    pub largest: PerAxis,
}

impl<'a> Places<'a> {
    /// Chooses positions: half of them over the travel, half of them where motions are known.
    ///
    /// # Errors
    /// If there is no reference correction at some position.
    pub fn new(case: &'a Case) -> Result<Self, NotConverged> {
        let kinematics =
            Kinematics::new(&case.machine, &case.errors).with_policy(Policy::Orientation);
        let mut random = Fixed::new(!case.seed);
        let mut places = Vec::new();
        for way in [Way::Inner, Way::Ends, Way::Edge, Way::Corner] {
            for number in 0..EACH {
                let known = number % 2 == 0;
                let mut command = choose(case, way, known, &mut random);
                let mut place = Place::new(&kinematics, command)?;
                // An end is outside as soon as its correction leads there, so stay just before it.
                for _ in 0..3 {
                    if place.is_inside || !known {
                        break;
                    }
                    draw_in(case, &mut command, &place.correction);
                    place = Place::new(&kinematics, command)?;
                }
                places.push(place);
            }
        }
        let largest = std::array::from_fn(|i| {
            let sizes = places.iter().map(|p| p.correction[i].abs());
            sizes.fold(0.0, f64::max)
        });
        Ok(Self {
            case,
            places,
            largest,
        })
    }

    /// Number of positions where the tolerance applies.
    #[must_use]
    pub fn inside(&self) -> usize {
        let counts = |p: &&Place| p.is_inside && !p.is_near;
        self.places.iter().filter(counts).count()
    }

    /// Number of positions where no motion holds that are within one correction of a measured point.
    #[must_use]
    pub fn near(&self) -> usize {
        let near = |p: &&Place| p.is_inside && p.is_near;
        self.places.iter().filter(near).count()
    }

    /// Encodes a draft, decodes it, and evaluates it at every position.
    ///
    /// # Errors
    /// If it cannot be encoded or decoded.
    pub fn measure(&self, draft: &Draft) -> Result<Measured, String> {
        let mut draft = draft.clone();
        for axis in &mut draft.axes {
            // Bounds of corrections are determined later; tables do not depend on them.
            axis.value_bound = 1e6;
        }
        let blob = draft.encode().map_err(|e| e.to_string())?;
        let runtime = Runtime::load(&blob).map_err(|e| e.to_string())?;
        let machine = &self.case.machine;
        let units: PerAxis = std::array::from_fn(|i| match machine.axes.get(i) {
            Some(axis) if axis.letter.is_rotary() => 1e6,
            _ => 1e3,
        });
        let (mut reached, mut near, mut anywhere) = (0.0_f64, 0.0_f64, PerAxis::default());
        for place in &self.places {
            let table = runtime.evaluate(&place.command).map(f64::from);
            let table = machine.to_kinematic(&table);
            for i in 0..machine.axes.len() {
                let deviation = (table[i] - place.correction[i]).abs() * units[i];
                // NaN counts as the worst case.
                let deviation = if deviation.is_nan() {
                    f64::INFINITY
                } else {
                    deviation
                };
                anywhere[i] = anywhere[i].max(deviation);
                match (place.is_inside, place.is_near) {
                    (true, false) => reached = reached.max(deviation),
                    (true, true) => near = near.max(deviation),
                    (false, _) => {}
                }
            }
        }
        Ok(Measured {
            reached,
            near,
            anywhere,
            largest: std::array::from_fn(|i| self.largest[i] * units[i]),
        })
    }
}

impl Measured {
    /// The largest deviation of any axis anywhere, as a fraction of the permitted one: the larger of the tolerance (µm,
    /// µrad) and the axis's largest correction. Above 1 it would be better to have no tables.
    #[must_use]
    pub fn harm(&self, tolerance: f64) -> f64 {
        let axes = self.anywhere.iter().zip(self.largest);
        axes.map(|(deviation, largest)| deviation / largest.max(tolerance))
            .fold(0.0, f64::max)
    }
}

impl Place {
    fn new(kinematics: &Kinematics<'_>, command: Command) -> Result<Self, NotConverged> {
        let (machine, errors) = (kinematics.machine, kinematics.errors);
        let (q, situation): (PerAxis, Situation) = command.kinematic(machine);
        let correction = kinematics.correction(&q, &situation, &Switches::ALL)?.dq;
        Ok(Self {
            command,
            correction,
            is_inside: !holds(machine, errors, &q, &correction),
            is_near: is_near_point(machine, errors, &q, &correction),
        })
    }
}

/// The ends of an axis (mm, deg): of its travel, or of its known range.
fn ends(case: &Case, axis: usize, known: bool) -> [f64; 2] {
    let [low, high] = case.machine.axes[axis].travel;
    if !known {
        return [low, high];
    }
    let [from, to] = calibrated(&case.machine, &case.errors, axis);
    [low.max(from), high.min(to)]
}

fn choose(case: &Case, way: Way, known: bool, random: &mut Fixed) -> Command {
    let machine = &case.machine;
    let mut command = Command::at(machine, &[]);
    let free = random.below(machine.axes.len());
    for i in 0..machine.axes.len() {
        let at_end = match way {
            Way::Inner => false,
            Way::Ends => random.chance(0.5),
            Way::Edge => i != free,
            Way::Corner => true,
        };
        let ends = ends(case, i, known);
        command.axes[i] = one(ends, at_end, random);
        command.travel[i] = match random.below(9) {
            0 => Travel::Unknown,
            n if n % 2 == 0 => Travel::Positive,
            _ => Travel::Negative,
        };
    }
    let lengths = machine.length_range.into_iter();
    let ranges = lengths.chain(case.errors.sensors.iter().map(|s| s.range_kelvin));
    for (auxiliary, range) in command.auxiliaries.iter_mut().zip(ranges) {
        let at_end = !matches!(way, Way::Inner) && random.chance(0.5);
        *auxiliary = one(range, at_end, random);
    }
    command
}

/// A position in a range, rounded as in the runtime.
fn one([low, high]: [f64; 2], at_end: bool, random: &mut Fixed) -> f32 {
    let position = match (at_end, random.chance(0.5)) {
        (false, _) => random.within(low, high),
        (true, false) => low,
        (true, true) => high,
    };
    position as f32
}

/// Moves the axes away from the ends of their known range by more than their corrections.
fn draw_in(case: &Case, command: &mut Command, correction: &PerAxis) {
    for (i, axis) in case.machine.axes.iter().enumerate() {
        let way = STAYS * axis.to_command(correction[i].abs());
        let [low, high] = ends(case, i, true);
        // Rounds towards the middle.
        let low = ((low + way) as f32).next_up();
        let high = ((high - way) as f32).next_down();
        if low < high {
            command.axes[i] = command.axes[i].max(low).min(high);
        }
    }
}
