//! With any disturbance of the line, an upload is complete or has no effect, and every motion is executed exactly
//! once.

use crate::specimen::{RATE, blob};
use crate::wire::{Badness, Wire};
use proptest::prelude::*;
use std::time::Duration;
use trueaxis::link::{Activation, Refusal, Request, Slot, SlotState};
use trueaxis::{Compensation, Inputs, Servo};
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::mock_flash::MockFlash;
use trueaxis_firmware::slots::WhileBusy;
use trueaxis_link::{Activated, Client, LinkError, Port, UploadError, flash};

const PERIOD: f32 = 0.001;
const POINTS: u16 = 500;

fn desktop() -> Desktop {
    Desktop::start(
        MockFlash::new(24).with_while_busy(WhileBusy::DualBank),
        PERIOD,
    )
}

fn connect(wire: Wire) -> Client<Wire> {
    // The line answers at once or never, so the number of tries matters, not the time limit.
    Client::connect_with(wire, Duration::from_secs(5), 60)
        .unwrap()
        .0
}

/// A device with this blob in use.
fn holding(blob: &[u8]) -> Desktop {
    let mut client = connect(Wire::good(desktop()));
    let controller = client.hello().unwrap();
    let outcome = flash(&mut client, &controller, blob, false, true, &()).unwrap();
    assert_eq!((outcome.slot, outcome.activated), (Slot::A, Activated::Yes));
    client.into_port().into_desktop()
}

fn holds(desktop: &Desktop, slot: Slot, blob: &[u8]) -> bool {
    desktop.device.slots().blob(slot) == Some(blob)
}

fn badness() -> impl Strategy<Value = Badness> {
    let chance = 0_u8..70;
    (chance.clone(), chance.clone(), chance.clone(), chance).prop_map(
        |(lost, doubled, delayed, damaged)| Badness {
            lost,
            doubled,
            delayed,
            damaged,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn an_upload_over_a_bad_line_is_complete_or_has_not_happened(
        badness in badness(),
        seed in any::<u64>(),
        restart in prop::option::of(1_u32..30),
    ) {
        let old = blob("m", b"XY", 0.1, POINTS);
        let new = blob("m", b"XY", 0.2, POINTS);
        let mut wire = Wire::new(holding(&old), badness, seed);
        if let Some(sends) = restart {
            wire = wire.restart_after(sends);
        }
        let connected = Client::connect_with(wire, Duration::from_secs(5), 60);
        // With a chance of at most 70 in 256 for each fault, not all of 60 tries fail.
        let (mut client, controller) = connected.map_err(|e| TestCaseError::fail(e.to_string()))?;
        let result = flash(&mut client, &controller, &new, false, true, &());
        let mut desktop = client.into_port().into_desktop();
        prop_assert!(holds(&desktop, Slot::A, &old), "the active slot is untouched");
        match result {
            Ok(outcome) => {
                prop_assert_eq!(outcome.slot, Slot::B);
                prop_assert!(holds(&desktop, Slot::B, &new));
                prop_assert_eq!(outcome.activated, Activated::Yes);
                desktop = desktop.restart();
                prop_assert_eq!(desktop.device.activation(), Activation::Active(Some(Slot::B)));
            }
            Err(UploadError::Link(LinkError::Silent)) => {
                desktop = desktop.restart();
                prop_assert_eq!(desktop.device.activation(), Activation::Active(Some(Slot::A)));
            }
            Err(error) => prop_assert!(false, "{error}"),
        }
        prop_assert!(desktop.device.slots().wear(Slot::B) <= 2, "erased again for nothing");
    }

    #[test]
    fn over_a_bad_line_every_motion_is_done_exactly_once(
        badness in badness(),
        seed in any::<u64>(),
        steps in prop::collection::vec((-50_i16..50, any::<bool>()), 1..20),
    ) {
        let blob = blob("m", b"XY", 0.3, POINTS);
        let mut compensation: Box<Compensation<'_>> = Box::new(Compensation::empty());
        compensation.load(&blob).unwrap();
        // The device starts with the new compensation.
        let mut client = connect(Wire::new(holding(&blob).restart(), badness, seed));
        let mut servo = Servo::new(&compensation);
        client.set(&Request::Referenced(3)).unwrap();
        let mut y = 0.0;
        for (step, on) in steps {
            client.set(&Request::Enable(on)).unwrap();
            if on { servo.enable() } else { servo.disable() }
            let mut rows = vec![];
            for _ in 0..40 {
                y += f32::from(step) * 0.01;
                rows.push([0.5, y]);
            }
            let results = client.motion(&rows, 2).unwrap();
            for (row, result) in rows.iter().zip(results) {
                let inputs = Inputs::at([row[0], row[1]]);
                let mut q = Inputs::<[f32; 8]>::default();
                q.axes[..2].copy_from_slice(&inputs.axes);
                let here = servo.update(&q, 3, PERIOD);
                prop_assert_eq!(result.dq, [here.dq[0], here.dq[1]]);
                prop_assert_eq!(result.computed, [here.computed[0], here.computed[1]]);
                prop_assert_eq!(result.status, here.status);
            }
        }
    }
}

#[test]
fn an_interrupted_upload_goes_on_where_it_was() {
    let old = blob("m", b"XY", 0.1, 4 * POINTS);
    let new = blob("m", b"XY", 0.2, 4 * POINTS);
    let flash_memory = MockFlash::new(80).with_while_busy(WhileBusy::DualBank);
    let mut client = connect(Wire::good(Desktop::start(flash_memory, PERIOD)));
    let controller = client.hello().unwrap();
    flash(&mut client, &controller, &old, false, true, &()).unwrap();
    // The host disappears in the middle.
    let word = |at: usize| u32::from_le_bytes(new[at..at + 4].try_into().unwrap());
    let (length, crc) = (word(8), word(12));
    for _ in 0..100 {
        client.upload(&Request::Begin { length, crc }).unwrap();
    }
    for (number, bytes) in new.chunks(900).take(5).enumerate() {
        let offset = 900 * number as u32;
        client.upload(&Request::Chunk { offset, bytes }).unwrap();
    }
    // And returns.
    let mut client = connect(client.into_port());
    let controller = client.hello().unwrap();
    assert!(matches!(
        controller.slots[1].state,
        SlotState::Uploading { received: 4500, .. }
    ));
    let outcome = flash(&mut client, &controller, &new, false, true, &()).unwrap();
    assert_eq!((outcome.slot, outcome.resumed), (Slot::B, 4500));
    // The same upload again writes nothing.
    let controller = client.hello().unwrap();
    let outcome = flash(&mut client, &controller, &new, false, true, &()).unwrap();
    assert!(outcome.already);
    assert_eq!(controller.slots[0].erased, 1);
    assert_eq!(controller.slots[1].erased, 1);
}

#[test]
fn a_host_that_is_delayed_into_the_session_of_another_one_does_no_harm() {
    let old = blob("m", b"XY", 0.1, POINTS);
    let mut first = connect(Wire::good(holding(&old)));
    first.set(&Request::Enable(true)).unwrap();
    // Another host opens a session; a delayed request of the first one arrives late.
    let mut wire = first.into_port();
    let mut late = vec![];
    for header in [(1, 1), (1, 2)] {
        let header = trueaxis::link::Header {
            session: header.0,
            sequence: header.1,
        };
        let (mut scratch, mut out) = ([0; 1024], [0; 1100]);
        late.extend(
            trueaxis::link::encode(header, &Request::Enable(false), &mut scratch, &mut out)
                .unwrap(),
        );
    }
    wire.send(&late).unwrap();
    let mut second = connect(wire);
    assert!(second.status().unwrap().enabled, "it was not carried out");
}

#[test]
fn while_positions_are_streamed_a_swap_makes_no_step_above_the_rate_bound() {
    let old = blob("m", b"XY", 0.1, POINTS);
    let new = blob("m", b"XY", -0.4, POINTS);
    let mut client = connect(Wire::good(holding(&old)));
    let controller = client.hello().unwrap();
    client.set(&Request::Referenced(3)).unwrap();
    client.set(&Request::Enable(true)).unwrap();
    let mut last = [0.0; 2];
    let mut largest = 0.0_f32;
    let mut stream = |client: &mut Client<Wire>, batches: u32| {
        for batch in 0..batches {
            let rows: Vec<[f32; 2]> = (0..30)
                .map(|k| [0.0, libm::sinf((batch * 30 + k) as f32 * 0.002) * 30.0])
                .collect();
            for result in client.motion(&rows, 2).unwrap() {
                for (dq, last) in result.dq.iter().zip(last) {
                    // The spacing of f32 at 0.5 mm is added.
                    largest = largest.max((dq - last).abs());
                    assert!((dq - last).abs() <= RATE * PERIOD + 1e-7);
                }
                last = result.dq;
            }
        }
        last
    };
    let before = stream(&mut client, 30);
    assert!(before[0] != 0.0);
    // Uploaded between two batches, and faded in while they continue.
    let outcome = flash(&mut client, &controller, &new, false, false, &()).unwrap();
    let mut state = client.activate(outcome.slot, false).unwrap();
    assert_eq!(state, Activation::Fading(Slot::B));
    let mut batches = 0;
    while state == Activation::Fading(Slot::B) {
        // Neither slot may be written in the meantime.
        let begin = Request::Begin {
            length: 100,
            crc: 0,
        };
        assert!(matches!(
            client.upload(&begin),
            Err(LinkError::Refused(Refusal::Busy))
        ));
        stream(&mut client, 1);
        state = client.activate(outcome.slot, false).unwrap();
        batches += 1;
    }
    assert_eq!(state, Activation::Active(Some(Slot::B)));
    assert!(batches > 5, "{batches} batches: it was no fade");
    stream(&mut client, 30);
}

#[test]
fn a_controller_of_another_version_is_named() {
    struct Newer(Vec<u8>);
    impl Port for Newer {
        fn send(&mut self, _: &[u8]) -> std::io::Result<()> {
            // A controller that supports only versions 2 to 5: the fixed format, with its checksum.
            let plain = [0_u8, 2, 5];
            let check = crc32(&plain).to_le_bytes();
            self.0 = vec![1, 7, 2, 5];
            self.0.extend(check);
            self.0.push(0);
            Ok(())
        }
        fn receive(&mut self, buffer: &mut [u8], _: Duration) -> std::io::Result<usize> {
            let count = self.0.len();
            buffer[..count].copy_from_slice(&self.0);
            self.0.clear();
            Ok(count)
        }
    }
    /// CRC-32/ISO-HDLC, bit by bit.
    fn crc32(bytes: &[u8]) -> u32 {
        let step = |crc: u32, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
        !bytes.iter().fold(u32::MAX, |crc, &byte| {
            (0..8).fold(crc ^ u32::from(byte), step)
        })
    }
    let result = Client::connect(Newer(vec![]));
    assert!(matches!(
        result,
        Err(LinkError::Version {
            lowest: 2,
            highest: 5
        })
    ));
}
