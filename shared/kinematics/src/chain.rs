//! The exact chain: workpiece to tool through every axis and every error.

use crate::errors::Carried;
use crate::nominal::{Frames, Link};
use crate::{
    ErrorModel, Htm, Jacobian, MAX_AXES, Machine, Nominal, PerAxis, Policy, Situation, Switches,
    Twist,
};

/// The kinematics of one machine with one set of errors.
#[derive(Clone, Debug)]
pub struct Kinematics<'a, P = &'static [f64]> {
    /// The machine.
    pub machine: &'a Machine,
    /// Errors.
    pub errors: &'a ErrorModel<P>,
    /// What the rotary axes correct.
    pub policy: Policy,
    pub(crate) nominal: Nominal<'a>,
    /// Frame of each axis relative to the previous frame, including the inter-axis error after it, at reference
    /// temperature; then that of the spindle.
    located: Frames,
    /// The error motions that each axis has.
    pub(crate) carried: [Carried; MAX_AXES],
}

impl<'a, P> Kinematics<'a, P> {
    /// Lays out the two branches; rotary axes are corrected by the default policy.
    #[must_use]
    pub fn new(machine: &'a Machine, errors: &'a ErrorModel<P>) -> Self {
        let nominal = Nominal::new(machine);
        let mut located = [Htm::identity(); MAX_AXES + 1];
        for link in nominal.workpiece.iter().chain(&nominal.tool) {
            located[link.index] = link.relative * Htm::from_xyz_abc(errors.inter[link.index]);
        }
        let n = machine.axes.len();
        located[n] = nominal.to_spindle * Htm::from_xyz_abc(errors.inter[n]);
        Self {
            machine,
            errors,
            policy: Policy::default(),
            nominal,
            located,
            carried: core::array::from_fn(|index| {
                let linear = machine
                    .axes
                    .get(index)
                    .is_some_and(|a| !a.letter.is_rotary());
                errors.carried(index, linear)
            }),
        }
    }

    /// These kinematics with another policy.
    #[must_use]
    pub fn with_policy(self, policy: Policy) -> Self {
        Self { policy, ..self }
    }

    /// Nominal pose of the tool (spindle orientation, origin at the tip) in the workpiece frame.
    #[must_use]
    pub fn nominal(&self, q: &PerAxis, length: Option<f64>) -> Htm {
        self.nominal.pose(q, length)
    }

    /// The control Jacobian at `q`: the twist of the tool (tool frame, at the tip) per mm or rad of each axis.
    #[must_use]
    pub fn jacobian(&self, q: &PerAxis, length: Option<f64>) -> Jacobian {
        self.nominal.jacobian(q, length)
    }

    /// Poses relative to the tool frame at the tip: of each axis frame before its motion (and, last, of the spindle
    /// frame), and of each axis frame after its motion.
    pub(crate) fn error_frames(&self, q: &PerAxis, length: Option<f64>) -> (Frames, Frames) {
        let (before, after) = self.nominal.frames(q);
        let tip = Htm::translation(self.nominal.tip(length));
        let from_tool = (before[self.machine.axes.len()] * tip).inverse();
        (before.map(|f| from_tool * f), after.map(|f| from_tool * f))
    }
}

impl<P: AsRef<[f64]>> Kinematics<'_, P> {
    /// Actual pose of the tool in the workpiece frame, including all errors, at the command `q`.
    #[must_use]
    pub fn actual(&self, q: &PerAxis, situation: &Situation, switches: &Switches) -> Htm {
        let cold = self.errors.inter_thermal.is_empty();
        let branch = |links: &[Link]| {
            links.iter().fold(Htm::identity(), |frame, link| {
                let index = link.index;
                let located = if cold {
                    self.located[index]
                } else {
                    link.relative
                        * Htm::from_xyz_abc(self.errors.inter_at(index, &situation.kelvin))
                };
                let moved = link.moved(frame * located, q[index]);
                let (carried, instead) = (self.carried[index], switches.instead_of(index));
                match self
                    .errors
                    .intra(carried, index, q[index], situation, instead)
                {
                    Some(error) => moved * Htm::from_xyz_abc(error),
                    None => moved,
                }
            })
        };
        let n = self.machine.axes.len();
        let workpiece = branch(&self.nominal.workpiece) * self.nominal.to_workpiece;
        let to_spindle = if cold {
            self.located[n]
        } else {
            let spindle = self.errors.inter_at(n, &situation.kelvin);
            self.nominal.to_spindle * Htm::from_xyz_abc(spindle)
        };
        let mut tool = branch(&self.nominal.tool) * to_spindle;
        tool.t += tool.r * self.nominal.tip(situation.length);
        workpiece.inverse() * tool
    }

    /// The volumetric error at a command, without or with a correction added to it: the twist
    /// of nominal(q)⁻¹ · actual(q + Δq), in the tool frame at the tip (mm, rad).
    #[must_use]
    pub fn volumetric_error(
        &self,
        q: &PerAxis,
        correction: &PerAxis,
        situation: &Situation,
    ) -> Twist {
        let corrected = core::array::from_fn(|i| q[i] + correction[i]);
        (self.nominal(q, situation.length).inverse()
            * self.actual(&corrected, situation, &Switches::ALL))
        .twist()
    }
}
