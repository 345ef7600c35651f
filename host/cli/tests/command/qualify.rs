//! `trueaxis qualify`: from simulated touches of one ball to a probe, and what later commands make of it.

use crate::program::{Folder, answer, example, plain, refused, trueaxis};
use serde_json::Value;

/// Lobes of 4.5 µm with three in a turn, and 6 µm less at the pole.
const PROBE: &str = "machine = \"Kolibri\"\ntip_radius_mm = 3.0\ntip_radius_standard_uncertainty_mm = 0.0\npole_mm = -0.006\n\
                     [[lobe]]\norder = 3\ncosine_mm = 0.004\nsine_mm = -0.002\nstandard_uncertainty_mm = 0.0\n";

fn simulate(folder: &Folder, plan: &str, log: &str, around: &[&str]) {
    let files = ["machine.toml", "errors-12.toml", "artefact.toml"];
    let [machine, errors, artefact] = files.map(|name| example(&format!("kolibri/{name}")));
    let probe = folder.at("truth.toml");
    let words = [
        "simulate",
        "touches",
        &machine,
        &errors,
        "--artefact",
        &artefact,
    ];
    let more = [
        "--plan", plan, "--probe", &probe, "--noise", "0.5", "-o", log,
    ];
    answer(0, &[&words[..], &more, around].concat());
}

#[test]
fn lobes_are_found_and_taken_out_of_other_touches() {
    let folder = Folder::new();
    folder.file("truth.toml", PROBE);
    let machine = example("kolibri/machine.toml");
    let poses = folder.file("poses.csv", "ball,A,C\n1,0,0\n1,30,0\n1,0,120\n");
    let (ball, probe) = (folder.at("ball.log"), folder.at("probe.toml"));
    simulate(&folder, &poses, &ball, &["--around", "12"]);
    let qualify = ["qualify", &machine, &ball, "--ball-diameter", "20"];
    let found = answer(0, &[&qualify[..], &["--json", "-o", &probe]].concat());
    let found: Value = serde_json::from_str(&found).unwrap();
    let number = |value: &Value| value.as_f64().unwrap();
    let third = &found["lobes"][1];
    assert_eq!(third["order"], 3);
    let standard = number(&third["standard_uncertainty_um"]);
    for (name, truth) in [("cosine_um", 4.0), ("sine_um", -2.0)] {
        let off = number(&third[name]) - truth;
        assert!(standard < 0.5 && off.abs() < 4.0 * standard, "{found}");
    }
    // Scales of up to 0.6 mm/m on 13 mm.
    assert!(
        (number(&found["tip_radius_mm"]) - 3.0).abs() < 6e-3,
        "{found}"
    );
    // The machine's errors make the ball wander, and they do not count as known of the tip.
    assert!(number(&found["ball_apart_um"]) > 20.0, "{found}");
    let file = std::fs::read_to_string(&probe).unwrap();
    assert!(
        file.contains("z_mm") && !file.contains("z_standard"),
        "{file}"
    );
    // Other touches fit better.
    let plan = folder.file(
        "plan.csv",
        "ball,A,C\n1,0,0\n2,20,60\n3,-20,120\n4,40,200\n1,30,300\n",
    );
    let log = folder.at("touches.log");
    simulate(&folder, &plan, &log, &[]);
    let noise = |more: &[&str]| -> f64 {
        let out = folder.at("probings.csv");
        let words = ["probings", &machine, &log, "--plan", &plan, "-o", &out];
        let said = answer(0, &[&words[..], more].concat());
        let (_, rest) = said.split_once("noise of a touch ").unwrap();
        rest.split(' ').next().unwrap().parse().unwrap()
    };
    let (with, without) = (noise(&["--probe", &probe]), noise(&[]));
    assert!(2.0 * with < without, "{with} {without}");
    // Without diameters of its own the file's is taken.
    noise(&["--probe", &probe, "--ball-diameter", "20"]);
    // Not of this ball, of too few touches, of another machine.
    refused(
        &["qualify", &machine, &log, "--ball-diameter", "20"],
        &["do not see one ball", "touches of one ball"],
    );
    let few: Vec<String> = std::fs::read_to_string(&ball)
        .unwrap()
        .lines()
        .take(3)
        .map(|line| format!("{line}\n"))
        .collect();
    let few = folder.file("few.log", few.concat());
    refused(
        &["qualify", &machine, &few, "--ball-diameter", "20"],
        &["3 touches are too few", "--around 12"],
    );
    let other = folder.file("other.toml", PROBE.replace("Kolibri", "Huron"));
    refused(
        &[
            "probings", &machine, &log, "--plan", &plan, "--probe", &other,
        ],
        &["other.toml, line 1", "was qualified on `Huron`"],
    );
}

#[test]
fn a_wrong_touch_and_a_wrong_diameter_are_named() {
    let folder = Folder::new();
    folder.file("truth.toml", PROBE);
    let machine = example("kolibri/machine.toml");
    let poses = folder.file("poses.csv", "ball,A,C\n1,0,0\n1,30,0\n1,0,120\n");
    let ball = folder.at("ball.log");
    simulate(&folder, &poses, &ball, &["--around", "12"]);
    let qualify = |ball: &str, diameter: &str| {
        let words = ["qualify", &machine, ball, "--ball-diameter", diameter];
        let output = trueaxis(&[&words[..], &["--stylus-diameter", "6"]].concat());
        let said = plain(&[&output.stdout[..], &output.stderr[..]].concat());
        (output.status.code().unwrap(), said)
    };
    let (code, said) = qualify(&ball, "20");
    assert!(code == 0 && said.contains("(from ball to tip)"), "{said}");
    // Without the diameter of the tip, nothing shows an error of that of the ball.
    let said = answer(0, &["qualify", &machine, &ball, "--ball-diameter", "20"]);
    assert!(
        said.contains("--stylus-diameter would show an error"),
        "{said}"
    );
    let (code, said) = qualify(&ball, "19");
    assert!(code != 0 && said.contains("measure 26.0"), "{said}");
    // The touch of the fourth line, 30 µm farther along each linear axis.
    let text = std::fs::read_to_string(&ball).unwrap();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[3].split(' ').map(str::to_owned).collect();
    for cell in &mut cells[..3] {
        let value: f64 = cell.parse().unwrap();
        *cell = format!("{:.6}", value + 0.03);
    }
    lines[3] = cells.join(" ");
    let wrong = folder.file("wrong.log", lines.join("\n") + "\n");
    let (code, said) = qualify(&wrong, "20");
    let named = "warning: line 4: this touch is ";
    assert!(code == 1 && said.contains(named), "{said}");
}
