//! Settings for a start: the compensation in use, the one before it, and whether corrections are enabled. See
//! `docs/src/slots.md`.
//!
//! The choices of a slot are stored before its trailer: the first one directly before it, each further one below. Every
//! choice is complete and numbered; the newest one in both slots applies. Each consists of its content and its
//! complement, either of which is enough: a flipped bit, or a word that can no longer be read, changes nothing.

use trueaxis::Checksum;

use super::bad_blocks::Health;
use super::layout::{CHOICE, TRAILER, WORD, blank, doubled, word};
use super::scan::newer;
use super::{Slot, SlotError, SlotState, Slots, TableFlash};

const MAGIC: [u8; 4] = *b"TXSC";
const IN_USE: u32 = 1;
const BEFORE: u32 = 2;
const ENABLE: u32 = 4;

/// A committed compensation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Table {
    /// Sequence number of the committed compensation.
    pub sequence: u32,
    /// CRC-32 in its header.
    pub crc: u32,
}

/// Settings for a start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Choice {
    /// The compensation in use.
    pub in_use: Option<Table>,
    /// The compensation in use before: for a rollback, and if the first one is not valid.
    pub before: Option<Table>,
    /// Corrections are enabled at start.
    pub enable: bool,
}

impl Choice {
    pub(super) fn encode(&self, number: u32) -> [u8; CHOICE] {
        let flag = |on: bool, flag: u32| if on { flag } else { 0 };
        let flags = flag(self.in_use.is_some(), IN_USE)
            | flag(self.before.is_some(), BEFORE)
            | flag(self.enable, ENABLE);
        let none = Table {
            sequence: 0,
            crc: 0,
        };
        let [used, before] = [self.in_use, self.before].map(|table| table.unwrap_or(none));
        let mut content = [0; 32];
        content[..4].copy_from_slice(&MAGIC);
        let words = [
            number,
            flags,
            used.sequence,
            used.crc,
            before.sequence,
            before.crc,
        ];
        for (place, value) in content[4..28].chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&value.to_le_bytes());
        }
        let check = Checksum::of(&content[..28]);
        content[28..].copy_from_slice(&check.to_le_bytes());
        doubled(&content)
    }

    /// Decodes a content; returns its number and the choice.
    fn decode(content: &[u8; WORD]) -> Option<(u32, Self)> {
        if content[..4] != MAGIC || word(content, 28) != Checksum::of(&content[..28]) {
            return None;
        }
        let flags = word(content, 8);
        let table = |flag: u32, at: usize| {
            (flags & flag != 0).then(|| Table {
                sequence: word(content, at),
                crc: word(content, at + 4),
            })
        };
        let choice = Self {
            in_use: table(IN_USE, 12),
            before: table(BEFORE, 20),
            enable: flags & ENABLE != 0,
        };
        Some((word(content, 4), choice))
    }
}

/// A choice as stored in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Stored {
    number: u32,
    choice: Choice,
    /// Both halves of it can be read.
    whole: bool,
}

/// The choices stored in a slot.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choices {
    newest: Option<Stored>,
    /// Number of places that are not blank.
    taken: usize,
}

impl<F: TableFlash> Slots<F> {
    /// Settings for the next start.
    #[must_use]
    pub fn choice(&self) -> Choice {
        let newest = self.newest_choice();
        newest.map_or(Choice::default(), |(_, stored)| stored.choice)
    }

    /// The newest choice, and the slot that holds it.
    pub(super) fn newest_choice(&self) -> Option<(Slot, Stored)> {
        let [a, b] = Slot::BOTH.map(|slot| {
            let newest = self.choices[slot.index()].newest;
            newest.map(|stored| (slot, stored))
        });
        match (a, b) {
            (Some(a), Some(b)) => Some(if newer(b.1.number, a.1.number) { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// Whether only one half of the newest choice can be read, and there is room to [store it](Self::choose) again.
    #[must_use]
    pub(crate) fn is_choice_halved(&self) -> bool {
        let whole = self.newest_choice().is_none_or(|(_, stored)| stored.whole);
        let room = self.in_use().map_or(0, |slot| self.places_left(slot));
        !whole && room >= 2
    }

    /// The valid slot with this compensation.
    #[must_use]
    pub fn slot_of(&self, table: Option<Table>) -> Option<Slot> {
        let wanted = table?;
        let mut both = Slot::BOTH.into_iter();
        both.find(|&slot| self.table(slot) == Some(wanted))
    }

    /// The compensation in a valid slot.
    fn table(&self, slot: Slot) -> Option<Table> {
        match self.state(slot) {
            SlotState::Valid { sequence, crc, .. } => Some(Table { sequence, crc }),
            _ => None,
        }
    }

    /// The slot selected for use, if it is valid.
    #[must_use]
    pub fn in_use(&self) -> Option<Slot> {
        self.slot_of(self.choice().in_use)
    }

    /// The slot that was in use before, if it is valid: for a rollback, and for a start if the other slot cannot be
    /// used.
    #[must_use]
    pub fn before(&self) -> Option<Slot> {
        self.slot_of(self.choice().before)
    }

    /// The valid slot whose compensation was never in use, so no start selects it.
    #[must_use]
    pub fn waiting(&self) -> Option<Slot> {
        let known = [self.in_use(), self.before()];
        let mut both = Slot::BOTH.into_iter();
        both.find(|&slot| self.state(slot).is_valid() && !known.contains(&Some(slot)))
    }

    /// The choice that puts a valid slot into use, with the other slot as its predecessor if it was ever in use.
    #[must_use]
    pub fn choosing(&self, slot: Slot) -> Choice {
        let known = [self.in_use(), self.before()].contains(&Some(slot.other()));
        Choice {
            in_use: self.table(slot),
            before: self.table(slot.other()).filter(|_| known),
            ..self.choice()
        }
    }

    /// Stores the settings for the next start, in the slot selected for use. Nothing is written if they are already
    /// stored and both halves can be read.
    ///
    /// # Errors
    /// [`SlotError::NotChosen`]: the slot selected for use is not valid. [`SlotError::NotStandstill`]: a running servo
    /// would be stalled. [`SlotError::Full`]: there is no room for it. In these cases nothing has changed.
    /// [`SlotError::Flash`], [`SlotError::Unusable`]: the previously stored settings still apply.
    pub fn choose(&mut self, choice: Choice) -> Result<(), SlotError> {
        // Choices in a slot that is not valid are lost with the next upload.
        let newest = self.newest_choice();
        let stays = newest.is_none_or(|(slot, stored)| stored.whole && self.state(slot).is_valid());
        if stays && self.choice() == choice {
            return Ok(());
        }
        let slot = self.slot_of(choice.in_use).ok_or(SlotError::NotChosen)?;
        // The last place is reserved for `secure`.
        if self.places_left(slot) < 2 {
            return Err(SlotError::Full);
        }
        self.put_choice(slot, choice)
    }

    /// Number of free places for choices in a valid slot.
    #[must_use]
    pub fn places_left(&self, slot: Slot) -> usize {
        let SlotState::Valid { length, .. } = self.state(slot) else {
            return 0;
        };
        let end = (length as usize).next_multiple_of(WORD);
        let room = (self.length() as usize).saturating_sub(TRAILER + end);
        (room / CHOICE).saturating_sub(self.choices[slot.index()].taken)
    }

    /// Whether the newest choice would be lost with this slot, and the other one can hold it.
    pub(super) fn must_secure(&self, slot: Slot) -> bool {
        let newest = self.newest_choice();
        newest.is_some_and(|(holds, _)| holds == slot) && self.places_left(slot.other()) > 0
    }

    /// Makes sure that the newest choice is not lost with this slot.
    pub(super) fn secure(&mut self, slot: Slot) -> Result<(), SlotError> {
        if !self.must_secure(slot) {
            return Ok(());
        }
        let kept = slot.other();
        let mut choice = self.choice();
        if self.active == Some(kept) && self.in_use() != Some(kept) {
            // The compensation selected for use is not valid, or is being lost, so the one used in its place stays in
            // use. Corrections were enabled for the former, not for the latter, which may be of another machine.
            choice = Choice {
                in_use: self.table(kept),
                before: None,
                enable: false,
            };
        }
        self.put_choice(kept, choice)
    }

    /// Whether a choice can be written to this slot now.
    pub(super) fn may_choose(&self, slot: Slot) -> Result<(), SlotError> {
        if self.choosing_stalls(slot) && !self.standstill {
            return Err(SlotError::NotStandstill);
        }
        Ok(())
    }

    /// Writes a choice to the next place of a slot, or to the place after that if a word of the first fails.
    fn put_choice(&mut self, slot: Slot, choice: Choice) -> Result<(), SlotError> {
        self.may_choose(slot)?;
        let mut place = self.choices[slot.index()].taken;
        for _ in 0..2 {
            let newest = self.newest_choice();
            let number = newest.map_or(0, |(_, stored)| stored.number);
            let number = number.wrapping_add(1);
            place = self.choices[slot.index()].taken;
            let at = self.choice_at(place).ok_or(SlotError::Full)?;
            let bytes = choice.encode(number);
            for (at, half) in (at..).step_by(WORD).zip(bytes.chunks(WORD)) {
                // One half is enough: the stored choice is read back.
                let _ = self.try_program(slot, at, half);
            }
            self.scan_choices(slot);
            let whole = |stored: Stored| stored.whole && stored.number == number;
            if self.choices[slot.index()].newest.is_some_and(whole) {
                return Ok(());
            }
            if self.places_left(slot) < 2 {
                break;
            }
        }
        let stored = |(holds, stored): (Slot, Stored)| holds == slot && stored.choice == choice;
        if self.newest_choice().is_some_and(stored) {
            return Ok(());
        }
        // The slot is in use, and is erased when the next upload goes there.
        let block = self.choice_at(place).unwrap_or(0) / F::ERASE_SIZE;
        let block = block as u32;
        if self.health(slot) == Health::Sound {
            self.health[slot.index()] = Health::Suspect { block };
        }
        Err(SlotError::Unusable { slot, block })
    }

    /// Position of a choice in a slot.
    fn choice_at(&self, place: usize) -> Option<usize> {
        let below = TRAILER + (place + 1) * CHOICE;
        (self.length() as usize).checked_sub(below)
    }

    /// Reads the choices of a slot, down to the first blank place.
    pub(super) fn scan_choices(&mut self, slot: Slot) {
        let mut choices = Choices::default();
        while let Some(at) = self.choice_at(choices.taken) {
            let [content, complement] = [at, at + WORD].map(|line| self.line(slot, line));
            let empty = |line: &Option<[u8; WORD]>| line.is_some_and(|line| blank(&line));
            if empty(&content) && empty(&complement) {
                break;
            }
            let plain = content.and_then(|line| Choice::decode(&line));
            let negative = complement.and_then(|line| Choice::decode(&line.map(|byte| !byte)));
            if let Some((number, choice)) = plain.or(negative) {
                let known = choices.newest;
                if known.is_none_or(|known: Stored| newer(number, known.number)) {
                    choices.newest = Some(Stored {
                        number,
                        choice,
                        whole: plain == negative,
                    });
                }
            }
            choices.taken += 1;
        }
        self.choices[slot.index()] = choices;
    }
}
