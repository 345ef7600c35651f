use super::*;

fn machine() -> Machine {
    Machine::from_toml(include_str!("../../../../../examples/router/machine.toml")).unwrap()
}

fn errors(machine: &Machine, parameters: &str) -> ErrorModel {
    let text = format!("machine = \"Router\"\n{parameters}");
    ErrorModel::from_toml(&text, machine).unwrap()
}

/// `_get_interpolated_z_compensation`, from its description, on the text.
fn by_klipper(text: &str, letter: char, at: f64) -> f64 {
    let values = |key: &str| -> Vec<f64> {
        let mut lines = text.lines().filter_map(|line| line.split_once(" = "));
        let value = lines.find(|(k, _)| *k == key).unwrap().1;
        value
            .split(',')
            .map(|v| v.trim().parse().unwrap())
            .collect()
    };
    let table = values(if letter == 'x' {
        "z_compensations"
    } else {
        "zy_compensations"
    });
    let [start, end] = ["start", "end"].map(|w| values(&format!("compensation_{w}_{letter}"))[0]);
    let t = (at - start) / ((end - start) / (table.len() - 1) as f64);
    let i = (t.floor() as i64).clamp(0, table.len() as i64 - 2) as usize;
    (1.0 - (t - i as f64)) * table[i] + (t - i as f64) * table[i + 1]
}

/// A roll of the bridge with a probe behind the nozzle: the probe goes down by roll times distance (small angles).
#[test]
fn the_probe_reads_with_the_table_what_the_nozzle_would() {
    let machine = machine();
    let errors = errors(
        &machine,
        "[tabulated.EAX]\nat = [0.0, 400.0, 800.0]\nvalue = [-1e-4, 0.0, 3e-4]\n",
    );
    let probe = Probe::new(&machine, &errors, [0.0, 30.0], -100.0).unwrap();
    // Roll lifts what is ahead of the nozzle (+y) by roll × 30 mm.
    let missing = |x: f64| probe.missing([x, 600.0]) - probe.missing([400.0, 600.0]);
    for (x, roll) in [(0.0, -1e-4), (600.0, 1.5e-4), (800.0, 3e-4)] {
        // Second order: squares of 3e-4 rad.
        assert!(
            (missing(x) - roll * 30.0).abs() < 1e-5,
            "{} {roll}",
            missing(x)
        );
    }
    let tables = probe.tables(5).unwrap();
    let text = print(&tables);
    let [before, left] = probe.left(&tables).unwrap();
    assert!(before > 5.9 && left < 0.02, "{before} {left}");
    let again = read(&text).unwrap();
    for at in [-50.0, 0.0, 123.0, 799.0, 900.0] {
        for (k, letter) in ['x', 'y'].into_iter().enumerate() {
            let (own, klipper) = (
                again[k].as_ref().unwrap().at(at),
                by_klipper(&text, letter, at),
            );
            assert!((own - klipper).abs() < 1e-12, "{own} {klipper}");
        }
    }
    // The other way: the roll that explains the table is that of the machine, but for its mean.
    let roll = probe.roll(0, again[0].as_ref().unwrap()).unwrap();
    for (i, expected) in [-1e-4, -0.5e-4, 0.0, 1.5e-4, 3e-4].into_iter().enumerate() {
        // Values are written to 1 nm over 30 mm: 3e-8; second order as above.
        assert!((roll[i] - roll[2] - expected).abs() < 4e-7, "{roll:?}");
    }
}

#[test]
fn a_probe_without_lever_is_refused() {
    let machine = machine();
    let perfect = ErrorModel::perfect(&machine);
    let probe = Probe::new(&machine, &perfect, [40.0, 0.0], 0.0).unwrap();
    let twist = Twist {
        nodes: Nodes::over([0.0, 100.0], 2),
        values: vec![-0.01, 0.01],
    };
    assert_eq!(probe.roll(0, &twist), Err(TwistError::NoLever('X')));
    // The portal carries X: when it rolls, the nozzle that follows goes up as much as the probe was.
    assert_eq!(probe.roll(1, &twist), Err(TwistError::NoLever('Y')));
    let far = Probe::new(&machine, &perfect, [0.0, 2000.0], 0.0);
    assert_eq!(far.err(), Some(TwistError::Travel('Y')));
}

#[test]
fn a_section_is_read_as_it_is_saved() {
    let text = "[axis_twist_compensation]\ncalibrate_start_x: 20\ncalibrate_y: 100\n\
#*# <---- SAVE_CONFIG ---->\n#*#\n#*# [axis_twist_compensation]\n#*# z_compensations = -0.01, 0.0, 0.01\n\
#*# compensation_start_x = 20.0\n#*# compensation_end_x = 200.0\n";
    let [x, y] = read(text).unwrap();
    assert_eq!(
        x.unwrap(),
        Twist {
            nodes: Nodes::over([20.0, 200.0], 3),
            values: vec![-0.01, 0.0, 0.01]
        }
    );
    assert_eq!(y, None);
    for (text, line, message) in [
        (
            "[axis_twist_compensation]\n".to_owned(),
            None,
            "no [axis_twist",
        ),
        (
            text.replace("compensation_end_x", "end_x"),
            Some(7),
            "no `compensation_end_x`",
        ),
        (
            text.replace("-0.01, 0.0, 0.01", "0.01"),
            Some(7),
            "needs two values",
        ),
        (
            text.replace("-0.01,", "much,"),
            Some(7),
            "`much` is not a number",
        ),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.message.contains(message), "{error:?}");
        assert_eq!(error.line(&text), line, "{error:?}");
    }
}
