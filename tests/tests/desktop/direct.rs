//! Direct measurements: instruments are simulated on machines with known errors, and the imported errors are compared
//! with these.

mod instruments;

use instruments::{everything, simulate};
use nalgebra::{DMatrix, DVector, Vector3};
use trueaxis_direct::formats::runs;
use trueaxis_direct::{
    AxisRuns, DirectResult, MeasuredRuns, Measurement, SolveOptions, error_file, solve,
};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation, Switches, Table};
use trueaxis_model::explain::Bench;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Branch, Machine};
use trueaxis_model::validate::{Command, Runtime};
use trueaxis_tables::compile::{Options as CompileOptions, build};
use trueaxis_tests::random_machines::cases;
use trueaxis_tests::{Fixed, errors, machine};

fn import(machine: &Machine, measured: &[Measurement]) -> DirectResult {
    let perfect = ErrorModel::perfect(machine);
    solve(machine, measured, &perfect, SolveOptions::default()).unwrap()
}

/// Least-squares slope.
fn slope(at: &[f64], values: &[f64]) -> f64 {
    let count = at.len() as f64;
    let mean = at.iter().sum::<f64>() / count;
    let along: f64 = at.iter().zip(values).map(|(q, v)| (q - mean) * v).sum();
    along / at.iter().map(|q| (q - mean).powi(2)).sum::<f64>()
}

/// Motions of every kind on every axis, different for each direction: their mean is zero at the target next to zero,
/// and straightnesses have no slope; plus the squarenesses.
fn drawn(machine: &Machine, found: &DirectResult, random: &mut Fixed) -> ErrorModel {
    let mut errors = ErrorModel::perfect(machine);
    for motion in &found.motions {
        let axis = &machine.axes[motion.axis];
        let size = if motion.component >= 3 { 50e-6 } else { 10e-3 };
        let mut both: Vec<f64> = motion
            .at
            .iter()
            .map(|_| random.within(-size, size))
            .collect();
        let mut half: Vec<f64> = motion
            .at
            .iter()
            .map(|_| random.within(-size, size) * 0.3)
            .collect();
        let last = both.len() - 1;
        if axis.modulo {
            (both[last], half[last]) = (both[0], half[0]);
        }
        let across = motion.component < 3 && motion.component != axis.letter.component();
        if across && !axis.letter.is_rotary() {
            let lean = slope(&motion.at, &both);
            for (value, q) in both.iter_mut().zip(&motion.at) {
                *value -= lean * q;
            }
        }
        let near = |a: &usize, b: &usize| motion.at[*a].abs().total_cmp(&motion.at[*b].abs());
        let zero = both[(0..=last).min_by(near).unwrap()];
        let sides = |sign: f64| -> Vec<f64> {
            let pairs = both.iter().zip(&half);
            pairs.map(|(b, h)| b - zero + sign * h).collect()
        };
        let table = Table {
            at: motion.at.clone(),
            positive: sides(1.0),
            negative: Some(sides(-1.0)),
        };
        assert!(errors.tabulate(motion.axis, motion.component, table));
    }
    for location in &found.locations {
        assert!(errors.set(machine, location.parameter, random.within(-100e-6, 100e-6)));
    }
    errors
}

/// True if no rotary axis carries a linear one: otherwise the directions of linear axes turn, and may coincide.
fn is_usual(machine: &Machine) -> bool {
    [Branch::Workpiece, Branch::Tool].iter().all(|branch| {
        let own = machine.axes.iter().filter(|axis| axis.branch == *branch);
        let rotary: Vec<bool> = own.map(|axis| axis.letter.is_rotary()).collect();
        rotary.is_sorted()
    })
}

/// Simulates every instrument on a machine with random errors, and expects to recover these errors.
fn check(name: &str, machine: &Machine, seed: u64) {
    let mut random = Fixed::new(seed + 7);
    let perfect = ErrorModel::perfect(machine);
    let home = Bench::new(machine, &perfect, Default::default()).home();
    // Linear axes anywhere; rotary ones where the directions of linear axes are orthogonal.
    let mut place = || {
        let mut at = random.position(machine);
        for (i, axis) in machine.axes.iter().enumerate() {
            if axis.letter.is_rotary() {
                at[i] = home[i];
            }
        }
        at
    };
    let plan = everything(machine, 6, &mut place);
    // On a perfect machine this determines which motions and locations are visible.
    let found = import(machine, &simulate(machine, &perfect, &plan, [0.0; 2], 0));
    assert_eq!(found.motions.len(), 6 * machine.axes.len(), "{name}");
    assert_eq!(found.locations.len(), 3, "{name}");
    let truth = drawn(machine, &found, &mut Fixed::new(seed + 99));
    let found = import(machine, &simulate(machine, &truth, &plan, [0.0; 2], 0));
    for motion in &found.motions {
        let table = truth.motions[motion.axis][motion.component]
            .table
            .as_ref()
            .unwrap();
        // Iterations end at 2e-11 mm; the remaining error is a few times that.
        let close = if motion.component >= 3 { 1e-11 } else { 1e-9 };
        let pairs = motion.positive.iter().zip(&table.positive);
        let others = motion.negative.as_ref().unwrap().iter();
        let pairs = pairs.chain(others.zip(table.negative.as_ref().unwrap()));
        for (found, expected) in pairs {
            assert!(
                (found - expected).abs() < close,
                "{name}: {}: {found} is not {expected}",
                motion.name(machine)
            );
        }
    }
    for location in &found.locations {
        let expected = truth.parameters[&location.parameter];
        let found = location.value;
        assert!(
            // A slope is a displacement over the travel, here 100 mm or more.
            (found - expected).abs() < 1e-11,
            "{name}: {}: {found} is not {expected}",
            location.parameter
        );
    }
    // All angular motions are known, so no lever is unknown.
    assert!(found.doubts.is_empty(), "{name}: {:?}", found.doubts);
}

#[test]
fn the_errors_of_every_example_come_back_from_its_instruments() {
    for (seed, name) in [
        "huron-k2x8/machine",
        "kolibri/machine",
        "hu40/machine",
        "fork-head/machine",
        "table-head/machine",
        "router/machine",
        "mill-21/machine",
        "five-axis-30/machine",
        "linuxcnc-xyzac-trt/machine",
        "linuxcnc-xyzac-trt/machine-conventional",
    ]
    .iter()
    .enumerate()
    {
        check(
            name,
            &machine(&format!("examples/{name}.toml")),
            seed as u64,
        );
    }
}

#[test]
fn the_errors_of_random_machines_come_back_from_their_instruments() {
    let mut count = 0;
    for case in cases(150).iter().filter(|case| is_usual(&case.machine)) {
        check(&format!("seed {}", case.seed), &case.machine, case.seed);
        count += 1;
    }
    assert!(count >= 20, "only {count}");
}

/// Readings in files are imported with the sign derived in the manual (measurement.md): a tool that moves too far is +
/// on the router, whose axes carry the tool, and − on the mill, whose table moves and is reversed.
#[test]
fn a_reading_has_the_sign_that_the_manual_says() {
    let laser = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n\
                 target,+1,-1\n0,2,-2\n100,4,0\n";
    let by_workpiece = "# axis = \"X\"\n# reads = \"workpiece +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n\
                 target,+1,-1\n0,-2,2\n100,-4,0\n";
    let angle = "# axis = \"X\"\n# reads = \"tool +Y to +Z\"\n# unit = \"urad\"\n\
                 target,+1,-1\n0,0,0\n100,20,20\n";
    let other_angle = angle.replace("+Y to +Z", "+Z to +Y").replace("20", "-20");
    let dial = "# axis = \"Z\"\n# reads = \"tool -Y\"\n# unit = \"um\"\n# slope = \"keep\"\n# at = { X = 0, Y = 0 }\n\
                target,+1\n-100,3\n0,0\n";
    let square = "# reads_along = { X = \"tool +Y\", Y = \"tool +X\" }\n# unit = \"um\"\n# at = { X = 0, Y = 0, Z = 0 }\n\
                  line,target,+1\nX,0,0\nX,100,3\nY,0,0\nY,100,0\n";
    let lying = square
        .replace("X,100,3", "X,100,13")
        .replace("Y,100,0", "Y,100,-10");
    for (name, sign) in [("router", 1.0), ("mill-21", -1.0)] {
        let machine = machine(&format!("examples/{name}/machine.toml"));
        let found = |text: &str| {
            let measured = runs::read(text, &machine).unwrap();
            let name = "runs".to_owned();
            import(&machine, &[Measurement { name, measured }])
        };
        let table = |text: &str, expected: &str, positive: [f64; 2], negative: Option<[f64; 2]>| {
            let found = found(text);
            let [motion] = &found.motions[..] else {
                panic!("{name}: {found:?}");
            };
            assert_eq!(motion.name(&machine), expected, "{name}");
            let near = |found: &[f64], expected: [f64; 2]| {
                // The second-order effect of 20 µrad over 500 mm is 1e-7 mm; displacements have none.
                found
                    .iter()
                    .zip(expected)
                    .all(|(f, e)| (f - e).abs() < 1e-9)
            };
            assert!(near(&motion.positive, positive), "{name}: {motion:?}");
            match negative {
                Some(values) => {
                    assert!(
                        near(motion.negative.as_ref().unwrap(), values),
                        "{name}: {motion:?}"
                    );
                }
                None => assert_eq!(motion.negative, None),
            }
        };
        let um = |v: f64| v * 1e-3 * sign;
        for laser in [laser, by_workpiece] {
            table(laser, "EXX", [2.0, 4.0].map(um), Some([-2.0, 0.0].map(um)));
        }
        let urad = |v: f64| v * 1e-6 * sign;
        for angle in [angle, &other_angle] {
            let turns = [0.0, 20.0].map(urad);
            table(angle, "EAX", turns, Some(turns));
        }
        // Z carries the tool on both: it deviates to −Y at −100 mm.
        table(dial, "EYZ", [-3e-3, 0.0], None);
        // A square does not depend on the sign of the axis: +3 µm is EC0X = 30e-6 on both.
        for square in [square, &lying] {
            let found = found(square);
            assert_eq!(found.locations[0].parameter.to_string(), "EC0X");
            assert!((found.locations[0].value - 30e-6).abs() < 1e-9, "{found:?}");
        }
    }
}

/// Remaining errors (mm) of tips after the best rigid-body fit: root mean square and largest.
fn left(off: &[(Vector3<f64>, Vector3<f64>)]) -> [f64; 2] {
    let rows = 3 * off.len();
    let matrix = DMatrix::from_fn(rows, 6, |row, column| {
        let (p, _) = off[row / 3];
        let unit = Vector3::ith(column % 3, 1.0);
        let effect = if column < 3 {
            unit
        } else {
            unit.cross(&p) / 1000.0
        };
        effect[row % 3]
    });
    let values = DVector::from_fn(rows, |row, _| off[row / 3].1[row % 3]);
    let fit = matrix
        .clone()
        .svd(true, true)
        .solve(&values, 1e-12)
        .unwrap();
    let rest = values - matrix * fit;
    let norms: Vec<f64> = (0..off.len())
        .map(|k| rest.fixed_rows::<3>(3 * k).norm())
        .collect();
    let squares: f64 = norms.iter().map(|n| n * n).sum();
    let most = norms.iter().fold(0.0, |most: f64, n| most.max(*n));
    [(squares / norms.len() as f64).sqrt(), most]
}

#[test]
fn the_mill_is_as_exact_as_its_laser_once_its_runs_are_compiled() {
    let machine = machine("examples/mill-21/machine.toml");
    let truth = errors("examples/mill-21/errors-21.toml", &machine);
    let mut random = Fixed::new(5);
    let mut plan = Vec::new();
    for (letter, count) in [('X', 51), ('Y', 61), ('Z', 81)] {
        let moved = machine.index(letter).unwrap();
        // Targets coincide with the points of its errors, so linear interpolation in between is the same.
        let points = truth.motions[moved][0].table.as_ref().unwrap().at.len();
        assert_eq!(points, count);
        let all = everything(&machine, count, || random.position(&machine));
        let own = all.into_iter().filter(|one| match &one.measured {
            MeasuredRuns::Line(line) => line.setup.moved == moved,
            MeasuredRuns::Square(_) => letter == 'X',
        });
        plan.extend(own);
    }
    let mut shown = Vec::new();
    for noise in [0.0, 0.2] {
        let five = |line: &mut AxisRuns| line.columns = vec![line.columns.clone(); 5].concat();
        let mut plan = plan.clone();
        for one in &mut plan {
            match &mut one.measured {
                MeasuredRuns::Line(line) => five(line),
                MeasuredRuns::Square(square) => square.lines.iter_mut().for_each(five),
            }
        }
        let measured = simulate(&machine, &truth, &plan, [noise * 1e-3, noise * 1e-6], 3);
        let found = import(&machine, &measured);
        // As a file, like a user would have.
        let text = error_file(&machine, &measured, &found);
        let found = ErrorModel::from_toml(&text, &machine).unwrap();
        let compiled = build(&machine, &found, &CompileOptions::default(), &()).unwrap();
        let runtime = Runtime::load(&compiled.blob).unwrap();
        let kinematics = Kinematics::new(&machine, &truth);
        let mut random = Fixed::new(17);
        let mut off = [Vec::new(), Vec::new()];
        for _ in 0..500 {
            let q = random.position(&machine);
            let command = Command::at(&machine, &machine.to_command(&q));
            let correction = runtime.evaluate(&command);
            let corrected = std::array::from_fn(|i| q[i] + f64::from(correction[i]));
            let nominal = kinematics.nominal(&q, None).t;
            for (off, q) in off.iter_mut().zip([q, corrected]) {
                let actual = kinematics.actual(&q, &Situation::default(), &Switches::ALL);
                off.push((nominal, actual.t - nominal));
            }
        }
        let [before, after] = off.map(|off| left(&off).map(|v| v * 1e3));
        shown.push((before, after));
    }
    let [(before, exact), (_, noisy)] = shown[..] else {
        unreachable!();
    };
    assert!(before[0] > 10.0, "{shown:?}");
    // The tolerance of the tables is 0.05 µm at the tip; values in a file are rounded to 1e-6 µm.
    assert!(exact[1] < 0.06, "{shown:?}");
    // 0.2 µm in five runs of each direction: 0.06 µm (µrad) each, in three displacements of three axes and
    // nine angles over up to 0.5 m, two of which act on each displacement: 0.06·√3·√(3 + 6·0.25²) = 0.2.
    assert!(noisy[0] < 0.25 && noisy[1] < 0.7, "{shown:?}");
}

#[test]
fn files_are_read_as_they_were_written() {
    let machine = machine("examples/five-axis-30/machine.toml");
    let truth = errors("examples/five-axis-30/errors-30.toml", &machine);
    let mut random = Fixed::new(11);
    let mut plan = everything(&machine, 5, || random.position(&machine));
    for one in plan.iter_mut().step_by(2) {
        if let MeasuredRuns::Line(line) = &mut one.measured {
            // An instrument with the opposite sign.
            line.setup.counts = -1.0;
            line.setup.keeps_slope = line.setup.is_straightness(&machine);
        }
    }
    for one in simulate(&machine, &truth, &plan, [1e-3, 1e-6], 1) {
        let text = runs::write(&one.measured, &machine);
        let read =
            runs::read(&text, &machine).unwrap_or_else(|e| panic!("{}: {e:?}\n{text}", one.name));
        // The two lines of a square in any order.
        let sorted = |text: &str| {
            let lines = text.lines().filter(|line| !line.contains("reads_along"));
            let mut lines: Vec<String> = lines.map(str::to_owned).collect();
            lines.sort();
            lines
        };
        assert_eq!(sorted(&runs::write(&read, &machine)), sorted(&text));
        let (MeasuredRuns::Line(a), MeasuredRuns::Line(b)) = (&one.measured, &read) else {
            continue;
        };
        assert_eq!(
            (a.setup.moved, a.setup.keeps_slope),
            (b.setup.moved, b.setup.keeps_slope)
        );
        // Measured from one axis to the other with the opposite sign equals from the other to the one.
        let turned = if a.setup.sense == b.setup.sense {
            1.0
        } else {
            -1.0
        };
        for (a, b) in a.columns.iter().zip(&b.columns) {
            for (a, b) in a.readings.iter().zip(&b.readings) {
                // Four decimals of µm or µrad.
                assert!((a - turned * b).abs() < 0.6e-7, "{}: {a} {b}", one.name);
            }
        }
    }
}

/// Readings of one axis along itself (mm).
fn positions(machine: &Machine, at: &str, readings: &str) -> Measurement {
    let text = format!(
        "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = {{ {at} }}\ntarget,+1\n{readings}"
    );
    Measurement {
        name: "x.csv".to_owned(),
        measured: runs::read(&text, machine).unwrap(),
    }
}

#[test]
fn the_lever_of_a_known_angular_motion_is_taken_out_and_of_an_unknown_one_told() {
    let machine = machine("examples/router/machine.toml");
    // The X carriage pitches: 50 µrad about Y at 400 mm. Its frame is at the origin, so a line at Z = −100, plus 60 mm
    // below due to the tool, moves by −160 mm · 50 µrad = −8 µm in X.
    let run = positions(&machine, "Y = 0, Z = -100", "0,0\n400,12\n");
    let pitch = runs::read(
        "# axis = \"X\"\n# reads = \"tool +Z to +X\"\n# unit = \"urad\"\ntarget,+1\n0,0\n400,50\n",
        &machine,
    )
    .unwrap();
    let pitch = Measurement {
        name: "pitch.csv".to_owned(),
        measured: pitch,
    };
    let alone = import(&machine, std::slice::from_ref(&run));
    assert!((alone.motions[0].positive[1] - 12e-3).abs() < 1e-9);
    let said: Vec<String> = alone.doubts.iter().map(ToString::to_string).collect();
    assert_eq!(
        said,
        ["EBX is not known: 1.6 µm for each 10 µrad of it are in EXX, with a lever of -160 mm"]
    );
    let both = import(&machine, &[run, pitch]);
    assert_eq!(both.motions[0].name(&machine), "EXX");
    // To the second order, 160 mm · (50 µrad)².
    assert!(
        (both.motions[0].positive[1] - 20e-3).abs() < 1e-6,
        "{both:?}"
    );
    assert!(both.doubts.is_empty(), "{both:?}");
}

#[test]
fn a_straightness_with_a_slope_beside_a_squareness_may_count_it_twice() {
    let machine = machine("examples/router/machine.toml");
    let dial = |slope: &str| {
        let text = format!(
            "# axis = \"X\"\n# reads = \"tool +Y\"\n# unit = \"um\"\n# at = {{ Y = 0, Z = 0 }}\n{slope}target,+1\n0,0\n400,12\n800,24\n"
        );
        let measured = runs::read(&text, &machine).unwrap();
        [Measurement {
            name: "straight.csv".to_owned(),
            measured,
        }]
    };
    let known = ErrorModel::from_toml(
        "machine = \"Router\"\n[parameters]\nEC0X = 10e-6\n",
        &machine,
    )
    .unwrap();
    let found =
        |slope: &str| solve(&machine, &dial(slope), &known, SolveOptions::default()).unwrap();
    let counts_twice = |found: &DirectResult| {
        let said = found.doubts.iter().map(ToString::to_string);
        said.filter(|said| said.contains("counted twice"))
            .collect::<Vec<_>>()
    };
    let kept = found("# slope = \"keep\"\n");
    // 30 µrad, including 10 for the squareness.
    assert!(
        (kept.motions[0].positive[2] - 16e-3).abs() < 1e-6,
        "{kept:?}"
    );
    assert_eq!(
        counts_twice(&kept),
        [
            "EYX leans by 20.0 µrad and EC0X is 10.0 µrad: both are the squareness of the same axes, which may be counted twice"
        ]
    );
    let removed = found("");
    assert!(removed.motions[0].positive[2].abs() < 1e-9, "{removed:?}");
    assert!((removed.slopes[0].1 - 20e-6).abs() < 1e-9, "{removed:?}");
    assert!(counts_twice(&removed).is_empty());
}

#[test]
fn one_number_is_half_of_the_mean_reversal_value() {
    let machine = machine("examples/router/machine.toml");
    let text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n\
                target,+1,-1\n0,1,-1\n400,5,1\n800,9,3\n";
    let measured = runs::read(text, &machine).unwrap();
    let name = "x.csv".to_owned();
    let perfect = ErrorModel::perfect(&machine);
    let options = SolveOptions { one_number: true };
    let found = solve(
        &machine,
        &[Measurement { name, measured }],
        &perfect,
        options,
    )
    .unwrap();
    let backlash = Parameter {
        component: 0,
        axis: 'X',
        kind: ParameterKind::Backlash,
    };
    // Reversals 2, 4 and 6 µm.
    assert!((found.errors.parameters[&backlash] - 2e-3).abs() < 1e-9);
    let motion = &found.motions[0];
    assert_eq!(motion.negative, None);
    for (value, um) in motion.positive.iter().zip([0.0, 3.0, 6.0]) {
        assert!((value - um * 1e-3).abs() < 1e-9, "{motion:?}");
    }
}

/// Readings of C on a machine with an endless table.
fn calibrator(machine: &Machine, readings: &str) -> DirectResult {
    let text = format!(
        "# axis = \"C\"\n# reads = \"tool +C\"\n# unit = \"urad\"\n# at = {{ A = 0 }}\ntarget,+1\n{readings}"
    );
    let measured = runs::read(&text, machine).unwrap();
    let name = "c.csv".to_owned();
    import(machine, &[Measurement { name, measured }])
}

#[test]
fn runs_of_an_endless_axis_are_closed_and_a_large_gap_is_told() {
    let machine = machine("examples/five-axis-30/machine.toml");
    let c = &machine.axes[machine.index('C').unwrap()];
    let [low, high] = c.travel;
    assert!(c.modulo && high - low == 360.0);
    let sign = if c.reversed { -1.0 } else { 1.0 };
    let whole: String = (0..=12)
        .map(|k| {
            format!(
                "{},{}\n",
                low + 30.0 * f64::from(k),
                [0.0, 5.0, 3.0][k as usize % 3]
            )
        })
        .collect();
    let found = calibrator(&machine, &whole);
    assert!(found.doubts.is_empty(), "{:?}", found.doubts);
    let text = error_file(
        &machine,
        &[],
        &DirectResult {
            motions: Vec::new(),
            ..found.clone()
        },
    );
    // An error that is not periodic is refused there.
    let read = ErrorModel::from_toml(&text, &machine).unwrap();
    let table = read.motions[machine.index('C').unwrap()][5]
        .table
        .clone()
        .unwrap();
    assert_eq!(table.at.len(), 13);
    // Too far in the direction of the command is + for a table that is not reversed (measurement.md).
    let step = table.positive[1] - table.positive[0];
    assert!(
        (step.abs() - 5e-6).abs() < 1e-11 && step * sign > 0.0,
        "{table:?}"
    );
    let part = format!("{low},0\n{},1\n{},2\n", low + 45.0, low + 90.0);
    let said: Vec<String> = (calibrator(&machine, &part).doubts.iter())
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        said,
        ["ECC was not measured over 270° of the turn: a straight line is assumed there"]
    );
}

#[test]
fn readings_of_no_small_errors_make_no_error_file() {
    let machine = machine("examples/router/machine.toml");
    // A tenth of a radian or more in one step, and levers of a metre.
    let text = "# axis = \"X\"\n# reads = \"tool +Z to +X\"\n# unit = \"rad\"\ntarget,+1\n0,0.1\n1,-0.1\n800,0.1\n";
    let measured = runs::read(text, &machine).unwrap();
    let name = "x.csv".to_owned();
    let perfect = ErrorModel::perfect(&machine);
    let solved = solve(
        &machine,
        &[Measurement { name, measured }],
        &perfect,
        SolveOptions::default(),
    );
    // Exact rotations are found even then; the error file refuses values above 0.1 rad.
    let found = solved.unwrap();
    let text = error_file(
        &machine,
        &[],
        &DirectResult {
            motions: Vec::new(),
            ..found
        },
    );
    assert!(ErrorModel::from_toml(&text, &machine).is_err());
}
