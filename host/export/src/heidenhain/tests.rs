use super::*;
use crate::refusals::are_refused;
use crate::rigid_body::MACHINES;
use nalgebra::Vector3;
use trueaxis_model::errors::{Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::PerAxis;

/// On a portal (Y carries X carries Z), errors of each axis, read from the text, add up with the levers behind them.
#[test]
fn the_tables_move_the_tip_of_a_portal_back() {
    let machine = Machine::from_toml(MACHINES[0].0).unwrap();
    let errors = ErrorModel::from_toml(MACHINES[0].1, &machine).unwrap();
    let kinematics = Kinematics::new(&machine, &errors);
    for angles in [Angles::Deg, Angles::Rad] {
        let (files, left) = export(&machine, &errors, 81, angles, 300, 1).unwrap();
        assert_eq!(files.iter().map(|f| f.axis).collect::<String>(), "YXZ");
        assert!(left.tip_before_um > 100.0 && left.tip_um < 25.0, "{left:?}");
        let error = |letter: char, at: f64| -> [f64; 6] {
            let file = files.iter().find(|file| file.axis == letter).unwrap();
            let rows: Vec<Vec<f64>> = (file.text.lines().skip(3))
                .map(|line| line.split(',').map(|w| w.parse().unwrap()).collect())
                .collect();
            let k = rows
                .iter()
                .rposition(|row| row[1] <= at)
                .unwrap()
                .min(rows.len() - 2);
            let t = (at - rows[k][1]) / (rows[k + 1][1] - rows[k][1]);
            std::array::from_fn(|i| {
                let value = rows[k][i + 2] * (1.0 - t) + rows[k + 1][i + 2] * t;
                match (i < 3, angles) {
                    (false, Angles::Deg) => value.to_radians(),
                    _ => value,
                }
            })
        };
        let tip = Vector3::new(0.0, 0.0, -60.0);
        for [x, y, z] in [
            [10.0, 20.0, -5.0],
            [790.0, 1100.0, -140.0],
            [400.0, 33.0, -77.7],
        ] {
            // Behind each axis, the tip as it stands: from the point that moves with the axis.
            let behind = [
                ("Y", Vector3::new(x, 0.0, z)),
                ("X", Vector3::new(0.0, 0.0, z)),
                ("Z", Vector3::zeros()),
            ];
            let mut sum = Vector3::zeros();
            for ((letter, further), at) in behind.into_iter().zip([y, x, z]) {
                let [ex, ey, ez, a, b, c] = error(letter.chars().next().unwrap(), at);
                sum += Vector3::new(ex, ey, ez) + Vector3::new(a, b, c).cross(&(further + tip));
            }
            let corrected: PerAxis = {
                let mut q = PerAxis::default();
                for (letter, p) in
                    ["X", "Y", "Z"]
                        .into_iter()
                        .zip([x - sum.x, y - sum.y, z - sum.z])
                {
                    q[machine.index(letter.chars().next().unwrap()).unwrap()] = p;
                }
                q
            };
            let actual = kinematics
                .actual(&corrected, &Situation::default(), &Switches::ALL)
                .t;
            let off = (actual - Vector3::new(x, y, z) - tip).norm() * 1e3;
            // Second order: 0.3 mrad squared over 1.2 m, and a parabola between points.
            assert!(off < 0.4, "{off} µm");
        }
    }
}

#[test]
fn a_table_that_is_not_whole_is_refused_with_its_line() {
    let machine = Machine::from_toml(MACHINES[0].0).unwrap();
    let errors = ErrorModel::from_toml(MACHINES[0].1, &machine).unwrap();
    let (files, _) = export(&machine, &errors, 3, Angles::Rad, 10, 1).unwrap();
    let text = &files[0].text;
    assert_eq!(text.lines().count(), 6);
    let rows = ",C5 | ,C7 | 3 | no column C5
,600.000000 | ,-600.000000 | 5 | must increase
,600.000000 | ,much | 5 | `much` is not a number
,600.000000 | | 5 | 7 values below 8 names";
    are_refused(text, rows, |text| read(text, Angles::Rad));
    let error = read("", Angles::Rad).unwrap_err();
    assert!(error.message.contains("ends too early"));
}
