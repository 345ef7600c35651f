mod at_start;
mod hosts;
mod servo_side;

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::vec;
use std::vec::Vec;

use trueaxis::link::{
    Activation, EvaluateRow, Fault, Health, MOST_BODY, MOST_CHUNK, MotionResult, Refusal, Reply,
    Request, Restart, Slot, Upload, put_positions,
};
use trueaxis::{
    AlignedBlob, Auxiliary, AuxiliaryKind, Axis, Conditions, Correction, Counts, Direction, Draft,
    DraftBank, Inputs, Interpolation, SampleFormat, Servo, Term, Travel, Travelling,
};

use crate::desktop::{Desktop, Side};
use crate::link::{Answer, Controller};
use crate::mock_flash::MockFlash;
use crate::slots::WhileBusy;

use super::*;

const PERIOD: f32 = 0.001;

/// X and Y; ΔX = scale · f(Y), up to `scale` mm.
pub(crate) fn blob(machine: &str, axes: &[u8], scale: f32) -> AlignedBlob {
    draft(machine, axes, scale).encode().unwrap()
}

/// The draft encoded by [`blob`].
pub(crate) fn draft(machine: &str, axes: &[u8], scale: f32) -> Draft {
    let axis = |&name: &u8| Axis {
        name,
        travel: [-1000.0, 1000.0],
        period: 0.0,
        value_bound: 0.5,
        rate_bound: 10.0,
        reversal_threshold: 0.01,
        ramp_rate: 2.0,
        reversal_rate: 10.0,
        reversal_acceleration: 40.0,
    };
    let bank = |direction, column| DraftBank {
        input: 1,
        start: -100.0,
        step: 50.0,
        modulo: false,
        direction,
        interpolation: Interpolation::Cubic,
        format: SampleFormat::F32,
        columns: vec![column],
    };
    let term = |output, weight, factors: &[u8]| Term {
        output,
        weight,
        limits: (output == 1).then_some([-1.0, 1.0]),
        factors: factors.try_into().unwrap(),
    };
    Draft {
        machine: machine.into(),
        axes: axes.iter().map(axis).collect(),
        banks: vec![
            // 1 at −50: of three equal samples.
            bank(Direction::Both, vec![0.0, 1.0, 1.0, 1.0, -0.5, 0.75]),
            bank(Direction::Signed, vec![0.1; 5]),
        ],
        terms: vec![term(0, scale, &[0]), term(1, 0.5, &[1])],
        ..Draft::default()
    }
}

fn flash(while_busy: WhileBusy) -> MockFlash {
    MockFlash::new(8).with_while_busy(while_busy)
}

pub(crate) struct Source(pub Option<Command<[f32; 8]>>);

impl PositionSource<[f32; 8]> for Source {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        self.0
    }
}

#[derive(Default)]
struct Sink(Vec<Correction<[f32; 8]>>);

impl CorrectionSink<[f32; 8]> for Sink {
    fn give(&mut self, correction: &Correction<[f32; 8]>, _: bool) {
        self.0.push(*correction);
    }
}

fn fresh(while_busy: WhileBusy) -> Desktop {
    Desktop::start(flash(while_busy), PERIOD)
}

/// With a compensation in use.
fn holding(scale: f32) -> Desktop {
    let mut desktop = fresh(WhileBusy::DualBank);
    flashed(&mut desktop, &blob("m", b"XY", scale));
    desktop
}

fn let_in(desktop: &mut Desktop) {
    for request in [Request::Referenced(3), Request::Enable(true)] {
        assert_eq!(ask(desktop, &request), Reply::Done);
    }
}

fn refuses(desktop: &mut Desktop, request: &Request<'_>, refusal: Refusal) {
    assert_eq!(ask(desktop, request), Reply::Refused(refusal));
}

fn weigh(desktop: &mut Desktop, value: f32) {
    let request = Request::SetWeight { term: 1, value };
    assert_eq!(ask(desktop, &request), Reply::Done);
}

fn active(desktop: &Desktop) -> Option<Slot> {
    match desktop.device.activation() {
        Activation::Active(slot) => slot,
        other => panic!("{other:?}"),
    }
}

fn begin(desktop: &mut Desktop, blob: &[u8]) -> Reply<'static> {
    let (length, crc) = announced(blob);
    ask(desktop, &Request::Begin { length, crc })
}

fn receiving(desktop: &mut Desktop, blob: &[u8]) {
    while !matches!(
        begin(desktop, blob),
        Reply::Upload(Upload::Receiving { .. })
    ) {
        desktop.turn(1);
    }
}

fn await_active(desktop: &mut Desktop, slot: Option<Slot>) {
    while desktop.device.activation() != Activation::Active(slot) {
        desktop.turn(1);
    }
}

fn ask(desktop: &mut Desktop, request: &Request<'_>) -> Reply<'static> {
    let mut rows = [0; MOST_BODY];
    match desktop.device.answer(request, &mut rows) {
        Answer::Now(Reply::Refused(refusal)) => Reply::Refused(refusal),
        Answer::Now(Reply::Upload(upload)) => Reply::Upload(upload),
        Answer::Now(Reply::Activation(activation)) => Reply::Activation(activation),
        Answer::Now(Reply::Status(report)) => Reply::Status(report),
        Answer::Now(Reply::Health(health)) => Reply::Health(health),
        Answer::Now(Reply::AtStart(at_start)) => Reply::AtStart(at_start),
        Answer::Now(Reply::Weights(weights)) => Reply::Weights(weights),
        Answer::Now(Reply::Done) => Reply::Done,
        Answer::Now(other) => Reply::Corrections(match other {
            Reply::Corrections(bytes) => bytes.to_vec().leak(),
            _ => unreachable!(),
        }),
        Answer::Later => Reply::Done,
    }
}

fn status(desktop: &mut Desktop) -> trueaxis::link::Report {
    let Reply::Status(report) = ask(desktop, &Request::Status) else {
        unreachable!()
    };
    report
}

fn announced(blob: &[u8]) -> (u32, u32) {
    let word = |at: usize| u32::from_le_bytes(blob[at..at + 4].try_into().unwrap());
    (word(8), word(12))
}

/// Uploads and commits; ticks continue meanwhile.
fn upload(desktop: &mut Desktop, blob: &[u8], force: bool) -> Reply<'static> {
    upload_with(desktop, blob, &Request::Commit { force })
}

/// Like `upload`, with another request at the end.
fn upload_with(desktop: &mut Desktop, blob: &[u8], last: &Request<'_>) -> Reply<'static> {
    let (length, crc) = announced(blob);
    let mut next = loop {
        match ask(desktop, &Request::Begin { length, crc }) {
            Reply::Upload(Upload::Receiving { next, .. }) => break next,
            Reply::Upload(_) => desktop.turn(10),
            other => return other,
        }
    };
    while next < length {
        let end = blob.len().min(next as usize + MOST_CHUNK);
        let bytes = &blob[next as usize..end];
        match ask(
            desktop,
            &Request::Chunk {
                offset: next,
                bytes,
            },
        ) {
            Reply::Upload(Upload::Receiving { next: n, .. }) => next = n,
            other => return other,
        }
        desktop.turn(1);
    }
    ask(desktop, last)
}

/// Ends with an active slot.
pub(crate) fn flashed(desktop: &mut Desktop, blob: &[u8]) -> Slot {
    let Reply::Upload(Upload::Committed { slot, .. }) = upload(desktop, blob, false) else {
        panic!("not committed")
    };
    let activate = Request::Activate { slot, force: false };
    for _ in 0..10_000 {
        match ask(desktop, &activate) {
            Reply::Activation(Activation::Active(Some(active))) if active == slot => return slot,
            Reply::Activation(_) => desktop.turn(1),
            other => panic!("{other:?}"),
        }
    }
    panic!("not active")
}

fn moved(desktop: &mut Desktop, rows: &[[f32; 2]]) -> Vec<Correction<[f32; 8]>> {
    let mut bytes = vec![0; rows.len() * 8];
    let mut rest = &mut bytes[..];
    for row in rows {
        rest = put_positions(row, 2, rest).unwrap();
    }
    assert_eq!(ask(desktop, &Request::Motion(&bytes)), Reply::Done);
    desktop.turn(rows.len() as u32 + 3);
    let mut out = [0; MOST_BODY];
    let Some(Reply::Motion(mut bytes)) = desktop.device.motion_answer(&mut out) else {
        panic!("no answer")
    };
    let mut results = vec![];
    while !bytes.is_empty() {
        let (result, rest) = MotionResult::get(bytes, 2).unwrap();
        results.push(result.0);
        bytes = rest;
    }
    results
}

/// Stays at one place until the corrections are fully in.
fn settle(desktop: &mut Desktop) {
    for _ in 0..100 {
        moved(desktop, &[[0.0, -50.0]; 8]);
    }
}

#[test]
fn without_a_compensation_the_corrections_are_zero_and_the_fault_says_why() {
    let mut desktop = fresh(WhileBusy::DualBank);
    assert_eq!(desktop.device.fault(), Some(Fault::NoCompensation));
    assert_eq!(
        ask(&mut desktop, &Request::Motion(&[0; 8])),
        Reply::Refused(Refusal::NoCompensation)
    );
    let hello = desktop.device.hello(1);
    assert_eq!((hello.machine, hello.axes.as_str()), ("", ""));
    assert_eq!(hello.capacities.tables, 96);
}

#[test]
fn at_start_what_was_in_use_is_active_and_otherwise_what_was_before_it() {
    let [first, second] = [0.1, 0.2].map(|scale| blob("m", b"XY", scale));
    let mut desktop = fresh(WhileBusy::DualBank);
    assert_eq!(flashed(&mut desktop, &first), Slot::A);
    assert_eq!(flashed(&mut desktop, &second), Slot::B);
    desktop = desktop.restart();
    assert_eq!(active(&desktop), Some(Slot::B));
    assert_eq!(desktop.device.fault(), None);
    // Now it is damaged.
    let mut flash = desktop.stop();
    flash.flip(Slot::B, 8 * 100);
    let desktop = Desktop::start(flash, PERIOD);
    assert_eq!(active(&desktop), Some(Slot::A));
    assert_eq!(desktop.device.fault(), Some(Fault::Lost));
}

#[test]
fn a_blob_that_this_firmware_cannot_use_is_a_fault_at_start() {
    let nine = blob("m", b"XYZUVWABC", 0.1);
    let mut desktop = fresh(WhileBusy::DualBank);
    let good = blob("m", b"XY", 0.1);
    flashed(&mut desktop, &good);
    let mut slots = Slots::open(desktop.stop());
    let (length, crc) = announced(&nine);
    slots.set_active(Some(Slot::A));
    slots.begin(length, crc).unwrap();
    while let Ok(crate::slots::Progress::Erasing { .. }) = slots.erase_step() {}
    slots.write(0, &nine).unwrap();
    // Written by firmware with larger capacities.
    slots.commit(|_| true).unwrap();
    slots.choose(slots.choosing(Slot::B)).unwrap();
    let desktop = Desktop::<4, 256>::start(slots.close(), PERIOD);
    assert!(matches!(
        desktop.device.fault(),
        Some(Fault::Load(
            Slot::B,
            trueaxis::LoadError::TooSmall {
                needed: Counts { axes: 9, .. },
                held: Counts { axes: 8, .. },
            }
        ))
    ));
    assert_eq!(active(&desktop), Some(Slot::A));
}

#[test]
fn a_motion_gives_what_a_servo_on_the_desktop_gives() {
    let blob = blob("m", b"XY", 0.3);
    let mut desktop = fresh(WhileBusy::DualBank);
    flashed(&mut desktop, &blob);
    let_in(&mut desktop);
    let mut compensation: std::boxed::Box<trueaxis::Compensation<'_>> =
        std::boxed::Box::new(trueaxis::Compensation::empty());
    compensation.load(&blob).unwrap();
    let mut servo = Servo::new(&compensation);
    servo.enable();
    for batch in 0..200 {
        if batch == 100 {
            weigh(&mut desktop, -0.25);
            servo.set_weight(1, -0.25).unwrap();
        }
        let at = |k: i32| [0.1, ((batch * 8 + k) as f32 * 0.01).sin() * 120.0];
        let rows: Vec<[f32; 2]> = (0..8).map(at).collect();
        for (row, result) in rows.iter().zip(moved(&mut desktop, &rows)) {
            let inputs = Inputs::at([row[0], row[1], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
            assert_eq!(result, servo.update(&inputs, 3, PERIOD));
        }
    }
    assert!(status(&mut desktop).dq[0] != 0.0);
    // And evaluated without state.
    let row = EvaluateRow {
        inputs: Inputs::at([1.0, 33.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        travelling: Travelling([Travel::Positive; 8]),
    };
    let mut bytes = vec![0; EvaluateRow::bytes(2, 0)];
    row.put(2, 0, &mut bytes).unwrap();
    let Reply::Corrections(answer) = ask(&mut desktop, &Request::Evaluate(&bytes)) else {
        panic!()
    };
    let (dq, rest) = trueaxis::link::positions::<[f32; 8]>(answer, 2).unwrap();
    let weights = *servo.wanted_weights();
    assert_eq!(
        dq,
        compensation.evaluate(&row.inputs, &row.travelling, &weights)
    );
    assert!(rest.is_empty());
}

#[test]
fn where_the_flash_stalls_no_update_falls_into_an_erase_or_a_write() {
    let during = Arc::new(AtomicU32::new(0));
    let counted = Arc::clone(&during);
    let mut desktop =
        Desktop::start_watched(flash(WhileBusy::Standstill), PERIOD, |flash, servo| {
            let servo = servo.clone();
            flash.set_listener(move |_| {
                counted.fetch_add(1, Ordering::SeqCst);
                // The interrupt that waited for the flash.
                let updates = |side: &mut Side| (side.counters().updates, side.is_at_zero());
                let before = servo.lock(updates);
                servo.tick();
                assert_eq!(servo.lock(updates), before, "the servo was updated");
                assert!(before.1, "a correction is not zero");
                assert!(servo.lock(|side| side.is_suspended()));
            });
        });
    let first = blob("m", b"XY", 0.3);
    flashed(&mut desktop, &first);
    let_in(&mut desktop);
    settle(&mut desktop);
    assert!(status(&mut desktop).dq[0] != 0.0);
    let writes = during.load(Ordering::SeqCst);
    assert!(writes > 0);

    // Refused while the machine may move; the corrections are not affected.
    desktop.standstill.set(false);
    let second = blob("m", b"XY", 0.2);
    let (length, crc) = announced(&second);
    let begin = Request::Begin { length, crc };
    refuses(&mut desktop, &begin, Refusal::NotStandstill);
    assert!(!status(&mut desktop).suspended);
    assert_eq!(during.load(Ordering::SeqCst), writes);

    // At standstill the corrections ramp to zero first, by themselves, because nothing commands now.
    desktop.standstill.set(true);
    assert_eq!(ask(&mut desktop, &begin), Reply::Upload(Upload::Ramping));
    // The slot about to be erased cannot become active meanwhile, and no motion starts.
    let activate = Request::Activate {
        slot: Slot::B,
        force: false,
    };
    let row: Vec<u8> = [0.0_f32, 0.0]
        .iter()
        .flat_map(|q| q.to_le_bytes())
        .collect();
    for request in [activate, Request::Motion(&row)] {
        refuses(&mut desktop, &request, Refusal::Busy);
    }
    let mut last = status(&mut desktop).dq[0];
    let mut seen = vec![];
    while status(&mut desktop).upload == Upload::Ramping {
        desktop.turn(1);
        let dq = status(&mut desktop).dq[0];
        assert!(
            (dq - last).abs() <= 2.0 * PERIOD * 1.001,
            "from {last} to {dq}"
        );
        last = dq;
    }
    assert_eq!(last, 0.0);
    while let upload @ Upload::Erasing { .. } = status(&mut desktop).upload {
        seen.push(upload);
        desktop.turn(1);
    }
    assert_eq!(seen.len(), 8, "one block a turn, visible: {seen:?}");
    let motion = Request::Motion(&[0; 8]);
    refuses(&mut desktop, &motion, Refusal::Suspended);

    // The machine starts to move in the middle: the servo resumes, the upload waits.
    let chunk = Request::Chunk {
        offset: 0,
        bytes: &second[..64],
    };
    assert!(matches!(ask(&mut desktop, &chunk), Reply::Upload(_)));
    desktop.standstill.set(false);
    let more = Request::Chunk {
        offset: 64,
        bytes: &second[64..],
    };
    refuses(&mut desktop, &more, Refusal::NotStandstill);
    let report = status(&mut desktop);
    assert!(matches!(report.upload, Upload::Paused { next: 64, .. }));
    assert!(!report.suspended);
    settle(&mut desktop);
    assert!(status(&mut desktop).dq[0] != 0.0, "enabled as before");

    // At standstill again it continues where it was.
    desktop.standstill.set(true);
    let slot = flashed(&mut desktop, &second);
    assert_eq!(slot, Slot::B);
    assert!(!status(&mut desktop).suspended);
    settle(&mut desktop);
    assert!((status(&mut desktop).dq[0] - 0.2).abs() < 1e-4);
    assert_eq!(desktop.device.slots().wear(Slot::B), 1, "erased once");
}

#[test]
fn another_machine_is_taken_only_by_force() {
    let mut desktop = holding(0.3);
    for other in [blob("n", b"XY", 0.3), blob("m", b"XZ", 0.3)] {
        let refused = upload(&mut desktop, &other, false);
        assert_eq!(refused, Reply::Refused(Refusal::OtherMachine));
        ask(&mut desktop, &Request::Abort);
    }
    let_in(&mut desktop);
    settle(&mut desktop);
    let other = blob("n", b"YX", 0.2);
    let Reply::Upload(Upload::Committed { slot, .. }) = upload(&mut desktop, &other, true) else {
        panic!()
    };
    let polite = Request::Activate { slot, force: false };
    refuses(&mut desktop, &polite, Refusal::OtherMachine);
    let force = Request::Activate { slot, force: true };
    assert_eq!(
        ask(&mut desktop, &force),
        Reply::Activation(Activation::Ramping(slot))
    );
    // An upload would overwrite what is about to be read.
    let begin = Request::Begin {
        length: 100,
        crc: 0,
    };
    refuses(&mut desktop, &begin, Refusal::Busy);
    let mut last = status(&mut desktop).dq[0];
    while desktop.device.activation() != Activation::Active(Some(slot)) {
        desktop.turn(1);
        let dq = status(&mut desktop).dq[0];
        assert!((dq - last).abs() <= 2.0 * PERIOD * 1.001);
        last = dq;
    }
    assert_eq!(desktop.device.hello(1).machine, "n");
    assert_eq!(
        status(&mut desktop).referenced,
        0,
        "known of the old axes only"
    );
}

#[test]
fn a_source_that_falls_silent_is_held_and_then_ramped_to_zero() {
    let mut desktop = holding(0.3);
    ask(&mut desktop, &Request::Enable(true));
    let mut spi = Source(Some(Command::new(
        [0.0, -50.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        3,
    )));
    let ticks = |spi: &mut Source, count| {
        let mut drives = Sink::default();
        for _ in 0..count {
            let tick = |side: &mut Side| side.tick(spi, &mut drives, &NoClock);
            desktop.servo.lock(tick);
        }
        drives.0
    };
    let settled = *ticks(&mut spi, 1000).last().unwrap();
    assert!((settled.dq[0] - 0.3).abs() < 1e-4);
    spi.0 = None;
    // Until the patience is over.
    let held = ticks(&mut spi, 9);
    assert!(
        held.iter()
            .all(|c| c.dq == settled.dq && c.status.is(Conditions::HELD))
    );
    let mut last = settled.dq[0];
    for correction in ticks(&mut spi, 1000) {
        assert!((correction.dq[0] - last).abs() <= 2.0 * PERIOD * 1.001);
        last = correction.dq[0];
    }
    assert_eq!(last, 0.0);
    let report = status(&mut desktop);
    assert_eq!(report.missed, 1009);
    // The link does not command, or the corrections would return during the fault.
    assert_eq!(
        ask(&mut desktop, &Request::Motion(&[0; 8])),
        Reply::Refused(Refusal::Occupied)
    );
}

/// A source of the board that gives this in every period, or nothing if `None`.
fn tick(desktop: &Desktop, source: &mut Source) {
    let ticked = |side: &mut Side| side.tick(source, &mut LinkOnly, &NoClock);
    desktop.servo.lock(ticked);
}

#[test]
fn neither_host_nor_motion_side_lets_corrections_in_that_the_other_has_taken_out() {
    let at = |enabling| Command {
        enabling,
        ..Command::new([0.0; 8], 3)
    };
    // The host's request; the results for the motion side being absent, leaving it to the host, on, off.
    for (host, expected) in [
        (None, [false, false, true, false]),
        (Some(true), [true, true, true, false]),
        (Some(false), [false, false, false, false]),
    ] {
        let says = [
            None,
            Some(at(Enabling::Host)),
            Some(at(Enabling::On)),
            Some(at(Enabling::Off)),
        ];
        for (command, expected) in says.into_iter().zip(expected) {
            // In either order.
            for first in [true, false] {
                let mut desktop = holding(0.3);
                let say = |desktop: &mut Desktop| {
                    if let Some(on) = host {
                        ask(desktop, &Request::Enable(on));
                    }
                };
                if first {
                    say(&mut desktop);
                }
                tick(&desktop, &mut Source(command));
                if !first {
                    say(&mut desktop);
                }
                assert_eq!(
                    status(&mut desktop).enabled,
                    expected,
                    "{host:?} {command:?}"
                );
                for _ in 0..2000 {
                    tick(&desktop, &mut Source(command.or(Some(at(Enabling::Host)))));
                }
                let factor = if expected { 1.0 } else { 0.0 };
                assert_eq!(status(&mut desktop).factor, factor);
            }
        }
    }
}

#[test]
fn what_the_motion_side_wants_holds_while_it_is_silent_and_while_the_servo_is_suspended() {
    let mut desktop = holding(0.3);
    let on = Command {
        enabling: Enabling::On,
        ..Command::new([0.0; 8], 3)
    };
    tick(&desktop, &mut Source(Some(on)));
    for _ in 0..1000 {
        tick(&desktop, &mut Source(None));
    }
    assert!(status(&mut desktop).enabled);
    desktop.servo.lock(|side| side.suspend(true));
    let off = Command {
        enabling: Enabling::Off,
        axes: [1.0; 8],
        ..on
    };
    tick(&desktop, &mut Source(Some(off)));
    let report = status(&mut desktop);
    assert!(!report.enabled);
    assert_eq!((report.positions[0], report.referenced), (1.0, 3));
}

#[test]
fn the_tool_length_of_the_motion_side_counts_while_it_gives_one() {
    let mut draft = draft("m", b"XY", 0.3);
    draft.auxiliaries = vec![Auxiliary {
        kind: AuxiliaryKind::ToolLength,
        name: "tool".try_into().unwrap(),
        reference: 100.0,
        sensor: trueaxis::Sensor::USUAL,
    }];
    let mut desktop = fresh(WhileBusy::DualBank);
    flashed(&mut desktop, &draft.encode().unwrap());
    let with = |tool_length| {
        Some(Command {
            tool_length,
            ..Command::new([0.0; 8], 3)
        })
    };
    let length = |desktop: &mut Desktop| status(desktop).auxiliaries[0];
    assert!(length(&mut desktop).is_nan());
    tick(&desktop, &mut Source(with(Some(130.0))));
    assert_eq!(length(&mut desktop), 130.0);
    ask(&mut desktop, &Request::ToolLength(95.5));
    assert_eq!(length(&mut desktop), 130.0);
    tick(&desktop, &mut Source(with(Some(131.0))));
    assert_eq!(length(&mut desktop), 131.0);
    tick(&desktop, &mut Source(with(None)));
    assert_eq!(length(&mut desktop), 95.5);
    // The servo ignores a NaN tool length, even from the host.
    tick(&desktop, &mut Source(with(Some(f32::NAN))));
    assert!(length(&mut desktop).is_nan());
}

#[test]
fn corrections_that_are_wanted_and_held_are_a_fault_and_others_are_none() {
    let mut desktop = holding(0.3);
    let healthy = |desktop: &Desktop| desktop.servo.lock(|side| side.is_healthy());
    let mut here = Source(Some(Command::new([0.0; 8], 3)));
    let mut silent = Source(None);
    tick(&desktop, &mut here);
    tick(&desktop, &mut silent);
    assert!(healthy(&desktop), "none are wanted");
    ask(&mut desktop, &Request::Enable(true));
    for _ in 0..1000 {
        tick(&desktop, &mut here);
    }
    assert!(healthy(&desktop));
    tick(&desktop, &mut silent);
    assert!(!healthy(&desktop));
    tick(&desktop, &mut here);
    assert!(healthy(&desktop));
}

#[test]
fn health_shows_what_the_source_has_counted_and_why_the_controller_has_started() {
    struct Irregular;
    impl PositionSource<[f32; 8]> for Irregular {
        fn take(&mut self) -> Option<Command<[f32; 8]>> {
            None
        }
        fn regularity(&self) -> Regularity {
            Regularity {
                frames: 1,
                repeated: 2,
                skipped: 3,
                damaged: 4,
                faults: 5,
                fault: true,
            }
        }
    }
    let mut desktop = fresh(WhileBusy::DualBank);
    desktop.servo.lock(|side| {
        side.set_overruns(6);
        side.tick(&mut Irregular, &mut LinkOnly, &NoClock);
    });
    let expected = Health {
        healthy: false,
        restart: Restart::PowerOn,
        frames: 1,
        repeated: 2,
        skipped: 3,
        damaged: 4,
        faults: 5,
        overruns: 6,
        garbled: 0,
    };
    assert_eq!(ask(&mut desktop, &Request::Health), Reply::Health(expected));
}
