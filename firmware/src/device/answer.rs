//! Executes requests.

use trueaxis::link::{
    EvaluateRow, Hello, MotionResult, Refusal, Reply, Request, TermWeight, motion_rows, positions,
    put_positions,
};
use trueaxis::{ADJUSTABLE, Room, TermView, Travel};

use super::report::{held, told};
use super::under_way::{Change, Stage};
use super::{Device, Machine, ServoAccess};
use crate::link::{Answer, Controller};
use crate::slots::TableFlash;

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Changes the settings of the servo.
    fn set(&mut self, request: &Request<'_>) -> Result<(), Refusal> {
        self.servo.with(|side| match *request {
            Request::Enable(on) => {
                side.enable(on);
                Ok(())
            }
            Request::DryRun(on) => {
                side.dry_run(on);
                Ok(())
            }
            Request::SetWeight { term, value } => Ok(side.set_weight(usize::from(term), value)?),
            Request::ToolLength(length) if length.is_finite() => {
                side.set_tool_length(length);
                Ok(())
            }
            Request::ToolLength(_) => Err(Refusal::NotFinite),
            Request::Referenced(mask) => {
                side.set_referenced(mask);
                Ok(())
            }
            _ => Err(Refusal::LogicBug),
        })
    }

    /// Number of axes of the active compensation, at least one.
    fn axes(&self) -> Result<usize, Refusal> {
        match self.loader.current().axes().len() {
            0 => Err(Refusal::NoCompensation),
            axes => Ok(axes),
        }
    }

    /// Evaluates with the requested weights, independently of the servo.
    fn evaluate<'a>(&mut self, bytes: &[u8], out: &'a mut [u8]) -> Result<&'a [u8], Refusal> {
        let axes = self.axes()?;
        let (swapping, weights) = self.servo.with(|side| {
            let servo = side.servo();
            (servo.is_swapping(), *servo.wanted_weights())
        });
        if swapping {
            // The weights already belong to the new compensation.
            return Err(Refusal::Busy);
        }
        let compensation = self.loader.current();
        let auxiliaries = compensation.auxiliaries().len();
        let length = EvaluateRow::bytes(axes, auxiliaries);
        if bytes.is_empty() || !bytes.len().is_multiple_of(length) {
            return Err(Refusal::BadRows);
        }
        let written = bytes.len() / length * 4 * axes;
        let mut rest_in = bytes;
        let mut rest_out = &mut *out;
        while !rest_in.is_empty() {
            let (row, rest) =
                EvaluateRow::<C::Axes<f32>, C::Axes<Travel>>::get(rest_in, axes, auxiliaries)
                    .ok_or(Refusal::BadRows)?;
            rest_in = rest;
            let dq = compensation.evaluate(&row.inputs, &row.travelling, &weights);
            rest_out = put_positions(dq.as_ref(), axes, rest_out).ok_or(Refusal::LogicBug)?;
        }
        out.get(..written).ok_or(Refusal::LogicBug)
    }

    /// The adjustable terms, with the requested weights.
    fn weights(&mut self) -> Result<heapless::Vec<TermWeight, ADJUSTABLE>, Refusal> {
        self.axes()?;
        let (swapping, weights) = self.servo.with(|side| {
            let servo = side.servo();
            (servo.is_swapping(), *servo.wanted_weights())
        });
        if swapping {
            // The weights already belong to the new compensation.
            return Err(Refusal::Busy);
        }
        let weight = |(term, view): (usize, TermView<'_>)| {
            Some(TermWeight {
                term: told(term, u16::MAX),
                output: view.output,
                value: weights.get(term)?,
                limits: view.limits?,
            })
        };
        let terms = self.loader.current().terms().enumerate();
        Ok(held(terms.filter_map(weight)))
    }

    fn motion(&mut self, bytes: &[u8]) -> Result<(), Refusal> {
        let axes = self.axes()?;
        if bytes.is_empty() || !bytes.len().is_multiple_of(4 * axes) {
            return Err(Refusal::BadRows);
        }
        let (rows, most) = (bytes.len() / (4 * axes), motion_rows(axes));
        if rows > most {
            return Err(Refusal::TooManyRows { most: most as u16 });
        }
        // While ramping to zero, the servo may be replaced or stopped in the middle of a batch.
        if matches!(self.stage, Stage::Ramping { .. }) || matches!(self.change, Change::Ramping(_))
        {
            return Err(Refusal::Busy);
        }
        self.end_ramp();
        self.servo.with(|side| {
            if side.is_suspended() {
                Err(Refusal::Suspended)
            } else if side.begin_batch() {
                Ok(())
            } else {
                Err(Refusal::Occupied)
            }
        })?;
        let mut rest = bytes;
        while !rest.is_empty() {
            let (q, after) = positions::<C::Axes<f32>>(rest, axes).ok_or(Refusal::LogicBug)?;
            rest = after;
            // One at a time, so that the interrupt never waits long.
            self.servo.with(|side| side.push(q));
        }
        self.motion = Some(rows);
        Ok(())
    }
}

impl<F, S, M, C: Room> Controller for Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    fn hello(&self, session: u32) -> Hello<'_> {
        self.identify(session)
    }

    fn answer<'a>(&mut self, request: &Request<'_>, rows: &'a mut [u8]) -> Answer<'a> {
        self.drop_motion();
        if let Request::Motion(bytes) = *request {
            return match self.motion(bytes) {
                Ok(()) => Answer::Later,
                Err(refusal) => Answer::Now(Reply::Refused(refusal)),
            };
        }
        let reply = match *request {
            Request::Status => Ok(Reply::Status(self.report())),
            Request::Health => Ok(Reply::Health(self.health())),
            Request::Begin { length, crc } => self.begin(length, crc).map(Reply::Upload),
            Request::Chunk { offset, bytes } => self.chunk(offset, bytes).map(Reply::Upload),
            Request::Commit { force } => self.commit(force).map(Reply::Upload),
            Request::Abort => Ok(Reply::Upload(self.abort())),
            Request::Activate { slot, force } => self.activate(slot, force).map(Reply::Activation),
            Request::Evaluate(bytes) => self.evaluate(bytes, rows).map(Reply::Corrections),
            Request::CommitInUse { force } => self.commit_in_use(force).map(Reply::Upload),
            Request::AtStart => Ok(Reply::AtStart(self.at_start())),
            Request::EnableAtStart(on) => self.enable_at_start(on).map(Reply::AtStart),
            Request::Weights => self.weights().map(Reply::Weights),
            // Handled by the link, and above.
            Request::Hello | Request::Motion(_) => Err(Refusal::LogicBug),
            Request::Enable(_)
            | Request::DryRun(_)
            | Request::SetWeight { .. }
            | Request::ToolLength(_)
            | Request::Referenced(_) => self.set(request).map(|()| Reply::Done),
        };
        Answer::Now(reply.unwrap_or_else(Reply::Refused))
    }

    fn motion_answer<'a>(&mut self, out: &'a mut [u8]) -> Option<Reply<'a>> {
        let rows = self.motion?;
        self.servo.with(|side| side.result(rows.checked_sub(1)?))?;
        self.motion = None;
        let axes = self.loader.current().axes().len();
        let written = rows * MotionResult::bytes(axes);
        let mut rest = &mut *out;
        for row in 0..rows {
            let correction = self.servo.with(|side| side.result(row))?;
            rest = MotionResult(correction).put(axes, rest)?;
        }
        Some(Reply::Motion(out.get(..written)?))
    }

    fn drop_motion(&mut self) {
        if self.motion.take().is_some() {
            self.servo.with(|side| side.end_batch());
        }
    }

    fn poll(&mut self) {
        self.step();
    }
}
