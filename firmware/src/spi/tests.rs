use embedded_hal::spi::{ErrorType, Operation, SpiDevice};
use std::vec::Vec;
use trueaxis::{Conditions, Correction, Status};

use super::*;
use crate::device::{Command, CorrectionSink, Enabling, PositionSource, Regularity};

const Q: [f32; 3] = [1.0, -2.5, 700.0];
const LENGTH: usize = length(3);

fn said(count: u8) -> CommandFrame<[f32; 3]> {
    CommandFrame {
        count,
        command: Command::new(Q, 0b101),
    }
}

fn bytes(said: &CommandFrame<[f32; 3]>) -> Vec<u8> {
    said.put(&mut [0; MOST]).unwrap().to_vec()
}

/// Adds the correct checksum to bytes.
fn no_frame(bytes: &[u8]) -> Option<NoFrame> {
    CommandFrame::<[f32; 3]>::get(bytes).err()
}

fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let check = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let at = bytes.len() - 4;
    let sum = check.checksum(&bytes[..at]).to_le_bytes();
    bytes[at..].copy_from_slice(&sum);
    bytes
}

#[test]
fn the_bytes_are_those_of_the_table() {
    let command = CommandFrame {
        count: 7,
        command: Command {
            enabling: Enabling::Off,
            tool_length: Some(130.0),
            ..said(7).command
        },
    };
    let mut expected = vec_of(
        &[2, 7, 0b101, 0, 0b110, 3, 0, 0],
        &[130.0, 1.0, -2.5, 700.0],
    );
    assert_eq!(bytes(&command), expected);
    assert_eq!(CommandFrame::get(&expected), Ok(command));
    let answer = Answer {
        count: Some(9),
        healthy: true,
        conditions: Conditions::RAMPING,
        irregular: 0x0102,
        dq: Q,
    };
    expected = vec_of(&[2, 9, 32, 0, 0b11, 3, 2, 1], &[0.0, 1.0, -2.5, 700.0]);
    assert_eq!(answer.put(&mut [0; MOST]).unwrap(), expected);
    assert_eq!(Answer::get(&expected), Ok(answer));
    let nothing = Answer::<[f32; 3]>::NOTHING;
    let written = nothing.put(&mut [0; MOST]).unwrap().to_vec();
    assert_eq!(written[4], 0, "neither answers nor is healthy");
    assert_eq!(Answer::get(&written), Ok(nothing));
}

fn vec_of(head: &[u8], values: &[f32]) -> Vec<u8> {
    let mut bytes = head.to_vec();
    bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    bytes.extend([0; 4]);
    sealed(bytes)
}

#[test]
fn each_way_of_enabling_comes_back_and_a_fourth_is_none() {
    for enabling in [Enabling::Host, Enabling::On, Enabling::Off] {
        for tool_length in [None, Some(0.0), Some(-12.5)] {
            let command = Command {
                enabling,
                tool_length,
                ..said(1).command
            };
            let sent = CommandFrame { count: 1, command };
            assert_eq!(CommandFrame::get(&bytes(&sent)), Ok(sent));
        }
    }
    for (place, value) in [(0, 1), (4, 3), (4, 8), (5, 2), (6, 1), (7, 1)] {
        let mut other = bytes(&said(1));
        other[place] = value;
        let other = sealed(other);
        assert_eq!(no_frame(&other), Some(NoFrame::Unknown), "{place}");
    }
    let mut answer = Answer::<[f32; 3]>::NOTHING
        .put(&mut [0; MOST])
        .unwrap()
        .to_vec();
    answer[4] = 4;
    let answer = sealed(answer);
    assert_eq!(Answer::<[f32; 3]>::get(&answer), Err(NoFrame::Unknown));
}

#[test]
fn every_damaged_bit_an_open_wire_and_another_length_are_no_frame() {
    let good = bytes(&said(7));
    assert_eq!(good.len(), LENGTH);
    for bit in 0..LENGTH * 8 {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(no_frame(&bad), Some(NoFrame::Check), "bit {bit}");
    }
    for level in [0x00, 0xFF] {
        assert_eq!(no_frame(&[level; LENGTH]), Some(NoFrame::Check));
    }
    for length in [0, 3, 4, LENGTH - 1] {
        assert_eq!(no_frame(&good[..length]), Some(NoFrame::Length));
    }
    // Valid, but for another number of axes.
    assert_eq!(CommandFrame::<[f32; 2]>::get(&good), Err(NoFrame::Length));
}

#[test]
fn the_longest_frame_fits_and_a_longer_one_is_not_written() {
    let long = CommandFrame {
        count: 0,
        command: Command::new([0.0; trueaxis::link::MOST_AXES], 0),
    };
    assert!(long.put(&mut [0; MOST]).is_some());
    assert!(long.put(&mut [0; MOST - 1]).is_none());
}

type Three = Intake<[f32; 3]>;

/// Hears frames with these counters in one period, then takes.
fn period(intake: &mut Three, counts: &[u8]) -> Option<Command<[f32; 3]>> {
    for count in counts {
        intake.hear(&bytes(&said(*count)));
    }
    intake.take()
}

#[test]
fn nothing_is_missed_before_the_first_frame() {
    let mut intake = Three::new(Tolerance::USUAL);
    for _ in 0..1000 {
        assert_eq!(period(&mut intake, &[]), None);
    }
    assert_eq!(intake.seen(), Regularity::NONE);
    assert_eq!(intake.count(), None);
    // Whatever its counter is.
    assert_eq!(period(&mut intake, &[200]), Some(said(200).command));
    assert_eq!(intake.count(), Some(200));
    let frames = Regularity {
        frames: 1,
        ..Regularity::NONE
    };
    assert_eq!(intake.seen(), frames);
}

#[test]
fn four_periods_in_a_row_without_a_frame_are_tolerated_and_the_fifth_is_a_fault() {
    let mut intake = Three::new(Tolerance::USUAL);
    period(&mut intake, &[1]);
    for _ in 0..4 {
        assert_eq!(period(&mut intake, &[]), Some(said(1).command));
        assert!(!intake.seen().fault);
    }
    for repeated in 5..100 {
        assert_eq!(period(&mut intake, &[]), None);
        let seen = intake.seen();
        assert_eq!(
            (seen.fault, seen.faults, seen.repeated),
            (true, 1, repeated)
        );
    }
    // The fault ends when the whole debt is paid back: of the four tolerated and one more.
    for count in 2..=81 {
        assert!(intake.seen().fault, "{count}");
        assert!(period(&mut intake, &[count]).is_some());
    }
    assert!(!intake.seen().fault);
    assert_eq!(intake.seen().skipped, 0, "as many as there were periods");
}

#[test]
fn a_frame_that_comes_again_or_damaged_is_none() {
    let mut intake = Three::new(Tolerance::USUAL);
    period(&mut intake, &[1]);
    period(&mut intake, &[1]);
    assert_eq!((intake.seen().repeated, intake.seen().damaged), (1, 0));
    let mut bad = bytes(&said(2));
    bad[12] ^= 1;
    intake.hear(&bad);
    assert_eq!(intake.take(), Some(said(1).command));
    let seen = intake.seen();
    assert_eq!((seen.repeated, seen.damaged, seen.skipped), (2, 1, 0));
    // A damaged frame is not also counted as skipped.
    period(&mut intake, &[4]);
    let seen = intake.seen();
    assert_eq!((seen.frames, seen.repeated, seen.skipped), (2, 2, 0));
}

#[test]
fn four_frames_without_a_period_are_tolerated_and_the_fifth_is_a_fault() {
    // Frames that did not arrive, and frames that arrived together; across the wrap of the counter.
    for (counts, fault) in [
        (&[254, 255, 0, 1, 2][..], false),
        (&[2], false),
        (&[254, 255, 0, 1, 2, 3], true),
        (&[3], true),
        (&[255, 3], true),
    ] {
        let mut intake = Three::new(Tolerance::USUAL);
        period(&mut intake, &[253]);
        let newest = *counts.last().unwrap();
        assert_eq!(period(&mut intake, counts), Some(said(newest).command));
        let seen = intake.seen();
        assert_eq!(
            (seen.fault, seen.faults),
            (fault, u32::from(fault)),
            "{counts:?}"
        );
        assert_eq!(seen.skipped, 4 + u32::from(fault));
        assert_eq!((seen.frames, seen.repeated), (2, 0));
    }
}

#[test]
fn one_in_seventeen_may_be_missing_for_ever_and_one_in_sixteen_not() {
    for (every, fault) in [(17, false), (16, true)] {
        let mut intake = Three::new(Tolerance::USUAL);
        let mut count = 0_u8;
        for number in 0..10_000 {
            if number % every == every - 1 {
                period(&mut intake, &[]);
            } else {
                count = count.wrapping_add(1);
                period(&mut intake, &[count]);
            }
        }
        assert_eq!(intake.seen().faults > 0, fault, "one in {every}");
    }
}

/// A motion side that is the slave, sends `says` and records what it hears.
struct Wire {
    says: Vec<u8>,
    heard: Vec<u8>,
    broken: bool,
}

#[derive(Debug)]
struct Broken;

impl embedded_hal::spi::Error for Broken {
    fn kind(&self) -> embedded_hal::spi::ErrorKind {
        embedded_hal::spi::ErrorKind::Other
    }
}

impl ErrorType for Wire {
    type Error = Broken;
}

impl SpiDevice for Wire {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Broken> {
        for operation in operations {
            let Operation::Transfer(read, write) = operation else {
                unreachable!("only transfers")
            };
            read.copy_from_slice(&self.says);
            self.heard = write.to_vec();
        }
        if self.broken { Err(Broken) } else { Ok(()) }
    }
}

#[test]
fn a_board_that_asks_gives_the_correction_with_the_next_question() {
    let wire = Wire {
        says: bytes(&said(7)),
        heard: Vec::new(),
        broken: false,
    };
    let mut polled = Polled::<_, 3>::new(wire, Tolerance::USUAL);
    let correction = Correction {
        dq: [0.01, 0.0, -0.5],
        computed: [0.0; 3],
        status: Status {
            conditions: Conditions::RAMPING,
            ..Status::default()
        },
    };
    let (mut source, mut sink) = polled.poll();
    assert_eq!(source.take(), Some(said(7).command));
    assert_eq!(source.regularity().frames, 1);
    sink.give(&correction, true);
    assert_eq!(
        Answer::get(&polled.device().heard),
        Ok(Answer::<[f32; 3]>::NOTHING)
    );

    // Now the bus fails: bytes left by it are not used.
    polled.device().says = bytes(&said(8));
    polled.device().broken = true;
    assert_eq!(polled.poll().0.take(), Some(said(7).command));
    let answer = Answer {
        count: Some(7),
        healthy: true,
        conditions: Conditions::RAMPING,
        irregular: 0,
        dq: correction.dq,
    };
    assert_eq!(Answer::get(&polled.device().heard), Ok(answer));
    let seen = polled.exchange().seen();
    assert_eq!((seen.damaged, seen.repeated), (1, 1));

    polled.device().broken = false;
    assert_eq!(polled.poll().0.take(), Some(said(8).command));
    let heard = Answer::<[f32; 3]>::get(&polled.device().heard).unwrap();
    assert_eq!(heard.irregular, 1);
}
