//! Several hosts, hosts that stop responding, and hosts that never stop.

use super::*;

/// Servo periods for this time without any request.
fn pass(desktop: &mut Desktop, seconds: u32) {
    for _ in 0..seconds {
        desktop.turn((1.0 / PERIOD) as u32);
    }
    desktop.turn(1);
}

/// Activates a slot and enables the corrections.
fn activate(desktop: &mut Desktop, slot: Slot) {
    let activate = Request::Activate { slot, force: false };
    for request in [activate, Request::Referenced(3), Request::Enable(true)] {
        ask(desktop, &request);
    }
}

/// An upload begun, erased, and its first 64 bytes written.
fn begun(desktop: &mut Desktop, blob: &[u8]) {
    receiving(desktop, blob);
    let bytes = &blob[..64];
    let written = ask(desktop, &Request::Chunk { offset: 0, bytes });
    assert!(matches!(
        written,
        Reply::Upload(Upload::Receiving { next: 64, .. })
    ));
}

#[test]
fn of_two_hosts_that_upload_the_second_one_is_refused_until_the_first_one_has_died() {
    for while_busy in [WhileBusy::DualBank, WhileBusy::Standstill] {
        let [first, second] = [0.1, 0.2].map(|scale| blob("m", b"XY", scale));
        let mut desktop = fresh(while_busy);
        begun(&mut desktop, &first);
        let refused = |wait| Reply::Refused(Refusal::Uploading { wait });
        assert_eq!(begin(&mut desktop, &second), refused(GIVEN_UP));
        pass(&mut desktop, 5);
        assert_eq!(begin(&mut desktop, &second), refused(GIVEN_UP - 5));
        // The first one is not affected, and each of its requests resets the timeout.
        let bytes = &first[64..128];
        let written = ask(&mut desktop, &Request::Chunk { offset: 64, bytes });
        assert!(matches!(written, Reply::Upload(_)));
        pass(&mut desktop, GIVEN_UP - 1);
        assert_eq!(begin(&mut desktop, &second), refused(1));
        assert_eq!(status(&mut desktop).suspended, desktop.device.stalls());
        // It no longer responds: the servo resumes, and the other host may upload.
        pass(&mut desktop, 2);
        assert_eq!(status(&mut desktop).upload, Upload::None);
        assert!(!status(&mut desktop).suspended);
        assert!(matches!(begin(&mut desktop, &second), Reply::Upload(_)));
        flashed(&mut desktop, &second);
    }
}

#[test]
fn a_host_that_dies_while_the_corrections_go_to_zero_or_the_machine_moves_does_no_harm() {
    let [first, second, third] = [0.1, 0.2, 0.3].map(|scale| blob("m", b"XY", scale));
    let mut desktop = fresh(WhileBusy::Standstill);
    flashed(&mut desktop, &first);
    let_in(&mut desktop);
    settle(&mut desktop);
    assert_eq!(begin(&mut desktop, &second), Reply::Upload(Upload::Ramping));
    let refused = Reply::Refused(Refusal::Uploading { wait: GIVEN_UP });
    assert_eq!(begin(&mut desktop, &third), refused);
    begun(&mut desktop, &second);
    desktop.standstill.set(false);
    desktop.turn(1);
    let paused = status(&mut desktop).upload;
    assert!(matches!(paused, Upload::Paused { next: 64, .. }));
    desktop.standstill.set(true);
    assert!(matches!(
        begin(&mut desktop, &third),
        Reply::Refused(Refusal::Uploading { .. })
    ));
    pass(&mut desktop, GIVEN_UP + 1);
    assert_eq!(status(&mut desktop).upload, Upload::None);
    settle(&mut desktop);
    assert!(status(&mut desktop).dq[0] != 0.0, "enabled as before");
    flashed(&mut desktop, &third);
}

#[test]
fn what_a_dead_host_has_sent_is_not_erased_for_the_next_one_with_the_same() {
    let blob = blob("m", b"XY", 0.1);
    let mut desktop = fresh(WhileBusy::DualBank);
    begun(&mut desktop, &blob);
    pass(&mut desktop, GIVEN_UP + 1);
    assert_eq!(status(&mut desktop).upload, Upload::None);
    flashed(&mut desktop, &blob);
    assert_eq!(desktop.device.slots().wear(Slot::A), 1);
}

/// Without requests: each turn of the main loop does this by itself.
#[test]
fn a_machine_that_moves_pauses_an_upload_without_a_word_of_the_host() {
    let [first, second] = [0.1, 0.2].map(|scale| blob("m", b"XY", scale));
    let mut desktop = fresh(WhileBusy::Standstill);
    flashed(&mut desktop, &first);
    let_in(&mut desktop);
    settle(&mut desktop);
    let suspended = |desktop: &Desktop| desktop.servo.lock(|side| side.is_suspended());
    let factor = |desktop: &Desktop| desktop.servo.lock(|side| side.servo().factor());

    // While ramping to zero.
    begin(&mut desktop, &second);
    desktop.turn(10);
    assert!(factor(&desktop) < 1.0);
    desktop.standstill.set(false);
    desktop.turn(1);
    assert_eq!(desktop.device.upload(), Upload::None);
    settle(&mut desktop);
    assert_eq!(factor(&desktop), 1.0);

    // In the middle of the erase.
    desktop.standstill.set(true);
    begin(&mut desktop, &second);
    while !matches!(desktop.device.upload(), Upload::Erasing { done: 3, .. }) {
        desktop.turn(1);
    }
    assert!(suspended(&desktop));
    desktop.standstill.set(false);
    let spent = desktop.device.slots().flash().spent();
    desktop.turn(5);
    assert!(!suspended(&desktop));
    assert_eq!(desktop.device.slots().flash().spent(), spent);
    settle(&mut desktop);
    assert_eq!(factor(&desktop), 1.0);

    // Standstill alone erases nothing; a host that asks again continues where it was.
    desktop.standstill.set(true);
    desktop.turn(100);
    assert_eq!(desktop.device.slots().flash().spent(), spent);
    assert_eq!(begin(&mut desktop, &second), Reply::Upload(Upload::Ramping));
    while desktop.device.upload() == Upload::Ramping {
        desktop.turn(1);
    }
    assert!(matches!(
        desktop.device.upload(),
        Upload::Erasing { done: 3, .. }
    ));
    begun(&mut desktop, &second);

    // In the middle of the bytes.
    desktop.standstill.set(false);
    desktop.turn(1);
    assert!(!suspended(&desktop));
    assert!(matches!(
        desktop.device.upload(),
        Upload::Paused { next: 64, .. }
    ));
    desktop.standstill.set(true);
    flashed(&mut desktop, &second);
    assert_eq!(desktop.device.slots().wear(Slot::B), 1);
}

#[test]
fn a_length_that_no_slot_holds_is_refused_whatever_the_machine_does() {
    let mut desktop = fresh(WhileBusy::Standstill);
    desktop.standstill.set(false);
    let held = desktop.device.slots().capacity();
    let header = trueaxis::HEADER as u32;
    for length in [0, header - 1, header, held, held + 1, u32::MAX] {
        let refused = if (header..=held).contains(&length) {
            Refusal::NotStandstill
        } else {
            Refusal::TooLong { held }
        };
        let begin = Request::Begin { length, crc: 1 };
        refuses(&mut desktop, &begin, refused);
    }
}

#[test]
fn erases_are_within_a_budget_for_each_hour() {
    let blobs: Vec<_> = (0..2)
        .map(|number| blob("m", b"XY", 0.1 + 0.1 * number as f32))
        .collect();
    for while_busy in [WhileBusy::DualBank, WhileBusy::Standstill] {
        let mut desktop = fresh(while_busy);
        for (number, blob) in (0..ERASES_PER_HOUR).zip(blobs.iter().cycle()) {
            assert!(
                matches!(upload(&mut desktop, blob, true), Reply::Upload(_)),
                "{number}"
            );
        }
        let seconds = desktop.servo.lock(|side| side.seconds());
        assert!(seconds <= 3, "{seconds}");
        activate(&mut desktop, Slot::A);
        settle(&mut desktop);
        // Nothing is done, the corrections do not change, and the answer states the time to wait.
        let spent = desktop.device.slots().flash().spent();
        let Reply::Refused(Refusal::Wear { wait }) = begin(&mut desktop, &blobs[0]) else {
            panic!()
        };
        assert!((3590..=3600).contains(&wait), "{wait}");
        assert_eq!(desktop.device.slots().flash().spent(), spent);
        let report = status(&mut desktop);
        assert!(matches!(
            report.upload,
            Upload::None | Upload::Committed { .. }
        ));
        assert!(!report.suspended);
        desktop.turn(10);
        assert_eq!(status(&mut desktop).factor, 1.0);
        pass(&mut desktop, wait);
        assert!(matches!(begin(&mut desktop, &blobs[0]), Reply::Upload(_)));
    }
}
