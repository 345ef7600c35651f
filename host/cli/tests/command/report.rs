//! The report: a single page, reproducible bytes, and messages about bad input.

use crate::identify::probings;
use crate::program::{Folder, answer, blob, done, example, refused, split, trueaxis};
use trueaxis_report::ReportFigures;

fn huron() -> [String; 2] {
    ["machine", "errors-13"].map(|name| example(&format!("huron-k2x8/{name}.toml")))
}

fn read(path: &str) -> String {
    std::fs::read_to_string(path).unwrap()
}

/// The page that `report` writes with these arguments, and its output. Checks that it exits with `code`.
fn page(folder: &Folder, code: i32, arguments: &[&str]) -> (String, String) {
    let out = folder.at("report.html");
    let mut all = vec!["report"];
    all.extend(arguments);
    all.extend(["-o", &out, "--random", "500"]);
    let said = answer(code, &all);
    (read(&out), said)
}

fn figures(arguments: &[&str]) -> ReportFigures {
    let mut all = vec!["report"];
    all.extend(arguments);
    all.extend(["--json", "--random", "500"]);
    serde_json::from_str(&answer(0, &all)).unwrap()
}

/// The page's text without its data, style and scripts.
fn text(page: &str) -> &str {
    let body = page.find("<main>").unwrap();
    let end = page.find("</main>").unwrap();
    &page[body..end]
}

#[test]
fn the_page_is_one_small_file_without_addresses_and_the_same_every_time() {
    let folder = Folder::new();
    let ([machine, errors], tables) = (huron(), blob("huron"));
    let arguments = [&machine as &str, &errors, &tables, "--date", "23 November"];
    let (first, said) = page(&folder, 0, &arguments);
    let (second, _) = page(&folder, 0, &arguments);
    assert_eq!(first, second);
    assert!(first.len() < 3_000_000, "{} bytes", first.len());
    for address in ["http", "src=", "href=\"/", "url(", "@import", "//www"] {
        assert!(!first.contains(address), "{address}");
    }
    let headline = "With these tables the measured errors put the tip off by about ";
    let cause = "The spindle's Z position (EZ0S) causes 56 of 68 µm on average.";
    assert!(said.contains(headline) && said.contains(cause), "{said}");
    assert!(text(&first).contains(&format!("<p>{headline}")));
    let short = "<p class=\"verdict\">Tip error 102 → about 14 µm with the tables, by the errors that were measured (95 %).";
    assert!(
        text(&first).contains(short),
        "{}",
        text(&first).split("<h2").next().unwrap()
    );
    // Autoescaping writes the apostrophe as a character reference.
    assert!(text(&first).contains(&cause.replace('\'', "&#x27;")));
    for heading in [
        "Before and after",
        "Error budget",
        "What tables cannot correct",
        "Error motions",
        "Circular tests (ISO 230-4)",
        "Diagonals (ISO 230-6)",
        "Positioning of linear axes (ISO 230-2)",
        "The tables",
        "This document",
        "23 November",
    ] {
        assert!(text(&first).contains(heading), "{heading}");
    }
}

#[test]
fn compile_writes_the_same_page() {
    let folder = Folder::new();
    let [machine, errors] = huron();
    let (tables, out) = (folder.at("huron.trax"), folder.at("compiled.html"));
    let line = format!("compile {machine} {errors} -o {tables} --report {out} --random 500");
    let arguments = split(&line);
    let said = answer(0, &arguments);
    assert!(said.contains("(EZ0S) causes 56 of 6"), "{said}");
    let bars: Vec<&str> = said.lines().filter(|line| line.contains('█')).collect();
    assert!(bars.len() == 5 && bars[0].starts_with("  EZ0S"), "{said}");
    assert!(!said.contains('\x1b'));
    let (page, _) = page(&folder, 0, &[&machine, &errors, &tables]);
    assert!(page == read(&out));
}

#[test]
fn all_figures_are_json_and_come_back() {
    let [machine, errors] = huron();
    let report = figures(&[&machine, &errors, &blob("huron")]);
    let again: ReportFigures =
        serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
    assert!(again == report);
    let most = &report.budget.shares[0];
    assert_eq!(most.name, "EZ0S");
    // A shift of 55.6 µm at every position, up to rounding.
    let tip = most.alone.translation_um;
    assert!((tip.mean - 55.6).abs() < 1e-9 && (tip.max - 55.6).abs() < 1e-9);
    assert_eq!(report.volumetric.meets_tolerance, Some(true));
    // One number: the maxima are those of the worst positions, and not less than at random ones.
    let (volumetric, worst) = (&report.volumetric, &report.worst);
    let after = volumetric.after.unwrap();
    for (quality, places) in [(volumetric.before, &worst.before), (after, &worst.after)] {
        assert_eq!(quality.translation_um.max, places[0].tip_um);
        assert!(quality.translation_um.max > quality.translation_um.p95);
        assert_eq!(places.len(), 6);
    }
    let names: Vec<&str> = report
        .tables
        .iter()
        .flat_map(|t| &t.class.names)
        .map(|n| &**n)
        .collect();
    assert_eq!(names, ["L-VOL+", "R-ANG"]);
}

#[test]
fn a_report_says_what_has_changed_since_an_older_one() {
    let folder = Folder::new();
    let [machine, errors] = huron();
    let old = answer(
        0,
        &["report", &machine, &errors, "--json", "--date", "spring"],
    );
    let old = folder.file("old.json", old);
    let changed = read(&errors).replace("EZ0S = 55.6e-3", "EZ0S = 75.6e-3");
    let changed = changed.replace("EXX1 = 25.9e-6", "EXX1 = 26.9e-6");
    let changed = folder.file("errors.toml", changed);
    let report = figures(&[&machine, &changed, "--compare", &old]);
    let changes = report.changes.unwrap();
    assert_eq!(changes.since.as_deref(), Some("spring"));
    assert_eq!(changes.files, ["errors"]);
    let found: Vec<_> = (changes.parameters.iter())
        .map(|c| (&*c.name, c.old, c.new, c.is_significant))
        .collect();
    // By 20 µm, where chance explains 2·√2·6.8 µm = 19.2; and by 1 µm/m, where it explains 22.9.
    assert_eq!(
        found,
        [
            ("EZ0S", Some(55.6e-3), Some(75.6e-3), Some(true)),
            ("EXX1", Some(25.9e-6), Some(26.9e-6), Some(false)),
        ]
    );
    let (page, _) = page(&folder, 0, &[&machine, &changed, "--compare", &old]);
    assert!(text(&page).contains("Since spring the mean error without tables has gone from"));
    let router = ["machine", "errors-10"].map(|name| example(&format!("router/{name}.toml")));
    let other = figures(&[&router[0], &router[1], "--compare", &old]);
    assert!(other.changes.is_none());
    assert!(
        other.remarks.iter().any(|r| r.contains("is not compared")),
        "{:?}",
        other.remarks
    );
    refused(
        &["report", &machine, &errors, "--json", "--compare", &errors],
        &[
            "errors-13.toml",
            "this is not what `trueaxis report --json` prints",
        ],
    );
    let future = read(&old).replace("\"format\": 1", "\"format\": 2");
    let future = folder.file("future.json", future);
    refused(
        &["report", &machine, &errors, "--json", "--compare", &future],
        &["this report has the format 2, this version writes 1"],
    );
}

#[test]
fn a_compensation_for_another_machine_is_left_out_and_the_report_says_so() {
    let folder = Folder::new();
    let [machine, errors] = huron();
    let (page, said) = page(&folder, 1, &[&machine, &errors, &blob("kolibri")]);
    assert!(
        said.contains("Without tables the machine is off by"),
        "{said}"
    );
    let remark = "The compensation is left out: the blob was made for the machine";
    assert!(text(&page).contains(remark) && !text(&page).contains("<h2>The tables"));
}

#[test]
fn nothing_of_a_name_is_run() {
    let folder = Folder::new();
    let [machine, errors] = huron();
    let evil = "</script><script>alert(1)</script><!-- & \\\" 'x\\u2028";
    let name = |text: &str| text.replace("Huron K2X8-Five", evil);
    let (machine, errors) = (
        folder.file("<machine>&.toml", name(&read(&machine))),
        folder.file("errors.toml", name(&read(&errors))),
    );
    let (page, _) = page(&folder, 0, &[&machine, &errors, "--date", "<b>today</b>"]);
    assert!(!page.contains("<script>alert") && !page.contains("<b>today"));
    // The page's own scripts: two with data and one to run.
    assert_eq!(page.matches("<script").count(), 3);
    assert_eq!(page.matches("</script>").count(), 3);
    // U+2028 ends a line in scripts but not in text.
    let data = &page[page.find("id=\"report-data\"").unwrap()..];
    assert!(!data.contains("<!--") && !data.contains('\u{2028}'));
    let heading = "<h1>&lt;&#x2f;script&gt;&lt;script&gt;alert(1)";
    assert!(page.contains(heading), "{}", &text(&page)[..400]);
    assert!(page.contains("&lt;machine&gt;&amp;.toml"));
}

#[test]
fn machines_and_errors_of_every_kind_have_a_report_that_says_what_is_missing() {
    let folder = Folder::new();
    let of = |machine: &str, errors: &str| [machine, errors].map(|f| example(&format!("{f}.toml")));
    // Only three axes, none of them rotary.
    let router = of("router/machine", "router/errors-10");
    let report = figures(&[&router[0], &router[1]]);
    assert!(
        report.beyond[0].contains("the machine has no rotary axis"),
        "{:?}",
        report.beyond
    );
    // Errors without uncertainties are nothing to warn of.
    assert!(report.remarks.is_empty(), "{:?}", report.remarks);
    assert!(
        report.headline.starts_with("Tip error ")
            && report
                .headline
                .ends_with(" µm, if the errors are as entered"),
        "{}",
        report.headline
    );
    assert!(
        report.verdict[0].starts_with("Without tables the machine is off by")
            && report.verdict[2].ends_with("The errors have no uncertainties."),
        "{:?}",
        report.verdict
    );
    // Measured motions.
    let mill = of("mill-21/machine", "mill-21/errors-21");
    let report = figures(&[&mill[0], &mill[1], &blob("mill-21")]);
    let x = report.axes.iter().find(|axis| axis.axis == 'X').unwrap();
    assert_eq!(x.motions.len(), 6);
    assert_eq!(x.motions[0].measured_at.len(), 51);
    // An axis without limits.
    let endless = of(
        "linuxcnc-xyzac-trt/machine-endless",
        "linuxcnc-xyzac-trt/errors-11",
    );
    let (page, _) = page(&folder, 0, &[&endless[0], &endless[1]]);
    assert!(text(&page).contains("Axis C, which turns without end"));
    // No errors at all.
    let none = folder.file("none.toml", "machine = \"Huron K2X8-Five\"\n");
    let (page, said) = self::page(&folder, 0, &[&huron()[0], &none]);
    assert!(said.contains("there is nothing to correct"), "{said}");
    assert!(text(&page).contains("The error file has no parameters"));
    let report = figures(&[&huron()[0], &none]);
    assert_eq!(report.volumetric.before.translation_um.max, 0.0);
    // Six axes, of which W goes along Z.
    let six = read(&huron()[0])
        .replace("wCAYFXZSt", "wCAYFXZWSt")
        .replace(
            "[spindle]",
            "[[axis]]\nname = \"W\"\nbranch = \"tool\"\nrange = [-30.0, 30.0]\n\n[spindle]",
        );
    let six = folder.file("six.toml", six);
    let report = figures(&[&six, &huron()[1]]);
    assert_eq!(report.axes.len(), 6);
    assert_eq!(report.tests.circles.len(), 3);
}

#[test]
fn an_identification_is_shown_and_that_of_another_machine_is_not() {
    let folder = Folder::new();
    let machine = example("kolibri/machine.toml");
    let probings = probings(&folder, &[]);
    let (errors, shown) = (folder.at("errors.toml"), folder.at("identified.html"));
    let line = format!("identify {machine} {probings} --model 10 -o {errors}");
    let arguments = split(&line);
    let json = answer(
        0,
        &[&arguments[..], &["--json", "--report", &shown]].concat(),
    );
    let json = folder.file("identified.json", json);
    let (page, _) = page(&folder, 0, &[&machine, &errors, "--identification", &json]);
    for page in [&page, &read(&shown)] {
        for part in [
            "<h2>Identification",
            "10 parameters from",
            "By ball",
            "(k = 2)",
            "Never probed: Y outside of",
            "A outside of −55.0 to 55.0 deg",
            "not measured",
        ] {
            assert!(text(page).contains(part), "{part}");
        }
    }
    let [huron, its] = huron();
    let report = figures(&[&huron, &its, "--identification", &json]);
    assert!(report.identification.is_none());
    assert!(
        report.remarks[0].contains("identification is left out"),
        "{:?}",
        report.remarks
    );
    refused(
        &["report", &huron, &its, "--json", "--identification", &its],
        &["this is not what `trueaxis identify --json` prints"],
    );
}

#[test]
fn a_report_needs_a_place_and_writes_over_no_input() {
    let folder = Folder::new();
    let [machine, errors] = huron();
    let output = trueaxis(&["report", &machine, &errors]);
    assert_eq!(output.status.code(), Some(2));
    let copy = folder.file("errors.toml", read(&errors));
    refused(
        &["report", &machine, &copy, "-o", &copy],
        &["the output", "is the input"],
    );
    let tables = folder.at("t.trax");
    refused(
        &split(&format!(
            "compile {machine} {errors} -o {tables} --report {tables}"
        )),
        &["--report is for one compensation, and a file of its own"],
    );
    assert_eq!(folder.names(), ["errors.toml"]);
}

#[test]
fn pictures_of_the_readme_are_what_the_command_writes() {
    let folder = Folder::new();
    let ([machine, errors], tables) = (huron(), blob("huron"));
    let pictures = folder.at("pictures");
    done(&format!(
        "report {machine} {errors} {tables} --pictures {pictures}"
    ));
    let mut compared = 0;
    for name in ["budget-tip.svg", "circle-XY.svg"] {
        let shown = format!(
            "{}/../../docs/src/pictures/{name}",
            env!("CARGO_MANIFEST_DIR")
        );
        let written = format!("{pictures}/{name}");
        assert!(
            read(&shown) == read(&written),
            "{name} is another: write it once more with the command that the README names"
        );
        compared += 1;
    }
    assert_eq!(compared, 2);
}

#[test]
fn a_validation_is_shown_as_measured_and_found_beside_its_files() {
    let folder = Folder::new();
    let [machine, its] = huron();
    let errors = folder.file("errors.toml", read(&its));
    let tables = folder.at("machine.trax");
    std::fs::copy(blob("huron"), &tables).unwrap();
    let measured = r#"{"probings": 10, "before": {"rms_um": 39.18, "largest_um": 61.2},
        "after": {"rms_um": 1.68, "largest_um": 3.1}, "probing_um": 2.0, "coverage_um": 4.24,
        "expected_um": 6.1, "is_kept": true}"#;
    let given = folder.file("measured.json", measured);
    let files = [machine.as_str(), &errors, &tables];
    let shown = |files: &[&str]| {
        let (page, _) = page(&folder, 0, files);
        let text = text(&page);
        let parts = [
            "as measured",
            "39",
            "1.7",
            "predicted, at most",
            "6.1",
            "± 4.2 µm",
        ];
        text.contains("Before and after, as measured")
            && parts.iter().all(|part| text.contains(part))
    };
    assert!(!shown(&files));
    assert!(shown(&[&files[..], &["--validation", &given]].concat()));
    folder.file("validation.json", measured);
    assert!(shown(&files));
    // What was not measured takes the limit away.
    let unseen = measured.replace(
        "\"is_kept\"",
        "\"unseen\": [\"EX0C\", \"EZ0A\"], \"is_kept\"",
    );
    let unseen = folder.file("unseen.json", &unseen);
    let (page, _) = page(
        &folder,
        0,
        &[&files[..], &["--validation", &unseen]].concat(),
    );
    let page = text(&page);
    assert!(page.contains("Not measured, and not in it: EX0C, EZ0A."));
    assert!(
        page.contains("predicted from the measured errors") && !page.contains("predicted, at most")
    );
    let report = figures(&files);
    assert_eq!(report.validation.map(|v| v.after.rms_um), Some(1.68));
    assert!(
        report
            .document
            .files
            .iter()
            .any(|file| file.role == "validation")
    );
    // Not that of tables elsewhere.
    assert!(!shown(&[&machine, &its, &tables]));
    refused(
        &["report", &machine, &its, "--json", "--validation", &its],
        &["this is not a validation.json of `trueaxis linuxcnc calibrate`"],
    );
}
