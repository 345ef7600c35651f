//! Words that cannot be programmed, or do not retain what was written.

use super::*;
use crate::mock_flash::{CutErase, Defect, MockFlash};

/// A host's attempts at one upload.
const ATTEMPTS: usize = 5;

/// An upload as a host does it; returns the number of attempts, or the last error.
fn insist<F: TableFlash>(slots: &mut Slots<F>, blob: &[u8]) -> Result<(Slot, usize), SlotError> {
    let mut last = Err(SlotError::LogicBug);
    for number in 1..=ATTEMPTS {
        last = attempt(slots, blob, 50).map(|slot| (slot, number));
        if matches!(last, Ok(_) | Err(SlotError::Unusable { .. })) {
            break;
        }
    }
    last
}

#[test]
fn a_word_that_reads_blank_and_refuses_programming_is_mended_by_an_erase() {
    let blobs = blobs(3, 40);
    for byte in (0..8 * 128).step_by(8) {
        let mut slots = Slots::open(MockFlash::<8, 128>::new(8));
        fill(&mut slots, &blobs[..2]);
        let mut flash = slots.close();
        flash.set_defect(Slot::A, byte, Defect::UntilErased);
        let mut slots = Slots::open(flash);
        assert_eq!(start(&mut slots).expect("in use").0, Slot::B);
        let (_, attempts) = insist(&mut slots, &blobs[2]).expect("an erase mends it");
        assert!(attempts <= 2, "byte {byte}: {attempts} attempts");
        // No errors from here on.
        for number in 0..10 {
            let used = slots.in_use();
            slots.set_active(used);
            assert!(attempt(&mut slots, &blobs[number % 2], 50).is_ok());
        }
        assert_eq!(slots.flash().programmed_weak(), 0);
    }
}

#[test]
fn a_block_is_unusable_once_it_fails_again_and_stays_so() {
    let mut slots = Slots::open(MockFlash::<8, 128>::new(8));
    let mut fails = |block: u32| {
        let offset = block * 128 + 8;
        slots.failed(Slot::A, offset, SlotError::Readback { offset })
    };
    let unusable = |block| SlotError::Unusable {
        slot: Slot::A,
        block,
    };
    assert_eq!(fails(2), SlotError::Readback { offset: 264 });
    // A different word: the erase between them may have repaired the first.
    assert_eq!(fails(5), SlotError::Readback { offset: 648 });
    assert_eq!(fails(5), unusable(5));
    assert_eq!(fails(3), unusable(5));
}

/// Two uploads, then a defect in the slot of the next one, which is returned.
fn with_defect<const W: usize, const E: usize>(
    blocks: usize,
    blobs: &[AlignedBlob],
    byte: usize,
    defect: Defect,
) -> MockFlash<W, E> {
    let mut slots = Slots::open(MockFlash::<W, E>::new(blocks));
    fill(&mut slots, &blobs[..2]);
    let mut flash = slots.close();
    flash.set_defect(Slot::A, byte, defect);
    flash
}

/// Uploads a blob into slot A; if that fails, the compensation previously in use must still be there.
fn goes_through_or_names_the_block<const W: usize, const E: usize>(
    flash: MockFlash<W, E>,
    blobs: &[AlignedBlob],
    byte: usize,
    case: &str,
) -> MockFlash<W, E> {
    let mut slots = Slots::open(flash);
    let (used, bytes) = start(&mut slots).expect(case);
    let next = if *bytes == *blobs[2] {
        &blobs[0]
    } else {
        &blobs[2]
    };
    let before = bytes.to_vec();
    match insist(&mut slots, next) {
        Ok((slot, attempts)) => {
            assert!(attempts <= 2, "{case}: {attempts} attempts");
            assert_eq!(slots.blob(slot), Some(&**next), "{case}");
            assert_eq!(slots.in_use(), Some(slot), "{case}");
        }
        Err(SlotError::Unusable { slot, block }) => {
            assert_eq!((slot, block as usize), (Slot::A, byte / E), "{case}");
            assert_eq!(slots.blob(used), Some(&*before), "{case}");
            assert_eq!(slots.in_use(), Some(used), "{case}");
            let spent = slots.flash().spent();
            let again = attempt(&mut slots, next, 50);
            // Slot A is not tried again; if it is in use, only its choices have failed.
            if used == Slot::B {
                assert_eq!(again, Err(SlotError::Unusable { slot, block }), "{case}");
                assert_eq!(slots.flash().spent(), spent, "{case}");
            }
        }
        Err(error) => panic!("{case}: {error}"),
    }
    let flash = slots.close();
    assert_eq!(flash.programmed_weak(), 0, "{case}");
    assert_eq!(flash.refused(), 0, "{case}");
    flash
}

#[test]
fn a_block_that_stays_bad_is_named_after_one_erase_of_the_whole_slot() {
    let blobs = blobs(3, 40);
    let mut named = 0;
    for defect in Defect::ALL {
        for byte in (0..1024).step_by(8) {
            let case = std::format!("{defect:?} at {byte}");
            let flash = with_defect::<8, 128>(8, &blobs, byte, defect);
            let before: u32 = flash.erases(Slot::A).iter().sum();
            let flash = goes_through_or_names_the_block(flash, &blobs, byte, &case);
            let erases = flash.erases(Slot::A).iter().sum::<u32>() - before;
            assert!(erases <= 16, "{case}: {erases}");
            if defect == Defect::UntilErased {
                continue;
            }
            let failing = Slots::open(flash).state(Slot::A);
            named += u32::from(!failing.is_valid());
        }
    }
    assert!(named > 50, "{named}");
}

#[test]
fn with_a_bad_word_the_power_may_go_at_any_byte() {
    let blobs = blobs(3, 40);
    fn run<const W: usize, const E: usize>(blocks: usize, blobs: &[AlignedBlob]) {
        let words = (0..blocks * E).step_by(W.max(16));
        for (number, byte) in words.enumerate() {
            let defect = Defect::ALL[number % 4];
            for fuel in (1 + number as u64 % 7..2400).step_by(23) {
                let case = std::format!("{W}, {E}, {defect:?} at {byte}, cut after {fuel}");
                let mut flash = with_defect::<W, E>(blocks, blobs, byte, defect);
                flash.set_cut_erase(match fuel % 3 {
                    0 => CutErase::Ascending,
                    1 => CutErase::Descending,
                    _ => CutErase::Scattered(fuel),
                });
                flash.set_fuel(Some(fuel));
                let mut slots = Slots::open(flash);
                start(&mut slots).expect(&case);
                let _ = insist(&mut slots, &blobs[2]);
                let mut flash = slots.close();
                flash.set_fuel(None);
                goes_through_or_names_the_block(flash, blobs, byte, &case);
            }
        }
    }
    run::<4, 128>(6, &blobs);
    run::<8, 128>(6, &blobs);
    run::<32, 64>(10, &blobs);
    run::<16, 768>(1, &blobs);
}
