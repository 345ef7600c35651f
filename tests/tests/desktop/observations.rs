//! Instruments of every kind: what they read, and what is identified from it together with probings.

use nalgebra::Vector3;
use std::fmt::Write;
use std::fs;
use std::process::Command;
use trueaxis_identify::formats::observations::{self, Observations};
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::instrument::Kind;
use trueaxis_identify::simulate::{self, Disturbances, OfObservations};
use trueaxis_identify::{
    Identified, IdentifyOptions, NoiseSource, OutlierKind, Problem, drifting, identify, snoop,
};
use trueaxis_model::errors::{ErrorModel, Parameter, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::uncertainty;
use trueaxis_tests::observed::{Strategy, mixed, observed};
use trueaxis_tests::probed::Case;
use trueaxis_tests::random_machines::{self, Kinds};
use trueaxis_tests::{Fixed, usual_or_all};

/// Where the instruments really are, which identification is not told.
const SETUPS: &str = "# [setup.bar]\n# place_mm = [21.0, -14.0, 9.0]\n# dead_length_mm = 30.0\n# tool_mm = [0.03, -0.02, -74.5]\n\
# [setup.tracker]\n# place_mm = [-400.0, 250.0, 120.0]\n# orientation_deg = [12.0, -31.0, 77.0]\n# tool_mm = [0.1, 0.2, -70.0]\n";
const ALL: [&str; 5] = ["length", "point", "displacement", "angle", "surface"];

/// The Kolibri with ten errors, and a scale of X that probings alone cannot tell.
fn kolibri() -> (Case, Vec<Parameter>) {
    let mut case = Case::new("kolibri", "errors-10.toml");
    let scale = Parameter::parse("EXX1").unwrap();
    assert!(case.errors.set(&case.machine, scale, 52e-6));
    let mut parameters = case.parameters("10");
    parameters.push(scale);
    (case, parameters)
}

fn found(
    case: &Case,
    parameters: &[Parameter],
    probed: &Probings,
    all: &Observations,
    options: IdentifyOptions,
) -> Identified {
    let perfect = ErrorModel::perfect(&case.machine);
    let problem = Problem::new(&case.machine, probed, &case.artefact, parameters, &perfect);
    identify(&problem.with(all), options).unwrap()
}

#[test]
fn without_noise_the_truth_is_found_from_any_kinds_together() {
    let (case, parameters) = kolibri();
    let probed = case.measured(&Disturbances::default());
    let sets: [&[&str]; 7] = [
        &["surface"],
        &["length"],
        &["point"],
        &["displacement"],
        &["angle", "displacement"],
        &["length", "point"],
        &ALL,
    ];
    for set in sets {
        let plan = mixed(&case.machine, set, &mut Fixed::new(5));
        let all = observed(&case.machine, &case.errors, &plan, SETUPS, 0.0, 1);
        let found = found(
            &case,
            &parameters,
            &probed,
            &all,
            IdentifyOptions::default(),
        );
        assert!(found.unseen.is_empty(), "{set:?}: {:?}", found.unseen);
        for e in &found.parameters {
            let off = (e.value - case.truth(e.parameter)).abs();
            // 1e-6 mm at a tenth of a metre.
            let is_slope = e.parameter.is_angular() || e.parameter.to_string().ends_with('1');
            let most = if is_slope { 1e-8 } else { 1e-6 };
            assert!(off < most, "{set:?} {}: {off}", e.parameter);
        }
        let left = found.observed.iter().map(|row| row.after.norm());
        // 0.001 µm.
        assert!(left.fold(0.0, f64::max) < 1e-6, "{set:?}");
    }
}

#[test]
fn instruments_alone_are_enough() {
    // A tracking interferometer at four stations: their places and dead lengths are not known.
    let (case, parameters) = kolibri();
    let stations = [
        [-300.0, 40.0, 60.0],
        [280.0, -120.0, 50.0],
        [30.0, 330.0, 90.0],
        [10.0, 20.0, -400.0],
    ];
    let (mut setups, mut shared) = (String::new(), String::new());
    for (k, [x, y, z]) in stations.into_iter().enumerate() {
        let _ = write!(
            setups,
            "# [setup.s{k}]\n# place_mm = [{x}, {y}, {z}]\n# dead_length_mm = {k}.0\n# tool = \"reflector\"\n"
        );
        let _ = write!(shared, "# [setup.s{k}]\n# tool = \"reflector\"\n");
    }
    let mut plan = Strategy::new(&case.machine, &shared);
    let mut random = Fixed::new(8);
    for _ in 0..60 {
        let position = plan.anywhere(0.9, &mut random);
        for k in 0..stations.len() {
            plan.add("length", &format!("s{k}"), &position, "", 0.5);
        }
    }
    let clean = observed(&case.machine, &case.errors, &plan, &setups, 0.0, 1);
    let none = Probings::default();
    let exact = found(
        &case,
        &parameters,
        &none,
        &clean,
        IdentifyOptions::default(),
    );
    assert!(exact.unseen.is_empty(), "{:?}", exact.unseen);
    for e in &exact.parameters {
        let off = (e.value - case.truth(e.parameter)).abs();
        assert!(off < 1e-6, "{}: {off}", e.parameter);
    }
    let noisy = observed(&case.machine, &case.errors, &plan, &setups, 1.0, 2);
    let noisy = found(
        &case,
        &parameters,
        &none,
        &noisy,
        IdentifyOptions::default(),
    );
    for e in &noisy.parameters {
        let off = (e.value - case.truth(e.parameter)) / e.uncertainty;
        assert!(off.abs() < 4.0, "{}: {off}", e.parameter);
    }
    for (setup, [x, _, _]) in noisy.setups.iter().zip(stations) {
        let place = setup.parts.iter().find(|p| p.what == "place in x").unwrap();
        assert!(
            (place.value - x).abs() < 5.0 * place.uncertainty,
            "{setup:?}"
        );
    }
}

#[test]
fn intervals_of_mixed_sets_cover_the_truth_as_often_as_they_say() {
    let (case, parameters) = kolibri();
    let plan = mixed(&case.machine, &ALL, &mut Fixed::new(5));
    let clean = observed(&case.machine, &case.errors, &plan, SETUPS, 0.0, 1);
    let probed = case.measured(&Disturbances::default());
    let seeds = usual_or_all(40, 1000);
    let mut inside = 0;
    let mut scales = 0;
    for seed in 1..=seeds {
        let disturbances = Disturbances {
            noise: 1e-3,
            seed,
            ..Disturbances::default()
        };
        let probed = simulate::disturbed(&case.machine, &probed, &disturbances);
        let mut all = observed(&case.machine, &case.errors, &plan, SETUPS, 1.0, seed);
        // The same set-ups to start with, to save time.
        all.setups.clone_from(&clean.setups);
        let found = found(
            &case,
            &parameters,
            &probed,
            &all,
            IdentifyOptions::default(),
        );
        for e in &found.parameters {
            let is_in = (e.value - case.truth(e.parameter)).abs() < 1.96 * e.uncertainty;
            inside += usize::from(is_in);
        }
        scales += found
            .components
            .iter()
            .filter(|one| one.is_misstated())
            .count();
    }
    let part = inside as f64 / (seeds as usize * parameters.len()) as f64;
    println!("{:.1} % of 95 % intervals over {seeds} seeds", part * 100.0);
    assert!((0.93..0.97).contains(&part), "{part}");
    // Once in a thousand, for each of four kinds.
    assert!(scales <= usual_or_all(3, 15), "{scales}");
}

#[test]
fn a_wrong_stated_uncertainty_is_reported_for_its_kind_alone() {
    let (case, parameters) = kolibri();
    let plan = mixed(&case.machine, &ALL, &mut Fixed::new(5));
    let mut all = observed(&case.machine, &case.errors, &plan, SETUPS, 1.0, 3);
    for row in &mut all.rows {
        if all.setups[row.setup].kind == Kind::Length {
            row.sigma = row.sigma.map(|sigma| sigma / 2.0);
        }
    }
    let found = found(
        &case,
        &parameters,
        &case.noisy(3),
        &all,
        IdentifyOptions::default(),
    );
    assert_eq!(found.components.len(), 1 + ALL.len());
    for one in &found.components {
        let is_wrong = one.source == NoiseSource::Observations(Kind::Length);
        assert_eq!(one.is_misstated(), is_wrong, "{one:?}");
        let expected = if is_wrong { 2.0 } else { 1.0 };
        if let Some(factor) = one.of_stated {
            // Some 50 degrees of freedom give it to 10 %; three times that, and what other kinds take in.
            assert!((factor / expected - 1.0).abs() < 0.35, "{one:?}");
        }
    }
    // Together they have all degrees of freedom: there is no bar or other knowledge.
    let sum: f64 = found.components.iter().map(|one| one.freedom).sum();
    assert!((sum - found.freedom as f64).abs() < 1e-6, "{sum}");
}

#[test]
fn wrong_readings_and_slipped_instruments_are_named_as_outliers() {
    let (case, parameters) = kolibri();
    let plan = mixed(&case.machine, &ALL, &mut Fixed::new(5));
    let clean = observed(&case.machine, &case.errors, &plan, SETUPS, 1.0, 4);
    let perfect = ErrorModel::perfect(&case.machine);
    let probed = case.noisy(4);
    let problem = |all: &Observations| {
        let problem = Problem::new(
            &case.machine,
            &probed,
            &case.artefact,
            &parameters,
            &perfect,
        );
        problem.with(all)
    };
    let outliers = |all: &Observations| {
        let problem = problem(all);
        let identified = identify(&problem, IdentifyOptions::default()).unwrap();
        let found = snoop(&problem, &identified);
        found
            .into_iter()
            .map(|one| (one.sentence(&problem), one))
            .collect::<Vec<_>>()
    };
    assert_eq!(outliers(&clean), Vec::new());
    let of_kind = |kind: Kind| {
        let rows = clean.rows.iter();
        let own = rows
            .enumerate()
            .filter(|(_, row)| clean.setups[row.setup].kind == kind);
        own.map(|(i, _)| i).collect::<Vec<usize>>()
    };
    for kind in Kind::ALL {
        let rows = of_kind(kind);
        let wrong = rows[rows.len() / 3];
        let mut all = clean.clone();
        all.rows[wrong].value.x += 0.05;
        let found = outliers(&all);
        assert_eq!(found.len(), 1, "{kind:?}: {found:?}");
        let (sentence, one) = &found[0];
        assert_eq!(
            (&one.kind, &one.observations[..]),
            (&OutlierKind::Row, &[wrong][..])
        );
        let line = format!("mixed.csv line {}", all.rows[wrong].line);
        assert!(sentence.contains(&line), "{sentence}");
        // 50 µm or µrad, to a few standard uncertainties of 2 at most.
        assert!((one.off.x - 0.05).abs() < 0.012, "{kind:?}: {}", one.off.x);
    }
    // Nor does a wrong reading hide in a source of few rows.
    let mut plan = Strategy::new(&case.machine, "");
    let x = case.machine.index('X').unwrap();
    let mut position = plan.anywhere(0.0, &mut Fixed::new(1));
    for k in 0..15 {
        position[x] = -112.0 + 16.0 * f64::from(k);
        plan.add("displacement", "laser", &position, "tool +X", 0.3);
    }
    let mut few = observed(&case.machine, &case.errors, &plan, "", 1.0, 4);
    assert_eq!(outliers(&few), Vec::new());
    few.rows[6].value.x += 0.02;
    let found = outliers(&few);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0].1.observations, [6]);
    // The bar slips by 20 µm half-way.
    let rows = of_kind(Kind::Length);
    let mut all = clean.clone();
    for i in &rows[rows.len() / 2..] {
        all.rows[*i].value.x += 0.02;
    }
    let found = outliers(&all);
    let (sentence, one) = &found[0];
    assert_eq!(one.kind, OutlierKind::Setup("bar".to_owned()));
    assert_eq!(one.observations, rows[rows.len() / 2..].to_vec());
    assert!((one.off.x - 0.02).abs() < 3e-3, "{one:?}");
    assert!(
        sentence.contains("bar reads 2") && sentence.contains("too much"),
        "{sentence}"
    );
    // Robust estimation gives wrong readings no weight.
    let mut all = clean.clone();
    for i in (0..all.rows.len()).step_by(25) {
        all.rows[i].value.x += 0.2;
    }
    let robust = IdentifyOptions {
        robust: true,
        ..IdentifyOptions::default()
    };
    let found = identify(&problem(&all), robust).unwrap();
    for e in &found.parameters {
        let off = (e.value - case.truth(e.parameter)) / e.uncertainty;
        assert!(off.abs() < 4.5, "{}: {off}", e.parameter);
    }
}

/// Rows in random order, one every half minute.
fn shuffled(case: &mut Case, random: &mut Fixed) {
    let rows = &mut case.plan.rows;
    for i in (1..rows.len()).rev() {
        rows.swap(i, random.within(0.0, (i + 1) as f64) as usize % (i + 1));
    }
    for (i, row) in rows.iter_mut().enumerate() {
        row.time = Some(30.0 * i as f64);
    }
}

#[test]
fn drift_is_found_with_the_parameters_and_costs_little() {
    let mut case = Case::new("kolibri", "errors-10.toml");
    shuffled(&mut case, &mut Fixed::new(2));
    let parameters = case.parameters("10");
    let perfect = ErrorModel::perfect(&case.machine);
    let solved = |drift: [f64; 3], drift_lag: f64, seed: u64| {
        let probed = case.measured(&Disturbances {
            noise: 1e-3,
            drift,
            drift_lag,
            seed,
            ..Disturbances::default()
        });
        let problem = || {
            Problem::new(
                &case.machine,
                &probed,
                &case.artefact,
                &parameters,
                &perfect,
            )
        };
        let steady = identify(&problem(), IdentifyOptions::default()).unwrap();
        let all = Observations {
            drift: drifting(&problem(), &steady),
            ..Observations::default()
        };
        (
            all.drift.len(),
            identify(&problem().with(&all), IdentifyOptions::default()).unwrap(),
        )
    };
    let positions: Vec<_> = (case.plan.rows.iter())
        .map(|row| {
            (
                case.machine.to_kinematic(&row.position),
                Situation::default(),
            )
        })
        .collect();
    let band = |found: &Identified| {
        uncertainty::band(&case.machine, &found.errors, &found.known, &positions)
    };
    let mut alarms = 0;
    // Linear, and exponential with 0.3 and a tenth of the time.
    for (seed, lag) in (0..12).zip([0.0, 0.3, 0.1].into_iter().cycle()) {
        let (steady_terms, steady) = solved([0.0; 3], 0.0, seed);
        alarms += steady_terms;
        let drift = [10e-3, -10e-3, 10e-3];
        let (_, found) = solved(drift, lag, seed);
        let ratio = found.noise / steady.noise;
        assert!(ratio < 1.15, "noise {ratio}");
        let ratio = band(&found).translation_um.max / band(&steady).translation_um.max;
        assert!(ratio < 1.15, "band {ratio}");
        for (k, expected) in drift.into_iter().enumerate() {
            let one = found.drift.iter().find(|one| one.component == k).unwrap();
            let off = (one.value - expected) / one.uncertainty;
            assert!(off.abs() < 4.0 && one.setup.is_none(), "{one:?}");
            // 10 µm bend by up to 4 µm, which the noise of 1 µm in 168 rows does not hide.
            let part = one.lag.map_or(0.0, |found| found / one.seconds);
            assert!((part - lag).abs() <= 0.35 * lag, "{one:?}: {lag}");
        }
        for e in &found.parameters {
            let off = (e.value - case.truth(e.parameter)) / e.uncertainty;
            assert!(off.abs() < 4.5, "{}: {off}", e.parameter);
        }
    }
    // Six components, each once in a thousand.
    assert!(alarms <= 1, "{alarms}");
}

#[test]
fn an_instrument_that_drifts_does_not_bend_the_machine() {
    let (case, parameters) = kolibri();
    let plan = mixed(&case.machine, &["length", "point"], &mut Fixed::new(5));
    let drift = Vector3::new(8e-3, 0.0, -6e-3);
    let true_ones = {
        let setups = SETUPS.to_owned() + &plan.text();
        observations::read(&setups, "mixed.csv", &case.machine).unwrap()
    };
    let disturbances = OfObservations {
        noise: 1.0,
        drift: drift.into(),
        drift_lag: 0.0,
        seed: 1,
    };
    let kinematics = Kinematics::new(&case.machine, &case.errors);
    let mut all = simulate::observations(&kinematics, &true_ones, &disturbances);
    let read = plan.read();
    (all.setups, all.tools) = (read.setups, read.tools);
    let perfect = ErrorModel::perfect(&case.machine);
    let probed = case.noisy(1);
    let problem = Problem::new(
        &case.machine,
        &probed,
        &case.artefact,
        &parameters,
        &perfect,
    );
    let steady = identify(&problem.clone().with(&all), IdentifyOptions::default()).unwrap();
    all.drift = drifting(&problem.clone().with(&all), &steady);
    let found = identify(&problem.with(&all), IdentifyOptions::default()).unwrap();
    assert!(!found.drift.is_empty());
    for e in &found.parameters {
        let off = (e.value - case.truth(e.parameter)) / e.uncertainty;
        assert!(off.abs() < 4.5, "{}: {off}", e.parameter);
    }
    for one in &found.components {
        assert!(!one.is_misstated(), "{one:?}");
    }
}

/// True if the independent program knows the machine and its errors: X, Y, Z and two rotary axes or more, error motions as
/// polynomials and harmonics over the whole travel.
fn is_known(case: &random_machines::Case) -> bool {
    let kinds = Kinds::of(case);
    let unknown = [
        "quill",
        "tabulated",
        "reversal",
        "thermal",
        "partly",
        "length",
    ];
    let rotary = case
        .machine
        .axes
        .iter()
        .filter(|axis| axis.letter.is_rotary());
    rotary.count() >= 2 && !unknown.iter().any(|kind| kinds.has(kind))
}

/// Every kind on such a machine, with spindle angles and directions of travel.
fn anything(machine: &Machine, random: &mut Fixed) -> String {
    let letters: Vec<String> = machine.axes.iter().map(|a| a.letter.to_string()).collect();
    let directions: Vec<String> = letters.iter().map(|l| format!("{l}_dir")).collect();
    let rotary: Vec<&String> = letters.iter().filter(|l| "ABC".contains(*l)).collect();
    let mut text = String::from(
        "# [setup.bar]\n# place_mm = [40.0, -70.0, 30.0]\n# dead_length_mm = 12.5\n# tool = \"ball\"\n# tool_mm = [1.0, 2.0, -90.0]\n\
# [setup.rtest]\n# place_mm = [-55.0, 66.0, 77.0]\n# orientation_deg = [20.0, 130.0, -75.0]\n# tool = \"ball\"\n\
# [setup.dial]\n# place_mm = [10.0, 20.0, 30.0]\n# orientation_deg = [0.2, -0.3, 0.1]\n\
# [setup.level]\n# orientation_deg = [0.02, -0.01, 0.03]\n\
# [setup.part]\n# place_mm = [-5.0, 6.0, 7.0]\n# orientation_deg = [3.0, -100.0, 20.0]\n",
    );
    let _ = writeln!(
        text,
        "kind,setup,{},{},S,reads,normal_x,normal_y,normal_z,length_mm,x_mm,y_mm,z_mm,displacement_um,angle_urad,deviation_um",
        letters.join(","),
        directions.join(",")
    );
    let reads = [
        "tool +X",
        "workpiece -Z",
        "tool -Y",
        "workpiece +Y to +Z",
        "tool +X to -Y",
    ];
    for row in 0..45 {
        let (kind, setup, reads, cells) = match row % 9 {
            8 => (
                "surface",
                "part",
                [",0.6,0,-0.8", ",0,1,0"][row / 9 % 2].to_owned(),
                ",,,,,,0",
            ),
            0 | 1 => ("length", "bar", String::new(), "0,,,,,,"),
            2 | 3 => ("point", "rtest", String::new(), ",0,0,0,,,"),
            4 => (
                "displacement",
                "laser",
                reads[row / 9 % 3].to_owned(),
                ",,,,0,,",
            ),
            5 => (
                "angle",
                "level",
                format!("tool -{}", rotary[row / 9 % 2]),
                ",,,,,0,",
            ),
            6 => (
                "angle",
                "zero",
                reads[3 + row / 9 % 2].to_owned(),
                ",,,,,0,",
            ),
            _ => (
                "displacement",
                "dial",
                reads[row / 9 % 3].to_owned(),
                ",,,,0,,",
            ),
        };
        let positions: Vec<String> = (machine.axes.iter())
            .map(|axis| format!("{:.4}", random.within(axis.travel[0], axis.travel[1])))
            .collect();
        let signs: Vec<&str> = (machine.axes.iter())
            .map(|_| ["1", "-1", "0"][random.within(0.0, 2.999) as usize])
            .collect();
        let reads = match kind {
            "surface" => reads,
            _ => format!("{reads},,,"),
        };
        let spindle = random.within(0.0, 360.0);
        let _ = writeln!(
            text,
            "{kind},{setup},{},{},{spindle:.3},{reads},{cells}",
            positions.join(","),
            signs.join(",")
        );
    }
    text
}

#[test]
fn what_is_written_is_read_again() {
    let (case, _) = kolibri();
    let plan = mixed(&case.machine, &ALL, &mut Fixed::new(5));
    let plan = SETUPS.to_owned() + &plan.text();
    let plan = observations::read(&plan, "mixed.csv", &case.machine).unwrap();
    let kinematics = Kinematics::new(&case.machine, &case.errors);
    let all = simulate::observations(&kinematics, &plan, &OfObservations::default());
    let text = observations::write(&all, &case.machine);
    let again = observations::read(&text, "mixed.csv", &case.machine).unwrap();
    assert_eq!(observations::write(&again, &case.machine), text);
    assert_eq!(
        (again.rows.len(), &again.tools),
        (all.rows.len(), &all.tools)
    );
    // Another file with the same set-ups adds rows, one that describes them differently is refused.
    let mut both = again.clone();
    both.add(again.clone()).unwrap();
    assert_eq!(
        (both.rows.len(), both.setups.len()),
        (2 * again.rows.len(), again.setups.len())
    );
    let mut other = again.clone();
    other.setups[0].given.length = Some(31.0);
    assert!(both.add(other).is_err());
}

#[test]
fn readings_of_every_kind_are_those_of_rigid_bodies() {
    let python = std::env::var("PYTHON").unwrap_or("python3".to_owned());
    let has = Command::new(&python)
        .args(["-c", "import tomllib"])
        .output();
    if !has.is_ok_and(|output| output.status.success()) {
        eprintln!("NOT RUN: readings beside tests/oracle/observations.py, which needs Python 3.11");
        return;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/oracle/observations.py");
    let folder = std::env::temp_dir().join(format!("observations-{}", std::process::id()));
    fs::create_dir_all(&folder).unwrap();
    let mut random = Fixed::new(11);
    let (mut worst, mut rows) = (0.0_f64, 0);
    let known = (0..).filter_map(random_machines::case).filter(is_known);
    for case in known.take(usual_or_all(8, 100)) {
        let (machine, errors) = (case.machine, case.errors);
        let plan = anything(&machine, &mut random);
        let plan = observations::read(&plan, "plan.csv", &machine);
        let plan = plan.unwrap_or_else(|e| panic!("{}: {}", e.message, e.remedy));
        let exact = OfObservations::default();
        let read = simulate::observations(&Kinematics::new(&machine, &errors), &plan, &exact);
        let files = ["machine.toml", "errors.toml", "observations.csv"].map(|f| folder.join(f));
        let [text, errors_text] = case.files;
        let contents = [text, errors_text, observations::write(&read, &machine)];
        for (file, content) in files.iter().zip(contents) {
            fs::write(file, content).unwrap();
        }
        let output = Command::new(&python)
            .arg(script)
            .args(&files)
            .output()
            .unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        let failed = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{failed}");
        assert_eq!(said.lines().count(), read.rows.len(), "{failed}");
        for line in said.lines() {
            for residual in line.split(' ').skip(2) {
                worst = worst.max(residual.parse::<f64>().unwrap().abs());
                rows += 1;
            }
        }
    }
    fs::remove_dir_all(&folder).unwrap();
    println!("{rows} readings: at most {worst:.1e} µm or µrad apart");
    // Files have nine decimals of a mm, 5e-7 µm, and six of a µm.
    assert!(worst < 1e-6, "{worst}");
}
