//! The schemes of the source document, as a user runs them.

use crate::program::{Folder, answer, example, plain, refused, split, trueaxis};
use serde_json::Value;
use trueaxis_tables::target::Target;

/// Compiles the Kolibri with ten errors into `k.trax` and returns standard error. Checks that it exits with `code`.
#[track_caller]
fn compile(folder: &Folder, code: i32, more: &[&str]) -> (String, String) {
    let (machine, errors, out) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
        folder.at("k.trax"),
    );
    let first = ["compile", &machine, &errors, "-o", &out, "--random", "500"];
    let output = trueaxis(&[&first[..], more].concat());
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    (String::from_utf8(output.stdout).unwrap(), said)
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

#[test]
fn a_grid_that_leaves_a_machine_worse_than_nothing_is_written_with_the_figures() {
    let folder = Folder::new();
    let grid = ["--scheme", "grid3d", "--policy", "orientation"];
    let (shown, said) = compile(&folder, 0, &[&grid[..], &["--json"]].concat());
    let told = json(&shown);
    assert_eq!(told["written"], true);
    assert_eq!(told["scheme"], "grid3d");
    // It is accurate where its rotary axes are.
    assert_eq!(told["held"]["axes"], json(r#"[["A", 0.0], ["C", 0.0]]"#));
    let largest = |of: &Value| of["translation_um"]["max"].as_f64().unwrap();
    assert!(largest(&told["held"]["after"]) < 0.01);
    assert_eq!(told["meets_tolerance"], true);
    let [before, after] = [largest(&told["before"]), largest(&told["after"])];
    assert!(after > before, "{before} {after}");
    let worse = "warning: the largest translation is worse after than before";
    assert!(said.contains(worse), "{said}");
    assert!(said.contains("for A = 0, C = 0 alone"), "{said}");
    assert_eq!(folder.names(), ["k.trax"]);
    // `verify` finds the same: only there.
    let (machine, errors, grid) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
        folder.at("k.trax"),
    );
    let verify = ["verify", &machine, &errors, &grid, "--random", "500"];
    answer(1, &verify);
    answer(0, &[&verify[..], &["--rotary", "A=0,C=0"]].concat());
    answer(1, &[&verify[..], &["--rotary", "A=50"]].concat());
}

#[test]
fn there_is_a_grid_for_each_position_of_the_rotary_axes_or_none() {
    let folder = Folder::new();
    let grid = [
        "--scheme",
        "grid3d",
        "--policy",
        "position",
        "--allow-large",
    ];
    let two = ["--rotary", "A=-30", "--rotary", "A=30,C=90"];
    let (shown, _) = compile(&folder, 0, &[&grid[..], &two, &["--json"]].concat());
    assert_eq!(folder.names(), ["k-A-30-C0.trax", "k-A30-C90.trax"]);
    for one in json(&shown).as_array().unwrap() {
        let left = &one["held"]["after"]["translation_um"]["max"];
        assert!(left.as_f64().unwrap() < 0.01);
    }
    // One of them does not fit, so none is written.
    let mut target = Target::stm32f405();
    target.bytes = Some(200);
    let small = folder.file("small.toml", target.to_toml());
    for name in ["k-A-30-C0.trax", "k-A30-C90.trax"] {
        std::fs::remove_file(folder.at(name)).unwrap();
    }
    let (_, said) = compile(
        &folder,
        1,
        &[&grid[..], &two, &["--target", &small]].concat(),
    );
    assert!(
        said.contains("bytes are needed, there is room for 200"),
        "{said}"
    );
    assert!(said.contains("raise --threshold"), "{said}");
    assert_eq!(folder.names(), ["small.toml"]);
    let twice = ["--rotary", "A=30", "--rotary", "C=0,A=30"];
    let (_, said) = compile(&folder, 2, &[&grid[..], &twice].concat());
    assert!(said.contains("--rotary: A30-C0 is given twice"), "{said}");
}

#[test]
fn a_scheme_says_by_how_much_it_misses_the_tolerance_and_is_written() {
    let folder = Folder::new();
    let poly25 = ["--scheme", "poly25", "--policy", "orientation"];
    let (shown, said) = compile(&folder, 0, &[&poly25[..], &["--json"]].concat());
    let answer = json(&shown);
    assert_eq!(
        (&answer["written"], &answer["meets_tolerance"]),
        (&true.into(), &false.into())
    );
    assert_eq!(answer["refusals"].as_array().unwrap().len(), 0);
    let missed = answer["missed"].as_array().unwrap();
    let missed = missed.iter().find(|m| m["kind"] == "tolerance").unwrap();
    assert!(missed["reached_um"].as_f64().unwrap() > 10.0);
    let text = "warning: the tolerance of 0.05 µm and µrad is not met:";
    assert!(said.contains(text), "{said}");
}

#[test]
fn what_a_scheme_cannot_do_is_refused_with_what_would_work() {
    let mill = [
        example("mill-21/machine.toml"),
        example("mill-21/errors-21.toml"),
    ];
    let folder = Folder::new();
    let out = folder.at("m.trax");
    for scheme in ["poly25", "trigo23", "trigo23:free"] {
        refused(
            &split(&format!(
                "compile {} {} -o {out} --scheme {scheme}",
                mill[0], mill[1]
            )),
            &[
                "needs three linear and two rotary axes: this machine has 3 linear and 0 rotary axes",
                "use --scheme exact",
            ],
        );
    }
    let nodes = [
        "--scheme",
        "grid3d",
        "--max-nodes",
        "3",
        "--threshold",
        "0.01",
    ];
    refused(
        &[&["compile", &mill[0], &mill[1], "-o", &out][..], &nodes].concat(),
        &[
            "with 3 nodes along each axis the threshold of 0.01 µm is not met",
            "raise --threshold above that, or --max-nodes",
        ],
    );
    for (more, parts) in [
        (
            &["--scheme", "poly25", "--threshold", "1"][..],
            [
                "--threshold is given, but --scheme poly25 knows nothing of it",
                "use --scheme grid3d",
            ],
        ),
        (
            &["--scheme", "grid3d", "--minimize", "tables"],
            [
                "--minimize is given, but --scheme grid3d",
                "use --scheme exact",
            ],
        ),
        (
            &["--scheme", "grid3d", "--points", "9"],
            [
                "--points is given, but --scheme grid3d has no tables",
                "--max-nodes",
            ],
        ),
        (
            &["--scheme", "grid3d", "--rotary", "A=500"],
            ["--rotary: the machine has no axis `A`", "write a position"],
        ),
    ] {
        refused(
            &[&["compile", &mill[0], &mill[1], "-o", &out][..], more].concat(),
            &parts,
        );
    }
    assert_eq!(folder.names(), [""; 0]);
    let mut target = Target::stm32f405();
    target.tables = 20;
    let small = folder.file("small.toml", target.to_toml());
    for (scheme, tables) in [("poly25", 25), ("trigo23", 23)] {
        let (_, said) = compile(&folder, 1, &["--scheme", scheme, "--target", &small]);
        assert!(
            said.contains(&format!("{tables} tables are needed, there is room for 20")),
            "{said}"
        );
        assert!(
            said.contains("use --scheme exact, which keeps to its target"),
            "{said}"
        );
    }
    assert_eq!(folder.names(), ["small.toml"]);
}

#[test]
fn an_unknown_scheme_is_refused_with_those_that_there_are() {
    let folder = Folder::new();
    let (_, said) = compile(&folder, 2, &["--scheme", "trigo24"]);
    assert!(
        said.contains("write one of exact, grid3d, poly25, trigo23, trigo23:free"),
        "{said}"
    );
}

#[test]
fn schemes_side_by_side_have_the_figures_of_each_by_itself() {
    let folder = Folder::new();
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-10.toml"),
    );
    let more = ["--random", "500", "--policy", "orientation", "--json"];
    let side_by_side = json(&answer(
        0,
        &[&["schemes", &machine, &errors][..], &more].concat(),
    ));
    let schemes = side_by_side["schemes"].as_array().unwrap();
    assert!(schemes.len() >= 5);
    for one in schemes {
        let name = one["scheme"].as_str().unwrap();
        let (alone, _) = compile(&folder, 0, &[&["--scheme", name][..], &more[2..]].concat());
        let alone = json(&alone);
        for key in [
            "tables",
            "terms",
            "samples",
            "bytes",
            "after",
            "meets_tolerance",
        ] {
            assert_eq!(one[key], alone[key], "{name} {key}");
        }
        let gone = one["compensability"].as_object().unwrap();
        assert_eq!(gone.len(), 10, "{name}");
        if name == "exact" {
            for (parameter, part) in gone {
                assert!(part.as_f64().unwrap() > 0.99, "{parameter} {part}");
            }
        }
    }
}

#[test]
fn schemes_that_cannot_do_a_machine_are_listed_with_the_reason() {
    let (machine, errors) = (
        example("mill-21/machine.toml"),
        example("mill-21/errors-21.toml"),
    );
    let text = answer(0, &["schemes", &machine, &errors, "--random", "300"]);
    let reason = "poly25: cannot do this machine: poly25 needs three linear and two rotary axes";
    assert!(text.contains(reason), "{text}");
    let tables_only = [
        example("five-axis-30/machine.toml"),
        example("five-axis-30/errors-30.toml"),
    ];
    let line = format!(
        "schemes {} {} --random 300 --tolerance 5",
        tables_only[0], tables_only[1]
    );
    let arguments = split(&line);
    let text = answer(0, &arguments);
    let reason = "no compensability: the error file has no parameters";
    assert_eq!(text.matches(reason).count(), 1, "{text}");
}

#[test]
fn each_error_by_itself_takes_the_tables_that_its_closed_form_has() {
    let (machine, errors) = (
        example("huron-k2x8/machine.toml"),
        example("huron-k2x8/errors-13.toml"),
    );
    let arguments = [
        "schemes",
        &machine,
        &errors,
        "--single",
        "--policy",
        "orientation",
        "--random",
        "300",
    ];
    let found = json(&answer(0, &[&arguments[..], &["--json"]].concat()));
    let single = found["single"].as_array().unwrap();
    assert_eq!(single.len(), 13);
    for one in single {
        for scheme in ["exact", "fik"] {
            let takes = &one["schemes"][scheme];
            let left = takes["largest_after_um"].as_f64().unwrap();
            // The tolerance at the tip; fik has second order and the bends between its points besides.
            assert!(left < if scheme == "exact" { 0.1 } else { 0.5 }, "{one}");
            assert!(takes["tables"].as_u64().unwrap() <= 14, "{one}");
        }
        // An offset of the spindle along Z, as it is.
        if one["parameter"] == "EZ0S" {
            let before = one["before_um"].as_f64().unwrap();
            assert!((before - 55.6).abs() < 0.05, "{one}");
        }
    }
    let scale = single
        .iter()
        .find(|one| one["parameter"] == "EXX1")
        .unwrap();
    // X times a constant.
    assert_eq!(scale["schemes"]["exact"]["tables"], 1, "{scale}");
    assert_eq!(scale["schemes"]["exact"]["terms"], 1, "{scale}");
    let text = answer(0, &arguments);
    assert!(text.contains("each error by itself"), "{text}");
    assert_eq!(
        text.lines().filter(|l| l.starts_with('E')).count(),
        13,
        "{text}"
    );
    // A machine that fik does not know.
    let text = answer(
        0,
        &[
            "schemes",
            &example("router/machine.toml"),
            &example("router/errors-10.toml"),
            "--single",
            "--random",
            "100",
        ],
    );
    assert!(
        text.contains("fik: fik needs two or three rotary axes"),
        "{text}"
    );
}

#[test]
fn a_grid_may_be_over_any_three_axes() {
    let folder = Folder::new();
    let grid = [
        "--scheme",
        "grid3d",
        "--policy",
        "position",
        "--inputs",
        "x,Y,C",
        "--rotary",
        "A=20,Z=150",
        "--json",
    ];
    let (shown, _) = compile(&folder, 0, &grid);
    let held = json(&shown);
    let axes: Vec<&str> = (held["held"]["axes"].as_array().unwrap().iter())
        .map(|axis| axis[0].as_str().unwrap())
        .collect();
    assert_eq!(axes, ["A", "Z"], "{held}");
    for (given, part) in [
        ("X,Y", "a grid has three axes, not 2"),
        ("X,Y,B", "the machine has no axis `B`"),
        ("X,C,X", "X is named twice"),
    ] {
        let more = ["--scheme", "grid3d", "--inputs", given];
        let (_, said) = compile(&folder, 2, &more);
        assert!(said.contains(part), "{said}");
    }
    let (_, said) = compile(&folder, 2, &["--inputs", "X,Y,C"]);
    assert!(
        said.contains("--inputs is given, but --scheme exact"),
        "{said}"
    );
}
