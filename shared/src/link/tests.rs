use std::string::String;
use std::vec;
use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::load_error::{LoadError, Part};
use crate::{Conditions, Correction, Inputs, Status, Travel, Travelling};

const HEADER: Header = Header {
    session: 0x0100_FE00,
    sequence: 7,
};

fn wire(message: &impl serde::Serialize) -> Vec<u8> {
    let (mut scratch, mut out) = ([0; MOST_BODY], [0; MOST_WIRE]);
    encode(HEADER, message, &mut scratch, &mut out)
        .unwrap()
        .to_vec()
}

/// Feeds bytes to a receiver; returns the bodies of all frames found, and the number of garbage reports.
fn received(bytes: &[u8]) -> (Vec<Vec<u8>>, usize) {
    let mut receiver = Receiver::new();
    let (mut bodies, mut garbage) = (vec![], 0);
    for &byte in bytes {
        match receiver.push(byte) {
            Received::Nothing => {}
            Received::Garbage => garbage += 1,
            Received::Frame => match receiver.frame() {
                Some(Framed::Message(header, body)) => {
                    assert_eq!(header, HEADER);
                    bodies.push(body.to_vec());
                }
                other => panic!("{other:?}"),
            },
        }
    }
    (bodies, garbage)
}

#[test]
fn the_bytes_of_a_frame_are_those_of_the_specification() {
    let bytes = wire(&Request::Begin {
        length: 300,
        crc: 1,
    });
    // As in docs/src/link.md: version 1, session, sequence, body, checksum; COBS; zero.
    let plain = [1, 0x00, 0xFE, 0x00, 0x01, 7, 0, 2, 0xAC, 0x02, 1];
    let check = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&plain);
    let mut frame = plain.to_vec();
    frame.extend(check.to_le_bytes());
    let mut expected = ::cobs::encode_vec(&frame);
    expected.push(0);
    assert_eq!(bytes, expected);
}

#[test]
fn the_bodies_are_those_of_the_specification() {
    fn body(message: &impl serde::Serialize) -> Vec<u8> {
        received(&wire(message)).0.remove(0)
    }
    let (length, crc) = (300, 1);
    assert_eq!(body(&Request::Begin { length, crc }), [2, 0xAC, 2, 1]);
    let (offset, bytes) = (992, &[0xDE, 0xAD][..]);
    let chunk = Request::Chunk { offset, bytes };
    assert_eq!(body(&chunk), [3, 0xE0, 7, 2, 0xDE, 0xAD]);
    assert_eq!(body(&Request::Commit { force: false }), [4, 0]);
    let (slot, force) = (Slot::B, true);
    assert_eq!(body(&Request::Activate { slot, force }), [6, 1, 1]);
    let (term, value) = (7, 0.5);
    assert_eq!(
        body(&Request::SetWeight { term, value }),
        [9, 7, 0, 0, 0, 0x3F]
    );
    let (next, length) = (992, 5452);
    assert_eq!(
        body(&Reply::Upload(Upload::Receiving { next, length })),
        [2, 3, 0xE0, 7, 0xCC, 0x2A]
    );
    let expected = 992;
    assert_eq!(
        body(&Reply::Refused(Refusal::Missing { expected })),
        [7, 7, 0xE0, 7]
    );
    let active = Activation::Active(Some(Slot::A));
    assert_eq!(body(&Reply::Activation(active)), [3, 0, 1, 0]);
    // The last variants, to show that none was inserted before them.
    assert_eq!(body(&Request::Health), [14]);
    assert_eq!(body(&Reply::Refused(Refusal::LogicBug)), [7, 24]);
    let file = Tail::of("spi.rs");
    let health = Health {
        healthy: true,
        restart: Restart::Panic { line: 300, file },
        frames: 1,
        repeated: 2,
        skipped: 3,
        damaged: 4,
        faults: 5,
        overruns: 6,
        garbled: 7,
    };
    let mut expected = vec![8, 1, 8, 0xAC, 2];
    expected.extend(b"spi.rs");
    expected.extend([0; 18]);
    expected.extend([1, 2, 3, 4, 5, 6, 7]);
    assert_eq!(body(&Reply::Health(health)), expected);
    let health = Health {
        restart: Restart::ClockStopped,
        ..Health::default()
    };
    let expected = [8, 0, 9, 0, 0, 0, 0, 0, 0, 0];
    assert_eq!(body(&Reply::Health(health)), expected);
    assert_eq!(body(&Request::EnableAtStart(true)), [16, 1]);
    assert_eq!(body(&Request::CommitInUse { force: true }), [17, 1]);
    assert_eq!(body(&Request::Weights), [18]);
    assert_eq!(body(&Reply::Refused(Refusal::Full)), [7, 27]);
    let (slot, block) = (Slot::B, 300);
    let unusable = Refusal::Unusable { slot, block };
    assert_eq!(body(&Reply::Refused(unusable)), [7, 28, 1, 0xAC, 2]);
    assert_eq!(body(&Reply::Refused(Refusal::NoNonce)), [7, 29]);
    let at_start = AtStart {
        in_use: Some(Slot::B),
        before: None,
        waiting: Some(Slot::A),
        enable: true,
        storing: Storing::Failed(Refusal::Flash),
    };
    assert_eq!(
        body(&Reply::AtStart(at_start)),
        [9, 1, 1, 0, 1, 0, 1, 2, 23]
    );
    let weight = TermWeight {
        term: 300,
        output: 1,
        value: 0.5,
        limits: [-1.0, 1.0],
    };
    let weights = heapless::Vec::from_slice(&[weight]).unwrap();
    let expected = [
        10, 1, 0xAC, 2, 1, 0, 0, 0, 0x3F, 0, 0, 0x80, 0xBF, 0, 0, 0x80, 0x3F,
    ];
    assert_eq!(body(&Reply::Weights(weights)), expected);
    let last = LoadError::SectionLength {
        stated: 1,
        computed: 2,
    };
    assert_eq!(body(&Reply::Refused(last.into())), [7, 12, 49, 1, 2]);
    let part = Part::Grid(3);
    let truncated = LoadError::Truncated { part };
    assert_eq!(body(&Reply::Refused(truncated.into())), [7, 12, 7, 12, 3]);
}

#[test]
fn the_version_answer_keeps_its_shape_for_ever() {
    let mut out = [0; 16];
    let bytes = encode_version_answer(&mut out).unwrap();
    assert_eq!(bytes, [1, 7, 1, 1, 0xC5, 0xD8, 0x5D, 0x91, 0]);
    let mut receiver = Receiver::new();
    let last = bytes.iter().map(|&byte| receiver.push(byte)).last();
    assert_eq!(last, Some(Received::Frame));
    let versions = VersionAnswer {
        lowest: 1,
        highest: 1,
    };
    assert_eq!(receiver.frame(), Some(Framed::VersionAnswer(versions)));
}

#[test]
fn a_frame_of_another_version_is_recognised_whatever_follows_its_version() {
    for body in [&[][..], &[1, 2, 3], &[0; 500]] {
        let mut plain = vec![9];
        plain.extend(body);
        let check = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&plain);
        plain.extend(check.to_le_bytes());
        let mut receiver = Receiver::new();
        for byte in ::cobs::encode_vec(&plain) {
            assert_eq!(receiver.push(byte), Received::Nothing);
        }
        assert_eq!(receiver.push(END), Received::Frame);
        assert_eq!(receiver.frame(), Some(Framed::OtherVersion(9)));
    }
}

fn full<const N: usize>(value: f32) -> heapless::Vec<f32, N> {
    heapless::Vec::from_slice(&[value; N]).unwrap()
}

#[test]
fn the_largest_messages_fit_into_a_frame() {
    let chunk = wire(&Request::Chunk {
        offset: u32::MAX,
        bytes: &[0xFF; MOST_CHUNK],
    });
    assert!(chunk.len() <= MOST_WIRE);
    let limits = LimitCounts {
        value: u32::MAX,
        rate: u32::MAX,
        travel: u32::MAX,
    };
    let fault = Some(Fault::Load(
        Slot::B,
        LoadError::UnknownVariant {
            part: Part::Term(u16::MAX),
            found: u32::MAX,
        },
    ));
    let report = Report {
        positions: full(1e30),
        dq: full(1e30),
        computed: full(1e30),
        auxiliaries: full(1e30),
        sensors_lost: u8::MAX,
        weights: heapless::Vec::from_slice(&[(u16::MAX, 1e30); crate::ADJUSTABLE]).unwrap(),
        enabled: true,
        dry_run: true,
        suspended: true,
        referenced: u16::MAX,
        factor: 1.0,
        conditions: u16::MAX,
        saturated: u16::MAX,
        rate_limited: u16::MAX,
        travel_limited: u16::MAX,
        limits: heapless::Vec::from_slice(&[limits; MOST_AXES]).unwrap(),
        updates: u32::MAX,
        missed: u32::MAX,
        cost: u32::MAX,
        worst_cost: u32::MAX,
        cost_unit: CostUnit::Instructions,
        activation: Activation::Fading(Slot::B),
        upload: Upload::Committed {
            slot: Slot::B,
            sequence: u32::MAX,
        },
        fault,
    };
    let report = Reply::Status(report);
    let bytes = wire(&report);
    let (bodies, _) = received(&bytes);
    assert_eq!(
        postcard::from_bytes::<Reply<'_>>(&bodies[0]).unwrap(),
        report
    );
    let name: String = core::iter::repeat_n('ä', 100).collect();
    let slot = SlotReport {
        state: SlotState::Valid {
            sequence: u32::MAX,
            length: u32::MAX,
            crc: u32::MAX,
        },
        erased: u32::MAX,
    };
    wire(&Reply::Hello(Hello {
        session: u32::MAX,
        firmware: &name,
        board: &name,
        formats: [u16::MAX; 2],
        capacities: Capacities {
            axes: 16,
            banks: u16::MAX,
            tables: u16::MAX,
            terms: u16::MAX,
            grids: u16::MAX,
            slot: u32::MAX,
        },
        period: 1.0,
        while_busy: WhileBusy::ServoInRam,
        machine: short_name(&name),
        axes: "XYZABCUVWXYZABCU".try_into().unwrap(),
        auxiliaries: 8,
        active: Some(Slot::B),
        slots: [slot; 2],
        fault,
    }));
    for axes in 1..=MOST_AXES {
        let rows = motion_rows(axes);
        assert!(rows >= 7, "{rows} rows of {axes} axes");
        wire(&Reply::Motion(&vec![1; rows * (8 * axes + 8)]));
        wire(&Request::Motion(&vec![1; rows * 4 * axes]));
        for auxiliaries in 0..=crate::AUXILIARIES {
            let rows = evaluate_rows(axes, auxiliaries);
            let length = EvaluateRow::bytes(axes, auxiliaries);
            wire(&Request::Evaluate(&vec![1; rows * length]));
        }
    }
    // One byte more than fits is an error, not a frame.
    let (mut scratch, mut out) = ([0; 2 * MOST_BODY], [0; 2 * MOST_WIRE]);
    let long = [1; MOST_BODY - 2];
    let result = encode(HEADER, &Reply::Motion(&long), &mut scratch, &mut out);
    assert_eq!(result, Err(FrameError::TooLong));
}

#[test]
fn a_long_name_is_cut_between_characters() {
    let name: String = core::iter::repeat_n('ä', 100).collect();
    assert_eq!(short_name(&name).len(), MOST_NAME);
    let odd = String::from("a") + &name;
    assert_eq!(short_name(&odd).len(), MOST_NAME - 1);
    assert_eq!(short_name("Huron"), "Huron");
}

type Six = EvaluateRow<[f32; 6], [Travel; 6]>;
type Three = EvaluateRow<[f32; 3], [Travel; 3]>;

#[test]
fn rows_come_back_as_they_were_written() {
    let row = EvaluateRow {
        inputs: Inputs {
            axes: [1.0, -2.0, f32::NAN, 4.0, 0.0, 0.0],
            auxiliaries: [7.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        },
        travelling: Travelling([
            Travel::Positive,
            Travel::Negative,
            Travel::Unknown,
            Travel::Negative,
            Travel::Unknown,
            Travel::Unknown,
        ]),
    };
    let mut bytes = [0; 28];
    assert!(row.put(4, 2, &mut bytes).unwrap().is_empty());
    let (back, rest) = Six::get(&bytes, 4, 2).unwrap();
    assert!(rest.is_empty());
    assert_eq!(back.inputs.axes[2].to_bits(), f32::NAN.to_bits());
    assert_eq!(back.travelling, row.travelling);
    assert_eq!(back.inputs.auxiliaries, row.inputs.auxiliaries);
    bytes[24] |= 3;
    assert!(Six::get(&bytes, 4, 2).is_none(), "direction 3");
    assert!(Six::get(&bytes[..27], 4, 2).is_none());
    assert!(Three::get(&bytes, 4, 2).is_none(), "no room");

    let result = MotionResult(Correction {
        dq: [1.0, 2.0],
        computed: [3.0, 4.0],
        status: Status {
            conditions: Conditions(0x1234),
            saturated: 1,
            rate_limited: 2,
            travel_limited: 0x8000,
        },
    });
    let mut bytes = [0; 24];
    assert!(result.put(2, &mut bytes).unwrap().is_empty());
    let (back, rest) = MotionResult::<[f32; 2]>::get(&bytes, 2).unwrap();
    assert_eq!((back, rest.len()), (result, 0));
    assert!(result.put(2, &mut bytes[..23]).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn cobs_is_that_of_the_cobs_crate(
        bytes in prop::collection::vec(prop_oneof![Just(0_u8), Just(255), any::<u8>()], 0..900),
        run in 0_usize..600,
    ) {
        // Includes long runs without zeros.
        let mut bytes = bytes;
        bytes.extend(core::iter::repeat_n(0x11, run));
        let mut out = [0; 2000];
        let mut encoder = cobs::Encoder::new(&mut out);
        encoder.put(&bytes).unwrap();
        let length = encoder.finish().unwrap();
        let mut expected = ::cobs::encode_vec(&bytes);
        expected.push(0);
        // For a full last block that crate adds an empty one; both forms are valid.
        let ours = &out[..length];
        if !(bytes.len() >= 254 && expected.len() == ours.len() + 1) {
            prop_assert_eq!(ours, &expected[..]);
        }
        prop_assert!(length <= cobs::encoded(bytes.len()) + 1);
        prop_assert_eq!(&::cobs::decode_vec(&ours[..length - 1]).unwrap(), &bytes);
        for wire in [ours, &expected] {
            let mut decoder = cobs::Decoder::NEW;
            let back: Vec<u8> = wire[..wire.len() - 1].iter().filter_map(|&b| decoder.push(b)).collect();
            prop_assert!(decoder.is_whole());
            prop_assert_eq!(&back, &bytes);
        }
    }

    #[test]
    fn a_frame_is_found_after_any_garbage_that_a_zero_ends(
        garbage in prop::collection::vec(any::<u8>(), 0..3000),
        flip in any::<(usize, u8)>(),
    ) {
        let frame = wire(&Request::Chunk { offset: 5, bytes: &[0, 1, 2, 0, 0, 3] });
        let mut stream = garbage;
        stream.push(END);
        stream.extend(&frame);
        let (bodies, _) = received(&stream);
        prop_assert_eq!(bodies.len(), 1);
        // A changed frame is not accepted.
        let mut changed = frame.clone();
        let place = flip.0 % (frame.len() - 1);
        changed[place] ^= 1 << (flip.1 % 8);
        changed.push(END);
        prop_assert_eq!(received(&changed).0.len(), 0);
        // Nor is a frame without its start.
        prop_assert_eq!(received(&frame[1 + place / 2..]).0.len(), 0);
    }
}
