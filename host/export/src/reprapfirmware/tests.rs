use super::*;
use crate::refusals::are_refused;
use proptest::prelude::*;

/// `HeightMap::GetInterpolatedHeightError` of RepRapFirmware on the text, from its description, in its single precision.
pub(crate) fn by_firmware(text: &str, at: [f64; 2]) -> f64 {
    let lines: Vec<&str> = text.lines().collect();
    let p: Vec<f32> = lines[2]
        .split(',')
        .filter_map(|word| word.parse().ok())
        .collect();
    let [low, spacing, count] = [[p[0], p[2]], [p[5], p[6]], [p[7], p[8]]];
    let rows: Vec<Vec<f32>> = (lines[3..].iter())
        .map(|line| line.split(',').map(|word| word.parse().unwrap()).collect())
        .collect();
    let cell = |k: usize| {
        let last = low[k] + (count[k] - 1.0) * spacing[k] - 0.01;
        let along = ((at[k] as f32).max(low[k]).min(last) - low[k]) * (1.0 / spacing[k]);
        (along.floor() as usize, along - along.floor())
    };
    let ((i, x), (j, y)) = (cell(0), cell(1));
    let xy = x * y;
    (rows[j][i] * (1.0 - x - y + xy)
        + rows[j][i + 1] * (x - xy)
        + rows[j + 1][i] * (y - xy)
        + rows[j + 1][i + 1] * xy)
        .into()
}

fn map() -> HeightMap {
    let nodes = [Nodes::over([0.0, 300.0], 7), Nodes::over([-30.0, 170.0], 4)];
    HeightMap::new(SampledGrid::of(&nodes, |p| {
        [0.05 * libm::sin(p[0] * 0.01) - 2e-4 * p[1]]
    }))
}

proptest! {
    #[test]
    fn a_map_is_evaluated_as_the_firmware_does(x in -50.0..400.0_f64, y in -100.0..300.0_f64) {
        let text = print(&map());
        let again = read(&text).unwrap();
        // Single precision of positions up to 300 mm in cells of 50 mm, on slopes of up to 5e-4: 1e-8 mm; and of values.
        prop_assert!((correction(&again, [x, y]) - by_firmware(&text, [x, y])).abs() < 1e-7);
        // Values are written to 0.1 µm; the last 0.01 mm are cut off on a slope of 5e-4 at most.
        prop_assert!((correction(&again, [x, y]) - map().grid.at(&[x, y])[0]).abs() < 0.5e-4 + 1e-5);
    }
}

#[test]
fn lines_fit_into_the_memory_of_the_firmware() {
    let nodes = [
        Nodes::over([0.0, 800.0], MOST_ALONG),
        Nodes::over([0.0, 90.0], 2),
    ];
    let text = print(&HeightMap::new(SampledGrid::of(&nodes, |_| [-9.99994])));
    assert!(
        text.lines()
            .skip(2)
            .all(|line| line.len() <= MOST_ALONG * 8 + 2)
    );
}

/// All generations, as firmwares of their time write them.
const FILES: [&str; 3] = [
    "RepRapFirmware height map file v2\nxmin,xmax,ymin,ymax,radius,spacing,xnum,ynum\n0.00,20.00,0.00,10.00,-1.00,10.00,3,2\n  0.010,      0, -0.020\n  0.030,  0.040,  0.000\n",
    "RepRapFirmware height map file v2 generated at 2020-05-01 10:00, mean error 0.01, deviation 0.02\nxmin,xmax,ymin,ymax,radius,xspacing,yspacing,xnum,ynum\n0.00,20.00,0.00,10.00,-1.00,10.00,10.00,3,2\n  0.010,      0, -0.020\n  0.030,  0.040,  0.000\n",
    "RepRapFirmware height map file v2 generated at 2023-05-01 10:00, min error -0.020, max error 0.040, mean 0.01, deviation 0.02\r\naxis0,axis1,min0,max0,min1,max1,radius,spacing0,spacing1,num0,num1\r\nX,Y,0.00,20.00,0.00,10.00,-1.00,10.00,10.00,3,2\r\n  0.010,      0, -0.020\r\n  0.030,  0.040,  0.000\r\n",
];

#[test]
fn maps_of_all_generations_are_read() {
    for text in FILES {
        let map = read(text).unwrap();
        let touches = [
            [0.0, 0.0, 0.01],
            [20.0, 0.0, -0.02],
            [0.0, 10.0, 0.03],
            [10.0, 10.0, 0.04],
            [20.0, 10.0, 0.0],
        ];
        assert_eq!(map.touches(), touches);
    }
    // The first firmware with maps called them v1.
    let first = FILES[0].replace("file v2", "file v1");
    assert_ne!(first, FILES[0]);
    assert_eq!(read(&first).unwrap(), read(FILES[0]).unwrap());
}

#[test]
fn what_the_firmware_would_not_read_is_refused_with_its_line() {
    let rows = "v2 | v3 | 1 | does not begin
xmin | x0 | 2 | does not know
,3,2 | ,3 | 3 | 8 parameters
,3,2 | ,3,1 | 3 | `1` is not a number of points
10.00,10.00,3 | 10.00,0.00,3 | 3 | less than the firmware
 0.040, | | 5 | 2 heights
0.040 | inf | 5 | `inf` is not a number
0.040 | 40 | 5 | 40 mm is no height
0.040,  0.000\\n | 0.040,  0.000\\n  0.030,  0.040,  0.000\\n | 6 | more rows of heights
-0.020\\n  0.030,  0.040,  0.000\\n | -0.020\\n | - | ends too early";
    are_refused(FILES[1], rows, read);
    let letters =
        "X,Y, | X,Z, | 3 | a map over `X` and `Z`\nX,Y, | Y,X, | 3 | a map over `Y` and `X`";
    are_refused(FILES[2], letters, read);
    assert!(read("").unwrap_err().message.contains("ends too early"));
}
