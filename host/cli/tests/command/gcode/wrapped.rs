//! Rotary axes that go round for ever.

use super::five_axes::run;
use super::{refuses_with, words};
use crate::program::blob;

const WRAPPED: &str = "[offset.G54]\n[axis.C]\nwrapped = true\n";

#[test]
fn the_sign_of_a_wrapped_word_is_its_direction_in_linuxcnc() {
    let program =
        "G21 G90 G94\nG0 X200 Y150 Z-21 A0 C10\nG1 C100 F5000\nC-10\nC-350\nC20\nC20\nM30\n";
    let (text, said) = run(program, WRAPPED, &[]);
    // 10, 100, down to 10, down to -10, up to 20: no more than 130 degrees at once, and nothing beyond.
    assert_eq!(said["check"]["times_differ"], 0, "{said}");
    assert!(said["check"]["off_urad"].as_f64().unwrap() <= 1.0, "{said}");
    let angles = words(&text, 'C');
    assert!(angles.iter().any(|c| (c + 350.0).abs() < 0.05), "{text}");
    assert!(angles.iter().all(|c| c.abs() < 360.0), "{text}");
    // 30 + 90 + 20 + 30 degrees, and the µm of the linear axes take as long.
    let minutes = said["check"]["minutes"][0].as_f64().unwrap();
    assert!(
        (minutes - (90.0 + 90.0 + 20.0 + 30.0) / 5000.0).abs() < 1e-9,
        "{said}"
    );
}

#[test]
fn fanuc_s_roll_over_takes_the_shorter_way() {
    let program = "G21 G90 G94 G17\nG0 X200. Y150. Z-21. A0. C350.\nG1 C10. F5000.\nC340.\nM30\n";
    let (_, said) = run(program, WRAPPED, &["--dialect", "fanuc"]);
    let minutes = said["check"]["minutes"][0].as_f64().unwrap();
    assert!((minutes - 50.0 / 5000.0).abs() < 1e-9, "{said}");
}

#[test]
fn what_a_wrapped_word_means_must_be_known() {
    let refuses = |program: &str, setup: &str, options: &[&str], parts: &[&str]| {
        let setup = format!("{}{setup}", super::five_axes::START);
        refuses_with(program, [&blob("xyzac-trt"), &setup], options, parts);
    };
    let fanuc = ["--dialect", "fanuc"];
    let start = "G21 G90 G17\nG0 X200. Y150. Z-21. A0. C0.\n";
    let half = format!("{start}G0 C180.\n");
    refuses(
        &half,
        WRAPPED,
        &fanuc,
        &["line 3", "C180.", "half a turn", "two moves"],
    );
    let turn = format!("{start}G0 C360.\n");
    refuses(&turn, WRAPPED, &[], &["line 3", "C360.", "a turn or more"]);
    let machine = format!("{start}G53 G0 C5.\n");
    refuses(
        &machine,
        WRAPPED,
        &[],
        &["line 3", "C5.", "G53 with C", "without G53"],
    );
    refuses(
        start,
        WRAPPED,
        &["--dialect", "grbl"],
        &["[axis.C]", "as far as words say"],
    );
    let x = "[offset.G54]\n[axis.X]\nwrapped = true\n";
    refuses(start, x, &[], &["no rotary axis", "[axis.C]"]);
}
