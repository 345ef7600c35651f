//! `export isg`, `heidenhain` and `fanuc`, `import isg`: their files, and what they leave.

use crate::program::{Folder, answer, blob, done, example, has, plain, refused, split, trueaxis};

#[test]
fn errors_for_a_control_with_a_model_are_written_and_read_again() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine", "errors-13"].map(|f| example(&format!("huron-k2x8/{f}.toml")));
    let csv = folder.at("huron.csv");
    let words = [
        "export", "isg", &machine, &errors, "-o", &csv, "--random", "1000",
    ];
    let said = answer(0, &words);
    assert!(
        said.contains("which the control does not correct"),
        "{said}"
    );
    let again = folder.at("again.toml");
    answer(
        0,
        &["import", "isg", &csv, "--machine", &machine, "-o", &again],
    );
    // The same errors in other words leave as much.
    let words = [
        "export", "isg", &machine, &again, "-o", &csv, "--random", "1000", "--json",
    ];
    let json: serde_json::Value = serde_json::from_str(&answer(0, &words)).unwrap();
    assert!(json["tip_before_um"].as_f64().unwrap() > 100.0, "{json}");
    assert!(json["tip_um"].as_f64().unwrap() < 0.5, "{json}");
    refused(
        &[
            "import",
            "isg",
            &machine,
            "--machine",
            &machine,
            "-o",
            &again,
        ],
        &["machine.toml, line"],
    );
    // What moves only the datum is left out, and said; a misspelt name is not.
    let csv = folder.file("measured.csv", "A0X A0Y\n1e-4 2e-5\n");
    let import = format!("import isg {csv} --machine {machine} -o {again}");
    let said = done(&import);
    has(
        &said,
        "not imported, because it moves only the datum: A0X\n",
    );
    folder.file("measured.csv", "PITCH A0Y\n1e-4 2e-5\n");
    refused(&split(&import), &["line 1", "`PITCH` is neither"]);
}

#[test]
fn backlash_is_left_and_said() {
    let folder = Folder::new();
    let [machine, errors] = ["machine", "errors-10"].map(|f| example(&format!("router/{f}.toml")));
    let to = folder.path().to_str().unwrap();
    let words = [
        "export",
        "heidenhain",
        &machine,
        &errors,
        "--angles",
        "deg",
        "-o",
        to,
        "--random",
        "500",
    ];
    let done = trueaxis(&words);
    assert_eq!(done.status.code(), Some(1));
    let said = plain(&done.stderr);
    has(&said, "nothing is written (--best-effort would)");
    assert!(folder.names().is_empty());
    trueaxis(&[&words[..], &["--best-effort"]].concat());
    assert_eq!(folder.names(), ["X.csv", "Y.csv", "Z.csv"]);
    // The unit is not guessed.
    let done = trueaxis(&["export", "heidenhain", &machine, &errors, "-o", to]);
    assert_eq!(done.status.code(), Some(2));
    assert!(plain(&done.stderr).contains("--angles"));
}

#[test]
fn a_grid_says_what_rotary_axes_leave() {
    let folder = Folder::new();
    let (blob, to) = (blob("huron"), folder.at("grid.csv"));
    let words = [
        "export", "fanuc", &blob, "-o", &to, "--points", "5,5,5", "--random", "500",
    ];
    let done = trueaxis(&words);
    assert_eq!(done.status.code(), Some(1));
    assert!(plain(&done.stderr).contains("--at holds rotary axes"));
    let words = [
        &words[..],
        &["--unit", "0.0001", "--tolerance", "200", "--json"],
    ]
    .concat();
    let at = |at: &str| -> f64 {
        let said = answer(0, &[&words[..], &["--at", at]].concat());
        let json: serde_json::Value = serde_json::from_str(&said).unwrap();
        let linear = json["axes"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|a| a["unit"] == "µm");
        linear
            .map(|a| a["difference"].as_f64().unwrap())
            .fold(0.0, f64::max)
    };
    // Steps of 0.2 µm, and tables within 0.05 µm between a few points.
    assert!(at("A=0,C=0") < 1.0);
    let grid = std::fs::read_to_string(&to).unwrap();
    let head = grid.lines().next().unwrap();
    assert!(head.ends_with("corrections, only for A0 C0"), "{head}");
    for (option, value, says) in [
        ("--at", "Q=0", "Q is not an axis"),
        ("--at", "A:0", "`A:0` is not an axis"),
        ("--at", "A=33,a=40,C=0", "--at has A twice"),
        ("--at", "A=900", "A=900 is outside of the travel"),
        ("--unit", "0.0000001", "detection unit"),
    ] {
        refused(
            &[
                "export", "fanuc", &blob, "-o", &to, "--points", "2,2,2", option, value,
            ],
            &[says],
        );
    }
}
