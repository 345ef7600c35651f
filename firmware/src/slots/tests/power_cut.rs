//! Power loss at every byte.

use std::format;

use super::*;
use crate::mock_flash::{CutErase, MockFlash};

/// A → B → A, each made active as a device does, until power is lost. Returns the number of acknowledged uploads.
fn cycle<const W: usize, const E: usize>(
    slots: &mut Slots<MockFlash<W, E>>,
    blobs: &[AlignedBlob],
    done: usize,
) -> usize {
    for (number, blob) in blobs.iter().enumerate().skip(done) {
        match attempt(slots, blob, 37) {
            Ok(slot) => slots.set_active(Some(slot)),
            Err(_) => return number,
        }
    }
    blobs.len()
}

/// Uploads three blobs, with a cut after each byte that is erased or programmed.
fn cut_everywhere<const W: usize, const E: usize>(blocks: usize) {
    for cut_erase in CUTS {
        for code in [false, true] {
            cut_with::<W, E>(blocks, cut_erase, code);
        }
    }
}

/// Like `cut_everywhere`, on flash with or without an error-correcting code.
fn cut_with<const W: usize, const E: usize>(blocks: usize, cut_erase: CutErase, code: bool) {
    let flash = || {
        let flash = MockFlash::<W, E>::new(blocks);
        if code { flash.with_code() } else { flash }
    };
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<W, E>::new(blocks));
    assert!(
        blobs
            .iter()
            .all(|blob| blob.len() <= slots.capacity() as usize)
    );
    assert_eq!(cycle(&mut slots, &blobs, 0), 3);
    let all = slots.close().spent();
    let (mut before, mut behind) = (0, 0);
    for fuel in 1..=all {
        let case = format!(
            "{W}-byte words, {E}-byte blocks, {cut_erase:?}, code: {code}, cut after {fuel}"
        );
        let mut flash = flash();
        flash.set_cut_erase(cut_erase);
        flash.set_fuel(Some(fuel));
        let mut slots = Slots::open(flash);
        let done = cycle(&mut slots, &blobs, 0);
        // The last choice counts as soon as its first half is written.
        assert!(done < 3 || fuel + 32 >= all, "{case}");

        let mut flash = slots.close();
        flash.set_fuel(None);
        let mut slots = Slots::open(flash);
        // In use is the last acknowledged blob, or the one whose choice was interrupted after enough of it was written.
        let active = start(&mut slots);
        let kept = match active {
            None => {
                before += 1;
                assert_eq!(done, 0, "{case}");
                0
            }
            Some((_, bytes)) => {
                assert_eq!(loads(bytes), Ok(()), "{case}");
                let kept = 1 + blobs.iter().position(|b| **b == *bytes).expect(&case);
                assert!(kept == done || kept == done + 1, "{case}");
                behind += 1;
                kept
            }
        };
        // The one before it is still there, unless it had to make room.
        if kept > done && kept > 1 {
            let fallback = slots.before().and_then(|slot| slots.blob(slot));
            assert_eq!(fallback, Some(&*blobs[kept - 2]), "{case}");
        }
        // And everything continues from there.
        for blob in &blobs[kept..] {
            let slot = upload(&mut slots, blob, 50);
            slots.set_active(Some(slot));
            assert_eq!(slots.blob(slot), Some(&**blob), "{case}");
        }
        // Each completed erase of the last block is counted, except those whose record was interrupted.
        for slot in Slot::BOTH {
            let erases = *slots.flash().erases(slot).last().expect("a block");
            let wear = slots.wear(slot);
            assert!(
                wear == erases || wear + 1 == erases,
                "{case}: {wear} of {erases}"
            );
        }
        let flash = slots.close();
        assert_eq!(flash.programmed_weak(), 0, "{case}");
        assert_eq!(flash.refused(), 0, "{case}");
    }
    // Cuts before the first commit, and after it.
    assert!(before > 0 && behind > 0, "{before} {behind}");
}

const CUTS: [CutErase; 4] = [
    CutErase::Ascending,
    CutErase::Descending,
    CutErase::Scattered(1),
    CutErase::Scattered(2),
];

#[test]
fn a_cut_at_any_byte_leaves_one_complete_blob_bytes() {
    cut_everywhere::<1, 128>(5);
}

#[test]
fn a_cut_at_any_byte_leaves_one_complete_blob_words() {
    cut_everywhere::<4, 64>(10);
}

#[test]
fn a_cut_at_any_byte_leaves_one_complete_blob_double_words() {
    cut_everywhere::<8, 512>(2);
}

#[test]
fn a_cut_at_any_byte_leaves_one_complete_blob_flash_words_of_32() {
    cut_everywhere::<32, 32>(20);
}

#[test]
fn a_cut_at_any_byte_leaves_one_complete_blob_one_block_per_slot() {
    cut_everywhere::<16, 640>(1);
}

#[test]
fn a_cut_after_a_restart_too() {
    // The second upload is cut at every seventh byte, and so is its continuation.
    let blobs = blobs(2, 40);
    for fuel in (1..1600).step_by(9) {
        for again in (1..1600).step_by(41) {
            let mut flash = MockFlash::<8, 128>::new(5);
            if fuel % 2 == 0 {
                flash = flash.with_code();
            }
            flash.set_cut_erase(CutErase::Scattered(fuel));
            let mut slots = Slots::open(flash);
            let slot = upload(&mut slots, &blobs[0], 64);
            let mut flash = slots.close();
            for fuel in [fuel, again] {
                flash.set_fuel(Some(fuel));
                slots = Slots::open(flash);
                slots.set_active(Some(slot));
                let _ = attempt(&mut slots, &blobs[1], 64);
                flash = slots.close();
                flash.set_fuel(None);
                slots = Slots::open(flash);
                let (used, bytes) = start(&mut slots).expect("never without a blob");
                assert!(*bytes == *blobs[usize::from(used != slot)]);
                flash = slots.close();
            }
            assert_eq!(flash.programmed_weak(), 0);
            assert_eq!(flash.refused(), 0);
        }
    }
}
