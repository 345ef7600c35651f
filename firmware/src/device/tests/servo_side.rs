//! Counts and state of the servo side.

use std::boxed::Box;
use std::cell::Cell;

use trueaxis::link::{CostUnit, LimitCounts};
use trueaxis::{Auxiliary, AuxiliaryKind};

use super::*;
use crate::double_buffer::DoubleBuffer;
use crate::slots::Slots;

/// The count, and the increments after each query.
struct Costs<'a>(Cell<u32>, Cell<&'a [u32]>);

impl Clock for Costs<'_> {
    const UNIT: CostUnit = CostUnit::Cycles;

    fn now(&self) -> u32 {
        let now = self.0.get();
        if let [cost, rest @ ..] = self.1.get() {
            self.0.set(now.wrapping_add(*cost));
            self.1.set(rest);
        }
        now
    }
}

fn at(y: f32) -> Command<[f32; 8]> {
    Command::new([0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3)
}

fn started(scale: f32) -> Desktop {
    let mut desktop = fresh(WhileBusy::DualBank);
    flashed(&mut desktop, &blob("m", b"XY", scale));
    let_in(&mut desktop);
    desktop
}

#[test]
fn the_limits_are_counted_per_axis_as_the_servo_reports_them() {
    // Up to 0.9 mm where 0.5 are permitted, then that with jumps, then that at the end of the travel, then jumps there:
    // each kind of limit, alone and together.
    let mut desktop = started(0.9);
    let mut counted = [LimitCounts::default(); 2];
    for batch in 0..400 {
        if batch == 300 {
            // Only X from here on.
            weigh(&mut desktop, 0.0);
        }
        let [x, y] = match batch {
            0..100 => [0.0, -50.0],
            100..200 => [0.0, [-50.0, 90.0][batch / 20 % 2]],
            200..300 => [1000.0, -50.0],
            _ => [999.95, [20.0, 90.0][batch / 20 % 2]],
        };
        for result in moved(&mut desktop, &[[x, y]; 8]) {
            let status = result.status;
            for (k, limits) in counted.iter_mut().enumerate() {
                let acts = |mask: u16| u32::from(mask & (1 << k) != 0);
                limits.value += acts(status.saturated);
                limits.rate += acts(status.rate_limited);
                limits.travel += acts(status.travel_limited);
            }
        }
    }
    let report = status(&mut desktop);
    assert_eq!(report.limits.as_slice(), counted);
    let [x, y] = counted;
    assert!(x.value > 0 && x.rate > 0 && x.travel > 0, "{x:?}");
    assert_ne!(x, y);
    assert_eq!((report.missed, report.cost_unit), (0, CostUnit::None));
}

#[test]
fn the_last_and_the_largest_cost_are_kept() {
    let desktop = started(0.3);
    // The increments within an update and between two updates; the count wraps within the first.
    let costs = [7, 100, 12, 100, 5, 100, 12, 100];
    let clock = Costs(Cell::new(u32::MAX - 3), Cell::new(&costs));
    let mut seen = vec![];
    desktop.servo.lock(|side| {
        let before = side.counters().updates;
        for _ in 0..4 {
            side.tick(&mut Source(Some(at(0.0))), &mut Sink::default(), &clock);
            let counters = side.counters();
            seen.push((counters.cost, counters.worst_cost));
        }
        assert_eq!(side.counters().updates, before + 4);
        assert_eq!(side.counters().cost_unit, CostUnit::Cycles);
    });
    assert_eq!(seen, [(7, 7), (12, 12), (5, 12), (12, 12)]);
}

#[test]
fn while_suspended_nothing_is_computed_and_the_place_remains_known() {
    let mut desktop = started(0.3);
    settle(&mut desktop);
    desktop.servo.lock(|side| {
        let (last, updates) = (*side.last(), side.counters().updates);
        assert!(last.dq[0] != 0.0);
        side.suspend(true);
        let mut sink = Sink::default();
        let mut command = at(12.0);
        command.referenced = 1;
        side.tick(&mut Source(Some(command)), &mut sink, &NoClock);
        assert_eq!(side.positions()[1], 12.0);
        assert_eq!(side.snapshot().referenced, 1);
        // NaN counts as having no position.
        side.tick(&mut Source(Some(at(f32::NAN))), &mut sink, &NoClock);
        side.tick(&mut Source(None), &mut sink, &NoClock);
        assert_eq!(side.positions()[1], 12.0);
        assert_eq!(sink.0, [last; 3], "the last one is given again");
        assert_eq!(side.counters().updates, updates);
        assert_eq!(side.counters().missed, 0);
        // The source has commanded, so the link does not.
        assert!(!side.begin_batch());
        side.suspend(false);
        side.tick(&mut Source(None), &mut sink, &NoClock);
        assert_eq!(side.counters().missed, 1);
        assert_eq!(side.counters().updates, updates + 1);
    });
}

#[test]
fn once_a_source_has_commanded_the_link_does_not_even_in_a_long_silence() {
    let desktop = started(0.3);
    desktop.servo.lock(|side| {
        assert!(side.begin_batch(), "no source yet");
        side.tick(&mut Source(Some(at(0.0))), &mut LinkOnly, &NoClock);
        for _ in 0..100_000 {
            assert!(!side.begin_batch());
            side.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
        }
    });
}

#[test]
fn a_batch_has_room_for_so_many_and_results_come_one_by_one() {
    let desktop = started(0.3);
    desktop.servo.lock(|side| {
        assert!(side.begin_batch());
        for _ in 0..trueaxis::link::MOST_ROWS {
            assert!(side.push([0.0; 8]));
        }
        assert!(!side.push([0.0; 8]));
        assert!(side.result(0).is_none());
        let mut sink = Sink::default();
        for row in 0..trueaxis::link::MOST_ROWS {
            assert!(side.result(row).is_none());
            side.tick(&mut LinkOnly, &mut sink, &NoClock);
            assert_eq!(side.result(row), sink.0.last().copied());
        }
        // All taken: there are no commands, so nothing is updated or output.
        let updates = side.counters().updates;
        side.tick(&mut LinkOnly, &mut sink, &NoClock);
        assert_eq!(side.counters().updates, updates);
        assert_eq!(sink.0.len(), trueaxis::link::MOST_ROWS);
        side.end_batch();
        assert!(side.result(0).is_none());
    });
}

/// A machine with a tool length and a temperature.
fn with_auxiliaries(machine: &str) -> AlignedBlob {
    let auxiliary = |kind, name: &str, reference| Auxiliary {
        kind,
        name: name.try_into().unwrap(),
        reference,
        sensor: trueaxis::Sensor::USUAL,
    };
    let axis = Axis {
        name: b'X',
        travel: [-100.0, 100.0],
        period: 0.0,
        value_bound: 0.5,
        rate_bound: 10.0,
        reversal_threshold: 0.01,
        ramp_rate: 2.0,
        reversal_rate: 10.0,
        reversal_acceleration: 40.0,
    };
    let draft = Draft {
        machine: machine.into(),
        axes: vec![axis],
        auxiliaries: vec![
            auxiliary(AuxiliaryKind::ToolLength, "", 100.0),
            auxiliary(AuxiliaryKind::Temperature, "bed", 20.0),
        ],
        ..Draft::default()
    };
    draft.encode().unwrap()
}

#[test]
fn another_compensation_finds_the_settings_and_no_stale_auxiliary() {
    let mut desktop = started(0.3);
    let settings = [
        Request::ToolLength(150.0),
        Request::DryRun(true),
        Request::Referenced(3),
    ];
    for request in settings {
        assert_eq!(ask(&mut desktop, &request), Reply::Done);
    }
    let blob = with_auxiliaries("n");
    let Reply::Upload(Upload::Committed { slot, .. }) = upload(&mut desktop, &blob, true) else {
        panic!()
    };
    let force = Request::Activate { slot, force: true };
    ask(&mut desktop, &force);
    await_active(&mut desktop, Some(slot));
    let report = status(&mut desktop);
    assert_eq!(report.auxiliaries[0], 150.0);
    assert!(report.auxiliaries[1].is_nan(), "not measured yet");
    assert!(report.enabled && report.dry_run && !report.suspended);
    assert_eq!(report.referenced, 0);
    desktop.servo.lock(|side| {
        side.set_auxiliary(1, 2.5);
        // There is no auxiliary with this index.
        side.set_auxiliary(8, 7.0);
        side.set_sensors_lost(0b10);
        assert!(side.is_enabled());
    });
    let report = status(&mut desktop);
    assert_eq!(report.auxiliaries.as_slice(), [150.0, 2.5]);
    assert_eq!(report.sensors_lost, 0b10);
    // A new tool length leaves the temperature unchanged.
    assert_eq!(ask(&mut desktop, &Request::ToolLength(80.0)), Reply::Done);
    let report = status(&mut desktop);
    assert_eq!(report.auxiliaries.as_slice(), [80.0, 2.5]);
    assert_eq!(desktop.device.hello(1).auxiliaries, 2);
    for length in [f32::NAN, f32::INFINITY] {
        refuses(
            &mut desktop,
            &Request::ToolLength(length),
            Refusal::NotFinite,
        );
    }
}

#[test]
fn rows_that_do_not_fit_are_refused() {
    let mut desktop = started(0.3);
    let refused = |reply| Reply::Refused(reply);
    for length in [0, 4, 7, 9, 12] {
        let bytes = vec![0; length];
        let reply = ask(&mut desktop, &Request::Motion(&bytes));
        assert_eq!(reply, refused(Refusal::BadRows));
    }
    let most = trueaxis::link::motion_rows(2);
    let bytes = vec![0; 8 * (most + 1)];
    let reply = ask(&mut desktop, &Request::Motion(&bytes));
    let most_told = most as u16;
    assert_eq!(reply, refused(Refusal::TooManyRows { most: most_told }));
    let whole = Request::Motion(&bytes[..8 * most]);
    assert_eq!(ask(&mut desktop, &whole), Reply::Done);
    let row = EvaluateRow::bytes(2, 0);
    for length in [0, 1, row - 1, row + 1, 2 * row - 1] {
        let bytes = vec![0; length];
        let reply = ask(&mut desktop, &Request::Evaluate(&bytes));
        assert_eq!(reply, refused(Refusal::BadRows));
    }
    // Two rows give two corrections.
    let mut bytes = vec![0; 2 * row];
    for (place, y) in bytes.chunks_mut(row).zip([-50.0, 30.0]) {
        let row = EvaluateRow {
            inputs: Inputs::at([0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            travelling: Travelling([Travel::Positive; 8]),
        };
        row.put(2, 0, place).unwrap();
    }
    let Reply::Corrections(answer) = ask(&mut desktop, &Request::Evaluate(&bytes)) else {
        panic!()
    };
    assert_eq!(answer.len(), 16);
    assert_ne!(answer[..8], answer[8..]);
}

#[test]
fn a_motion_is_dropped_by_whatever_is_asked_next() {
    let mut desktop = started(0.3);
    let rows = Request::Motion(&[0; 16]);
    assert_eq!(ask(&mut desktop, &rows), Reply::Done);
    desktop.turn(1);
    // One of two has been taken, so there is no answer yet.
    let mut out = [0; MOST_BODY];
    assert!(desktop.device.motion_answer(&mut out).is_none());
    status(&mut desktop);
    let updates = desktop.servo.lock(|side| side.counters().updates);
    desktop.turn(5);
    assert!(desktop.device.motion_answer(&mut out).is_none());
    assert_eq!(
        desktop.servo.lock(|side| side.counters().updates),
        updates,
        "what was left is not taken"
    );
}

#[test]
fn what_the_device_shows_is_what_it_tells() {
    let mut desktop = started(0.3);
    let (length, crc) = announced(&blob("m", b"XY", 0.2));
    let begin = Request::Begin { length, crc };
    ask(&mut desktop, &begin);
    let told = status(&mut desktop).upload;
    assert_ne!(told, Upload::default());
    assert_eq!(desktop.device.upload(), told);
    assert_eq!(desktop.device.fault(), status(&mut desktop).fault);
    assert_eq!(desktop.device.compensation().machine(), "m");
    assert!(desktop.device.machine().standstill());
    desktop.standstill.set(false);
    assert!(!desktop.device.machine().standstill());
    desktop.device.servo().lock(|side| side.enable(false));
    assert!(!status(&mut desktop).enabled);
    let hello = desktop.device.hello(5);
    assert_eq!((hello.session, hello.board), (5, "desktop"));
    assert_eq!(hello.active, Some(Slot::A));
    assert_eq!((hello.axes.as_str(), hello.auxiliaries), ("XY", 0));
    let slots: Slots<_> = Slots::open(desktop.stop());
    assert_eq!(slots.newest(), Some(Slot::A));
}

#[test]
fn a_dry_run_computes_and_gives_nothing() {
    let mut desktop = started(0.3);
    for (dry, given) in [(true, 0.0), (false, 0.3)] {
        assert_eq!(ask(&mut desktop, &Request::DryRun(dry)), Reply::Done);
        settle(&mut desktop);
        let report = status(&mut desktop);
        assert_eq!(report.dry_run, dry);
        // The ramp ends within the resolution of f32.
        assert!((report.dq[0] - given).abs() < 1e-6, "{}", report.dq[0]);
        assert!((report.computed[0] - 0.3).abs() < 1e-6);
    }
}

#[test]
fn a_correction_that_happens_to_be_zero_is_not_at_rest() {
    // Both terms have zero weight.
    let mut desktop = started(0.0);
    weigh(&mut desktop, 0.0);
    for _ in 0..200 {
        moved(&mut desktop, &[[0.0, -100.0]; 8]);
    }
    let report = status(&mut desktop);
    assert_eq!(report.dq.as_slice(), [0.0; 2]);
    assert_eq!(report.factor, 1.0);
    assert!(desktop.servo.lock(|side| !side.is_at_zero()));
    assert_eq!(ask(&mut desktop, &Request::Enable(false)), Reply::Done);
    for _ in 0..200 {
        moved(&mut desktop, &[[0.0, -100.0]; 8]);
    }
    assert_eq!(status(&mut desktop).factor, 0.0);
    assert!(desktop.servo.lock(|side| side.is_at_zero()));
}

#[test]
fn what_is_kept_at_zero_stays_there_whatever_is_enabled() {
    let mut desktop = started(0.3);
    settle(&mut desktop);
    desktop.servo.lock(|side| side.keep_at_zero(true));
    assert_eq!(ask(&mut desktop, &Request::Enable(true)), Reply::Done);
    // Without commands it ramps by itself, and after that nothing is updated.
    for _ in 0..1000 {
        desktop.servo.tick();
    }
    let updates = desktop.servo.lock(|side| {
        assert!(side.is_at_zero() && side.is_enabled());
        side.counters().updates
    });
    desktop.turn(10);
    assert_eq!(desktop.servo.lock(|side| side.counters().updates), updates);
    settle(&mut desktop);
    assert!(desktop.servo.lock(|side| side.is_at_zero()));
    desktop.servo.lock(|side| side.keep_at_zero(false));
    settle(&mut desktop);
    assert!(desktop.servo.lock(|side| !side.is_at_zero()));
}

#[test]
fn another_compensation_is_let_in_only_if_enabled_and_not_kept_at_zero() {
    let buffers: &'static DoubleBuffer = Box::leak(Box::default());
    let (mut loader, servo) = buffers.split().unwrap();
    let blob: &'static AlignedBlob = Box::leak(Box::new(blob("m", b"XY", 0.3)));
    let mut side = ServoSide::new(servo, PERIOD);
    for (enabled, kept) in [(true, true), (false, false), (false, true), (true, false)] {
        side.enable(enabled);
        side.keep_at_zero(kept);
        side.replace(loader.load(&**blob).unwrap()).unwrap();
        for _ in 0..500 {
            side.tick(&mut Source(Some(at(-50.0))), &mut LinkOnly, &NoClock);
        }
        assert_eq!(side.is_at_zero(), !enabled || kept, "{enabled} {kept}");
    }
    assert_eq!(
        side.replace(loader.load(&**blob).unwrap()),
        Err(trueaxis::Refused::Busy),
        "not at zero"
    );
}
