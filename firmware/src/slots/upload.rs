//! The upload of a blob into a slot.

use trueaxis::{HEADER, Header};

use super::bad_blocks::Health;
use super::layout::{self, WORD};
use super::tail::Tail;
use super::{Slot, SlotError, SlotState, Slots, TableFlash};

/// Progress of an upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Progress {
    /// The slot is being erased, one block per call of `erase_step`.
    Erasing {
        /// Blocks that are erased or need no erase.
        done: u32,
        /// Number of blocks in the slot.
        blocks: u32,
    },
    /// The slot accepts bytes from `next` on; once `next` is the length of the blob it can be committed.
    Receiving {
        /// Offset of the first byte that has not arrived.
        next: u32,
    },
    /// An error has spoiled the upload: begin again, which erases the slot.
    Spoiled,
}

/// An upload.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    /// The target slot.
    pub slot: Slot,
    /// Length of the blob in bytes.
    pub length: u32,
    /// CRC-32 in the header of the blob.
    pub crc: u32,
    /// Progress of the upload.
    pub progress: Progress,
}

/// An upload, with private state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Session {
    pub upload: Upload,
    /// Blocks that read blank need no erase.
    pub skips_blank: bool,
    pub tail: Tail,
}

impl Session {
    /// Offset of the first byte that has not arrived.
    pub fn receiving(&self) -> Result<u32, SlotError> {
        match self.upload.progress {
            Progress::Erasing { .. } => Err(SlotError::Erasing),
            Progress::Receiving { next } => Ok(next),
            Progress::Spoiled => Err(SlotError::Spoiled),
        }
    }
}

/// How an upload begins.
enum Beginning {
    /// It is already open.
    Open(Progress),
    /// The slot contains part of it, from before a restart.
    Resumes(Slot),
    /// The slot is erased first.
    Erases {
        slot: Slot,
        /// Blocks that read blank are blank: none of them belongs to an interrupted erase.
        proven: bool,
    },
}

impl<F: TableFlash> Slots<F> {
    /// Begins the upload of a blob of `length` bytes with `crc` in its header.
    ///
    /// It goes to the slot that is not active, or with none active, to the one that is not the newest. The same blob
    /// continues where it was. After a restart it begins at byte 0, but bytes already in the flash are only compared:
    /// nothing is erased or written twice. A different blob replaces an upload in progress. If necessary, the settings
    /// for the start are first [stored](Self::choose) in the other slot.
    ///
    /// # Errors
    /// [`SlotError::Length`], [`SlotError::NotStandstill`], [`SlotError::Unusable`], [`SlotError::Leased`]; if a choice
    /// is written first, also those of [`choose`](Self::choose).
    pub fn begin(&mut self, length: u32, crc: u32) -> Result<Progress, SlotError> {
        let beginning = self.beginning(length, crc)?;
        let (slot, progress, skips_blank) = match beginning {
            Beginning::Open(progress) => return Ok(progress),
            Beginning::Resumes(slot) => {
                self.may_stall()?;
                (slot, Progress::Receiving { next: 0 }, true)
            }
            Beginning::Erases { slot, proven } => {
                self.may_stall()?;
                self.session = None;
                self.secure(slot)?;
                let marked = proven && self.mark(slot);
                let progress = Progress::Erasing {
                    done: 0,
                    blocks: self.blocks(),
                };
                let sound = self.health(slot) == Health::Sound;
                (slot, progress, marked && sound)
            }
        };
        self.session = Some(Session {
            upload: Upload {
                slot,
                length,
                crc,
                progress,
            },
            skips_blank,
            tail: Tail::EMPTY,
        });
        Ok(progress)
    }

    /// Whether [`begin`](Self::begin) with these arguments would erase the slot.
    ///
    /// # Errors
    /// [`SlotError::Length`], [`SlotError::Unusable`], [`SlotError::Leased`]
    pub(crate) fn would_erase(&mut self, length: u32, crc: u32) -> Result<bool, SlotError> {
        let beginning = self.beginning(length, crc)?;
        Ok(matches!(beginning, Beginning::Erases { .. }))
    }

    /// Whether [`begin`](Self::begin) first writes to the slot that is kept, and thereby stalls a running servo.
    #[must_use]
    pub(crate) fn begin_stalls(&self) -> bool {
        let target = self.target();
        self.must_secure(target) && self.choosing_stalls(target.other())
    }

    fn beginning(&mut self, length: u32, crc: u32) -> Result<Beginning, SlotError> {
        let capacity = self.capacity();
        if length > capacity || (length as usize) < HEADER {
            return Err(SlotError::Length { capacity });
        }
        let slot = self.target();
        if let Health::Unusable { block } = self.health(slot) {
            return Err(SlotError::Unusable { slot, block });
        }
        let open = self.session.map(|session| session.upload);
        let open = open.filter(|u| (u.slot, u.length, u.crc) == (slot, length, crc));
        let spoiled = match open.map(|upload| upload.progress) {
            Some(Progress::Spoiled) => true,
            Some(progress) => return Ok(Beginning::Open(progress)),
            None => false,
        };
        if self.is_leased(slot) {
            return Err(SlotError::Leased);
        }
        self.scan(slot);
        let found = self.found[slot.index()];
        let (same, proven) = match found.state {
            SlotState::Uploading {
                length: l, crc: c, ..
            } => ((l, c) == (length, crc), self.is_begun(slot)),
            // Blank at the start of the blob: an erase that needed no mark was interrupted and has restored a flipped
            // bit of the trailer.
            _ => (false, found.proven() && !self.is_blank(slot, 0, WORD)),
        };
        if same && proven && !spoiled && self.health(slot) == Health::Sound {
            return Ok(Beginning::Resumes(slot));
        }
        Ok(Beginning::Erases { slot, proven })
    }

    /// Erases the next block that needs it, at most one, with the last block of the slot last; does nothing when the
    /// erase is complete.
    ///
    /// # Errors
    /// [`SlotError::NoUpload`], [`SlotError::Spoiled`], [`SlotError::NotStandstill`],
    /// [`SlotError::Flash`], [`SlotError::Readback`], [`SlotError::Unusable`].
    pub fn erase_step(&mut self) -> Result<Progress, SlotError> {
        let mut session = self.session.ok_or(SlotError::NoUpload)?;
        let (mut done, blocks) = match session.upload.progress {
            Progress::Erasing { done, blocks } => (done, blocks),
            Progress::Receiving { .. } => return Ok(session.upload.progress),
            Progress::Spoiled => return Err(SlotError::Spoiled),
        };
        self.may_stall()?;
        // If an error interrupts this, it stays spoiled.
        self.spoil();
        let slot = session.upload.slot;
        while done + 1 < blocks && session.skips_blank && self.is_block_blank(slot, done) {
            done += 1;
        }
        let erased = self.erase(slot, done);
        // Choices stored there are lost in any case.
        self.scan_choices(slot);
        erased?;
        done += 1;
        session.upload.progress = if done == blocks {
            self.record(&session.upload)?;
            Progress::Receiving { next: 0 }
        } else {
            Progress::Erasing { done, blocks }
        };
        self.session = Some(session);
        Ok(session.upload.progress)
    }

    /// Accepts bytes of the blob starting at `offset`; returns the offset of the first byte that has not arrived. Bytes
    /// that have arrived before are only compared.
    ///
    /// # Errors
    /// [`SlotError::NoUpload`], [`SlotError::Erasing`], [`SlotError::Gap`], [`SlotError::Beyond`],
    /// [`SlotError::Conflict`], [`SlotError::NotStandstill`]: nothing has changed.
    /// [`SlotError::Spoiled`], [`SlotError::NotBlank`], [`SlotError::Readback`],
    /// [`SlotError::Flash`]: begin again. [`SlotError::Unusable`].
    pub fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<u32, SlotError> {
        let mut session = self.session.ok_or(SlotError::NoUpload)?;
        let next = session.receiving()?;
        let length = session.upload.length;
        let end = u64::from(offset) + bytes.len() as u64;
        if end > u64::from(length) {
            return Err(SlotError::Beyond { length });
        }
        if offset > next {
            return Err(SlotError::Gap { expected: next });
        }
        let again = bytes.len().min((next - offset) as usize);
        let (again, fresh) = bytes.split_at(again);
        self.compare(&session, offset, again)?;
        if fresh.is_empty() {
            return Ok(next);
        }
        self.may_stall()?;
        self.spoil();
        let slot = session.upload.slot;
        // `next` without the bytes waiting in the tail: where writing to flash continues.
        let mut at = next as usize - session.tail.held().len();
        let mut rest = fresh;
        if !session.tail.held().is_empty() {
            rest = session.tail.fill(F::WRITE_SIZE, rest);
            if session.tail.held().len() == F::WRITE_SIZE {
                self.program(slot, at, session.tail.held())?;
                at += F::WRITE_SIZE;
                session.tail = Tail::EMPTY;
            }
        }
        let whole = rest.len() - rest.len() % F::WRITE_SIZE;
        let (words, rest) = rest.split_at(whole);
        self.program(slot, at, words)?;
        at += whole;
        session.tail.fill(F::WRITE_SIZE, rest);
        if end == u64::from(length) && !session.tail.held().is_empty() {
            self.program(slot, at, session.tail.padded(F::WRITE_SIZE))?;
            session.tail = Tail::EMPTY;
        }
        let next = end as u32;
        session.upload.progress = Progress::Receiving { next };
        self.session = Some(session);
        Ok(next)
    }

    /// Makes the received blob the newest one: reads it in place, calls `check` to see whether it can be used, and
    /// writes the last word. Returns the slot. No start selects it before it is [chosen](Self::choose).
    ///
    /// # Errors
    /// [`SlotError::NoUpload`], [`SlotError::Erasing`], [`SlotError::Incomplete`],
    /// [`SlotError::Refused`], [`SlotError::NotStandstill`]: nothing has changed.
    /// [`SlotError::Spoiled`], [`SlotError::Blob`], [`SlotError::OtherBlob`],
    /// [`SlotError::Readback`], [`SlotError::Flash`]: begin again. [`SlotError::Unusable`].
    pub fn commit(&mut self, check: impl FnOnce(&[u8]) -> bool) -> Result<Slot, SlotError> {
        let session = self.session.ok_or(SlotError::NoUpload)?;
        let Upload {
            slot, length, crc, ..
        } = session.upload;
        let expected = session.receiving()?;
        if expected != length {
            return Err(SlotError::Incomplete { expected });
        }
        self.may_stall()?;
        self.spoil();
        let header = self.check_blob(slot).map_err(|offset| {
            let error = SlotError::Readback { offset };
            self.failed(slot, offset, error)
        })?;
        if header.map_err(SlotError::Blob)? != (Header { length, crc }) {
            return Err(SlotError::OtherBlob);
        }
        let record = self.read_record(slot);
        let record = record.map_err(|_| {
            let offset = layout::record_at(self.length() as usize).start as u32;
            self.failed(slot, offset, SlotError::Readback { offset })
        })?;
        if !check(self.flash.read_in_place(slot, length)) {
            self.session = Some(session);
            return Err(SlotError::Refused);
        }
        let other = self.found[slot.other().index()].committed;
        let sequence = other.map_or(1, |newest| newest.wrapping_add(1));
        let at = layout::commit_at(self.length() as usize).start;
        self.program(slot, at, &record.commit(sequence))?;
        self.scan(slot);
        if self.found[slot.index()].valid() != Some(sequence) {
            let offset = at as u32;
            return Err(self.failed(slot, offset, SlotError::Readback { offset }));
        }
        self.health[slot.index()] = Health::Sound;
        self.session = None;
        Ok(slot)
    }

    /// Ends the upload. What has been written stays, and the same blob can continue later.
    pub fn abort(&mut self) {
        if let Some(session) = self.session.take() {
            self.scan(session.upload.slot);
        }
    }
}
