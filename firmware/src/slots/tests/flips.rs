//! Single bit flips.

use super::*;
use crate::mock_flash::MockFlash;
use crate::slots::{Damage, SlotState};

#[test]
fn every_flip_in_a_small_blob_or_behind_it_is_found() {
    let blobs = blobs(2, 40);
    let mut slots = Slots::open(MockFlash::<4, 128>::new(8));
    let slot = fill(&mut slots, [&blobs[0]]);
    assert_eq!(upload(&mut slots, &blobs[1], 64), slot.other());
    let newest = slot.other();
    let mut flash = slots.close();
    let length = flash.bytes(newest).len();
    let capacity = length - 128;
    let filling = blobs[1].len()..capacity;
    assert!(!filling.is_empty());
    for bit in 0..8 * length {
        flash.flip(newest, bit);
        let mut slots = Slots::open(flash);
        if filling.contains(&(bit / 8)) {
            // Belongs to nothing.
            assert!(slots.state(newest).is_valid());
            assert_eq!(slots.blob(newest), Some(&*blobs[1]));
        } else {
            match slots.state(newest) {
                SlotState::Damaged(Damage::Blob(_)) => assert!(bit / 8 < blobs[1].len()),
                SlotState::Damaged(Damage::Record | Damage::Commit) | SlotState::Erasing => {
                    assert!(bit / 8 >= capacity);
                }
                state => panic!("bit {bit}: {state:?}"),
            }
            assert_eq!(slots.blob(newest), None);
            let (found, bytes) = start(&mut slots).expect("the fallback");
            assert_eq!((found, bytes), (slot, &*blobs[0]));
        }
        flash = slots.close();
        flash.flip(newest, bit);
    }
    // Without the flip, the newest is back.
    assert_eq!(Slots::open(flash).newest(), Some(newest));
}

#[test]
fn where_numbers_begin_again_beside_one_that_cannot_be_read_a_start_goes_by_the_choice() {
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<4, 128>::new(8));
    for (blob, slot) in blobs.iter().zip([Slot::A, Slot::B]) {
        assert_eq!(upload(&mut slots, blob, 64), slot);
        slots.set_active(Some(slot));
    }
    // Bits flip in the blob of one slot and in the mark of the other: neither is valid.
    let mark = 8 * (slots.flash().bytes(Slot::B).len() - 64);
    let mut flash = slots.close();
    flash.flip(Slot::A, 800);
    flash.flip(Slot::B, mark);
    let mut slots = Slots::open(flash);
    assert_eq!(start(&mut slots), None);
    assert_eq!(upload(&mut slots, &blobs[2], 64), Slot::A);
    assert!(matches!(
        slots.state(Slot::A),
        SlotState::Valid { sequence: 1, .. }
    ));
    // The bit in the mark flips back.
    let mut flash = slots.close();
    flash.flip(Slot::B, mark);
    let mut slots = Slots::open(flash);
    assert_eq!(slots.newest(), Some(Slot::B));
    assert_eq!(start(&mut slots), Some((Slot::A, &*blobs[2])));
}

#[test]
fn sampled_flips_in_a_large_blob_are_found() {
    let large = large_blob();
    let mut slots = Slots::open(MockFlash::<4, { 128 * 1024 }>::new(1));
    let slot = upload(&mut slots, &large, 4096);
    let mut flash = slots.close();
    // A prime step reaches every bit position and both ends of the blob.
    let last = 8 * large.len() - 1;
    for bit in (0..last).step_by(2503).chain([last]) {
        flash.flip(slot, bit);
        let slots = Slots::open(flash);
        assert!(
            matches!(slots.state(slot), SlotState::Damaged(Damage::Blob(_))),
            "bit {bit}"
        );
        assert_eq!(slots.newest(), None);
        flash = slots.close();
        flash.flip(slot, bit);
    }
    assert_eq!(Slots::open(flash).newest(), Some(slot));
}

#[test]
fn a_damaged_newest_that_recovers_does_not_win_over_what_came_later() {
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<4, 768>::new(1));
    fill(&mut slots, &blobs[..2]);
    let damaged = slots.newest().expect("two blobs");
    let mut flash = slots.close();
    flash.flip(damaged, 8 * 100);
    let mut slots = Slots::open(flash);
    // The servo still reads it, so the upload replaces the older one.
    slots.set_active(Some(damaged));
    let slot = upload(&mut slots, &blobs[2], 64);
    assert_eq!(slot, damaged.other());
    let mut flash = slots.close();
    flash.flip(damaged, 8 * 100);
    let slots = Slots::open(flash);
    assert_eq!(
        (slots.in_use(), slots.before(), slots.newest()),
        (Some(slot), None, Some(slot))
    );
    assert_eq!(slots.waiting(), Some(damaged));
}

#[test]
fn a_word_that_cannot_be_read_is_an_answer_wherever_it_is() {
    let blobs = blobs(2, 40);
    let mut slots = Slots::open(MockFlash::<16, 128>::new(8).with_code());
    let old = fill(&mut slots, [&blobs[0]]);
    let newest = upload(&mut slots, &blobs[1], 64);
    let mut flash = slots.close();
    let length = flash.bytes(newest).len();
    let blob = blobs[1].len().next_multiple_of(32);
    for word in (0..length).step_by(16) {
        flash.flip(newest, 8 * word);
        let mut slots = Slots::open(flash);
        let expected = match word {
            // To the end of its last line.
            _ if word < blob => SlotState::Damaged(Damage::Unreadable),
            _ if word < length - 128 => slots.state(newest),
            _ if word < length - 64 => SlotState::Damaged(Damage::Record),
            _ if word < length - 32 => SlotState::Erasing,
            _ => SlotState::Damaged(Damage::Commit),
        };
        assert_eq!(slots.state(newest), expected, "word at {word}");
        let valid = (blob..length - 128).contains(&word);
        assert_eq!(slots.state(newest).is_valid(), valid, "word at {word}");
        // Which of the two a start uses, without looking at bytes that cannot be read in place.
        let taken = if valid { newest } else { old };
        assert_eq!(start(&mut slots).map(|found| found.0), Some(taken));
        flash = slots.close();
        flash.flip(newest, 8 * word);
    }
}

#[test]
fn an_upload_goes_through_whichever_word_in_its_way_cannot_be_read() {
    let blobs = blobs(2, 40);
    for word in (0..8 * 128).step_by(16) {
        let mut slots = Slots::open(MockFlash::<16, 128>::new(8).with_code());
        erased(&mut slots, &blobs[0]);
        slots.write(0, &blobs[0][..100]).expect("power");
        let mut flash = slots.close();
        flash.flip(Slot::A, 8 * word);
        // The same upload continues and erases only where necessary; so does another one.
        let mut slots = Slots::open(flash);
        let slot = upload(&mut slots, &blobs[0], 64);
        assert_eq!(slots.blob(slot), Some(&*blobs[0]), "word at {word}");
        let slot = upload(&mut slots, &blobs[1], 64);
        assert_eq!(
            start(&mut slots),
            Some((slot, &*blobs[1])),
            "word at {word}"
        );
        assert_eq!(slots.flash().refused(), 0);
    }
}

#[test]
fn what_came_before_and_cannot_be_read_again_is_no_conflict_but_a_fault() {
    let blob = blob(1, 40);
    let mut slots = Slots::open(MockFlash::<16, 128>::new(8).with_code());
    erased(&mut slots, &blob);
    slots.write(0, &blob[..100]).expect("power");
    slots.flash.flip(Slot::A, 8 * 40);
    assert_eq!(slots.write(0, &blob[..20]), Ok(100));
    let unreadable = Err(SlotError::Readback { offset: 35 });
    assert_eq!(slots.write(35, &blob[35..60]), unreadable);
    // Nor is it committed.
    slots.flash.flip(Slot::A, 8 * 40);
    slots.write(100, &blob[100..]).expect("power");
    slots.flash.flip(Slot::A, 8 * 40);
    let refused = slots.commit(|_| panic!("it is read in place"));
    assert_eq!(refused, Err(SlotError::Readback { offset: 32 }));
}

#[test]
#[should_panic(expected = "a torn word is read in place")]
fn the_mock_notices_a_torn_word_that_is_read_in_place() {
    let mut flash = MockFlash::<16, 128>::new(8).with_code();
    flash.flip(Slot::B, 8 * 100);
    assert_eq!(flash.read_in_place(Slot::B, 96).len(), 96);
    assert_eq!(flash.read_in_place(Slot::A, 128).len(), 128);
    let _ = flash.read_in_place(Slot::B, 97);
}
