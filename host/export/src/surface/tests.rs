use super::{Format, read};
use crate::refusals::are_refused;
use proptest::prelude::*;

/// Three by two equal points of each program: x 10, 20, 30; y −5, 5.
const ROWS: &str = "10.0000 -5.0000 0.10 0 0 0 0 0 0\n20 -5 0.2\n30.0 -5.0 0.3\n\n# second row, first once too high\n\
                    30,5,0.65\n30,5,0.6\n20\t5\t0.5\n10 5 0.4\n";
const BCNC: &str = "10 30 3\n-5 5 2\n-10 3 100\n\n\n10 -5 0.1\n20 -5 0.2\n30 -5 0.3\n\n10 5 0.4\n20 5 0.5\n30 5 0.6\n\n";
const CANDLE: &str = "candle map v3\r\n10;-5;20;10\r\n10;-5\r\n3;2;-1;1;100\r\n0;10;10\r\n0.1;0.2;0.3\r\n0.4;0.5;0.6\r\n";
const CANDLE_1: &str = "10;-5;20;10\r\n3;2;-1;1\r\n1;10;10\r\n0.1;0.2;0.3\r\n0.4;0.5;0.6\r\n";
const PILOT: &str = "\u{feff}<?xml version=\"1.0\" encoding=\"utf-8\"?>\r\n\
    <heightmap MinX=\"10\" MinY=\"-5\" MaxX=\"30\" MaxY=\"5\" SizeX=\"3\" SizeY=\"2\">\r\n  <point X=\"0\" Y=\"0\">0.1</point>\r\n  \
    <point X=\"0\" Y=\"1\">0.4</point>\r\n  <point X=\"1\" Y=\"0\">0.2</point>\r\n  <point X=\"1\" Y=\"1\">0.5</point>\r\n  \
    <point X=\"2\" Y=\"0\">0.3</point>\r\n  <point X=\"2\" Y=\"1\">0.6</point>\r\n</heightmap>";

const FILES: [(&str, Format); 5] = [
    (ROWS, Format::Rows),
    (BCNC, Format::Bcnc),
    (CANDLE, Format::Candle),
    (CANDLE_1, Format::Candle),
    (PILOT, Format::CncPilot),
];

#[test]
fn every_program_writes_the_same_map() {
    for (text, format) in FILES {
        let (map, found) = read(text).unwrap();
        assert_eq!(found, format);
        let [x, y] = [0, 1].map(|k| map.grid.nodes[k]);
        assert_eq!((x.start, x.step, x.count), (10.0, 10.0, 3), "{format:?}");
        assert_eq!((y.start, y.step, y.count), (-5.0, 10.0, 2), "{format:?}");
        let values: Vec<f64> = map.grid.values.iter().map(|[v]| *v).collect();
        assert_eq!(values, [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], "{format:?}");
    }
}

#[test]
fn a_heading_may_name_the_columns_in_their_order() {
    let (expected, _) = read(ROWS).unwrap();
    for heading in ["x,y,z", "X Y Z A B C U V W", "# probed\nx_mm, y_mm, z_mm"] {
        let (map, _) = read(&format!("{heading}\n{ROWS}")).unwrap();
        assert_eq!(map, expected, "{heading}");
    }
}

#[test]
fn what_is_not_a_complete_grid_is_refused() {
    for (text, expected) in [
        ("", "no points"),
        ("# nothing\n", "no points"),
        ("1 2\n", "2 numbers"),
        ("10,5 2,5 -0,012\n", "decimal commas"),
        ("1 2 three\n", "`three` is not a number"),
        ("y,x,z\n1 2 3\n", "`y` is not a number"),
        ("X1 Y2 Z3\n1 2 3\n", "`X1` is not a number"),
        ("1 2 0\n1 3 0\n", "all points have the same X"),
        ("1 2 0\n2 2 0\n", "all points have the same Y"),
        ("<html></html>", "`html` is not a height map"),
        ("<heightmap>", "not a height map of OpenCNCPilot"),
    ] {
        let error = read(text).unwrap_err();
        assert!(error.message.contains(expected), "{}", error.message);
    }
    for (text, rows) in [
        (
            ROWS,
            "20 -5 0.2\\n | | - | 1 of 3 × 2 points are missing, first the one at 20.000, -5.000
20 -5 | 22 -5 | 2 | X = 22 is not one of 4 positions",
        ),
        (BCNC, "20 5 0.5\\n | | 1 | say 6 points, and 5 follow"),
        (
            CANDLE,
            "v3 | v4 | 1 | only the format `candle map v3`
0.4;0.5;0.6\r\\n | | - | ends too early
;0.5 | | 7 | 2 heights, where 3 belong
0.5 | | 7 | a point was not probed
0.5 | 0,5 | 7 | `0,5` is not a number
;20; | ;0; | 4 | the rectangle is 0 × 10",
        ),
        (
            PILOT,
            "<point X=\"1\" Y=\"1\">0.5</point> | | 2 | 1 of 3 × 2 points were not probed
X=\"2\" Y=\"1\" | X=\"3\" Y=\"1\" | 8 | point 3, 1 of 3 × 2
SizeX=\"3\" | SizeX=\"three\" | 2 | SizeX is `three`",
        ),
    ] {
        are_refused(text, rows, read);
    }
}

proptest! {
    /// A changed file is read or refused at a place that it has.
    #[test]
    fn a_changed_file_is_read_or_refused_at_its_place(
        file in 0..FILES.len(), at in any::<prop::sample::Index>(), cut in 0..9_usize,
        with in "[ -~\\n\u{e4}]{0,4}",
    ) {
        let text = FILES[file].0.trim_start_matches('\u{feff}');
        let start = at.index(text.len());
        let text = format!("{}{with}{}", &text[..start], &text[(start + cut).min(text.len())..]);
        if let Err(error) = read(&text) {
            let span = error.span.unwrap_or(0..0);
            prop_assert!(text.get(span).is_some());
            prop_assert!(!error.remedy.is_empty());
        }
    }
}
