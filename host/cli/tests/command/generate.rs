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
    let symbol = "void mill_i5_t0_w0_c5(const float inputs[5], float corrections[5])";
    assert!(c.contains(symbol) && c.contains("#include \"a.h\""));
    let header = std::fs::read_to_string(folder.at("a.h")).unwrap();
    for part in [
        "#ifndef MILL_H",
        "#define MILL_INPUTS 5",
        "#define MILL_CHECKSUM 0x",
        symbol,
        "static inline void mill(const float inputs[5], float corrections[5])",
    ] {
        assert!(header.contains(part), "{part}: {header}");
    }
    assert!(!header.contains("trueaxis.h"));
    assert!(!c.contains("trueaxis.h"));
    let for_servo = write("b.c", &["--function", "mill", "--servo"]);
    let header = std::fs::read_to_string(folder.at("b.h")).unwrap();
    assert!(header.contains("#include \"trueaxis.h\""));
    assert!(header.contains("extern const trueaxis_generated mill_generated;"));
    for part in [
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
    let header = folder.at("a.h");
    refused(
        &["generate", &huron, "-o", &header, "--lang", "c"],
        &["the header would have this name"],
    );
    refused(
        &["generate", &huron, "-o", &rust, "--function", "mill"],
        &["the language is Rust"],
    );
    assert_eq!(folder.names(), ["x.trax"]);
}
