//! Settings for the start, as seen by a host.

use trueaxis::link::{AtStart, Storing};

use super::*;

const IN_USE: Request<'_> = Request::CommitInUse { force: false };

fn at_start(desktop: &mut Desktop) -> AtStart {
    match ask(desktop, &Request::AtStart) {
        Reply::AtStart(at_start) => at_start,
        other => panic!("{other:?}"),
    }
}

fn activate(desktop: &mut Desktop, slot: Slot) -> Reply<'static> {
    ask(desktop, &Request::Activate { slot, force: false })
}

/// `periods` servo periods, with as many turns of the main loop.
fn is(desktop: &mut Desktop, slot: Option<Slot>, enabled: bool) {
    assert_eq!((active(desktop), status(desktop).enabled), (slot, enabled));
}

fn sound(desktop: &Desktop, slot: Option<Slot>) {
    assert_eq!((active(desktop), desktop.device.fault()), (slot, None));
}

fn stand(desktop: &mut Desktop, periods: u32) {
    for _ in 0..periods {
        desktop.turn(1);
    }
}

/// Compensations of one machine in both slots. Both have been in use; B is now.
fn both(while_busy: WhileBusy) -> Desktop {
    let mut desktop = fresh(while_busy);
    for (scale, slot) in [(0.1, Slot::A), (0.2, Slot::B)] {
        let blob = blob("m", b"XY", scale);
        let done = upload_with(&mut desktop, &blob, &IN_USE);
        assert!(matches!(done, Reply::Upload(Upload::Committed { .. })));
        desktop = desktop.restart();
        sound(&desktop, Some(slot));
    }
    desktop
}

const EVERY: [WhileBusy; 3] = [
    WhileBusy::Standstill,
    WhileBusy::DualBank,
    WhileBusy::ServoInRam,
];

#[test]
fn what_was_committed_and_never_activated_is_not_taken_by_a_start() {
    for while_busy in EVERY {
        let mut desktop = fresh(while_busy);
        upload(&mut desktop, &blob("m", b"XY", 0.1), false);
        desktop = desktop.restart();
        assert_eq!(active(&desktop), None);
        assert_eq!(desktop.device.fault(), Some(Fault::Waiting(Slot::A)));
        activate(&mut desktop, Slot::A);
        desktop.turn(1);
        sound(&desktop, Some(Slot::A));
        upload(&mut desktop, &blob("m", b"XY", 0.2), false);
        let known = AtStart {
            in_use: Some(Slot::A),
            before: None,
            waiting: Some(Slot::B),
            enable: false,
            storing: Storing::Stored,
        };
        assert_eq!(at_start(&mut desktop), known);
        desktop = desktop.restart();
        assert_eq!(
            (active(&desktop), at_start(&mut desktop)),
            (Some(Slot::A), known)
        );
    }
}

#[test]
fn a_rollback_lasts() {
    for while_busy in EVERY {
        let mut desktop = both(while_busy);
        for slot in [Slot::A, Slot::B, Slot::A] {
            assert_eq!(at_start(&mut desktop).before, Some(slot));
            activate(&mut desktop, slot);
            await_active(&mut desktop, Some(slot));
            assert_eq!(at_start(&mut desktop).storing, Storing::Stored);
            desktop = desktop.restart();
            sound(&desktop, Some(slot));
        }
    }
}

#[test]
fn where_the_flash_stalls_a_change_in_motion_is_stored_at_the_next_standstill() {
    let mut desktop = both(WhileBusy::Standstill);
    let_in(&mut desktop);
    settle(&mut desktop);
    desktop.standstill.set(false);
    let spent = desktop.device.slots().flash().spent();
    activate(&mut desktop, Slot::A);
    while desktop.device.activation() != Activation::Active(Some(Slot::A)) {
        settle(&mut desktop);
    }
    let pending = at_start(&mut desktop);
    assert_eq!(
        (pending.in_use, pending.storing),
        (Some(Slot::B), Storing::Pending)
    );
    assert_eq!(desktop.device.slots().flash().spent(), spent);
    assert!((status(&mut desktop).dq[0] - 0.1).abs() < 1e-4);

    // A short stop has no effect.
    desktop.standstill.set(true);
    stand(&mut desktop, 1900);
    assert_eq!(status(&mut desktop).factor, 1.0);
    desktop.standstill.set(false);
    desktop.turn(1);

    // It stops for longer and moves again before the corrections are zero, so they come back.
    desktop.standstill.set(true);
    stand(&mut desktop, 1900);
    assert_eq!(status(&mut desktop).factor, 1.0);
    let begins = |desktop: &mut Desktop| {
        while status(desktop).factor == 1.0 {
            desktop.turn(1);
        }
        assert!(status(desktop).factor > 0.5);
    };
    begins(&mut desktop);
    desktop.standstill.set(false);
    settle(&mut desktop);
    assert_eq!(status(&mut desktop).factor, 1.0);
    assert_eq!(desktop.device.slots().flash().spent(), spent);

    // A motion over the link takes precedence too.
    desktop.standstill.set(true);
    begins(&mut desktop);
    let row = [[0.0, -50.0]; 1];
    moved(&mut desktop, &row);
    assert_eq!(at_start(&mut desktop).storing, Storing::Pending);

    // At standstill they ramp to zero, the choice is stored, and they may come back.
    let mut last = status(&mut desktop).dq[0];
    while at_start(&mut desktop).storing == Storing::Pending {
        desktop.turn(1);
        let dq = status(&mut desktop).dq[0];
        assert!((dq - last).abs() <= 2.0 * PERIOD * 1.001);
        last = dq;
    }
    assert_eq!(last, 0.0);
    assert!(!status(&mut desktop).suspended);
    assert_eq!(at_start(&mut desktop).in_use, Some(Slot::A));
    settle(&mut desktop);
    assert!((status(&mut desktop).dq[0] - 0.1).abs() < 1e-4);
    assert_eq!(active(&desktop.restart()), Some(Slot::A));
}

#[test]
fn what_waits_to_be_stored_is_not_forgotten_by_a_change() {
    let mut desktop = both(WhileBusy::Standstill);
    let_in(&mut desktop);
    settle(&mut desktop);
    // The corrections are ramping to zero for that when the machine starts to move.
    ask(&mut desktop, &Request::EnableAtStart(true));
    desktop.standstill.set(false);
    desktop.turn(1);
    activate(&mut desktop, Slot::A);
    while desktop.device.activation() != Activation::Active(Some(Slot::A)) {
        settle(&mut desktop);
    }
    assert_eq!(at_start(&mut desktop).storing, Storing::Pending);
    desktop.standstill.set(true);
    while at_start(&mut desktop).storing == Storing::Pending {
        desktop.turn(1);
    }
    let stored = at_start(&mut desktop);
    assert_eq!((stored.in_use, stored.enable), (Some(Slot::A), true));
}

#[test]
fn no_update_falls_into_the_storing_of_what_a_start_goes_by() {
    for while_busy in [WhileBusy::Standstill, WhileBusy::DualBank] {
        let flash = both(while_busy).stop();
        let mut desktop = Desktop::start_watched(flash, PERIOD, |flash, servo| {
            let servo = servo.clone();
            flash.set_listener(move |_| {
                assert!(servo.lock(|side| side.is_suspended() && side.is_at_zero()));
            });
        });
        let_in(&mut desktop);
        settle(&mut desktop);
        assert!(status(&mut desktop).dq[0] != 0.0);
        ask(&mut desktop, &Request::EnableAtStart(true));
        while at_start(&mut desktop).storing == Storing::Pending {
            desktop.turn(1);
        }
        assert!(at_start(&mut desktop).enable);
        assert!(!status(&mut desktop).suspended);
    }
}

#[test]
fn corrections_are_let_in_at_start_only_if_that_was_set() {
    for while_busy in EVERY {
        let mut desktop = both(while_busy);
        assert!(!status(&mut desktop).enabled);
        ask(&mut desktop, &Request::Enable(true));
        desktop = desktop.restart();
        assert!(
            !status(&mut desktop).enabled,
            "enabling is not stored by itself"
        );
        for on in [true, false, true] {
            let Reply::AtStart(set) = ask(&mut desktop, &Request::EnableAtStart(on)) else {
                panic!()
            };
            assert_eq!((set.enable, set.storing), (on, Storing::Stored));
            desktop = desktop.restart();
            assert_eq!(status(&mut desktop).enabled, on);
        }
        // It survives an upload and a rollback.
        let third = blob("m", b"XY", 0.3);
        upload_with(&mut desktop, &third, &IN_USE);
        desktop = desktop.restart();
        is(&mut desktop, Some(Slot::A), true);
        activate(&mut desktop, Slot::B);
        await_active(&mut desktop, Some(Slot::B));
        desktop.turn(2000);
        desktop = desktop.restart();
        is(&mut desktop, Some(Slot::B), true);
        // Not in the slot used in place of the chosen one.
        let mut flash = desktop.stop();
        flash.flip(Slot::B, 800);
        let mut desktop = Desktop::start(flash, PERIOD);
        assert_eq!(desktop.device.fault(), Some(Fault::Lost));
        is(&mut desktop, Some(Slot::A), false);
        // Unless requested.
        ask(&mut desktop, &Request::EnableAtStart(true));
        desktop = desktop.restart();
        assert_eq!(
            (desktop.device.fault(), status(&mut desktop).enabled),
            (None, true)
        );
    }
}

#[test]
fn an_upload_over_what_was_lost_leaves_the_one_in_its_place_in_use() {
    for while_busy in EVERY {
        let mut desktop = both(while_busy);
        ask(&mut desktop, &Request::EnableAtStart(true));
        desktop = lose_and_begin(desktop, Slot::B);
        sound(&desktop, Some(Slot::A));
        // The start that did not find B enabled nothing, and nothing has changed that since.
        assert!(!status(&mut desktop).enabled);
        ask(&mut desktop, &Request::EnableAtStart(true));
        assert!(status(&mut desktop.restart()).enabled);
    }
}

#[test]
fn an_upload_over_what_was_lost_lets_nothing_of_another_machine_in() {
    let mut desktop = both(WhileBusy::ServoInRam);
    let force = true;
    let other = blob("n", b"XY", 0.2);
    upload_with(&mut desktop, &other, &Request::CommitInUse { force });
    desktop = desktop.restart();
    assert_eq!(active(&desktop), Some(Slot::A));
    // Back to the original machine: the other one was in use before.
    let slot = Slot::B;
    ask(&mut desktop, &Request::Activate { slot, force });
    desktop.turn(1);
    ask(&mut desktop, &Request::EnableAtStart(true));
    desktop = desktop.restart();
    is(&mut desktop, Some(Slot::B), true);
    desktop = lose_and_begin(desktop, Slot::B);
    is(&mut desktop, Some(Slot::A), false);
}

/// A bit flips in the compensation in use. At the next start an upload into its slot is only begun, which erases the
/// slot together with the choice stored there. Then another start.
fn lose_and_begin(desktop: Desktop, lost: Slot) -> Desktop {
    let mut flash = desktop.stop();
    flash.flip(lost, 800);
    let mut desktop = Desktop::start(flash, PERIOD);
    receiving(&mut desktop, &blob("m", b"XY", 0.3));
    desktop.restart()
}

#[test]
fn of_another_machine_nothing_is_let_in_by_itself() {
    for in_use in [false, true] {
        let mut desktop = both(WhileBusy::ServoInRam);
        ask(&mut desktop, &Request::EnableAtStart(true));
        let other = blob("n", b"XY", 0.2);
        let force = true;
        if in_use {
            upload_with(&mut desktop, &other, &Request::CommitInUse { force });
        } else {
            upload(&mut desktop, &other, force);
            let slot = Slot::A;
            ask(&mut desktop, &Request::Activate { slot, force });
            desktop.turn(1);
        }
        assert!(!at_start(&mut desktop).enable);
        desktop = desktop.restart();
        is(&mut desktop, Some(Slot::A), false);
    }
}

#[test]
fn what_cannot_be_stored_is_refused_in_words() {
    let enable = Request::EnableAtStart(true);
    let mut desktop = fresh(WhileBusy::Standstill);
    refuses(&mut desktop, &enable, Refusal::NoCompensation);
    let mut desktop = both(WhileBusy::Standstill);
    desktop.standstill.set(false);
    refuses(&mut desktop, &enable, Refusal::NotStandstill);
    // An unchanged setting needs no flash.
    let off = ask(&mut desktop, &Request::EnableAtStart(false));
    assert!(matches!(off, Reply::AtStart(_)));
    desktop.standstill.set(true);
    let third = blob("m", b"XY", 0.3);
    let (length, crc) = announced(&third);
    ask(&mut desktop, &Request::Begin { length, crc });
    refuses(&mut desktop, &enable, Refusal::Busy);
    ask(&mut desktop, &Request::Abort);
    // Until there is no more room, which is reported; an upload then makes room.
    let mut on = false;
    let refused = loop {
        on = !on;
        match ask(&mut desktop, &Request::EnableAtStart(on)) {
            Reply::AtStart(set) => assert_eq!((set.enable, set.storing), (on, Storing::Stored)),
            refused => break refused,
        }
    };
    assert_eq!(refused, Reply::Refused(Refusal::Full));
    upload_with(&mut desktop, &third, &IN_USE);
    assert_eq!(at_start(&mut desktop).storing, Storing::Stored);
    let done = ask(&mut desktop, &Request::EnableAtStart(on));
    assert!(matches!(done, Reply::AtStart(set) if set.enable == on));
}

#[test]
fn weights_come_with_their_limits() {
    let mut desktop = fresh(WhileBusy::DualBank);
    refuses(&mut desktop, &Request::Weights, Refusal::NoCompensation);
    flashed(&mut desktop, &blob("m", b"XY", 0.1));
    let value = -0.25;
    ask(&mut desktop, &Request::SetWeight { term: 1, value });
    let Reply::Weights(weights) = ask(&mut desktop, &Request::Weights) else {
        panic!()
    };
    let expected = trueaxis::link::TermWeight {
        term: 1,
        output: 1,
        value,
        limits: [-1.0, 1.0],
    };
    assert_eq!(&weights[..], [expected]);
}

#[test]
fn a_choice_of_which_only_half_was_written_is_stored_again_by_the_next_start() {
    for while_busy in EVERY {
        let mut slots = Slots::open(both(while_busy).stop());
        slots.set_standstill(true);
        let choice = Choice {
            enable: true,
            ..slots.choice()
        };
        let mut flash = slots.close();
        // One half, and part of the other one.
        flash.set_fuel(Some(40));
        slots = Slots::open(flash);
        slots.set_standstill(true);
        let _ = slots.choose(choice);
        let mut flash = slots.close();
        flash.set_fuel(None);
        slots = Slots::open(flash);
        assert!(slots.is_choice_halved());
        assert_eq!(slots.choice(), choice);
        let mut desktop = Desktop::start(slots.close(), PERIOD);
        assert_eq!(at_start(&mut desktop).storing, Storing::Pending);
        // If that stalls the servo, once the machine stands still.
        desktop.standstill.set(false);
        stand(&mut desktop, 10);
        let stalls = while_busy != WhileBusy::ServoInRam;
        assert_eq!(at_start(&mut desktop).storing == Storing::Pending, stalls);
        desktop.standstill.set(true);
        stand(&mut desktop, 4000);
        assert_eq!(at_start(&mut desktop).storing, Storing::Stored);
        assert!(status(&mut desktop).enabled);
        let slots = Slots::open(desktop.stop());
        assert!(!slots.is_choice_halved());
        assert_eq!(slots.choice(), choice);
    }
}
