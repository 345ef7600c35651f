//! `trueaxis qualify`: from simulated touches of one ball to a probe, and what later commands make of it.

use crate::program::{Folder, plain};
use serde_json::Value;

/// Lobes of 4.5 µm with three in a turn, and 6 µm less at the pole.
const PROBE: &str = "machine = \"Kolibri\"\ntip_radius_mm = 3.0\ntip_radius_standard_uncertainty_mm = 0.0\npole_mm = -0.006\n\
                     [[lobe]]\norder = 3\ncosine_mm = 0.004\nsine_mm = -0.002\nstandard_uncertainty_mm = 0.0\n";

const POSES: &str = "ball,A,C\n1,0,0\n1,30,0\n1,0,120\n";

/// Touches of a plan in the folder, by the probe that is in it.
fn simulate(folder: &Folder, plan: &str, log: &str, around: &str) {
    folder.file("truth.toml", PROBE);
    folder.answer(&format!(
        "simulate touches @kolibri/machine.toml @kolibri/errors-12.toml --artefact @kolibri/artefact.toml \
         --plan %{plan} --probe %truth.toml --noise 0.5 -o %{log} {around}"
    ));
}

const QUALIFY: &str = "qualify @kolibri/machine.toml --ball-diameter 20";

#[test]
fn lobes_are_found_and_taken_out_of_other_touches() {
    let folder = Folder::new();
    folder.file("poses.csv", POSES);
    simulate(&folder, "poses.csv", "ball.log", "--around 12");
    let found = folder.answer(&format!("{QUALIFY} %ball.log --json -o %probe.toml"));
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
    let file = folder.text("probe.toml");
    assert!(
        file.contains("z_mm") && !file.contains("z_standard"),
        "{file}"
    );
    // Other touches fit better.
    folder.file(
        "plan.csv",
        "ball,A,C\n1,0,0\n2,20,60\n3,-20,120\n4,40,200\n1,30,300\n",
    );
    simulate(&folder, "plan.csv", "touches.log", "");
    let probings = "probings @kolibri/machine.toml %touches.log --plan %plan.csv";
    let noise = |more: &str| -> f64 {
        let said = folder.answer(&format!("{probings} -o %probings.csv {more}"));
        let (_, rest) = said.split_once("noise of a touch ").unwrap();
        rest.split(' ').next().unwrap().parse().unwrap()
    };
    let (with, without) = (noise("--probe %probe.toml"), noise(""));
    assert!(2.0 * with < without, "{with} {without}");
    // Without diameters of its own the file's is taken.
    noise("--probe %probe.toml --ball-diameter 20");
    // Not of this ball, of too few touches, of another machine.
    let several = ["do not see one ball", "touches of one ball"];
    folder.refused(&format!("{QUALIFY} %touches.log"), &several);
    let ball = folder.text("ball.log");
    folder.file(
        "few.log",
        ball.split_inclusive('\n').take(3).collect::<String>(),
    );
    let few = ["3 touches are too few", "--around 12"];
    folder.refused(&format!("{QUALIFY} %few.log"), &few);
    folder.file("other.toml", PROBE.replace("Kolibri", "Huron"));
    let other = ["other.toml, line 1", "was qualified on `Huron`"];
    folder.refused(&format!("{probings} --probe %other.toml"), &other);
}

#[test]
fn a_wrong_touch_and_a_wrong_diameter_are_named() {
    let folder = Folder::new();
    folder.file("poses.csv", POSES);
    simulate(&folder, "poses.csv", "ball.log", "--around 12");
    let qualify = |ball: &str, diameter: &str| {
        let options = format!("--ball-diameter {diameter} --stylus-diameter 6");
        let output = folder.run(&format!("qualify @kolibri/machine.toml %{ball} {options}"));
        let said = plain(&[&output.stdout[..], &output.stderr[..]].concat());
        (output.status.code().unwrap(), said)
    };
    let (code, said) = qualify("ball.log", "20");
    assert!(code == 0 && said.contains("(from ball to tip)"), "{said}");
    // Without the diameter of the tip, nothing shows an error of that of the ball.
    let said = folder.answer(&format!("{QUALIFY} %ball.log"));
    let shown = "--stylus-diameter would show an error";
    assert!(said.contains(shown), "{said}");
    let (code, said) = qualify("ball.log", "19");
    assert!(code != 0 && said.contains("measure 26.0"), "{said}");
    // The touch of the fourth line, 30 µm farther along each linear axis.
    let text = folder.text("ball.log");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[3].split(' ').map(str::to_owned).collect();
    for cell in &mut cells[..3] {
        let value: f64 = cell.parse().unwrap();
        *cell = format!("{:.6}", value + 0.03);
    }
    lines[3] = cells.join(" ");
    folder.file("wrong.log", lines.join("\n") + "\n");
    let (code, said) = qualify("wrong.log", "20");
    let named = "warning: line 4: this touch is ";
    assert!(code == 1 && said.contains(named), "{said}");
}
