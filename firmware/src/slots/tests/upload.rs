//! Uploads step by step.

use std::boxed::Box;

use super::*;
use crate::mirror::{Memory, Mirrored};
use crate::mock_flash::{Defect, MockFlash};
use crate::slots::{Damage, Health, SlotState, WhileBusy};

type Small = Slots<MockFlash<8, 128>>;

/// Erased and ready for the first byte.
fn begun(blob: &[u8]) -> Small {
    let mut slots = Slots::open(MockFlash::new(6));
    erased(&mut slots, blob);
    slots
}

#[test]
fn each_step_shows() {
    let blob = blob(1, 40);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    assert_eq!(slots.capacity(), 768 - 384);
    assert_eq!(slots.state(Slot::A), SlotState::Blank);
    assert_eq!((slots.newest(), slots.upload()), (None, None));
    for done in 0..6 {
        let progress = Progress::Erasing { done, blocks: 6 };
        assert_eq!(slots.begin(length, crc), Ok(progress));
        assert_eq!(slots.state(Slot::A), SlotState::Erasing);
        assert_eq!(slots.write(0, &blob[..8]), Err(SlotError::Erasing));
        assert_eq!(slots.commit(|_| true), Err(SlotError::Erasing));
        slots.erase_step().expect("power");
        assert_eq!(slots.flash().erases(Slot::A).iter().sum::<u32>(), done + 1);
    }
    // Extra steps do nothing.
    assert_eq!(slots.erase_step(), Ok(Progress::Receiving { next: 0 }));
    assert_eq!(slots.flash().erases(Slot::A), [1; 6]);
    assert_eq!(slots.write(0, &blob[..13]), Ok(13));
    let received = |received| SlotState::Uploading {
        received,
        length,
        crc,
    };
    assert_eq!(slots.state(Slot::A), received(13));
    assert_eq!(
        slots.begin(length, crc),
        Ok(Progress::Receiving { next: 13 })
    );
    assert_eq!(
        slots.commit(|_| true),
        Err(SlotError::Incomplete { expected: 13 })
    );
    assert_eq!(slots.write(13, &blob[13..]), Ok(length));
    let uploaded = slots.commit(|bytes| bytes == &*blob);
    assert_eq!(uploaded, Ok(Slot::A));
    let valid = SlotState::Valid {
        sequence: 1,
        length,
        crc,
    };
    assert_eq!((slots.state(Slot::A), slots.upload()), (valid, None));
    assert_eq!(slots.wear(Slot::A), 1);
    assert_eq!(slots.blob(Slot::A), Some(&*blob));
    assert_eq!(slots.commit(|_| true), Err(SlotError::NoUpload));
}

#[test]
fn chunks_may_come_twice_and_overlap() {
    let blob = blob(1, 40);
    let mut slots = begun(&blob);
    let (mut at, mut size) = (0, 1);
    while at < blob.len() {
        let end = blob.len().min(at + size);
        // Starting somewhere before the first missing byte.
        let from = at.saturating_sub(size * 3 % 17);
        for _ in 0..2 {
            assert_eq!(slots.write(from as u32, &blob[from..end]), Ok(end as u32));
        }
        at = end;
        size = size * 5 % 23 + 1;
    }
    assert_eq!(slots.write(5, &[]), Ok(blob.len() as u32));
    assert_eq!(slots.commit(|_| true), Ok(Slot::A));
    assert_eq!(slots.flash().refused(), 0);
}

#[test]
fn a_gap_names_what_is_missing_and_a_change_its_place() {
    let blob = blob(1, 40);
    let length = blob.len() as u32;
    let mut slots = begun(&blob);
    assert_eq!(
        slots.write(20, &blob[20..40]),
        Err(SlotError::Gap { expected: 0 })
    );
    assert_eq!(slots.write(0, &blob[..20]), Ok(20));
    assert_eq!(
        slots.write(21, &blob[21..40]),
        Err(SlotError::Gap { expected: 20 })
    );
    // Byte 3 is in the flash, byte 18 is waiting for its word.
    for offset in [3, 18] {
        let mut changed = blob.to_vec();
        changed[offset] ^= 1;
        let conflict = Err(SlotError::Conflict {
            offset: offset as u32,
        });
        assert_eq!(slots.write(0, &changed[..30]), conflict);
    }
    assert_eq!(
        slots.write(length - 1, &[0; 2]),
        Err(SlotError::Beyond { length })
    );
    assert_eq!(
        slots.write(u32::MAX, &[0; 2]),
        Err(SlotError::Beyond { length })
    );
    assert_eq!(slots.write(20, &blob[20..]), Ok(length));
    assert_eq!(slots.commit(|_| true), Ok(Slot::A));
}

#[test]
fn lengths_that_no_slot_holds_are_refused() {
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    for length in [16, 384] {
        assert!(Small::open(MockFlash::new(6)).begin(length, 1).is_ok());
    }
    for length in [0, 15, 385, u32::MAX] {
        assert_eq!(
            slots.begin(length, 1),
            Err(SlotError::Length { capacity: 384 })
        );
    }
    assert_eq!(slots.erase_step(), Err(SlotError::NoUpload));
    assert_eq!(slots.write(0, &[1]), Err(SlotError::NoUpload));
    assert_eq!(slots.commit(|_| true), Err(SlotError::NoUpload));
    assert_eq!(slots.flash().spent(), 0);
}

#[test]
fn an_error_says_what_it_is_and_where() {
    let said = |error: SlotError| std::string::ToString::to_string(&error);
    assert_eq!(said(SlotError::NoUpload), "no upload is under way");
    let gap = SlotError::Gap { expected: 20 };
    assert_eq!(said(gap), "bytes are missing from 20 on");
    let error = SlotError::Blob(LoadError::BadChecksum);
    assert!(said(error).ends_with(&std::format!("{}", LoadError::BadChecksum)));
}

#[test]
fn a_blob_that_fills_the_slot_fits() {
    // 384 bytes of capacity; the blob ends anywhere in its last word.
    for points in 60..160 {
        let blob = blob(1, points);
        let mut slots = Slots::open(MockFlash::<32, 128>::new(6));
        if blob.len() > slots.capacity() as usize {
            let refused = Err(SlotError::Length { capacity: 384 });
            assert_eq!(attempt(&mut slots, &blob, 100), refused);
            assert!(points > 100);
        } else {
            let slot = upload(&mut slots, &blob, 100);
            assert_eq!(slots.blob(slot), Some(&*blob));
        }
    }
}

#[test]
fn an_upload_never_touches_the_active_slot() {
    let blobs = blobs(4, 40);
    let mut slots = Slots::open(MockFlash::<4, 128>::new(6));
    let first = fill(&mut slots, [&blobs[0]]);
    // Never made active, so each replaces the previous one.
    for blob in &blobs[1..] {
        let before = slots.flash().bytes(first).to_vec();
        assert_eq!(committed(&mut slots, blob, 64), Ok(first.other()));
        assert_eq!(slots.flash().bytes(first), before);
        assert_eq!(slots.newest(), Some(first.other()));
    }
    assert_eq!(slots.flash().erases(first), [1; 6]);
    assert_eq!((slots.wear(first), slots.wear(first.other())), (1, 3));
    // With none active, the newest is kept.
    slots.set_active(None);
    assert_eq!(upload(&mut slots, &blobs[0], 64), first);
}

#[test]
fn blocks_that_no_blob_has_reached_are_not_erased_again() {
    let blobs = blobs(3, 40);
    assert!(blobs.iter().all(|blob| (128..256).contains(&blob.len())));
    let mut slots = Slots::open(MockFlash::<4, 128>::new(8));
    for blob in &blobs {
        upload(&mut slots, blob, 64);
        slots.set_active(None);
        slots.set_active(Some(Slot::B));
    }
    // At first the state of the blocks is unknown, because an interrupted erase can leave blocks that read blank. After
    // that, only the blocks of the blob and the last one are erased.
    assert_eq!(slots.flash().erases(Slot::A), [3, 3, 1, 1, 1, 1, 3, 3]);
    assert_eq!(slots.wear(Slot::A), 3);
}

#[test]
fn the_same_blob_goes_on_after_a_restart_without_erase() {
    let blob = blob(1, 40);
    let mut slots = begun(&blob);
    slots.write(0, &blob[..100]).expect("power");
    let flash = slots.close();
    let spent = flash.spent();
    let mut slots = Slots::open(flash);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let left = SlotState::Uploading {
        received: 0,
        length,
        crc,
    };
    assert_eq!(slots.state(Slot::A), left);
    assert_eq!(attempt(&mut slots, &blob, 64), Ok(Slot::A));
    assert_eq!(slots.flash().erases(Slot::A), [1; 6]);
    // Only what had not been written: whole words, the commit, whose last word stays blank, and the choice.
    let missing = blob.len().next_multiple_of(8) - 96;
    assert_eq!(slots.flash().spent() - spent, missing as u64 + 24 + 64);
    assert_eq!(slots.wear(Slot::A), 1);
}

#[test]
fn before_anything_is_erased_the_slot_says_so() {
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    for blob in &blobs[..2] {
        upload(&mut slots, blob, 64);
    }
    assert!(slots.state(Slot::A).is_valid());
    begin(&mut slots, &blobs[2]).expect("room");
    let slots = Slots::open(slots.close());
    assert_eq!(slots.state(Slot::A), SlotState::Erasing);
    assert_eq!(slots.flash().erases(Slot::A), [1; 6]);
}

#[test]
fn whether_a_begin_erases_is_known_before() {
    let blob = blob(1, 40);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    assert_eq!(slots.would_erase(length, crc), Ok(true));
    assert_eq!(slots.flash().spent(), 0);
    let mut slots = begun(&blob);
    slots.write(0, &blob[..64]).expect("power");
    for again in [false, true] {
        assert_eq!(slots.would_erase(length, crc), Ok(false), "{again}");
        assert_eq!(slots.would_erase(length, crc ^ 1), Ok(true), "{again}");
        slots = Slots::open(slots.close());
    }
    let capacity = slots.capacity();
    let refused = Err(SlotError::Length { capacity });
    assert_eq!(slots.would_erase(capacity + 1, crc), refused);
}

#[test]
fn another_blob_takes_the_place_of_one_that_has_begun() {
    let blobs = blobs(2, 40);
    let mut slots = begun(&blobs[0]);
    slots.write(0, &blobs[0][..100]).expect("power");
    assert_eq!(attempt(&mut slots, &blobs[1], 64), Ok(Slot::A));
    assert_eq!(slots.blob(Slot::A), Some(&*blobs[1]));
    // Blocks 1 and 2 were blank.
    assert_eq!(slots.flash().erases(Slot::A), [2, 1, 1, 1, 1, 2]);
}

#[test]
fn what_differs_from_what_an_upload_left_is_erased() {
    // Same length and checksum, but bits have changed since.
    let blob = blob(1, 40);
    let mut slots = begun(&blob);
    slots.write(0, &blob[..100]).expect("power");
    let mut flash = slots.close();
    flash.flip(Slot::A, 8 * 50);
    let mut slots = Slots::open(flash);
    let refused = Err(SlotError::NotBlank { offset: 48 });
    assert_eq!(attempt(&mut slots, &blob, 64), refused);
    // The flash cannot be blamed for that.
    assert!(matches!(slots.health[Slot::A.index()], Health::Sound));
    assert_eq!(slots.write(0, &blob), Err(SlotError::Spoiled));
    assert_eq!(attempt(&mut slots, &blob, 64), Ok(Slot::A));
    assert_eq!(slots.flash().refused(), 0);
}

#[test]
fn what_is_no_blob_or_another_is_not_committed() {
    let blob = blob(1, 40);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let mut slots = begun(&blob);
    let mut changed = blob.to_vec();
    changed[60] ^= 4;
    slots.write(0, &changed).expect("power");
    let refused = Err(SlotError::Blob(LoadError::BadChecksum));
    assert_eq!(slots.commit(|_| true), refused);
    assert_eq!(slots.commit(|_| true), Err(SlotError::Spoiled));
    assert_eq!(slots.newest(), None);

    // Announced with another checksum.
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    slots.begin(length, !crc).expect("room");
    while slots.erase_step() != Ok(Progress::Receiving { next: 0 }) {}
    slots.write(0, &blob).expect("power");
    assert_eq!(slots.commit(|_| true), Err(SlotError::OtherBlob));

    // The target does not accept it: the commit may be repeated, and nothing was erased.
    let mut slots = begun(&blob);
    slots.write(0, &blob).expect("power");
    assert_eq!(slots.commit(|_| false), Err(SlotError::Refused));
    assert_eq!(slots.newest(), None);
    assert_eq!(slots.commit(|_| true), Ok(Slot::A));
}

#[test]
fn an_aborted_upload_leaves_the_rest_usable() {
    let blobs = blobs(2, 40);
    let mut slots = Slots::open(MockFlash::<4, 128>::new(6));
    let first = fill(&mut slots, [&blobs[0]]);
    begin(&mut slots, &blobs[1]).expect("room");
    slots.abort();
    assert_eq!((slots.upload(), slots.newest()), (None, Some(first)));
    assert_eq!(attempt(&mut slots, &blobs[1], 64), Ok(first.other()));
    // Making a slot active ends an upload into it.
    slots.set_active(None);
    begin(&mut slots, &blobs[1]).expect("room");
    slots.set_active(slots.upload().map(|upload| upload.slot));
    assert_eq!(slots.upload(), None);
}

#[test]
fn a_driver_that_describes_impossible_slots_gets_no_upload() {
    // Nothing is written.
    let (flash, memory) = (MockFlash::<8, 128>::new(6), Memory::new());
    let memory = Box::leak(Box::new(memory));
    let crooked = Mirrored::<_, 736>::open(flash, [0, 768], WhileBusy::DualBank, memory);
    let mut slots = Slots::open(crooked);
    assert_eq!(slots.capacity(), 0);
    assert_eq!(slots.begin(100, 1), Err(SlotError::Length { capacity: 0 }));
    assert_eq!(slots.state(Slot::A), SlotState::Damaged(Damage::Record));
}

#[test]
fn a_flash_that_does_not_hold_what_is_written_is_noticed() {
    let blob = blob(1, 40);
    let mut slots = begun(&blob);
    slots.write(0, &blob[..64]).expect("power");
    let mut flash = slots.close();
    flash.set_defect(Slot::A, 70, Defect::Stuck);
    let mut slots = Slots::open(flash);
    let worn = Err(SlotError::Readback { offset: 64 });
    assert_eq!(attempt(&mut slots, &blob, 8), worn);
    assert_eq!(slots.newest(), None);
}

#[test]
fn a_block_that_is_not_erased_is_named() {
    let old = blob(1, 40);
    let mut slots = begun(&old);
    slots.write(0, &old).expect("power");
    let mut flash = slots.close();
    assert!(old[130] != 0xFF);
    flash.set_defect(Slot::A, 130, Defect::Stuck);
    let mut slots = Slots::open(flash);
    let worn = Err(SlotError::Readback { offset: 128 });
    assert_eq!(attempt(&mut slots, &blob(2, 40), 8), worn);
}

#[test]
fn no_upload_begins_where_a_blob_is_leased() {
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    fill(&mut slots, &blobs[..2]);
    assert!(
        slots
            .lease(Slot::A)
            .is_some_and(|lease| lease.bytes() == &*blobs[0])
    );
    let leases = [Slot::A, Slot::B, Slot::B].map(|slot| slots.lease(slot));
    let [Some(first), Some(second), Some(third)] = leases else {
        panic!("both slots are valid");
    };
    let spent = slots.flash().spent();
    let leased = Err(SlotError::Leased);
    assert_eq!(attempt(&mut slots, &blobs[2], 64), leased);
    slots.take_back(first);
    // The dropped one is never returned.
    assert_eq!(attempt(&mut slots, &blobs[2], 64), leased);
    assert_eq!(slots.flash().spent(), spent);
    // All leases of the other slot are returned.
    slots.set_active(Some(Slot::A));
    slots.take_back(second);
    assert_eq!(attempt(&mut slots, &blobs[2], 64), leased);
    // Returning a foreign lease ends no lease.
    let other: &'static [u8] = blobs[0].to_vec().leak();
    slots.take_back(other.into());
    assert_eq!(attempt(&mut slots, &blobs[2], 64), leased);
    slots.take_back(third);
    assert_eq!(attempt(&mut slots, &blobs[2], 64), Ok(Slot::B));
    // None of them ended the lease of A that was dropped.
    slots.set_active(Some(Slot::B));
    assert_eq!(attempt(&mut slots, &blobs[1], 64), leased);
    slots.set_active(Some(Slot::A));
    // Only valid slots can be leased.
    begin(&mut slots, &blobs[0]).expect("room");
    assert!(slots.lease(Slot::B).is_none());
}

#[test]
fn a_lease_from_before_a_restart_ends_none() {
    let mut slots = Slots::open(MockFlash::<8, 128>::new(6));
    let slot = upload(&mut slots, &blob(1, 40), 64);
    let lease = slots.lease(slot).expect("a valid slot");
    let mut slots = Slots::open(slots.close());
    let place = slots.blob(slot).map(<[u8]>::as_ptr);
    assert_eq!(place, Some(lease.bytes().as_ptr()));
    slots.take_back(lease);
    assert!(!slots.is_leased(slot));
}

/// An upload that is interrupted by a restart and begun again.
fn begun_again<const W: usize, const E: usize>(blocks: usize) -> Progress {
    let blob = blob(1, 40);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let mut slots = Slots::open(MockFlash::<W, E>::new(blocks));
    let mut progress = slots.begin(length, crc).expect("room");
    while matches!(progress, Progress::Erasing { .. }) {
        progress = slots.erase_step().expect("power");
    }
    slots.write(0, &blob[..64]).expect("power");
    let mut slots = Slots::open(slots.close());
    slots.begin(length, crc).expect("room")
}

#[test]
fn an_upload_resumes_after_a_restart_where_the_slot_has_more_than_one_block() {
    assert_eq!(begun_again::<8, 128>(6), Progress::Receiving { next: 0 });
    // With one block, an interrupted erase may look the same.
    let erasing = Progress::Erasing { done: 0, blocks: 1 };
    assert_eq!(begun_again::<16, 768>(1), erasing);
}
