//! The other end: what a motion side does with corrections, and when they stop.
//!
//! A reference for whoever writes the motion side, in any language. Once per period it makes a
//! frame of its command, exchanges it, and gives what has come back to [`MotionSide::answer`],
//! which says what to add to the command. Whatever comes, or does not:
//!
//! - **never a step**: what is added changes by at most a bound per period, all axes by a common
//!   part of the way, so that corrections that cancel each other stay together;
//! - **hold, then ramp**: without news it stays as it is for a while, and then goes to zero;
//! - **news** is an answer that is whole, within bounds, for one of the last commands, and for
//!   another one than the answer before. A controller that is dead, while its SPI hardware sends the
//!   same bytes for ever, gives none.
//!
//! What the machine does then is an [alarm](Applied::alarm): hold the feed, stop the program.

use crate::device::Command;
use crate::spi::{Answer, CommandFrame};

/// What a motion side accepts. All of it is about the machine, and independent of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const AXES: usize> {
    /// Largest correction of each axis, mm or degrees, above zero: an answer beyond it is none.
    pub value: [f32; AXES],
    /// Largest change of each axis in one period, mm or degrees, above zero; at least the rate
    /// bound of the compensation times the period, or corrections lag behind.
    pub step: [f32; AXES],
    /// For so many periods without news the corrections stay as they are.
    pub hold: u32,
}

/// What is added to the commands, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum State {
    /// What the controller gives, or on the way to it.
    Following,
    /// No news: the last one stays.
    Holding,
    /// None for too long: on the way to zero, or there.
    Leaving,
}

/// What to add to the commands of this period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Applied<const AXES: usize> {
    /// To be added, mm or degrees.
    pub dq: [f32; AXES],
    /// Why.
    pub state: State,
    /// No news for longer than is tolerated, or the controller says that something is wrong.
    pub alarm: bool,
}

/// The motion side of one controller.
#[derive(Clone, Copy, Debug)]
pub struct MotionSide<const AXES: usize> {
    bounds: Bounds<AXES>,
    /// Count of the last command.
    count: u8,
    /// Count in the last sound answer.
    seen: Option<u8>,
    /// What is added now.
    dq: [f32; AXES],
    /// The last news.
    wanted: [f32; AXES],
    /// Periods without news; more than `hold` after start.
    silent: u32,
    /// Pieces of news in a row.
    steady: u32,
    healthy: bool,
    refused: u32,
}

impl<const AXES: usize> MotionSide<AXES> {
    /// An answer may be for a command so many periods before the last, which is the usual one; and
    /// so many periods without news are no alarm. The controller tolerates as many
    /// ([`Tolerance::USUAL`](crate::spi::Tolerance::USUAL)).
    pub const LATE: u8 = 4;
    /// After a loss, so many pieces of news in a row are followed again: more than old frames can
    /// look like, two of which a dead controller may send in turn.
    pub const STEADY: u32 = 2 * (Self::LATE as u32 + 1);

    /// Nothing has come yet: no corrections.
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

    /// What has come back while the frame of [`command`](Self::command) went out; nothing, or
    /// anything. `pin`: level of the fault pin, high while there is no fault.
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

    /// Answers that were whole but not acceptable: not numbers, or beyond the bounds.
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
        // 1: the command before the one that goes out now.
        let age = self.count.wrapping_sub(count);
        if !other || !(1..=1 + Self::LATE).contains(&age) {
            return None;
        }
        self.healthy = answer.healthy;
        // False for what is not a number.
        let within = |(dq, most): (&f32, &f32)| dq.abs() <= *most;
        if !answer.dq.iter().zip(&self.bounds.value).all(within) {
            self.refused = self.refused.wrapping_add(1);
            return None;
        }
        Some(answer.dq)
    }

    /// Goes to what is wanted, as far as one period allows: all axes the same part of their ways.
    fn approach(&mut self) {
        let mut most = 1.0_f32;
        for ((dq, wanted), step) in self.dq.iter().zip(&self.wanted).zip(&self.bounds.step) {
            // Of an axis without a step there is no way either; what is not a number is left out.
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
#[cfg(test)]
mod two_clocks;
