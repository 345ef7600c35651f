//! The pages about the source document's figures in `docs/evidence` equal the output of `cargo xtask reproduce`.

use serde_json::Value;
use trueaxis_reproduce::{page, reproduce};
use trueaxis_tests::shown::same;

fn manual(name: &str) -> String {
    let path = format!("{}/../../docs/evidence/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// Pages or pictures are equal if their words are equal, and their numbers to a unit in the last digit.
#[track_caller]
fn shows(name: &str, written: &str) {
    let shown = manual(name);
    let (mut shown, mut written) = (shown.lines(), written.lines());
    loop {
        match (shown.next(), written.next()) {
            (None, None) => return,
            (Some(shown), Some(written)) => assert!(
                same(written, shown, 0.0),
                "{name} shows\n{shown}\nbut it is\n{written}\n(cargo xtask reproduce writes it)"
            ),
            ends => panic!("{name} is longer or shorter: {ends:?}"),
        }
    }
}

/// The numbers of a picture, which are whole drawing units, and everything between them.
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
    // As much stack as a program has; a test has a quarter of that.
    let computing = std::thread::Builder::new().stack_size(8 << 20);
    let computing = computing.spawn(|| reproduce(&()).unwrap()).unwrap();
    let found = computing.join().unwrap();
    shows("reproduced.md", &page(&found));
    let json = serde_json::to_string_pretty(&found).unwrap();
    shows("reproduced.json", &json);
    let json: Value = serde_json::from_str(&json).unwrap();
    let chapters = json["chapters"].as_array().unwrap();
    let (mut fixed, mut pictures, mut compared) = (0, 0, 0);
    for chapter in chapters {
        for one in chapter["fixed"].as_array().unwrap() {
            assert_eq!(one["holds"], true, "{one}");
            fixed += 1;
        }
        assert_ne!(chapter["source"], "", "{}", chapter["title"]);
        for one in chapter["compared"].as_array().unwrap() {
            assert!(one["ours"] != Value::Null, "{one}");
            // A row that differs by more than a tenth says why; one of Chapters 5 to 7 in µm says what it is.
            let far = match (one["document"].as_f64(), one["ours"].as_f64()) {
                (Some(document), Some(ours)) => (ours - document).abs() > 0.1 * document.abs(),
                _ => false,
            };
            assert!(!far || one["why"].is_string(), "{one}");
            let title = chapter["title"].as_str().unwrap();
            let is_tip = one["unit"] == "µm"
                && ["5", "6", "7"]
                    .iter()
                    .any(|n| title.starts_with(&format!("Chapter {n}")));
            assert!(!is_tip || one["quantity"] != "", "{one}");
            compared += 1;
        }
    }
    for picture in found.chapters.iter().flat_map(|chapter| &chapter.pictures) {
        let name = format!("pictures/{}.svg", picture.name);
        let ((numbers, words), (shown, shown_words)) =
            (parts(&picture.svg()), parts(&manual(&name)));
        assert_eq!(words, shown_words, "{name}");
        assert_eq!(numbers.len(), shown.len(), "{name}");
        // A unit is a quarter of a CSS pixel.
        let near = numbers
            .iter()
            .zip(&shown)
            .all(|(a, b)| (a - b).abs() <= 1.0);
        assert!(near, "{name}: run cargo xtask reproduce");
        pictures += 1;
    }
    // Ensures that this test has something to compare.
    assert!(
        fixed >= 10 && pictures >= 5 && compared >= 150,
        "{fixed} {pictures} {compared}"
    );
    assert!(json["not_reproduced"].as_array().unwrap().len() >= 10);
}
