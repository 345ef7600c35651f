use super::*;
use crate::errors::{Situation, Switches};
use crate::kinematics::{Kinematics, Linearised};

/// X, Y, Z and a C axis without limits; A, with limits, is mounted on it.
const MACHINE: &str = r#"
name = "mill"
[[axis]]
name = "Y"
branch = "workpiece"
range = [-200.0, 200.0]
[[axis]]
name = "A"
branch = "workpiece"
range = [-90.0, 90.0]
[[axis]]
name = "C"
branch = "workpiece"
range = [0.0, 360.0]
modulo = true
[[axis]]
name = "X"
branch = "tool"
range = [-300.0, 300.0]
[[axis]]
name = "Z"
branch = "tool"
range = [0.0, 400.0]
[spindle]
axis = "z"
[tool]
tip_mm = [0.0, 0.0, -100.0]
"#;

const A: usize = 1;
const C: usize = 2;
const X: usize = 3;

fn machine() -> Machine {
    Machine::from_toml(MACHINE).unwrap()
}

fn read(body: &str) -> Result<ErrorModel, FileError> {
    ErrorModel::from_toml(&format!("machine = \"mill\"\n{body}"), &machine())
}

/// Component 0 of the error of an axis at a position (mm or deg), arriving in direction `sign`.
fn x_error(errors: &ErrorModel, index: usize, position: f64, sign: f64) -> f64 {
    let machine = machine();
    let q = machine.axes[index].to_kinematic(position);
    let situation = Situation {
        sign: [sign; 6],
        ..Situation::default()
    };
    let error = errors.intra_at(&machine, index, q, &situation, &Switches::ALL);
    error.unwrap()[0]
}

fn calibrated(errors: &ErrorModel, index: usize) -> [f64; 2] {
    errors.calibrated[index].map(|c| machine().axes[index].to_command(c))
}

#[test]
fn a_table_on_a_part_of_the_travel_limits_the_calibrated_range() {
    let two = "[tabulated.EXX]\nat = [-100.0, 250.0]\nvalue = [0.0, 0.001]\n[tabulated.EAX]\nat = [-400.0, 200.0]\nvalue = [0.0, 1e-5]\n";
    let errors = read(two).unwrap();
    assert_eq!(calibrated(&errors, X), [-100.0, 200.0]);
    assert_eq!(calibrated(&errors, 0), [-200.0, 200.0]);
}

#[test]
fn a_calibrated_range_that_is_written_is_taken_whatever_the_tables_cover() {
    let table = "[tabulated.EXX]\nat = [-100.0, 250.0]\nvalue = [0.0, 0.001]\n[calibrated]\nX = [-150.0, 280.0]\n";
    assert_eq!(calibrated(&read(table).unwrap(), X), [-150.0, 280.0]);
}

#[test]
fn a_table_over_the_travel_leaves_nothing_uncalibrated() {
    let table = "[tabulated.EXA]\nat = [-90.0, 0.0, 90.0]\nvalue = [0.0, 0.001, 0.0]\n";
    let errors = read(table).unwrap();
    let [low, high] = calibrated(&errors, 1);
    // The degrees of the file are converted to radians in between.
    assert!(low < -90.0 + 1e-9 && high > 90.0 - 1e-9, "{low} {high}");
}

#[test]
fn a_travel_narrower_than_a_millimetre_may_be_calibrated_as_a_whole() {
    let text = MACHINE.replace("[0.0, 400.0]", "[0.0, 0.5]");
    let machine = Machine::from_toml(&text).unwrap();
    let errors = |range: &str| {
        let text = format!("machine = \"mill\"\n[calibrated]\nZ = {range}\n");
        ErrorModel::from_toml(&text, &machine)
    };
    assert!(errors("[-1.0, 0.5]").is_ok());
    assert!(errors("[0.0, 0.4]").is_err());
}

#[test]
fn a_table_has_a_value_for_each_direction_of_travel() {
    let table = "[tabulated.EXX]\nat = [-300.0, 300.0]\npositive = [0.001, 0.003]\nnegative = [-0.001, 0.003]\n";
    let errors = read(table).unwrap();
    assert!(errors.reverses(X) && errors.bends(&machine(), X));
    for (sign, value) in [(1.0, 0.002), (-1.0, 0.001), (0.0, 0.0015)] {
        assert!((x_error(&errors, X, 0.0, sign) - value).abs() < 1e-18);
    }
}

#[test]
fn harmonics_hold_outside_the_calibrated_range_but_never_on_an_endless_axis() {
    let text = "[parameters]\nEXAc1 = 1e-3\nEXCs2 = 2e-3\n[calibrated]\nA = [-30.0, 60.0]\nC = [90.0, 180.0]\n";
    let errors = read(text).unwrap();
    let cosine = |degrees: f64| 1e-3 * libm::cos(degrees.to_radians());
    for (position, at) in [(10.0, 10.0), (90.0, 60.0), (-80.0, -30.0)] {
        assert!((x_error(&errors, A, position, 0.0) - cosine(at)).abs() < 1e-15);
    }
    for position in [10.0_f64, 100.0, 300.0] {
        let expected = 2e-3 * libm::sin((2.0 * position).to_radians());
        assert!((x_error(&errors, C, position, 0.0) - expected).abs() < 1e-15);
    }
}

#[test]
fn what_closes_over_the_turn_is_taken() {
    for body in [
        "[parameters]\nEXC0 = 1e-3\nEXCb = 1e-3\nEXCc1 = 1e-3\nEBCs8 = 1e-5",
        "[tabulated.EXC]\nat = [0.0, 90.0, 360.0]\nvalue = [0.002, 0.001, 0.002]",
        "[tabulated.EXC]\nat = [-10.0, 0.0, 360.0]\npositive = [0.0, 0.1, 0.1]\nnegative = [0.0, 0.2, 0.2]",
    ] {
        assert!(read(body).is_ok(), "{body}: {:?}", read(body));
    }
    // An even polynomial over a symmetric turn.
    let text = MACHINE.replace("[0.0, 360.0]", "[-180.0, 180.0]");
    let machine = Machine::from_toml(&text).unwrap();
    let even = "machine = \"mill\"\n[parameters]\nEXC2 = 1e-3\n";
    assert!(ErrorModel::from_toml(even, &machine).is_ok());
    let odd = "machine = \"mill\"\n[parameters]\nEXC2 = 1e-3\nEXC3 = 1e-4\n";
    let error = ErrorModel::from_toml(odd, &machine).unwrap_err();
    assert!(error.message.starts_with("EXC3 does not close"), "{error}");
}

#[test]
fn a_travel_with_ends_need_not_close() {
    assert!(read("[parameters]\nEXA1 = 1e-3\nEXA3 = 1e-4").is_ok());
}

#[test]
fn the_linearised_model_knows_harmonics() {
    let machine = machine();
    let q = machine.to_kinematic(&[20.0, 40.0, 70.0, -50.0, 100.0]);
    let situation = Situation::default();
    for name in ["EXAc1", "EZAs3", "EBCc2", "ECCs8"] {
        let twist = |value: f64| {
            let errors = read(&format!("[parameters]\n{name} = {value:e}\n")).unwrap();
            let kinematics = Kinematics::new(&machine, &errors);
            kinematics
                .volumetric_error(&q, &[0.0; 6], &situation)
                .to_array()
        };
        let (plus, minus) = (twist(1e-4), twist(-1e-4));
        let perfect = ErrorModel::perfect(&machine);
        let kinematics = Kinematics::new(&machine, &perfect);
        let linearised = Linearised::new(&kinematics, &q, &situation);
        let column = linearised.column(Parameter::parse(name).unwrap());
        for (i, c) in column.unwrap().to_array().into_iter().enumerate() {
            let difference = (plus[i] - minus[i]) / 2e-4;
            // The cubic term of a rotation by 1e-4, on levers of 200 mm.
            assert!((c - difference).abs() < 1e-6, "{name}: {c} {difference}");
        }
    }
}
