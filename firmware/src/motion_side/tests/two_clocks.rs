//! Motion side and controller with two clocks, from the command to the correction added to it.

use std::boxed::Box;
use std::vec;

use trueaxis::{
    AlignedBlob, Axis, Direction, Draft, DraftBank, Holds, Interpolation, SampleFormat, Term,
};

use crate::device::{Command, Enabling, NoClock, Regularity, ServoSide};
use crate::double_buffer::DoubleBuffer;
use crate::motion_side::{Bounds, MotionSide};
use crate::spi::{Exchange, MOST, Tolerance, length};

/// Nominal period of both, ns.
const PERIOD: u64 = 250_000;
/// How long after the last frame a controller clocked by frames continues without one, in hundredths of a period.
const SILENCE: u64 = 150;

type Small = Holds<2, 4, 4, 4, 1>;

/// ΔX = 0.001 · X up to 0.1 mm; ΔZ = −ΔX.
fn blob() -> &'static [u8] {
    let axis = |name| Axis {
        name,
        travel: [-200.0, 200.0],
        period: 0.0,
        value_bound: 0.2,
        rate_bound: 2.0,
        reversal_threshold: 0.01,
        ramp_rate: 1.0,
        reversal_rate: 2.0,
        reversal_acceleration: 20.0,
    };
    let term = |output, weight| Term {
        output,
        weight,
        limits: None,
        factors: [0].as_slice().try_into().unwrap(),
    };
    let draft = Draft {
        machine: "m".into(),
        axes: vec![axis(b'X'), axis(b'Z')],
        banks: vec![DraftBank {
            input: 0,
            start: -100.0,
            step: 200.0,
            modulo: false,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![vec![-0.1, 0.1]],
        }],
        terms: vec![term(0, 1.0), term(1, -1.0)],
        ..Draft::default()
    };
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft.encode().unwrap()));
    blob
}

/// The servo side with tables, as after a start: no host has sent anything.
fn side() -> ServoSide<Small> {
    let buffers: &'static DoubleBuffer<Small> = Box::leak(Box::new(DoubleBuffer::new()));
    let (mut loader, servo) = buffers.split().unwrap();
    let mut side = ServoSide::new(servo, PERIOD as f32 * 1e-9);
    side.replace(loader.load(blob()).unwrap()).unwrap();
    side
}

/// The source of the clock.
#[derive(Clone, Copy, PartialEq)]
enum Clocked {
    /// The end of a frame, or a timer while frames are missing.
    ByFrames,
    /// A timer of the controller, which then asks for the newest frame.
    ByTimer,
}

/// Result of a run.
#[derive(Debug)]
struct Run {
    seen: Regularity,
    /// How often the fault pin went low.
    drops: u32,
    /// Periods with an alarm on the motion side, after the first ones.
    alarms: u32,
    /// Largest correction added, mm.
    largest: f32,
}

/// `motion`: time between two frames in per cent of the nominal period; `periods`: number of nominal periods.
fn run(clocked: Clocked, motion: f64, tolerance: Tolerance, periods: u64) -> Run {
    let motion_period = (PERIOD as f64 * motion / 100.0) as u64;
    let bounds = Bounds {
        value: [0.2; 2],
        // 2 mm/s, as in the compensation, plus half as much for the remainder after a skipped period.
        step: [2.0 * PERIOD as f32 * 1e-9 * 1.5; 2],
        hold: 40,
    };
    let mut machine = MotionSide::<2>::new(bounds);
    let mut exchange = Exchange::<2>::new(tolerance);
    let mut side = side();
    let mut frame = [0; MOST];
    let mut answer = [0; MOST];
    exchange.answer(&mut answer);
    let (mut at_motion, mut at_controller) = (motion_period / 3, PERIOD);
    let (mut x, mut speed) = (0.0_f32, 0.005_f32);
    let (mut pin, mut sent) = (true, 0_u64);
    let mut run = Run {
        seen: Regularity::NONE,
        drops: 0,
        alarms: 0,
        largest: 0.0,
    };
    while at_motion < periods * PERIOD {
        let now = if at_motion <= at_controller {
            at_motion
        } else {
            at_controller
        };
        let mut tick = false;
        if now == at_motion {
            at_motion += motion_period;
            // 20 mm/s to and fro.
            x += speed;
            if x.abs() >= 80.0 {
                speed = -speed;
            }
            let command = Command {
                enabling: Enabling::On,
                ..Command::new([x, 0.0], 0b11)
            };
            let bytes = machine.command(command, &mut frame).unwrap();
            let applied = machine.answer(&answer[..length(2)], pin);
            sent += 1;
            run.alarms += u32::from(sent > 100 && applied.alarm);
            run.largest = run.largest.max(applied.dq[0].abs());
            exchange.hear(bytes);
            if clocked == Clocked::ByFrames {
                tick = true;
                at_controller = now + PERIOD * SILENCE / 100;
            }
        } else {
            tick = true;
            at_controller += PERIOD;
        }
        if tick {
            let (mut source, mut sink) = exchange.ends();
            side.tick(&mut source, &mut sink, &NoClock);
            exchange.answer(&mut answer);
            run.drops += u32::from(pin && !side.is_healthy());
            pin = side.is_healthy();
        }
    }
    run.seen = exchange.seen();
    run
}

/// 10 s.
const SHORT: u64 = 40_000;

#[test]
fn clocked_by_frames_nothing_is_skipped_whatever_the_clocks() {
    for motion in [99.0, 100.0, 101.0, 110.0] {
        let run = run(Clocked::ByFrames, motion, Tolerance::USUAL, SHORT);
        let seen = run.seen;
        assert_eq!(
            (seen.repeated, seen.skipped, seen.faults),
            (0, 0, 0),
            "{motion}"
        );
        assert_eq!((run.drops, run.alarms), (0, 0), "{motion}");
        // The corrections are fully in: up to 0.08 mm at 80 mm.
        assert!((run.largest - 0.08).abs() < 1e-3, "{}", run.largest);
    }
}

#[test]
fn two_clocks_that_differ_by_one_per_cent_are_no_fault_and_what_is_skipped_is_counted() {
    // 40 000 periods: one in 101 without a frame, or one frame in 99 without a period.
    for (motion, repeated, skipped) in [(101.0, 396, 0), (99.0, 0, 404), (100.0, 0, 0)] {
        let run = run(Clocked::ByTimer, motion, Tolerance::USUAL, SHORT);
        let near = |count: u32, expected: u32| count.abs_diff(expected) <= 1;
        assert!(near(run.seen.repeated, repeated), "{run:?}");
        assert!(near(run.seen.skipped, skipped), "{run:?}");
        assert_eq!(
            (run.seen.faults, run.drops, run.alarms),
            (0, 0, 0),
            "{run:?}"
        );
    }
}

#[test]
fn what_tolerates_nothing_drops_the_fault_pin_99_times_in_ten_seconds_of_1_khz() {
    // The former behaviour of the board: every period without a new frame was a fault.
    let run = run(Clocked::ByTimer, 101.0, Tolerance::in_a_row(0), 10_000);
    assert_eq!(run.drops, 99, "{run:?}");
}

#[test]
fn two_clocks_that_differ_by_ten_per_cent_are_a_fault() {
    for motion in [110.0, 90.0] {
        let run = run(Clocked::ByTimer, motion, Tolerance::USUAL, SHORT);
        assert!(run.seen.faults > 0 && run.drops > 0, "{run:?}");
    }
}

#[test]
fn ten_minutes_with_clocks_one_per_cent_apart_have_no_fault() {
    // The pattern of frames repeats after 101 periods.
    const TEN_MINUTES: u64 = 2_400_000;
    for (clocked, repeated) in [(Clocked::ByTimer, 23_762), (Clocked::ByFrames, 0)] {
        let run = run(clocked, 101.0, Tolerance::USUAL, TEN_MINUTES);
        // Of 2 400 000 periods, 2 376 238 had a frame.
        assert!(run.seen.repeated.abs_diff(repeated) <= 1, "{run:?}");
        assert_eq!(run.seen.skipped, 0);
        assert_eq!(
            (run.seen.faults, run.drops, run.alarms),
            (0, 0, 0),
            "{run:?}"
        );
    }
}
