//! Flash that stalls the processor.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering::Relaxed};

use proptest::prelude::*;

use super::*;
use crate::mock_flash::MockFlash;
use crate::slots::WhileBusy;

/// The servo interrupt: occurs during any flash operation while the servo runs.
#[derive(Clone, Default)]
struct Servo {
    runs: Arc<AtomicBool>,
    ticks_while_busy: Arc<AtomicU32>,
}

fn watched(while_busy: WhileBusy) -> (Slots<MockFlash<4, 128>>, Servo) {
    let mut flash = MockFlash::new(6).with_while_busy(while_busy);
    let servo = Servo::default();
    let interrupt = servo.clone();
    flash.set_listener(move |_| {
        if interrupt.runs.load(Relaxed) {
            interrupt.ticks_while_busy.fetch_add(1, Relaxed);
        }
    });
    (Slots::open(flash), servo)
}

/// What a controller does during an upload.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// The machine stops, its drives go off, the servo stops.
    Stop,
    /// The machine is switched on.
    Run,
    Begin,
    Erase,
    Write(usize),
    Commit,
    Abort,
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        2 => Just(Event::Stop),
        1 => Just(Event::Run),
        2 => Just(Event::Begin),
        8 => Just(Event::Erase),
        8 => (1..200_usize).prop_map(Event::Write),
        2 => Just(Event::Commit),
        1 => Just(Event::Abort),
    ]
}

/// Plays events; returns the number of servo ticks while the flash was busy, and the number of commits.
fn play(while_busy: WhileBusy, events: &[Event]) -> (u32, u32) {
    let blob = blob(3, 60);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let (mut slots, servo) = watched(while_busy);
    let mut commits = 0;
    servo.runs.store(true, Relaxed);
    for &event in events {
        let spent = slots.flash().spent();
        let next = match slots.upload().map(|upload| upload.progress) {
            Some(Progress::Receiving { next }) => next as usize,
            _ => 0,
        };
        let result = match event {
            Event::Stop | Event::Run => {
                let runs = matches!(event, Event::Run);
                servo.runs.store(runs, Relaxed);
                slots.set_standstill(!runs);
                Ok(())
            }
            Event::Begin => slots.begin(length, crc).map(drop),
            Event::Erase => slots.erase_step().map(drop),
            Event::Write(count) => {
                let end = blob.len().min(next + count);
                slots.write(next as u32, &blob[next..end]).map(drop)
            }
            Event::Commit => slots.commit(|_| true).map(|_| commits += 1),
            Event::Abort => {
                slots.abort();
                Ok(())
            }
        };
        if result == Err(SlotError::NotStandstill) {
            assert_eq!(
                slots.flash().spent(),
                spent,
                "refused, and did it nevertheless"
            );
        }
    }
    (servo.ticks_while_busy.load(Relaxed), commits)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_servo_tick_falls_inside_an_erase_or_a_program(
        events in prop::collection::vec(event(), 0..80),
    ) {
        prop_assert_eq!(play(WhileBusy::Standstill, &events).0, 0);
    }
}

#[test]
fn other_flash_is_busy_while_the_servo_runs() {
    // The same events with flash that does not stall: ticks occur then, so the test above can detect them.
    let mut events = std::vec![Event::Begin];
    events.extend([Event::Erase; 6]);
    events.extend([Event::Write(64); 10]);
    events.push(Event::Commit);
    for while_busy in [WhileBusy::DualBank, WhileBusy::ServoInRam] {
        let (ticks, commits) = play(while_busy, &events);
        assert!(ticks > 10, "{ticks}");
        assert_eq!(commits, 1);
    }
    assert_eq!(play(WhileBusy::Standstill, &events), (0, 0));
    events.insert(0, Event::Stop);
    assert_eq!(play(WhileBusy::Standstill, &events), (0, 1));
}

#[test]
fn starting_the_machine_pauses_an_upload() {
    let blob = blob(3, 60);
    let Header { length, crc } = Header::read(&blob).expect("a blob");
    let (mut slots, _) = watched(WhileBusy::Standstill);
    assert_eq!(slots.begin(length, crc), Err(SlotError::NotStandstill));
    assert_eq!(slots.upload(), None);
    slots.set_standstill(true);
    slots.begin(length, crc).expect("it stands still");
    while slots.erase_step() != Ok(Progress::Receiving { next: 0 }) {}
    assert_eq!(slots.write(0, &blob[..50]), Ok(50));
    slots.set_standstill(false);
    assert_eq!(slots.write(50, &blob[50..]), Err(SlotError::NotStandstill));
    // A repeated chunk needs no flash.
    assert_eq!(slots.write(0, &blob[..50]), Ok(50));
    slots.set_standstill(true);
    assert_eq!(slots.write(50, &blob[50..]), Ok(length));
    slots.set_standstill(false);
    assert_eq!(slots.commit(|_| true), Err(SlotError::NotStandstill));
    slots.set_standstill(true);
    assert_eq!(slots.commit(|_| true), Ok(Slot::A));
}
