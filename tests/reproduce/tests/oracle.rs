//! The most important figures of the page, beside those of a program that shares no code (tests/oracle/figures.py).

use serde_json::Value;
use std::process::Command;

/// Beginning of the chapter and row of the page, quantity, name in the program's answer if it is another one, and how far
/// they may be apart.
///
/// Two searches for the ball with central differences end within a hundredth of a mm, of which the page shows a tenth, as of
/// a µm. Ball and stylus of the page are fitted to exact poses, those of the program to first order; its polynomials are
/// those of corrections of first order (0.3 µm), without points of tables (0.2 µm). In Table 6-7 the page has 1.85 µm of
/// noise in each coordinate: 0.25 µm in a mean of 60, of which two standard deviations, and 1.85 µm in a single length, the
/// largest of some. The program reads every tenth position of the ball-bar. Random commands decide by a node. 2000 random
/// positions of lengths that scatter by half of their mean: 1.1 %, of which three.
const ROWS: &str = "\
Chapter 5 | place of the ball: x, y, z | | | 0.1
Chapter 5 | … misfit of its ten effects | | | 0.1
Chapter 5 | … misfit with the rows as printed | | | 0.1
Chapter 5 | mean: before | raw | | 0.1
Chapter 5 | RMS along X / Y / Z: before | raw | RMS along X / Y / Z: before, raw | 0.1
Chapter 5 | RMS along X / Y / Z: before | set-up-free | RMS along X / Y / Z: before, set-up-free | 0.2
Chapter 5 | … 12 errors | raw | | 0.6
Chapter 6: Table 6-2 | largest of the ten, before: mean at the probings | raw | | 0.1
Chapter 6: Table 6-2 | … maximum | raw | | 0.1
Chapter 6: calibrated | mean: before | raw | mean: before, without tool | 0.1
Chapter 6: calibrated | mean: before | set-up-free | mean: before, set-up-free | 0.5
Chapter 6: calibrated | maximum: before | set-up-free | maximum: before, set-up-free | 5.0
Chapter 4: the ball-bar | form, largest less smallest residual: before | | | 0.15
Chapter 4: the ball-bar | form, standard deviation: before | | | 0.1
Chapter 4: the ball-bar | size: before | | | 0.1
Chapter 4: the ball-bar | largest less smallest reading: before | | | 0.2
Chapter 4: the size | nodes, 13 errors | | | 0.0
Chapter 4: the size | … as measured | | | 1.0
Chapter 7 | mean error: before | raw | | 1.5
Chapter 7 | mean error by EZZ1, before | raw | | 0.3
Chapter 7 | … after, by the parameters of Table 7-2 | raw | mean error: after | 0.4
Chapter 7 | mean error by EB0A, before | raw | | 0.4
Chapter 7 | mean error by EA0Z, before | raw | | 0.7";

fn page() -> Value {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../docs/evidence/reproduced.json"
    );
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// What the page has as ours.
fn ours<'a>(page: &'a Value, chapter: &str, what: &str, quantity: &str) -> &'a Value {
    let begins = |one: &&Value| one["title"].as_str().unwrap().starts_with(chapter);
    let chapters = page["chapters"].as_array().unwrap();
    let mut rows = chapters
        .iter()
        .filter(begins)
        .flat_map(|one| one["compared"].as_array().unwrap());
    let row = rows.find(|row| row["what"] == what && row["quantity"] == quantity);
    &row.unwrap_or_else(|| panic!("{chapter}: {what}, {quantity}"))["ours"]
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
    let centre = numbers(ours(&page, "Chapter 4", "centre: X, Y, Z", ""));
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
    for row in ROWS.lines() {
        let mut cells = row.split('|').map(str::trim);
        let [chapter, what, quantity, name, apart] = [(); 5].map(|()| cells.next().unwrap());
        let name = if name.is_empty() { what } else { name };
        let apart: f64 = apart.parse().unwrap();
        // A grid has as many nodes along each axis.
        let here = numbers(ours(&page, chapter, what, quantity));
        let there = numbers(&found[name]);
        println!("{row}: {here:?} {there:?}");
        assert!(!there.is_empty() && here.len() >= there.len(), "{row}");
        for (here, there) in here.iter().zip(&there) {
            assert!((here - there).abs() <= apart, "{row}: {here} {there}");
        }
    }
}
