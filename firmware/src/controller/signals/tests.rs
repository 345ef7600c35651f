use std::rc::Rc;

use trueaxis::Usual;

use super::*;
use crate::controller::tests::{Pin, Wire, access, side};
use crate::device::{Command, LinkOnly, NoClock, PositionSource};

/// Referenced, at one place.
struct Place([f32; 8]);

impl PositionSource<[f32; 8]> for Place {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        Some(Command {
            axes: self.0,
            referenced: u16::MAX,
        })
    }
}

/// Where a correction is not zero.
const HERE: [f32; 8] = [0.0, -50.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// So many periods at a place.
fn ticks(side: &mut ServoSide<Usual>, place: [f32; 8], count: u32) {
    for _ in 0..count {
        side.tick(&mut Place(place), &mut LinkOnly, &NoClock);
    }
}

/// Enabled at [`HERE`], with the whole correction.
fn correcting() -> ServoSide<Usual> {
    let mut side = side(0.3);
    side.enable(true);
    ticks(&mut side, HERE, 2000);
    assert!(side.last().dq[0] != 0.0);
    side
}

#[test]
fn corrections_that_are_in_are_shown() {
    let side = correcting();
    assert_eq!(Shown::of(&side, false), Shown::Correcting);
    assert_eq!(Shown::of(&side, true), Shown::Fault);
}

#[test]
fn idle_is_what_is_disabled_or_comes_or_goes() {
    let mut side = side(0.3);
    assert_eq!(Shown::of(&side, false), Shown::Idle);
    ticks(&mut side, HERE, 10);
    assert_eq!(Shown::of(&side, false), Shown::Idle);
    side.enable(true);
    ticks(&mut side, HERE, 2);
    assert_eq!(Shown::of(&side, false), Shown::Idle, "on the way in");
    ticks(&mut side, HERE, 2000);
    assert_eq!(Shown::of(&side, false), Shown::Correcting);
    side.enable(false);
    assert_eq!(Shown::of(&side, false), Shown::Idle, "on the way out");
    side.enable(true);
    side.dry_run(true);
    ticks(&mut side, HERE, 2000);
    assert_eq!(Shown::of(&side, false), Shown::Idle, "a dry run");
}

#[test]
fn inputs_that_are_no_numbers_are_a_fault_while_enabled() {
    let mut side = correcting();
    ticks(&mut side, [f32::NAN; 8], 1);
    assert_eq!(Shown::of(&side, false), Shown::Fault, "held");
    ticks(&mut side, [f32::NAN; 8], 4000);
    assert_eq!(Shown::of(&side, false), Shown::Fault, "and after the hold");
    // Nobody wants corrections: nothing is wrong with there being none.
    side.enable(false);
    assert_eq!(Shown::of(&side, false), Shown::Idle);
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

/// What lamp and fault pin are set to.
fn pins(shown: Shown, now: u32) -> (bool, bool) {
    let (lamp, healthy) = (Pin::new(false), Pin::new(false));
    let mut signals = Signals::new(Wire(Rc::clone(&lamp)), Wire(Rc::clone(&healthy)));
    let mut servo = access(match shown {
        Shown::Idle => side(0.3),
        _ => correcting(),
    });
    assert_eq!(signals.show(&mut servo, shown == Shown::Fault, now), shown);
    (lamp.high.get(), healthy.high.get())
}

#[test]
fn the_fault_pin_is_high_while_there_is_no_fault() {
    for now in [0, 100, 1000] {
        assert!(pins(Shown::Correcting, now).1);
        assert!(pins(Shown::Idle, now).1);
        assert!(!pins(Shown::Fault, now).1);
    }
}

#[test]
fn the_lamp_is_on_while_correcting_slow_while_idle_and_fast_in_a_fault() {
    let lamp = |shown, now| pins(shown, now).0;
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

#[test]
fn a_pin_that_fails_does_not_keep_the_other_from_being_set() {
    let (lamp, healthy) = (Pin::new(false), Pin::new(true));
    lamp.broken.set(true);
    let mut signals = Signals::new(Wire(Rc::clone(&lamp)), Wire(Rc::clone(&healthy)));
    signals.show(&mut access(side(0.3)), true, 0);
    assert!(!healthy.high.get());
}
