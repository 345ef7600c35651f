//! The calibration report: one example as it is read, what is missing, hostile text, limits, and messages about bad input.

use crate::identify::probings;
use crate::program::{Folder, answer, blob, done, example, refused, split, trueaxis};
use serde_json::Value;
use trueaxis_tests::shown::same;

/// The files of a calibration of the Kolibri: error parameters and the identification.
fn kolibri(folder: &Folder) -> [String; 3] {
    let machine = example("kolibri/machine.toml");
    let artefact = example("kolibri/artefact.toml");
    let (probings, errors) = (probings(folder, &["--seed", "3"]), folder.at("errors.toml"));
    let found = done(&format!(
        "identify {machine} {probings} --artefact {artefact} --model 10 -o {errors} \
             --json"
    ));
    [machine, errors, folder.file("found.json", found)]
}

const VALIDATION: &str = r#"{ "probings": 10, "before": { "rms_um": 61.2, "largest_um": 88.0 },
    "after": { "rms_um": 2.4, "largest_um": 3.9 }, "probing_um": 1.8, "coverage_um": 1.2, "expected_um": 2.9,
    "is_kept": true }"#;

/// Writes a calibration report; checks that it exits with `code`, and returns the page and what was printed.
fn certificate(folder: &Folder, code: i32, arguments: &[&str]) -> [String; 2] {
    let out = folder.at("calibration.html");
    let start = ["report", "--calibration-report", "-o", &out];
    let said = answer(code, &[&start, arguments].concat());
    [std::fs::read_to_string(out).unwrap(), said]
}

/// What is read on a page, a line for each line of its source that has words.
fn read(page: &str) -> String {
    let mut text = String::new();
    let (mut is_tag, mut is_picture) = (false, false);
    let main = &page[page.find("<main>").unwrap()..page.find("</main>").unwrap()];
    for (at, c) in main.char_indices() {
        is_picture |= main[at..].starts_with("<svg");
        is_picture &= !main[..at].ends_with("</svg>");
        match c {
            '<' => is_tag = true,
            '>' => {
                is_tag = false;
                text.push(' ');
            }
            _ if is_tag || is_picture => {}
            _ => text.push(c),
        }
    }
    let lines = text
        .lines()
        .map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
    let lines: Vec<String> = lines.filter(|line| !line.is_empty()).collect();
    lines.join("\n").replace("&#x2f;", "/") + "\n"
}

#[test]
fn a_certificate_is_read_as_it_was_approved() {
    let folder = Folder::new();
    let [machine, errors, found] = kolibri(&folder);
    let validation = folder.file("validation.json", VALIDATION);
    let [page, said] = certificate(
        &folder,
        1,
        &[
            &machine,
            &errors,
            "--calibration",
            &example("kolibri/calibration.toml"),
            "--identification",
            &found,
            "--validation",
            &validation,
            "--date",
            "2026-11-26",
        ],
    );
    // Checksums and lengths of files depend on the last bit, their names on where they are.
    let text = read(&page);
    let text = &text[..text.find("Files\n").unwrap()];
    let golden = format!(
        "{}/tests/command/certificate.txt",
        env!("CARGO_MANIFEST_DIR")
    );
    if std::env::var_os("UPDATE_CERTIFICATE").is_some() {
        std::fs::write(&golden, text).unwrap();
    }
    let approved = std::fs::read_to_string(&golden).unwrap();
    for (approved, line) in approved.lines().zip(text.lines()) {
        assert!(same(line, approved, 0.0), "{approved}\n{line}");
    }
    assert_eq!(approved.lines().count(), text.lines().count());
    assert!(said.contains("No compensation is given"), "{said}");
    assert!(page.matches("<svg").count() == 2 && !page.contains("<script"));
    for address in ["http", "src=", "url(", "@import"] {
        assert!(!page.contains(address), "{address}");
    }
}

#[test]
fn a_certificate_without_statements_says_what_is_missing_and_nothing_about_conformity() {
    let folder = Folder::new();
    let files = ["machine", "errors-13"].map(|name| example(&format!("huron-k2x8/{name}.toml")));
    let [page, said] = certificate(&folder, 0, &[&files[0], &files[1]]);
    for missing in [
        "serial number of the machine is not stated",
        "operator is not stated",
        "laboratory is not stated",
        "date of the measurement is not stated",
        "method is not described",
        "No instrument is stated: the results are not traceable",
        "No temperature",
        "No identification is given",
        "No compensation is given",
        "not validated by measurements",
        "No limits are stated: nothing is said about conformity.",
    ] {
        assert!(
            said.contains(missing) && read(&page).contains(missing),
            "{missing}: {said}"
        );
    }
    assert!(page.contains("not stated"));
    // Errors without uncertainties.
    let router = ["machine", "errors-10"].map(|name| example(&format!("router/{name}.toml")));
    let limits = "[[limit]]\nquantity = \"tip mean\"\num = 1e3\n";
    let limits = folder.file("limits.toml", limits);
    let [page, said] = certificate(
        &folder,
        1,
        &[&router[0], &router[1], "--calibration", &limits],
    );
    assert!(said.starts_with(&folder.at("calibration.html")), "{said}");
    assert!(
        said.contains("NOT DECIDED: of the stated limit, 0 passed, 1 not decided."),
        "{said}"
    );
    assert!(
        said.contains("No error parameter has an uncertainty"),
        "{said}"
    );
    assert!(
        read(&page).contains("not decided : its uncertainty is unknown"),
        "{}",
        read(&page)
    );
}

#[test]
fn limits_are_judged_with_their_uncertainty_and_the_tables() {
    let folder = Folder::new();
    // EZ0S is 55.6 µm with a standard uncertainty of 3.4 µm and more: verified to be more than 30, and less than 90.
    let errors = folder.file("errors.toml", huron_without(&[]));
    let judged = |all: &[(&str, f64)], more: &[&str]| {
        let limits = all.iter().map(|(quantity, um)| limit(quantity, *um));
        let is_length = all.iter().any(|(quantity, _)| *quantity == "tip mean");
        let stated = STATED.to_owned() + if is_length { LENGTH } else { "" };
        let stated = stated + &limits.collect::<String>();
        let (code, all, json) = decided(&folder, &errors, &stated, identified(""), more);
        let decisions = all.into_iter().map(|[decision, _]| decision);
        (code, decisions.collect::<Vec<_>>(), json)
    };
    let (code, decisions, _) = judged(&[("EZ0S", 30.0), ("EZ0S", 90.0), ("EZ0S", 56.0)], &[]);
    assert_eq!(
        (code, &decisions.join(" ")[..]),
        (Some(1), "fail pass not_decided")
    );
    let (code, decisions, _) = judged(&[("EZ0S", 90.0)], &[]);
    assert_eq!((code, &decisions[0][..]), (Some(0), "pass"));
    // 68 µm at the tip without tables, and what is not known of the parameters with them.
    let tables = blob("huron");
    let volumetric = [("tip mean", 30.0), ("G XY", 1000.0), ("E +X+Y-Z", 1000.0)];
    let (_, before, _) = judged(&volumetric, &[]);
    let (_, after, json) = judged(&volumetric, &[&tables, "--random", "500"]);
    assert_eq!(before, ["fail", "pass", "pass"]);
    assert_eq!(after, ["pass", "pass", "pass"]);
    let interval = &json["judged"][0]["interval"];
    assert!(
        interval[0].as_f64().unwrap() > 0.5 && interval[1].as_f64().unwrap() < 20.0,
        "{interval}"
    );
}

/// The date and an instrument.
const STATED: &str = "date = 2026-11-26\n[[instrument]]\nname = \"Touch probe\"\n";
/// The uncertainty of the length reference.
const LENGTH: &str = "[uncertainty]\nartefact_um = 0.1\nexpansion_um = 0.1\n";

/// A limit in the unit of its quantity.
fn limit(quantity: &str, at_most: f64) -> String {
    let unit = match quantity {
        "EYY1" => "um_per_m",
        "direction mean" => "urad",
        _ => "um",
    };
    format!("[[limit]]\nquantity = \"{quantity}\"\n{unit} = {at_most:?}\n")
}

/// The least that a calibration report of the Huron reads of an identification, with `more` keys.
fn identified(more: &str) -> Option<String> {
    Some(format!(
        r#"{{ "machine": "Huron K2X8-Five", "probings": 0, "probed": [], "balls": [], "parameters": [], "correlations": [],
            "unseen": [], "noise_um": 1.0, "noise_of_stated": 1.0, "degrees_of_freedom": 100, "condition": 1.0, "held_out": null,
            "left_um": [1.0, 1.0, 1.0], "checks": [], "outliers": [], "rows": []{more} }}"#
    ))
}

/// The exit code of a calibration report of the Huron with these errors (a file), statements and identification, each
/// decision with its reason, and all of it.
fn decided(
    folder: &Folder,
    errors: &str,
    stated: &str,
    found: Option<String>,
    more: &[&str],
) -> (Option<i32>, Vec<[String; 2]>, Value) {
    let machine = example("huron-k2x8/machine.toml");
    let calibration = folder.file("limits.toml", stated);
    let found = found.map(|text| folder.file("found.json", text));
    let line = format!("report {machine} {errors} --calibration-report --json");
    let mut arguments = split(&line);
    arguments.extend(["--calibration", &calibration]);
    arguments.extend(found.iter().flat_map(|path| ["--identification", path]));
    let output = trueaxis(&[&arguments, more].concat());
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = |one: &Value, key: &str| one[key].as_str().unwrap_or("").to_owned();
    let all = json["judged"].as_array().unwrap().iter();
    let all = all.map(|one| [text(one, "decision"), text(one, "why")]);
    (output.status.code(), all.collect(), json.clone())
}

/// Errors of the Huron without `others`, as if its tip and its direction had been measured in space.
fn huron_without(others: &[&str]) -> String {
    let text = std::fs::read_to_string(example("huron-k2x8/errors-13.toml")).unwrap();
    let is_in = |line: &&str| !others.iter().any(|name| line.starts_with(name));
    let lines = text.lines().filter(is_in);
    let lines: String = lines.map(|line| line.to_owned() + "\n").collect();
    lines + "[uncertainty]\nmisfit_um = 0.5\nmisfit_urad = 0.5\n"
}

#[test]
fn nothing_passes_without_its_grounds() {
    let folder = Folder::new();
    let text = huron_without(&[]);
    let without_backlash = folder.file("without-backlash.toml", text.clone());
    let backlash = |text: &str| {
        let with = "EXXb = 1e-3\n\n[standard_uncertainty]\nEXXb = 1e-4";
        text.replace("\n[standard_uncertainty]", with)
    };
    let errors = folder.file("errors.toml", backlash(&text));
    // All with limits that no interval reaches.
    let limits = [
        "EZ0S", "tip p95", "E X", "E +X+Y+Z", "F XY", "G XY", "B X", "EYY1",
    ]
    .map(|quantity| limit(quantity, 9999.0));
    let judged = |stated: &str, errors: &str, found: Option<String>| {
        let stated = stated.to_owned() + &limits.concat();
        let (code, all, _) = decided(&folder, errors, &stated, found, &[]);
        (code, all)
    };
    let found = identified;
    let (code, all) = judged(&(STATED.to_owned() + LENGTH), &errors, found(""));
    for (k, [decision, why]) in all.iter().enumerate() {
        match k {
            0 | 7 => assert!(why.contains("of a parameter does not include"), "{why}"),
            _ => assert_eq!(decision, "pass", "{why}"),
        }
    }
    assert_eq!(code, Some(1));
    // What depends on a length does not pass unless the uncertainty of its reference is stated.
    let (_, all) = judged(STATED, &errors, found(""));
    for (k, [decision, why]) in all.iter().enumerate() {
        match k {
            0 | 5 | 6 => assert_eq!(decision, "pass", "{why}"),
            _ => assert!(
                why.starts_with("the uncertainty of the length reference"),
                "{why}"
            ),
        }
    }
    // Without a misfit nothing shows what other errors do.
    let alone = text.replace("misfit_um = 0.5\nmisfit_urad = 0.5\n", "");
    let alone = folder.file("alone.toml", backlash(&alone));
    let (_, decisions) = judged(STATED, &alone, found(""));
    for (k, [decision, why]) in decisions.iter().enumerate() {
        match k {
            0 => assert_eq!(decision, "pass", "{why}"),
            7 => assert!(why.starts_with("the uncertainty of the length"), "{why}"),
            _ => assert!(why.starts_with("no misfit is stated"), "{decision} {why}"),
        }
    }
    // Where no backlash was measured, no limit of the reversal is known to be kept.
    let (_, all) = judged(STATED, &without_backlash, found(""));
    assert_eq!(
        all[6],
        ["not_decided", "the backlash of X was not measured"],
        "{all:?}"
    );
    let unjudged = found("").map(|text| text.replace("\"noise_of_stated\": 1.0,", ""));
    // Without a statement, or with residuals that refute the model, nothing passes.
    let undated = STATED.replace("date = 2026-11-26\n", "");
    for (stated, found, reason) in [
        ("", found(""), "no instrument"),
        (&undated[..], found(""), "no date"),
        (STATED, None, "no identification"),
        (STATED, unjudged, "no noise is stated"),
        (
            STATED,
            found(r#", "refuted": ["probings"]"#),
            "residuals exceed",
        ),
        (
            STATED,
            found(r#", "repeats": { "is_less": true }"#),
            "residuals exceed",
        ),
    ] {
        let (code, all) = judged(stated, &errors, found);
        let is_open =
            |[decision, why]: &[String; 2]| decision == "not_decided" && why.contains(reason);
        assert!(all.iter().all(is_open), "{reason}: {all:?}");
        assert_eq!(code, Some(1), "{reason}");
    }
    // The scale of X is not known, so neither is any length: only form and reversal can pass.
    let errors = folder.file("relative.toml", backlash(&huron_without(&["EXX1"])));
    let (code, all) = judged(STATED, &errors, found(""));
    let decisions: Vec<&str> = all.iter().map(|[decision, _]| &decision[..]).collect();
    let [pass, open] = ["pass", "not_decided"];
    assert_eq!(
        decisions,
        [pass, open, open, open, open, pass, pass, open],
        "{all:?}"
    );
    assert!(
        all[2][1].contains("the scale of X was not measured"),
        "{all:?}"
    );
    assert_eq!(code, Some(1));
    // Without that of Y, nor is the form of a circle; the reversal of X is.
    let errors = folder.file("none.toml", backlash(&huron_without(&["EXX1", "EYY1"])));
    let (_, all) = judged(STATED, &errors, found(""));
    assert_eq!([&all[5][0][..], &all[6][0]], [open, pass], "{all:?}");
    assert!(all[5][1].contains("scales of Y and X"), "{all:?}");
}

#[test]
fn nothing_is_decided_beyond_the_probed_zone_nor_where_an_unmeasured_error_matters() {
    let folder = Folder::new();
    let names = [
        "tip p95",
        "direction mean",
        "E X",
        "E Y",
        "E +X+Y+Z",
        "G XY",
        "G YZ",
    ];
    let limits = names.map(|name| limit(name, 9999.0));
    let stated = STATED.to_owned() + LENGTH + &limits.concat();
    let open = |more: &str| {
        let errors = folder.file("errors.toml", huron_without(&[]) + more);
        let (code, all, _) = decided(&folder, &errors, &stated, identified(""), &[]);
        let open = all.into_iter().zip(names);
        let open = open.filter(|([decision, _], _)| decision == "not_decided");
        let open = open.map(|([_, why], name)| (name, why));
        (code, open.collect::<Vec<(&str, String)>>())
    };
    let names =
        |open: &[(&'static str, String)]| -> Vec<&str> { open.iter().map(|o| o.0).collect() };
    let (code, all) = open("");
    assert_eq!((code, names(&all)), (Some(0), vec![]));
    // Not the whole travel of X, but the circle in its middle.
    let (code, all) = open("[calibrated]\nX = [-320.0, 320.0]\n");
    let beyond = ["tip p95", "direction mean", "E X", "E +X+Y+Z"];
    assert_eq!((code, names(&all)), (Some(1), beyond.to_vec()), "{all:?}");
    for (name, why) in &all {
        assert!(
            why.contains("it needs X from") && why.contains("only −320 to 320 was probed"),
            "{name}: {why}"
        );
    }
    // The place of the rotary axis moves the tip only.
    let (code, all) = open("[unseen]\nEX0C = 14.0\n");
    assert_eq!((code, names(&all)), (Some(1), vec!["tip p95"]), "{all:?}");
    assert_eq!(all[0].1, "EX0C was not measured");
}

#[test]
fn nothing_is_decided_by_a_value_that_was_measured_once() {
    let folder = Folder::new();
    let text = huron_without(&[]).replace("EYY1 = -14.3e-6", "EYY1 = -60e-6");
    let names = ["EC0X", "E X", "E Y", "B X"];
    let judged = |text: &str, found: &str, at_most: f64| {
        let errors = folder.file("errors.toml", text);
        let limits = names.map(|name| match name {
            "EC0X" => limit(name, at_most).replace("um =", "urad ="),
            "B X" => limit(name, 9999.0),
            _ => limit(name, at_most),
        });
        let stated = format!("{STATED}{}", limits.concat());
        let found = identified("").map(|all| all.replace("\"probed\": []", found));
        decided(&folder, &errors, &stated, found, &[]).1
    };
    let all = |text: &str| judged(text, "\"probed\": []", 0.001);
    let decisions = |all: &[[String; 2]]| -> Vec<String> {
        all.iter().map(|[decision, _]| decision.clone()).collect()
    };
    // No backlash of X was measured.
    let open = "not_decided";
    assert_eq!(decisions(&all(&text)), ["fail", "fail", "fail", open]);
    // A table of X without its uncertainty, which Y does not depend on.
    let once = "\n[tabulated.EXX]\nat = [-350.0, 0.0, 350.0]\npositive = [0.0, 5.0, 9.0]\nnegative = [2.0, 7.0, 11.0]\nunit = \"um\"\n";
    let lines = text.lines().filter(|line| !line.starts_with("EXX1"));
    let tabulated = lines.map(|line| line.to_owned() + "\n").collect::<String>() + once;
    let found = all(&tabulated);
    assert_eq!(decisions(&found), ["fail", open, "fail", open], "{found:?}");
    for of_x in [1, 3] {
        assert_eq!(
            found[of_x][1],
            "EXX has no uncertainty, as from a single run"
        );
    }
    let found = all(&text.replace("EYY1 = 6.4e-6\n", ""));
    assert_eq!(decisions(&found), ["fail", "fail", open, open], "{found:?}");
    assert_eq!(found[2][1], "EYY1 has no uncertainty");
    // A squareness from a corner of the travel is a yaw there, too.
    let corner = "\"probed\": [{ \"axis\": \"X\", \"range\": [5.0, 105.0] }]";
    let found = judged(&text, corner, 9999.0);
    assert_eq!(
        found[0],
        ["not_decided", "X was measured only from 5 to 105"]
    );
}

#[test]
fn nothing_passes_where_positions_hide_what_repeats_between_them() {
    let folder = Folder::new();
    let errors = folder.file("errors.toml", huron_without(&[]));
    let hidden = r#"[{ "motions": ["EXX", "EYX"], "periods": [25.0, 16.67, 12.5] }]"#;
    let grid = format!(r#"{{ "axis": "X", "range": [-350.0, 350.0], "hidden": {hidden} }}"#);
    let other = r#"{ "axis": "Y", "range": [-350.0, 350.0], "hidden": [{ "motions": ["EXY"], "periods": [5.0] }] }"#;
    let gap = r#"{ "axis": "A", "range": [-100.0, 100.0], "gap": [10.0, 60.0] }"#;
    let probed = format!("\"probed\": [{grid}, {other}, {gap}]");
    let found = identified("").map(|text| text.replace("\"probed\": []", &probed));
    let names = ["tip p95", "E X", "E Y", "G YZ"];
    let limits = names.map(|name| limit(name, 9999.0)).concat();
    let judged = |more: &str| {
        let stated = format!("{STATED}{LENGTH}{more}{limits}");
        let (_, all, json) = decided(&folder, &errors, &stated, found.clone(), &[]);
        let missing = json["missing"].to_string();
        assert!(
            missing.contains(
                "Errors EXX, EYX of X that repeat every 25 mm (or 16.7, 12.5) hardly show at the measured positions"
            ),
            "{missing}"
        );
        assert!(
            missing.contains("Nothing was measured between A 10 and 60°"),
            "{missing}"
        );
        all
    };
    // E Y and the circle in YZ do not move X, and what is hidden of Y is across.
    let all = judged("");
    let decisions = all.iter().map(|[decision, _]| &decision[..]);
    let decisions: Vec<&str> = decisions.collect();
    assert_eq!(decisions, ["not_decided", "not_decided", "pass", "pass"]);
    assert!(
        all[1][1].contains("hardly show at the measured positions: measure at others"),
        "{all:?}"
    );
    // An identification of an older version does not say what is hidden.
    let older = r#""probed": [{ "axis": "Y", "range": [-350.0, 350.0], "step": 50.0 }]"#;
    let older = identified("").map(|text| text.replace("\"probed\": []", older));
    let stated = format!("{STATED}{LENGTH}{limits}");
    let (_, all, _) = decided(&folder, &errors, &stated, older, &[]);
    assert!(all[2][1].contains("of an older version"), "{all:?}");
    // Stated, they widen the interval.
    let all = judged("periodic_um = 2.0\n");
    assert!(
        all.iter().all(|[decision, _]| decision == "pass"),
        "{all:?}"
    );
}

#[test]
fn a_limit_of_tip_and_direction_can_be_decided_for_the_probed_zone() {
    let folder = Folder::new();
    let machine = example("huron-k2x8/machine.toml");
    let zone = "[calibrated]\nX = [-320.0, 320.0]\nY = [-100.0, 100.0]\n";
    let errors = folder.file("errors.toml", huron_without(&[]) + zone);
    let judged = |limit: &str| {
        let stated = format!("{STATED}{LENGTH}[[limit]]\n{limit}\n");
        let (_, all, json) = decided(&folder, &errors, &stated, identified(""), &[]);
        let one = &json["judged"][0];
        let words = one["words"].as_str().unwrap().to_owned();
        (all[0][0].clone(), words, one["value"].as_f64())
    };
    let limit = |zone: &str| format!("quantity = \"tip p95\"\num = 9999.0{zone}");
    let (whole, words, over_travel) = judged(&limit(""));
    assert_eq!(whole, "not_decided");
    assert!(words.ends_with("95 % of the travel"), "{words}");
    let (probed, words, in_zone) = judged(&limit("\nzone = \"probed\""));
    assert_eq!(probed, "pass");
    assert!(words.ends_with("95 % of the probed zone"), "{words}");
    assert!(in_zone < over_travel, "{in_zone:?} {over_travel:?}");
    let direction = "quantity = \"direction mean\"\nurad = 9999.0\nzone = \"probed\"";
    assert_eq!(judged(direction).0, "pass");
    for (limit, message) in [
        (
            "quantity = \"E X\"\num = 9.0\nzone = \"probed\"",
            "`E X` has no zone",
        ),
        (
            "quantity = \"tip mean\"\num = 9.0\nzone = \"middle\"",
            "`middle` is not a zone",
        ),
    ] {
        let stated = folder.file("limits.toml", format!("{STATED}[[limit]]\n{limit}\n"));
        let line =
            format!("report {machine} {errors} --calibration-report --json --calibration {stated}");
        refused(&split(&line), &[message]);
    }
}

#[test]
fn nothing_of_a_statement_is_run() {
    let folder = Folder::new();
    let files = ["machine", "errors-13"].map(|name| example(&format!("huron-k2x8/{name}.toml")));
    let evil = "</td><script>alert(1)</script> <b>& ' \\\"\\u2028";
    let mut text = String::new();
    for key in [
        "number",
        "serial_number",
        "operator",
        "laboratory",
        "date",
        "method",
    ] {
        text += &format!("{key} = \"{evil}\"\n");
    }
    text += &format!(
        "[[instrument]]\nname = \"{evil}\"\nserial_number = \"{evil}\"\ncertificate = \"{evil}\"\n"
    );
    text += &format!("[[temperature]]\nplace = \"{evil}\"\ncelsius = [20.0, 21.0]\n");
    text += &format!("[[limit]]\ntest = \"{evil}\"\nquantity = \"EZ0S\"\num = 500.0\n");
    let calibration = folder.file("<i>calibration.toml", text);
    let [page, _] = certificate(
        &folder,
        1,
        &[&files[0], &files[1], "--calibration", &calibration],
    );
    assert!(!page.contains("<script") && !page.contains("<b>&") && !page.contains("<i>cal"));
    // The number is in the title, at the top and at the end; for every sheet it is in the style sheet, as code points.
    assert_eq!(page.matches("&lt;script&gt;alert(1)").count(), 13);
    let style = &page[..page.find("</style>").unwrap()];
    assert!(
        style.contains("\\00003c\\00002ftd\\00003e\\00003cscript"),
        "{style}"
    );
}

/// A file, and what is said of it.
const BAD_CALIBRATIONS: &str = r#"operater = "A" | line 1 | unknown field `operater`
operator = "A"\nlaboratory = "LONG" | line 2 | 49 characters | room for 48 | shorten it
operator = " " | line 1 | this text is empty | leave it out if it is unknown
[[temperature]]\nplace = "air"\ncelsius = [293.0, 294.0] | line 3 | not a range of temperatures | in °C
[[temperature]]\nplace = "air"\ncelsius = [21.0, 20.0] | line 3 | 21 to 20 °C
[[temperature]]\nplace = "air"\ncelsius = [20,0, 21,0] | line 3 | decimal point, not a comma
[uncertainty]\nlobes_um = -0.3 | line 2 | -0.3 µm is not a standard uncertainty | Leave it out if it is unknown
LIMIT "EZ0B"\num = 1.0 | line 3 | no parameter EZ0B
LIMIT "roundness"\num = 1.0 | line 3 | not a quantity that can be limited
LIMIT "G XW"\num = 1.0 | line 3 | not a quantity that can be limited | "G XY"
LIMIT "E W"\num = 1.0 | line 3 | no linear axis W
LIMIT "EXX2"\num = 1.0 | line 3 | EXX2 is a coefficient | limit its effect
LIMIT "EA0Z"\num = 1.0 | line 4 | `EA0Z` is not in um | urad = 10.0 or um_per_m = 10.0
LIMIT "EZ0S" | line 2 | a limit needs a number | um = 10.0
LIMIT "EZ0S"\num = 1.0\nurad = 2.0 | line 5 | a limit has one number
LIMIT "EZ0S"\num = -1.0 | line 4 | -1 is not a limit
LIMIT "EZ0S"\num = nan | line 4 | NaN is not a limit"#;

#[test]
fn a_bad_calibration_is_refused_with_line_and_remedy() {
    let folder = Folder::new();
    let files = ["machine", "errors-13"].map(|name| example(&format!("huron-k2x8/{name}.toml")));
    let seven = "[[instrument]]\nname = \"A\"\n".repeat(7);
    let seven = format!("{seven} | line 13 | 7 instruments | room for 6").replace('\n', "\\n");
    for row in BAD_CALIBRATIONS.lines().chain([&seven[..]]) {
        let mut cells = row.split(" | ");
        let text = cells.next().unwrap().replace("\\n", "\n");
        let text = text.replace("LONG", &"x".repeat(49));
        let text = text.replace("LIMIT", "operator = \"A\"\n[[limit]]\nquantity =");
        let path = folder.file("calibration.toml", text + "\n");
        let out = folder.at("c.html");
        let line = format!(
            "report {} {} --calibration-report -o {out} --calibration {path}",
            files[0], files[1]
        );
        refused(&split(&line), &cells.collect::<Vec<_>>());
        assert_eq!(folder.names(), ["calibration.toml"]);
    }
    let path = folder.file("calibration.toml", "operator = \"A\"\n");
    refused(
        &split(&format!(
            "report {} {} --calibration-report --json --validation {path}",
            files[0], files[1]
        )),
        &["this is not a validation.json of `trueaxis linuxcnc calibrate`"],
    );
    refused(
        &split(&format!(
            "report {} {} --calibration-report -o {path} --calibration {path}",
            files[0], files[1]
        )),
        &["the output", "is the input"],
    );
    // Statements without a calibration report.
    let output = trueaxis(&split(&format!(
        "report {} {} --json --calibration {path}",
        files[0], files[1]
    )));
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn an_identification_of_another_machine_is_refused() {
    let folder = Folder::new();
    let [_, _, found] = kolibri(&folder);
    let [machine, errors] =
        ["machine", "errors-13"].map(|name| example(&format!("huron-k2x8/{name}.toml")));
    let out = folder.at("calibration.html");
    refused(
        &split(&format!(
            "report {machine} {errors} --calibration-report -o {out} --identification \
             {found}"
        )),
        &[
            "found.json",
            "belongs to the machine",
            "or no identification",
        ],
    );
    assert!(!std::path::Path::new(&out).exists());
}

#[test]
fn an_identification_of_other_errors_is_refused() {
    let folder = Folder::new();
    let [machine, errors, found] = kolibri(&folder);
    let text = std::fs::read_to_string(&errors).unwrap();
    let line = text
        .lines()
        .find(|line| line.starts_with("EC0X = "))
        .unwrap();
    let other = folder.file("other.toml", text.replacen(line, "EC0X = 1.25e-4", 1));
    let out = folder.at("calibration.html");
    refused(
        &split(&format!(
            "report {machine} {other} --calibration-report -o {out} --identification {found}"
        )),
        &[
            "found.json",
            "it has EC0X = ",
            "and the error file 1.25",
            "these errors",
        ],
    );
    assert!(!std::path::Path::new(&out).exists());
}
