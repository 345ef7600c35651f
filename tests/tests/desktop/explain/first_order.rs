//! The second derivation: first-order readings of an instrument, from transport matrices and the control Jacobian of
//! the linearised model, which have their own sign conventions for branches and reversed axes.

use nalgebra::Vector3;
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::explain::{
    BenchInstrument, BenchState, EntryKind, Explained, InstrumentReading, REACH, Sense,
};
use trueaxis_model::kinematics::{Kinematics, Linearised};
use trueaxis_model::machine::Machine;

/// The first-order effect of one parameter on an otherwise perfect machine.
pub struct First<'a> {
    pub machine: &'a Machine,
    pub errors: &'a ErrorModel,
    pub perfect: ErrorModel,
}

impl First<'_> {
    /// The error's magnitude (mm, rad) at a position, in units of the parameter that the linearised model uses.
    fn size(&self, explained: &Explained<'_>, state: &BenchState) -> f64 {
        let (alone, n) = (&explained.alone, self.machine.axes.len());
        let (index, component) = (alone.index(), alone.parameter.component);
        let table = || {
            self.errors.motions[index][component]
                .table
                .as_ref()
                .unwrap()
        };
        match &alone.said {
            EntryKind::Parameter(value) => *value,
            EntryKind::PerKelvin { per_kelvin, .. } => *per_kelvin,
            EntryKind::Table => table().value(state.q[index.min(n - 1)], 0.0),
            EntryKind::TableReversal => {
                let at = |sign| table().value(state.q[index], sign);
                0.5 * (at(1.0) - at(-1.0)) * state.sign[index]
            }
        }
    }

    /// Tip and rotation of the tool, minus the error-free values (mm, rad, workpiece frame).
    fn off(&self, explained: &Explained<'_>, state: &BenchState) -> [Vector3<f64>; 2] {
        let kinematics = Kinematics::new(self.machine, &self.perfect);
        let situation = Situation {
            sign: state.sign,
            ..Situation::default()
        };
        let linearised = Linearised::new(&kinematics, &state.q, &situation);
        let column = linearised.column(explained.alone.parameter).unwrap();
        let r = kinematics.nominal(&state.q, None).r;
        let size = self.size(explained, state);
        [r * column.t * size, r * column.r * size]
    }

    /// Direction in which a positive command moves the tip, or about which it rotates the tool.
    fn way(&self, axis: usize, state: &BenchState) -> Vector3<f64> {
        let kinematics = Kinematics::new(self.machine, &self.perfect);
        let [x, y, z, a, b, c] = kinematics.jacobian(&state.q, None).column(axis);
        let column = match self.machine.axes[axis].letter.is_rotary() {
            true => Vector3::new(a, b, c),
            false => Vector3::new(x, y, z),
        };
        kinematics.nominal(&state.q, None).r * column
    }

    /// Reading of the instrument, to first order (mm, rad).
    pub fn reads(&self, explained: &Explained<'_>, reading: &InstrumentReading) -> f64 {
        let InstrumentReading {
            instrument,
            sense,
            from,
            to,
            ..
        } = reading;
        let between = |from: &BenchState, to: &BenchState| {
            let ([t0, r0], [t1, r1]) = (self.off(explained, from), self.off(explained, to));
            [t1 - t0, r1 - r0]
        };
        let [tip, turn] = between(from, to);
        let across = |a: usize, b: usize| self.way(a, to).cross(&self.way(b, to)).normalize();
        match (instrument, sense) {
            (BenchInstrument::Tram, Sense::In(axis)) => {
                let [_, turn] = self.off(explained, to);
                let kinematics = Kinematics::new(self.machine, &self.perfect);
                let tool = kinematics
                    .nominal(&to.q, None)
                    .r
                    .column(self.machine.tool_axis)
                    * -self.machine.tip[self.machine.tool_axis].signum();
                let way = self.way(*axis, to);
                let arm = (way - tool * tool.dot(&way)).normalize() * REACH;
                -2.0 * turn.cross(&arm).dot(&tool)
            }
            (BenchInstrument::Square, Sense::In(aligned)) => {
                let moved = reading.moved.unwrap();
                let distance = to.q[moved] - from.q[moved];
                // Elsewhere along the aligned leg, whose direction is the same everywhere.
                let travel = self.machine.axes[*aligned].travel;
                let home = 0.0_f64.max(travel[0]).min(travel[1]);
                let there = match () {
                    () if travel[1] - home >= REACH => home + REACH,
                    () if home - travel[0] >= REACH => home - REACH,
                    () if travel[1] - home >= home - travel[0] => travel[1],
                    () => travel[0],
                };
                let mut at = [*from; 2];
                at[0].q[moved] = to.q[moved].min(from.q[moved]);
                for state in &mut at {
                    // The leg is aligned with the other axis at home.
                    let span = self.machine.axes[moved].travel;
                    state.q[moved] = 0.0_f64.max(span[0]).min(span[1]);
                }
                at[0].q[*aligned] = home;
                at[1].q[*aligned] = there;
                let (leg, way) = (self.way(*aligned, from), self.way(moved, from));
                let [leans, _] = between(&at[0], &at[1]);
                let leans = leans / (there - home);
                let leans = leans - leg * leg.dot(&leans);
                (tip.dot(&leg) / distance + way.dot(&leans)) * REACH
            }
            (BenchInstrument::Straightedge { ends }, Sense::In(axis)) => {
                let moved = reading.moved.unwrap();
                let [first, last] = ends.map(|end| from.with(moved, end));
                let way = self.way(*axis, to);
                let off = |state: &BenchState| between(&first, state)[0].dot(&way);
                let part = (to.q[moved] - ends[0]) / (ends[1] - ends[0]);
                off(to) - off(&last) * part
            }
            (_, Sense::In(axis)) => tip.dot(&self.way(*axis, to)),
            (_, Sense::From(a, b)) => turn.dot(&across(*a, *b)),
            (_, Sense::About(axis)) => turn.dot(&self.way(*axis, to)),
        }
    }
}

/// The effect of a parameter on tip and tool direction at random positions that cannot be removed by a common motion of
/// the workpiece, as a fraction of its magnitude: least squares on the linearised model.
pub fn left(first: &First<'_>, explained: &Explained<'_>, positions: &[BenchState]) -> f64 {
    let machine = first.machine;
    let perfect = Kinematics::new(machine, &first.perfect);
    let tools: Vec<_> = positions
        .iter()
        .map(|p| perfect.nominal(&p.q, None))
        .collect();
    let offs: Vec<_> = positions.iter().map(|p| first.off(explained, p)).collect();
    // Tip: v + w × p; six unknowns.
    let mut normal = nalgebra::Matrix6::<f64>::zeros();
    let mut right = nalgebra::Vector6::<f64>::zeros();
    for (tool, [tip, _]) in tools.iter().zip(&offs) {
        let mut a = nalgebra::Matrix3x6::<f64>::zeros();
        a.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        a.fixed_view_mut::<3, 3>(0, 3)
            .copy_from(&-tool.t.cross_matrix());
        normal += a.transpose() * a;
        right += a.transpose() * tip;
    }
    let x = normal.lu().solve(&right).unwrap();
    let (v, w) = (x.fixed_rows::<3>(0), x.fixed_rows::<3>(3));
    let left = tools.iter().zip(&offs).map(|(tool, [tip, turn])| {
        let direction = tool.r.column(machine.tool_axis);
        let tip = (tip - v - w.cross(&tool.t)).norm();
        tip.max((turn - w).cross(&direction).norm() * REACH)
    });
    let scale = match explained.alone.parameter.is_angular() {
        true => explained.alone.size() * REACH,
        false => explained.alone.size(),
    };
    left.fold(0.0, f64::max) / scale
}
