//! Nominal kinematics compared with the published geometry of LinuxCNC's `xyzac-trt`: a table C on a trunnion A, both
//! in the workpiece branch, X Y Z in the tool branch.
//!
//! The mapping of the parameters is described in the manual (`docs/src/machine-file.md`), and at the head of the files
//! in `examples/linuxcnc-xyzac-trt`, from which the test reads them. By default LinuxCNC turns the table itself by +A
//! and +C. ISO 841 counts an axis that moves the workpiece by the motion of the tool relative to it, which is opposite;
//! `conventional-directions = 1` selects that, and our word for it is `reversed`.

use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_tests::{Fixed, read};

struct Geometry {
    /// x-rot-point, y-rot-point, z-rot-point
    rot: [f64; 3],
    /// y-offset
    dy: f64,
    /// z-offset
    dz: f64,
    /// tool-offset
    dt: f64,
    conventional: bool,
}

impl Geometry {
    /// LinuxCNC's forward kinematics: joints X Y Z (mm), A C (rad) to the pose x y z (mm).
    fn pose(&self, [x, y, z, a, c]: [f64; 5]) -> [f64; 3] {
        let turn = if self.conventional { -1.0 } else { 1.0 };
        let (sa, ca) = (turn * a).sin_cos();
        let (s, c) = (turn * c).sin_cos();
        let [xr, yr, zr] = self.rot;
        let dz = self.dz + self.dt;
        // From the axis A, rotated about it; relative to the axis C, rotated about that.
        let (u, v, w) = (x - xr, y - self.dy - yr, z - dz - zr);
        let (v, w) = (ca * v + sa * w + self.dy, ca * w - sa * v + dz);
        [c * u + s * v + xr, c * v - s * u + yr, w + zr]
    }

    /// The LinuxCNC parameters stated in the comment of a machine file.
    fn of_comment(text: &str) -> Self {
        let pin = |name: &str| -> f64 {
            let mut lines = text
                .lines()
                .filter_map(|line| line.strip_prefix("#   setp xyzac-trt-kins."));
            let value = lines.find_map(|line| line.strip_prefix(name)).unwrap();
            value.split_whitespace().next().unwrap().parse().unwrap()
        };
        Self {
            rot: ["x-rot-point", "y-rot-point", "z-rot-point"].map(pin),
            dy: pin("y-offset"),
            dz: pin("z-offset"),
            dt: pin("tool-offset"),
            conventional: pin("conventional-directions") == 1.0,
        }
    }

    fn compare(&self, machine: &Machine, seed: u64) {
        let errors = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &errors);
        let mut random = Fixed::new(seed);
        for _ in 0..500 {
            let q = random.position(machine);
            let joints = ['X', 'Y', 'Z', 'A', 'C'].map(|l| q[machine.index(l).unwrap()]);
            let mut tip = kinematics.nominal(&q, None).t;
            tip.z += self.dt;
            for (found, expected) in tip.iter().zip(self.pose(joints)) {
                // 1 m in f64, a dozen operations.
                assert!(
                    (found - expected).abs() < 1e-11,
                    "{found} instead of {expected} at {joints:?}"
                );
            }
        }
    }
}

/// X and Y carry the table there, reversed: the tip moves as if they carried the tool.
#[test]
fn the_examples_are_what_linuxcnc_is_told_at_their_heads() {
    for (name, conventional) in [("machine", false), ("machine-conventional", true)] {
        let text = read(&format!("examples/linuxcnc-xyzac-trt/{name}.toml"));
        let geometry = Geometry::of_comment(&text);
        assert_eq!(geometry.conventional, conventional);
        assert!(geometry.rot.iter().all(|r| *r != 0.0) && geometry.dy != 0.0 && geometry.dz != 0.0);
        let machine = Machine::from_toml(&text).unwrap();
        assert_eq!(machine.topology(), "wCAXYFZSt");
        geometry.compare(&machine, 5);
        assert_eq!(Machine::doubts(&text), []);
    }
}

/// The rows of the manual that show the results of `pose`.
#[test]
fn the_manual_shows_poses_of_the_example() {
    let text = read("examples/linuxcnc-xyzac-trt/machine.toml");
    let (machine, geometry) = (
        Machine::from_toml(&text).unwrap(),
        Geometry::of_comment(&text),
    );
    let manual = read("docs/evidence/reproduction.md");
    let mut count = 0;
    for row in manual.lines().filter(|line| line.starts_with("| X = ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let numbers = |cell: &str| -> Vec<f64> {
            let parts = cell
                .split(',')
                .map(|part| part.split(" = ").last().unwrap().trim());
            parts
                .map(|number| number.replace('−', "-").parse().unwrap())
                .collect()
        };
        let (at, shown) = (numbers(cells[1]), numbers(cells[2]));
        let mut position = [0.0; 5];
        for (letter, value) in "XYZAC".chars().zip(&at) {
            position[machine.index(letter).unwrap()] = *value;
        }
        let errors = ErrorModel::perfect(&machine);
        let q = machine.to_kinematic(&position);
        let tip = Kinematics::new(&machine, &errors).nominal(&q, None).t;
        let joints = [at[0], at[1], at[2], at[3].to_radians(), at[4].to_radians()];
        let mut linuxcnc = geometry.pose(joints);
        linuxcnc[2] -= geometry.dt;
        for i in 0..3 {
            assert!((tip[i] - shown[i]).abs() < 5.1e-5, "{row}: {tip}");
            assert!(
                (linuxcnc[i] - shown[i]).abs() < 5.1e-5,
                "{row}: {linuxcnc:?}"
            );
        }
        count += 1;
    }
    assert_eq!(count, 3);
}
