//! Both directions of the exchange, independent of which side is the master of the bus.

use trueaxis::{Conditions, Correction};

use super::frame::{Answer, MOST, length};
use super::intake::{Intake, Tolerance};
use crate::device::{Command, CorrectionSink, PositionSource, Regularity};

/// The controller's end of the exchange.
///
/// On a board that is the slave: when a frame has ended, [`hear`](Self::hear) it, tick with [`ends`](Self::ends), and
/// prepare the [`answer`](Self::answer) for the next frame. While frames are missing, do the same without `hear`, once
/// per period.
#[derive(Clone, Copy, Debug)]
pub struct Exchange<const AXES: usize> {
    intake: Intake<[f32; AXES]>,
    computed: Computed<AXES>,
}

/// The servo's last result.
#[derive(Clone, Copy, Debug)]
struct Computed<const AXES: usize> {
    healthy: bool,
    conditions: Conditions,
    dq: [f32; AXES],
}

/// The command of one period.
#[derive(Debug)]
pub struct Source<'m, const AXES: usize>(&'m mut Intake<[f32; AXES]>);

/// Receives the correction of one period.
#[derive(Debug)]
pub struct Sink<'m, const AXES: usize>(&'m mut Computed<AXES>);

impl<const AXES: usize> Exchange<AXES> {
    /// Nothing has been exchanged yet.
    #[must_use]
    pub const fn new(tolerance: Tolerance) -> Self {
        const { assert!(length(AXES) <= MOST, "no frame has so many axes") };
        Self {
            intake: Intake::new(tolerance),
            computed: Computed {
                healthy: false,
                conditions: Conditions::DISABLED,
                dq: [0.0; AXES],
            },
        }
    }

    /// Processes the bytes of a frame that has ended. Bytes that do not form a frame count as damaged.
    pub fn hear(&mut self, bytes: &[u8]) {
        self.intake.hear(bytes);
    }

    /// Source and sink of one [`tick`](crate::device::ServoSide::tick).
    pub fn ends(&mut self) -> (Source<'_, AXES>, Sink<'_, AXES>) {
        (Source(&mut self.intake), Sink(&mut self.computed))
    }

    /// Writes the bytes to send with the next frame; the bytes after them stay unchanged.
    pub fn answer(&self, out: &mut [u8; MOST]) {
        let Computed {
            healthy,
            conditions,
            dq,
        } = self.computed;
        let seen = self.intake.seen();
        let answer = Answer {
            count: self.intake.count(),
            healthy,
            conditions,
            irregular: seen.repeated.wrapping_add(seen.skipped) as u16,
            dq,
        };
        // There is room for the number of axes that `new` permits.
        let _ = answer.put(out);
    }

    /// Counts so far.
    #[must_use]
    pub const fn seen(&self) -> Regularity {
        self.intake.seen()
    }
}

impl<const AXES: usize> PositionSource<[f32; AXES]> for Source<'_, AXES> {
    fn take(&mut self) -> Option<Command<[f32; AXES]>> {
        self.0.take()
    }

    fn regularity(&self) -> Regularity {
        self.0.seen()
    }
}

impl<const AXES: usize> CorrectionSink<[f32; AXES]> for Sink<'_, AXES> {
    fn give(&mut self, correction: &Correction<[f32; AXES]>, healthy: bool) {
        *self.0 = Computed {
            healthy,
            conditions: correction.status.conditions,
            dq: correction.dq,
        };
    }
}
