use std::rc::Rc;

use super::*;
use crate::controller::tests::{Dog, Pin, Wire};

const PATIENCE: u32 = 10;

/// With the level of its pin, the number of feeds, and the liveness of the main loop.
fn heart() -> (Heart<Wire, Dog>, Rc<Pin>, Dog, Liveness) {
    let (pin, dog) = (Pin::new(true), Dog(Rc::default()));
    let heart = Heart::new(Wire(Rc::clone(&pin)), Dog(Rc::clone(&dog.0)));
    (heart, pin, dog, Liveness::new(PATIENCE))
}

#[test]
fn until_the_main_loop_has_begun_the_pin_is_low_and_the_watchdog_fed() {
    let (mut heart, pin, dog, liveness) = heart();
    assert!(!pin.high.get());
    for fed in 1..=PATIENCE {
        assert_eq!(heart.beat(&liveness, true), Beat::Alive);
        assert_eq!((pin.high.get(), dog.0.get()), (false, fed));
    }
    // It takes too long to start.
    assert_eq!(heart.beat(&liveness, true), Beat::Dead);
    assert_eq!(dog.0.get(), PATIENCE);
}

#[test]
fn while_both_live_the_watchdog_is_fed_and_the_pin_says_what_the_servo_says() {
    let (mut heart, pin, dog, liveness) = heart();
    for number in 1..=10_u32 {
        liveness.main_loop();
        for healthy in [true, false, true] {
            assert_eq!(heart.beat(&liveness, healthy), Beat::Alive);
            assert_eq!(pin.high.get(), healthy);
        }
        assert_eq!(dog.0.get(), 3 * number);
    }
}

#[test]
fn when_the_main_loop_stops_the_pin_drops_and_the_watchdog_starves() {
    let (mut heart, pin, dog, liveness) = heart();
    liveness.main_loop();
    for _ in 0..PATIENCE {
        assert_eq!(heart.beat(&liveness, true), Beat::Alive);
        assert!(pin.high.get());
    }
    let fed = dog.0.get();
    for _ in 0..3 {
        assert_eq!(heart.beat(&liveness, true), Beat::Dead);
        assert_eq!((pin.high.get(), dog.0.get()), (false, fed));
        // Too late: once dead, it is not trusted again.
        liveness.main_loop();
    }
}

#[test]
fn when_the_servo_stops_nobody_feeds_the_watchdog() {
    let (mut heart, _, dog, liveness) = heart();
    liveness.main_loop();
    heart.beat(&liveness, true);
    for _ in 0..100 {
        liveness.main_loop();
    }
    assert_eq!(dog.0.get(), 1);
}
