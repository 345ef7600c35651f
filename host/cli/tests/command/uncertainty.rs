//! Covariances: written, read, merged, and the error that they leave.

use crate::identify::probings;
use crate::program::{
    Folder, answer, done, example, examples, json, plain, refuses, run, trueaxis,
};

/// Identifies the Kolibri's ten errors into `errors.toml`.
fn identified(folder: &Folder) -> String {
    let (out, machine) = (folder.at("errors.toml"), example("kolibri/machine.toml"));
    let probings = probings(folder, &[]);
    done(&format!(
        "identify {machine} {probings} --model 10 -o {out}"
    ));
    out
}

fn compiled(folder: &Folder, errors: &str, more: &[&str]) -> String {
    let (machine, out) = (example("kolibri/machine.toml"), folder.at("k.trax"));
    let mut arguments = vec!["compile", &machine, errors, "-o", &out, "--random", "1000"];
    arguments.extend(more);
    answer(0, &arguments)
}

#[test]
fn compile_and_verify_print_what_uncertain_parameters_leave() {
    let folder = Folder::new();
    let errors = identified(&folder);
    // The misfit would hide the difference that correlations make.
    let text = std::fs::read_to_string(&errors).unwrap();
    let lines = text.lines().filter(|line| !line.starts_with("misfit_um"));
    let text: String = lines.map(|line| line.to_owned() + "\n").collect();
    let errors = folder.file("errors.toml", &text);
    let said = compiled(&folder, &errors, &["--verbose"]);
    assert!(
        said.contains("95 % interval of the error from uncertain parameters"),
        "{said}"
    );
    assert!(!said.contains("uncorrelated"), "{said}");
    let parsed = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let with = parsed(&compiled(&folder, &errors, &["--json"]));
    assert_eq!(with["uncertainty"]["correlated"], 10);
    let verified = [
        "verify",
        &example("kolibri/machine.toml"),
        &errors,
        &folder.at("k.trax"),
    ];
    let verified = parsed(&answer(
        0,
        &[&verified[..], &["--random", "1000", "--json"]].concat(),
    ));
    assert_eq!(verified["uncertainty"], with["uncertainty"]);
    // Without correlations the output says so, and the band differs.
    let text = std::fs::read_to_string(&errors).unwrap();
    let alone = text.replace(
        "[uncertainty]\ncovariance = \"errors.covariance.csv\"\n",
        "",
    );
    let alone = folder.file("alone.toml", &alone);
    let said = compiled(&folder, &alone, &["--verbose"]);
    assert!(
        said.contains("10 of 10 parameters are taken as uncorrelated"),
        "{said}"
    );
    let without = parsed(&compiled(&folder, &alone, &["--json"]));
    let mean = |answer: &serde_json::Value| {
        let mean = &answer["uncertainty"]["travel"]["translation_um"]["mean"];
        mean.as_f64().unwrap()
    };
    let (with, without) = (mean(&with), mean(&without));
    assert!((with / without - 1.0).abs() > 0.05, "{with} {without}");
    // Nothing is printed if no uncertainty is known.
    let errors = example("kolibri/errors-10.toml");
    let none = parsed(&compiled(&folder, &errors, &["--json"]));
    assert!(none["uncertainty"].is_null());
}

#[test]
fn covariances_that_do_not_belong_to_the_errors_are_refused() {
    let folder = Folder::new();
    let errors = identified(&folder);
    let covariances = folder.at("errors.covariance.csv");
    let text = std::fs::read_to_string(&covariances).unwrap();
    let machine = example("kolibri/machine.toml");
    let out = folder.at("never.trax");
    for (from, to, parts) in [
        (
            "EB0A",
            "EB0Y",
            [
                "EB0Y has no value under [parameters]",
                "one run of identify",
            ],
        ),
        (
            "parameter,",
            "name,",
            ["does not begin with `parameter`", "header"],
        ),
        (
            "\nEC0A,",
            "\nEC0A,0,",
            ["the row has 12 columns, the header has 11", "one row"],
        ),
    ] {
        std::fs::write(&covariances, text.replace(from, to)).unwrap();
        refuses(&format!("compile {machine} {errors} -o {out}"), &parts);
    }
    // From another run, with twice the uncertainty.
    let scaled: Vec<String> = text
        .lines()
        .map(|line| {
            let cells = line.split(',').map(|cell| match cell.parse::<f64>() {
                Ok(value) => format!("{:e}", 4.0 * value),
                Err(_) => cell.to_owned(),
            });
            cells.collect::<Vec<_>>().join(",")
        })
        .collect();
    std::fs::write(&covariances, scaled.join("\n")).unwrap();
    let parts = ["the standard uncertainty of EB0A is", "one run of identify"];
    refuses(&format!("compile {machine} {errors} -o {out}"), &parts);
    std::fs::remove_file(&covariances).unwrap();
    refuses(
        &format!("compile {machine} {errors} -o {out}"),
        &["errors.covariance.csv: cannot be read", "CSV file"],
    );
}

#[test]
fn what_is_known_already_is_merged_with_its_covariances() {
    let folder = Folder::new();
    let errors = identified(&folder);
    let probings = folder.at("probings.csv");
    let out = folder.at("new.toml");
    let machine = example("kolibri/machine.toml");
    let names = "EB0A,EC0A,EY0C,EA0C,EB0C";
    done(&format!(
        "identify {machine} {probings} --model {names} --update {errors} -o {out}"
    ));
    let merged = std::fs::read_to_string(folder.at("new.covariance.csv")).unwrap();
    let header = merged.lines().next().unwrap();
    assert_eq!(
        header,
        format!("parameter,{names},EC0X,EA0Z,EB0Z,EYY1,EZZ1")
    );
    // The rows determine the first five parameters, given the others, much better than the others are known. So with
    // the uncertainty of the others they are as uncertain as before.
    let old = std::fs::read_to_string(&errors).unwrap();
    let new = std::fs::read_to_string(&out).unwrap();
    let of = |text: &str, name: &str| -> f64 {
        let part = text.split("[standard_uncertainty]").nth(1).unwrap();
        let line = part.lines().find(|l| l.starts_with(name)).unwrap();
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    for name in names.split(',') {
        let ratio = of(&new, name) / of(&old, name);
        // The same rows are used twice.
        assert!((ratio - 1.0).abs() < 0.01, "{name}: {ratio}");
    }
    // It can be read again.
    compiled(&folder, &out, &[]);
}

#[test]
fn a_bar_to_a_ball_that_was_not_probed_is_told() {
    let folder = Folder::new();
    let probings = probings(&folder, &[]);
    let artefact = folder.file(
        "a.toml",
        "[[ball]]\nname = \"1\"\n[[ball]]\nname = \"2\"\n[[ball]]\nname = \"3\"\n[[ball]]\nname = \"4\"\n[[ball]]\nname = \"one\"\n[[bar]]\nballs = [\"1\", \"one\"]\nlength_mm = 100.0\nstandard_uncertainty_mm = 0.001\n",
    );
    let machine = example("kolibri/machine.toml");
    let output = run(&format!(
        "identify {machine} {probings} --model 10 --artefact {artefact}"
    ));
    assert_eq!(output.status.code(), Some(0));
    let said = plain(&output.stderr);
    assert!(
        said.contains("ball one was not probed under this name"),
        "{said}"
    );
}

#[test]
fn identifications_are_repeated_for_anyone() {
    let [machine, errors, artefact, plan] = examples(
        "kolibri",
        [
            "machine.toml",
            "errors-10.toml",
            "artefact.toml",
            "plan.csv",
        ],
    );
    let said = json(&format!(
        "simulate identifications {machine} {errors} --artefact {artefact} --plan \
            {plan} --model 10 --seeds 20"
    ));
    assert_eq!(said["identifications"], 20);
    assert_eq!(said["parameters"].as_array().unwrap().len(), 10);
    let inside = said["tips_inside"].as_f64().unwrap();
    assert!((0.8..=1.0).contains(&inside), "{inside}");
}

/// Runs of X of the router: five targets over its travel, three runs in each direction.
const RUNS: &str = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 0, Z = 0 }\n\
target,+1,-1,+2,-2,+3,-3\n0,0.2,-3.9,-0.3,-4.2,0.1,-4.0\n200,3.1,-1.2,2.8,-1.0,3.0,-1.3\n\
400,7.4,3.0,7.9,3.3,7.6,3.1\n600,9.8,5.9,10.2,5.6,9.9,6.0\n800,14.1,9.7,13.8,10.1,14.4,9.9\n";

#[test]
fn what_runs_scatter_is_in_the_band_of_their_tables() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let (runs, errors) = (folder.file("x.csv", RUNS), folder.at("errors.toml"));
    let parsed = |text: &str| serde_json::from_str::<serde_json::Value>(text).unwrap();
    let said = json(&format!("iso230-2 {machine} {runs} -o {errors}"));
    assert!(said.is_array(), "{said}");
    let written = std::fs::read_to_string(&errors).unwrap();
    let line = written
        .lines()
        .find(|line| line.starts_with("standard_uncertainty"));
    let um: f64 = line
        .unwrap()
        .split('=')
        .nth(1)
        .unwrap()
        .trim()
        .parse()
        .unwrap();
    // 20 differences from means of three, pooled, with values as in the file.
    let readings = RUNS.lines().skip(5).map(|line| {
        let cells = line.split(',').skip(1).map(|v| v.parse::<f64>().unwrap());
        cells.collect::<Vec<f64>>()
    });
    let squares: f64 = readings
        .flat_map(|row| [0, 1].map(|k| [row[k], row[k + 2], row[k + 4]]))
        .map(|three| {
            let mean = three.iter().sum::<f64>() / 3.0;
            three.iter().map(|v| (v - mean).powi(2)).sum::<f64>()
        })
        .sum();
    // And the step of the display.
    let expected = libm::hypot((squares / 20.0 / 3.0).sqrt(), 0.1 / 12.0_f64.sqrt());
    // Four digits are written.
    assert!((um / expected - 1.0).abs() < 1e-3, "{um} {expected}");
    let blob = folder.at("x.trax");
    let compile = |errors: &str| {
        let arguments = ["compile", &machine, errors, "-o", &blob, "--random", "1000"];
        parsed(&answer(0, &[&arguments[..], &["--json"]].concat()))
    };
    let compiled = compile(&errors);
    let band = &compiled["uncertainty"];
    assert_eq!(
        (&band["tables"], &band["exact_tables"]),
        (&1.into(), &0.into())
    );
    let of = |what: &str| band["travel"]["translation_um"][what].as_f64().unwrap();
    // At a value 1.96 u, half way between two of them 1/√2 of that.
    let largest = 1.959_964 * um;
    assert!((0.99..1.000_001).contains(&(of("max") / largest)), "{band}");
    // The mean of √(t² + (1 − t)²); for 1000 positions it is accurate to 0.4 %; four times that.
    let mean = 0.5 * (1.0 + libm::asinh(1.0) / 2.0_f64.sqrt());
    assert!((of("mean") / largest / mean - 1.0).abs() < 0.015, "{band}");
    // Without it nothing is printed; together with a parameter it is mentioned.
    let without = written.replace(line.unwrap(), "");
    let exact = folder.file("exact.toml", &without);
    assert!(compile(&exact)["uncertainty"].is_null());
    let beside =
        format!("{without}[parameters]\nEC0X = 1e-5\n[standard_uncertainty]\nEC0X = 1e-6\n");
    let beside = folder.file("beside.toml", &beside);
    let said = done(&format!(
        "compile {machine} {beside} -o {blob} --random 1000 -v"
    ));
    assert!(
        said.contains("1 of 1 tabulated motions have no standard uncertainty, and count as exact"),
        "{said}"
    );
    // With one number for the backlash, both are more accurate than each value: by √2 and by √10.
    let arguments = ["iso230-2", &machine, &runs, "--one-number", "-o", &errors];
    answer(0, &arguments);
    let written = std::fs::read_to_string(&errors).unwrap();
    let of_values = written.split("[tabulated.EXX]").nth(1).unwrap();
    let of_backlash = written.split("[standard_uncertainty]").nth(1).unwrap();
    let of = |text: &str, name: &str| -> f64 {
        let line = text.lines().find(|line| line.starts_with(name)).unwrap();
        line.split('=').nth(1).unwrap().trim().parse().unwrap()
    };
    let known = [
        of(of_values, "standard_uncertainty"),
        1e3 * of(of_backlash, "EXXb"),
    ];
    for (known, part) in known.into_iter().zip([2.0_f64, 10.0]) {
        assert!(
            (known / expected * part.sqrt() - 1.0).abs() < 1e-3,
            "{written}"
        );
    }
}

#[test]
fn a_straightness_that_leans_beside_a_squareness_is_told_wherever_it_is_read() {
    let folder = Folder::new();
    let machine = example("router/machine.toml");
    let errors = |slope: f64, squareness: f64| {
        let text = format!(
            "machine = \"Router\"\n[parameters]\nEC0X = {squareness:e}\n[tabulated.EYX]\nat = [0.0, 400.0, 800.0]\nvalue = [0.0, 0.001, {:e}]\n",
            800.0 * slope
        );
        folder.file("errors.toml", text)
    };
    let blob = folder.at("x.trax");
    let said = |arguments: &[&str]| {
        let output = trueaxis(arguments);
        assert_eq!(output.status.code(), Some(0), "{}", plain(&output.stderr));
        plain(&output.stderr)
    };
    let leaning = errors(2e-5, 1e-5);
    let compile = [
        "compile", &machine, &leaning, "-o", &blob, "--random", "200",
    ];
    let verify = ["verify", &machine, &leaning, &blob, "--random", "200"];
    for arguments in [&compile[..], &verify[..], &["explain", &machine, &leaning]] {
        let said = said(arguments);
        for part in [
            "EYX leans by 20.0 µrad and EC0X is 10.0 µrad",
            "may be counted twice",
            "take the slope off the straightness, or leave",
        ] {
            assert!(said.contains(part), "{said}");
        }
    }
    let text = std::fs::read_to_string(&leaning).unwrap();
    let text = text.replace(
        "[parameters]",
        "slopes_beside_squareness = true\n[parameters]",
    );
    folder.file("errors.toml", text);
    assert!(!said(&compile).contains("counted twice"));
    // No warning without a slope, nor without a squareness.
    for (slope, squareness) in [(0.0, 1e-5), (2e-5, 0.0)] {
        errors(slope, squareness);
        let said = said(&compile);
        assert!(!said.contains("counted twice"), "{said}");
    }
}
