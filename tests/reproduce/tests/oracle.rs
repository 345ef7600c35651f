//! The most important figures of the page, beside those of a program that shares no code (tests/oracle/figures.py).

use serde_json::Value;
use std::process::Command;

const CHAPTER_4: &str = "Chapter 4: the size of a grid";
const BALL_BAR: &str = "Chapter 4: the ball-bar";
const CHAPTER_5: &str = "Chapter 5: polynomials of two models";
const TABLE_6_2: &str = "Chapter 6: Table 6-2, one error at a time";
const TABLE_6_7: &str = "Chapter 6: calibrated and validated, with noise";
const CHAPTER_7: &str = "Chapter 7: tables of the closed form";

/// Chapter, row and quantity of the page, name in the program's answer, and how far they may be apart.
const ROWS: [(&str, &str, &str, &str, f64); 23] = [
    // Two searches with central differences end within a hundredth of a mm; the page shows a tenth.
    (
        CHAPTER_5,
        "place of the ball: x, y, z",
        "",
        "place of the ball: x, y, z",
        0.1,
    ),
    (
        CHAPTER_5,
        "… misfit of its ten effects",
        "",
        "… misfit of its ten effects",
        0.1,
    ),
    (
        CHAPTER_5,
        "… misfit with the rows as printed",
        "",
        "… misfit with the rows as printed",
        0.1,
    ),
    // Shown to a tenth of a µm.
    (CHAPTER_5, "mean: before", "raw", "mean: before", 0.1),
    (
        CHAPTER_5,
        "RMS along X / Y / Z: before",
        "raw",
        "RMS along X / Y / Z: before, raw",
        0.1,
    ),
    // Ball and stylus of the page are fitted to exact poses, those of the program to first order.
    (
        CHAPTER_5,
        "RMS along X / Y / Z: before",
        "set-up-free",
        "RMS along X / Y / Z: before, set-up-free",
        0.2,
    ),
    // Polynomials of the program are those of corrections of first order (0.3 µm), without points of tables (0.2 µm).
    (CHAPTER_5, "… 12 errors", "raw", "… 12 errors", 0.6),
    (
        TABLE_6_2,
        "largest of the ten, before: mean at the probings",
        "raw",
        "largest of the ten, before: mean at the probings",
        0.1,
    ),
    (TABLE_6_2, "… maximum", "raw", "… maximum", 0.1),
    // The page has 1.85 µm of noise in each coordinate: 0.25 µm in a mean of 60, of which two standard deviations, and
    // 1.85 µm in a single length, the largest of some.
    (
        TABLE_6_7,
        "mean: before",
        "raw",
        "mean: before, without tool",
        0.1,
    ),
    (
        TABLE_6_7,
        "mean: before",
        "set-up-free",
        "mean: before, set-up-free",
        0.5,
    ),
    (
        TABLE_6_7,
        "maximum: before",
        "set-up-free",
        "maximum: before, set-up-free",
        5.0,
    ),
    // The program reads every tenth position, and the page shows a tenth of a µm.
    (
        BALL_BAR,
        "form, largest less smallest residual: before",
        "",
        "form, largest less smallest residual: before",
        0.15,
    ),
    (
        BALL_BAR,
        "form, standard deviation: before",
        "",
        "form, standard deviation: before",
        0.1,
    ),
    (BALL_BAR, "size: before", "", "size: before", 0.1),
    (
        BALL_BAR,
        "largest less smallest reading: before",
        "",
        "largest less smallest reading: before",
        0.2,
    ),
    (CHAPTER_4, "nodes, 13 errors", "", "nodes, 13 errors", 0.0),
    // Random commands decide by a node.
    (CHAPTER_4, "… as measured", "", "… as measured", 1.0),
    // 2000 random positions of lengths that scatter by half of their mean: 1.1 %, of which three.
    (
        CHAPTER_7,
        "mean error: before",
        "raw",
        "mean error: before",
        1.5,
    ),
    (
        CHAPTER_7,
        "mean error by EZZ1, before",
        "raw",
        "mean error by EZZ1, before",
        0.3,
    ),
    (
        CHAPTER_7,
        "… after, by the parameters of Table 7-2",
        "raw",
        "mean error: after",
        0.4,
    ),
    (
        CHAPTER_7,
        "mean error by EB0A, before",
        "raw",
        "mean error by EB0A, before",
        0.4,
    ),
    (
        CHAPTER_7,
        "mean error by EA0Z, before",
        "raw",
        "mean error by EA0Z, before",
        0.7,
    ),
];

fn page() -> Value {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../docs/evidence/reproduced.json"
    );
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// What the page has as ours.
fn ours<'a>(page: &'a Value, title: &str, what: &str, quantity: &str) -> &'a Value {
    let chapters = page["chapters"].as_array().unwrap();
    let chapter = chapters.iter().find(|chapter| chapter["title"] == title);
    let rows = chapter.unwrap_or_else(|| panic!("{title}"))["compared"]
        .as_array()
        .unwrap();
    let row = rows
        .iter()
        .find(|row| row["what"] == what && row["quantity"] == quantity);
    &row.unwrap_or_else(|| panic!("{title}: {what}, {quantity}"))["ours"]
}

/// The numbers in a figure: one, or those of a text.
fn numbers(figure: &Value) -> Vec<f64> {
    match figure.as_f64() {
        Some(number) => vec![number],
        None => (figure.as_str().unwrap())
            .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
            .filter_map(|word| word.parse().ok())
            .collect(),
    }
}

#[test]
fn the_most_important_figures_are_those_of_rigid_bodies() {
    let python = std::env::var("PYTHON").unwrap_or("python3".to_owned());
    let has = Command::new(&python)
        .args(["-c", "import tomllib, numpy"])
        .output();
    if !has.is_ok_and(|output| output.status.success()) {
        eprintln!(
            "NOT RUN: figures beside tests/oracle/figures.py, which needs Python 3.11 and numpy"
        );
        return;
    }
    let page = page();
    let centre = numbers(ours(&page, BALL_BAR, "centre: X, Y, Z", ""));
    let output = Command::new(&python)
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../oracle/figures.py"))
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples"))
        .args(centre.iter().map(f64::to_string))
        .env("OMP_NUM_THREADS", "1")
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let found: Value = serde_json::from_slice(&output.stdout).unwrap();
    for (title, what, quantity, name, apart) in ROWS {
        // A grid has as many nodes along each axis.
        let (here, there) = (
            numbers(ours(&page, title, what, quantity)),
            numbers(&found[name]),
        );
        println!("{what}, {quantity}: {here:?} {there:?}");
        assert!(
            !there.is_empty() && here.len() >= there.len(),
            "{title}: {what}"
        );
        for (here, there) in here.iter().zip(&there) {
            assert!(
                (here - there).abs() <= apart,
                "{title}: {what}: {here} {there}"
            );
        }
    }
}
