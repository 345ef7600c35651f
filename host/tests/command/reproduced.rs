//! What the manual shows of the source document's figures is what `trueaxis reproduce` writes.

use crate::program::{Folder, answer, refused};
use crate::shown::same;
use serde_json::Value;
use std::path::Path;

fn manual(name: &str) -> String {
    let path = format!("{}/../docs/src/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// A page, or a picture, is the same where its words are, and its numbers to a unit of their last digit.
#[track_caller]
fn shows(name: &str, written: &str) {
    let shown = manual(name);
    let (mut shown, mut written) = (shown.lines(), written.lines());
    loop {
        match (shown.next(), written.next()) {
            (None, None) => return,
            (Some(shown), Some(written)) => assert!(
                same(written, shown, 0.0),
                "{name} shows\n{shown}\nbut it is\n{written}\n(trueaxis reproduce -o docs/src writes it)"
            ),
            ends => panic!("{name} is longer or shorter: {ends:?}"),
        }
    }
}

/// Numbers of a picture, which are whole units of the drawing, and everything between them.
fn parts(svg: &str) -> (Vec<f64>, String) {
    let (mut numbers, mut words) = (Vec::new(), String::new());
    for part in svg.split_inclusive(|c: char| !c.is_ascii_digit() && c != '.') {
        let number = part.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
        match number.parse() {
            Ok(value) => numbers.push(value),
            Err(_) => words.push_str(number),
        }
        words.push_str(&part[number.len()..]);
    }
    (numbers, words)
}

#[test]
fn the_manual_shows_what_is_recomputed_and_what_is_fixed_from_outside_holds() {
    let folder = Folder::new();
    let at = folder.at("written");
    let said = answer(0, &["reproduce", "-o", &at]);
    let read = |name: &str| std::fs::read_to_string(Path::new(&at).join(name)).unwrap();
    for name in ["reproduced.md", "reproduced.json"] {
        shows(name, &read(name));
    }
    let json: Value = serde_json::from_str(&read("reproduced.json")).unwrap();
    let chapters = json["chapters"].as_array().unwrap();
    let (mut fixed, mut arithmetic, mut pictures, mut compared) = (0, 0, 0, 0);
    for chapter in chapters {
        for one in chapter["fixed"].as_array().unwrap() {
            assert_eq!(one["holds"], true, "{one}");
            fixed += 1;
        }
        for one in chapter["arithmetic"].as_array().unwrap() {
            assert_eq!(one["holds"], true, "{one}");
            arithmetic += 1;
        }
        for one in chapter["compared"].as_array().unwrap() {
            assert!(one["ours"] != Value::Null, "{one}");
            compared += 1;
        }
        for picture in chapter["pictures"].as_array().unwrap() {
            let name = format!("pictures/{}.svg", picture["name"].as_str().unwrap());
            let ((numbers, words), (shown, shown_words)) =
                (parts(&read(&name)), parts(&manual(&name)));
            assert_eq!(words, shown_words, "{name}");
            assert_eq!(numbers.len(), shown.len(), "{name}");
            // A quarter of a CSS pixel is a unit.
            let near = numbers
                .iter()
                .zip(&shown)
                .all(|(a, b)| (a - b).abs() <= 1.0);
            assert!(near, "{name}: run trueaxis reproduce -o docs/src");
            pictures += 1;
        }
    }
    // So that this test does not end up with nothing to look at.
    assert!(
        fixed >= 7 && arithmetic >= 15 && pictures >= 5 && compared >= 150,
        "{fixed} {arithmetic} {pictures} {compared}"
    );
    assert!(json["not_reproduced"].as_array().unwrap().len() >= 10);
    assert!(said.contains("reproduced.md, reproduced.json"), "{said}");
}

#[test]
fn what_would_be_in_the_way_is_refused_before_anything_is_computed() {
    let folder = Folder::new();
    let file = folder.file("taken", "text");
    refused(&["reproduce", "-o", &file], &["taken", "cannot be made"]);
    assert_eq!(folder.names(), ["taken"]);
}
