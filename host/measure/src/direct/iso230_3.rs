//! ISO 230-3: thermal effects, from readings of displacement sensors at the spindle over time.
//!
//! Clause 5 is the environmental temperature variation error, clause 6 the distortion by the rotating spindle, clause 7
//! that by moving linear axes. All are judged by ranges: the largest minus the smallest reading in a period. Drift
//! counts from the first reading. Inclinations follow from two sensors in the same direction: turning by a small angle
//! EA about X and EB about Y moves a point at +z by EB·z in X and by −EA·z in Y.

use serde::Serialize;
use std::fmt;

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

/// What changes over time.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftKind {
    /// `X1`, `tilt about X`, or the place of a temperature.
    pub name: String,
    /// Unit.
    pub unit: Unit,
    /// Times (s) and values: displacements (mm) and inclinations (rad) since the first reading, temperatures (°C).
    pub course: Vec<[f64; 2]>,
    /// Range over the whole test.
    pub range: f64,
    /// Range until the motion stopped, and after it.
    pub stopped: Option<[f64; 2]>,
    /// Values at the times asked for; `None` where nothing was read before or after.
    pub at: Vec<Option<f64>>,
}

/// The unit of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// mm.
    Length,
    /// rad.
    Angle,
    /// °C.
    Temperature,
    /// mm of change for each mm between two positions.
    Expansion,
}

/// The drifts at one position of the moving axis, or of the whole test.
#[derive(Clone, Debug, PartialEq)]
pub struct DriftAnalysis {
    /// Position of the moving axis (mm).
    pub position: Option<f64>,
    /// What was measured there.
    pub drifts: Vec<DriftKind>,
}

/// Evaluates a test; `at` are times (s, as in the file). In a test of a moving axis, one result for each position, and
/// then, if there are several, one without a position: how the distance between the outermost of them has changed.
#[must_use]
pub fn analysis(measured: &Displacements, at: &[f64]) -> Vec<DriftAnalysis> {
    let mut positions: Vec<Option<f64>> = measured.readings.iter().map(|r| r.position).collect();
    positions.sort_by(|a, b| a.unwrap_or(0.0).total_cmp(&b.unwrap_or(0.0)));
    positions.dedup();
    let mut found: Vec<DriftAnalysis> = (positions.iter())
        .map(|position| {
            let readings = measured.readings.iter().filter(|r| r.position == *position);
            let readings: Vec<&DriftReading> = readings.collect();
            DriftAnalysis {
                position: *position,
                drifts: drifts(measured, &readings, at),
            }
        })
        .collect();
    let expansion = expansion(measured, &found, at);
    found.extend(expansion.map(|drift| DriftAnalysis {
        position: None,
        drifts: vec![drift],
    }));
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
        Some((analysis.position?, drift.course.clone()))
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
    fn new(name: String, unit: Unit, course: Vec<[f64; 2]>, stop: Option<f64>, at: &[f64]) -> Self {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        Self {
            name,
            unit,
            range: range(&course, all),
            stopped: stop.map(|stop| [[all[0], stop], [stop, all[1]]].map(|p| range(&course, p))),
            at: at.iter().map(|time| value(&course, *time)).collect(),
            course,
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
    let (low, high) = values.fold((f64::MAX, f64::MIN), |(l, h), v| (l.min(v), h.max(v)));
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
    /// From the unit of the values to the one in which people read them.
    #[must_use]
    pub fn shown(self) -> (f64, &'static str) {
        match self {
            Self::Length => (1e3, "µm"),
            Self::Angle => (1e6, "µrad"),
            Self::Temperature => (1.0, "°C"),
            Self::Expansion => (1e6, "µm/m"),
        }
    }
}

impl fmt::Display for Test {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Environment => {
                f.write_str("environmental temperature variation error, ETVE (ISO 230-3, clause 5)")
            }
            Self::Spindle => {
                f.write_str("thermal distortion by the rotating spindle (ISO 230-3, clause 6)")
            }
            Self::Axis(axis) => {
                write!(
                    f,
                    "thermal distortion by moving {axis} (ISO 230-3, clause 7)"
                )
            }
        }
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
    pub results: Vec<DriftPositionRecord>,
}

/// Drifts at a position of the axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftPositionRecord {
    /// The position, if it was stated.
    pub position_mm: Option<f64>,
    /// Displacements, tilts and temperatures.
    pub drifts: Vec<DriftCourseRecord>,
}

/// A drift.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriftCourseRecord {
    /// What drifts.
    pub name: String,
    /// Unit of the values.
    pub unit: &'static str,
    /// Largest less smallest value.
    pub range: f64,
    /// Largest less smallest value until the stop.
    pub range_until_stop: Option<f64>,
    /// Largest less smallest value after the stop.
    pub range_after_stop: Option<f64>,
    /// Values at `at_minutes`.
    pub at: Vec<Option<f64>>,
}

impl DriftTestRecord {
    /// Of an [`analysis`] with the values at some times (minutes).
    #[must_use]
    pub fn of(measured: &Displacements, found: &[DriftAnalysis], at_minutes: &[f64]) -> Self {
        let [first, last] = measured.span();
        let drift = |drift: &DriftKind| {
            let (factor, unit) = drift.unit.shown();
            let stopped = drift.stopped.map(|ranges| ranges.map(|v| v * factor));
            DriftCourseRecord {
                name: drift.name.clone(),
                unit,
                range: drift.range * factor,
                range_until_stop: stopped.map(|[until, _]| until),
                range_after_stop: stopped.map(|[_, after]| after),
                at: drift.at.iter().map(|v| v.map(|v| v * factor)).collect(),
            }
        };
        let position = |analysis: &DriftAnalysis| DriftPositionRecord {
            position_mm: analysis.position,
            drifts: analysis.drifts.iter().map(drift).collect(),
        };
        Self {
            test: measured.test.to_string(),
            minutes: (last - first) / 60.0,
            stopped_after_minutes: measured.stop.map(|stop| (stop - first) / 60.0),
            sensors_apart_mm: measured.apart,
            at_minutes: at_minutes.to_vec(),
            results: found.iter().map(position).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::displacements::read;
    use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};
    use std::fmt::Write;

    /// A spindle that moves and turns as a rigid body while it warms: displacement (mm) and rotation (rad) at a time.
    fn body(time: f64) -> Isometry3<f64> {
        let warm = 1.0 - libm::exp(-time / 3600.0_f64);
        let cooled = if time > 7200.0 {
            (time - 7200.0) / 7200.0
        } else {
            0.0
        };
        let part = warm * (1.0 - cooled);
        Isometry3::from_parts(
            Translation3::new(12e-3 * part, -7e-3 * part, 35e-3 * part),
            UnitQuaternion::from_scaled_axis(Vector3::new(30e-6, -45e-6, 0.0) * part),
        )
    }

    /// Readings of five sensors 120 mm apart, every minute over three hours, from the points of the body that they
    /// touch.
    fn readings() -> Displacements {
        let mut text = "# test = \"spindle\"\n# sensors_apart_mm = 120.0\n# stops_at_s = 7200\n\
                        time_s,x1_um,y1_um,x2_um,y2_um,z_um,housing_C\n"
            .to_owned();
        for minute in 0..=180 {
            let time = f64::from(minute) * 60.0;
            let moved = |z: f64| (body(time) * Point3::new(0.0, 0.0, z)).coords - Vector3::z() * z;
            let [one, two] = [moved(-200.0), moved(-80.0)].map(|v| v * 1e3);
            // Sensors start anywhere.
            let _ = writeln!(
                text,
                "{time},{},{},{},{},{},{}",
                one.x + 3.0,
                one.y - 8.0,
                two.x,
                two.y + 1.0,
                one.z,
                20.0 + 5.0 * time / 10800.0
            );
        }
        read(&text).unwrap()
    }

    fn named<'a>(found: &'a [DriftAnalysis], name: &str) -> &'a DriftKind {
        found[0].drifts.iter().find(|d| d.name == name).unwrap()
    }

    #[test]
    fn displacement_and_tilt_of_a_rigid_body_come_back() {
        let found = analysis(&readings(), &[3600.0, 90.0]);
        let names: Vec<&str> = found[0].drifts.iter().map(|d| &*d.name).collect();
        let expected = [
            "X1",
            "Y1",
            "X2",
            "Y2",
            "Z",
            "tilt about X",
            "tilt about Y",
            "housing",
        ];
        assert_eq!(names, expected);
        let part = 1.0 - libm::exp(-1.0_f64);
        // Second order in angles of 45 µrad over 200 mm: below 1e-9 of what is measured; printed readings have all bits.
        for (name, value) in [
            ("tilt about X", 30e-6),
            ("tilt about Y", -45e-6),
            ("Z", 35e-3),
        ] {
            let got = named(&found, name).at[0].unwrap();
            assert!((got / (value * part) - 1.0).abs() < 1e-4, "{name}: {got}");
        }
        let x1 = named(&found, "X1");
        let expected = (12e-3 + 45e-6 * 200.0) * part;
        assert!((x1.at[0].unwrap() / expected - 1.0).abs() < 1e-6, "{x1:?}");
        // Between two readings, on the line.
        let halfway = 0.5 * (x1.course[1][1] + x1.course[2][1]);
        assert!((x1.at[1].unwrap() - halfway).abs() < 1e-15);
    }

    #[test]
    fn ranges_are_those_of_the_whole_and_of_both_periods() {
        let found = analysis(&readings(), &[]);
        let z = named(&found, "Z");
        // It rises until the spindle stops at two hours, then falls to half of what it would be.
        let at = |hours: f64| {
            let warm = 1.0 - libm::exp(-hours);
            35e-3 * warm * (1.0 - (hours - 2.0).max(0.0) / 2.0)
        };
        let [until, after] = z.stopped.unwrap();
        // 200 mm that are turned by 54 µrad are 0.3 nm lower: 1e-5 of 30 µm.
        assert!((z.range / at(2.0) - 1.0).abs() < 3e-5, "{z:?}");
        assert!((until / at(2.0) - 1.0).abs() < 3e-5);
        assert!((after / (at(2.0) - at(3.0)) - 1.0).abs() < 3e-5);
        let housing = named(&found, "housing");
        assert!((housing.range - 5.0).abs() < 1e-9 && housing.course[0][1] == 20.0);
    }

    #[test]
    fn the_side_of_the_second_sensors_is_in_the_sign_of_their_distance() {
        let mut other = readings();
        other.apart = Some(-120.0);
        for reading in &mut other.readings {
            reading.displacements.swap(0, 2);
            reading.displacements.swap(1, 3);
        }
        let [a, b] = [readings(), other].map(|r| analysis(&r, &[]));
        for name in ["tilt about X", "tilt about Y"] {
            let [a, b] = [&a, &b].map(|found| named(found, name).course[100][1]);
            assert!((a - b).abs() < 1e-18, "{a} {b}");
        }
    }

    #[test]
    fn a_moving_axis_that_grows_is_seen_between_its_ends() {
        // A screw that grows by 20 µm/m in two hours, fixed at 0, read at three positions one after the other.
        let mut text = "# test = \"axis\"\n# axis = \"X\"\ntime_s,position_mm,x1_um\n".to_owned();
        for k in 0..=240 {
            let (time, position) = (f64::from(k) * 30.0, [100.0, 300.0, 600.0][k as usize % 3]);
            let _ = writeln!(
                text,
                "{time},{position},{}",
                20.0 * position / 1e3 * time / 7200.0
            );
        }
        let found = analysis(&read(&text).unwrap(), &[3600.0]);
        let positions: Vec<Option<f64>> = found.iter().map(|f| f.position).collect();
        assert_eq!(positions, [Some(100.0), Some(300.0), Some(600.0), None]);
        let growth = &found[3].drifts[0];
        assert_eq!(
            (growth.unit, &*growth.name),
            (Unit::Expansion, "X from 100 to 600 mm")
        );
        // Both ends count from their first readings, 0 and 60 s, and both drift in proportion to time: at 3600 s 10 µm/m,
        // less 20·0.6/0.5·60/7200 µm/m because the far end began later.
        let expected = 10e-6 - 20e-6 * 0.6 / 0.5 * 60.0 / 7200.0;
        assert!(
            (growth.at[0].unwrap() - expected).abs() < 1e-12,
            "{growth:?}"
        );
    }

    #[test]
    fn bad_files_are_refused_with_line_and_remedy() {
        let head = "# test = \"spindle\"\n";
        for (text, line, message) in [
            ("", None, "empty"),
            ("time_s,z_um\n0,0\n1,1\n", None, "does not say `test`"),
            (
                "# test = \"etve\"\ntime_s,z_um\n0,0\n1,1\n",
                Some(1),
                "not a known test",
            ),
            (
                "# test = \"axis\"\ntime_s,z_um\n0,0\n1,1\n",
                Some(1),
                "which axis moved",
            ),
            (
                "# test = \"axis\"\n# axis = \"C\"\ntime_s,position_mm,z_um\n0,0,0\n1,1,1\n",
                Some(2),
                "not a linear axis",
            ),
            (
                "# test = \"axis\"\n# axis = \"Z\"\ntime_s,z_um\n0,0\n1,1\n",
                Some(3),
                "`position_mm` is missing",
            ),
            (
                &format!("{head}time_s,position_mm,z_um\n0,0,0\n1,1,1\n"),
                Some(2),
                "no axis moves",
            ),
            (
                &format!("{head}z_um\n0\n1\n"),
                Some(2),
                "`time_s` is missing",
            ),
            (
                &format!("{head}time_s,air_C\n0,20\n1,20\n"),
                Some(2),
                "no column with readings",
            ),
            (
                &format!("{head}time_s,w_um\n0,20\n1,20\n"),
                Some(2),
                "`w_um` is not a known column",
            ),
            (
                &format!("{head}time_s,z_um\n0,0\n0,1\n"),
                Some(4),
                "must increase",
            ),
            (
                &format!("{head}time_s,z_um\n0,0\n1,\n"),
                Some(4),
                "value is missing",
            ),
            (
                &format!("{head}time_s,z_um\n0,0\n1,1e9\n"),
                Some(4),
                "larger than any value of such a test",
            ),
            (
                &format!("{head}time_s,z_um\n0,0\n"),
                None,
                "at least two readings",
            ),
            (
                &format!("{head}# sensors_apart_mm = 0\ntime_s,z_um\n0,0\n1,1\n"),
                Some(2),
                "cannot be 0 mm apart",
            ),
            (
                &format!("{head}# stops_at_s = 9\ntime_s,z_um\n0,0\n1,1\n"),
                Some(2),
                "nothing was read at 9 s",
            ),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.message.contains(message), "{text}: {}", error.message);
            assert_eq!(error.line(text), line, "{text}: {}", error.message);
            assert!(!error.remedy.is_empty());
        }
    }
}
