//! Maps of a probed surface as a compensation of Z.

use crate::program::{Folder, answer, done, example, json, plain, refused, trueaxis};

/// Z of the surface at x and y of the workpiece: with a product, which is linear along each axis.
fn height(x: f64, y: f64) -> f64 {
    0.05 + 2e-3 * x - 1e-3 * y + 1e-5 * x * y
}

/// `probe_points.txt` of a grid.
fn points(xs: &[f64], ys: &[f64]) -> String {
    let rows = ys.iter().flat_map(|y| xs.iter().map(move |x| (x, y)));
    rows.map(|(x, y)| format!("{x:.4} {y:.4} {:.6} 0 0 0 0 0 0\n", height(*x, *y)))
        .collect()
}

const XS: [f64; 4] = [-10.0, 20.0, 50.0, 80.0];
const YS: [f64; 3] = [0.0, 25.0, 50.0];

/// Corrections of X, Y and Z in µm at machine positions.
fn corrections(folder: &Folder, trax: &str, positions: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let rows = positions
        .iter()
        .map(|[x, y, z]| format!("{x},{y},{z}\n"))
        .collect::<String>();
    let path = folder.file("path.csv", format!("X,Y,Z\n{rows}"));
    let said = json(&format!("eval {trax} --positions {path}"));
    let axes: Vec<&str> = said["axes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|a| a.as_str().unwrap())
        .collect();
    let order = ["X", "Y", "Z"].map(|letter| axes.iter().position(|a| *a == letter).unwrap());
    let rows = said["corrections"].as_array().unwrap();
    rows.iter()
        .map(|row| {
            order
                .iter()
                .map(|k| row[*k].as_f64().unwrap() * 1e3)
                .collect()
        })
        .collect()
}

#[test]
fn z_follows_a_surface_where_it_was_probed() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let file = folder.file("probe_points.txt", points(&XS, &YS));
    let map = folder.at("map.trax");
    let import = ["import", "points", &file, "--machine", &machine, "--offset"];
    let words = [&import[..], &["X=120.5,Y=80", "-o", &map]].concat();
    let said = answer(0, &words);
    assert!(
        said.contains("X 110.500 to 200.500 in 3 steps, Y 80.000 to 130.000 in 2 steps"),
        "{said}"
    );
    // At points, between them, and beyond.
    let places = [[-10.0, 0.0], [80.0, 50.0], [33.0, 41.0], [0.0, 60.0]];
    let positions = places.map(|[x, y]| [x + 120.5, y + 80.0, -20.0]);
    let found = corrections(&folder, &map, &positions);
    for ([x, y], row) in places.iter().zip(&found) {
        let expected = 1e3 * height(*x, y.min(50.0));
        // Heights have six digits.
        assert!(
            (row[2] - expected).abs() < 2e-3,
            "{x} {y}: {row:?}, {expected}"
        );
        assert_eq!(row[..2], [0.0, 0.0]);
    }

    // Added to a compensation, whose corrections stay.
    let geometry = folder.at("geometry.trax");
    let errors = example("mill-21/errors-21.toml");
    done(&format!(
        "compile {machine} {errors} -o {geometry} --random 500"
    ));
    let both = folder.at("both.trax");
    let add = [
        &import[..],
        &["X=120.5,Y=80", "--add-to", &geometry, "-o", &both],
    ]
    .concat();
    answer(0, &add);
    let [of_geometry, of_both] =
        [&geometry, &both].map(|trax| corrections(&folder, trax, &positions));
    for ((before, after), map) in of_geometry.iter().zip(&of_both).zip(&found) {
        assert_eq!(before[..2], after[..2]);
        assert!(
            (before[2] + map[2] - after[2]).abs() < 1e-4,
            "{before:?} {after:?}"
        );
    }
    // With bounds that hold both, and once only.
    let bound = |trax: &str| {
        let said = json(&format!("inspect {trax}"));
        let axes = said["axes"].as_array().unwrap();
        let z = axes.iter().find(|axis| axis["name"] == "Z").unwrap();
        z["value_bound"].as_f64().unwrap()
    };
    assert!((bound(&geometry) + bound(&map) - bound(&both)).abs() < 1e-6);
    let again = folder.at("again.trax");
    let add = [
        &import[..],
        &["X=120.5,Y=80", "--add-to", &both, "-o", &again],
    ]
    .concat();
    refused(&add, &["it has a map of Z already"]);
}

#[test]
fn what_cannot_be_meant_is_refused() {
    let folder = Folder::new();
    let machine = example("mill-21/machine.toml");
    let deep: String = points(&XS, &YS)
        .lines()
        .map(|line| {
            let [x, y, z, ..] = line.split(' ').collect::<Vec<_>>()[..] else {
                panic!("{line}")
            };
            format!("{x} {y} {}\n", z.parse::<f64>().unwrap() - 35.0)
        })
        .collect();
    let file = folder.file("points.txt", &deep);
    let map = folder.at("map.trax");
    let import = |offset: &'static str, more: &[&str]| {
        let words = ["import", "points", &file, "--machine", &machine, "-o", &map];
        trueaxis(&[&words[..], &["--offset", offset], more].concat())
    };
    for (offset, more, expected) in [
        ("X=100,Y=80", &[][..], "need a bound of more than 2 mm"),
        (
            "X=9000,Y=80",
            &[],
            "the points reach from 8990.000 to 9080.000 of X, whose travel is",
        ),
        ("X=100,Y=80", &["--unit", "inch"], "the points reach from"),
        (
            "X=100,Y=80",
            &["--zero", "0,60"],
            "--zero: 0, 60 is outside of the points",
        ),
        ("X=100,Q=80", &[], "--offset"),
        (
            "X=100,Y=80",
            &["--zero=0,0", "--add-to", &machine],
            "machine.toml",
        ),
    ] {
        let done = import(offset, more);
        let said = plain(&done.stderr);
        assert_eq!(done.status.code(), Some(2), "{said}");
        assert!(said.contains(expected), "{said}");
        assert!(!std::path::Path::new(&map).exists());
    }
    // Where Z was set.
    assert!(import("X=100,Y=80", &["--zero", "20,25"]).status.success());
    let found = corrections(&folder, &map, &[[120.0, 105.0, 0.0], [110.0, 80.0, 0.0]]);
    assert!(found[0][2].abs() < 2e-3, "{found:?}");
    let expected = 1e3 * (height(10.0, 0.0) - height(20.0, 25.0));
    assert!(
        (found[1][2] - expected).abs() < 2e-3,
        "{found:?} {expected}"
    );
}
