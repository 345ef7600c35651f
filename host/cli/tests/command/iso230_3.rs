//! Thermal drift to ISO 230-3.

use crate::program::Folder;
use std::fmt::Write;

/// Ten hours in a hall whose temperature swings by 2 K, with sensors that follow it: 3 µm/K in X1, 5 µm/K in Z.
fn environment() -> String {
    let mut text = "# test = \"environment\"\ntime_s,x1_um,z_um,air_C\n".to_owned();
    for k in 0..=60 {
        let time = f64::from(k) * 600.0;
        let kelvin = libm::sin(std::f64::consts::TAU * time / 36_000.0);
        let _ = writeln!(
            text,
            "{time},{:.4},{:.4},{:.4}",
            3.0 * kelvin,
            5.0 * kelvin,
            20.0 + kelvin
        );
    }
    text
}

#[test]
fn ranges_values_and_pictures_are_written() {
    let folder = Folder::new();
    folder.file("hall.csv", environment());
    let said = folder.answer("iso230-3 %hall.csv --at 150,450 --pictures %drift");
    let head = "ETVE (ISO 230-3, clause 5)\n61 readings in 600.0 min\n";
    assert!(said.contains(head), "{said}");
    // Swings of ±1 K; the extremes are read at 150 and 450 min.
    let row = |name: &str| {
        let line = said.lines().find(|line| line.starts_with(name)).unwrap();
        line.split_whitespace()
            .skip(2)
            .map(str::to_owned)
            .collect::<Vec<_>>()
    };
    assert_eq!(row("X1"), ["6.00", "3.00", "-3.00"]);
    assert_eq!(row("Z"), ["10.00", "5.00", "-5.00"]);
    assert_eq!(row("air"), ["2.00", "21.00", "19.00"]);
    for (name, words) in [
        ("displacement", "displacement (µm)"),
        ("temperature", "temperature (°C)"),
    ] {
        let picture = folder.text(&format!("drift/{name}.svg"));
        assert!(
            picture.contains(words) && picture.contains("time (h)"),
            "{name}"
        );
    }
    let json = folder.answer("iso230-3 %hall.csv --at 150 --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    let z = &json["results"][0]["drifts"][1];
    assert_eq!(
        (z["name"].as_str(), z["unit"].as_str()),
        (Some("Z"), Some("µm"))
    );
    assert!(
        (z["range"].as_f64().unwrap() - 10.0).abs() < 1e-9
            && (z["at"][0].as_f64().unwrap() - 5.0).abs() < 1e-9
    );
}

#[test]
fn bad_readings_and_times_are_refused() {
    let folder = Folder::new();
    folder.file("hall.csv", environment());
    for minutes in ["700", "-1", "nan"] {
        let parts = ["nothing was read after", "write times up to 600.0 min"];
        folder.refused(&format!("iso230-3 %hall.csv --at={minutes}"), &parts);
    }
    folder.file("bad.csv", environment().replacen("600,0", "600,O", 1));
    let parts = [
        "bad.csv, line 4",
        "column 2 (x1_um)",
        "is not a finite number",
    ];
    folder.refused("iso230-3 %bad.csv", &parts);
    folder.file("empty.csv", "");
    folder.refused("iso230-3 %empty.csv", &["empty.csv", "the file is empty"]);
    let no_folder = folder.run("iso230-3 %hall.csv --pictures %bad.csv");
    assert_eq!(no_folder.status.code(), Some(2));
}
