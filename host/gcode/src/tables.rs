//! The compensation, at positions of a program's axes.

use super::axes::{self, COUNT, PerLetter, is_rotary};
use super::bend::Bend;
use super::interpret::bits;
use trueaxis::{AuxiliaryKind, Direction, Inputs, Largest, Travel, Travelling, Weights};

/// The smallest reversal threshold that differs from none (mm, degrees).
pub(crate) const FINEST: f64 = 1e-3;
/// What does not count, in parts of a reversal threshold: as small as rounding words makes borderline cases anyway.
pub(crate) const OF_THRESHOLD: f64 = 0.02;
/// Most axes of a blob.
const MOST: usize = 16;

/// A compensation with the letters of a program.
pub struct Tables<'a> {
    compensation: &'a Largest<'a>,
    weights: Weights,
    /// For each of its axes the place of its letter.
    letters: Vec<usize>,
    /// Like `letters`, as bits.
    pub axes: u16,
    /// Letters (bits) whose direction of travel matters.
    pub directional: u16,
    /// How far apart samples may be on each axis (mm, degrees): half an interval of its tables.
    pub spacing: PerLetter,
    /// True if the tool length is an input.
    pub takes_length: bool,
    /// The tool lengths (mm) that its tables reach; beyond, they hold their end values.
    pub lengths: [f64; 2],
    /// Travel of each axis; `None` for endless ones.
    pub travel: [Option<[f64; 2]>; COUNT],
    /// The turn of endless axes (degrees), otherwise 0.
    pub period: PerLetter,
    /// How far corrections can bend along a move.
    pub bend: Bend,
    /// What an axis must come back by before it counts as turned round (mm, degrees).
    pub reversal_threshold: PerLetter,
    farthest: PerLetter,
    /// The limits of each axis with what rounding may be beyond them.
    reach: [[f64; 2]; COUNT],
}

impl<'a> Tables<'a> {
    /// # Errors
    /// An axis whose letter no program has.
    pub fn new(compensation: &'a Largest<'a>) -> Result<Self, String> {
        let mut tables = Self {
            compensation,
            weights: compensation.weights(),
            letters: Vec::new(),
            axes: 0,
            directional: 0,
            spacing: [f64::INFINITY; COUNT],
            takes_length: false,
            lengths: [f64::NEG_INFINITY, f64::INFINITY],
            travel: [None; COUNT],
            period: [0.0; COUNT],
            bend: Bend::default(),
            reversal_threshold: [0.0; COUNT],
            farthest: [f64::INFINITY; COUNT],
            reach: [[f64::NEG_INFINITY, f64::INFINITY]; COUNT],
        };
        for (number, axis) in compensation.axes().iter().enumerate() {
            tables.add_axis(number, axis)?;
        }
        for bank in compensation.banks() {
            tables.spaced(bank.input, bank.step);
            if bank.direction != Direction::Both
                && let Some(letter) = tables.letters.get(usize::from(bank.input))
            {
                tables.directional |= 1 << letter;
            }
        }
        for axis in compensation.grids().iter().flat_map(|grid| &grid.axes) {
            tables.spaced(axis.input, axis.step);
        }
        tables.find_tool_length();
        tables.bend = Bend::new(compensation, &tables.letters);
        Ok(tables)
    }

    fn add_axis(&mut self, number: usize, axis: &trueaxis::Axis) -> Result<(), String> {
        let Some(letter) = axes::index(axis.name) else {
            let name = char::from(axis.name);
            return Err(format!(
                "the compensation has an axis {name}, which programs do not"
            ));
        };
        self.letters.push(letter);
        self.axes |= 1 << letter;
        self.period[letter] = f64::from(axis.period);
        self.travel[letter] = (axis.period == 0.0).then_some(axis.travel.map(f64::from));
        self.reversal_threshold[letter] = f64::from(axis.reversal_threshold);
        if let Some(most) = self.compensation.farthest(number) {
            self.farthest[letter] = f64::from(most);
        }
        let [low, high] = self.limits(letter);
        // A position in the program has decimals, the travel in the blob is f32.
        let slack = 1e-6 * high.abs().max(low.abs()).max(1.0);
        self.reach[letter] = [low - slack, high + slack];
        Ok(())
    }

    /// Whether the tool length is an input, and which lengths the tables reach.
    fn find_tool_length(&mut self) {
        let auxiliaries = self.compensation.auxiliaries();
        let place = auxiliaries
            .iter()
            .position(|a| a.kind == AuxiliaryKind::ToolLength);
        self.takes_length = place.is_some();
        let input = self.compensation.axes().len() + place.unwrap_or(auxiliaries.len());
        for bank in self.compensation.banks() {
            if usize::from(bank.input) == input {
                let [low, high] = &mut self.lengths;
                *low = low.max(f64::from(bank.start));
                *high = high.min(f64::from(bank.end()));
            }
        }
    }

    /// Axes (bits) that turn for ever.
    #[must_use]
    pub fn endless(&self) -> u16 {
        let endless = (0..COUNT).filter(|axis| self.period[*axis] != 0.0);
        endless.fold(0, |mask, axis| mask | 1 << axis)
    }

    fn spaced(&mut self, input: u8, step: f32) {
        if let Some(&letter) = self.letters.get(usize::from(input)) {
            self.spacing[letter] = self.spacing[letter].min(0.5 * f64::from(step));
        }
    }

    /// True if corrections along a straight move by so much cannot turn any axis round between its ends, but for a part of its
    /// reversal threshold that does not count.
    #[must_use]
    pub fn keeps_straight(&self, by: &PerLetter) -> bool {
        let [linear, rotary] = self.bend.at_most(&by.map(f64::abs));
        let counts = |axis: usize| {
            let bend = if is_rotary(axis) { rotary } else { linear };
            bend > OF_THRESHOLD * self.reversal_threshold[axis].max(FINEST)
        };
        !bits(self.directional).any(counts)
    }

    /// Corrections (mm, degrees) at positions, before any limit; sensors at their references.
    #[must_use]
    pub fn at(&self, q: &PerLetter, travel: &[Travel; COUNT], length: f64) -> PerLetter {
        let mut inputs = Inputs::at([0.0_f32; MOST]);
        let mut travelling = Travelling([Travel::Unknown; MOST]);
        for (number, letter) in self.letters.iter().enumerate() {
            inputs.axes[number] = q[*letter] as f32;
            travelling.0[number] = travel[*letter];
        }
        let auxiliaries = self.compensation.auxiliaries();
        for (value, auxiliary) in inputs.auxiliaries.iter_mut().zip(auxiliaries) {
            *value = match auxiliary.kind {
                AuxiliaryKind::ToolLength => length as f32,
                AuxiliaryKind::Temperature => 0.0,
            };
        }
        let all = self
            .compensation
            .evaluate(&inputs, &travelling, &self.weights);
        let mut dq = [0.0; COUNT];
        for (number, letter) in self.letters.iter().enumerate() {
            dq[*letter] = f64::from(all[number]);
        }
        dq
    }

    /// Where axes are commanded to (mm, degrees) as far as directions of travel do not change it: positions with the mean of
    /// the corrections for both directions. Lost motion is taken up by the way that these go, not by the way of the program.
    #[must_use]
    pub fn middle(&self, q: &PerLetter, length: f64) -> PerLetter {
        let towards = |way| self.at(q, &[way; COUNT], length);
        let [up, down] = [Travel::Positive, Travel::Negative].map(towards);
        std::array::from_fn(|i| q[i] + 0.5 * (up[i] + down[i]))
    }

    /// The first axis that is out of its travel, or too far away for the tables, with its limits.
    #[must_use]
    pub fn outside(&self, q: &PerLetter) -> Option<(usize, [f64; 2])> {
        let is_inside = |[low, high]: [f64; 2], q: f64| q >= low && q <= high;
        let mut letters = self.letters.iter();
        let letter = *letters.find(|letter| !is_inside(self.reach[**letter], q[**letter]))?;
        Some((letter, self.limits(letter)))
    }

    /// The place within the travel of an axis that is nearest to a position.
    #[must_use]
    pub fn nearest(&self, letter: usize, q: f64) -> f64 {
        let [low, high] = self.limits(letter);
        q.max(low).min(high)
    }

    /// Ends of the travel of an axis, or of what the tables can be asked for.
    fn limits(&self, letter: usize) -> [f64; 2] {
        let farthest = self.farthest[letter];
        self.travel[letter].unwrap_or([-farthest, farthest])
    }
}
