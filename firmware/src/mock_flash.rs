//! A NOR flash on the desktop that can lose power, stall its readers and flip its bits.

use std::boxed::Box;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

use crate::slots::{Mapped, Slot, Slots, TableFlash, WhileBusy};

/// Why an operation of the mock failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MockError {
    /// The fuel is used up: everything fails until power returns.
    PowerCut,
    /// A word was written that was not blank.
    NotBlank,
    /// A word was read whose error-correcting code reports an error.
    Torn,
    /// A word with a [`Defect`] was programmed.
    Defective,
    /// The address is out of range or not a multiple of the required size.
    Place(NorFlashErrorKind),
}

impl NorFlashError for MockError {
    fn kind(&self) -> NorFlashErrorKind {
        match *self {
            Self::Place(kind) => kind,
            Self::PowerCut | Self::NotBlank | Self::Torn | Self::Defective => {
                NorFlashErrorKind::Other
            }
        }
    }
}

/// What the flash is busy with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Busy {
    /// It erases a block.
    Erase,
    /// It programs words.
    Program,
}

/// State left by an interrupted erase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CutErase {
    /// The first bytes are erased.
    Ascending,
    /// The last bytes are erased.
    Descending,
    /// Arbitrary bits are erased; the number selects them.
    Scattered(u64),
}

/// Failure mode of a word of the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Defect {
    /// Programming it fails until its block is erased: a word that reads blank but is not, as left by interrupted
    /// programming when there is an error-correcting code.
    UntilErased,
    /// Programming it always fails.
    Refuses,
    /// Some of its bits stay at 1 when it is programmed, without an error.
    Misreads,
    /// It keeps its bits when erased or programmed, without an error.
    Stuck,
}

impl Defect {
    /// All defects.
    pub const ALL: [Self; 4] = [
        Self::UntilErased,
        Self::Refuses,
        Self::Misreads,
        Self::Stuck,
    ];
}

/// State of an error-correcting code: the words that it reports as bad.
#[derive(Default)]
struct Code {
    /// Words whose programming or erase was interrupted.
    torn: BTreeSet<usize>,
    /// Words with flipped bits.
    flipped: BTreeSet<usize>,
}

type Listener = Box<dyn FnMut(Busy) + Send>;

/// Two slots in memory, with `WRITE` bytes to a word and `ERASE` to a block.
pub struct MockFlash<const WRITE: usize = 4, const ERASE: usize = 256> {
    memory: Vec<u8>,
    erases: Vec<u32>,
    /// Blocks whose erase was interrupted and that have not been erased since.
    weak: Vec<bool>,
    fuel: Option<u64>,
    spent: u64,
    cut_erase: CutErase,
    while_busy: WhileBusy,
    listener: Option<Listener>,
    programmed_weak: u32,
    refused: u32,
    /// Defective words.
    defects: BTreeMap<usize, Defect>,
    code: Option<Code>,
    in_place: RefCell<[Option<&'static [u8]>; 2]>,
}

impl<const WRITE: usize, const ERASE: usize> MockFlash<WRITE, ERASE> {
    /// Two blank slots of `blocks` blocks each, in a flash that does not affect a servo in RAM.
    #[must_use]
    pub fn new(blocks: usize) -> Self {
        Self {
            memory: vec![0xFF; 2 * blocks * ERASE],
            erases: vec![0; 2 * blocks],
            weak: vec![false; 2 * blocks],
            fuel: None,
            spent: 0,
            cut_erase: CutErase::Ascending,
            while_busy: WhileBusy::ServoInRam,
            listener: None,
            programmed_weak: 0,
            refused: 0,
            defects: BTreeMap::new(),
            code: None,
            in_place: RefCell::new([None; 2]),
        }
    }

    /// Sets how the servo keeps running.
    #[must_use]
    pub fn with_while_busy(mut self, while_busy: WhileBusy) -> Self {
        self.while_busy = while_busy;
        self
    }

    /// Adds an error-correcting code to each word: a word whose programming or erase was interrupted, or whose bits
    /// [flip](Self::flip), can no longer be read; reading it in place panics.
    #[must_use]
    pub fn with_code(mut self) -> Self {
        self.code = Some(Code::default());
        self
    }

    /// Sets a function that is called in the middle of every erase and program, where an interrupt would occur.
    pub fn set_listener(&mut self, listener: impl FnMut(Busy) + Send + 'static) {
        self.listener = Some(Box::new(listener));
    }

    /// Cuts the power after this many more bytes have been erased or programmed; the last byte is left in a state
    /// between old and new. `None`: unlimited power.
    pub fn set_fuel(&mut self, fuel: Option<u64>) {
        self.fuel = fuel;
    }

    /// Sets the state that interrupted erases leave.
    pub fn set_cut_erase(&mut self, cut_erase: CutErase) {
        self.cut_erase = cut_erase;
    }

    /// Bytes erased or programmed so far.
    #[must_use]
    pub fn spent(&self) -> u64 {
        self.spent
    }

    /// Completed erases of each block of a slot.
    #[must_use]
    pub fn erases(&self, slot: Slot) -> &[u32] {
        let blocks = self.erases.len() / 2;
        &self.erases[slot.index() * blocks..][..blocks]
    }

    /// Words that were programmed in a block whose last erase was interrupted: such cells are unreliable.
    #[must_use]
    pub fn programmed_weak(&self) -> u32 {
        self.programmed_weak
    }

    /// Operations that a NOR flash does not permit: words written twice, wrong addresses.
    #[must_use]
    pub fn refused(&self) -> u32 {
        self.refused
    }

    /// The word at this byte of a slot fails from now on.
    pub fn set_defect(&mut self, slot: Slot, byte: usize, defect: Defect) {
        let place = slot.index() * self.memory.len() / 2 + byte;
        self.defects.insert(place / WRITE, defect);
    }

    /// Flips one bit of a slot. With an error-correcting code, the word becomes unreadable, or readable again.
    pub fn flip(&mut self, slot: Slot, bit: usize) {
        let place = slot.index() * self.memory.len() / 2 + bit / 8;
        match &mut self.code {
            None => self.memory[place] ^= 1 << (bit % 8),
            Some(code) => {
                if !code.flipped.remove(&(place / WRITE)) {
                    code.flipped.insert(place / WRITE);
                }
            }
        }
        self.changed(place);
    }

    /// Whether any word of these bytes cannot be read.
    fn is_torn(&self, bytes: Range<usize>) -> bool {
        let words = bytes.start / WRITE..bytes.end.div_ceil(WRITE);
        let among = |set: &BTreeSet<usize>| set.range(words.clone()).next().is_some();
        let code = self.code.as_ref();
        code.is_some_and(|code| among(&code.torn) || among(&code.flipped))
    }

    /// Marks these words as interrupted, or as intact.
    fn tear(&mut self, words: Range<usize>, cut: bool) {
        if let Some(code) = &mut self.code {
            for word in words {
                code.flipped.remove(&word);
                if cut {
                    code.torn.insert(word);
                } else {
                    code.torn.remove(&word);
                }
            }
        }
    }

    /// All bytes of a slot, as they are.
    #[must_use]
    pub fn bytes(&self, slot: Slot) -> &[u8] {
        let length = self.memory.len() / 2;
        &self.memory[slot.index() * length..][..length]
    }

    /// Both slots, for arbitrary changes.
    pub fn image(&mut self) -> &mut [u8] {
        *self.in_place.get_mut() = [None; 2];
        &mut self.memory
    }

    fn changed(&mut self, place: usize) {
        let slot = 2 * place / self.memory.len();
        self.in_place.get_mut()[slot] = None;
    }

    /// Uses the fuel for one byte; returns false if it was the last.
    fn burn(&mut self) -> bool {
        self.spent += 1;
        match &mut self.fuel {
            None => true,
            Some(fuel) => {
                *fuel = fuel.saturating_sub(1);
                *fuel > 0
            }
        }
    }

    fn powered(&self) -> Result<(), MockError> {
        match self.fuel {
            Some(0) => Err(MockError::PowerCut),
            _ => Ok(()),
        }
    }

    fn allow(&mut self, place: Result<(), NorFlashErrorKind>) -> Result<(), MockError> {
        self.refused += u32::from(place.is_err());
        place.map_err(MockError::Place)
    }

    fn notify(&mut self, busy: Busy) {
        if let Some(listener) = &mut self.listener {
            listener(busy);
        }
    }

    fn erase_block(&mut self, block: usize) -> Result<(), MockError> {
        let bytes = block * ERASE..(block + 1) * ERASE;
        let words = bytes.start / WRITE..bytes.end / WRITE;
        let stuck: Vec<_> = (self.defects.range(words.clone()))
            .filter(|(_, defect)| **defect == Defect::Stuck)
            .map(|(word, _)| (word * WRITE, self.memory[word * WRITE..][..WRITE].to_vec()))
            .collect();
        self.changed(bytes.start);
        self.notify(Busy::Erase);
        self.weak[block] = true;
        for step in 0..ERASE {
            let place = match self.cut_erase {
                CutErase::Descending => bytes.end - 1 - step,
                CutErase::Ascending | CutErase::Scattered(_) => bytes.start + step,
            };
            if !self.burn() {
                self.half_erase(place, bytes);
                return Err(MockError::PowerCut);
            }
            if !matches!(self.cut_erase, CutErase::Scattered(_)) {
                self.memory[place] = 0xFF;
                // Its other bytes may still follow; until then it counts as interrupted.
                let word = place / WRITE;
                let whole = self.memory[word * WRITE..][..WRITE]
                    .iter()
                    .all(|b| *b == 0xFF);
                self.tear(word..word + 1, !whole);
            }
        }
        self.tear(bytes.start / WRITE..bytes.end / WRITE, false);
        self.memory[bytes].fill(0xFF);
        for (start, held) in stuck {
            self.memory[start..start + WRITE].copy_from_slice(&held);
        }
        self.defects
            .retain(|word, defect| *defect != Defect::UntilErased || !words.contains(word));
        self.weak[block] = false;
        self.erases[block] += 1;
        Ok(())
    }

    /// The power goes while `place` is being erased.
    fn half_erase(&mut self, place: usize, block: Range<usize>) {
        let CutErase::Scattered(seed) = self.cut_erase else {
            self.memory[place] |= 0x5A;
            self.tear(place / WRITE..place / WRITE + 1, true);
            return;
        };
        // SplitMix64.
        let mut state = seed ^ place as u64;
        let words = block.start / WRITE..block.end / WRITE;
        for byte in &mut self.memory[block] {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut bits = state;
            bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            *byte |= (bits >> 56) as u8;
        }
        for word in words {
            let bytes = &self.memory[word * WRITE..][..WRITE];
            let blank = bytes.iter().all(|byte| *byte == 0xFF);
            self.tear(word..word + 1, !blank);
        }
    }
}

impl<const WRITE: usize, const ERASE: usize> fmt::Debug for MockFlash<WRITE, ERASE> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MockFlash")
            .field("write", &WRITE)
            .field("erase", &ERASE)
            .field("bytes", &self.memory.len())
            .field("fuel", &self.fuel)
            .finish_non_exhaustive()
    }
}

impl<const WRITE: usize, const ERASE: usize> ErrorType for MockFlash<WRITE, ERASE> {
    type Error = MockError;
}

impl<const WRITE: usize, const ERASE: usize> ReadNorFlash for MockFlash<WRITE, ERASE> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), MockError> {
        check_read(self, offset, bytes.len()).map_err(MockError::Place)?;
        if self.is_torn(offset as usize..offset as usize + bytes.len()) {
            return Err(MockError::Torn);
        }
        bytes.copy_from_slice(&self.memory[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.memory.len()
    }
}

impl<const WRITE: usize, const ERASE: usize> NorFlash for MockFlash<WRITE, ERASE> {
    const WRITE_SIZE: usize = WRITE;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), MockError> {
        self.powered()?;
        let place = check_erase(self, from, to);
        self.allow(place)?;
        for block in from as usize / ERASE..to as usize / ERASE {
            self.erase_block(block)?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), MockError> {
        self.powered()?;
        let place = check_write(self, offset, bytes.len());
        self.allow(place)?;
        let offset = offset as usize;
        self.notify(Busy::Program);
        for (number, word) in bytes.chunks(WRITE).enumerate() {
            let start = offset + number * WRITE;
            self.changed(start);
            let blank = self.memory[start..start + WRITE].iter().all(|&b| b == 0xFF);
            if !blank || self.is_torn(start..start + WRITE) {
                self.refused += 1;
                return Err(MockError::NotBlank);
            }
            let defect = self.defects.get(&(start / WRITE)).copied();
            if matches!(defect, Some(Defect::UntilErased | Defect::Refuses)) {
                return Err(MockError::Defective);
            }
            if self.weak[start / ERASE] {
                self.programmed_weak += 1;
            }
            for (place, &byte) in (start..).zip(word) {
                if !self.burn() {
                    self.memory[place] &= byte | 0xA5;
                    self.tear(start / WRITE..start / WRITE + 1, true);
                    return Err(MockError::PowerCut);
                }
                self.memory[place] &= match defect {
                    Some(Defect::Stuck) => 0xFF,
                    Some(Defect::Misreads) => byte | 0x11,
                    _ => byte,
                };
            }
        }
        Ok(())
    }
}

impl<const WRITE: usize, const ERASE: usize> TableFlash for MockFlash<WRITE, ERASE> {
    fn range(&self, slot: Slot) -> Range<u32> {
        let length = self.memory.len() / 2;
        let start = slot.index() * length;
        start as u32..(start + length) as u32
    }

    /// A copy that never changes and is never freed.
    ///
    /// # Panics
    /// If one of these bytes cannot be read; on a target that would be a bus fault.
    fn in_place(&self, slot: Slot, length: u32) -> Mapped {
        let start = slot.index() * self.memory.len() / 2;
        let end = start + length as usize;
        assert!(!self.is_torn(start..end), "a torn word is read in place");
        let copies = &mut self.in_place.borrow_mut()[slot.index()];
        let copy: &'static [u8] = copies.get_or_insert_with(|| aligned(self.bytes(slot)));
        Mapped::constant(&copy[..length as usize])
    }

    fn while_busy(&self) -> WhileBusy {
        self.while_busy
    }
}

impl<const WRITE: usize, const ERASE: usize> Slots<MockFlash<WRITE, ERASE>> {
    /// Returns the flash. Leased bytes are copies and stay unchanged.
    #[must_use]
    pub fn close(self) -> MockFlash<WRITE, ERASE> {
        self.into_flash()
    }
}

/// Copies of everything read in place; equal bytes share one copy.
static COPIES: Mutex<BTreeSet<&'static [u8]>> = Mutex::new(BTreeSet::new());

/// A copy at a multiple of 32 bytes, never freed.
fn aligned(bytes: &[u8]) -> &'static [u8] {
    let mut copies = COPIES.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(copy) = copies.get(bytes) {
        return copy;
    }
    let copy = vec![0; bytes.len() + 32].leak();
    let skip = copy.as_ptr().align_offset(32);
    let (_, rest) = copy.split_at_mut(skip);
    let (copy, _) = rest.split_at_mut(bytes.len());
    copy.copy_from_slice(bytes);
    copies.insert(copy);
    copy
}
