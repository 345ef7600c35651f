//! The functions that make up Eq. 44.

use trueaxis_model::machine::{Machine, PerAxis};

/// Functions of the rotary axis: 1, cos, sin, cos·sin, sin².
pub(crate) const FUNCTIONS: usize = 5;

/// 1, cos, sin, cos·sin, sin² of an angle (rad).
pub fn functions(angle: f64) -> [f64; FUNCTIONS] {
    let (s, c) = libm::sincos(angle);
    [1.0, c, s, c * s, s * s]
}

/// The fitted functions: those of both rotary axes, alone and times each linear position.
pub struct Basis {
    pub linear: Vec<usize>,
    pub rotary: Vec<usize>,
    /// Middle and half width of the travel of each linear axis (mm); positions are divided by the half width.
    middle: PerAxis,
    pub half: PerAxis,
    /// True if positions are measured from the middle, so that their mean is 0 at every angle.
    centred: bool,
}

impl Basis {
    pub fn new(machine: &Machine, centred: bool) -> Self {
        let axes = |rotary: bool| {
            let all = 0..machine.axes.len();
            all.filter(move |i| machine.axes[*i].letter.is_rotary() == rotary)
        };
        let mut basis = Self {
            linear: axes(false).collect(),
            rotary: axes(true).collect(),
            middle: PerAxis::default(),
            half: PerAxis::default(),
            centred,
        };
        // X, Y, Z, in the document's order of tables.
        basis.linear.sort_by_key(|i| machine.axes[*i].letter.char());
        for i in axes(false) {
            let [low, high] = machine.axes[i].travel;
            basis.middle[i] = 0.5 * (low + high);
            basis.half[i] = 0.5 * (high - low);
        }
        basis
    }

    /// Origin of the position of a linear axis (mm).
    pub fn from(&self, axis: usize) -> f64 {
        if self.centred { self.middle[axis] } else { 0.0 }
    }

    pub fn count(&self) -> usize {
        (1 + self.linear.len()) * self.rotary.len() * FUNCTIONS
    }

    /// Index of a function of a rotary axis (0, 1), alone (0) or times a linear position (1, 2, 3).
    pub fn number(&self, times: usize, rotary: usize, function: usize) -> usize {
        (times * self.rotary.len() + rotary) * FUNCTIONS + function
    }

    pub fn values(&self, q: &PerAxis, into: &mut [f64]) {
        let linear = self.linear.iter();
        let linear = linear.map(|i| (q[*i] - self.from(*i)) / self.half[*i]);
        for (times, factor) in std::iter::once(1.0).chain(linear).enumerate() {
            for (rotary, axis) in self.rotary.iter().enumerate() {
                for (f, value) in functions(q[*axis]).into_iter().enumerate() {
                    into[self.number(times, rotary, f)] = factor * value;
                }
            }
        }
    }

    /// All functions of one rotary axis in `times`: alone, or times a linear position.
    pub fn of(&self, rotary: usize, times: std::ops::Range<usize>) -> Vec<usize> {
        let all = times.flat_map(|times| (0..FUNCTIONS).map(move |f| (times, f)));
        all.map(|(times, f)| self.number(times, rotary, f))
            .collect()
    }
}
