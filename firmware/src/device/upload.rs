//! An upload. If the flash stalls the processor, it runs only at standstill, with corrections at zero and the servo
//! suspended.

use trueaxis::link::{Refusal, Upload, short_name};
use trueaxis::{Compensation, Room, Row};

use super::under_way::{Change, Stage, Wish};
use super::{Device, Machine, ServoAccess};
use crate::double_buffer::Loader;
use crate::slots::{Progress, Slot, SlotError, SlotState, TableFlash};

/// Whether a compensation is for the same machine as the one in use: name and axis letters.
pub(super) fn same_machine<C: Room>(
    active: &Compensation<'_, C>,
    new: &Compensation<'_, C>,
) -> bool {
    let letters = |c: &Compensation<'_, C>| {
        let mut letters = C::Axes::<u8>::all(0);
        for (letter, axis) in letters.as_mut().iter_mut().zip(c.axes()) {
            *letter = axis.name;
        }
        letters
    };
    active.axes().is_empty()
        || (short_name(active.machine()) == short_name(new.machine())
            && letters(active) == letters(new))
}

/// Loads a blob to check whether it can be used, also on this machine. Returns whether the machine is the same.
fn acceptable<C: Room>(loader: &mut Loader<C>, blob: &[u8], force: bool) -> Result<bool, Refusal> {
    let same = loader.try_on(blob, same_machine)?;
    (force || same).then_some(same).ok_or(Refusal::OtherMachine)
}

/// An upload is dropped after this time without a request for it, s.
pub const GIVEN_UP: u32 = 20;

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    /// Begins or continues an upload, or reports its progress.
    pub(super) fn begin(&mut self, length: u32, crc: u32) -> Result<Upload, Refusal> {
        if self.change != Change::None {
            // The servo reads both slots.
            return Err(Refusal::Busy);
        }
        if let Stage::Failed(refusal) = self.stage {
            self.stage = Stage::None;
            return Err(refusal);
        }
        let held = self.slots.capacity();
        if length > held || (length as usize) < trueaxis::HEADER {
            return Err(Refusal::TooLong { held });
        }
        let now = self.now();
        if self.coming().is_some_and(|coming| coming != (length, crc)) {
            let idle = now.wrapping_sub(self.heard);
            // An upload without requests for that long is dropped by `poll_upload`.
            let wait = GIVEN_UP.saturating_sub(idle);
            return Err(Refusal::Uploading { wait });
        }
        self.heard = now;
        self.end_ramp();
        if self.stalls() || self.slots.begin_stalls() {
            if !self.machine.standstill() {
                return Err(Refusal::NotStandstill);
            }
            if self.stage != Stage::Open {
                if !matches!(self.stage, Stage::Ramping { .. }) {
                    self.afford(length, crc)?;
                }
                self.servo.with(|side| side.keep_at_zero(true));
                self.stage = Stage::Ramping { length, crc };
                self.open_at_zero()?;
                return Ok(self.upload_state());
            }
        }
        self.open(length, crc)?;
        Ok(self.upload_state())
    }

    /// Begins in the slots as soon as the corrections are zero.
    fn open_at_zero(&mut self) -> Result<(), Refusal> {
        let Stage::Ramping { length, crc } = self.stage else {
            return Ok(());
        };
        let at_zero = self.servo.with(|side| {
            let at_zero = side.is_at_zero();
            side.suspend(at_zero);
            at_zero
        });
        if !at_zero {
            return Ok(());
        }
        self.slots.set_standstill(true);
        if let Wish::Pending(choice) = self.wish {
            // While that is possible; otherwise storing is done by the upload.
            self.store(choice);
        }
        let opened = self.open(length, crc);
        if opened.is_err() {
            self.release();
            self.stage = Stage::None;
        } else if !self.stalls() {
            self.release();
        }
        opened
    }

    /// Length and CRC of the blob being uploaded.
    fn coming(&self) -> Option<(u32, u32)> {
        match self.stage {
            Stage::Ramping { length, crc } => Some((length, crc)),
            Stage::Open | Stage::Paused => {
                let upload = self.slots.upload()?;
                Some((upload.length, upload.crc))
            }
            Stage::None | Stage::Failed(_) | Stage::Committed(_) => None,
        }
    }

    /// Checks whether a begin stays within the erase budget; returns whether it erases.
    fn afford(&mut self, length: u32, crc: u32) -> Result<bool, Refusal> {
        let erases = self.slots.would_erase(length, crc)?;
        let now = self.now();
        match self.budget.wait(now) {
            wait if erases && wait > 0 => Err(Refusal::Wear { wait }),
            _ => Ok(erases),
        }
    }

    fn open(&mut self, length: u32, crc: u32) -> Result<(), Refusal> {
        // The servo holds both buffers only during a change, and no upload begins while one waits for zero.
        self.vacate()?;
        let begun = self.afford(length, crc).and_then(|erases| {
            self.slots.begin(length, crc)?;
            Ok(erases)
        });
        match begun {
            Ok(erases) => {
                if erases {
                    let now = self.now();
                    self.budget.spend(now);
                }
                self.stage = Stage::Open;
                Ok(())
            }
            Err(refusal) => {
                // Also if another upload was open, because that one is lost.
                self.release();
                self.stage = Stage::None;
                Err(refusal)
            }
        }
    }

    /// Resumes the servo.
    pub(super) fn release(&mut self) {
        self.slots.set_standstill(false);
        self.servo.with(|side| {
            side.suspend(false);
            side.keep_at_zero(false);
        });
    }

    pub(super) fn poll_upload(&mut self) {
        let ramping = matches!(self.stage, Stage::Ramping { .. });
        let moving = (ramping || self.stalls()) && !self.machine.standstill();
        if self.coming().is_some() && self.now().wrapping_sub(self.heard) >= GIVEN_UP {
            // The host no longer responds: the bytes sent so far are kept, and the servo resumes.
            self.abort();
        }
        match self.stage {
            Stage::Ramping { .. } if moving => {
                self.release();
                self.stage = Stage::None;
            }
            Stage::Ramping { .. } => {
                if let Err(refusal) = self.open_at_zero() {
                    self.stage = Stage::Failed(refusal);
                }
            }
            Stage::Open if moving => {
                self.release();
                self.stage = Stage::Paused;
            }
            Stage::Open => {
                let upload = self.slots.upload();
                if let Some(Progress::Erasing { .. }) = upload.map(|upload| upload.progress)
                    && let Err(error) = self.slots.erase_step()
                {
                    self.release();
                    self.stage = Stage::Failed(error.into());
                }
            }
            Stage::None | Stage::Paused | Stage::Failed(_) | Stage::Committed(_) => {}
        }
    }

    /// The upload accepts bytes: it is open, and nothing is moving that would be stalled.
    fn opened(&mut self) -> Result<(), Refusal> {
        // The machine may have begun to move since the last poll.
        self.poll_pause();
        match self.stage {
            Stage::Open => Ok(()),
            Stage::Paused => Err(Refusal::NotStandstill),
            Stage::Ramping { .. } => Err(Refusal::Erasing),
            Stage::Failed(refusal) => Err(refusal),
            Stage::None | Stage::Committed(_) => Err(Refusal::NoUpload),
        }
    }

    fn poll_pause(&mut self) {
        if self.stage == Stage::Open && self.stalls() && !self.machine.standstill() {
            self.release();
            self.stage = Stage::Paused;
        }
    }

    pub(super) fn chunk(&mut self, offset: u32, bytes: &[u8]) -> Result<Upload, Refusal> {
        self.opened()?;
        self.heard = self.now();
        self.slots.write(offset, bytes)?;
        Ok(self.upload_state())
    }

    pub(super) fn commit(&mut self, force: bool) -> Result<Upload, Refusal> {
        let (slot, _) = self.check_and_commit(force)?;
        self.committed(slot)
    }

    /// Commits the upload, and the next start uses it.
    pub(super) fn commit_in_use(&mut self, force: bool) -> Result<Upload, Refusal> {
        let (slot, same) = self.check_and_commit(force)?;
        // After the commit, while the flash can be written.
        self.store(self.choosing(slot).on(same));
        self.committed(slot)
    }

    /// Slot of the received blob, and whether it is for the same machine.
    fn check_and_commit(&mut self, force: bool) -> Result<(Slot, bool), Refusal> {
        self.opened()?;
        self.heard = self.now();
        let loader = &mut self.loader;
        let mut why = Refusal::LogicBug;
        let mut same = false;
        let check = |blob: &[u8]| match acceptable(loader, blob, force) {
            Ok(accepted) => {
                same = accepted;
                true
            }
            Err(refusal) => {
                why = refusal;
                false
            }
        };
        let slot = self.slots.commit(check).map_err(|error| match error {
            SlotError::Refused => why,
            other => other.into(),
        })?;
        Ok((slot, same))
    }

    fn committed(&mut self, slot: Slot) -> Result<Upload, Refusal> {
        self.release();
        let sequence = match self.slots.state(slot) {
            SlotState::Valid { sequence, .. } => sequence,
            _ => return Err(Refusal::LogicBug),
        };
        let done = Upload::Committed { slot, sequence };
        self.stage = Stage::Committed(done);
        Ok(done)
    }

    pub(super) fn abort(&mut self) -> Upload {
        if matches!(self.stage, Stage::Ramping { .. } | Stage::Open) {
            self.release();
        }
        self.slots.abort();
        self.stage = Stage::None;
        Upload::None
    }

    pub(super) fn upload_state(&self) -> Upload {
        let (next, length, erasing) = match self.slots.upload() {
            Some(upload) => match upload.progress {
                Progress::Erasing { done, blocks } => (0, upload.length, Some((done, blocks))),
                Progress::Receiving { next } => (next, upload.length, None),
                Progress::Spoiled => (0, upload.length, None),
            },
            None => (0, 0, None),
        };
        match (self.stage, erasing) {
            (Stage::None | Stage::Failed(_), _) => Upload::None,
            (Stage::Ramping { .. }, _) => Upload::Ramping,
            (Stage::Open, Some((done, blocks))) => Upload::Erasing { done, blocks },
            (Stage::Open, None) => Upload::Receiving { next, length },
            (Stage::Paused, _) => Upload::Paused { next, length },
            (Stage::Committed(done), _) => done,
        }
    }
}
