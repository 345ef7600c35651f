use std::boxed::Box;
use std::format;
use std::string::ToString;
use std::vec;

use trueaxis::{
    AlignedBlob, Axis, Direction, Draft, DraftBank, Holds, Inputs, Interpolation, Refused,
    SampleFormat, Term,
};

use super::*;

type Two = Holds<2, 4, 4, 4, 1>;
type Small = DoubleBuffer<Two>;

fn buffers() -> &'static Small {
    Box::leak(Box::new(Small::new()))
}

/// ΔX = scale · X.
fn blob(machine: &str, scale: f32) -> &'static [u8] {
    let draft = Draft {
        machine: machine.into(),
        axes: vec![Axis {
            name: b'X',
            travel: [-100.0, 100.0],
            period: 0.0,
            value_bound: 100.0,
            rate_bound: 1e4,
            reversal_threshold: 0.01,
            ramp_rate: 1e3,
            reversal_rate: 1e4,
            reversal_acceleration: 20000.0,
        }],
        banks: vec![DraftBank {
            input: 0,
            start: -10.0,
            step: 20.0,
            modulo: false,
            direction: Direction::Both,
            interpolation: Interpolation::Linear,
            format: SampleFormat::F32,
            columns: vec![vec![-10.0, 10.0]],
        }],
        terms: vec![Term {
            output: 0,
            weight: scale,
            limits: None,
            factors: [0].as_slice().try_into().unwrap(),
        }],
        ..Draft::default()
    };
    let blob: &'static AlignedBlob = Box::leak(Box::new(draft.encode().unwrap()));
    blob
}

fn update(servo: &mut BufferedServo<Two>) -> f32 {
    servo.update(&Inputs::at([5.0, 0.0]), 1, 0.001).dq[0]
}

#[test]
fn the_sides_are_given_once_until_both_are_back() {
    let buffers = buffers();
    let (mut loader, mut servo) = buffers.split().unwrap();
    assert!(buffers.split().is_none());
    let loaded = loader.load(blob("m", 1.0)).unwrap();
    servo.replace(loaded).unwrap();
    assert!(buffers.unite(loader, servo));
    let (loader, servo) = buffers.split().unwrap();
    assert_eq!(loader.current().machine(), "", "empty again");
    assert_eq!(servo.compensation().axes().len(), 0);
    // Sides of other buffers are refused.
    let (other, _driven) = self::buffers().split().unwrap();
    assert!(!buffers.unite(other, servo));
    assert!(buffers.split().is_none());
}

#[test]
fn what_is_loaded_is_swapped_in_while_the_servo_runs() {
    let (mut loader, mut servo) = buffers().split().unwrap();
    let loaded = loader.load(blob("m", 1.0)).unwrap();
    assert_eq!(loaded.compensation().machine(), "m");
    assert_eq!(loaded.active().machine(), "");
    servo.replace(loaded).unwrap();
    servo.enable(true);
    for _ in 0..2000 {
        update(&mut servo);
    }
    assert_eq!(update(&mut servo), 5.0);

    let loaded = loader.load(blob("m", -1.0)).unwrap();
    servo.swap(loaded).unwrap();
    let mut periods = 0;
    while servo.is_swapping() {
        // Both buffers are in use: nothing is loaded or emptied.
        assert!(matches!(loader.load(blob("m", 2.0)), Err(NotLoaded::Busy)));
        assert!(matches!(loader.vacate(), Err(NotLoaded::Busy)));
        update(&mut servo);
        periods += 1;
    }
    assert!(periods > 20);
    assert_eq!(update(&mut servo), -5.0);
    // The old buffer is vacant: loading into it without swapping changes nothing.
    let loaded = loader.load(blob("n", 3.0)).unwrap();
    assert_eq!(loaded.compensation().machine(), "n");
    assert_eq!(update(&mut servo), -5.0);
    let lease = loader.vacate().unwrap().unwrap();
    assert_eq!(lease.bytes(), blob("n", 3.0));
    assert!(loader.vacate().unwrap().is_none());
    assert_eq!(loader.current().machine(), "m");
    assert_eq!(update(&mut servo), -5.0);
}

#[test]
fn what_was_tried_on_or_vacated_is_not_kept() {
    let (mut loader, _servo) = buffers().split().unwrap();
    let vacant = |loader: &Loader<Two>| loader.vacant().unwrap().read().machine().to_string();
    let machine = loader.try_on(blob("m", 1.0), |_, new| new.machine().to_string());
    assert_eq!(machine.unwrap(), "m");
    assert_eq!(vacant(&loader), "");
    loader.load(blob("n", 1.0)).unwrap();
    assert_eq!(vacant(&loader), "n");
    loader.vacate().unwrap();
    assert_eq!(vacant(&loader), "");
}

#[test]
fn what_is_refused_leaves_everything_as_it_is() {
    let (mut loader, mut servo) = buffers().split().unwrap();
    let loaded = loader.load(blob("m", 1.0)).unwrap();
    // It has axes, the compensation in use has none.
    assert_eq!(servo.swap(loaded), Err(Refused::Axes));
    assert!(!servo.is_swapping());
    let error = loader.load(&[1; 16][..]).map(|_| ()).unwrap_err();
    assert_eq!(error, NotLoaded::Refused(LoadError::BadMagic));
    assert_eq!(format!("{error}"), format!("{}", LoadError::BadMagic));
    let busy = "the previous change of compensation is not finished";
    assert_eq!(format!("{}", NotLoaded::Busy), busy);
    // From other buffers.
    let (mut foreign, _other) = buffers().split().unwrap();
    let loaded = foreign.load(blob("m", 1.0)).unwrap();
    assert_eq!(servo.swap(loaded), Err(Refused::Busy));
    let loaded = foreign.load(blob("m", 1.0)).unwrap();
    assert_eq!(servo.replace(loaded), Err(Refused::Busy));
    assert_eq!(servo.compensation().axes().len(), 0);
    // And it still works.
    let loaded = loader.load(blob("m", 1.0)).unwrap();
    servo.replace(loaded).unwrap();
    assert_eq!(servo.compensation().machine(), "m");
}
