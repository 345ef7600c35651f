//! The other end: how a motion side applies corrections, and what it does when they stop.
//!
//! A reference for implementing the motion side in any language. Once per period it makes a frame of its command,
//! exchanges it, and passes the received bytes to [`MotionSide::answer`], which returns what to add to the command.
//! Whatever is received, or if nothing is:
//!
//! - **never a step**: the added correction changes by at most a bound per period. All axes cover the same fraction of
//!   their distance, so corrections that cancel each other stay together;
//! - **hold, then ramp**: without news it stays unchanged for a while, and then goes to zero;
//! - **news** is an answer that is complete, within bounds, for one of the last commands, and for a different one than
//!   the previous answer. A dead controller whose SPI hardware keeps sending the same bytes gives no news.
//!
//! The machine must react to an [alarm](Applied::alarm): hold the feed, stop the program.

use crate::device::Command;
use crate::spi::{Answer, CommandFrame};

/// Limits that a motion side enforces. They depend only on the machine and are independent of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const AXES: usize> {
    /// Largest correction of each axis, mm or degrees, above zero. An answer that exceeds it is rejected.
    pub value: [f32; AXES],
    /// Largest change of each axis in one period, mm or degrees, above zero. Should be at least the rate bound of the
    /// compensation times the period, or corrections lag.
    pub step: [f32; AXES],
    /// Number of periods without news for which the corrections stay unchanged.
    pub hold: u32,
}

/// How the added correction is determined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// It follows the controller, or is moving to the value it gave.
    Following,
    /// No news: the last correction is held.
    Holding,
    /// No news for too long: ramping to zero, or at zero.
    Leaving,
}

/// What to add to the commands of this period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied<const AXES: usize> {
    /// Correction to add, mm or degrees.
    pub dq: [f32; AXES],
    /// How it was determined.
    pub state: State,
    /// No news for longer than tolerated, or the controller reports a fault.
    pub alarm: bool,
}

/// The motion side of one controller.
#[derive(Clone, Copy, Debug)]
pub struct MotionSide<const AXES: usize> {
    bounds: Bounds<AXES>,
    /// Counter of the last command.
    count: u8,
    /// Counter in the last valid answer.
    seen: Option<u8>,
    /// The correction being added.
    dq: [f32; AXES],
    /// Corrections of the last news.
    wanted: [f32; AXES],
    /// Periods without news; more than `hold` after start.
    silent: u32,
    /// Consecutive news.
    steady: u32,
    healthy: bool,
    refused: u32,
}

impl<const AXES: usize> MotionSide<AXES> {
    /// An answer may be for a command up to this many periods before the last one, which is the normal case; and this
    /// many periods without news raise no alarm. The controller tolerates the same number
    /// ([`Tolerance::USUAL`](crate::spi::Tolerance::USUAL)).
    pub const LATE: u8 = 4;
    /// Number of consecutive news required to follow again after a loss: more than old frames can imitate, two of which
    /// a dead controller may send alternately.
    pub const STEADY: u32 = 2 * (Self::LATE as u32 + 1);

    /// Nothing received yet: no corrections.
    #[must_use]
    pub const fn new(bounds: Bounds<AXES>) -> Self {
        Self {
            bounds,
            count: 0,
            seen: None,
            dq: [0.0; AXES],
            wanted: [0.0; AXES],
            silent: u32::MAX,
            steady: 0,
            healthy: false,
            refused: 0,
        }
    }

    /// The frame of this period's command; `None` if there is no room for it in `out`.
    pub fn command<'a>(
        &mut self,
        command: Command<[f32; AXES]>,
        out: &'a mut [u8],
    ) -> Option<&'a [u8]> {
        self.count = self.count.wrapping_add(1);
        let count = self.count;
        CommandFrame { count, command }.put(out)
    }

    /// Processes the bytes received while the frame of [`command`](Self::command) was sent, which may be empty or
    /// arbitrary. `pin`: level of the fault pin, high while there is no fault.
    pub fn answer(&mut self, bytes: &[u8], pin: bool) -> Applied<AXES> {
        match self.news(bytes) {
            Some(dq) => {
                self.steady = self.steady.saturating_add(1);
                if self.is_lost() && self.steady < Self::STEADY {
                    self.silent = self.silent.saturating_add(1);
                } else {
                    self.silent = 0;
                    self.wanted = dq;
                }
            }
            None => {
                self.steady = 0;
                self.silent = self.silent.saturating_add(1);
            }
        }
        let state = if self.is_lost() {
            self.wanted = [0.0; AXES];
            self.approach();
            State::Leaving
        } else if self.silent > 0 {
            State::Holding
        } else {
            self.approach();
            State::Following
        };
        Applied {
            dq: self.dq,
            state,
            alarm: self.silent > u32::from(Self::LATE) || !self.healthy || !pin,
        }
    }

    /// Number of answers that were complete but unacceptable: NaN, or beyond the bounds.
    #[must_use]
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    fn is_lost(&self) -> bool {
        self.silent > self.bounds.hold
    }

    /// The corrections of an answer, if it is news.
    fn news(&mut self, bytes: &[u8]) -> Option<[f32; AXES]> {
        let answer = Answer::<[f32; AXES]>::get(bytes).ok()?;
        let count = answer.count?;
        let other = self.seen.replace(count) != Some(count);
        // 1: the command before the one being sent now.
        let age = self.count.wrapping_sub(count);
        if !other || !(1..=1 + Self::LATE).contains(&age) {
            return None;
        }
        self.healthy = answer.healthy;
        // False for NaN.
        let within = |(dq, most): (&f32, &f32)| dq.abs() <= *most;
        if !answer.dq.iter().zip(&self.bounds.value).all(within) {
            self.refused = self.refused.wrapping_add(1);
            return None;
        }
        Some(answer.dq)
    }

    /// Moves towards the wanted corrections as far as one period permits, all axes by the same fraction of their
    /// distance.
    fn approach(&mut self) {
        let mut most = 1.0_f32;
        for ((dq, wanted), step) in self.dq.iter().zip(&self.wanted).zip(&self.bounds.step) {
            // An axis without a permitted change has no distance to cover; NaN is left out.
            most = ((wanted - dq).abs() / step).max(most);
        }
        if most > 1.0 {
            for (dq, wanted) in self.dq.iter_mut().zip(&self.wanted) {
                *dq += (wanted - *dq) / most;
            }
        } else {
            self.dq = self.wanted;
        }
    }
}

#[cfg(test)]
mod tests;
