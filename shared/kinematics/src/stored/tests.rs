//! Files that read back as written, and files that are refused.

use super::*;
use crate::{Kinematics, Parameter, Situation, Switches};
use std::vec::Vec as List;

fn machine() -> Machine {
    let mut machine = Machine::new(&[
        Axis::new(Letter::Y, Branch::Workpiece, [-150.0, 150.0]),
        Axis {
            modulo: true,
            reversed: true,
            ..Axis::new(Letter::C, Branch::Workpiece, [-180.0, 180.0])
                .at([1.0, 2.0, 3.0, 0.1, 0.2, 0.3])
        },
        Axis::new(Letter::X, Branch::Tool, [-250.0, 250.0]),
        Axis::new(Letter::Z, Branch::Tool, [0.0, 300.0]),
    ])
    .unwrap();
    machine.tip = [0.0, 0.0, -100.0];
    machine.workpiece = crate::Htm::from_xyz_abc([5.0, 6.0, 7.0, 0.0, 0.0, 0.5]);
    machine
}

/// One of every kind.
fn errors(machine: &Machine) -> ErrorModel<List<f64>> {
    let mut errors = ErrorModel::new(machine);
    let named = |name| Parameter::parse(name).unwrap();
    for (name, value) in [
        ("EB0Z", 50e-6),
        ("EX0S", 1e-3),
        ("EXX1", 20e-6),
        ("EYX3", 0.0),
        ("EYX1", 3e-6),
        ("EXXb", 4e-3),
        ("EXCc2", 1e-3),
        ("EBCs1", 2e-5),
    ] {
        assert!(errors.set(machine, named(name), value), "{name}");
    }
    for (name, sensor) in [("EZ0S", 1), ("EYY1", 0), ("EXCs3", 1)] {
        assert!(errors.set_per_kelvin(machine, named(name), sensor, 1e-6));
    }
    let table = |both: bool| Table {
        at: List::from([-100.0, 0.0, 200.0]),
        positive: List::from([1e-3, 2e-3, -1e-3]),
        negative: both.then(|| List::from([0.0, 1e-3, -2e-3])),
    };
    assert!(errors.tabulate(3, 2, table(true)) && errors.tabulate(2, 4, table(false)));
    errors.calibrated[2] = [-200.0, 200.0];
    errors
}

/// The bytes aligned to 8, like a file read into such a buffer.
struct Aligned(List<u64>, usize);

impl Aligned {
    fn new(bytes: &[u8]) -> Self {
        let words = bytes.chunks(8).map(|chunk| {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            u64::from_ne_bytes(word)
        });
        Self(words.collect(), bytes.len())
    }
    fn bytes(&self) -> &[u8] {
        &bytemuck::cast_slice(&self.0)[..self.1]
    }
}

/// The second one follows the same reading as the first one, with a lag.
const SENSORS: [Sensor; 2] = [
    Sensor {
        reading: 0,
        reference: 20.0,
        lag: 0.0,
    },
    Sensor {
        reading: 0,
        reference: 21.5,
        lag: 218.0,
    },
];

fn file() -> List<u8> {
    let machine = machine();
    Stored::write("Mill", &machine, &errors(&machine), &SENSORS).unwrap()
}

fn refused(bytes: &[u8]) -> StoredError {
    Stored::read(Aligned::new(bytes).bytes()).unwrap_err()
}

fn sealed(mut file: List<u8>) -> List<u8> {
    let length = u32::try_from(file.len()).unwrap();
    file[8..12].copy_from_slice(&length.to_le_bytes());
    let crc = checksum(&file);
    file[12..16].copy_from_slice(&crc.to_le_bytes());
    file
}

#[test]
fn what_is_read_is_what_was_written() {
    let machine = machine();
    let errors = errors(&machine);
    let file = Aligned::new(&file());
    let stored = Stored::read(file.bytes()).unwrap();
    assert_eq!((stored.name, &stored.machine), ("Mill", &machine));
    assert_eq!(stored.sensors[..], SENSORS);
    let (a, b) = (
        Kinematics::new(&machine, &errors),
        Kinematics::new(&stored.machine, &stored.errors),
    );
    let q = [33.0, 0.5, -220.0, 17.0, 0.0, 0.0];
    let mut situation = Situation {
        sign: [1.0, -1.0, -1.0, -1.0, 0.0, 0.0],
        ..Situation::default()
    };
    (situation.kelvin[0], situation.kelvin[1]) = (3.0, -2.0);
    let pose = a.actual(&q, &situation, &Switches::ALL);
    assert_eq!(pose, b.actual(&q, &situation, &Switches::ALL));
    assert_ne!(pose, a.nominal(&q, None));
    for (index, motions) in errors.motions.iter().enumerate() {
        for (component, motion) in motions.iter().enumerate() {
            let read = &stored.errors.motions[index][component];
            assert_eq!(read.holds(), motion.holds());
            assert_eq!(read.reverses(), motion.reverses());
        }
    }
}

#[test]
fn every_byte_that_is_changed_and_every_cut_is_noticed() {
    let file = file();
    for at in 0..file.len() {
        let mut changed = file.clone();
        changed[at] ^= 1;
        refused(&changed);
        refused(&file[..at]);
    }
    assert_eq!(refused(&file[..8]), StoredError::NoModel);
    assert_eq!(refused(&file[..file.len() - 1]), StoredError::Damaged);
    let mut other = file.clone();
    other[4] = 2;
    assert_eq!(refused(&other), StoredError::Version { found: 2 });
    other[0] = b'X';
    assert_eq!(refused(&other), StoredError::NoModel);
}

#[test]
fn a_file_off_its_place_is_refused() {
    let mut bytes = List::from([0; 4]);
    bytes.extend(file());
    let file = Aligned::new(&bytes);
    let result = Stored::read(&file.bytes()[4..]);
    assert_eq!(result.unwrap_err(), StoredError::Misaligned);
}

#[test]
fn contents_that_make_no_sense_are_refused_although_the_checksum_is_right() {
    let good = file();
    let end = good.len();
    let mut wrong = good.clone();
    wrong[end - 8..].copy_from_slice(&f64::NAN.to_le_bytes());
    assert_eq!(refused(&sealed(wrong)), StoredError::Contents);
    // One point too many, and one too few.
    let mut wrong = good.clone();
    wrong.extend([0; 8]);
    assert_eq!(refused(&sealed(wrong)), StoredError::Contents);
    assert_eq!(
        refused(&sealed(good[..end - 8].to_vec())),
        StoredError::Contents
    );
    // Longer than the file.
    let mut wrong = good.clone();
    wrong[16..20].copy_from_slice(&u32::MAX.to_le_bytes());
    assert_eq!(refused(&sealed(wrong)), StoredError::Contents);
}

#[test]
fn any_damage_under_a_right_checksum_is_read_or_refused_and_never_panics() {
    let good = file();
    let mut kept = 0;
    for at in 16..good.len() {
        for value in [0, 1, 2, 5, 6, 7, 0x7f, 0x80, 0xff] {
            let mut changed = good.clone();
            changed[at] = value;
            let changed = Aligned::new(&sealed(changed));
            if let Ok(stored) = Stored::read(changed.bytes()) {
                kept += 1;
                let kinematics = Kinematics::new(&stored.machine, &stored.errors);
                let situation = Situation::default();
                let _ = kinematics.actual(&[1.0; 6], &situation, &Switches::ALL);
            }
        }
    }
    // Most bytes are parts of numbers, for which any value is valid.
    assert!(kept > good.len());
}
