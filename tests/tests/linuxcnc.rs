//! Nominal kinematics against the published geometry of LinuxCNC's `xyzac-trt`: a table C on a
//! trunnion A, both in the workpiece branch, X Y Z in the tool branch.
//!
//! How the parameters map (LinuxCNC's pins left):
//!
//! | LinuxCNC | machine.toml |
//! |---|---|
//! | `x-rot-point`, `y-rot-point`, `z-rot-point` | `origin_mm` of C |
//! | `y-offset`, `z-offset` (from there to the axis A) | `origin_mm` of A is that of C + (0, dy, dz) |
//! | `tool-offset` dt | `tip_mm = [0, 0, -dt]`; LinuxCNC's z is that of the tip + dt |
//! | `conventional-directions = 0` (its default) | A and C as they are |
//! | `conventional-directions = 1` | A and C `reversed = true` |
//!
//! By default LinuxCNC turns the table itself by +A and +C. ISO 841 counts an axis that moves the
//! workpiece by the motion of the tool relative to it, the other way; `conventional-directions = 1`
//! does that, and `reversed` is our word for it.

use trueaxis_host::errors::ErrorModel;
use trueaxis_host::kinematics::Kinematics;
use trueaxis_host::machine::Machine;
use trueaxis_tests::Fixed;

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
        // From the axis A, turned about it, seen from the axis C, turned about that.
        let (u, v, w) = (x - xr, y - self.dy - yr, z - dz - zr);
        let (v, w) = (ca * v + sa * w + self.dy, ca * w - sa * v + dz);
        [c * u + s * v + xr, c * v - s * u + yr, w + zr]
    }

    fn machine(&self) -> Machine {
        let [x, y, z] = self.rot;
        let (ay, az) = (y + self.dy, z + self.dz);
        let (reversed, dt) = (self.conventional, self.dt);
        Machine::from_toml(&format!(
            r#"
name = "xyzac-trt"
topology = "wCAFXYZSt"
[[axis]]
name = "A"
branch = "workpiece"
origin_mm = [{x:?}, {ay:?}, {az:?}]
range = [-120.0, 120.0]
reversed = {reversed}
[[axis]]
name = "C"
branch = "workpiece"
origin_mm = [{x:?}, {y:?}, {z:?}]
range = [-360.0, 360.0]
reversed = {reversed}
[[axis]]
name = "X"
branch = "tool"
range = [-300.0, 300.0]
[[axis]]
name = "Y"
branch = "tool"
range = [-200.0, 200.0]
[[axis]]
name = "Z"
branch = "tool"
range = [-250.0, 100.0]
[spindle]
axis = "z"
[tool]
tip_mm = [0.0, 0.0, {:?}]
"#,
            -dt
        ))
        .unwrap()
    }

    fn compare(&self, seed: u64) {
        let machine = self.machine();
        let errors = ErrorModel::perfect(&machine);
        let kinematics = Kinematics::new(&machine, &errors);
        let mut random = Fixed::new(seed);
        for _ in 0..500 {
            let q = random.position(&machine);
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

#[test]
fn the_pose_of_xyzac_trt_is_reproduced() {
    let plain = Geometry {
        rot: [0.0; 3],
        dy: 0.0,
        dz: 0.0,
        dt: 0.0,
        conventional: false,
    };
    plain.compare(1);
    Geometry {
        rot: [12.5, -30.0, 44.0],
        dy: -7.25,
        dz: 21.5,
        dt: 0.0,
        conventional: false,
    }
    .compare(2);
    Geometry {
        rot: [12.5, -30.0, 44.0],
        dy: -7.25,
        dz: 21.5,
        dt: 81.3,
        conventional: false,
    }
    .compare(3);
}

#[test]
fn conventional_directions_are_reversed_axes() {
    Geometry {
        rot: [-3.0, 8.0, -60.0],
        dy: 15.0,
        dz: -9.5,
        dt: 120.0,
        conventional: true,
    }
    .compare(4);
}
