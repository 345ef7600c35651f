//! The exact kinematic correction, from which the tables are sampled: `trueaxis-kinematics`, f64 with the trigonometry
//! of `libm`, iterated to convergence.

use super::{TIP, errors};
use core::f64::consts::FRAC_PI_4;
use trueaxis_kinematics::{
    Axis, Branch, ErrorModel, Htm, Kinematics, Letter, Machine, MachineError, Parameter, Situation,
    Switches,
};

/// The Huron K2X8-Five.
pub fn machine() -> Result<Machine, MachineError> {
    let linear = [-350.0, 350.0];
    let mut machine = Machine::new(&[
        Axis::new(Letter::Y, Branch::Workpiece, linear),
        Axis::new(Letter::A, Branch::Workpiece, [-120.0, 120.0])
            .at([0.0, 0.0, 0.0, 0.0, -FRAC_PI_4, 0.0]),
        Axis::new(Letter::C, Branch::Workpiece, [-360.0, 360.0]),
        Axis::new(Letter::X, Branch::Tool, linear),
        Axis::new(Letter::Z, Branch::Tool, linear),
    ])?;
    machine.spindle = Htm::from_xyz_abc([0.0, 0.0, 0.0, -2.0 * FRAC_PI_4, 0.0, 0.0]);
    machine.tool_axis = 1;
    machine.tip = [0.0, f64::from(TIP), 0.0];
    Ok(machine)
}

macro_rules! set {
    ($model:ident, $machine:ident, $($name:ident)*) => {
        $(
            let value = f64::from(errors::$name);
            let parameter = Parameter::parse(stringify!($name));
            let known = parameter.is_some_and(|p| $model.set($machine, p, value));
            assert!(known, stringify!($name));
        )*
    };
}

/// The thirteen errors of the Huron.
pub fn errors(machine: &Machine) -> ErrorModel {
    let mut model = ErrorModel::perfect(machine);
    set!(model, machine, EZ0S EA0Z EZZ1 EB0A EA0C EC0X EB0Z EB0C EXX1 EX0S EYY1 EC0A EY0C);
    model
}

/// Δq at a position; NaN where there is none.
#[inline(never)]
pub fn correction(kinematics: &Kinematics<'_>, position: &[f32; 5]) -> [f32; 5] {
    let machine = kinematics.machine;
    let q = machine.to_kinematic(&position.map(f64::from));
    match kinematics.correction(&q, &Situation::default(), &Switches::ALL) {
        Ok(correction) => {
            let dq = machine.to_command(&correction.dq);
            core::array::from_fn(|i| dq[i] as f32)
        }
        Err(_) => [f32::NAN; 5],
    }
}
