use std::cell::Cell as StdCell;
use std::vec::Vec;

use trueaxis::link::CostUnit;
use trueaxis::{Correction, Usual};

use super::*;
use crate::controller::tests::{leak, shared, side};
use crate::device::{Command, LinkOnly, NoClock, Regularity};

fn shell(rate: u32) -> &'static Shell<Usual> {
    leak(Shell::new(rate))
}

fn tick(shell: &Shell<Usual>) {
    shell.tick(&mut LinkOnly, &mut LinkOnly, &NoClock);
}

#[test]
fn milliseconds_are_counted_from_the_first_tick_at_any_rate() {
    for rate in [1000, 2000, 4000, 20_000] {
        let shell = shell(rate);
        let per_ms = rate / 1000;
        let mut seen = Vec::new();
        for _ in 0..5 * per_ms {
            tick(shell);
            seen.push(shell.milliseconds());
        }
        let expected: Vec<u32> = (1..=5 * per_ms).map(|ticks| ticks / per_ms).collect();
        assert_eq!(seen, expected, "{rate} Hz");
    }
}

#[test]
fn milliseconds_wrap() {
    let shell = shell(1000);
    shell.milliseconds.store(u32::MAX, Ordering::Relaxed);
    tick(shell);
    assert_eq!(shell.milliseconds(), 0);
}

#[test]
#[should_panic(expected = "whole servo periods")]
fn a_rate_that_is_no_multiple_of_1_khz_is_refused() {
    let _ = Shell::<Usual>::new(1500);
}

#[test]
#[should_panic(expected = "whole servo periods")]
fn a_rate_of_nothing_is_refused() {
    let _ = Shell::<Usual>::new(0);
}

/// Commands and corrections that count how often they are requested and delivered.
#[derive(Default)]
struct Ends {
    taken: StdCell<u32>,
    given: StdCell<u32>,
}

struct Source<'e>(&'e Ends);
struct Sink<'e>(&'e Ends);

impl PositionSource<[f32; 8]> for Source<'_> {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        self.0.taken.set(self.0.taken.get() + 1);
        Some(Command::new([1.0; 8], 3))
    }
}

impl CorrectionSink<[f32; 8]> for Sink<'_> {
    fn give(&mut self, _: &Correction<[f32; 8]>, _: bool) {
        self.0.given.set(self.0.given.get() + 1);
    }
}

/// Increases by seven with each query.
struct Sevens(StdCell<u32>);

impl Clock for Sevens {
    const UNIT: CostUnit = CostUnit::Cycles;

    fn now(&self) -> u32 {
        self.0.set(self.0.get().wrapping_add(7));
        self.0.get()
    }
}

#[test]
fn a_tick_updates_the_side_that_is_shared_with_these_ends_and_this_clock() {
    let (shell, ends) = (shell(4000), Ends::default());
    let clock = Sevens(StdCell::new(u32::MAX - 3));
    // Before there is a side, only time advances.
    shell.tick(&mut Source(&ends), &mut Sink(&ends), &clock);
    assert_eq!((ends.taken.get(), ends.given.get()), (0, 0));

    let mut access = shell.share(shared(side(0.3)));
    for _ in 0..3 {
        shell.tick(&mut Source(&ends), &mut Sink(&ends), &clock);
    }
    assert_eq!((ends.taken.get(), ends.given.get()), (3, 3));
    access.with(|side| {
        assert_eq!(side.counters().updates, 3);
        assert_eq!(side.counters().cost, 7);
        assert_eq!(side.counters().cost_unit, CostUnit::Cycles);
        assert_eq!(side.positions(), &[1.0; 8]);
    });
    assert_eq!(access.milliseconds(), 1, "the one before counted too");
}

#[test]
fn what_is_set_through_the_access_is_what_the_next_tick_finds() {
    let shell = shell(1000);
    let mut access = shell.share(shared(side(0.3)));
    let ends = Ends::default();
    access.with(|side| side.suspend(true));
    shell.tick(&mut Source(&ends), &mut Sink(&ends), &NoClock);
    assert_eq!(access.with(|side| side.counters().updates), 0);
    let mut again = access;
    again.with(|side| side.suspend(false));
    shell.tick(&mut Source(&ends), &mut Sink(&ends), &NoClock);
    assert_eq!(access.with(|side| side.counters().updates), 1);
}

#[test]
fn a_tick_while_somebody_holds_the_side_is_left_out_and_time_goes_on() {
    let shell = shell(1000);
    let ends = Ends::default();
    // A panic in there would end the interrupt. `std` lets the same thread enter twice.
    let mut access = shell.share(shared(side(0.3)));
    access.with(|side| {
        shell.tick(&mut Source(&ends), &mut Sink(&ends), &NoClock);
        assert_eq!(side.counters().updates, 0);
    });
    assert_eq!(ends.taken.get(), 0);
    assert_eq!(shell.milliseconds(), 1);
}

/// Returns fixed values, including its regularity.
struct Told(bool, Regularity);

impl PositionSource<[f32; 8]> for Told {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        self.0
            .then_some(Command::new([0.0, -50.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], 3))
    }

    fn regularity(&self) -> Regularity {
        self.1
    }
}

#[test]
fn a_tick_runs_with_no_interrupt_masked() {
    /// Checks from another thread: the lock of `critical_section` is free, and the side has been taken out.
    struct Look(&'static Shell<Usual>, bool);
    impl CorrectionSink<[f32; 8]> for Look {
        fn give(&mut self, _: &Correction<[f32; 8]>, _: bool) {
            let shell = self.0;
            let gone = std::thread::spawn(move || shell.take().is_none());
            self.1 = gone.join().unwrap();
        }
    }
    let shell = shell(1000);
    shell.share(shared(side(0.3)));
    let mut look = Look(shell, false);
    shell.tick(&mut Told(true, Regularity::NONE), &mut look, &NoClock);
    assert!(look.1);
}

#[test]
fn a_tick_says_whether_there_is_a_fault() {
    let shell = shell(1000);
    assert!(
        !shell.tick(&mut LinkOnly, &mut LinkOnly, &NoClock),
        "no side yet"
    );
    let mut access = shell.share(shared(side(0.3)));
    let tick = |told: &mut Told| shell.tick(told, &mut LinkOnly, &NoClock);
    let mut told = Told(true, Regularity::NONE);
    assert!(tick(&mut told));
    // A fault of the frames.
    told.1.fault = true;
    assert!(!tick(&mut told));
    told.1.fault = false;
    assert!(tick(&mut told));
    // A fault of the slots.
    access.with(|side| side.set_faulty(true));
    assert!(!tick(&mut told));
    access.with(|side| side.set_faulty(false));
    assert!(tick(&mut told));
    // A fault of the servo, which matters while corrections are requested.
    told.0 = false;
    assert!(tick(&mut told));
    access.with(|side| side.enable(true));
    assert!(!tick(&mut told));
}

#[test]
fn overruns_and_regularity_are_shown_with_the_next_period() {
    let shell = shell(1000);
    let mut access = shell.share(shared(side(0.3)));
    shell.overrun();
    shell.overrun();
    let seen = Regularity {
        skipped: 7,
        ..Regularity::NONE
    };
    shell.tick(&mut Told(true, seen), &mut LinkOnly, &NoClock);
    access.with(|side| {
        assert_eq!(side.counters().overruns, 2);
        assert_eq!(side.counters().regularity, seen);
    });
}

#[test]
fn the_main_loop_is_dead_after_a_second_of_silence() {
    let shell = shell(4000);
    let access = shell.share(shared(side(0.3)));
    for _ in 0..2 {
        access.lives();
        for _ in 0..4000 {
            assert!(shell.liveness().servo());
        }
    }
    assert!(!shell.liveness().servo());
}
