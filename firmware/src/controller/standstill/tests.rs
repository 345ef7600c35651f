use std::rc::Rc;

use trueaxis::Usual;

use super::*;
use crate::controller::tests::{Pin, Wire};

/// Drives that are off, and their observer.
fn standing() -> (Rc<Pin>, Standstill<Wire, Usual>) {
    let pin = Pin::new(true);
    (Rc::clone(&pin), Standstill::new(Wire(pin)))
}

fn at(x: f32) -> [f32; 8] {
    let mut commands = [0.0; 8];
    commands[3] = x;
    commands
}

#[test]
fn nothing_is_known_of_a_machine_that_was_never_looked_at() {
    let (_pin, standstill) = standing();
    assert!(!standstill.standstill());
}

#[test]
fn commands_that_never_change_are_quiet_from_the_start() {
    let (_pin, mut standstill) = standing();
    standstill.observe(&at(0.0), 1);
    assert!(standstill.standstill());
}

#[test]
fn a_change_of_any_axis_counts_for_200_ms() {
    let (_pin, mut standstill) = standing();
    standstill.observe(&at(0.001), 1000);
    assert!(!standstill.standstill());
    standstill.observe(&at(0.001), 1199);
    assert!(!standstill.standstill());
    standstill.observe(&at(0.001), 1200);
    assert!(standstill.standstill());
    // Moving back is a change too, and each change restarts the time.
    standstill.observe(&at(0.0), 1300);
    standstill.observe(&at(0.5), 1400);
    standstill.observe(&at(0.5), 1599);
    assert!(!standstill.standstill());
    standstill.observe(&at(0.5), 1600);
    assert!(standstill.standstill());
}

#[test]
fn the_count_of_milliseconds_may_wrap() {
    let (_pin, mut standstill) = standing();
    standstill.observe(&at(1.0), u32::MAX - 99);
    standstill.observe(&at(1.0), 99);
    assert!(!standstill.standstill());
    standstill.observe(&at(1.0), 100);
    assert!(standstill.standstill());
}

#[test]
fn the_pin_counts_as_it_is_now() {
    let (pin, mut standstill) = standing();
    standstill.observe(&at(0.0), 1);
    for high in [false, true, false] {
        pin.high.set(high);
        assert_eq!(standstill.standstill(), high);
    }
}

#[test]
fn a_pin_that_cannot_be_read_says_that_the_drives_may_be_on() {
    let (pin, mut standstill) = standing();
    standstill.observe(&at(0.0), 1);
    pin.broken.set(true);
    assert!(!standstill.standstill());
}
