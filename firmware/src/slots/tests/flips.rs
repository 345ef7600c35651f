//! Single bits flip.

use super::*;
use crate::mock_flash::MockFlash;
use crate::slots::{Damage, SlotState};

#[test]
fn every_flip_in_a_small_blob_or_behind_it_is_found() {
    let blobs = blobs(2, 40);
    let mut slots = Slots::open(MockFlash::<4, 128>::new(8));
    let slot = upload(&mut slots, &blobs[0], 64);
    slots.set_active(Some(slot));
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
    // Unharmed, the newest is back.
    assert_eq!(Slots::open(flash).newest(), Some(newest));
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
fn a_flip_while_running_is_found_by_a_rescan() {
    let blob = blob(0, 40);
    let mut slots = Slots::open(MockFlash::<4, 768>::new(1));
    let slot = upload(&mut slots, &blob, 64);
    let mut flash = slots.close();
    flash.flip(slot, 8 * 100);
    let mut slots = Slots::open(flash);
    assert!(!slots.rescan(slot).is_valid());
    let mut flash = slots.close();
    flash.flip(slot, 8 * 100);
    let mut slots = Slots::open(flash);
    assert!(slots.rescan(slot).is_valid());
}

#[test]
fn a_damaged_newest_that_recovers_does_not_win_over_what_came_later() {
    let blobs = blobs(3, 40);
    let mut slots = Slots::open(MockFlash::<4, 768>::new(1));
    for blob in &blobs[..2] {
        let slot = upload(&mut slots, blob, 64);
        slots.set_active(Some(slot));
    }
    let damaged = slots.newest().expect("two blobs");
    let mut flash = slots.close();
    flash.flip(damaged, 8 * 100);
    let mut slots = Slots::open(flash);
    // The servo still reads it, so the upload goes over the older one.
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
