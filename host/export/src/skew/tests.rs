use super::*;
use nalgebra::Vector3;
use proptest::prelude::*;
use trueaxis_model::errors::{ErrorModel, Situation, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_tables::compile::{Options, build};

const ALL: [Firmware; 3] = [
    Firmware::Klipper,
    Firmware::Marlin,
    Firmware::RepRapFirmware,
];

proptest! {
    #[test]
    fn what_is_written_is_read_again(xy in -0.02..0.02_f64, xz in -0.02..0.02_f64, yz in -0.02..0.02_f64) {
        let skew = Skew { x_by_y: xy, x_by_z: xz, y_by_z: yz };
        for firmware in ALL {
            let again = firmware.read(&firmware.print(&skew).unwrap()).unwrap();
            for (one, other) in [(xy, again.x_by_y), (xz, again.x_by_z), (yz, again.y_by_z)] {
                // Nine decimals of a factor, or of a diagonal of 141 mm; 1e-9 of 1 m is 1 nm.
                prop_assert!((one - other).abs() < 1e-9, "{firmware:?}: {one} {other}");
            }
        }
    }
}

#[test]
fn a_skew_that_is_too_large_is_refused() {
    let skew = Skew {
        x_by_y: -1.5,
        ..Skew::default()
    };
    let refused = Firmware::Marlin.print(&skew).unwrap_err().cause;
    assert!(refused.contains("more than the firmware accepts"));
    assert!(Firmware::Marlin.read("M852 I0.1 J0").is_err());
}

/// Portals and tables: the axes are carried in different orders.
const MACHINES: [&str; 2] = [
    include_str!("../../../../examples/router/machine.toml"),
    include_str!("../../../../examples/mill-21/machine.toml"),
];

/// Squarenesses of any kind that a machine has (rad), as the firmware would get them, make it true: exact poses of the
/// corrected machine keep all distances.
#[test]
fn a_corrected_machine_keeps_the_distances_between_points() {
    for text in MACHINES {
        let machine = Machine::from_toml(text).unwrap();
        let names = ["EC0X", "EB0X", "EC0Y", "EA0Y", "EA0Z", "EB0Z"];
        let known = names
            .iter()
            .enumerate()
            .map(|(k, name)| format!("{name} = {:e}\n", 1e-4 * libm::sin((k + 1) as f64 * 1.7)));
        let known: Vec<String> = known
            .filter(|line| ErrorModel::from_toml(&file(&machine, line), &machine).is_ok())
            .collect();
        assert!(known.len() >= 3, "{known:?}");
        let errors = ErrorModel::from_toml(&file(&machine, &known.concat()), &machine).unwrap();
        let options = Options {
            random: 100,
            ..Options::default()
        };
        let built = build(&machine, &errors, &options, &()).unwrap();
        let runtime = Runtime::load(&built.blob).unwrap();
        let kinematics = Kinematics::new(&machine, &errors);
        for firmware in ALL {
            let (written, found) = skew(&runtime, firmware, None, 500, 1).unwrap();
            let text = written.lines;
            for axis in found.axes {
                // Tables within 0.05 µm, and the tip's own rotation over 1 m with squares of 0.1 mrad: 0.01 µm.
                assert!(axis.left_um < 0.1, "{firmware:?}: {found:?}");
            }
            let [ix, iy, iz] = ['X', 'Y', 'Z'].map(|letter| machine.index(letter).unwrap());
            let tip = |[x, y, z]: [f64; 3]| {
                let mut q = PerAxis::default();
                [q[ix], q[iy], q[iz]] = by_firmware(firmware, &text, [x, y, z]);
                kinematics
                    .actual(&q, &Situation::default(), &Switches::ALL)
                    .t
            };
            let travel = [ix, iy, iz].map(|i| machine.axes[i].travel);
            let corner = |k: usize| [0, 1, 2].map(|i| travel[i][k >> i & 1]);
            for (i, j) in (0..8).flat_map(|i| (0..i).map(move |j| (i, j))) {
                let nominal = Vector3::from(corner(i)) - Vector3::from(corner(j));
                let actual = tip(corner(i)) - tip(corner(j));
                // As above, on a diagonal.
                let off = (nominal.norm() - actual.norm()).abs() * 1e3;
                assert!(off < 0.3, "{firmware:?}: {off} µm\n{text}");
            }
        }
    }
}

/// With a map, a bent bridge is no obstacle: the firmware adds the height at the skewed position.
#[test]
fn with_a_height_map_a_bent_bridge_keeps_the_distances_between_points() {
    let machine = Machine::from_toml(MACHINES[0]).unwrap();
    let parameters = "EC0X = 310e-6\nEA0Z = -180e-6\nEB0Z = 240e-6\nEZX2 = 4e-7\nEZY1 = 5e-5\n";
    let errors = ErrorModel::from_toml(&file(&machine, parameters), &machine).unwrap();
    let options = Options {
        random: 100,
        ..Options::default()
    };
    let built = build(&machine, &errors, &options, &()).unwrap();
    let runtime = Runtime::load(&built.blob).unwrap();
    let kinematics = Kinematics::new(&machine, &errors);
    let [ix, iy, iz] = ['X', 'Y', 'Z'].map(|letter| machine.index(letter).unwrap());
    for firmware in [Firmware::Klipper, Firmware::RepRapFirmware] {
        let (written, found) = skew(&runtime, firmware, Some([21, 21]), 2000, 1).unwrap();
        let without = skew(&runtime, firmware, None, 2000, 1).unwrap().1;
        let map = written.map.unwrap();
        // Cells of 40 mm on a curvature of 8e-7 per mm: 0.16 µm in the middle; RepRapFirmware's steps: 0.05 µm.
        assert!(found.axes[2].left_um < 0.3, "{found:?}");
        assert!(without.axes[2].left_um > 30.0, "{without:?}");
        let tip = |p: [f64; 3]| {
            let skewed = by_firmware(firmware, &written.lines, p);
            let height = match firmware {
                Firmware::Klipper => {
                    crate::klipper::bed_mesh::by_klipper(&map, [skewed[0], skewed[1]])
                }
                _ => crate::reprapfirmware::by_firmware(&map, [skewed[0], skewed[1]]),
            };
            let mut q = PerAxis::default();
            [q[ix], q[iy], q[iz]] = [skewed[0], skewed[1], skewed[2] + height];
            kinematics
                .actual(&q, &Situation::default(), &Switches::ALL)
                .t
        };
        let at = |k: usize| {
            let step = |axis: usize, k: usize, of: f64| {
                let [low, high] = machine.axes[axis].travel;
                low + (high - low) * k as f64 / of
            };
            [
                step(ix, k % 4, 3.0),
                step(iy, k / 4 % 4, 3.0),
                step(iz, k / 16, 1.0),
            ]
        };
        for (i, j) in (0..32).flat_map(|i| (0..i).map(move |j| (i, j))) {
            let nominal = Vector3::from(at(i)) - Vector3::from(at(j));
            let off = (nominal.norm() - (tip(at(i)) - tip(at(j))).norm()).abs() * 1e3;
            // Two heights as above, and squares of 0.3 mrad over 1.4 m: 0.06 µm.
            assert!(off < 0.5, "{firmware:?}: {off} µm");
        }
    }
}

#[test]
fn a_map_that_the_firmware_cannot_hold_is_refused() {
    let nodes = [Nodes::over([0.0, 800.0], 30), Nodes::over([0.0, 90.0], 20)];
    let map = HeightMap::new(SampledGrid::of(&nodes, |_| [0.0]));
    for firmware in [Firmware::RepRapFirmware, Firmware::Marlin] {
        assert_eq!(firmware.height_map(&map).unwrap_err().remedy, MAP);
    }
}

fn file(machine: &Machine, parameters: &str) -> String {
    format!("machine = \"{}\"\n[parameters]\n{parameters}", machine.name)
}

/// What a firmware does to a command, from its own source, whose names of numbers are kept: `calc_skew` of Klipper,
/// `Planner::skew` of Marlin, `Move::AxisTransform` of RepRapFirmware.
fn by_firmware(firmware: Firmware, text: &str, [x, y, z]: [f64; 3]) -> [f64; 3] {
    let numbers: Vec<f64> = text
        .split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'))
        .filter_map(|word| word.parse().ok())
        .collect();
    match (firmware, &numbers[..]) {
        (Firmware::RepRapFirmware, [_, height, a, b, c]) => {
            let (tan_xy, tan_yz, tan_xz) = (a / height, b / height, c / height);
            [x + tan_xy * y + tan_xz * z, y + tan_yz * z, z]
        }
        (Firmware::Marlin, [_, _, xy, xz, yz]) => [x - y * xy - z * (xz - xy * yz), y - z * yz, z],
        (Firmware::Klipper, lengths) => {
            let factor = |k: usize| {
                let [ac, bd, ad] = [0, 1, 2].map(|i| lengths[3 * k + i]);
                let side = (2.0 * ac * ac + 2.0 * bd * bd - 4.0 * ad * ad).sqrt() / 2.0;
                let cosine = (ac * ac - side * side - ad * ad) / (2.0 * side * ad);
                libm::tan(std::f64::consts::FRAC_PI_2 - libm::acos(cosine))
            };
            let (xy, xz, yz) = (factor(0), factor(1), factor(2));
            [x - y * xy - z * (xz - xy * yz), y - z * yz, z]
        }
        _ => panic!("{text}"),
    }
}
