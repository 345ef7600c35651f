//! Error motions of an axis of rotation to ISO 230-7.

use crate::program::{Folder, example};

#[test]
fn values_and_polar_plots_of_a_spindle_are_written() {
    let folder = Folder::new();
    let said = folder.answer("iso230-7 @spindle/turns.csv --pictures %plots");
    let head = "(ISO 230-7)\n8 turns with 72 angles\n";
    assert!(said.contains(head), "{said}");
    let json = folder.answer("iso230-7 @spindle/turns.csv --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let all = json["error_motions"].as_array().unwrap();
    assert_eq!(all.len(), 10);
    for one in all {
        let [total, synchronous, asynchronous] =
            ["total", "synchronous", "asynchronous"].map(|key| one[key].as_f64().unwrap());
        // The total contains the others, and is contained in their sum.
        assert!(total >= synchronous.max(asynchronous), "{one}");
        assert!(total <= synchronous + 2.0 * asynchronous, "{one}");
        let axial = one["name"] == "axial";
        assert_eq!(one["off_centre"].is_null(), axial, "{one}");
    }
    // The artefact is 12 µm off centre, of which nothing is left.
    assert!((all[0]["off_centre"].as_f64().unwrap() - 12.0).abs() < 0.1);
    for name in [
        "radial-x1-fixed",
        "radial-1-rotating",
        "tilt-rotating",
        "axial",
    ] {
        let picture = folder.text(&format!("plots/{name}.svg"));
        assert!(
            picture.contains("synchronous") && picture.contains("90°"),
            "{name}"
        );
    }
}

#[test]
fn turns_that_are_not_whole_are_refused() {
    let folder = Folder::new();
    let text = std::fs::read_to_string(example("spindle/turns.csv")).unwrap();
    let cut = text.rsplit_once("\n8,355").unwrap().0.to_owned() + "\n";
    folder.file("cut.csv", cut);
    let parts = ["cut.csv", "turn 8 lacks the angle 355°", "by the encoder"];
    folder.refused("iso230-7 %cut.csv", &parts);
    folder.file("twice.csv", format!("{text}8,355,0,0,0,0,0\n"));
    let parts = [
        "twice.csv",
        "turn 8 has this angle twice",
        "number of its own",
    ];
    folder.refused("iso230-7 %twice.csv", &parts);
}
