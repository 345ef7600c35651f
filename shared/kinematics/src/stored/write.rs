//! Writes the file, on the host.

use super::description::{AxisEntry, Frame, Head, Item, Kind};
use super::{HEADER, MAGIC, VERSION, checksum};
use crate::{Branch, ErrorModel, Htm, Machine, Motion, ParameterKind, Sensor, Stored};
use serde::Serialize;
use std::vec::Vec;

impl Stored<'_> {
    /// The file of a machine; `sensors` are the temperatures on which its errors depend.
    ///
    /// `None` if a table or the whole exceeds the maximum size of a file, about four billion bytes.
    #[must_use]
    pub fn write<P: AsRef<[f64]>>(
        name: &str,
        machine: &Machine,
        errors: &ErrorModel<P>,
        sensors: &[Sensor],
    ) -> Option<Vec<u8>> {
        let (items, points) = items(machine, errors, sensors)?;
        let head = Head {
            name,
            axes: u8::try_from(machine.axes.len()).ok()?,
            spindle: frame(&machine.spindle),
            tool_axis: u8::try_from(machine.tool_axis).ok()?,
            tip: machine.tip,
            workpiece: frame(&machine.workpiece),
            items: u32::try_from(items.len()).ok()?,
        };
        let mut file = Vec::from([0; HEADER]);
        put(&mut file, &head)?;
        for (axis, calibrated) in machine.axes.iter().zip(errors.calibrated) {
            let entry = AxisEntry {
                letter: axis.letter.char() as u8,
                tool: axis.branch == Branch::Tool,
                modulo: axis.modulo,
                reversed: axis.reversed,
                frame: frame(&axis.frame),
                travel: axis.travel,
                max_speed: axis.max_speed,
                reversal_threshold: axis.reversal_threshold,
                calibrated,
            };
            put(&mut file, &entry)?;
        }
        for item in &items {
            put(&mut file, item)?;
        }
        let description = u32::try_from(file.len() - HEADER).ok()?;
        // The header is itself a multiple of 8.
        file.resize(file.len().next_multiple_of(8), 0);
        for point in points {
            file.extend(point.to_le_bytes());
        }
        let length = u32::try_from(file.len()).ok()?;
        file[..4].copy_from_slice(&MAGIC);
        file[4..6].copy_from_slice(&VERSION.to_le_bytes());
        file[8..12].copy_from_slice(&length.to_le_bytes());
        file[16..20].copy_from_slice(&description.to_le_bytes());
        let crc = checksum(&file);
        file[12..16].copy_from_slice(&crc.to_le_bytes());
        Some(file)
    }
}

/// Appends a part of the description.
fn put(file: &mut Vec<u8>, part: &impl Serialize) -> Option<()> {
    // Larger than any part: the name has 64 bytes, a head or an axis 36 numbers.
    let mut room = std::vec![0; 1024];
    let part = postcard::to_slice(part, &mut room).ok()?;
    file.extend_from_slice(part);
    Some(())
}

/// All errors, and the points of tables in order.
fn items<P: AsRef<[f64]>>(
    machine: &Machine,
    errors: &ErrorModel<P>,
    sensors: &[Sensor],
) -> Option<(Vec<Item>, Vec<f64>)> {
    let mut items: Vec<Item> = Vec::new();
    for (number, sensor) in sensors.iter().enumerate() {
        items.push(Item::Reference(sensor.reference));
        if sensor.reading != number || sensor.lag != 0.0 {
            items.push(Item::Lag(u8::try_from(sensor.reading).ok()?, sensor.lag));
        }
    }
    let mut points = Vec::new();
    let place = |index: usize, component: usize| [index as u8, component as u8];
    let n = machine.axes.len();
    for (index, inter) in errors.inter[..=n].iter().enumerate() {
        for (component, value) in inter.iter().enumerate() {
            if *value != 0.0 {
                items.push(Item::Location(place(index, component), *value));
            }
        }
    }
    for change in &errors.inter_thermal {
        let at = place(change.index, change.component);
        let item = Item::LocationPerKelvin(at, change.sensor as u8, change.per_kelvin);
        items.push(item);
    }
    for (index, motions) in errors.motions[..n].iter().enumerate() {
        for (component, motion) in motions.iter().enumerate() {
            self::motion(place(index, component), motion, &mut items, &mut points)?;
        }
    }
    Some((items, points))
}

/// One error motion. All coefficients are written, including zeros: the presence of a degree makes a motion hold its
/// end value.
fn motion<P: AsRef<[f64]>>(
    at: [u8; 2],
    motion: &Motion<P>,
    items: &mut Vec<Item>,
    points: &mut Vec<f64>,
) -> Option<()> {
    for (k, value) in (0..).zip(&motion.coefficients) {
        items.push(Item::Motion(at, Kind::Degree(k), *value));
    }
    for (k, [cosine, sine]) in (1..).zip(&motion.harmonics) {
        items.push(Item::Motion(at, Kind::Cosine(k), *cosine));
        items.push(Item::Motion(at, Kind::Sine(k), *sine));
    }
    if motion.backlash != 0.0 {
        items.push(Item::Motion(at, Kind::Backlash, motion.backlash));
    }
    for change in &motion.thermal {
        let kind = match change.kind {
            ParameterKind::Degree(k) => Kind::Degree(k),
            ParameterKind::Cosine(k) => Kind::Cosine(k),
            ParameterKind::Sine(k) => Kind::Sine(k),
            ParameterKind::Inter | ParameterKind::Backlash => return None,
        };
        let (sensor, per_kelvin) = (change.sensor as u8, change.per_kelvin);
        items.push(Item::MotionPerKelvin(at, kind, sensor, per_kelvin));
    }
    if let Some(table) = &motion.table {
        let columns = [
            Some(&table.at),
            Some(&table.positive),
            table.negative.as_ref(),
        ];
        let count = u32::try_from(table.at.as_ref().len()).ok()?;
        items.push(Item::Table(at, count, table.negative.is_some()));
        for column in columns.into_iter().flatten() {
            points.extend_from_slice(column.as_ref());
        }
    }
    Some(())
}

fn frame(pose: &Htm) -> Frame {
    let numbers = pose.r.iter().chain(pose.t.iter());
    let mut frame = Frame::default();
    for (to, from) in frame.iter_mut().zip(numbers) {
        *to = *from;
    }
    frame
}
