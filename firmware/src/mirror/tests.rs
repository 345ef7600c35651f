use std::boxed::Box;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::rc::Rc;
use std::vec::Vec;

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};

use super::*;

/// Length of a slot, and of a block, in bytes.
const SLOT: usize = 2048;
const BLOCK: usize = 1024;

/// Two slots starting at address 4096, with an error-correcting code for each word.
#[derive(Clone, Default)]
struct Chip {
    bytes: Rc<RefCell<Vec<u8>>>,
    /// Indices of words whose code reports an error.
    torn: Rc<RefCell<BTreeSet<usize>>>,
    /// Number of words that can be programmed before power is lost.
    power: Rc<Cell<Option<usize>>>,
}

const START: u32 = 4096;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Unreadable;

impl NorFlashError for Unreadable {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Chip {
    type Error = Unreadable;
}

impl ReadNorFlash for Chip {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Unreadable> {
        let at = (offset - START) as usize;
        let words = at / WORD..(at + bytes.len()).div_ceil(WORD);
        if self.torn.borrow().range(words).next().is_some() {
            // Left over from an aborted transfer.
            bytes.fill(0x55);
            return Err(Unreadable);
        }
        bytes.copy_from_slice(&self.bytes.borrow()[at..at + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        START as usize + 2 * SLOT
    }
}

impl NorFlash for Chip {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = BLOCK;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Unreadable> {
        let [from, to] = [from, to].map(|address| (address - START) as usize);
        self.bytes.borrow_mut()[from..to].fill(0xFF);
        self.torn
            .borrow_mut()
            .retain(|w| !(from..to).contains(&(w * WORD)));
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Unreadable> {
        for (number, word) in bytes.chunks(WORD).enumerate() {
            let at = (offset - START) as usize + number * WORD;
            if self.power.get() == Some(number) {
                self.torn.borrow_mut().insert(at / WORD);
                return Err(Unreadable);
            }
            self.bytes.borrow_mut()[at..at + WORD].copy_from_slice(word);
        }
        Ok(())
    }
}

/// A chip whose bytes are roughly their own addresses, and its mirror.
fn mirrored() -> (Chip, Mirrored<Chip, SLOT>) {
    let chip = Chip::default();
    *chip.bytes.borrow_mut() = (0..2 * SLOT).map(|at| (at % 251) as u8).collect();
    (chip.clone(), open(&chip))
}

fn open(chip: &Chip) -> Mirrored<Chip, SLOT> {
    let memory = Box::leak(Box::new(Memory::new()));
    let starts = [START, START + SLOT as u32];
    Mirrored::open(chip.clone(), starts, WhileBusy::DualBank, memory)
}

/// Whether both slots in memory equal the contents of the flash, with zeros for unreadable words.
fn agrees(chip: &Chip, mirrored: &Mirrored<Chip, SLOT>) -> bool {
    let mut bytes = chip.bytes.borrow().clone();
    for word in chip.torn.borrow().iter() {
        bytes[word * WORD..][..WORD].fill(0);
    }
    let [a, b] = Slot::BOTH.map(|slot| mirrored.read_in_place(slot, SLOT as u32));
    bytes == [a, b].concat()
}

#[test]
fn at_start_both_slots_are_copied() {
    let (chip, mirrored) = mirrored();
    assert!(agrees(&chip, &mirrored));
    assert_eq!(mirrored.range(Slot::A), START..START + 2048);
    assert_eq!(mirrored.range(Slot::B), START + 2048..START + 4096);
    assert_eq!(mirrored.while_busy(), WhileBusy::DualBank);
    assert_eq!(mirrored.capacity(), START as usize + 2 * SLOT);
    for slot in Slot::BOTH {
        assert_eq!(mirrored.read_in_place(slot, 1).as_ptr().addr() % 32, 0);
        assert_eq!(mirrored.read_in_place(slot, 100).len(), 100);
        assert!(mirrored.read_in_place(slot, SLOT as u32 + 1).is_empty());
    }
}

#[test]
fn what_is_erased_and_written_is_copied_and_nothing_else_changes() {
    let (chip, mut mirrored) = mirrored();
    let b = START + SLOT as u32;
    mirrored.erase(b, b + BLOCK as u32).unwrap();
    assert!(agrees(&chip, &mirrored));
    assert!(
        mirrored
            .read_in_place(Slot::B, BLOCK as u32)
            .iter()
            .all(|byte| *byte == 0xFF)
    );
    mirrored.write(b + 64, &[7; 96]).unwrap();
    assert!(agrees(&chip, &mirrored));
    assert_eq!(mirrored.read_in_place(Slot::B, 160)[64..], [7; 96]);
    mirrored
        .erase(START + BLOCK as u32, START + SLOT as u32)
        .unwrap();
    mirrored.write(START + SLOT as u32 - 32, &[9; 32]).unwrap();
    assert!(agrees(&chip, &mirrored));
    let mut bytes = [0; 32];
    mirrored.read(START + SLOT as u32 - 32, &mut bytes).unwrap();
    assert_eq!(bytes, [9; 32]);
}

#[test]
fn what_is_written_across_the_border_of_the_slots_is_copied_into_both() {
    let (chip, mut mirrored) = mirrored();
    let b = START + SLOT as u32;
    mirrored.erase(b - BLOCK as u32, b + BLOCK as u32).unwrap();
    assert!(agrees(&chip, &mirrored));
    mirrored.write(b - 64, &[7; 160]).unwrap();
    assert!(agrees(&chip, &mirrored));
    assert_eq!(
        mirrored.read_in_place(Slot::A, SLOT as u32)[SLOT - 64..],
        [7; 64]
    );
    assert_eq!(mirrored.read_in_place(Slot::B, 96), [7; 96]);
}

#[test]
fn slots_that_lie_apart_in_any_order_get_what_is_theirs() {
    let (chip, _) = mirrored();
    let memory = Box::leak(Box::new(Memory::new()));
    // B before A, with a gap: the last and the first half of the chip's first and last kilobytes.
    let starts = [START + 3072, START];
    chip.bytes.borrow_mut().resize(3072 + SLOT, 0);
    let mut mirrored = Mirrored::<_, SLOT>::open(chip.clone(), starts, WhileBusy::DualBank, memory);
    let agree = |mirrored: &Mirrored<Chip, SLOT>| {
        let bytes = chip.bytes.borrow();
        let [a, b] = Slot::BOTH.map(|slot| mirrored.read_in_place(slot, SLOT as u32));
        a == &bytes[3072..] && b == &bytes[..SLOT]
    };
    assert!(agree(&mirrored));
    // The end of B, the gap, and the start of A; then a range outside both.
    mirrored.write(START + 1984, &[7; 1184]).unwrap();
    assert!(agree(&mirrored));
    mirrored.write(START + SLOT as u32, &[9; 1024]).unwrap();
    assert!(agree(&mirrored));
}

#[test]
fn no_more_is_read_than_what_has_changed() {
    let (chip, mut mirrored) = mirrored();
    // To the end of the chip, beyond which nothing can be read.
    let from = START + 2 * SLOT as u32 - (PIECE + WORD) as u32;
    mirrored
        .erase(START + SLOT as u32, START + 2 * SLOT as u32)
        .unwrap();
    mirrored.write(from, &[7; PIECE + WORD]).unwrap();
    assert!(agrees(&chip, &mirrored));
}

#[test]
fn a_torn_word_is_zeros_in_memory_and_an_error_of_a_read() {
    let (chip, _) = mirrored();
    // The first word, the last of a piece, the last of all.
    chip.torn.borrow_mut().extend([0, 31, 2 * SLOT / WORD - 1]);
    let mut mirrored = open(&chip);
    assert!(agrees(&chip, &mirrored));
    assert_eq!(mirrored.read(START, &mut [0; 32]), Err(Unreadable));
    assert_eq!(mirrored.read(START + 32, &mut [0; 32]), Ok(()));
}

#[test]
fn a_write_that_is_cut_short_is_copied_as_far_as_it_came() {
    let (chip, mut mirrored) = mirrored();
    mirrored.erase(START, START + BLOCK as u32).unwrap();
    chip.power.set(Some(1));
    assert_eq!(mirrored.write(START, &[3; 96]), Err(Unreadable));
    assert!(agrees(&chip, &mirrored));
    let slot = mirrored.read_in_place(Slot::A, SLOT as u32);
    assert_eq!((slot[31], slot[32], slot[64]), (3, 0, 0xFF));
}

#[test]
fn the_flash_is_given_back() {
    let (chip, mirrored) = mirrored();
    let mut flash = mirrored.close();
    flash.erase(START, START + 2 * SLOT as u32).unwrap();
    assert_eq!(chip.bytes.borrow()[SLOT], 0xFF);
}
