//! A compensation that does not fit into the target, or misses its tolerance, is not written.

use crate::program::{Folder, answer, example, plain, refused, split, trueaxis};
use serde_json::Value;
use trueaxis_tables::target::Target;
use trueaxis_tests::usual_or_all;

/// Compiles an example with twelve errors into `k.trax` with additional arguments; returns standard output and
/// standard error. Checks that it exits with `code`.
#[track_caller]
fn compile(folder: &Folder, code: i32, more: &[&str]) -> (String, String) {
    let (machine, errors, out) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
        folder.at("k.trax"),
    );
    let line = format!("compile {machine} {errors} -o {out} --random 300 --policy orientation");
    let first = split(&line);
    let output = trueaxis(&[&first[..], more].concat());
    let said = plain(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{said}");
    (String::from_utf8(output.stdout).unwrap(), said)
}

/// A target with the capacities of the reference board, modified by `change`.
fn target(folder: &Folder, change: impl FnOnce(&mut Target)) -> String {
    let mut target = Target::stm32f405();
    target.name = "small".to_owned();
    change(&mut target);
    folder.file("small.toml", target.to_toml())
}

/// Checks that the folder only has the target and the old file with its content.
#[track_caller]
fn only_old(folder: &Folder) {
    assert_eq!(folder.names(), ["k.trax", "small.toml"]);
    assert_eq!(std::fs::read(folder.at("k.trax")).unwrap(), b"old");
}

#[test]
fn a_target_that_is_full_is_the_reason_told_with_a_tolerance_that_fits() {
    let folder = Folder::new();
    folder.file("k.trax", "old");
    let held = 1500;
    let small = target(&folder, |t| t.bytes = Some(held));
    let (shown, said) = compile(
        &folder,
        1,
        &["--target", &small, "--tolerance", "0.05", "--json"],
    );
    only_old(&folder);
    let answer: Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(answer["written"], false);
    assert_eq!(answer["target"]["name"], "small");
    assert_eq!(answer["refusals"][0]["kind"], "tolerance");
    assert_eq!(answer["shortages"].as_array().unwrap().len(), 0);
    let full = &answer["full"];
    assert_eq!(full["used"][2]["what"], "bytes");
    assert_eq!(full["used"][2]["held"], held);
    assert_eq!(full["used"][2]["used"], answer["bytes"]);
    assert!(said.contains("small is too small for 0.05 µm"), "{said}");
    assert!(said.contains("k.trax stays as it was; --best-effort would write it"));
    // The tolerance that it reports as met is met.
    let fits = full["fits_um"].as_f64().unwrap();
    assert!(fits > 0.05);
    let tolerance = format!(" bytes; with --tolerance {fits} it fits");
    assert!(said.contains(&tolerance), "{said}");
    let (_, asked) = compile(
        &folder,
        0,
        &["--target", &small, "--tolerance", &fits.to_string()],
    );
    assert!(!asked.contains("the finest of"), "{asked}");
}

#[test]
fn what_a_finer_tolerance_leaves_at_best_is_no_more_than_what_a_coarser_one_does() {
    let folder = Folder::new();
    let small = target(&folder, |t| (t.tables, t.terms) = (9, 12));
    // The finest tolerance met; µm and µrad count alike under the policy `orientation`.
    let left = |tolerance: &str| {
        let output = trueaxis(&split(&format!(
            "compile {} {} -o {} --policy orientation --target {small} --best-effort \
             --tolerance {tolerance} --json",
            example("kolibri/machine.toml"),
            example("kolibri/errors-12.toml"),
            folder.at("k.trax")
        )));
        let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
        let found = match &answer["inside"] {
            Value::Null => &answer,
            inside => inside,
        };
        let of = |name: &str| found[name].as_f64().unwrap();
        (
            of("difference_um").max(of("difference_urad")),
            answer["meets_tolerance"] == true,
        )
    };
    let tolerances = usual_or_all(&["0.05", "1"][..], &["0.05", "0.2", "1", "5"]);
    let found: Vec<_> = tolerances.iter().map(|t| left(t)).collect();
    for pair in found.windows(2) {
        let [(finer, met), (coarser, _)] = pair else {
            unreachable!()
        };
        // Being met counts, even if a coarser tolerance happens to leave much less.
        assert!(*met || finer <= coarser, "{found:?}");
    }
    assert!(!found[0].1, "{found:?}");
}

#[test]
fn too_few_tables_are_told_as_what_is_used() {
    let folder = Folder::new();
    folder.file("k.trax", "old");
    let small = target(&folder, |t| (t.tables, t.terms) = (8, 12));
    let (shown, said) = compile(&folder, 1, &["--target", &small, "--tolerance", "0.05"]);
    assert!(shown.contains("8 tables"), "{shown}");
    assert!(
        said.contains("the best that fits takes 8 of 8 tables, "),
        "{said}"
    );
    only_old(&folder);
    let (_, said) = compile(
        &folder,
        1,
        &["--target", &small, "--tolerance", "0.05", "--best-effort"],
    );
    assert!(said.contains("small is too small"), "{said}");
    assert!(said.contains("k.trax is written all the same"), "{said}");
}

#[test]
fn what_it_says_would_meet_the_tolerance_does() {
    let folder = Folder::new();
    let small = target(&folder, |t| (t.tables, t.terms) = (9, 12));
    let (shown, said) = compile(
        &folder,
        1,
        &["--target", &small, "--tolerance", "0.05", "--json"],
    );
    let answer: Value = serde_json::from_str(&shown).unwrap();
    let size = &answer["full"]["unlimited"];
    let of = |name: &str| usize::try_from(size[name].as_u64().unwrap()).unwrap();
    assert!(of("tables") > 9 && of("terms") > 12, "{size}");
    let told = format!(
        "; with room for all of it, {} banks, {} tables, {} terms and {} bytes meet it",
        of("banks"),
        of("tables"),
        of("terms"),
        of("bytes")
    );
    assert!(said.contains(&told), "{said}");
    let (shown, _) = compile(
        &folder,
        0,
        &["--target", "desktop", "--tolerance", "0.05", "--json"],
    );
    let answer: Value = serde_json::from_str(&shown).unwrap();
    for what in ["banks", "tables", "terms", "bytes"] {
        assert_eq!(answer[what], of(what), "{what}");
    }
}

#[test]
fn a_tolerance_far_below_what_uncertain_parameters_leave_is_said_to_buy_nothing() {
    let folder = Folder::new();
    let [machine, errors] =
        ["machine", "errors-13"].map(|n| example(&format!("huron-k2x8/{n}.toml")));
    let out = folder.at("k.trax");
    let said = |more: &[&str]| {
        let first = ["compile", &machine, &errors, "-o", &out];
        let output = trueaxis(&[&first[..], more].concat());
        assert_eq!(output.status.code(), Some(0));
        plain(&output.stderr)
    };
    // The parameters leave up to 15 µm.
    let far = said(&["--tolerance", "0.05"]);
    // A tenth of the 14.95 µm in the README.
    assert!(
        far.contains("a tolerance below 1.50 µm buys nothing"),
        "{far}"
    );
    assert!(!said(&["--tolerance", "2"]).contains("buys nothing"));
    assert!(!said(&[]).contains("buys nothing"));
}

#[test]
fn a_target_without_room_for_the_axes_gets_nothing() {
    let folder = Folder::new();
    folder.file("k.trax", "old");
    let small = target(&folder, |t| t.axes = 3);
    // Not even with --best-effort, because it could not be used.
    let more = ["--target", &small, "--best-effort"];
    let (shown, said) = compile(&folder, 1, &more);
    assert_eq!(shown, "");
    let axes = "small is too small: 5 axes are needed, there is room for 3";
    assert!(said.contains(axes), "{said}");
    assert!(said.ends_with("k.trax stays as it was"), "{said}");
    let (shown, _) = compile(&folder, 1, &[&more[..], &["--json"]].concat());
    let answer: Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(answer["written"], false);
    assert_eq!(answer["shortages"][0]["what"], "axes");
    assert_eq!(answer["shortages"][0]["needed"], 5);
    only_old(&folder);
}

#[test]
fn a_missed_tolerance_writes_nothing_unless_the_best_effort_is_asked_for() {
    let folder = Folder::new();
    folder.file("small.toml", "");
    folder.file("k.trax", "old");
    // Three points cannot represent a sine.
    let coarse = ["--points", "3", "--tolerance", "0.05", "--json"];
    let (shown, said) = compile(&folder, 1, &coarse);
    let answer: Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(answer["written"], false);
    assert_eq!(answer["meets_tolerance"], false);
    assert_eq!(answer["full"], Value::Null);
    assert!(
        said.contains("the tolerance of 0.05 µm and µrad is not met"),
        "{said}"
    );
    assert!(said.contains("were reached"), "{said}");
    assert!(
        said.contains("k.trax stays as it was; --best-effort would write it"),
        "{said}"
    );
    only_old(&folder);
    let best = [&coarse[..], &["--best-effort"]].concat();
    let (shown, said) = compile(&folder, 1, &best);
    let answer: Value = serde_json::from_str(&shown).unwrap();
    assert_eq!(answer["written"], true);
    assert_eq!(answer["meets_tolerance"], false);
    assert!(said.contains("is written all the same"), "{said}");
    let written = std::fs::metadata(folder.at("k.trax")).unwrap().len();
    assert_eq!(answer["bytes"], written);
}

#[test]
fn a_target_that_prefers_short_samples_gets_them_unless_told_otherwise() {
    let folder = Folder::new();
    let small = target(&folder, |t| t.samples = trueaxis::SampleFormat::I16);
    let formats = |more: &[&str]| {
        let all = ["--target", &small, "--best-effort", "--tolerance", "1"];
        compile(&folder, 0, &[&all[..], more].concat());
        answer(0, &["inspect", &folder.at("k.trax")])
    };
    assert!(formats(&[]).contains("i16"));
    assert!(!formats(&["--samples", "f32"]).contains("i16"));
}

#[test]
fn a_target_that_is_none_is_refused() {
    let folder = Folder::new();
    let out = folder.at("k.trax");
    let (machine, errors) = (
        example("kolibri/machine.toml"),
        example("kolibri/errors-12.toml"),
    );
    let small = folder.file("small.toml", "name = \"small\"\naxes = 5\ntable = 9\n");
    let with = |target: &str, parts: &[&str]| {
        refused(
            &["compile", &machine, &errors, "-o", &out, "--target", target],
            parts,
        );
    };
    with(
        "stm32f4",
        &[
            "--target: `stm32f4` is neither a target nor a file",
            "stm32f405, desktop",
        ],
    );
    with(
        &small,
        &["small.toml, line 3: unknown field `table`", "--dry-run"],
    );
    assert_eq!(folder.names(), ["small.toml"]);
    // The target file is an input.
    refused(
        &split(&format!(
            "compile {machine} {errors} -o {small} --target {small}"
        )),
        &["is the input"],
    );
}
