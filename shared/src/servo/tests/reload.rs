//! Compensations owned by the servo: they are returned, and their place is loaded again.

use std::boxed::Box;
use std::string::ToString;

use super::*;

fn boxed(draft: &Draft) -> Box<C> {
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft.encode().unwrap()));
    let mut place = Box::new(C::empty());
    place.load(blob).unwrap();
    place
}

/// Like [`settle`], for any handle.
fn run<H: Handle<Room = Three>>(servo: &mut Servo<H>) -> [f32; 3] {
    for _ in 0..8000 {
        servo.update(&at(20.0, 10.0, 45.0), ALL, DT);
    }
    servo.update(&at(20.0, 10.0, 45.0), ALL, DT).dq
}

#[test]
fn a_place_is_loaded_into_again_and_again_without_a_second_reference() {
    let mut servo = Servo::new(boxed(&draft(1.0)));
    servo.enable();
    let first = run(&mut servo);
    assert_eq!(first, settled(&at(20.0, 10.0, 45.0)).correction.dq);
    let mut vacant = boxed(&draft(1.5));
    for scale in [2.0, 0.5, 1.0] {
        let address = &raw const *vacant;
        let blob: &'static AlignedBlob = Box::leak(Box::new(draft(scale).encode().unwrap()));
        vacant.load(blob).unwrap();
        assert!(servo.swap(vacant).unwrap().is_none());
        assert!(servo.take_retired().is_none(), "it is still read");
        run(&mut servo);
        assert!(core::ptr::eq(servo.compensation(), address));
        vacant = servo.take_retired().unwrap();
        assert!(servo.take_retired().is_none(), "given once");
    }
    assert_eq!(run(&mut servo), first, "the tables of the beginning");
}

#[test]
fn what_is_not_taken_comes_back_with_the_reason() {
    let mut servo = Servo::new(boxed(&draft(1.0)));
    servo.enable();
    run(&mut servo);
    let mut other = draft(1.0);
    other.axes[1].name = b'Z';
    let refused = servo.swap(boxed(&other)).unwrap_err();
    assert_eq!(refused.why, Refused::Axes);
    assert_eq!(refused.handle.axes()[1].name, b'Z');
    assert_eq!(refused.to_string(), Refused::Axes.to_string());
    assert!(refused.to_string().starts_with("the axes differ"));
    assert_eq!(std::format!("{refused:?}"), "NotTaken(Axes)");
    servo.swap(boxed(&draft(0.5))).unwrap();
    let refused = servo.swap(refused.handle).unwrap_err();
    assert_eq!(refused.why, Refused::Busy);
}

#[test]
fn what_nobody_took_back_comes_with_the_next_swap() {
    let mut servo = Servo::new(boxed(&draft(1.0)));
    servo.swap(boxed(&draft(2.0))).unwrap();
    run(&mut servo);
    let first = servo.swap(boxed(&draft(3.0))).unwrap().unwrap();
    assert_eq!(
        first.terms().next().unwrap().weight,
        draft(1.0).terms[0].weight
    );
    run(&mut servo);
    let second = servo.take_retired().unwrap();
    assert_eq!(
        second.terms().next().unwrap().weight,
        draft(2.0).terms[0].weight
    );
}

#[test]
fn the_compensation_in_use_comes_back_at_once_and_only_its_weights_are_faded() {
    let mut servo = settled(&at(20.0, 10.0, 45.0));
    servo.set_weight(5, 2.0).unwrap();
    run(&mut servo);
    let back = servo.swap(*A).unwrap().unwrap();
    assert!(core::ptr::eq(back, *A));
    assert!(!servo.is_swapping());
    run(&mut servo);
    assert!(servo.take_retired().is_none());
    assert_eq!(servo.wanted_weights().get(5), Some(1.0));
}

#[test]
fn whatever_holds_a_compensation_gives_the_same_corrections() {
    let by_reference = run(&mut Servo::new(*A));
    let place: &'static mut C = Box::leak(boxed(&draft(1.0)));
    assert_eq!(run(&mut Servo::new(place)), by_reference);
    assert_eq!(run(&mut Servo::new(*boxed(&draft(1.0)))), by_reference);
    let shared = std::sync::Arc::new(C::clone(&A));
    assert_eq!(run(&mut Servo::new(shared)), by_reference);
}
