//! From a draft to its largest error, in units of the tolerance: measures tables as the runtime evaluates them.

use super::fit::{Sample, fitted};
use crate::policy;
use crate::schemes::SchemeError;
use crate::size::Size;
use crate::target::Target;
use crate::validate::{Command, Region, Runtime, holds, random_commands};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::HashMap;
use std::sync::{Mutex, OnceLock, PoisonError};
use trueaxis::{AUXILIARIES, Draft, Travel};
use trueaxis_model::errors::Switches;
use trueaxis_model::kinematics::{Jacobian, Kinematics, NotConverged, Policy};
use trueaxis_model::machine::{MAX_AXES, PerAxis};
use trueaxis_model::parallel;

/// Number of random positions at which tables are measured.
const JUDGED: usize = 3000;
/// Number of random positions at which a good draft is confirmed, and number of the worst failing ones that are
/// measured from then on.
const CONFIRMED: usize = 8000;
const MOST_MISSED: usize = 1000;
/// Number of the worst of these positions from which worse corners are searched, number of rounds over the inputs,
/// and positions of rotary axes in the range that are tried, because sines may be largest anywhere.
const CLIMBS: usize = 24;
const CLIMB_ROUNDS: usize = 4;
const CLIMB_PARTS: [f64; 7] = [0.0, 1.0, 0.5, 0.25, 0.75, 0.125, 0.875];
/// Number of positions of a fit per weight of an output, enough for it to hold elsewhere.
const FIT_SAMPLES: usize = 12;

/// Seed of the positions; a verification uses others.
const SEED: u64 = 0x6a75_6467;

/// Positions with their reference corrections. They do not depend on the tolerance.
pub struct Positions<'a> {
    kinematics: Kinematics<'a>,
    /// The correction at the zero position (mm, rad).
    pub zero: PerAxis,
    first: Vec<JudgedPosition>,
    /// Positions at which only drafts that are good so far are measured; drawn for the first such draft.
    others: OnceLock<Vec<JudgedPosition>>,
    /// Largest correction of each axis (mm, rad).
    largest: PerAxis,
    /// Positions reached by climbs; the next climb visits many of them again.
    climbed: Mutex<HashMap<Bits, JudgedPosition>>,
}

/// Measures drafts for one tolerance.
pub struct Judge<'a> {
    positions: &'a Positions<'a>,
    tolerance: Tolerance,
    /// Positions at which a draft failed: those of the latest first. They are measured from then on.
    missed: Vec<JudgedPosition>,
    /// True once drafts are also measured at the positions of confirmation.
    is_confirming: bool,
    /// Further positions for fitting, used if there are many weights.
    further: Vec<JudgedPosition>,
}

/// The bits of a command's numbers, and its directions of travel.
type Bits = ([u32; MAX_AXES], [u8; MAX_AXES], [u32; AUXILIARIES]);

#[derive(Clone)]
struct JudgedPosition {
    command: Command,
    /// The reference correction (mm, rad), minus that of the zero position.
    correction: PerAxis,
    /// Effect of the axes on the tool here.
    jacobian: Jacobian,
    /// True if a motion holds its end value here, at a bend that tables cannot follow.
    holds: bool,
}

/// The result of measuring a draft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Largest deviation from the kinematic correction where no motion holds its end value, in units of the
    /// tolerance.
    pub error: f64,
    /// Largest deviation of any axis in the whole travel, divided by what is permitted: the larger of the tolerance
    /// and the largest correction of the axis. Above 1 the tables do harm.
    pub harm: f64,
}

impl Verdict {
    const NOTHING: Self = Self {
        error: 0.0,
        harm: 0.0,
    };

    fn worse(self, other: Self) -> Self {
        Self {
            error: self.error.max(other.error),
            harm: self.harm.max(other.harm),
        }
    }
}

/// The result of confirming a draft.
#[derive(Clone, Copy, Debug)]
pub struct Confirmation {
    /// True if the draft stays within the requested multiple of the tolerance.
    pub is_kept: bool,
    verdict: Verdict,
}

impl Confirmation {
    /// Merges this with an earlier verdict. If the draft stayed within the limit, the earlier figures remain,
    /// because here the limit was a little wider.
    pub(crate) fn added_to(self, before: Verdict) -> Verdict {
        Verdict {
            error: match self.is_kept {
                true => before.error,
                false => before.error.max(self.verdict.error),
            },
            harm: before.harm.max(self.verdict.harm),
        }
    }
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
    fn others(&self) -> Result<&[JudgedPosition], SchemeError> {
        if self.others.get().is_none() {
            let drawn = places(&self.kinematics, &self.zero, CONFIRMED, !SEED)?;
            return Ok(self.others.get_or_init(|| drawn));
        }
        Ok(self.others.get().map_or(&[], Vec::as_slice))
    }

    /// The negligible fraction of a correction: a little of the tolerance relative to the largest correction.
    pub(crate) fn smallest_part(&self, tolerance: &Tolerance) -> f64 {
        let sizes = self.largest.iter().zip(&tolerance.axes).map(|(l, t)| l / t);
        0.02 / sizes.fold(1.0, f64::max)
    }

    /// [`JudgedPosition::inside`], computed once for each command.
    fn climbed_to(&self, command: Command) -> Result<JudgedPosition, NotConverged> {
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

impl<'a> Judge<'a> {
    /// Measures at these positions.
    pub fn new(positions: &'a Positions<'a>, tolerance: Tolerance) -> Self {
        Self {
            positions,
            tolerance,
            missed: Vec::new(),
            is_confirming: false,
            further: Vec::new(),
        }
    }

    /// The positions that are measured first.
    fn places(&self) -> impl Iterator<Item = &JudgedPosition> {
        self.missed.iter().chain(&self.positions.first)
    }

    /// The tolerance of each axis (mm, rad), the unit of errors.
    pub fn tolerance(&self) -> &PerAxis {
        &self.tolerance.axes
    }

    /// True if the tip and the tool direction are measured.
    pub(crate) fn is_of_tool(&self) -> bool {
        self.tolerance.is_of_tool()
    }

    /// Measures a draft; `None` if a blob or the target cannot hold it.
    pub fn measure(&self, draft: &Draft, target: &Target) -> Option<Verdict> {
        let others = self.positions.others.get().filter(|_| self.is_confirming);
        let places = self.places().chain(others.into_iter().flatten()).collect();
        self.measure_at(places, draft, target, f64::INFINITY)
    }

    /// Measures a draft, without the positions that confirm good drafts. Also returns `None` if its error exceeds
    /// `most` tolerances.
    pub(crate) fn measure_first(
        &self,
        draft: &Draft,
        target: &Target,
        most: f64,
    ) -> Option<Verdict> {
        self.measure_at(self.places().collect(), draft, target, most)
    }

    fn measure_at(
        &self,
        places: Vec<&JudgedPosition>,
        draft: &Draft,
        target: &Target,
        most: f64,
    ) -> Option<Verdict> {
        let blob = draft.encode().ok()?;
        let runtime = Runtime::load(&blob).ok()?;
        if !target.shortages(&Size::of(&runtime)).is_empty() {
            return None;
        }
        let verdicts = parallel::try_map(&places, |place| {
            let verdict = self.at(place, &runtime);
            if verdict.error <= most {
                Ok(verdict)
            } else {
                Err(())
            }
        });
        let verdicts = verdicts.ok()?.into_iter();
        Some(verdicts.fold(Verdict::NOTHING, Verdict::worse))
    }

    /// Measures a draft at many more positions. Those where it exceeds the multiple of the tolerance are added to
    /// the ones measured first.
    pub(crate) fn confirm(
        &mut self,
        draft: &Draft,
        factor: f64,
    ) -> Result<Confirmation, SchemeError> {
        let others = self.positions.others()?;
        self.is_confirming = true;
        let blob = draft.encode();
        let Some(runtime) = blob.as_ref().ok().and_then(|b| Runtime::load(b).ok()) else {
            return Ok(Confirmation {
                is_kept: false,
                verdict: Verdict::NOTHING,
            });
        };
        let verdicts: Vec<Verdict> = parallel::map(others, |place| self.at(place, &runtime));
        let mut order: Vec<usize> = (0..verdicts.len()).collect();
        order.sort_by(|a, b| verdicts[*b].error.total_cmp(&verdicts[*a].error));
        let misses = |verdict: &Verdict| verdict.error > factor;
        let missed = order.iter().take_while(|i| misses(&verdicts[**i]));
        let missed = missed.take(MOST_MISSED).map(|i| others[*i].clone());
        let mut missed: Vec<JudgedPosition> = missed.collect();
        let mut worst = verdicts
            .iter()
            .copied()
            .fold(Verdict::NOTHING, Verdict::worse);
        let starts = order.iter().take(CLIMBS);
        let starts: Vec<_> = starts.map(|i| (verdicts[*i], others[*i].clone())).collect();
        let climbed = parallel::try_map(&starts, |(verdict, place)| {
            self.climb(*verdict, place.clone(), &runtime)
        })?;
        for (verdict, place) in climbed.into_iter().filter(|(v, _)| misses(v)) {
            worst = worst.worse(verdict);
            missed.push(place);
        }
        let is_kept = missed.is_empty();
        // Measured first from now on: a draft that fails there needs no further test.
        self.missed.splice(0..0, missed);
        Ok(Confirmation {
            is_kept,
            verdict: worst,
        })
    }

    /// Moves one input after the other, mostly to an end of its range, as long as the deviation grows. The worst
    /// corner is one of thousands and random positions may miss it.
    fn climb(
        &self,
        mut verdict: Verdict,
        mut place: JudgedPosition,
        runtime: &Runtime<'_>,
    ) -> Result<(Verdict, JudgedPosition), NotConverged> {
        let kinematics = &self.positions.kinematics;
        let axes = kinematics.machine.axes.len();
        let moves = moves(kinematics);
        for _ in 0..CLIMB_ROUNDS {
            let before = verdict.error;
            for &(input, end) in &moves {
                let mut command = place.command;
                match end {
                    End::Position(x) => *position(&mut command, axes, input) = x,
                    End::Travel(travel) => command.travel[input] = travel,
                }
                let next = self.positions.climbed_to(command)?;
                let found = self.at(&next, runtime);
                if found.error > verdict.error {
                    (verdict, place) = (found, next);
                }
            }
            if verdict.error == before {
                break;
            }
        }
        Ok((verdict, place))
    }

    /// The draft with fitted weights. The fit uses the positions at which it is measured and some of those at which
    /// it is confirmed, and further ones if there are many weights. The remaining confirmation positions show
    /// whether the fit was right.
    pub fn fitted(&mut self, draft: &Draft) -> Result<Option<Draft>, SchemeError> {
        let positions = self.positions;
        let others = positions.others()?;
        self.is_confirming = true;
        let wanted = FIT_SAMPLES * most_terms(draft);
        let have = self.places().count() + others.len() / 3 + self.further.len();
        if wanted > have {
            let seed = SEED.rotate_left(7) ^ have as u64;
            let more = places(&positions.kinematics, &positions.zero, wanted - have, seed)?;
            self.further.extend(more);
        }
        let machine = positions.kinematics.machine;
        let places = self.places().chain(others.iter().step_by(3));
        let samples: Vec<Sample> = places
            .chain(&self.further)
            .filter(|place| !place.holds)
            .map(|place| Sample {
                command: place.command,
                wanted: machine.to_command(&place.correction),
            })
            .collect();
        Ok(fitted(
            draft,
            &samples,
            &machine.to_command(self.tolerance()),
        ))
    }

    /// Measures tables at one position.
    fn at(&self, place: &JudgedPosition, runtime: &Runtime<'_>) -> Verdict {
        let machine = self.positions.kinematics.machine;
        let table = runtime.evaluate(&place.command).map(f64::from);
        let table = machine.to_kinematic(&table);
        let deviation = std::array::from_fn(|i| table[i] - place.correction[i]);
        let mut harm = 0.0_f64;
        for (i, deviation) in deviation.iter().enumerate().take(machine.axes.len()) {
            let most = self.tolerance.axes[i].max(self.positions.largest[i]);
            harm = harm.max(deviation.abs() / most);
        }
        Verdict {
            error: if place.holds {
                0.0
            } else {
                self.tolerance.share(&deviation, &place.jacobian)
            },
            harm,
        }
    }
}

/// The number of terms of the output that has most.
fn most_terms(draft: &Draft) -> usize {
    let mut counts = [0; MAX_AXES];
    for term in &draft.terms {
        counts[usize::from(term.output)] += 1;
    }
    counts.into_iter().max().unwrap_or(0)
}

/// Draws positions with their reference corrections: a quarter over the travel, the others where no motion holds its end
/// value. Half of them have axes at their ends, where most functions are largest.
fn places(
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
    fn inside(
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
            let [from, to] = crate::validate::calibrated(machine, errors, i);
            return [low.max(from), high.min(to)];
        }
        [low, high]
    };
    let kelvin = errors.sensors.iter().map(|s| s.range_kelvin);
    let others = machine.length_range.into_iter().chain(kelvin);
    (0..machine.axes.len()).map(axis).chain(others).collect()
}

/// The value of input number `input`; the first `axes` inputs are axes.
fn position(command: &mut Command, axes: usize, input: usize) -> &mut f32 {
    match input.checked_sub(axes) {
        None => &mut command.axes[input],
        Some(auxiliary) => &mut command.auxiliaries[auxiliary],
    }
}

/// A target position of an input.
#[derive(Clone, Copy)]
enum End {
    Position(f32),
    Travel(Travel),
}

/// Every input to each end of its range; rotary axes also to positions in between.
fn moves(kinematics: &Kinematics<'_>) -> Vec<(usize, End)> {
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

/// Number of random positions at which levers are computed.
const LEVER_PLACES: usize = 200;

/// Permitted deviation of tables from the kinematic correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// For each axis (mm, rad); structures are made for it. Under [`Policy::Direction`] a rotary axis may move the
    /// tip as far as a linear one, because their tables leave similar errors.
    pub axes: PerAxis,
    /// For the tip (mm) and the tool direction (rad), if these are what is measured.
    tool: Option<[f64; 2]>,
}

impl Tolerance {
    /// The tolerance if linear axes or the tip may deviate by `mm`.
    pub fn new(kinematics: &Kinematics<'_>, mm: f64) -> Self {
        let urad = policy::tolerance_urad(kinematics.policy, 1e3 * mm);
        let direction = 1e-6 * urad;
        let tool = matches!(kinematics.policy, Policy::Direction { .. });
        let machine = kinematics.machine;
        let mut axes = PerAxis::default();
        for (i, tolerance) in axes.iter_mut().enumerate() {
            let rotary = machine.axes.get(i).is_some_and(|a| a.letter.is_rotary());
            *tolerance = match (rotary, tool) {
                (false, _) => mm,
                (true, false) => direction,
                (true, true) => direction.min(mm / lever(kinematics, i)),
            };
        }
        Self {
            axes,
            tool: tool.then_some([mm, direction]),
        }
    }

    /// True if the tip and the tool direction are measured. There, deviations of related axes cancel, so tables need
    /// far fewer points than each axis alone would.
    pub(crate) fn is_of_tool(&self) -> bool {
        self.tool.is_some()
    }

    /// A deviation (mm, rad, one per axis) in units of the tolerance; `jacobian` is that of the position.
    pub fn share(&self, deviation: &PerAxis, jacobian: &Jacobian) -> f64 {
        let Some([tip, direction]) = self.tool else {
            let shares = deviation.iter().zip(&self.axes).map(|(d, t)| d.abs() / t);
            return shares.fold(0.0, f64::max);
        };
        let [at_tip, across] = jacobian.moved(deviation);
        (at_tip / tip).max(across / direction)
    }
}

/// The largest displacement (mm) of the tip per rad of a rotary axis, at random positions.
fn lever(kinematics: &Kinematics<'_>, axis: usize) -> f64 {
    let machine = kinematics.machine;
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let ways = (0..LEVER_PLACES).map(|_| {
        let mut at = [0.0; trueaxis_model::machine::MAX_AXES];
        for (q, axis) in at.iter_mut().zip(&machine.axes) {
            let [low, high] = axis.travel;
            *q = if random.random::<bool>() { low } else { high };
            if axis.letter.is_rotary() {
                *q = low + (high - low) * random.random::<f64>();
            }
        }
        let mut command = Command::at(machine, &at);
        if let Some([_, longest]) = machine.length_range {
            command.auxiliaries[0] = longest as f32;
        }
        let (q, situation) = command.kinematic(machine);
        let [x, y, z, ..] = kinematics.jacobian(&q, situation.length).column(axis);
        (x * x + y * y + z * z).sqrt()
    });
    // The axis turns about the tip if there is no lever.
    ways.fold(1.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::specimen::{errors, with_rotary};
    use super::*;
    use crate::schemes::blank::blank;
    use trueaxis::Term;

    #[test]
    fn nothing_does_no_harm_and_the_wrong_sign_does() {
        let machine = with_rotary(&[('A', [-60.0, 60.0])]);
        let errors = errors(&machine, "[parameters]\nEX0A = 20e-3\nEB0A = 40e-6\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let tolerance = Tolerance::new(&kinematics, 1e-3);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let judge = Judge::new(&positions, tolerance);
        let mut draft = blank(&kinematics);
        let target = Target::default();
        let nothing = judge.measure(&draft, &target).unwrap();
        assert_eq!(nothing.harm, 1.0);
        assert!(nothing.error >= 20.0);
        // The table is 20 µm too far in X, so the tool must be too.
        for (weight, harmless) in [(0.02, true), (-0.02, false)] {
            draft.terms = vec![Term {
                output: 0,
                weight,
                limits: None,
                factors: [].into_iter().collect(),
            }];
            let verdict = judge.measure(&draft, &target).unwrap();
            assert_eq!(verdict.harm <= 1.0, harmless, "{verdict:?}");
        }
    }

    #[test]
    fn the_worst_corner_is_found_and_remembered() {
        let machine = with_rotary(&[('A', [-60.0, 60.0])]);
        let errors = errors(&machine, "[parameters]\nEAX1 = 1e-7\nEX0A = 1e-3\n");
        let kinematics = Kinematics::new(&machine, &errors);
        let tolerance = Tolerance::new(&kinematics, 1e-3);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let mut judge = Judge::new(&positions, tolerance);
        let draft = blank(&kinematics);
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        // The error grows towards the ends of several axes at the same time.
        let at = |axes: &[f64]| {
            let command = Command::at(&machine, axes);
            let place = JudgedPosition::inside(&kinematics, &positions.zero, command).unwrap();
            (judge.at(&place, &runtime), place)
        };
        let (start, place) = at(&[10.0, 20.0, -30.0, 5.0]);
        let (worst, corner) = judge.climb(start, place, &runtime).unwrap();
        let (error, worst) = (start.error, worst.error);
        let corners = (0..16).map(|bits| {
            let end = |i: usize, range: f64| if bits >> i & 1 == 1 { range } else { -range };
            at(&[end(0, 200.0), end(1, 200.0), end(2, 200.0), end(3, 60.0)])
                .0
                .error
        });
        let most = corners.fold(0.0, f64::max);
        assert!(worst > 2.0 * error && worst >= most, "{worst} {most}");
        assert!(!corner.holds);
        // Positions where the tables exceed the limit are measured from then on.
        assert!(judge.confirm(&draft, most * 1.01).unwrap().is_kept);
        let before = judge.places().count();
        assert!(!judge.confirm(&draft, most * 0.9).unwrap().is_kept);
        assert!(judge.places().count() > before);
    }

    #[test]
    fn what_the_target_cannot_hold_is_not_measured() {
        let machine = with_rotary(&[]);
        let errors = errors(&machine, "");
        let kinematics = Kinematics::new(&machine, &errors);
        let positions = Positions::new(&kinematics, PerAxis::default()).unwrap();
        let judge = Judge::new(&positions, Tolerance::new(&kinematics, 1.0));
        let draft = blank(&kinematics);
        let mut target = Target::default();
        assert!(judge.measure(&draft, &target).is_some());
        target.bytes = Some(16);
        assert!(judge.measure(&draft, &target).is_none());
    }
}
