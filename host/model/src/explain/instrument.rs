//! Instruments: the commanded positions, and what is read there. All readings are relative to commands: positive
//! means that the tool, relative to the workpiece, is farther in the direction of a positive command.

use super::bench::{Bench, BenchState, Deviation};
use crate::machine::PerAxis;
use crate::pose::ToolPose;
use nalgebra::Vector3;
use std::f64::consts::{FRAC_PI_2, PI};
use trueaxis_kinematics::Branch;

/// Travel of linear axes (mm), distance of balls from an axis, and length of the arm of a dial.
pub const REACH: f64 = 100.0;

/// An instrument and its setup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BenchInstrument {
    /// A laser interferometer along the axis that moves.
    Laser,
    /// A dial along a straightedge that was aligned at both ends of the motion.
    Straightedge {
        /// The ends (mm) of the motion.
        ends: [f64; 2],
    },
    /// A dial along one leg of a square, the other leg aligned with an axis.
    Square,
    /// An angle interferometer, autocollimator or level.
    Angle,
    /// A rotary calibrator, or a polygon and an autocollimator, on the rotating axis.
    Calibrator,
    /// A ball on the workpiece and an indicator in the spindle, with linear axes keeping the indicator on the ball.
    Ball {
        /// Position of the ball.
        place: BallPlacement,
    },
    /// A dial on an arm in the spindle, swept over the table.
    Tram,
    /// A probe in the spindle, on a point of the workpiece.
    Probe,
}

/// Position of a ball on the workpiece.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BallPlacement {
    /// On the rotating axis.
    OnAxis,
    /// At a distance of [`REACH`] from it in the direction of a linear axis (by index).
    Away(usize),
    /// At the tip, for an axis that turns the tool.
    Tip,
}

/// Direction of a reading; axes by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sense {
    /// Along a linear axis.
    In(usize),
    /// Rotation of the tool relative to the workpiece, from one linear axis towards another.
    From(usize, usize),
    /// Rotation of the tool relative to the workpiece in the sense of a rotary axis.
    About(usize),
}

/// A reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InstrumentReading {
    /// The instrument.
    pub instrument: BenchInstrument,
    /// The moving axis (by index), if any.
    pub moved: Option<usize>,
    /// The direction of the reading.
    pub sense: Sense,
    /// Where it is set to zero.
    pub from: BenchState,
    /// Where it is read.
    pub to: BenchState,
    /// The reading in mm or rad; on a square, in mm per [`REACH`] of the motion.
    pub value: f64,
}

impl InstrumentReading {
    /// Magnitude (mm), with angles multiplied by [`REACH`].
    #[must_use]
    pub fn size(&self) -> f64 {
        match self.sense {
            Sense::In(_) => self.value.abs(),
            Sense::From(..) | Sense::About(_) => self.value.abs() * REACH,
        }
    }
}

/// The largest reading, or the first of several equal ones: rounding must not decide.
pub fn largest(readings: impl IntoIterator<Item = InstrumentReading>) -> Option<InstrumentReading> {
    const AS_LARGE: f64 = 1.0 + 1e-6;
    readings.into_iter().fold(None, |best, one| match best {
        Some(best) if one.size() <= best.size() * AS_LARGE => Some(best),
        _ => Some(one),
    })
}

impl Bench<'_> {
    /// The part of a deviation that an instrument shows in one direction, with the machine at `q`.
    #[must_use]
    pub fn reads(&self, sense: Sense, deviation: &Deviation, q: &PerAxis) -> f64 {
        match sense {
            Sense::In(axis) => deviation.tip.dot(&self.way(q, axis)),
            Sense::About(axis) => deviation.turn.dot(&self.about(q, axis)),
            Sense::From(a, b) => {
                let normal = self.way(q, a).cross(&self.way(q, b));
                deviation.turn.dot(&normal.normalize())
            }
        }
    }

    /// Readings of the tip's deviation between two commands, along each linear axis.
    fn tip(
        &self,
        instrument: BenchInstrument,
        moved: Option<usize>,
        from: BenchState,
        to: BenchState,
    ) -> impl Iterator<Item = InstrumentReading> + '_ {
        let deviation = self.deviation(&from, &to);
        self.linear()
            .map(Sense::In)
            .map(move |sense| InstrumentReading {
                instrument,
                moved,
                sense,
                from,
                to,
                value: self.reads(sense, &deviation, &to.q),
            })
    }

    /// A laser or a dial along each linear axis.
    pub fn laser(
        &self,
        moved: usize,
        from: BenchState,
        to: BenchState,
    ) -> impl Iterator<Item = InstrumentReading> {
        self.tip(BenchInstrument::Laser, Some(moved), from, to)
    }

    /// A probe at a point of the workpiece, in the direction of each linear axis.
    pub fn probe(
        &self,
        from: BenchState,
        to: BenchState,
    ) -> impl Iterator<Item = InstrumentReading> {
        self.tip(BenchInstrument::Probe, None, from, to)
    }

    /// Rotation of the tool relative to the workpiece, from each linear axis towards the next, and about a rotary
    /// axis if it moves.
    pub fn angle(
        &self,
        moved: Option<usize>,
        from: BenchState,
        to: BenchState,
    ) -> Vec<InstrumentReading> {
        let deviation = self.deviation(&from, &to);
        let component = |axis: usize| self.machine.axes[axis].letter.component();
        let reading = |instrument, sense| InstrumentReading {
            instrument,
            moved,
            sense,
            from,
            to,
            value: self.reads(sense, &deviation, &to.q),
        };
        let about = moved.filter(|axis| self.machine.axes[*axis].letter.is_rotary());
        let about = about.map(|axis| reading(BenchInstrument::Calibrator, Sense::About(axis)));
        let mut readings: Vec<InstrumentReading> = about.into_iter().collect();
        for a in self.linear() {
            for b in self.linear() {
                let normal = self.way(&to.q, a).cross(&self.way(&to.q, b));
                if (component(a) + 1) % 3 == component(b) && normal.norm() > 0.5 {
                    readings.push(reading(BenchInstrument::Angle, Sense::From(a, b)));
                }
            }
        }
        readings
    }

    /// The usual range for a reading of an axis, within given limits (mm or rad): [`REACH`], or a quarter of a turn.
    pub fn span(&self, axis: usize, [low, high]: [f64; 2]) -> [f64; 2] {
        let from = 0.0_f64.max(low).min(high);
        let usual = match self.machine.axes[axis].letter.is_rotary() {
            true => FRAC_PI_2,
            false => REACH,
        };
        let to = match (high - from, from - low) {
            (up, _) if up >= usual => from + usual,
            (_, down) if down >= usual => from - usual,
            (up, down) if up >= down => high,
            _ => low,
        };
        [from, to]
    }

    /// The travel of an axis (mm or rad).
    pub fn travel(&self, index: usize) -> [f64; 2] {
        let axis = &self.machine.axes[index];
        axis.travel.map(|t| axis.to_kinematic(t))
    }

    /// A square: one leg aligned with the motion of `aligned`, and a dial moved along the other leg by `moved` over
    /// a span (mm).
    pub fn square(&self, aligned: usize, moved: usize, [from, to]: [f64; 2]) -> InstrumentReading {
        let home = BenchState::at(self.home());
        let from = home.with(moved, from);
        let to = home.with(moved, to);
        let [a0, a1] = self
            .span(aligned, self.travel(aligned))
            .map(|q| home.with(aligned, q));
        let way = a1.q[aligned] - a0.q[aligned];
        let nominal = |state: &BenchState| self.nominal(&state.q).t;
        let actual = |state: &BenchState| self.actual(state).t;
        let off = |at: &dyn Fn(&BenchState) -> Vector3<f64>| {
            let leg = ((at(&a1) - at(&a0)) * way.signum()).normalize();
            (at(&to) - at(&from)).dot(&leg)
        };
        InstrumentReading {
            instrument: BenchInstrument::Square,
            moved: Some(moved),
            sense: Sense::In(aligned),
            from,
            to,
            value: (off(&actual) - off(&nominal)) / (to.q[moved] - from.q[moved]) * REACH,
        }
    }

    /// A straightedge along an axis, aligned at the first and the last position, read in the direction of each other
    /// linear axis where the deviation is largest.
    pub fn straightedge<'s>(
        &'s self,
        moved: usize,
        places: &'s [f64],
    ) -> impl Iterator<Item = InstrumentReading> + 's {
        let home = BenchState::at(self.home());
        let ends = match places {
            [first, .., last] => Some([*first, *last]),
            _ => None,
        };
        let across = self.linear().filter(move |axis| *axis != moved);
        across.filter_map(move |axis| {
            let ends = ends?;
            let [from, last] = ends.map(|end| home.with(moved, end));
            let off = |to: &BenchState| self.deviation(&from, to).tip.dot(&self.way(&to.q, axis));
            let slope = off(&last) / (ends[1] - ends[0]);
            largest(places.iter().map(|place| {
                let to = home.with(moved, *place);
                InstrumentReading {
                    instrument: BenchInstrument::Straightedge { ends },
                    moved: Some(moved),
                    sense: Sense::In(axis),
                    from,
                    to,
                    value: off(&to) - slope * (place - ends[0]),
                }
            }))
        })
    }

    /// Range (rad) over which a rotary axis is turned to find its centre: half a turn, if possible.
    pub fn swing(&self, rotary: usize) -> [f64; 2] {
        match self.travel(rotary) {
            [low, high] if low <= 0.0 && high >= PI => [0.0, PI],
            [low, high] if low <= -PI && high >= 0.0 => [0.0, -PI],
            [low, high] if low <= -FRAC_PI_2 && high >= FRAC_PI_2 => [-FRAC_PI_2, FRAC_PI_2],
            [low, high] if high - low >= PI => [low, low + PI],
            travel => travel,
        }
    }

    /// A ball on the workpiece, with linear axes keeping the tip on it while a rotary axis turns from one position
    /// (rad) to another; the indicator reads in the direction of each linear axis.
    pub fn ball(
        &self,
        rotary: usize,
        [from, to]: [f64; 2],
        away: Option<usize>,
    ) -> Vec<InstrumentReading> {
        let home = self.home();
        let (place, point) = match (self.machine.axes[rotary].branch, away) {
            (Branch::Tool, _) => (BallPlacement::Tip, self.nominal(&home).t),
            (Branch::Workpiece, None) => (BallPlacement::OnAxis, self.foot(&home, rotary)),
            (Branch::Workpiece, Some(axis)) => (
                BallPlacement::Away(axis),
                self.foot(&home, rotary) + self.way(&home, axis) * REACH,
            ),
        };
        let on_ball = |angle: f64| {
            let turned = BenchState::at(home).with(rotary, angle);
            self.reach(&turned.q, point).map(BenchState::at)
        };
        let (Some(from), Some(to)) = (on_ball(from), on_ball(to)) else {
            return Vec::new();
        };
        self.tip(BenchInstrument::Ball { place }, Some(rotary), from, to)
            .collect()
    }

    /// A dial on an arm in the spindle, swept over the table from the negative to the positive side of each linear
    /// axis that is not along the tool. The reading is positive if the dial is pushed in farther on the positive
    /// side.
    pub fn tram(&self) -> impl Iterator<Item = InstrumentReading> + '_ {
        let home = BenchState::at(self.home());
        let nominal = self.nominal(&home.q);
        let tool = Vector3::from(ToolPose::of(self.machine, &nominal).direction);
        let turn = self.actual(&home).r * nominal.r.transpose();
        self.linear().filter_map(move |axis| {
            let way = self.way(&home.q, axis);
            let arm = way - tool * tool.dot(&way);
            (arm.norm() > 0.5).then(|| {
                let arm = arm.normalize() * REACH;
                InstrumentReading {
                    instrument: BenchInstrument::Tram,
                    moved: None,
                    sense: Sense::In(axis),
                    from: home,
                    to: home,
                    // Lower on one side, higher on the other.
                    value: -2.0 * (turn * arm - arm).dot(&tool),
                }
            })
        })
    }
}
