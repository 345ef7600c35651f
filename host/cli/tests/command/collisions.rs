//! Solids of machine and artefact: what `plan` and `linuxcnc probe` leave out, go around, and refuse.

use crate::program::{Folder, answer, example, plain, refused, trueaxis};

const TOUCHES: [&str; 4] = ["--ball-diameter", "20", "--stylus-diameter", "6"];

fn words<'a>(machine: &'a str, artefact: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let plan = [
        "plan",
        machine,
        "--artefact",
        artefact,
        "--model",
        "EC0X,EA0Z",
    ];
    [&plan[..], &TOUCHES, more].concat()
}

fn files() -> [String; 2] {
    ["machine-solids", "artefact"].map(|name| example(&format!("linuxcnc-xyzac-trt/{name}.toml")))
}

#[test]
fn rows_on_which_the_spindle_meets_the_cradle_are_not_planned() {
    let folder = Folder::new();
    let [machine, artefact] = files();
    let plain_machine = example("linuxcnc-xyzac-trt/machine.toml");
    let plan = folder.at("plan.csv");
    let program = folder.at("probe.ngc");
    // With C at 0 the ball is near an arm of the cradle, and the spindle is wide.
    let tilted = ["--plan", &plan, "--program", &program];
    folder.file(
        "plan.csv",
        "ball,A,C\nlow,0,90\nhigh,0,90\nlow,10,45\nlow,0,0\nlow,60,90\nhigh,60,90\n",
    );
    refused(
        &words(&machine, &artefact, &tilted),
        &[
            "line 5 of the plan",
            "`spindle` would pass `right arm of the cradle`",
            "1.0 mm are asked",
        ],
    );
    assert_eq!(folder.names(), ["plan.csv"]);
    // Without solids nothing is known of it.
    let bare = folder.file(
        "bare.toml",
        std::fs::read_to_string(&artefact)
            .unwrap()
            .lines()
            .filter(|line| {
                ["post", "shaft", "shank", "length"]
                    .iter()
                    .all(|w| !line.starts_with(w))
            })
            .collect::<Vec<_>>()
            .join("\n"),
    );
    answer(0, &words(&plain_machine, &bare, &tilted));
    // The planner takes other rows, if it knows.
    let proposed = folder.at("proposed.csv");
    let propose = [
        "--indexings",
        "A=-40:40:40,C=0:330:30",
        "--probings",
        "20",
        "-o",
        &proposed,
    ];
    let judge = ["--plan", &proposed, "--program", &program];
    answer(0, &words(&plain_machine, &bare, &propose));
    refused(&words(&machine, &artefact, &judge), &["`spindle` would"]);
    answer(0, &words(&machine, &artefact, &propose));
    answer(0, &words(&machine, &artefact, &judge));
}

/// A fixed pin in the way of a ball that turns with the table where it was touched, but not where it is touched next.
#[test]
fn axes_turn_where_that_is_clear() {
    let folder = Folder::new();
    let [machine, artefact] = files();
    let text = std::fs::read_to_string(machine).unwrap();
    let pin = |y: f64| {
        format!(
            "{text}\n[[solid]]\nname = \"pin\"\ncarried_by = \"foundation\"\nshape = \"capsule\"\n\
             diameter_mm = 4.0\nlength_mm = 300.0\norigin_mm = [60.0, {y:?}, -250.0]\n"
        )
    };
    let plan = folder.file(
        "plan.csv",
        "ball,A,C\nlow,0,90\nlow,0,-90\nlow,10,-90\nlow,-10,-90\n",
    );
    let program = folder.at("probe.ngc");
    let moves = |y: f64| -> Vec<String> {
        let machine = folder.file("machine.toml", pin(y));
        let more = ["--plan", &plan, "--program", &program];
        let output = trueaxis(&words(&machine, &artefact, &more));
        let said = plain(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{said}");
        let text = std::fs::read_to_string(&program).unwrap();
        let rapids = text.lines().filter(|line| line.starts_with("G0"));
        rapids.map(str::to_owned).collect()
    };
    let is_turn = |line: &String| line.contains("C-90");
    // The second turn of C: to the second row.
    let turn = |moves: &[String]| moves.iter().position(is_turn).unwrap();
    let usual = moves(-500.0);
    let around = moves(-40.0);
    assert_ne!(usual, around);
    // Usually it turns at once; now it moves before, to where it turns.
    let before = |moves: &[String]| moves[turn(moves) - 1].clone();
    assert_ne!(before(&usual), before(&around));
}
