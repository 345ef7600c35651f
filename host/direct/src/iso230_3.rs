//! ISO 230-3: thermal effects, from readings of displacement sensors at the spindle over time.
//!
//! Clause 5 is the environmental temperature variation error, clause 6 the distortion by the rotating spindle, clause 7
//! that by moving linear axes. All are judged by ranges: the largest minus the smallest reading in a period. Drift
//! counts from the first reading. Inclinations follow from two sensors in the same direction: turning by a small angle
//! EA about X and EB about Y moves a point at +z by EB·z in X and by −EA·z in Y.

use serde::Serialize;
use std::fmt;
use trueaxis_model::numbers::extremes;

/// Which test was made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Test {
    /// Environmental temperature variation error: nothing moves (ISO 230-3, clause 5).
    Environment,
    /// Thermal distortion caused by the rotating spindle (clause 6).
    Spindle,
    /// Thermal distortion caused by a moving linear axis, `X`, `Y` or `Z` (clause 7).
    Axis(char),
}

/// The sensors, in the order of their columns. Each reads how far the mandrel in the spindle has moved relative to the
/// workpiece side in the direction of +X, +Y or +Z.
pub const SENSORS: [&str; 5] = ["X1", "Y1", "X2", "Y2", "Z"];

/// The readings of a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Displacements {
    /// The test.
    pub test: Test,
    /// How far the sensors 2 are from the sensors 1 in +Z (mm); negative if they are in −Z.
    pub apart: Option<f64>,
    /// When the spindle or axis stopped and cooling began (s).
    pub stop: Option<f64>,
    /// The sensors in use.
    pub sensors: [bool; 5],
    /// Names of the temperatures.
    pub temperatures: Vec<String>,
    /// The readings, in order of time.
    pub readings: Vec<DriftReading>,
}

/// Readings at one time.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftReading {
    /// Time (s).
    pub time: f64,
    /// Where the moving axis stood (mm).
    pub position: Option<f64>,
    /// Of each sensor (mm); 0 for those not in use.
    pub displacements: [f64; 5],
    /// Temperatures (°C).
    pub celsius: Vec<f64>,
}

impl Displacements {
    /// Times of the first and the last reading (s).
    #[must_use]
    pub fn span(&self) -> [f64; 2] {
        [self.readings.first(), self.readings.last()].map(|r| r.map_or(0.0, |r| r.time))
    }
}

/// What changes over time, with its values in `unit`: displacements and inclinations since the first reading.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftKind {
    /// `X1`, `tilt about X`, or the place of a temperature.
    pub name: String,
    /// Unit.
    pub unit: Unit,
    /// Range over the whole test.
    pub range: f64,
    /// Range until the motion stopped.
    pub range_until_stop: Option<f64>,
    /// Range after the motion stopped.
    pub range_after_stop: Option<f64>,
    /// Values at the times asked for; `None` where nothing was read before or after.
    pub at: Vec<Option<f64>>,
    /// Times (s) and values.
    #[serde(skip)]
    pub course: Vec<[f64; 2]>,
}

/// The unit in which people read a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Of mm.
    #[serde(rename = "µm")]
    Length,
    /// Of rad.
    #[serde(rename = "µrad")]
    Angle,
    /// Of °C.
    #[serde(rename = "°C")]
    Temperature,
    /// Of mm of change for each mm between two positions.
    #[serde(rename = "µm/m")]
    Expansion,
}

/// The drifts at one position of the moving axis, or of the whole test.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftAnalysis {
    /// Position of the moving axis.
    pub position_mm: Option<f64>,
    /// Displacements, tilts and temperatures.
    pub drifts: Vec<DriftKind>,
}

/// Positions (mm) that are no farther apart are one: an axis comes back to a few micrometres.
const SAME: f64 = 0.1;

/// Evaluates a test; `at` are times (s, as in the file). In a test of a moving axis, one result for each position, and
/// then, if there are several, one without a position: how the distance between the outermost of them has changed.
#[must_use]
pub fn analysis(measured: &Displacements, at: &[f64]) -> Vec<DriftAnalysis> {
    let mut readings: Vec<&DriftReading> = measured.readings.iter().collect();
    readings.sort_by(|a, b| {
        a.position
            .unwrap_or(0.0)
            .total_cmp(&b.position.unwrap_or(0.0))
    });
    let is_same = |a: &&DriftReading, b: &&DriftReading| {
        b.position.unwrap_or(0.0) - a.position.unwrap_or(0.0) <= SAME
    };
    let mut found: Vec<DriftAnalysis> = (readings.chunk_by(is_same))
        .map(|readings| {
            let mut readings = readings.to_vec();
            readings.sort_by(|a, b| a.time.total_cmp(&b.time));
            let positions = readings.iter().filter_map(|r| r.position);
            let mean = positions.sum::<f64>() / readings.len() as f64;
            let position = readings[0].position.map(|_| (mean * 1e3).round() / 1e3);
            DriftAnalysis {
                position_mm: position,
                drifts: drifts(measured, &readings, at),
            }
        })
        .collect();
    let expansion = expansion(measured, &found, at);
    found.extend(expansion.map(|drift| DriftAnalysis {
        position_mm: None,
        drifts: vec![drift],
    }));
    found
        .iter_mut()
        .flat_map(|one| &mut one.drifts)
        .for_each(DriftKind::scale);
    found
}

fn drifts(measured: &Displacements, readings: &[&DriftReading], at: &[f64]) -> Vec<DriftKind> {
    let drift = |name: String, unit, of: &dyn Fn(&DriftReading) -> f64| {
        let course = readings.iter().map(|r| [r.time, of(r)]).collect();
        DriftKind::new(name, unit, course, measured.stop, at)
    };
    let first = readings[0].displacements;
    let since = |k: usize| move |r: &DriftReading| r.displacements[k] - first[k];
    let used = |k: &usize| measured.sensors[*k];
    let sensors = (0..SENSORS.len()).filter(used);
    let sensors = sensors.map(|k| drift(SENSORS[k].to_owned(), Unit::Length, &since(k)));
    let tilt = |about: &str, [near, far]: [usize; 2], sign: f64| {
        let apart = measured.apart.filter(|_| used(&near) && used(&far))?;
        let angle = move |r: &DriftReading| sign * (since(far)(r) - since(near)(r)) / apart;
        Some(drift(format!("tilt about {about}"), Unit::Angle, &angle))
    };
    let tilts = [tilt("X", [1, 3], -1.0), tilt("Y", [0, 2], 1.0)];
    let temperatures = measured.temperatures.iter().enumerate();
    let temperatures =
        temperatures.map(|(k, place)| drift(place.clone(), Unit::Temperature, &|r| r.celsius[k]));
    sensors
        .chain(tilts.into_iter().flatten())
        .chain(temperatures)
        .collect()
}

/// Change of the distance between the outermost positions, for each mm of it: positive if the machine moves farther than
/// commanded.
fn expansion(measured: &Displacements, found: &[DriftAnalysis], at: &[f64]) -> Option<DriftKind> {
    let Test::Axis(axis) = measured.test else {
        return None;
    };
    let of = |analysis: &DriftAnalysis| {
        let mut drifts = analysis.drifts.iter().filter(|d| d.unit == Unit::Length);
        let drift = drifts.find(|drift| drift.name.starts_with(axis))?;
        Some((analysis.position_mm?, drift.course.clone()))
    };
    let (low, start) = of(found.first()?)?;
    let (high, end) = of(found.last()?)?;
    if low == high {
        return None;
    }
    let change = |[time, end]: [f64; 2]| Some([time, (end - value(&start, time)?) / (high - low)]);
    let course: Vec<[f64; 2]> = end.into_iter().filter_map(change).collect();
    let name = format!("{axis} from {low} to {high} mm");
    (course.len() > 1).then(|| DriftKind::new(name, Unit::Expansion, course, measured.stop, at))
}

impl DriftKind {
    /// From a course in mm, rad or °C.
    fn new(name: String, unit: Unit, course: Vec<[f64; 2]>, stop: Option<f64>, at: &[f64]) -> Self {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        Self {
            name,
            unit,
            range: range(&course, all),
            range_until_stop: stop.map(|stop| range(&course, [all[0], stop])),
            range_after_stop: stop.map(|stop| range(&course, [stop, all[1]])),
            at: at.iter().map(|time| value(&course, *time)).collect(),
            course,
        }
    }

    /// Into its unit.
    fn scale(&mut self) {
        let stopped = [&mut self.range_until_stop, &mut self.range_after_stop];
        let values = stopped.into_iter().chain(&mut self.at).flatten();
        let course = self.course.iter_mut().map(|[_, value]| value);
        for value in values.chain(course).chain([&mut self.range]) {
            *value *= self.unit.factor();
        }
    }
}

/// Largest minus smallest value in a period, with those at its ends.
fn range(course: &[[f64; 2]], [from, to]: [f64; 2]) -> f64 {
    let inside = course.iter().filter(|[time, _]| (from..=to).contains(time));
    let ends = [from, to]
        .into_iter()
        .filter_map(|time| value(course, time));
    let values = inside.map(|[_, value]| *value).chain(ends);
    let [low, high] = extremes(values);
    (high - low).max(0.0)
}

/// The value at a time, on a straight line between two readings.
fn value(course: &[[f64; 2]], time: f64) -> Option<f64> {
    let after = course.partition_point(|[t, _]| *t < time);
    let [t1, v1] = *course.get(after)?;
    if t1 == time {
        return Some(v1);
    }
    let [t0, v0] = course[after.checked_sub(1)?];
    Some(v0 + (v1 - v0) * (time - t0) / (t1 - t0))
}

impl Unit {
    /// From mm, rad or °C.
    #[must_use]
    pub fn factor(self) -> f64 {
        match self {
            Self::Length => 1e3,
            Self::Angle | Self::Expansion => 1e6,
            Self::Temperature => 1.0,
        }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Environment => {
                "environmental temperature variation error, ETVE (ISO 230-3, clause 5)"
            }
            Self::Spindle => "thermal distortion by the rotating spindle (ISO 230-3, clause 6)",
            Self::Axis(axis) => {
                return write!(
                    f,
                    "thermal distortion by moving {axis} (ISO 230-3, clause 7)"
                );
            }
        })
    }
}

/// A test as it is written for programs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftTestRecord {
    /// Name and clause.
    pub test: String,
    /// From the first to the last reading.
    pub minutes: f64,
    /// When what warms the machine stopped, if it did.
    pub stopped_after_minutes: Option<f64>,
    /// Distance of the second pair of sensors from the first.
    pub sensors_apart_mm: Option<f64>,
    /// Times of the values in `at`, from the first reading.
    pub at_minutes: Vec<f64>,
    /// For each position of the axis, or one.
    pub results: Vec<DriftAnalysis>,
}

impl DriftTestRecord {
    /// Evaluates a test, with the values at some times (minutes).
    #[must_use]
    pub fn of(measured: &Displacements, at_minutes: &[f64]) -> Self {
        let [first, last] = measured.span();
        let at: Vec<f64> = at_minutes.iter().map(|m| first + m * 60.0).collect();
        Self {
            test: measured.test.to_string(),
            minutes: (last - first) / 60.0,
            stopped_after_minutes: measured.stop.map(|stop| (stop - first) / 60.0),
            sensors_apart_mm: measured.apart,
            at_minutes: at_minutes.to_vec(),
            results: analysis(measured, &at),
        }
    }
}

#[cfg(test)]
mod tests;
