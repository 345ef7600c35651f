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
    let expected = "X1, Y1, X2, Y2, Z, tilt about X, tilt about Y, housing";
    assert_eq!(names.join(", "), expected);
    let part = 1.0 - libm::exp(-1.0_f64);
    // Second order in angles of 45 µrad over 200 mm: below 1e-9 of what is measured; printed readings have all bits.
    for (name, value) in [("tilt about X", 30.0), ("tilt about Y", -45.0), ("Z", 35.0)] {
        let got = named(&found, name).at[0].unwrap();
        assert!((got / (value * part) - 1.0).abs() < 1e-4, "{name}: {got}");
    }
    let x1 = named(&found, "X1");
    let expected = (12.0 + 45e-3 * 200.0) * part;
    assert!((x1.at[0].unwrap() / expected - 1.0).abs() < 1e-6, "{x1:?}");
    // Between two readings, on the line.
    let halfway = 0.5 * (x1.course[1][1] + x1.course[2][1]);
    assert!((x1.at[1].unwrap() - halfway).abs() < 1e-12);
}

#[test]
fn ranges_are_those_of_the_whole_and_of_both_periods() {
    let found = analysis(&readings(), &[]);
    let z = named(&found, "Z");
    // It rises until the spindle stops at two hours, then falls to half of what it would be.
    let at = |hours: f64| {
        let warm = 1.0 - libm::exp(-hours);
        35.0 * warm * (1.0 - (hours - 2.0).max(0.0) / 2.0)
    };
    let [until, after] = [z.range_until_stop, z.range_after_stop].map(Option::unwrap);
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
        assert!((a - b).abs() < 1e-12, "{a} {b}");
    }
}

#[test]
fn a_moving_axis_that_grows_is_seen_between_its_ends() {
    // A screw that grows by 20 µm/m in two hours, fixed at 0, read at three positions one after the other.
    let mut text = "# test = \"axis\"\n# axis = \"X\"\ntime_s,position_mm,x1_um\n".to_owned();
    for k in 0..=240 {
        let (time, position) = (f64::from(k) * 30.0, [100.0, 300.0, 600.0][k as usize % 3]);
        // As an encoder has it.
        let read = position + 2e-3 * libm::sin(f64::from(k));
        let _ = writeln!(
            text,
            "{time},{read},{}",
            20.0 * position / 1e3 * time / 7200.0
        );
    }
    let found = analysis(&read(&text).unwrap(), &[3600.0]);
    let positions: Vec<Option<f64>> = found.iter().map(|f| f.position_mm).collect();
    assert_eq!(positions, [Some(100.0), Some(300.0), Some(600.0), None]);
    let growth = &found[3].drifts[0];
    assert_eq!(
        (growth.unit, &*growth.name),
        (Unit::Expansion, "X from 100 to 600 mm")
    );
    // Both ends count from their first readings, 0 and 60 s, and both drift in proportion to time: at 3600 s 10 µm/m,
    // less 20·0.6/0.5·60/7200 µm/m because the far end began later.
    let expected = 10.0 - 20.0 * 0.6 / 0.5 * 60.0 / 7200.0;
    assert!(
        (growth.at[0].unwrap() - expected).abs() < 1e-6,
        "{growth:?}"
    );
}

#[test]
fn bad_files_are_refused_with_line_and_remedy() {
    // A file, in which `;` ends a line; the line; part of what is said of it.
    for case in r#"
        | 0 | empty
        time_s,z_um;0,0;1,1;                                        | 0 | does not say `test`
        # test = "etve";time_s,z_um;0,0;1,1;                        | 1 | not a known test
        # test = "axis";time_s,z_um;0,0;1,1;                        | 1 | which axis moved
        # test = "axis";# axis = "C";time_s,position_mm,z_um;0,0,0;1,1,1; | 2 | not a linear axis
        # test = "axis";# axis = "Z";time_s,z_um;0,0;1,1;           | 3 | `position_mm` is missing
        # test = "spindle";time_s,position_mm,z_um;0,0,0;1,1,1;     | 2 | no axis moves
        # test = "spindle";z_um;0;1;                                | 2 | `time_s` is missing
        # test = "spindle";time_s,air_C;0,20;1,20;                  | 2 | no column with readings
        # test = "spindle";time_s,w_um;0,20;1,20;                   | 2 | `w_um` is not a known column
        # test = "spindle";time_s,z_um;0,0;0,1;                     | 4 | must increase
        # test = "spindle";time_s,z_um;0,0;1,;                      | 4 | value is missing
        # test = "spindle";time_s,z_um;0,0;1,1e9;                   | 4 | larger than any value of such a test
        # test = "spindle";time_s,z_um;0,0;                         | 0 | at least two readings
        # test = "spindle";# sensors_apart_mm = 0;time_s,z_um;0,0;1,1; | 2 | cannot be 0 mm apart
        # test = "spindle";# stops_at_s = 9;time_s,z_um;0,0;1,1;    | 2 | nothing was read at 9 s"#
        .lines()
        .skip(1)
    {
        let [text, line, message] = [0, 1, 2].map(|k| case.split('|').nth(k).unwrap().trim());
        let text = text.replace(';', "\n");
        let error = read(&text).unwrap_err();
        assert!(error.message.contains(message), "{text}: {}", error.message);
        let found = error.line(&text).unwrap_or(0).to_string();
        assert_eq!(found, line, "{text}: {}", error.message);
        assert!(!error.remedy.is_empty());
    }
}
