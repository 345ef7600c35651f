use std::rc::Rc;

use trueaxis::{Conditions, Usual};

use super::*;
use crate::controller::tests::{Pin, Wire, access, side};
use crate::device::tests::Source;
use crate::device::{Command, FAULTS, LinkOnly, NoClock};

const HERE: [f32; 8] = [0.0, -50.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Runs `count` periods at a place.
fn ticks(side: &mut ServoSide<Usual>, place: [f32; 8], count: u32) {
    for _ in 0..count {
        let mut source = Source(Some(Command::new(place, u16::MAX)));
        side.tick(&mut source, &mut LinkOnly, &NoClock);
    }
}

/// Enabled at [`HERE`], with the full correction.
fn correcting() -> ServoSide<Usual> {
    let mut side = side(0.3);
    side.enable(true);
    ticks(&mut side, HERE, 2000);
    assert!(side.last().dq[0] != 0.0);
    side
}

#[test]
fn corrections_that_are_in_are_shown() {
    let mut side = correcting();
    assert_eq!(Shown::of(&side), Shown::Correcting);
    side.set_faulty(true);
    assert_eq!(Shown::of(&side), Shown::Fault);
}

#[test]
fn idle_is_what_is_disabled_or_comes_or_goes() {
    let mut side = side(0.3);
    assert_eq!(Shown::of(&side), Shown::Idle);
    ticks(&mut side, HERE, 10);
    assert_eq!(Shown::of(&side), Shown::Idle);
    side.enable(true);
    ticks(&mut side, HERE, 2);
    assert_eq!(Shown::of(&side), Shown::Idle, "on the way in");
    ticks(&mut side, HERE, 2000);
    assert_eq!(Shown::of(&side), Shown::Correcting);
    side.enable(false);
    assert_eq!(Shown::of(&side), Shown::Idle, "on the way out");
    side.enable(true);
    side.dry_run(true);
    ticks(&mut side, HERE, 2000);
    assert_eq!(Shown::of(&side), Shown::Idle, "a dry run");
}

#[test]
fn inputs_that_are_no_numbers_are_a_fault_while_enabled() {
    let mut side = correcting();
    ticks(&mut side, [f32::NAN; 8], 1);
    assert_eq!(Shown::of(&side), Shown::Fault, "held");
    ticks(&mut side, [f32::NAN; 8], 4000);
    assert_eq!(Shown::of(&side), Shown::Fault, "and after the hold");
    // With corrections disabled, their absence is not a fault.
    side.enable(false);
    assert_eq!(Shown::of(&side), Shown::Idle);
}

#[test]
fn each_condition_that_is_a_fault_is_shown_as_one_and_no_other() {
    for bit in 0..16 {
        let condition = Conditions(1 << bit);
        let fault = [
            Conditions::BAD_INPUT,
            Conditions::BAD_PERIOD,
            Conditions::HELD,
            Conditions::FROZEN,
        ];
        assert_eq!(
            FAULTS.contains(condition),
            fault.contains(&condition),
            "{condition:?}"
        );
    }
}

/// The lamp output.
fn lamp(shown: Shown, now: u32) -> bool {
    let lamp = Pin::new(false);
    let mut signals = Signals::new(Wire(Rc::clone(&lamp)));
    let mut side = match shown {
        Shown::Idle => side(0.3),
        _ => correcting(),
    };
    side.set_faulty(shown == Shown::Fault);
    assert_eq!(signals.show(&mut access(side), now), shown);
    lamp.high.get()
}

#[test]
fn the_lamp_is_on_while_correcting_slow_while_idle_and_fast_in_a_fault() {
    for now in [0, 99, 100, 999, 1000, 1999, 2000] {
        assert!(lamp(Shown::Correcting, now));
        assert_eq!(
            lamp(Shown::Idle, now),
            !(1000..2000).contains(&now),
            "{now}"
        );
        assert_eq!(
            lamp(Shown::Fault, now),
            now != 100 && now != 999 && now != 1999,
            "{now}"
        );
    }
}
