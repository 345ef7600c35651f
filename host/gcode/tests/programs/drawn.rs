//! Programs that nobody wrote: all modes, offsets, arcs of every kind, cycles, rotary moves.

use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use trueaxis_gcode::axes::{self, COUNT, PerLetter};
use trueaxis_gcode::modal::{Distance, Units};
use trueaxis_gcode::words::Block;
use trueaxis_gcode::{Rules, State};

/// Modes, with what they need.
const MODES: [&str; 22] = [
    "G20", "G21", "G20", "G21", "G90", "G91", "G90", "G91", "G90.1", "G91.1", "G17", "G18", "G19",
    "G54", "G55", "G92.1", "G98", "G99", "G43 H1", "G49", "G94", "G95",
];
const CYCLES: [&str; 7] = ["G81", "G82", "G83", "G73", "G85", "G86", "G89"];
/// Decimals of words whose values must fit together.
const FINE: usize = 5;

/// Where each axis may be (machine, mm and degrees).
pub type Boxes = [[f64; 2]; COUNT];

/// A program while it is being written, and what it says so far.
struct Writer<'a> {
    random: &'a mut Pcg64Mcg,
    rules: &'a Rules,
    boxes: &'a Boxes,
    state: State,
    block: Block,
    text: String,
}

/// A program of so many motions, which stays near the boxes; it sets G55 itself.
pub fn program(random: &mut Pcg64Mcg, rules: &Rules, boxes: &Boxes, motions: usize) -> String {
    let mut writer = Writer {
        random,
        rules,
        boxes,
        state: State::new(rules),
        block: Block::default(),
        text: String::new(),
    };
    writer.put("G21 G90 G17 G94 G98 F1000");
    writer.put("S500 M3");
    let mut second = "G10 L2 P2 R20".to_owned();
    for axis in writer.all() {
        let [low, high] = boxes[axis];
        let origin = 0.3 * (low + high) + 0.1 * (high - low);
        let _ = write!(second, " {}{origin:.3}", axes::name(axis));
    }
    writer.put(&second);
    writer.first();
    for _ in 1..motions {
        writer.modes();
        writer.motion();
    }
    writer.text
}

impl Writer<'_> {
    /// Writes a line, which must be one.
    fn put(&mut self, line: &str) {
        self.block
            .scan(line.as_bytes(), self.rules.dialect)
            .unwrap();
        self.state
            .step(&self.block, self.rules)
            .unwrap_or_else(|fault| panic!("{}{line}: {}", self.text, fault.cause));
        self.text += line;
        self.text += "\n";
    }

    fn one_of(&mut self, many: u32) -> bool {
        self.random.random_range(0..many) == 0
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.random.random::<f64>()
    }

    fn inside(&mut self, axis: usize) -> f64 {
        let [low, high] = self.boxes[axis];
        self.between(low, high)
    }

    fn all(&self) -> Vec<usize> {
        let is_there = |axis: &usize| self.rules.axes & (1 << axis) != 0;
        (0..COUNT).filter(is_there).collect()
    }

    /// mm in a unit of words of an axis.
    fn unit(&self, axis: usize) -> f64 {
        match axes::is_rotary(axis) {
            true => 1.0,
            false => self.state.units.map_or(1.0, Units::mm),
        }
    }

    fn is_relative(&self) -> bool {
        self.state.distance == Some(Distance::Incremental)
    }

    /// All axes go somewhere.
    fn first(&mut self) {
        let mut to = self.state.position.at;
        for axis in self.all() {
            to[axis] = self.inside(axis);
        }
        let words = self.words(&to, &self.all(), 3);
        let word = ["G0", "G1"][self.random.random_range(0..2)];
        self.put(&format!("{word}{words}"));
    }

    fn modes(&mut self) {
        if self.one_of(3) {
            let mode = MODES[self.random.random_range(0..MODES.len())];
            self.put(mode);
            let feed = self.random.random_range(100..2000);
            self.put(&format!("F{feed}"));
        }
        if self.one_of(12) {
            let [x, y, z] = [(); 3].map(|()| self.random.random_range(-50..50));
            let word = ["G92", "G10 L2 P1", "G10 L20 P1"][self.random.random_range(0..3)];
            self.put(&format!("{word} X{x} Y{y} Z{z}"));
        }
    }

    fn motion(&mut self) {
        let in_xy = self.state.plane.unwrap().axes()[2] == 2;
        let may_turn = in_xy || !self.state.offsets.is_turned();
        match self.random.random_range(0..6) {
            0 | 1 if may_turn => self.arc(),
            2 if may_turn => self.cycle(),
            _ => self.straight(),
        }
    }

    /// Words that lead some axes from where they are to a position.
    fn words(&self, to: &PerLetter, only: &[usize], digits: usize) -> String {
        let target = self.state.offsets.program(to);
        let here = self.state.offsets.program(&self.state.position.at);
        let mut words = String::new();
        for &axis in only {
            let value = match self.is_relative() {
                true => target[axis] - here[axis],
                false => target[axis],
            };
            let value = value / self.unit(axis);
            let _ = write!(words, " {}{value:.digits$}", axes::name(axis));
        }
        words
    }

    fn straight(&mut self) {
        let from = self.state.position.at;
        let mut to = from;
        for axis in self.all() {
            let chance = if axes::is_rotary(axis) { 0.3 } else { 0.7 };
            if self.random.random::<f64>() < chance {
                to[axis] = self.inside(axis);
                // Short moves too.
                if self.one_of(3) {
                    to[axis] = from[axis] + 0.01 * (to[axis] - from[axis]);
                }
            }
        }
        let moved: Vec<usize> = self
            .all()
            .into_iter()
            .filter(|i| to[*i] != from[*i])
            .collect();
        if moved.is_empty() {
            return;
        }
        let digits = match self.state.units {
            Some(Units::Inch) => FINE,
            _ => self.random.random_range(1..5),
        };
        if !self.is_relative() && self.one_of(6) {
            let mut line = ["G53 G0", "G53 G1"][self.random.random_range(0..2)].to_owned();
            for &axis in &moved {
                let value = to[axis] / self.unit(axis);
                let _ = write!(line, " {}{value:.digits$}", axes::name(axis));
            }
            return self.put(&line);
        }
        let words = self.words(&to, &moved, digits);
        match self.random.random_range(0..20) {
            0..5 => self.put(&format!("G0{words}")),
            5..8 => {
                let share = self.random.random_range(1..50);
                self.put(&format!("G93 G1{words} F{share}"));
                let feed = self.random.random_range(100..2000);
                self.put(&format!("G94 F{feed}"));
            }
            _ => self.put(&format!("G1{words}")),
        }
    }

    fn arc(&mut self) {
        let [i, j, n] = self.state.plane.unwrap().axes();
        let from = self.state.position.at;
        let clockwise = self.one_of(2);
        // A centre near by, so that the circle stays in the travel.
        let radius = self.between(0.5, 14.5);
        let angle = self.between(0.0, TAU);
        let mut centre = from;
        centre[i] += radius * libm::cos(angle);
        centre[j] += radius * libm::sin(angle);
        let full = self.one_of(4);
        let sweep = self.between(0.3, 5.8);
        let mut end = from;
        let mut only = Vec::new();
        if !full {
            let turned = angle + PI + if clockwise { -sweep } else { sweep };
            end[i] = centre[i] + radius * libm::cos(turned);
            end[j] = centre[j] + radius * libm::sin(turned);
            only.extend([i, j]);
        }
        if self.one_of(2) {
            end[n] = self.inside(n);
            only.push(n);
        }
        only.sort_unstable();
        let mut line = if clockwise { "G2" } else { "G3" }.to_owned();
        line += &self.words(&end, &only, FINE);
        // Near a half turn, and near a whole one, R says little.
        let by_radius = !full && !(2.7..3.6).contains(&sweep) && self.one_of(3);
        if by_radius {
            let radius = if sweep > PI { -radius } else { radius };
            let _ = write!(line, " R{:.FINE$}", radius / self.unit(i));
        } else {
            let offsets = &self.state.offsets;
            let (to, at) = (offsets.program(&centre), offsets.program(&from));
            for axis in [i, j] {
                let value = match self.state.arc_distance {
                    Distance::Incremental => to[axis] - at[axis],
                    Distance::Absolute => to[axis],
                };
                let letter = ["I", "J", "K"][axis];
                let _ = write!(line, " {letter}{:.FINE$}", value / self.unit(axis));
            }
            if self.one_of(6) {
                let turns = self.random.random_range(1..4);
                let _ = write!(line, " P{turns}");
            }
        }
        self.put(&line);
    }

    fn cycle(&mut self) {
        let [i, j, n] = self.state.plane.unwrap().axes();
        let unit = self.unit(n);
        let from = self.state.position.at;
        let word = CYCLES[self.random.random_range(0..CYCLES.len())];
        let repeat = if self.one_of(4) { 3 } else { 1 };
        let mut to = from;
        for axis in [i, j] {
            to[axis] = self.inside(axis);
            if self.is_relative() {
                to[axis] = from[axis] + (to[axis] - from[axis]) / f64::from(repeat);
            }
        }
        let words = self.words(&to, &[i, j], FINE);
        let mut top = from;
        top[n] = self.inside(n);
        let mut bottom = top;
        bottom[n] -= self.between(0.5, 15.0);
        let offsets = &self.state.offsets;
        let [start, r, z] = [&from, &top, &bottom].map(|at| offsets.program(at)[n] / unit);
        let (r, z) = match self.is_relative() {
            true => (r - start, z - r),
            false => (r, z),
        };
        let mut line = format!("{word}{words} {}{z:.FINE$} R{r:.FINE$}", axes::name(n));
        if matches!(word, "G83" | "G73") {
            let _ = write!(line, " Q{:.FINE$}", self.between(0.7, 9.0) / unit);
        }
        if matches!(word, "G82" | "G86" | "G89") {
            line += " P0.1";
        }
        if repeat > 1 {
            let _ = write!(line, " L{repeat}");
        }
        self.put(&line);
        if self.one_of(2) {
            let mut to = self.state.position.at;
            to[i] = self.inside(i);
            let words = self.words(&to, &[i], FINE);
            self.put(words.trim_start());
        }
        self.put("G80");
    }
}
