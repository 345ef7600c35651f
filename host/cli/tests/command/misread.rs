//! Readings of instruments that are another quantity than declared, copied, or against what was stated beforehand.

use crate::identify::{probings, probings_of};
use crate::observations::observations;
use crate::program::{Folder, example, examples, plain, run, trueaxis};

/// The observations with one column of the rows of a set-up changed, and the answer of `identify` to them: exit code,
/// output and warnings.
fn with(setup: &str, column: &str, change: &dyn Fn(f64, f64) -> f64) -> (i32, String) {
    let folder = Folder::new();
    let observed = std::fs::read_to_string(observations(&folder, &[])).unwrap();
    let mut places: Option<[usize; 3]> = None;
    let changed: String = (observed.lines())
        .map(|line| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if line.starts_with("kind") {
                let place = |name: &str| cells.iter().position(|cell| cell == name).unwrap();
                places = Some(["setup", column, "X"].map(place));
            } else if let Some([own, value, x]) = places
                && cells[own] == setup
            {
                let [read, x]: [f64; 2] = [value, x].map(|k| cells[k].parse().unwrap());
                cells[value] = format!("{:.9}", change(read, x));
            }
            cells.join(",") + "\n"
        })
        .collect();
    identified(&folder, &changed)
}

/// The answer to a file of observations, beside probings.
fn identified(folder: &Folder, observed: &str) -> (i32, String) {
    let probed = probings(folder, &[]);
    let file = folder.file("changed.csv", observed);
    let machine = example("kolibri/machine.toml");
    let output = run(&format!(
        "identify {machine} {probed} --observations {file}"
    ));
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    (output.status.code().unwrap(), plain(&said))
}

fn named(what: &str, (code, said): (i32, String), parts: &[&str]) {
    assert_ne!(code, 0, "{what}: {said}");
    for part in parts {
        assert!(said.contains(part), "{what}: `{part}` is not in\n{said}");
    }
}

#[test]
fn readings_as_they_are_contradict_nothing_and_show_the_deviation_of_each_prior() {
    let (code, said) = with("bar", "length_mm", &|read, _| read);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("stated as 0.0000 ± 0.0005 (|z| = "), "{said}");
    for word in ["z = ", "look ", "equal to the last digit"] {
        assert!(
            !said.replace("|z| = ", "").contains(word),
            "`{word}` in\n{said}"
        );
    }
}

#[test]
fn readings_of_another_quantity_are_named() {
    type Change = fn(f64, f64) -> f64;
    let cases: [(&str, Change, &str); 8] = [
        ("bar", |read, _| read / 25.4, "fit if they are in inches"),
        ("bar", |read, _| read * 1e-3, "fit if they are in metres"),
        ("bar", |read, _| read * 1e3, "fit if they are in µm"),
        (
            "bar",
            |read, _| read - 100.0,
            "fit if they are deviations of a length of 100.0",
        ),
        // Without its extension.
        (
            "bar",
            |read, _| read - 30.0,
            "fit with a dead length of 30.0",
        ),
        (
            "laser",
            |read, x| x + 1e-3 * read,
            "fit if they are positions in mm instead of deviations in µm",
        ),
        (
            "square",
            |read, _| -read,
            "look as if they count the other way",
        ),
        (
            "square",
            |read, _| read / 1e3,
            "look to be in mm instead of µm",
        ),
    ];
    for (setup, change, what) in cases {
        let column = match setup {
            "bar" => "length_mm",
            _ => "displacement_um",
        };
        let part = format!("the readings of {setup} {what}");
        named(what, with(setup, column, &change), &[&part]);
    }
    // More than any deviation.
    let found = with("laser", "displacement_um", &|read, x| 1e3 * x + read);
    named("µm", found, &["cannot be a reading", "look at its unit"]);
}

#[test]
fn readings_that_are_zero_everywhere_are_named() {
    let (_, said) = with("laser", "displacement_um", &|_, _| 0.0);
    let parts = [
        "readings of laser are the same: no machine is as good",
        "look whether the instrument was read",
    ];
    for part in parts {
        assert!(said.contains(part), "{said}");
    }
}

#[test]
fn lengths_whose_deviations_have_the_other_sign_are_named_however_exact_they_are_said_to_be() {
    let folder = Folder::new();
    let observed = std::fs::read_to_string(observations(&folder, &[])).unwrap();
    let header = observed.lines().find(|line| line.starts_with("kind"));
    let header: Vec<&str> = header.unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|cell| *cell == name).unwrap();
    let [length, sigma] = ["length_mm", "sigma_um"].map(place);
    // With a small uncertainty the machine is fitted to them, and all else seems to be wrong.
    for stated in ["0.5", "0.1", "0.02", "0.005"] {
        let changed: String = (observed.lines())
            .map(|line| {
                let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
                if line.starts_with("length,bar") {
                    let read: f64 = cells[length].parse().unwrap();
                    cells[length] = format!("{:.9}", 200.0 - read);
                    cells[sigma] = stated.to_owned();
                }
                cells.join(",") + "\n"
            })
            .collect();
        let found = identified(&folder, &changed);
        let part = "the readings of bar look as if they count the other way";
        named(stated, found, &[part]);
    }
}

#[test]
fn a_stated_dead_length_that_other_readings_contradict_is_named() {
    let found = with("bar", "length_mm", &|read, _| read - 0.05);
    let parts = [
        "bar: the dead length was stated as 0.0000 ± 0.0005 mm (standard uncertainty)",
        "z = ",
        "chance gives among 1 stated values with a probability of",
    ];
    named("dead length", found, &parts);
}

/// Probings with changed cells of one axis, and the answer to them.
fn probed(axis: &str, change: &dyn Fn(f64) -> f64) -> (i32, String) {
    let folder = Folder::new();
    let text = std::fs::read_to_string(probings(&folder, &[])).unwrap();
    let place = text.lines().next().unwrap();
    let place = place.split(',').position(|cell| cell == axis).unwrap();
    let changed: String = (text.lines().enumerate())
        .map(|(number, line)| {
            let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
            if number > 0 {
                cells[place] = format!("{:.9}", change(cells[place].parse().unwrap()));
            }
            cells.join(",") + "\n"
        })
        .collect();
    let file = folder.file("changed.csv", changed);
    let output = trueaxis(&["identify", &example("kolibri/machine.toml"), &file]);
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    (output.status.code().unwrap(), plain(&said))
}

#[test]
fn one_linear_axis_in_another_unit_is_named() {
    for (axis, factor, unit) in [("X", 25.4, "inches"), ("Z", 1e3, "metres")] {
        let found = probed(axis, &|value| value / factor);
        named(
            unit,
            found,
            &[&format!("the rows fit if {axis} is in {unit}")],
        );
    }
}

#[test]
fn senses_that_probings_cannot_show_are_said_to_be_unseen() {
    let (code, said) = probed("X", &|value| value);
    assert_eq!(code, 0, "{said}");
    let part =
        "these rows would fit as well if C and X counted the other way: nothing here shows it";
    assert!(said.contains(part), "{said}");
    // With the places of balls, they are seen.
    let folder = Folder::new();
    let file = probings(&folder, &[]);
    let [machine, artefact] = examples("kolibri", ["machine.toml", "artefact.toml"]);
    let output = run(&format!("identify {machine} {file} --artefact {artefact}"));
    let said = plain(&output.stdout);
    assert!(!said.contains("counted the other way"), "{said}");
}

#[test]
fn a_position_of_a_rotary_axis_that_is_off_is_named() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    // The machine stood at 15.0025° where it reported 15°: 44 µrad.
    let plan = std::fs::read_to_string(example("kolibri/plan.csv")).unwrap();
    let plan = folder.file("plan.csv", plan.replace(",15,", ",15.0025,"));
    let text = std::fs::read_to_string(probings_of(&folder, &plan, &[])).unwrap();
    let text = text.replace(",15.002500000,", ",15.000000000,");
    let file = folder.file("reported.csv", text);
    let output = run(&format!("identify {machine} {file} --model 10"));
    let said = plain(&[&output.stdout[..], &output.stderr[..]].concat());
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("at A = 15, A was off by "), "{said}");
}

#[test]
fn copied_rows_are_named() {
    let folder = Folder::new();
    let observed = std::fs::read_to_string(observations(&folder, &[])).unwrap();
    let copies: Vec<&str> = (observed.lines())
        .filter(|line| line.starts_with("displacement,laser"))
        .collect();
    let (_, said) = identified(&folder, &(observed.clone() + &copies.join("\n") + "\n"));
    assert!(said.contains("equal to the last digit"), "{said}");
    // A repeated measurement is no copy.
    let (_, said) = identified(&folder, &observed);
    assert!(!said.contains("equal to the last digit"), "{said}");
}

/// Ten runs of X that read 20 nm/mm, while the machine becomes `longer` (µm at the end) from the first to the last.
fn warming(longer: f64) -> String {
    let mut text = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 150, Z = -200 }\ntarget".to_owned();
    let runs = || (1..=5).flat_map(|run| [(run, 1), (run, -1)]);
    for (run, direction) in runs() {
        text += &format!(",{:+}", direction * run);
    }
    for target in 0..=10 {
        text += &format!("\n{}", 50 * target);
        for (number, (run, direction)) in runs().enumerate() {
            // Scatter of a few tenths of a micrometre in no order.
            let noise = f64::from((7 * target + 5 * run + 3 * direction) % 11 - 5) / 20.0;
            let warm = longer * number as f64 / 9.0 * f64::from(target) / 10.0;
            text += &format!(",{:.2}", f64::from(target) + noise + warm);
        }
    }
    text + "\n"
}

#[test]
fn readings_that_go_one_way_from_run_to_run_are_a_warm_up() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let said = |longer: f64| {
        let runs = folder.file("runs.csv", warming(longer));
        let output = run(&format!("measured {machine} {runs}"));
        plain(&[&output.stdout[..], &output.stderr[..]].concat())
    };
    let warm = said(10.0);
    assert!(
        warm.contains("the readings of X change with the order of the runs, at 500 by 9.1 µm"),
        "{warm}"
    );
    assert!(!said(0.0).contains("order of the runs"), "{}", said(0.0));
}
