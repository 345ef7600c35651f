//! Settings for a start.

use super::*;
use crate::mock_flash::{Defect, MockFlash};
use crate::slots::{Choice, WhileBusy};

/// 12 blocks of 128 bytes: room for several choices beside a blob of 180 bytes.
type Small = Slots<MockFlash<8, 128>>;

fn open() -> Small {
    Slots::open(MockFlash::new(12))
}

fn restart(slots: Small) -> Small {
    let mut slots = Slots::open(slots.close());
    start(&mut slots);
    slots
}

/// An upload that is committed but not chosen.
fn commit(slots: &mut Small, blob: &[u8]) -> Slot {
    committed(slots, blob, 64).expect("room and power")
}

fn enable(slots: &mut Small, enable: bool) -> Result<(), SlotError> {
    let choice = slots.choice();
    slots.choose(Choice { enable, ..choice })
}

#[test]
fn what_was_never_chosen_is_not_taken_by_a_start() {
    let blobs = blobs(3, 40);
    let mut slots = open();
    assert_eq!(commit(&mut slots, &blobs[0]), Slot::A);
    slots = restart(slots);
    assert_eq!((slots.active(), slots.waiting()), (None, Some(Slot::A)));
    slots.choose(slots.choosing(Slot::A)).expect("power");
    slots = restart(slots);
    assert_eq!((slots.active(), slots.waiting()), (Some(Slot::A), None));
    assert_eq!(commit(&mut slots, &blobs[1]), Slot::B);
    slots = restart(slots);
    assert_eq!(slots.newest(), Some(Slot::B));
    assert_eq!((slots.active(), slots.before()), (Some(Slot::A), None));
    assert_eq!(slots.waiting(), Some(Slot::B));
    // Nor when the one in use is damaged.
    let mut flash = slots.close();
    flash.flip(Slot::A, 800);
    let slots = restart(Slots::open(flash));
    assert_eq!((slots.active(), slots.waiting()), (None, Some(Slot::B)));
}

#[test]
fn where_the_one_in_use_is_damaged_the_one_before_it_is_used() {
    let blobs = blobs(2, 40);
    let mut slots = open();
    fill(&mut slots, &blobs);
    enable(&mut slots, true).expect("room");
    let mut flash = slots.close();
    flash.flip(Slot::B, 800);
    let mut slots = restart(Slots::open(flash));
    assert_eq!((slots.active(), slots.in_use()), (Some(Slot::A), None));
    // An upload erases it; before that, the one used in its place is stored as the one in use, in its slot. This start
    // has enabled nothing, and neither does the next one, because the slot may be of another machine.
    let known = slots.choice();
    begin(&mut slots, &blobs[1]).expect("room");
    let stays = Choice {
        in_use: known.before,
        before: None,
        enable: false,
    };
    assert_eq!(restart(slots).choice(), stays);
}

#[test]
fn a_rollback_lasts_and_what_takes_its_place_is_known() {
    let blobs = blobs(3, 40);
    let mut slots = open();
    for (blob, slot) in blobs.iter().zip([Slot::A, Slot::B]) {
        assert_eq!(upload(&mut slots, blob, 64), slot);
        slots = restart(slots);
        assert_eq!(slots.active(), Some(slot));
    }
    for back in [Slot::A, Slot::B, Slot::A] {
        assert_eq!(slots.before(), Some(back));
        slots.choose(slots.choosing(back)).expect("power");
        slots = restart(slots);
        assert_eq!((slots.active(), slots.waiting()), (Some(back), None));
    }
    // An upload overwrites the one rolled back from; then there is no previous one.
    assert_eq!(commit(&mut slots, &blobs[2]), Slot::B);
    assert_eq!((slots.before(), slots.waiting()), (None, Some(Slot::B)));
    slots = restart(slots);
    assert_eq!(slots.active(), Some(Slot::A));
    // The same bytes under another number are another upload.
    assert_eq!(slots.choosing(Slot::B).before, slots.choice().in_use);
}

#[test]
fn what_is_active_and_not_stored_stays_in_use_and_lets_nothing_in_where_an_upload_erases_the_rest()
{
    let blobs = blobs(3, 40);
    let mut slots = open();
    let first = fill(&mut slots, [&blobs[0]]);
    enable(&mut slots, true).expect("room");
    // Activated, perhaps by force, and not stored: there may have been no room, or no standstill.
    let second = commit(&mut slots, &blobs[1]);
    slots.set_active(Some(second));
    assert_eq!(slots.in_use(), Some(first));
    let stays = Choice {
        in_use: slots.choosing(second).in_use,
        ..Choice::default()
    };
    begin(&mut slots, &blobs[2]).expect("room");
    slots.erase_step().expect("power");
    slots = restart(slots);
    assert_eq!((slots.choice(), slots.active()), (stays, Some(second)));
}

#[test]
fn choices_are_counted_and_the_last_place_is_kept_for_an_upload() {
    let [first, second] = [blob(1, 40), blob(2, 40)];
    let mut slots = open();
    let slot = fill(&mut slots, [&first]);
    // Between blob and trailer, except the place of the choice itself.
    let lines = (first.len()).next_multiple_of(32);
    let left = (12 * 128 - 128 - lines) / 64 - 1;
    assert_eq!(slots.places_left(slot), left);
    for number in 0..left - 1 {
        let on = number % 2 == 0;
        assert_eq!(enable(&mut slots, on), Ok(()));
        // A setting that is already stored takes no room.
        assert_eq!(enable(&mut slots, on), Ok(()));
        assert_eq!(slots.places_left(slot), left - 1 - number);
        let again = Slots::open(slots.close());
        assert_eq!(again.choice().enable, on);
        slots = again;
        start(&mut slots);
    }
    let stored = slots.choice();
    assert_eq!(enable(&mut slots, !stored.enable), Err(SlotError::Full));
    assert_eq!(slots.choice(), stored);
    assert_eq!(slots.blob(slot), Some(&*first));
    // An upload makes room and carries over the stored settings.
    fill(&mut slots, [&second]);
    assert_eq!(slots.choice().enable, stored.enable);
    assert_eq!(enable(&mut slots, !stored.enable), Ok(()));
}

#[test]
fn a_slot_that_is_full_of_its_blob_has_room_for_four() {
    let mut slots = Slots::open(MockFlash::<32, 128>::new(8));
    let capacity = slots.capacity() as usize;
    let blob = (100..).map(|points| blob(1, points));
    let blob = blob
        .take_while(|blob| blob.len() <= capacity)
        .last()
        .expect("one fits");
    assert!(blob.len() + 4 > capacity);
    let slot = upload(&mut slots, &blob, 64);
    assert_eq!(slots.places_left(slot), 3);
}

#[test]
fn without_a_compensation_there_is_nothing_to_choose() {
    let mut slots = open();
    assert_eq!(enable(&mut slots, true), Err(SlotError::NotChosen));
    let choice = slots.choosing(Slot::B);
    assert_eq!(choice.in_use, None);
    assert_eq!(
        slots.choose(choice),
        Ok(()),
        "nothing is stored, and nothing is what holds"
    );
    assert_eq!(slots.flash().spent(), 0);
    assert_eq!(slots.places_left(Slot::A), 0);
}

#[test]
fn every_bit_of_a_choice_may_flip_and_every_line_may_be_lost() {
    let [first, second] = [blob(1, 40), blob(2, 40)];
    for code in [false, true] {
        let flash = MockFlash::<32, 128>::new(12);
        let mut slots = Slots::open(if code { flash.with_code() } else { flash });
        fill(&mut slots, [&first]);
        let slot = upload(&mut slots, &second, 64);
        let choice = slots.choice();
        slots
            .choose(Choice {
                enable: true,
                ..choice
            })
            .expect("room");
        let (expected, left) = (slots.choice(), slots.places_left(slot));
        let mut flash = slots.close();
        let end = 12 * 128 - 128;
        for bit in 8 * (end - 3 * 64)..8 * end {
            flash.flip(slot, bit);
            let slots = Slots::open(flash);
            assert_eq!(slots.choice(), expected, "bit {bit}");
            let blank = bit / 8 < end - 2 * 64;
            assert_eq!(slots.places_left(slot), left - usize::from(blank));
            flash = slots.close();
            flash.flip(slot, bit);
        }
        // A place with a flipped bit is skipped.
        flash.flip(slot, 8 * (end - 3 * 64));
        let mut slots = Slots::open(flash);
        let choice = slots.choice();
        slots
            .choose(Choice {
                enable: false,
                ..choice
            })
            .expect("room");
        assert!(!Slots::open(slots.close()).choice().enable);
    }
}

#[test]
fn a_choice_stalls_a_servo_only_where_it_reads_the_same_bank() {
    let [first, second] = [blob(1, 40), blob(2, 40)];
    let stalls = |while_busy| {
        let flash = MockFlash::<8, 128>::new(12).with_while_busy(while_busy);
        let mut slots = Slots::open(flash);
        slots.set_standstill(true);
        fill(&mut slots, [&first]);
        let other = commit(&mut slots, &second);
        slots.set_standstill(false);
        let spent = slots.flash().spent();
        let own = enable(&mut slots, true);
        assert_eq!(own.is_err(), spent == slots.flash().spent());
        let next = slots.choose(slots.choosing(other));
        (own, next)
    };
    let refused = Err(SlotError::NotStandstill);
    assert_eq!(stalls(WhileBusy::Standstill), (refused, refused));
    assert_eq!(stalls(WhileBusy::DualBank), (refused, Ok(())));
    assert_eq!(stalls(WhileBusy::ServoInRam), (Ok(()), Ok(())));
}

/// A was chosen and is damaged; with `waits`, B was committed but never chosen. No slot is active.
fn lost(waits: bool) -> Small {
    let mut slots = open();
    commit(&mut slots, &blob(1, 40));
    slots.choose(slots.choosing(Slot::A)).expect("room");
    enable(&mut slots, true).expect("room");
    slots = restart(slots);
    if waits {
        assert_eq!(commit(&mut slots, &blob(2, 40)), Slot::B);
    }
    let mut flash = slots.close();
    flash.flip(Slot::A, 800);
    restart(Slots::open(flash))
}

#[test]
fn an_upload_over_what_was_lost_chooses_nothing() {
    for waits in [true, false] {
        let mut slots = lost(waits);
        assert_eq!(slots.active(), None);
        let choice = slots.choice();
        assert!(choice.enable && choice.in_use.is_some());
        // A slot without a blob holds no choice either.
        let untouched = slots.state(Slot::B);
        begin(&mut slots, &blob(3, 40)).expect("room");
        assert_eq!(slots.upload().map(|upload| upload.slot), Some(Slot::A));
        assert_eq!(slots.choice(), choice);
        let slots = restart(slots);
        assert_eq!(slots.state(Slot::B), untouched);
        assert_eq!((slots.in_use(), slots.before()), (None, None));
        assert_eq!(slots.waiting(), waits.then_some(Slot::B));
    }
}

#[test]
fn a_begin_stalls_the_servo_only_where_it_first_saves_a_choice_in_its_bank() {
    let both = [blob(1, 40), blob(2, 40)];
    let stalls = |while_busy, used| {
        let flash = MockFlash::<8, 128>::new(12).with_while_busy(while_busy);
        let mut slots = Slots::open(flash);
        slots.set_standstill(true);
        fill(&mut slots, &both);
        // The newest choice is in B.
        slots.set_active(Some(used));
        slots.begin_stalls()
    };
    for while_busy in [WhileBusy::Standstill, WhileBusy::DualBank] {
        assert!(stalls(while_busy, Slot::A), "{while_busy:?}");
        assert!(!stalls(while_busy, Slot::B), "{while_busy:?}");
    }
    assert!(!stalls(WhileBusy::ServoInRam, Slot::A));
}

#[test]
fn a_choice_that_the_power_cuts_is_the_old_or_the_new_one() {
    let both = [blob(1, 40), blob(2, 40)];
    for code in [false, true] {
        let mut kept = [0; 2];
        for fuel in 1..=64 {
            let flash = MockFlash::<16, 128>::new(12);
            let mut slots = Slots::open(if code { flash.with_code() } else { flash });
            fill(&mut slots, &both);
            let old = slots.choice();
            let new = Choice {
                enable: true,
                ..slots.choosing(Slot::A)
            };
            let mut flash = slots.close();
            flash.set_fuel(Some(fuel));
            let mut slots = Slots::open(flash);
            let done = slots.choose(new);
            let mut flash = slots.close();
            flash.set_fuel(None);
            let mut slots = Slots::open(flash);
            let found = slots.choice();
            assert!(found == old || found == new, "{fuel}: {found:?}");
            assert!(done.is_err() || found == new, "acknowledged after {fuel}");
            kept[usize::from(found == new)] += 1;
            // And it continues.
            start(&mut slots);
            slots.choose(new).expect("power");
            assert_eq!(Slots::open(slots.close()).choice(), new);
        }
        assert!(kept.iter().all(|count| *count > 10), "{kept:?}");
    }
}

#[test]
fn the_numbers_of_choices_go_on_across_the_wrap() {
    let blobs = blobs(2, 40);
    let mut slots = open();
    fill(&mut slots, &blobs);
    // The newest choice of each slot gets a number just before the wrap.
    let at = 12 * 128 - 128 - 64;
    let (a, b) = (slots.choosing(Slot::A), slots.choosing(Slot::B));
    let mut flash = slots.close();
    for (slot, choice, number) in [(0, a, u32::MAX - 1), (1, b, u32::MAX)] {
        let place = slot * 12 * 128 + at;
        flash.image()[place..place + 64].copy_from_slice(&choice.encode(number));
    }
    let mut slots = restart(Slots::open(flash));
    for back in [Slot::A, Slot::B, Slot::A] {
        slots.choose(slots.choosing(back)).expect("room");
        slots = restart(slots);
        assert_eq!(slots.active(), Some(back));
    }
}

#[test]
fn a_choice_of_which_the_power_has_left_one_half_is_stored_again() {
    let blobs = blobs(2, 40);
    let mut halved = 0;
    for fuel in 1..=64 {
        let mut slots = open();
        fill(&mut slots, [&blobs[0]]);
        let slot = commit(&mut slots, &blobs[1]);
        let choice = slots.choosing(slot);
        slots.flash.set_fuel(Some(fuel));
        let _ = slots.choose(choice);
        let mut flash = slots.close();
        flash.set_fuel(None);
        let mut slots = Slots::open(flash);
        if !slots.is_choice_halved() {
            continue;
        }
        halved += 1;
        assert_eq!(slots.choice(), choice);
        assert_eq!(slots.choose(choice), Ok(()));
        assert!(!slots.is_choice_halved());
        // Now it survives the loss of any one half.
        for place in 0..2 {
            let mut flash = slots.close();
            let bit = 8 * (12 * 128 - 128 - 64 * (place + 1));
            for half in [0, 256] {
                flash.flip(slot, bit + half + 40);
                let slots = Slots::open(flash);
                assert_eq!(slots.choice(), choice, "{fuel}");
                flash = slots.close();
                flash.flip(slot, bit + half + 40);
            }
            slots = Slots::open(flash);
        }
    }
    assert!(halved >= 30, "{halved}");
}

#[test]
fn a_choice_goes_to_the_next_place_where_a_word_of_the_first_fails() {
    let [first, second] = [blob(1, 40), blob(2, 40)];
    for defect in Defect::ALL {
        for byte in (0..128).step_by(8) {
            let mut slots = open();
            let slot = fill(&mut slots, [&first]);
            let mut flash = slots.close();
            flash.set_defect(slot, 12 * 128 - 128 - 192 + byte, defect);
            slots = restart(Slots::open(flash));
            enable(&mut slots, true).expect("one half is enough");
            slots = restart(slots);
            assert!(slots.choice().enable, "{defect:?} at {byte}");
            assert!(!slots.is_choice_halved(), "{defect:?} at {byte}");
            assert_eq!(upload(&mut slots, &second, 64), slot.other());
            assert_eq!(slots.flash().refused(), 0);
        }
    }
}

#[test]
fn two_places_that_fail_are_named_and_what_was_stored_holds() {
    let mut slots = open();
    let slot = fill(&mut slots, [&blob(1, 40)]);
    let stored = slots.choice();
    let end = 12 * 128 - 128 - 64;
    for byte in (end - 128..end).step_by(8) {
        slots.flash.set_defect(slot, byte, Defect::Refuses);
    }
    let block = (end as u32 - 64) / 128;
    let unusable = Err(SlotError::Unusable { slot, block });
    for _ in 0..2 {
        assert_eq!(enable(&mut slots, true), unusable);
        assert_eq!(slots.choice(), stored);
    }
    // Its next upload erases all of it; the block that never worked is reported again once it is needed.
    slots.set_active(None);
    fill(&mut slots, [&blob(2, 40)]);
    assert_eq!(commit(&mut slots, &blob(3, 40)), slot);
    assert_eq!(slots.flash().erases(slot), [2; 12]);
}

/// Enables corrections with `places` left beside a choice, the next of which has a defect in both halves.
fn enabled_beside_a_bad_place(places: usize) -> (Result<(), SlotError>, Small) {
    let mut slots = open();
    let slot = fill(&mut slots, [&blob(1, 40)]);
    let room = slots.places_left(slot);
    let mut on = false;
    while slots.places_left(slot) > places {
        on = !on;
        enable(&mut slots, on).expect("room");
    }
    let at = 12 * 128 - 128 - 64 * (2 + room - places);
    for half in [0, 32] {
        slots.flash.set_defect(slot, at + half, Defect::Misreads);
    }
    (enable(&mut slots, !on), slots)
}

#[test]
fn the_last_place_is_kept_where_the_one_before_it_fails() {
    for places in 2..5 {
        let (result, slots) = enabled_beside_a_bad_place(places);
        let left = slots.places_left(Slot::A);
        if places == 2 {
            assert!(
                matches!(result, Err(SlotError::Unusable { .. })),
                "{result:?}"
            );
            assert_eq!(left, 1);
        } else {
            assert_eq!((result, left), (Ok(()), places - 2));
        }
    }
}

#[test]
fn one_half_of_a_choice_is_enough_where_no_place_takes_both() {
    let mut slots = open();
    let slot = fill(&mut slots, [&blob(1, 40)]);
    for place in 2..4 {
        let at = 12 * 128 - 128 - 64 * place;
        slots.flash.set_defect(slot, at, Defect::Refuses);
    }
    assert_eq!(enable(&mut slots, true), Ok(()));
    assert!(slots.choice().enable);
    assert!(slots.is_choice_halved());
}
