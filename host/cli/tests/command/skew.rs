//! `export klipper`, `export marlin` and `export reprapfirmware`: their output, and what they refuse.

use crate::program::{Folder, answer, blob, plain, refused, trueaxis};

/// The router with squareness and scales only.
fn square(folder: &Folder) -> String {
    let text = "machine = \"Router\"\n[parameters]\nEC0X = 310e-6\nEB0Z = 240e-6\nEXX1 = 120e-6\n";
    folder.file("errors.toml", text);
    folder.answer("compile @router/machine.toml %errors.toml -o %router.trax --random 500");
    folder.at("router.trax")
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
            said.contains("more than 1 µm remains, and nothing is written"),
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

/// From lengths that somebody measured to the machine, and to what Klipper is told: the same lengths.
#[test]
fn measured_diagonals_become_a_machine_that_klipper_corrects_by_the_same_diagonals() {
    let folder = Folder::new();
    let [machine, errors] = ["machine.toml", "errors.toml"].map(|name| folder.at(name));
    let files = ["--machine", &machine, "--errors", &errors];
    let lengths = ["--xy", "141.32,141.51,100", "--yz", "141.5,141.3,100"];
    refused(&[&["skew"], &lengths[..], &files].concat(), &["--travel"]);
    let travel = ["--travel", "235,235,250"];
    let said = answer(0, &[&["skew"], &lengths[..], &travel, &files].concat());
    // (141.32² − 141.51²) / (4 · 100 · 100.007)
    assert!(
        said.contains("Y leans by 0.134 mm per 100 mm away from X"),
        "{said}"
    );
    folder.answer("compile %machine.toml %errors.toml -o %p.trax --random 500");
    folder.answer("export klipper %p.trax -o %skew.cfg --random 2000");
    let lines = folder.text("skew.cfg");
    for (plane, wanted) in [
        ("XY=", [141.32, 141.51, 100.0]),
        ("YZ=", [141.5, 141.3, 100.0]),
    ] {
        let start = lines.find(plane).unwrap() + 3;
        let text = lines[start..].split_whitespace().next().unwrap();
        let found: Vec<f64> = text.split(',').map(|n| n.parse().unwrap()).collect();
        let lean = |l: &[f64]| (l[0] * l[0] - l[1] * l[1]) / (2.0 * (l[0] * l[0] + l[1] * l[1]));
        // Tables are within 0.05 µm over 235 mm.
        assert!((lean(&found) - lean(&wanted)).abs() < 5e-7, "{lines}");
    }
    // Merged: another plane is added, this one is replaced, and what else is there stays.
    let mut text = std::fs::read_to_string(&errors).unwrap();
    text = text.replace("[parameters]\n", "[parameters]\nEZX2 = 4e-6 # mine\n");
    std::fs::write(&errors, &text).unwrap();
    folder.answer(
        "skew --xz 141.5,141.3,100 --xy 141.51,141.32,100 --machine %machine.toml --errors %errors.toml",
    );
    let merged = std::fs::read_to_string(&errors).unwrap();
    assert!(merged.contains("EZX2 = 4e-6 # mine\n"), "{merged}");
    let values = |text: &str| -> Vec<String> {
        let names = ["EA0", "EB0", "EC0"];
        let of = |line: &&str| names.iter().any(|n| line.starts_with(n));
        text.lines().filter(of).map(str::to_owned).collect()
    };
    let (before, after) = (values(&text), values(&merged));
    assert_eq!((before.len(), after.len()), (3, 4), "{merged}");
    for bad in ["100,141,100,3", "10,141,100"] {
        refused(&[&["skew", "--xy", bad], &files[..]].concat(), &["--xy: "]);
    }
    assert_eq!(std::fs::read_to_string(&errors).unwrap(), merged);
    // The uncertainty of what is replaced goes with it, and a covariance file is refused.
    let of_xy = values(&merged)
        .into_iter()
        .find(|line| line.starts_with("EC0"));
    let name = of_xy.unwrap()[..4].to_owned();
    let rest = merged.lines().filter(|line| !line.starts_with(&name));
    let rest = rest.collect::<Vec<_>>().join("\n");
    let again = [&["skew", "--xy", "141.51,141.32,100"], &files[..]].concat();
    for (text, section) in [(&merged, "standard_uncertainty"), (&rest, "unseen")] {
        let mine = format!("\n[{section}]\nEXX3 = 2e-6\n");
        std::fs::write(&errors, format!("{text}{mine}{name} = 1e-6\n")).unwrap();
        answer(0, &again);
        let new = std::fs::read_to_string(&errors).unwrap();
        assert!(new.ends_with(&mine), "{new}");
        assert_eq!(new.matches(&name).count(), 1, "{new}");
    }
    folder.file("c.csv", format!("parameter,{name}\n{name},1e-12\n"));
    let text = format!("{merged}\n[uncertainty]\ncovariance = \"c.csv\"\n");
    std::fs::write(&errors, &text).unwrap();
    refused(&again, &["covariance file", &name, "[uncertainty]"]);
    assert_eq!(std::fs::read_to_string(&errors).unwrap(), text);
}
