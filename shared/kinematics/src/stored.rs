//! A machine with its errors in one file that is read in place, for the simulation of a real machine.
//!
//! | bytes | contents |
//! |---|---|
//! | 0…3 | `TRAM` |
//! | 4…5 | version, 1 |
//! | 6…7 | 0 |
//! | 8…11 | length of the whole file |
//! | 12…15 | CRC-32/ISO-HDLC over everything but these four |
//! | 16…19 | length of the description |
//! | 20…23 | 0 |
//! | from 24 | the description, in postcard; zeros up to the next multiple of 8 |
//! | then | points of tables (f64), in the order of the tables: positions, values, values after negative travel |
//!
//! All numbers are little-endian. The points are used in place.

mod description;
#[cfg(feature = "std")]
mod write;

use crate::{
    Axis, Branch, Change, ErrorModel, InterChange, Letter, MAX_AXES, MAX_SENSORS, Machine,
    ParameterKind, Table,
};
use core::fmt;
use description::{AxisEntry, Frame, Head, Item, Kind};
use heapless::Vec;
use serde::Deserialize;

const MAGIC: [u8; 4] = *b"TRAM";
const VERSION: u16 = 1;
/// Bytes before the description.
const HEADER: usize = 24;
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
/// Upper limit of every number in a description: travels end at 1e5, and errors are small.
const LARGEST: f64 = 1e9;

/// A machine with its errors; its tabulated motions stay in the file.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored<'f> {
    /// The machine's name.
    pub name: &'f str,
    /// The machine.
    pub machine: Machine,
    /// Errors of the machine.
    pub errors: ErrorModel<&'f [f64]>,
    /// The temperatures on which errors depend.
    pub sensors: Vec<Sensor, MAX_SENSORS>,
}

/// A temperature on which errors depend.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sensor {
    /// The reading (by index) that it follows: sensors with several lags share one.
    pub reading: usize,
    /// Reference temperature (°C).
    pub reference: f64,
    /// Time constant (s) with which the effect follows the reading; 0 if it does at once.
    pub lag: f64,
}

/// Why a file is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoredError {
    /// It does not start with the magic bytes of a model file.
    NoModel,
    /// The version is unknown.
    Version {
        /// The version found.
        found: u16,
    },
    /// Length or its checksum is wrong.
    Damaged,
    /// It does not start at a multiple of 8 bytes, or this system is not little-endian.
    Misaligned,
    /// Checksum is correct but its contents are not valid.
    Contents,
}

impl fmt::Display for StoredError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoModel => f.write_str("not a machine model: it does not start with TRAM"),
            Self::Version { found } => write!(f, "version {found} is unknown here"),
            Self::Damaged => f.write_str("it is damaged or incomplete"),
            Self::Misaligned => f.write_str("it must start at a multiple of 8 bytes"),
            Self::Contents => f.write_str("its contents are not valid"),
        }
    }
}

impl core::error::Error for StoredError {}

/// CRC-32 over everything but the checksum field itself.
fn checksum(file: &[u8]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&file[..12]);
    digest.update(&file[16..]);
    digest.finalize()
}

impl<'f> Stored<'f> {
    /// Reads a file that starts at a multiple of 8 bytes. Checks everything needed to compute a pose, but not whether
    /// the machine can be corrected ([`Machine::check`]).
    ///
    /// # Errors
    /// [`StoredError`].
    pub fn read(file: &'f [u8]) -> Result<Self, StoredError> {
        let Some((header, rest)) = file.split_first_chunk::<HEADER>() else {
            return Err(StoredError::NoModel);
        };
        let word = |at: usize| {
            let bytes = [header[at], header[at + 1], header[at + 2], header[at + 3]];
            u32::from_le_bytes(bytes) as usize
        };
        if header[..4] != MAGIC {
            return Err(StoredError::NoModel);
        }
        let version = u16::from_le_bytes([header[4], header[5]]);
        if version != VERSION {
            return Err(StoredError::Version { found: version });
        }
        if word(8) != file.len() || word(12) != checksum(file) as usize {
            return Err(StoredError::Damaged);
        }
        if cfg!(target_endian = "big") {
            return Err(StoredError::Misaligned);
        }
        let (described, points) = rest
            .split_at_checked(word(16).next_multiple_of(8))
            .ok_or(StoredError::Contents)?;
        let points = bytemuck::try_cast_slice(points).map_err(|_| StoredError::Misaligned)?;
        read(&described[..word(16)], points)
    }
}

/// Decodes the next part of a description.
fn next<'f, T: Deserialize<'f>>(rest: &mut &'f [u8]) -> Result<T, StoredError> {
    let (part, after) = postcard::take_from_bytes(rest).map_err(|_| StoredError::Contents)?;
    *rest = after;
    Ok(part)
}

/// Decodes the contents if all numbers are valid and nothing is left over.
fn read<'f>(mut rest: &'f [u8], mut points: &'f [f64]) -> Result<Stored<'f>, StoredError> {
    if points.iter().any(|value| !is_number(*value)) {
        return Err(StoredError::Contents);
    }
    let head: Head<'f> = next(&mut rest)?;
    let mut axes = Vec::<Axis, MAX_AXES>::new();
    let mut calibrated = [[0.0; 2]; MAX_AXES];
    let known = calibrated.get_mut(..usize::from(head.axes));
    for known in known.ok_or(StoredError::Contents)? {
        let entry: AxisEntry = next(&mut rest)?;
        let axis = entry.axis().ok_or(StoredError::Contents)?;
        axes.push(axis).map_err(|_| StoredError::Contents)?;
        *known = entry.calibrated;
    }
    let mut machine = Machine::new(&axes).map_err(|_| StoredError::Contents)?;
    machine.tool_axis = usize::from(head.tool_axis);
    machine.tip = head.tip;
    let placed = frame(&head.spindle).zip(frame(&head.workpiece));
    let right = machine.tool_axis < 3 && head.tip.iter().all(|v| is_number(*v));
    let (Some((spindle, workpiece)), true) = (placed, right) else {
        return Err(StoredError::Contents);
    };
    (machine.spindle, machine.workpiece) = (spindle, workpiece);
    let mut errors = ErrorModel::new(&machine);
    errors.calibrated = calibrated;
    let mut stored = Stored {
        name: head.name,
        machine,
        errors,
        sensors: Vec::new(),
    };
    for _ in 0..head.items {
        stored.take(&next(&mut rest)?, &mut points)?;
    }
    match rest.is_empty() && points.is_empty() {
        true => Ok(stored),
        false => Err(StoredError::Contents),
    }
}

impl<'f> Stored<'f> {
    /// Adds one item; tables take their points from the start of `points`.
    fn take(&mut self, item: &Item, points: &mut &'f [f64]) -> Result<(), StoredError> {
        let taken = match *item {
            Item::Reference(..) | Item::Lag(..) => self.take_sensor(item),
            Item::Location(..) | Item::LocationPerKelvin(..) => self.take_location(item),
            Item::Motion(..) | Item::MotionPerKelvin(..) => self.take_motion(item),
            Item::Table(place, count, both) => self.take_table(place, count, both, points),
        };
        taken.ok_or(StoredError::Contents)
    }

    /// Adds a sensor, or the lag of the last one.
    fn take_sensor(&mut self, item: &Item) -> Option<()> {
        match *item {
            Item::Reference(celsius) if is_number(celsius) => {
                let sensor = Sensor {
                    reading: self.sensors.len(),
                    reference: celsius,
                    lag: 0.0,
                };
                self.sensors.push(sensor).ok()
            }
            Item::Lag(reading, lag) if lag >= 0.0 && is_number(lag) => {
                let reading = usize::from(reading);
                let last = self.sensors.last_mut().filter(|_| reading < MAX_SENSORS)?;
                (last.reading, last.lag) = (reading, lag);
                Some(())
            }
            _ => None,
        }
    }

    /// Adds a constant location error, or how it changes.
    fn take_location(&mut self, item: &Item) -> Option<()> {
        let place = |[index, component]: [u8; 2]| {
            let (index, component) = (usize::from(index), usize::from(component));
            (index <= self.machine.axes.len() && component < 6).then_some((index, component))
        };
        match *item {
            Item::Location(at, value) if is_number(value) => {
                let (index, component) = place(at)?;
                self.errors.inter[index][component] = value;
                Some(())
            }
            Item::LocationPerKelvin(at, sensor, per_kelvin) if is_number(per_kelvin) => {
                let (index, component) = place(at)?;
                let change = InterChange {
                    index,
                    component,
                    sensor: usize::from(sensor),
                    per_kelvin,
                };
                let thermal = &mut self.errors.inter_thermal;
                (change.sensor < MAX_SENSORS && thermal.push(change).is_ok()).then_some(())
            }
            _ => None,
        }
    }

    /// The axis and the component of an error motion.
    fn motion(&self, [index, component]: [u8; 2]) -> Option<(usize, usize)> {
        let (index, component) = (usize::from(index), usize::from(component));
        (index < self.machine.axes.len() && component < 6).then_some((index, component))
    }

    /// Adds a parameter of an error motion, or how it changes.
    fn take_motion(&mut self, item: &Item) -> Option<()> {
        let taken = match *item {
            Item::Motion(at, kind, value) if is_number(value) => {
                let (index, component) = self.motion(at)?;
                self.errors.motions[index][component].set(kind.parameter(), value)
            }
            Item::MotionPerKelvin(at, kind, sensor, per_kelvin) if is_number(per_kelvin) => {
                let (index, component) = self.motion(at)?;
                let change = Change {
                    kind: kind.parameter(),
                    sensor: usize::from(sensor),
                    per_kelvin,
                };
                let thermal = &mut self.errors.motions[index][component].thermal;
                change.sensor < MAX_SENSORS
                    && change.kind != ParameterKind::Backlash
                    && thermal.push(change).is_ok()
            }
            _ => false,
        };
        taken.then_some(())
    }

    /// Adds a table of an error motion.
    fn take_table(
        &mut self,
        place: [u8; 2],
        count: u32,
        both: bool,
        points: &mut &'f [f64],
    ) -> Option<()> {
        let mut column = || {
            let (taken, rest) = points.split_at_checked(count as usize)?;
            *points = rest;
            Some(taken)
        };
        let table = Table {
            at: column()?,
            positive: column()?,
            negative: if both { Some(column()?) } else { None },
        };
        let (index, component) = self.motion(place)?;
        self.errors.tabulate(index, component, table).then_some(())
    }
}

impl AxisEntry {
    /// The axis, if the entry is valid.
    fn axis(&self) -> Option<Axis> {
        let letter = Letter::new(char::from(self.letter))?;
        let branch = match self.tool {
            true => Branch::Tool,
            false => Branch::Workpiece,
        };
        let numbers = [self.max_speed, self.reversal_threshold];
        let pairs = [self.travel, self.calibrated];
        let right = numbers.iter().all(|v| is_number(*v))
            && pairs.iter().flatten().all(|v| is_number(*v))
            && pairs.iter().all(|[low, high]| low <= high)
            && (!self.modulo || self.travel[0] < self.travel[1]);
        right.then_some(Axis {
            frame: frame(&self.frame)?,
            modulo: self.modulo,
            reversed: self.reversed,
            max_speed: self.max_speed,
            reversal_threshold: self.reversal_threshold,
            ..Axis::new(letter, branch, self.travel)
        })
    }
}

impl Kind {
    fn parameter(self) -> ParameterKind {
        match self {
            Self::Degree(k) => ParameterKind::Degree(k),
            Self::Cosine(k) => ParameterKind::Cosine(k),
            Self::Sine(k) => ParameterKind::Sine(k),
            Self::Backlash => ParameterKind::Backlash,
        }
    }
}

/// A pose: three columns of its rotation, then its translation (mm).
fn frame(numbers: &Frame) -> Option<crate::Htm> {
    let right = numbers.iter().all(|v| is_number(*v));
    right.then(|| crate::Htm {
        r: nalgebra::Matrix3::from_column_slice(&numbers[..9]),
        t: nalgebra::Vector3::from_column_slice(&numbers[9..]),
    })
}

fn is_number(value: f64) -> bool {
    // False for NaN, too.
    value.abs() <= LARGEST
}

#[cfg(all(test, feature = "std"))]
mod tests;
