//! Flash with arbitrary contents.

use proptest::prelude::*;

use super::*;
use crate::mock_flash::MockFlash;
use crate::slots::layout::{Record, commit_at, mark_at, record_at};
use crate::slots::{Damage, SlotState};

const SLOT: usize = 768;

/// Survives anything: nothing is active, and an upload succeeds.
fn survives(image: &[u8]) {
    let mut flash = MockFlash::<8, 128>::new(SLOT / 128);
    flash.image().copy_from_slice(image);
    let mut slots = Slots::open(flash);
    assert_eq!(start(&mut slots), None);
    assert_eq!((slots.newest(), slots.before()), (None, None));
    assert_eq!(Slot::BOTH.map(|slot| slots.blob(slot)), [None; 2]);
    let blob = blob(7, 40);
    let slot = upload(&mut slots, &blob, 64);
    assert_eq!(start(&mut slots), Some((slot, &*blob)));
    let mut slots = Slots::open(slots.close());
    assert_eq!(start(&mut slots), Some((slot, &*blob)));
}

/// Bytes with a consistent record, and perhaps a commit.
fn with_trailer(bytes: &mut [u8], length: u32, crc: u32, sequence: Option<u32>) {
    let record = Record {
        length,
        crc,
        wear: 5,
        other_wear: 4,
    };
    bytes[record_at(SLOT)].copy_from_slice(&record.encode());
    bytes[mark_at(SLOT)].fill(0xFF);
    bytes[commit_at(SLOT)].fill(0xFF);
    if let Some(sequence) = sequence {
        bytes[commit_at(SLOT)].copy_from_slice(&record.commit(sequence));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn random_bytes_are_never_active(image in prop::collection::vec(any::<u8>(), 2 * SLOT)) {
        survives(&image);
    }

    #[test]
    fn random_bytes_behind_a_header_are_never_active(
        mut image in prop::collection::vec(any::<u8>(), 2 * SLOT),
        length in any::<u32>(),
        erased in any::<bool>(),
    ) {
        for slot in image.chunks_mut(SLOT) {
            slot[..8].copy_from_slice(b"TRAX\x01\0\0\0");
            slot[8..12].copy_from_slice(&(length % 600).to_le_bytes());
            if erased {
                slot[100..].fill(0xFF);
            }
        }
        survives(&image);
    }

    #[test]
    fn random_bytes_before_a_trailer_that_holds_are_never_active(
        mut image in prop::collection::vec(any::<u8>(), 2 * SLOT),
        length in any::<u32>(),
        crc in any::<u32>(),
        sequence in prop::option::of(any::<u32>()),
        header in any::<bool>(),
    ) {
        for (slot, length) in image.chunks_mut(SLOT).zip([length, length % 400]) {
            with_trailer(slot, length, crc, sequence);
            if header {
                slot[..8].copy_from_slice(b"TRAX\x01\0\0\0");
                slot[8..12].copy_from_slice(&length.to_le_bytes());
                slot[12..16].copy_from_slice(&crc.to_le_bytes());
            }
        }
        survives(&image);
    }

    #[test]
    fn the_newer_sequence_number_wins_across_the_wrap(
        first in prop_oneof![any::<u32>(), u32::MAX - 2..=u32::MAX],
        ahead in 1..=u32::MAX / 2,
        swapped in any::<bool>(),
    ) {
        let blobs = [blob(1, 40), blob(2, 40)];
        let mut flash = MockFlash::<4, SLOT>::new(1);
        let mut sequences = [first, first.wrapping_add(ahead)];
        if swapped {
            sequences.reverse();
        }
        for ((slot, blob), sequence) in flash.image().chunks_mut(SLOT).zip(&blobs).zip(sequences) {
            slot[..blob.len()].copy_from_slice(blob);
            let header = Header::read(blob).expect("a blob");
            with_trailer(slot, header.length, header.crc, Some(sequence));
        }
        let slots = Slots::open(flash);
        let expected = if swapped { Slot::A } else { Slot::B };
        prop_assert_eq!(slots.newest(), Some(expected));
    }
}

#[test]
fn a_sequence_number_goes_on_across_the_wrap() {
    let blobs = blobs(3, 40);
    let mut flash = MockFlash::<4, SLOT>::new(1);
    let header = Header::read(&blobs[0]).expect("a blob");
    let slot = &mut flash.image()[..SLOT];
    slot[..blobs[0].len()].copy_from_slice(&blobs[0]);
    with_trailer(slot, header.length, header.crc, Some(u32::MAX));
    let mut slots = Slots::open(flash);
    slots.choose(slots.choosing(Slot::A)).expect("room");
    for (number, blob) in (0..).zip(&blobs[1..]) {
        assert!(start(&mut slots).is_some());
        let slot = upload(&mut slots, blob, 64);
        assert!(
            matches!(slots.state(slot), SlotState::Valid { sequence, .. } if sequence == number)
        );
        assert_eq!(slots.newest(), Some(slot));
        slots = Slots::open(slots.close());
        assert_eq!(start(&mut slots), Some((slot, &**blob)));
    }
}

#[test]
fn a_slot_is_blank_where_every_byte_of_it_is_and_only_there() {
    let open = |flipped: Option<usize>| {
        let mut flash = MockFlash::<8, 128>::new(SLOT / 128);
        // The other one is not.
        flash.flip(Slot::B, 0);
        if let Some(byte) = flipped {
            flash.flip(Slot::A, 8 * byte + 3);
        }
        let slots = Slots::open(flash);
        assert!(matches!(slots.state(Slot::B), SlotState::Damaged(_)));
        slots.state(Slot::A)
    };
    assert_eq!(open(None), SlotState::Blank);
    for byte in 0..SLOT {
        let expected = if mark_at(SLOT).contains(&byte) {
            SlotState::Erasing
        } else {
            SlotState::Damaged(Damage::Record)
        };
        assert_eq!(open(Some(byte)), expected, "{byte}");
    }
    let slots = Slots::open(MockFlash::<8, 128>::new(SLOT / 128));
    assert_eq!(slots.state(Slot::B), SlotState::Blank);
    // There is no room for a blob.
    let slots = Slots::open(MockFlash::<8, 128>::new(3));
    assert_eq!(slots.state(Slot::A), SlotState::Damaged(Damage::Record));
}

#[test]
fn a_record_that_holds_is_that_of_its_blob_or_names_what_is_wrong() {
    let blob = blob(1, 40);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let state = |length: u32, crc: u32, sequence: Option<u32>| {
        let mut flash = MockFlash::<8, 128>::new(SLOT / 128);
        let slot = &mut flash.image()[..SLOT];
        slot[..blob.len()].copy_from_slice(&blob);
        with_trailer(slot, length, crc, sequence);
        Slots::open(flash).state(Slot::A)
    };
    let valid = SlotState::Valid {
        sequence: 1,
        length,
        crc,
    };
    assert_eq!(state(length, crc, Some(1)), valid);
    for (length, crc) in [(length - 1, crc), (length, crc ^ 1)] {
        let other = SlotState::Damaged(Damage::OtherBlob);
        assert_eq!(state(length, crc, Some(1)), other);
    }
    let held = (SLOT - 384) as u32;
    let received = 0;
    let uploading = |length| SlotState::Uploading {
        received,
        length,
        crc,
    };
    assert_eq!(state(held, crc, None), uploading(held));
    for length in [held + 1, u32::MAX] {
        let damaged = SlotState::Damaged(Damage::Record);
        assert_eq!(state(length, crc, None), damaged);
    }
}

#[test]
fn a_layout_of_another_version_is_named_and_an_upload_takes_its_place() {
    let blob = blob(1, 40);
    for version in [1, 3] {
        let mut slots = Slots::open(MockFlash::<4, SLOT>::new(1));
        let slot = upload(&mut slots, &blob, 64);
        let mut flash = slots.close();
        // The version, and its complement.
        flash.image()[record_at(SLOT).start + 4] = version;
        flash.image()[record_at(SLOT).start + 36] = !version;
        let mut slots = Slots::open(flash);
        let found = u16::from(version);
        let found = SlotState::Damaged(Damage::UnknownLayout { found });
        assert_eq!((slots.state(slot), slots.in_use()), (found, None));
        let slot = upload(&mut slots, &blob, 64);
        assert_eq!(start(&mut slots), Some((slot, &*blob)));
    }
}
