use super::*;
use proptest::prelude::*;
use std::f64::consts::PI;
use trueaxis_export::positions::random;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::source::Named;
use trueaxis_tables::compile::{Options, build};

/// LinuxCNC's loader and `compute_screw_comp`, from their description: values are single precision, lines before the
/// first and after the last have a slope of 0.
fn by_linuxcnc(text: &str, kind: u8, position: f64, forward: bool) -> f64 {
    let lines: Vec<Vec<f64>> = text
        .lines()
        .map(|line| {
            line.split(' ')
                .map(|word| word.parse().unwrap())
                .collect::<Vec<f64>>()
        })
        .collect();
    let trim = |line: &Vec<f64>| {
        let value = if forward { line[1] } else { line[2] };
        (if kind == 0 { line[0] - value } else { value }) as f32
    };
    let k = lines.iter().rposition(|line| line[0] <= position);
    let Some(k) = k else {
        return trim(&lines[0]).into();
    };
    let slope = match lines.get(k + 1) {
        Some(next) => {
            ((f64::from(trim(next)) - f64::from(trim(&lines[k]))) / (next[0] - lines[k][0])) as f32
        }
        None => 0.0,
    };
    f64::from(trim(&lines[k])) + f64::from(slope) * (position - lines[k][0])
}

fn configuration(unit: &str) -> Configuration {
    let open = |name: &str| {
        let text = match name {
            "m.ini" => format!(
                "[EMC]\nVERSION = 1.1\n[KINS]\nKINEMATICS = trivkins coordinates=XYYZ\nJOINTS = 4\n[TRAJ]\nLINEAR_UNITS = {unit}\n[HAL]\nHALFILE = m.hal\n"
            ),
            _ => String::new(),
        };
        let name = name.to_owned();
        Ok(Named { name, text })
    };
    Configuration::read(open("m.ini").unwrap(), &open, None).unwrap()
}

/// Errors of each axis along itself, with and without reversal, are all that such files need to express.
#[test]
fn linuxcnc_corrects_with_them_what_an_axis_does_along_itself() {
    let machine =
        Machine::from_toml(include_str!("../../../../examples/router/machine.toml")).unwrap();
    let errors = "machine = \"Router\"\n[parameters]\nEXX1 = 120e-6\nEXX2 = -1e-7\nEXXb = 0.018\nEYY1 = -85e-6\nEYYb = -0.012\n";
    let errors = ErrorModel::from_toml(errors, &machine).unwrap();
    let options = Options {
        random: 100,
        ..Options::default()
    };
    let built = build(&machine, &errors, &options, &()).unwrap();
    let runtime = Runtime::load(&built.blob).unwrap();
    let axes = runtime.compensation().axes();
    for (unit, mm) in [("mm", 1.0), ("inch", 25.4)] {
        for (kind, code) in [(Type::Positions, 0), (Type::Corrections, 1)] {
            let configuration = configuration(unit);
            let (files, found) = export(&runtime, &configuration, kind, None, 300, 1).unwrap();
            // Both joints of the gantry; Z has no error.
            let joints: Vec<usize> = files.iter().map(|file| file.joint.number).collect();
            assert_eq!(joints, [1, 2, 0]);
            assert_eq!(files[0].text, files[1].text);
            for axis in &found {
                // Two tables, each within 0.05 µm, and the straight lines between 256 points or fewer, another 0.05.
                assert!(axis.difference < 0.15, "{found:?}");
            }
            let mut worst = [0.0_f64; 2];
            for command in random(axes, 2000, 7) {
                for (axis, worst) in worst.iter_mut().enumerate() {
                    let forward = command.travel[axis] != Travel::Negative;
                    let mut command = command;
                    command.travel[axis] = match forward {
                        true => Travel::Positive,
                        false => Travel::Negative,
                    };
                    let letter = char::from(axes[axis].name);
                    let file = files.iter().find(|file| file.joint.letter == letter);
                    let text = &file.unwrap().text;
                    let position = f64::from(command.axes[axis]) / mm;
                    let added = by_linuxcnc(text, code, position, forward) * mm;
                    let wanted = f64::from(runtime.evaluate(&command)[axis]);
                    *worst = worst.max((added - wanted).abs() * 1e3);
                }
            }
            for (worst, found) in worst.iter().zip(&found) {
                // Single precision of 0.1 mm, and other random positions.
                assert!(
                    *worst < found.difference + 0.05,
                    "{worst} {found:?} {unit} {code}"
                );
            }
        }
    }
}

#[test]
fn rows_are_read_as_they_were_written() {
    let rows: Vec<CompFileRow> = (0..40)
        .map(|k| {
            let k = f64::from(k);
            [k * PI, 0.1 * libm::sin(k), -0.1 * libm::cos(k)]
        })
        .collect();
    for kind in [Type::Positions, Type::Corrections] {
        let again = read(&print(&rows, kind), kind).unwrap();
        for (one, other) in rows.iter().zip(&again) {
            for k in 0..3 {
                // Half of the last decimal, and rounding.
                assert!((one[k] - other[k]).abs() < 0.501e-6, "{one:?} {other:?}");
            }
        }
    }
    let long: String = (0..300).map(|k| format!("{k} 0 0\n")).collect();
    assert!(
        read(&long, Type::Corrections)
            .unwrap_err()
            .message
            .contains("256")
    );
}

#[test]
fn an_axis_without_a_joint_is_refused() {
    let machine =
        Machine::from_toml(include_str!("../../../../examples/mill-21/machine.toml")).unwrap();
    let errors = ErrorModel::perfect(&machine);
    let options = Options {
        random: 100,
        ..Options::default()
    };
    let built = build(&machine, &errors, &options, &()).unwrap();
    let runtime = Runtime::load(&built.blob).unwrap();
    let mut configuration = configuration("mm");
    configuration.module.letters = "XY".to_owned();
    let error = export(&runtime, &configuration, Type::Positions, None, 100, 1).unwrap_err();
    assert_eq!(error, ExportError::NoJoint('Z'));
}

proptest! {
    /// A changed file is read or refused at a place that it has.
    #[test]
    fn a_changed_file_is_read_or_refused_at_its_place(
        at in any::<prop::sample::Index>(), cut in 0..9_usize, with in "[ -~\\n\u{e4}]{0,4}",
    ) {
        let text = "-5 -5.001 -5.002\n0 0 0\n5 5.003 5\n";
        let start = at.index(text.len());
        let text = format!("{}{with}{}", &text[..start], &text[(start + cut).min(text.len())..]);
        if let Err(bad) = read(&text, Type::Positions) {
            prop_assert!(bad.span.and_then(|span| text.get(span)).is_some());
        }
    }
}
