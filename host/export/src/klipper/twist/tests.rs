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
    let probe = NozzleProbe::new(&machine, &errors, [0.0, 30.0], -100.0).unwrap();
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
    let tables = probe.tables(5, Lookup::Bed).unwrap();
    let text = print(&tables, Lookup::Bed);
    let [before, left] = probe.left(&tables, Lookup::Bed).unwrap();
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
    let probe = NozzleProbe::new(&machine, &perfect, [40.0, 0.0], 0.0).unwrap();
    let twist = TwistTable {
        nodes: Nodes::over([0.0, 100.0], 2),
        values: vec![-0.01, 0.01],
    };
    let refused = |k: usize| probe.roll(k, &twist).unwrap_err().cause;
    assert!(refused(0).starts_with("a roll of X does not move"));
    // The portal carries X: when it rolls, the nozzle that follows goes up as much as the probe was.
    assert!(refused(1).starts_with("a roll of Y does not move"));
    let far = NozzleProbe::new(&machine, &perfect, [0.0, 2000.0], 0.0);
    assert!(
        far.err()
            .is_some_and(|e| e.cause.starts_with("the travel of Y"))
    );
}

#[test]
fn a_section_is_read_as_it_is_saved() {
    let text = "[axis_twist_compensation]\ncalibrate_start_x: 20\ncalibrate_y: 100\n\
#*# <---- SAVE_CONFIG ---->\n#*#\n#*# [axis_twist_compensation]\n#*# z_compensations = -0.01, 0.0, 0.01\n\
#*# compensation_start_x = 20.0\n#*# compensation_end_x = 200.0\n";
    let [x, y] = read(text).unwrap();
    assert_eq!(
        x.unwrap(),
        TwistTable {
            nodes: Nodes::over([20.0, 200.0], 3),
            values: vec![-0.01, 0.0, 0.01]
        }
    );
    assert_eq!(y, None);
    // Of sections with one name, Klipper makes one; what comes later wins.
    let more = format!("{text}[axis_twist_compensation]\nz_compensations = 0.02, 0.03\n");
    let [x, _] = read(&more).unwrap();
    assert_eq!(x.unwrap().values, [0.02, 0.03]);
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
        (
            text.replace("-0.01,", "-10.0,"),
            Some(7),
            "no axis twists that far",
        ),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.message.contains(message), "{error:?}");
        assert_eq!(error.line(&text), line, "{error:?}");
    }
}

/// A carriage whose roll is a parabola, a probe beside and before the nozzle.
const CURVED: &str = "[tabulated.EAX]\nat = [-100.0, 0.0, 100.0, 200.0, 300.0, 400.0, 500.0, 600.0, 700.0, 900.0]\n\
    value = [3e-4, 0.0, 1e-4, 6e-4, 15e-4, 28e-4, 45e-4, 66e-4, 91e-4, 171e-4]\n";

#[test]
fn each_firmware_finds_the_value_where_it_looks_it_up() {
    let machine = machine();
    let errors = errors(&machine, CURVED);
    let probe = NozzleProbe::new(&machine, &errors, [-28.0, -13.0], -100.0).unwrap();
    for lookup in [Lookup::Bed, Lookup::Nozzle] {
        let tables = probe.tables(33, lookup).unwrap();
        let text = print(&tables, lookup);
        let position = [300.0, 600.0];
        let at = match lookup {
            Lookup::Bed => position[0] - 28.0,
            Lookup::Nozzle => position[0],
        };
        let mean = probe.missing([500.0, 600.0])
            - by_klipper(
                &text,
                'x',
                if lookup == Lookup::Bed { 472.0 } else { 500.0 },
            );
        let off = probe.missing(position) - by_klipper(&text, 'x', at) - mean;
        // Between nodes 24 mm apart, of a roll that is linear over 100 mm: at its bends alone.
        assert!(off.abs() < 5e-4, "{lookup:?} {off}");
        let other = match lookup {
            Lookup::Bed => Lookup::Nozzle,
            Lookup::Nozzle => Lookup::Bed,
        };
        let [_, left] = probe.left(&tables, lookup).unwrap();
        let [_, wrong] = probe.left(&tables, other).unwrap();
        assert!(wrong > 5.0 * left, "{left} {wrong}");
    }
}

/// As Klipper calibrates: at places of the bed, by the probe with the tool `offset` away and by the nozzle there.
#[test]
fn what_klipper_has_measured_is_the_roll_where_the_tool_stood() {
    let machine = machine();
    let perfect = ErrorModel::perfect(&machine);
    let offset = [-28.0, -13.0];
    let roll = |x: f64| 2e-4 * (x / 100.0).powi(2) - 1e-4 * (x / 100.0);
    let nodes = Nodes::over([20.0, 200.0], 5);
    let places: Vec<f64> = (0..5).map(|i| nodes.at(i) - offset[0]).collect();
    // The probe is lower by the roll over its distance along Y.
    let readings: Vec<f64> = places.iter().map(|x| -roll(*x) * offset[1]).collect();
    let mean = readings.iter().sum::<f64>() / 5.0;
    let table = TwistTable {
        nodes,
        values: readings.iter().map(|reading| mean - reading).collect(),
    };
    let probe = NozzleProbe::new(&machine, &perfect, offset, 0.0).unwrap();
    assert_eq!(probe.probed_at(0, &table), places);
    let found = probe.roll(0, &table).unwrap();
    let middle = places.iter().map(|x| roll(*x)).sum::<f64>() / 5.0;
    for (found, x) in found.iter().zip(&places) {
        // The derivative is taken over 10 µrad, second order.
        assert!((found - (roll(*x) - middle)).abs() < 1e-8, "{found} {x}");
    }
}

/// A portal without errors; the nozzle is `y` mm beside the guide of X.
fn with_tip(y: &str) -> Machine {
    let text = include_str!("../../../../../examples/router/machine.toml");
    let tip = "tip_mm = [0.0, 0.0, -60.0]";
    assert!(text.contains(tip));
    Machine::from_toml(&text.replace(tip, &format!("tip_mm = [0.0, {y}, -60.0]"))).unwrap()
}

fn table(ends: [f64; 2]) -> TwistTable {
    TwistTable {
        nodes: Nodes::over(ends, 3),
        values: vec![-0.01, 0.0, 0.01],
    }
}

/// A roll a(x) lifts the probe by a(x) (t + y), the nozzle after X has moved by a(x + x_offset) t: with t ≠ 0, two rolls.
#[test]
fn a_nozzle_with_a_lever_of_its_own_is_refused_unless_the_probe_is_straight_before_it() {
    let machine = with_tip("-60.0");
    let perfect = ErrorModel::perfect(&machine);
    let roll = |offset: [f64; 2]| {
        let probe = NozzleProbe::new(&machine, &perfect, offset, 0.0).unwrap();
        probe.roll(0, &table([100.0, 300.0]))
    };
    let cause = roll([30.0, -20.0]).unwrap_err().cause;
    assert!(cause.contains("cannot tell the two rolls apart"), "{cause}");
    // t + y − t = −20: values of ±0.01 mm by the lever; the derivative is taken over 10 µrad, second order.
    let found = roll([0.0, -20.0]).unwrap();
    assert!(
        (found[0] - 5e-4).abs() < 1e-8 && (found[2] + 5e-4).abs() < 1e-8,
        "{found:?}"
    );
}

#[test]
fn a_table_over_positions_that_the_machine_does_not_reach_is_refused() {
    let machine = machine();
    let perfect = ErrorModel::perfect(&machine);
    let probe = NozzleProbe::new(&machine, &perfect, [30.0, -20.0], 0.0).unwrap();
    let errors_of = |ends: [f64; 2]| TwistErrors::of(&probe, &[Some(table(ends)), None]);
    // The probe reaches 30 to 830, the nozzle 0 to 800; the axes then stand 30 mm before.
    assert!(
        errors_of([30.0, 800.0])
            .unwrap()
            .text
            .contains("at = [0.0, 385.0, 770.0]")
    );
    for (ends, stood) in [
        ([10.0, 800.0], "-20.00 to 770.00"),
        ([1000.0, 2000.0], "970.00 to 1970.00"),
        ([30.0, 801.0], "0.00 to 771.00"),
    ] {
        let cause = errors_of(ends).unwrap_err().cause;
        assert!(cause.contains(&format!("X stood at {stood} mm")), "{cause}");
        assert!(cause.contains("from 0 to 770 mm only"), "{cause}");
    }
}

#[test]
fn a_table_that_no_roll_explains_does_not_take_the_other_with_it() {
    let machine = machine();
    let perfect = ErrorModel::perfect(&machine);
    let probe = NozzleProbe::new(&machine, &perfect, [30.0, -20.0], 0.0).unwrap();
    let found = TwistErrors::of(
        &probe,
        &[Some(table([100.0, 300.0])), Some(table([100.0, 300.0]))],
    );
    let found = found.unwrap();
    assert_eq!(found.motions, ["EAX"]);
    assert!(found.left_out[0].starts_with("zy_compensations: a roll of Y does not move"));
    assert!(TwistErrors::of(&probe, &[None, Some(table([100.0, 300.0]))]).is_err());
}

#[test]
fn values_may_stand_on_the_lines_after_the_key() {
    let text = "[axis_twist_compensation]\nz_compensations:\n  -0.01, 0.0,\n  0.01\ncompensation_start_x: 20\n\
                compensation_end_x:\n 200\nzy_compensations:\n";
    let [x, y] = read(text).unwrap();
    assert_eq!(x.unwrap(), table([20.0, 200.0]));
    assert_eq!(y, None);
    assert_eq!(corrects(text).unwrap(), [true, false]);
    assert_eq!(corrects("[axis_twist_compensation]\n").unwrap(), [false; 2]);
}

/// A bed that moves along Y, to either side for a positive command. Its errors are functions of the command.
#[test]
fn the_offset_of_the_probe_counts_along_commands() {
    for reversed in [false, true] {
        let text = format!(
            "name = \"P\"\n[[axis]]\nname = \"Y\"\nbranch = \"workpiece\"\nrange = [0.0, 240.0]\nreversed = {reversed}\n\
             [[axis]]\nname = \"Z\"\nbranch = \"tool\"\nrange = [-10.0, 400.0]\n\
             [[axis]]\nname = \"X\"\nbranch = \"tool\"\nrange = [0.0, 240.0]\n\
             [spindle]\naxis = \"z\"\n[tool]\ntip_mm = [0.0, 0.0, -40.0]\n"
        );
        let machine = Machine::from_toml(&text).unwrap();
        let text = "machine = \"P\"\n[parameters]\nEZY1 = 1e-4\nEZY2 = 1e-6\n";
        let errors = ErrorModel::from_toml(text, &machine).unwrap();
        let probe = NozzleProbe::new(&machine, &errors, [0.0, 25.0], 0.0).unwrap();
        assert_eq!(probe.range(1).unwrap(), [0.0, 215.0]);
        // The nozzle comes 25 mm after the probe. Differences are rounded at positions up to 240 mm.
        let bed = |y: f64| 1e-4 * y + 1e-6 * y * y;
        for y in [0.0, 100.0, 200.0] {
            let (found, expected) = (probe.missing([120.0, y]), bed(y + 25.0) - bed(y));
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
}
