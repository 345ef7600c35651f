//! `export klipper`, `export marlin` and `export reprapfirmware`: their output, and what they refuse.

use crate::program::{Folder, answer, blob, example, plain, refused, trueaxis};

/// The router with squareness and scales only.
fn square(folder: &Folder) -> String {
    let text = "machine = \"Router\"\n[parameters]\nEC0X = 310e-6\nEB0Z = 240e-6\nEXX1 = 120e-6\n";
    let errors = folder.file("errors.toml", text);
    let blob = folder.at("router.trax");
    answer(
        0,
        &[
            "compile",
            &example("router/machine.toml"),
            &errors,
            "-o",
            &blob,
            "--random",
            "500",
        ],
    );
    blob
}

#[test]
fn what_is_left_decides_whether_lines_are_written() {
    let folder = Folder::new();
    let blob = square(&folder);
    for firmware in ["klipper", "marlin", "reprapfirmware"] {
        let out = folder.at(firmware);
        let words = ["export", firmware, &blob, "-o", &out, "--random", "2000"];
        let done = trueaxis(&words);
        // The scale of X is 120 µm/m over 800 mm.
        assert_eq!(done.status.code(), Some(1));
        let said = plain(&done.stderr);
        assert!(
            said.contains("more than 1 µm is left, and nothing is written"),
            "{said}"
        );
        assert!(!std::path::Path::new(&out).exists());
        let said = answer(0, &[&words[..], &["--steps-changed"]].concat());
        assert!(said.contains("0.999880"), "{said}");
        assert!(
            said.starts_with(&std::fs::read_to_string(&out).unwrap()),
            "{said}"
        );
    }
    let lines = std::fs::read_to_string(folder.at("marlin")).unwrap();
    assert!(lines.starts_with("G21\nM852 I"), "{lines}");
}

#[test]
fn axes_that_these_firmwares_do_not_have_are_refused() {
    let folder = Folder::new();
    let out = folder.at("out");
    let words = ["export", "marlin", &blob("kolibri"), "-o", &out];
    refused(
        &words,
        &["axes YACXZ", "correct X, Y and Z", "trueaxis gcode"],
    );
    assert!(folder.names().is_empty());
}
