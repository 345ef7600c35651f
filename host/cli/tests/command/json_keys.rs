//! The keys of what commands print with `--json`, which programs of users rely on.

use crate::identify::{probings, probings_of};
use crate::observations::observations;
use crate::program::{Folder, answer, blob, example};
use serde_json::Value;
use std::collections::BTreeSet;

/// Every key with the keys that it stands in; elements of a list are one.
fn keys(value: &Value, place: &str, all: &mut BTreeSet<String>) {
    match value {
        Value::Object(object) => {
            for (key, value) in object {
                let place = format!("{place}.{key}");
                keys(value, &place, all);
                all.insert(place);
            }
        }
        Value::Array(array) => array
            .iter()
            .for_each(|value| keys(value, &format!("{place}[]"), all)),
        _ => {}
    }
}

const RUNS: &str = "# axis = \"X\"\n# reads = \"tool +X\"\n# unit = \"um\"\n# at = { Y = 100.0, Z = -40.0 }\n\
target,+1,-1,+2,-2,+3,-3,+4,-4,+5,-5\n0,0.1,-1.2,0.0,-1.3,0.1,-1.2,0.0,-1.3,0.1,-1.1\n\
100,2.2,1.0,2.1,1.1,2.2,1.0,2.1,1.1,2.2,1.0\n200,3.2,2.0,3.1,2.1,3.2,2.0,3.1,2.1,3.2,2.0\n\
300,3.2,2.0,3.1,2.1,3.2,2.0,3.1,2.1,3.2,2.0\n400,3.2,2.0,3.1,2.1,3.2,2.0,3.1,2.1,3.2,2.0\n";

#[test]
fn keys_of_json_stay_what_they_are() {
    let folder = Folder::new();
    let (observed, kolibri) = (
        observations(&folder, &["--seed", "2"]),
        example("kolibri/machine.toml"),
    );
    let probed = probings(&folder, &[]);
    let file = |path: &str| example(path);
    let (huron, errors) = (
        file("huron-k2x8/machine.toml"),
        file("huron-k2x8/errors-13.toml"),
    );
    let (mill, mill_errors) = (file("mill-21/machine.toml"), file("mill-21/errors-21.toml"));
    let (artefact, after) = (
        file("kolibri/artefact.toml"),
        file("kolibri/errors-10.toml"),
    );
    let warming = ["machine.toml", "points.csv", "temperatures.csv"]
        .map(|f| file(&format!("mill-warming/{f}")));
    let runs = folder.file("x.csv", RUNS);
    let (out, page) = (folder.at("out.trax"), folder.at("again.csv"));
    let compiled = blob("huron");
    let plan = file("kolibri/plan.csv");
    let few: String = {
        let all = std::fs::read_to_string(&plan).unwrap();
        all.lines()
            .take(22)
            .map(|line| line.to_owned() + "\n")
            .collect()
    };
    let few = folder.file("few.csv", few);
    let own = Folder::new();
    let few = probings_of(&own, &few, &[]);
    let circle = folder.at("circle.csv");
    answer(
        0,
        &[
            "ballbar",
            "simulate",
            &mill,
            &mill_errors,
            "--steps",
            "180",
            "--at",
            "X=200,Y=150,Z=-200",
            "-o",
            &circle,
        ],
    );
    let (turns, drift) = (file("spindle/turns.csv"), file("thermal-drift/spindle.csv"));
    let commands: &[(i32, &[&str])] = &[
        (
            0,
            &["identify", &kolibri, &probed, "--observations", &observed],
        ),
        (
            0,
            &[
                "identify",
                &kolibri,
                &probed,
                "--model",
                "10",
                "--artefact",
                &artefact,
                "--before",
                &after,
            ],
        ),
        (0, &["identify", &kolibri, &few, "--model", "13"]),
        (
            0,
            &[
                "identify",
                &warming[0],
                "--observations",
                &warming[1],
                "--temperatures",
                &warming[2],
                "--model",
                "EXX1,EYY1,EZZ1,EC0Y,EA0Z,EB0Z,EX0S,EY0S,EZ0S",
            ],
        ),
        (
            0,
            &["compile", &huron, &errors, "-o", &out, "--random", "500"],
        ),
        (
            1,
            &[
                "compile", &huron, &errors, "-o", &out, "--random", "500", "--points", "2",
            ],
        ),
        (
            0,
            &["verify", &huron, &errors, &compiled, "--random", "500"],
        ),
        (0, &["inspect", &compiled]),
        (0, &["report", &huron, &errors, "--random", "500"]),
        (0, &["schemes", &huron, &errors, "--random", "500"]),
        (0, &["pose", &huron, &errors, "--at", "X=10"]),
        (0, &["explain", &huron, &errors]),
        (
            0,
            &[
                "plan",
                &kolibri,
                "--artefact",
                &artefact,
                "--model",
                "12",
                "--probings",
                "30",
                "-o",
                &page,
            ],
        ),
        (0, &["measured", &mill, &runs]),
        (0, &["iso230-2", &mill, &runs]),
        (0, &["iso230-3", &drift, "--at", "150"]),
        (0, &["iso230-7", &turns]),
        (0, &["ballbar", "analyse", &circle]),
    ];
    let mut text = String::new();
    for (code, words) in commands {
        let said = answer(*code, &[words, &["--json"][..]].concat());
        let mut all = BTreeSet::new();
        keys(&serde_json::from_str(&said).unwrap(), "", &mut all);
        let options = words.iter().filter(|word| word.starts_with("--"));
        let options: Vec<&str> = options.copied().collect();
        text += &format!("{} {}\n", words[0], options.join(" "));
        for key in all {
            text += &format!("  {key}\n");
        }
    }
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/command/json_keys.txt");
    if std::env::var_os("UPDATE_KEYS").is_some() {
        std::fs::write(path, &text).unwrap();
    }
    let frozen = std::fs::read_to_string(path).unwrap_or_default();
    let changed: Vec<&str> = text
        .lines()
        .filter(|line| !frozen.contains(line))
        .chain(frozen.lines().filter(|line| !text.contains(line)))
        .collect();
    assert!(
        text == frozen,
        "write them with UPDATE_KEYS=1, and list what changes in the changelog: {changed:?}"
    );
}
