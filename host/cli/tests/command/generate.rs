//! `generate`: code is written, and what is bad input is refused. That it compiles and gives the same bits is tested by
//! `cargo xtask generated`.

use crate::program::{Folder, answer, blob, refused};

#[test]
fn the_language_is_that_of_the_name_or_the_option() {
    let folder = Folder::new();
    let huron = blob("huron");
    let few = ["--compared", "5000"];
    let write = |name: &str, more: &[&str]| {
        let out = folder.at(name);
        let arguments = [&["generate", &huron, "-o", &out], &few[..], more].concat();
        let said = answer(0, &arguments);
        assert!(said.contains("the same bits as"), "{said}");
        std::fs::read_to_string(out).unwrap()
    };
    for code in [write("a.rs", &[]), write("a.txt", &["--lang", "rust"])] {
        assert!(code.contains("pub fn evaluate(inputs: &[f32; 5]) -> [f32; 5] {"));
        assert!(!code.contains("FACTS"));
    }
    assert!(write("b.rs", &["--servo"]).contains("pub static FACTS"));
    let c = write("a.c", &["--function", "mill"]);
    assert!(c.contains("void mill(const float inputs[5], float corrections[5]);"));
    assert!(!c.contains("trueaxis.h"));
    let for_servo = write("b.c", &["--function", "mill", "--servo"]);
    for part in [
        "#include \"trueaxis.h\"",
        "#if TRUEAXIS_AXES < 5",
        "const trueaxis_generated mill_generated = {",
    ] {
        assert!(for_servo.contains(part), "{part}");
    }
    // Of the machine, the file, its checksum and what it corrects.
    let head = c.lines().take(4).collect::<Vec<_>>().join(" ");
    for part in ["Huron K2X8-Five", "checksum", "direction", "trueaxis"] {
        assert!(head.contains(part), "{head}");
    }
}

#[test]
fn bad_input_writes_nothing() {
    let folder = Folder::new();
    let huron = blob("huron");
    let (out, rust) = (folder.at("code"), folder.at("a.rs"));
    refused(
        &["generate", &huron, "-o", &out],
        &["which language", ".rs or .c"],
    );
    refused(
        &["generate", &folder.file("x.trax", "TRAX"), "-o", &rust],
        &["x.trax", "as `trueaxis compile` writes it"],
    );
    refused(
        &["generate", &huron, "-o", &huron, "--lang", "c"],
        &["the output", "another name"],
    );
    assert_eq!(folder.names(), ["x.trax"]);
}
