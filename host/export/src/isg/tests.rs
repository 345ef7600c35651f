use super::*;
use crate::refusals::are_refused;
use crate::rigid_body::MACHINES;
use nalgebra::{Matrix3, Matrix4, Rotation3, Unit, Vector3, Vector4};
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Axis, Branch, PerAxis};
use trueaxis_model::validate::commands_in_travel;

/// What the control does, from its description, on the text: homogeneous matrices in the coordinates of the machine, the
/// tip moved back along the linear axes. `chain` has the letters from the workpiece to the tool, `workpiece` of them on
/// the side of the workpiece.
struct Control {
    rows: Vec<(Vec<String>, Vec<Vec<f64>>)>,
    chain: Vec<char>,
    workpiece: usize,
}

impl Control {
    fn new(text: &str, machine: &Machine) -> Self {
        let tables = text.split('#').map(|table| {
            let lines = table
                .lines()
                .map(|line| line.split("//").next().unwrap().trim());
            let mut lines = lines.filter(|line| !line.is_empty());
            let names = lines
                .next()
                .unwrap()
                .split('\t')
                .map(str::to_owned)
                .collect();
            let rows = lines.map(|line| line.split('\t').map(|v| v.parse().unwrap()).collect());
            (names, rows.collect())
        });
        let (workpiece, tool): (Vec<&Axis>, Vec<&Axis>) = machine
            .axes
            .iter()
            .partition(|axis| axis.branch == Branch::Workpiece);
        let count = workpiece.len();
        let chain: Vec<&Axis> = workpiece.into_iter().rev().chain(tool).collect();
        Self {
            rows: tables.collect(),
            chain: chain.iter().map(|axis| axis.letter.char()).collect(),
            workpiece: count,
        }
    }

    fn constant(&self, name: &str) -> Option<f64> {
        let (names, rows) = &self.rows[0];
        names.iter().position(|n| n == name).map(|k| rows[0][k])
    }

    fn vector(&self, start: &str, end: &str) -> Option<Vector3<f64>> {
        let of = |letter: &str| self.constant(&format!("{start}{letter}{end}"));
        Some(Vector3::new(of("X")?, of("Y")?, of("Z")?))
    }

    fn direction(&self, k: usize) -> Vector3<f64> {
        let letter = self.chain[k];
        let along = "XYZABC".find(letter).unwrap() % 3;
        let given = self.vector("V", &letter.to_string());
        given.unwrap_or(Vector3::ith(along, 1.0))
    }

    fn error(&self, letter: char, at: f64) -> [f64; 6] {
        let (names, rows) = (self.rows.iter())
            .find(|(names, _)| names[0] == letter.to_string())
            .unwrap();
        assert_eq!(names[1], format!("EX{letter}"));
        assert_eq!(names[6], format!("EC{letter}"));
        let k = rows
            .iter()
            .rposition(|row| row[0] <= at)
            .unwrap_or(0)
            .min(rows.len() - 2);
        let t = ((at - rows[k][0]) / (rows[k + 1][0] - rows[k][0])).clamp(0.0, 1.0);
        std::array::from_fn(|i| rows[k][i + 1] + t * (rows[k + 1][i + 1] - rows[k][i + 1]))
    }

    /// Motion of an axis by its command, with its error.
    fn moved(&self, k: usize, q: f64, with_error: bool) -> Matrix4<f64> {
        let letter = self.chain[k];
        let translation = |v: Vector3<f64>| Matrix4::new_translation(&v);
        let direction = self.direction(k);
        let (motion, point) = match "ABC".contains(letter) {
            false => (translation(direction * q), Vector3::zeros()),
            true => {
                let turn =
                    Rotation3::from_axis_angle(&Unit::new_normalize(direction), q.to_radians());
                let point = self.vector("P", &letter.to_string()).unwrap();
                (
                    translation(point) * turn.to_homogeneous() * translation(-point),
                    point,
                )
            }
        };
        let [x, y, z, a, b, c] = self.error(letter, q);
        // Small angles.
        let turned = Matrix3::new(1.0, -c, b, c, 1.0, -a, -b, a, 1.0).to_homogeneous();
        let error =
            translation(point) * translation(Vector3::new(x, y, z)) * turned * translation(-point);
        if with_error { motion * error } else { motion }
    }

    fn correction(&self, machine: &Machine, q: &PerAxis) -> PerAxis {
        let command = |k: usize| q[machine.index(self.chain[k]).unwrap()];
        let side = |range: &mut dyn Iterator<Item = usize>, with_error| {
            range.fold(Matrix4::identity(), |m, k| {
                m * self.moved(k, command(k), with_error)
            })
        };
        let tip = self.vector("P0", "").unwrap();
        let pose = |with_error| {
            let workpiece = side(&mut (0..self.workpiece).rev(), with_error);
            let tool = side(&mut (self.workpiece..self.chain.len()), with_error);
            let tip = tool * Vector4::new(tip.x, tip.y, tip.z, 1.0);
            (workpiece.try_inverse().unwrap() * tip).xyz()
        };
        let error = pose(true) - pose(false);
        // How far the tip moves per mm of a linear axis: by a difference.
        let linear: Vec<usize> = (0..self.chain.len())
            .filter(|k| "XYZ".contains(self.chain[*k]))
            .collect();
        let shifted = |shift: usize| {
            let command = |k: usize| command(k) + f64::from(u8::from(k == shift));
            let side = |range: &mut dyn Iterator<Item = usize>| {
                range.fold(Matrix4::identity(), |m, k| {
                    m * self.moved(k, command(k), false)
                })
            };
            let workpiece: Matrix4<f64> = side(&mut (0..self.workpiece).rev());
            let tool: Matrix4<f64> = side(&mut (self.workpiece..self.chain.len()));
            (workpiece.try_inverse().unwrap() * tool * Vector4::new(tip.x, tip.y, tip.z, 1.0)).xyz()
        };
        let columns: Vec<Vector3<f64>> = linear.iter().map(|k| shifted(*k) - pose(false)).collect();
        let solved = Matrix3::from_columns(&columns).try_inverse().unwrap() * error;
        let mut correction = PerAxis::default();
        for (k, value) in linear.into_iter().zip(solved.iter()) {
            correction[machine.index(self.chain[k]).unwrap()] = -value;
        }
        correction
    }
}

/// The machines, and one whose frames have origins and are turned: Y and X each move along the other's letter, and Z in a
/// frame upside down.
fn machines() -> Vec<(Machine, ErrorModel)> {
    let mut turned = include_str!("../../../../examples/mill-21/machine.toml").to_owned();
    for (range, frame) in [
        (
            "[0.0, 300.0]",
            "origin_mm = [50.0, 0.0, -200.0]\norientation_deg = [0.0, 0.0, 90.0]",
        ),
        (
            "[0.0, 500.0]",
            "origin_mm = [0.0, 40.0, -100.0]\norientation_deg = [0.0, 0.0, 90.0]",
        ),
        (
            "[-400.0, 0.0]",
            "origin_mm = [300.0, 100.0, 500.0]\norientation_deg = [180.0, 0.0, 0.0]\nreversed = true",
        ),
    ] {
        turned = turned.replace(range, &format!("{range}\n{frame}"));
    }
    let errors = include_str!("../../../../examples/mill-21/errors-21.toml");
    let all = MACHINES.into_iter().chain([(&turned[..], errors)]);
    let read = all.map(|(machine, errors)| {
        let machine = Machine::from_toml(machine).unwrap();
        let errors = ErrorModel::from_toml(errors, &machine).unwrap();
        (machine, errors)
    });
    read.collect()
}

#[test]
fn the_control_moves_the_tip_back() {
    for (machine, errors) in machines() {
        let (csv, left) = export(&machine, &errors, 61, 400, 1).unwrap();
        let RemainingErrors {
            tip_before_um,
            tip_um,
            direction_before_urad,
            direction_urad,
        } = left;
        // Backlash of the router (18 µm) and of the Kolibri; straight lines between points.
        assert!(
            tip_before_um > 50.0 && tip_um < 25.0,
            "{}: {:?}",
            machine.name,
            left
        );
        // The orientation stays as it is: the corrections turn nothing (squares of 0.1 mrad).
        assert!(
            (direction_before_urad - direction_urad).abs() < 0.5,
            "{:?}",
            left
        );
        let control = Control::new(&csv, &machine);
        let kinematics = Kinematics::new(&machine, &errors);
        let chain = Chain::new(&machine);
        let read = IsgParameters::read_csv(&csv)
            .unwrap()
            .motions(&machine)
            .unwrap();
        for command in commands_in_travel(&machine, &errors, 100, 5) {
            let (command, situation) = (command.axes.map(f64::from), Situation::default());
            let by_control = control.correction(&machine, &command);
            for (own, other) in chain.correction(&read, &command).iter().zip(by_control) {
                // Small angles instead of rotations: squares of 1.1 mrad over 0.3 m.
                assert!(
                    (own - other).abs() < 5e-4,
                    "{}: {own} {other}",
                    machine.name
                );
            }
            let kinematic = |p: PerAxis| machine.to_kinematic(&p[..machine.axes.len()]);
            let corrected = kinematic(std::array::from_fn(|i| command[i] + by_control[i]));
            let actual = kinematics.actual(&corrected, &situation, &Switches::ALL).t;
            let nominal = kinematics.nominal(&kinematic(command), None).t;
            // Second order: the control takes the error at the command, 0.3 mm and a mrad off; straight lines between 61
            // points, of a harmonic of 10 µm over 6°: 0.02 µm.
            let off = (actual - nominal).norm() * 1e3;
            assert!(off < 0.8, "{}: {off} µm", machine.name);
        }
    }
}

#[test]
fn axes_that_the_control_does_not_have_are_refused() {
    let text = MACHINES[0]
        .0
        .replace("name = \"Z\"", "name = \"W\"")
        .replace("wFYXZSt", "wFYXWSt");
    let machine = Machine::from_toml(&text).unwrap();
    let errors = ErrorModel::perfect(&machine);
    let refused = export(&machine, &errors, 5, 10, 1).unwrap_err().cause;
    assert!(refused.ends_with("the machine has YXW"), "{refused}");
}

/// In the form of the exchange format: two locations and two motions.
const ETALON: &str = "// a machine\n[C0Y]\nVALUE = 0.0001\n[A0X] // about itself\nVALUE = 0.5\n[P0Z]\nVALUE = 12\n\
[EXY]\nGridpoints = {\n  0.0 0.001\n  1000.0 0.002 // last\n}  // end of EXY\n[EAX]\nGridpoints = {\n  10 1e-5\n  20 -2e-5\n}\n";

#[test]
fn the_exchange_format_becomes_errors_of_the_machine() {
    assert!(is_etalon(ETALON));
    let machine = Machine::from_toml(MACHINES[0].0).unwrap();
    let parameters = IsgParameters::read_etalon(ETALON).unwrap();
    let (text, notes) = imported(&parameters, &machine).unwrap();
    let errors = ErrorModel::from_toml(&text, &machine).unwrap();
    let [x, y] = ['X', 'Y'].map(|letter| machine.index(letter).unwrap());
    let motion = |index: usize, component: usize, q: f64| {
        errors
            .intra_at(&machine, index, q, &Situation::default(), &Switches::ALL)
            .unwrap()[component]
    };
    // Y turned about z by +0.1 mrad goes towards −x: at 500 mm by 0.05 mm.
    assert!(
        (motion(y, 0, 500.0) - (0.0015 - 0.05)).abs() < 1e-12,
        "{text}"
    );
    assert!((motion(x, 3, 15.0) + 0.5e-5).abs() < 1e-12, "{text}");
    assert_eq!(
        notes[0],
        "not imported, because it moves only the datum: A0X"
    );
    assert!(text.contains("only the datum: A0X\n"), "{text}");
    // Nothing is known of X beside its table; Y has the slope of its squareness everywhere.
    let ends = ["Y end at 0 and 1000", "X end at 10 and 20"];
    let ends = ends.map(|ends| format!("tables of {ends}: beyond, their end values are held"));
    assert_eq!(notes[1..], ends);
    assert!(text.contains("[calibrated]\nX = [10.0, 20.0]\n"), "{text}");
    assert!(!text.contains("\nY = "), "{text}");
}

/// An angle of a linear axis turns its direction: the tip goes as with the exact location error, which also turns what the
/// axis carries, by as much at every position.
#[test]
fn an_angle_turns_the_direction_of_an_axis_also_if_it_is_reversed() {
    for sense in ["", "\nreversed = true"] {
        let text = MACHINES[0]
            .0
            .replace("name = \"Y\"", &format!("name = \"Y\"{sense}"));
        let machine = Machine::from_toml(&text).unwrap();
        let parameters = IsgParameters::read_etalon("[C0Y]\nVALUE = 0.0001\n").unwrap();
        let (sloped, _) = imported(&parameters, &machine).unwrap();
        let turned = format!(
            "machine = \"{}\"\n[parameters]\nEC0Y = 1e-4\n",
            machine.name
        );
        let y = machine.index('Y').unwrap();
        let along = |errors: &str| {
            let errors = ErrorModel::from_toml(errors, &machine).unwrap();
            let kinematics = Kinematics::new(&machine, &errors);
            let mut q = PerAxis::default();
            let [at_zero, at_300] = [0.0, 300.0].map(|position| {
                q[y] = position;
                kinematics
                    .actual(&q, &Situation::default(), &Switches::ALL)
                    .t
            });
            at_300 - at_zero
        };
        let off = along(&sloped) - along(&turned);
        // 300 mm · (1e-4)² / 2.
        assert!(off.norm() < 2e-6, "{off:?}\n{sloped}");
        assert!(along(&turned).x.abs() > 0.029);
    }
}

/// A squareness holds over the whole travel, however short a table of the straightness is.
#[test]
fn an_angle_turns_the_direction_of_an_axis_over_its_whole_travel() {
    let machine = Machine::from_toml(MACHINES[1].0).unwrap();
    let y = machine.index('Y').unwrap();
    for (rows, [low, high]) in [("0 0\n10 0.001\n", [0.0, 0.001]), ("50 0.01\n", [0.01; 2])] {
        let csv = format!("C0Y\n1e-4\n#\nY EXY\n{rows}");
        let parameters = IsgParameters::read_csv(&csv).unwrap();
        let (text, _) = imported(&parameters, &machine).unwrap();
        let errors = ErrorModel::from_toml(&text, &machine).unwrap();
        for (q, own) in [(-210.0, low), (-200.0, low), (200.0, high), (210.0, high)] {
            let found = errors.intra_at(&machine, y, q, &Situation::default(), &Switches::ALL);
            let off = found.unwrap()[0] - (own - 1e-4 * q);
            assert!(off.abs() < 1e-12, "{q}: {off}\n{text}");
        }
    }
}

/// What is exported is imported as the same errors: the exact poses agree.
#[test]
fn an_export_is_imported_as_the_same_poses() {
    for (machine, errors) in machines() {
        let (csv, _) = export(&machine, &errors, 241, 10, 1).unwrap();
        assert!(!is_etalon(&csv));
        let (text, notes) = imported(&IsgParameters::read_csv(&csv).unwrap(), &machine).unwrap();
        assert!(notes.is_empty(), "{notes:?}");
        let again = ErrorModel::from_toml(&text, &machine).unwrap();
        let [one, other] = [&errors, &again].map(|errors| Kinematics::new(&machine, errors));
        for command in commands_in_travel(&machine, &errors, 100, 3) {
            let (q, _) = command.kinematic(&machine);
            let pose = |k: &Kinematics<'_>| k.actual(&q, &Situation::default(), &Switches::ALL);
            let [one, other] = [pose(&one), pose(&other)];
            let off = (one.t - other.t).norm() * 1e3;
            let turned = (one.r - other.r).norm() * 1e6;
            // Between points 3° apart, a harmonic of 10 µm bows by 0.004 µm and one of 100 µrad by 0.04 µrad, on two axes.
            let name = &machine.name;
            assert!(
                off < 0.05 && turned < 0.2,
                "{name}: {off} µm, {turned} µrad"
            );
        }
    }
}

/// The same locations of a rotary axis turn the same work, in whichever frame the machine file has the axis.
#[test]
fn locations_are_in_the_coordinates_of_the_machine() {
    let [plain, turned] = [
        "",
        "origin_mm = [0.0, 0.0, -50.0]\norientation_deg = [0.0, 0.0, 90.0]",
    ]
    .map(|frame| {
        let name = format!("name = \"C\"\n{frame}");
        Machine::from_toml(&MACHINES[1].0.replace("name = \"C\"", &name)).unwrap()
    });
    // About the origin, and the same about the other point: 50 mm below, b moves by −50 b.
    let poses = [(plain, "0.010 0.020"), (turned, "0.005 0.025")].map(|(machine, moved)| {
        let csv = format!("X0C Y0C A0C B0C\n{moved} 1e-4 1e-4\n");
        let (text, _) = imported(&IsgParameters::read_csv(&csv).unwrap(), &machine).unwrap();
        let errors = ErrorModel::from_toml(&text, &machine).unwrap();
        let c = machine.index('C').unwrap();
        let frame = machine.axes[c].frame;
        let inter = trueaxis_model::kinematics::Htm::from_xyz_abc(
            errors.inter_at(c, &Situation::default().kelvin),
        );
        frame * inter * frame.inverse()
    });
    let off = (poses[0].t - poses[1].t).norm();
    // 50 mm · (1e-4)².
    assert!(
        off < 1e-6 && (poses[0].r - poses[1].r).norm() < 1e-12,
        "{poses:?}"
    );
}

#[test]
fn what_is_no_such_file_is_refused_with_its_line() {
    let machine = Machine::from_toml(MACHINES[0].0).unwrap();
    let csv = |text: &str| IsgParameters::read_csv(text).and_then(|p| imported(&p, &machine));
    for (text, line, message) in [
        ("X EXX\n0 1 2\n", Some(2), "3 values below 2 names"),
        ("X EXX\n0 1\n0 2\n", Some(3), "positions must increase"),
        ("Z X EXX\n0 0 1\n", Some(1), "a table over Z and X"),
        ("X EXX\n0 y\n", Some(2), "`y` is not a number"),
        ("X EXX\n", Some(1), "without rows"),
        ("Y EXX\n0 1e-3\n", Some(1), "EXX is a table over Y"),
        (
            "A EXA\n0 1e-3\n",
            Some(1),
            "an axis that the machine does not have",
        ),
        ("X TEMP\n0 20\n", Some(1), "TEMP is no error motion"),
        ("A0Q\n1\n", Some(1), "`A0Q` is neither an error of an axis"),
        ("A0X\n", Some(1), "0 rows of parameters"),
        ("PITCH\n1\n", Some(1), "`PITCH` is neither an error"),
        ("PXB\n1\n", Some(1), "`PXB` is neither an error"),
        ("LNQ\n1\n", Some(1), "`LNQ` is neither an error"),
        (
            "P0X P0Z LNX\n0.01 9 1\n",
            Some(1),
            "P0X is 0.01, and by the machine file 0.000000",
        ),
        (
            "X EXX\n1 0\n#\nVYX\n-1\n",
            Some(4),
            "VYX is -1, and by the machine file 0.000000",
        ),
        ("IDZ\n5\n", Some(1), "IDZ is 5, and by the machine file 0"),
    ] {
        let error = csv(text).unwrap_err();
        assert!(error.message.contains(message), "{error:?}");
        assert_eq!(error.line(text), line, "{error:?}");
    }
    let rows = "}  // | // | 13 | 1 numbers instead of
VALUE = 12 | NUMBER = 12 | 7 | neither a value nor grid points
20 -2e-5\\n}\\n | 20 -2e-5\\n | 13 | do not end
1000.0 | 0.0 | 11 | positions must increase";
    are_refused(ETALON, rows, IsgParameters::read_etalon);
}

#[test]
fn what_has_no_parameters_or_is_of_another_machine_is_refused() {
    let machine = Machine::from_toml(MACHINES[0].0).unwrap();
    let refused = |text: &str| {
        let parameters = IsgParameters::read_etalon(text).unwrap();
        imported(&parameters, &machine).unwrap_err().message
    };
    assert_eq!(refused("// nothing\n"), "no parameters");
    let elsewhere = ETALON
        .replace("10 1e-5", "-9000 1e-5")
        .replace("20 -2e-5", "-8000 -2e-5");
    let said = refused(&elsewhere);
    assert!(
        said.starts_with("EAX from -9000 to -8000, and X travels"),
        "{said}"
    );
    // Neither of two is known to be the right one.
    let twice = refused("[C0Y]\nVALUE = 1e-4\n[C0Y]\nVALUE = 5e-4\n");
    assert_eq!(twice, "`C0Y` is given twice");
    let datum = refused("[A0X]\nVALUE = 1e-4\n[P0Z]\nVALUE = 5\n");
    assert!(datum.starts_with("there is no error of an axis"), "{datum}");
}
