use super::*;
use crate::refusals::are_refused;
use proptest::prelude::*;

/// `ZMesh.calc_z` of Klipper for `algo = direct`, from its description.
pub(crate) fn by_klipper(text: &str, [x, y]: [f64; 2]) -> f64 {
    let option = |key: &str| -> &str {
        let mut lines = text.lines().map(|line| line.split_once(" = "));
        lines
            .find_map(|line| line.filter(|(k, _)| *k == key))
            .unwrap()
            .1
    };
    let number = |key: &str| option(key).parse::<f64>().unwrap();
    assert_eq!(
        [option("version"), option("algo"), option("mesh_x_pps")],
        ["1", "direct", "0"]
    );
    let points: Vec<Vec<f64>> = (text.lines().filter(|line| line.starts_with("  ")))
        .map(|line| line.split(',').map(|p| p.trim().parse().unwrap()).collect())
        .collect();
    let cell = |at: f64, low: f64, high: f64, count: f64| {
        let apart = (high - low) / (count - 1.0);
        let index = ((at - low) / apart).floor().max(0.0).min(count - 2.0);
        let t = ((at - (low + apart * index)) / apart).clamp(0.0, 1.0);
        (t, index as usize)
    };
    let (tx, i) = cell(x, number("min_x"), number("max_x"), number("x_count"));
    let (ty, j) = cell(y, number("min_y"), number("max_y"), number("y_count"));
    let along = |row: &Vec<f64>| (1.0 - tx) * row[i] + tx * row[i + 1];
    (1.0 - ty) * along(&points[j]) + ty * along(&points[j + 1])
}

fn map() -> HeightMap {
    let nodes = [
        Nodes::over([10.0, 210.0], 5),
        Nodes::over([-20.0, 100.0], 4),
    ];
    HeightMap::new(SampledGrid::of(&nodes, |p| {
        [1e-3 * libm::sin(p[0] * 0.1) - 2e-5 * p[1]]
    }))
}

proptest! {
    #[test]
    fn a_profile_is_evaluated_as_klipper_does(x in -50.0..300.0_f64, y in -50.0..200.0_f64) {
        let text = print(&map(), "p");
        let again = read(&text, Some("p")).unwrap();
        // The same numbers in another order of operations.
        prop_assert!((correction(&again, [x, y]) - by_klipper(&text, [x, y])).abs() < 1e-12);
        // Values are written to 1 nm.
        prop_assert!((correction(&again, [x, y]) - map().grid.at(&[x, y])[0]).abs() < 0.6e-6);
    }
}

/// As `SAVE_CONFIG` stores it, beside other sections.
const SAVED: &str = "[bed_mesh]\nspeed: 120\nmesh_min: 5, 5\n[printer]\nkinematics: corexy\n\n\
#*# <---------------------- SAVE_CONFIG ---------------------->\n#*# DO NOT EDIT THIS BLOCK OR BELOW.\n#*#\n\
#*# [bed_mesh cold]\n#*# version = 1\n#*# points =\n#*# \t  0.010000, -0.020000\n#*# \t  0.030000, 0.000000\n#*# \t  0.1, 0.2\n\
#*# x_count = 2\n#*# y_count = 3\n#*# mesh_x_pps = 2\n#*# algo = lagrange\n#*# tension = 0.2\n#*# min_x = 5.0\n#*# max_x = 25.0\n\
#*# min_y = 0.0\n#*# max_y = 40.0\n#*# mesh_y_pps = 2\n";

#[test]
fn a_profile_is_read_as_it_is_saved() {
    let map = read(SAVED, None).unwrap();
    assert_eq!(
        map.grid.nodes,
        [Nodes::over([5.0, 25.0], 2), Nodes::over([0.0, 40.0], 3)]
    );
    let touches = map.touches();
    assert_eq!(touches.len(), 6);
    assert_eq!(touches[1], [25.0, 0.0, -0.02]);
    assert_eq!(touches[4], [5.0, 40.0, 0.1]);
    // Of sections with one name, Klipper makes one; what comes later wins.
    let more = SAVED.to_owned() + "#*# [bed_mesh cold]\n#*# max_y = 50.0\n";
    let nodes = read(&more, None).unwrap().grid.nodes;
    assert_eq!(nodes[1], Nodes::over([0.0, 50.0], 3));
}

#[test]
fn what_klipper_would_not_use_is_refused_with_its_line() {
    let two = SAVED.to_owned() + "#*# [bed_mesh hot]\n#*# version = 1\n";
    for (text, profile, line, message) in [
        ("[bed_mesh]\n".to_owned(), None, None, "no stored profile"),
        (SAVED.to_owned(), Some("hot"), None, "no profile `hot`"),
        (two.clone(), None, None, "several profiles"),
        (two, Some("hot"), Some(26), "has no `min_x`"),
    ] {
        let error = read(&text, profile).unwrap_err();
        assert!(error.message.contains(message), "{error:?}");
        assert_eq!(error.line(&text), line, "{error:?}");
    }
    let rows = "version = 1 | version = 0 | 11 | version 0
-0.02 | -90 | 13 | -900000 mm is no height
-0.02 | x | 13 | `x0000` is not a number
, 0.2 | | 15 | 1 points, where x_count is 2
y_count = 3 | y_count = 4 | 12 | 3 rows of points
y_count = 3 | y_count = 1e9 | 17 | `1e9` is not a number of points
max_x = 25.0 | max_x = 5 | 22 | not after the start";
    are_refused(SAVED, rows, |text| read(text, None));
}

/// A profile of `count` × `count` points over a square, with all heights zero.
fn square(bed: &str, count: usize, [low, high]: [f64; 2]) -> String {
    let rows = format!("  {}\n", vec!["0.0"; count].join(", ")).repeat(count);
    format!(
        "{bed}\n[bed_mesh default]\nversion = 1\npoints =\n{rows}x_count = {count}\ny_count = {count}\n\
         min_x = {low}\nmax_x = {high}\nmin_y = {low}\nmax_y = {high}\n"
    )
}

/// The number of points in each row that were probed.
fn probed_in_rows(text: &str) -> Vec<usize> {
    let map = read(text, None).unwrap();
    let rows = map.probed.chunks(map.grid.nodes[0].count);
    rows.map(|row| row.iter().filter(|probed| **probed).count())
        .collect()
}

#[test]
fn only_points_within_the_radius_of_a_round_bed_were_probed() {
    // Steps of 33.33 mm: points with i² + j² ≤ (100 / 33.33)² = 9.002.
    let text = "[bed_mesh]\nmesh_radius: 100.04\nmesh_origin: 150, 150\n";
    let text = square(text, 7, [50.01, 249.99]);
    assert_eq!(probed_in_rows(&text), [1, 5, 5, 7, 5, 5, 1]);
    // The middles of the rows, where the row is not full.
    let map = read(&text, None).unwrap();
    assert_eq!(map.probed[..7], [0, 0, 0, 1, 0, 0, 0].map(|one| one == 1));
    // Steps of 10 mm: the points on the circle, as 30 and 40 mm, count. A circle of radius 5 has 81 whole points.
    let text = square("[bed_mesh]\nmesh_radius: 50\n", 11, [-50.0, 50.0]);
    assert_eq!(probed_in_rows(&text).iter().sum::<usize>(), 81);
    for (from, to) in [
        ("mesh_radius: 50", "mesh_radius: 60"),
        ("mesh_radius: 50", "mesh_radius: 50\nmesh_origin: 5, 0"),
    ] {
        let other = text.replace(from, to);
        let error = read(&other, None).unwrap_err();
        assert!(error.message.contains("another mesh_radius"), "{error:?}");
        assert_eq!(error.line(&other), Some(2));
    }
}

#[test]
fn points_in_a_faulty_region_were_not_probed() {
    let bed = "[bed_mesh]\nfaulty_region_1_min: 20, 10\nfaulty_region_1_max: 0, 20\n\
               faulty_region_2_min: 35, 35\nfaulty_region_2_max: 45, 45\n";
    // Points at 0, 10 … 40: three by two, ends included, and one.
    let text = square(bed, 5, [0.0, 40.0]);
    assert_eq!(probed_in_rows(&text), [5, 2, 2, 5, 4]);
    let text = text.replace("faulty_region_2_max: 45, 45", "faulty_region_2_max: 45");
    let error = read(&text, None).unwrap_err();
    assert!(error.message.contains("needs two numbers"), "{error:?}");
    let elsewhere = square("[include bed.cfg]", 5, [0.0, 40.0]);
    let error = read(&elsewhere, None).unwrap_err();
    assert_eq!(error.line(&elsewhere), Some(1), "{error:?}");
}

#[test]
fn the_first_row_of_points_may_stand_beside_the_key() {
    let beside = SAVED.replace("points =\n#*# \t ", "points =");
    assert_ne!(beside, SAVED);
    assert_eq!(read(&beside, None).unwrap(), read(SAVED, None).unwrap());
}
