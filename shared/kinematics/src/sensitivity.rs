//! Effect of each error on a point of the tool, from the exact chain.

use crate::nominal::Link;
use crate::{Htm, Kinematics, MAX_AXES, PerAxis, Situation};
use nalgebra::{Matrix3, Matrix3x6, Vector3};

/// A point of the tool in the workpiece frame, and its derivatives with respect to every error of every axis. The
/// derivatives are exact at the given errors, while [`Linearised`](crate::Linearised) has those of a perfect machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensitivity {
    /// The point (mm, workpiece frame).
    pub point: Vector3<f64>,
    /// Derivative with respect to the point in the spindle frame: mm per mm.
    pub by_tool: Matrix3<f64>,
    /// Derivative with respect to the inter-axis error `[x y z a b c]` of each axis, then of the spindle: mm per mm
    /// or rad.
    pub by_inter: [Matrix3x6<f64>; MAX_AXES + 1],
    /// Derivative with respect to the error motions `[x y z a b c]` of each axis: mm per mm or rad.
    pub by_intra: [Matrix3x6<f64>; MAX_AXES],
}

/// An error Trans(x, y, z) · Rx(a) · Ry(b) · Rz(c) in the chain: how its translations and rotations move the rest of
/// the chain.
#[derive(Clone, Copy)]
struct Joint {
    /// Directions of its translations: the frame before it.
    along: Matrix3<f64>,
    /// Axes of its rotations.
    about: Matrix3<f64>,
    /// Point through which these axes pass.
    through: Vector3<f64>,
}

impl Joint {
    /// An error after a frame, and the frame after the error.
    fn after(frame: &Htm, error: &[f64; 6]) -> (Self, Htm) {
        let next = *frame * Htm::from_xyz_abc(*error);
        // b turns about y as rotated by a, c about z as rotated by both.
        let turned = Htm::from_xyz_abc([0.0, 0.0, 0.0, error[3], 0.0, 0.0]);
        let y = frame.r * turned.r.column(1);
        let about =
            Matrix3::from_columns(&[frame.r.column(0).into_owned(), y, next.r.column(2).into()]);
        let joint = Self {
            along: frame.r,
            about,
            through: next.t,
        };
        (joint, next)
    }

    /// Movement of a point (foundation frame), relative to a frame with this rotation.
    fn moves(&self, point: &Vector3<f64>, seen: &Matrix3<f64>, way: f64) -> Matrix3x6<f64> {
        let lever = point - self.through;
        let mut columns = Matrix3x6::zeros();
        for i in 0..3 {
            columns.set_column(i, &self.along.column(i).into_owned());
            columns.set_column(3 + i, &self.about.column(i).cross(&lever));
        }
        seen.transpose() * columns * way
    }
}

impl<P: AsRef<[f64]>> Kinematics<'_, P> {
    /// Position of a point of the spindle frame (mm), such as a stylus tip, at the command `q` (mm, rad) with all
    /// errors, and the effect of each error on it.
    #[must_use]
    pub fn sensitivity(
        &self,
        q: &PerAxis,
        situation: &Situation,
        in_spindle: &Vector3<f64>,
    ) -> Sensitivity {
        let n = self.machine.axes.len();
        let identity = Htm::identity();
        let nothing = Joint::after(&identity, &[0.0; 6]).0;
        let mut inter = [nothing; MAX_AXES + 1];
        let mut intra = [nothing; MAX_AXES];
        let mut branch = |links: &[Link]| {
            links.iter().fold(identity, |frame, link| {
                let i = link.index;
                let located = self.errors.inter_at(i, &situation.kelvin);
                let (joint, frame) = Joint::after(&(frame * link.relative), &located);
                inter[i] = joint;
                let q = q[i];
                let error = self.errors.intra(self.carried[i], i, q, situation, None);
                let moved = link.moved(frame, q);
                let (joint, frame) = Joint::after(&moved, &error.unwrap_or_default());
                intra[i] = joint;
                frame
            })
        };
        let workpiece = branch(&self.nominal.workpiece) * self.nominal.to_workpiece;
        let last = branch(&self.nominal.tool) * self.nominal.to_spindle;
        let located = self.errors.inter_at(n, &situation.kelvin);
        let (joint, spindle) = Joint::after(&last, &located);
        inter[n] = joint;
        let point = spindle.r * in_spindle + spindle.t;
        // Relative to the workpiece, an error of the workpiece branch moves the point the opposite way.
        let mut way = [0.0; MAX_AXES + 1];
        for (links, sign) in [(&self.nominal.workpiece, -1.0), (&self.nominal.tool, 1.0)] {
            for link in links {
                way[link.index] = sign;
            }
        }
        way[n] = 1.0;
        let seen = &workpiece.r;
        let to_workpiece = workpiece.inverse();
        Sensitivity {
            point: to_workpiece.r * point + to_workpiece.t,
            by_tool: to_workpiece.r * spindle.r,
            by_inter: core::array::from_fn(|i| inter[i].moves(&point, seen, way[i])),
            by_intra: core::array::from_fn(|i| intra[i].moves(&point, seen, way[i])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Branch, ErrorModel, Letter, Machine, Parameter, ParameterKind, Switches};
    use std::format;

    /// Both branches, a tilted axis, a reversed one, an offset spindle.
    fn machine() -> Machine {
        let mut y = Axis::new(Letter::Y, Branch::Workpiece, [-200.0, 200.0]);
        y.reversed = true;
        let a = Axis::new(Letter::A, Branch::Workpiece, [-90.0, 90.0]);
        let mut machine = Machine::new(&[
            y,
            a.at([10.0, 20.0, 30.0, 0.1, -0.7, 0.2]),
            Axis::new(Letter::X, Branch::Tool, [-200.0, 200.0]),
            Axis::new(Letter::Z, Branch::Tool, [-200.0, 200.0]),
            Axis::new(Letter::B, Branch::Tool, [-90.0, 90.0]),
        ])
        .unwrap();
        machine.tip = [3.0, -2.0, -120.0];
        machine.spindle = Htm::from_xyz_abc([5.0, 6.0, -40.0, 0.0, 0.3, 0.0]);
        machine.workpiece = Htm::from_xyz_abc([-20.0, 0.0, 15.0, 0.0, 0.0, 0.5]);
        machine
    }

    /// Errors everywhere, far larger than on any machine, so that their products are visible.
    fn errors(machine: &Machine) -> ErrorModel {
        let mut errors = ErrorModel::perfect(machine);
        for (i, inter) in errors.inter.iter_mut().enumerate() {
            *inter = core::array::from_fn(|k| 0.02 * ((7 * i + 3 * k) as f64).sin());
        }
        for (i, axis) in "YAXZB".chars().enumerate() {
            for (k, component) in "XYZABC".chars().enumerate() {
                let name = format!("E{component}{axis}0");
                let value = 0.03 * ((5 * i + 11 * k) as f64).cos();
                assert!(errors.set(machine, Parameter::parse(&name).unwrap(), value));
            }
        }
        errors
    }

    #[test]
    fn derivatives_are_those_of_the_exact_pose() {
        let machine = machine();
        let errors = errors(&machine);
        let q = [50.0, 0.6, -80.0, 30.0, -0.4, 0.0];
        let situation = Situation::default();
        let tip = Vector3::from(machine.tip);
        let at = |errors: &ErrorModel, tip: &Vector3<f64>| {
            let mut machine = machine.clone();
            machine.tip = (*tip).into();
            let pose = Kinematics::new(&machine, errors).actual(&q, &situation, &Switches::ALL);
            pose.t
        };
        let found = Kinematics::new(&machine, &errors).sensitivity(&q, &situation, &tip);
        // The same chain with products in another order.
        assert!((found.point - at(&errors, &tip)).norm() < 1e-12);
        let h = 1e-4;
        // Central differences have an error of h²/6 times the third derivative, about 200 mm here, plus rounding of
        // 1e-13 mm over 2 h.
        let close = |column: Vector3<f64>, ahead: Vector3<f64>, behind: Vector3<f64>| {
            let numeric = (ahead - behind) / (2.0 * h);
            assert!((column - numeric).norm() < 1e-6, "{column} {numeric}");
        };
        for i in 0..3 {
            let mut step = Vector3::zeros();
            step[i] = h;
            let column = found.by_tool.column(i).into_owned();
            close(
                column,
                at(&errors, &(tip + step)),
                at(&errors, &(tip - step)),
            );
        }
        let with = |parameter: Parameter, change: f64| {
            let mut errors = errors.clone();
            let i = machine.index(parameter.axis).unwrap_or(machine.axes.len());
            let k = parameter.component;
            let value = match parameter.kind {
                ParameterKind::Inter => errors.inter[i][k],
                _ => errors.motions[i][k].coefficients[0],
            };
            assert!(errors.set(&machine, parameter, value + change));
            at(&errors, &tip)
        };
        for (i, axis) in "YAXZBS".chars().enumerate() {
            for (k, component) in "XYZABC".chars().enumerate() {
                let check = |name: &str, column: Vector3<f64>| {
                    let parameter = Parameter::parse(name).unwrap();
                    close(column, with(parameter, h), with(parameter, -h));
                };
                let inter = found.by_inter[i].column(k).into_owned();
                check(&format!("E{component}0{axis}"), inter);
                if axis != 'S' {
                    let intra = found.by_intra[i].column(k).into_owned();
                    check(&format!("E{component}{axis}0"), intra);
                }
            }
        }
    }
}
