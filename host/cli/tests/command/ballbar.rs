//! The ball-bar: path, simulation and analysis through the command.

use crate::program::{Folder, answer, example, has, plain, trueaxis};

const CENTRE: &str = "X=12,Y=-7,Z=5";

/// A figure from the JSON output.
fn figure(json: &str, pointer: &str) -> f64 {
    let value: serde_json::Value = serde_json::from_str(json).unwrap();
    let found = value.pointer(pointer).and_then(serde_json::Value::as_f64);
    found.unwrap_or_else(|| panic!("{pointer} in {json}"))
}

#[test]
fn a_hemisphere_is_written_simulated_and_its_readings_analysed() {
    let folder = Folder::new();
    let hu40 = "@hu40/machine.toml @hu40/errors-13.toml";
    folder.answer(&format!("compile {hu40} -o %hu40.trax --random 200"));
    let path = format!("ballbar path @hu40/machine.toml --at {CENTRE} -o %p.ngc");
    let said = folder.answer(&path);
    assert!(said.ends_with(": 19809 positions\n"), "{said}");
    let program = folder.text("p.ngc");
    let positions = program.lines().filter(|line| line.contains('X'));
    assert_eq!(positions.count(), 19_809);
    let options = format!("--at {CENTRE} --steps 180 --compensation %hu40.trax -o %r.csv --json");
    let json = folder.answer(&format!("ballbar simulate {hu40} {options}"));
    let [before, after] = ["/before/form_um", "/after/form_um"].map(|name| figure(&json, name));
    // Squareness of about 100 µrad on a bar of 150 mm; tables of 0.05 µm at both balls.
    assert!(before > 5.0 && after < 0.2, "{json}");
    assert!(figure(&json, "/after/size_um").abs() < 0.1, "{json}");
    let analysed = folder.answer("ballbar analyse %r.csv --json");
    // The file has readings to 0.1 nm, and positions to 0.1 µm.
    for name in ["size_um", "form_um", "form_deviation_um", "rms_um"] {
        let off = figure(&json, &format!("/after/{name}"))
            - figure(&analysed, &format!("/measured/{name}"));
        assert!(off.abs() < 1e-3, "{name}: {off}");
    }
    // Also along X, which carries the workpiece: a positive command moves the tip in negative direction relative to
    // it.
    for axis in 0..3 {
        let [simulated, measured] = [(&json, "after"), (&analysed, "measured")]
            .map(|(json, which)| figure(json, &format!("/{which}/setup_um/{axis}")));
        assert!(
            (simulated - measured).abs() < 1e-3,
            "{axis}: {simulated} {measured}"
        );
    }
}

#[test]
fn squareness_alone_makes_the_form_and_the_circle_that_geometry_says() {
    let folder = Folder::new();
    let name = std::fs::read_to_string(example("mill-21/machine.toml")).unwrap();
    let name = name.lines().find(|line| line.starts_with("name")).unwrap();
    let name = name.replace("name", "machine");
    folder.file(
        "errors.toml",
        format!("{name}\n[parameters]\nEC0X = 40e-6\n"),
    );
    let mill = "@mill-21/machine.toml %errors.toml --at X=250,Y=150,Z=-200 --radius 100";
    let json = folder.answer(&format!("ballbar simulate {mill} --steps 180 --json"));
    // 40 µrad · 100 mm · x y, with x y between -1/2 and 1/2 on a hemisphere: 4 µm. The equator is only travelled on
    // one side, so the least-squares sphere is tilted there and leaves a little more.
    let form = figure(&json, "/before/form_um");
    assert!((4.0..4.4).contains(&form), "{json}");
    folder.answer(&format!(
        "simulate ballbar {mill} --plane XY -o %circle.csv"
    ));
    let json = folder.answer("ballbar analyse %circle.csv --json");
    for pointer in [
        "/circle/g_um/0",
        "/circle/g_um/1",
        "/circle/g_bidirectional_um",
    ] {
        assert!(
            (figure(&json, pointer) - 4.0).abs() < 1e-3,
            "{pointer}: {json}"
        );
    }
    assert!((figure(&json, "/circle/f_max_um") - 2.0).abs() < 1e-3);
    assert!((figure(&json, "/circle/f_min_um") + 2.0).abs() < 1e-3);
    assert!(figure(&json, "/circle/h_um") < 1e-3);
    let said = folder.answer("ballbar analyse %circle.csv");
    assert!(
        said.contains("G(XY) counter-clockwise") && said.contains("H(XY)"),
        "{said}"
    );
}

#[test]
fn what_cannot_be_is_refused() {
    let folder = Folder::new();
    let path = |options: &str, parts: &[&str]| {
        folder.refused(&format!("ballbar path @hu40/machine.toml {options}"), parts);
    };
    path("--at X=5000", &["its travel is", "--at"]);
    let uneven = ["no whole number of steps between 7 meridians", "1400 for 7"];
    path(&format!("--at {CENTRE} --meridians 7"), &uneven);
    path("--at Q=1", &["the machine has no axis `Q`"]);
    let head = "# radius_mm = 100\n# unit = \"um\"\nX,Y,Z,radial\n";
    folder.file(
        "line.csv",
        format!("{head}100,0,0,1\n-100,0,0,2\n100,0,0,1\n"),
    );
    let line = ["do not determine both centre and radius", "hemisphere"];
    folder.refused("ballbar analyse %line.csv", &line);
    folder.file("unknown.csv", "# radius = 100\nangle,ccw\n");
    folder.refused(
        "ballbar analyse %unknown.csv",
        &["radius", "radius_mm = 150.0"],
    );
}

#[test]
fn one_circle_does_not_tell_a_bent_screw_from_a_yaw() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let (truth, circle, found) = (
        folder.at("truth.toml"),
        folder.at("c.csv"),
        folder.at("f.toml"),
    );
    let bent = "machine = \"Mill with 21 errors\"\n[parameters]\nEC0X = -36.9e-6\nEXX1 = 20e-6\nEXX2 = 1e-7\n";
    folder.file("truth.toml", bent);
    for seed in ["1", "2", "3"] {
        let at = [
            "--plane",
            "XY",
            "--at",
            "X=150,Y=150,Z=-200",
            "--radius",
            "150",
        ];
        let noise = ["--noise", "0.5", "--seed", seed, "-o", &circle];
        answer(
            0,
            &[&["simulate", "ballbar", &machine, &truth], &at[..], &noise].concat(),
        );
        let told = trueaxis(&["identify", &machine, &circle, "-o", &found]);
        let text = std::fs::read_to_string(&found).unwrap();
        let value = |line: &str| line.split_once("= ").unwrap().1.parse::<f64>().unwrap();
        let mut lines = text
            .lines()
            .filter(|line| line.starts_with("EC0X = "))
            .map(value);
        let [is, uncertainty] = [(); 2].map(|()| lines.next().unwrap());
        // Three standard uncertainties: three trials.
        assert!((is + 36.9e-6).abs() < 3.0 * uncertainty, "{text}");
        assert!(uncertainty < 1e-6 && !text.contains("\nECY1 = "), "{text}");
        has(
            &plain(&told.stderr),
            "these measurements do not tell which it is",
        );
    }
}
