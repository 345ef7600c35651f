use super::*;
use embedded_hal::spi::{ErrorType, Operation};
use std::vec::Vec;
use trueaxis::{Conditions, Status};

/// A motion side that says `frame` and notes what it hears.
struct Wire {
    says: [u8; MOST],
    heard: Vec<u8>,
}

impl ErrorType for Wire {
    type Error = core::convert::Infallible;
}

impl SpiDevice for Wire {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Self::Error> {
        for operation in operations {
            match operation {
                Operation::Transfer(read, write) => {
                    assert_eq!(read.len(), write.len());
                    read.copy_from_slice(&self.says[..read.len()]);
                    self.heard = write.to_vec();
                }
                _ => unreachable!("only transfers"),
            }
        }
        Ok(())
    }
}

const Q: [f32; 3] = [1.0, -2.5, 700.0];

fn motion(says: [u8; MOST]) -> SpiMotion<Wire> {
    SpiMotion::new(Wire {
        says,
        heard: Vec::new(),
    })
}

fn take(motion: &mut SpiMotion<Wire>) -> Option<Command<[f32; 3]>> {
    motion.ends().0.take()
}

#[test]
fn a_command_comes_and_its_correction_goes_out_in_the_next_period() {
    let mut motion = motion(put(7, 0b101, &Q).unwrap());
    let command = Command {
        axes: Q,
        referenced: 0b101,
    };
    assert_eq!(take(&mut motion), Some(command));
    let correction = Correction {
        dq: [0.01, 0.0, -0.5],
        computed: [0.0; 3],
        status: Status {
            conditions: Conditions::RAMPING,
            ..Status::default()
        },
    };
    motion.ends().1.give(&correction);
    motion.device.says = put(8, 0b101, &Q).unwrap();
    assert!(take(&mut motion).is_some());
    let mut heard = [0; MOST];
    heard[..motion.device.heard.len()].copy_from_slice(&motion.device.heard);
    let (count, conditions, dq) = get::<3>(&heard).unwrap();
    assert_eq!((count, dq), (7, correction.dq));
    assert_eq!(conditions, Conditions::RAMPING.0);
    assert_eq!(motion.device.heard.len(), 20);
}

#[test]
fn the_same_command_again_is_none() {
    let mut motion = motion(put(7, 0b111, &Q).unwrap());
    assert!(take(&mut motion).is_some());
    assert_eq!(take(&mut motion), None);
    assert_eq!(motion.failures(), 1);
}

#[test]
fn every_damaged_bit_and_an_open_wire_are_no_command() {
    let good = put(7, 0b111, &Q).unwrap();
    for bit in 0..20 * 8 {
        let mut bad = good;
        bad[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(take(&mut motion(bad)), None, "bit {bit}");
    }
    for level in [0x00, 0xFF] {
        assert_eq!(take(&mut motion([level; MOST])), None);
    }
}

#[test]
fn the_longest_frame_fits() {
    assert!(put(0, 0, &[0.0; trueaxis::link::MOST_AXES]).is_some());
    assert!(put(0, 0, &[0.0; trueaxis::link::MOST_AXES + 1]).is_none());
}
