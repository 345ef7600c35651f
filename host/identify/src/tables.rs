//! Motions that are known as tables: which parameters they replace, and how their uncertainty adds to that of the others.

use crate::Unknown;
use crate::estimate::Estimate;
use crate::factor::ScaledFactor;
use crate::rows::{EquationWeights, Problem};
use nalgebra::DMatrix;
use trueaxis_model::errors::{Parameter, ParameterKind};

impl Problem<'_> {
    /// The change of the unknowns of a factor, in its order, by one standard uncertainty of each value of the tables that are
    /// known, which are independent. `None` if it is not finite.
    pub(crate) fn by_tables(
        &self,
        (estimate, weights, factor): (&Estimate, &EquationWeights, &ScaledFactor),
        jacobian: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let mut columns = Vec::new();
        for ((axis, component), uncertainty) in &self.base.table_uncertainty {
            let Some(table) = &self.base.motions[*axis][*component].table else {
                continue;
            };
            let letter = self.machine.axes[*axis].letter.char();
            let unit = Unknown::Parameter(Parameter {
                component: *component,
                axis: letter,
                kind: ParameterKind::Degree(0),
            });
            let by_motion = self.derivatives(&[unit], estimate, weights);
            let (count, both) = (table.at.len(), table.negative.is_some());
            let mut own = DMatrix::zeros(jacobian.nrows(), if both { 2 * count } else { count });
            for (block, (q, situation)) in self.blocks().zip(self.commands()) {
                let q = self.base.held(*axis, q[*axis], None);
                let sign = situation.sign[*axis];
                let ways = match both {
                    true => vec![(0, 0.5 * (1.0 + sign)), (count, 0.5 * (1.0 - sign))],
                    false => vec![(0, 1.0)],
                };
                for (value, part) in shares(&table.at, q) {
                    for (first, way) in &ways {
                        for row in block.clone() {
                            own[(row, first + value)] +=
                                by_motion[(row, 0)] * part * way * uncertainty[value];
                        }
                    }
                }
            }
            columns.push(own);
        }
        factor.absorbed(jacobian, columns.iter().flat_map(|own| own.column_iter()))
    }
}

/// The values of a table, by index, that make up its value at a position, and how much each counts.
fn shares(at: &[f64], q: f64) -> Vec<(usize, f64)> {
    let above = at.partition_point(|at| *at <= q);
    match above {
        0 => vec![(0, 1.0)],
        _ if above == at.len() => vec![(above - 1, 1.0)],
        _ => {
            let part = (q - at[above - 1]) / (at[above] - at[above - 1]);
            vec![(above - 1, 1.0 - part), (above, part)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::artefact::Artefact;
    use crate::formats::observations::{self, Observations};
    use crate::formats::probings::Probings;
    use crate::{Identified, IdentifyOptions, identify};
    use nalgebra::DVector;
    use std::fmt::Write;
    use trueaxis_model::errors::ErrorModel;
    use trueaxis_model::errors::Table;
    use trueaxis_model::machine::Machine;

    const MACHINE: &str = r#"
        name = "mill"
        axis = [
            { name = "X", branch = "workpiece", range = [-200.0, 200.0] },
            { name = "Y", branch = "workpiece", range = [-200.0, 200.0] },
            { name = "Z", branch = "tool", range = [-200.0, 200.0] },
        ]
        spindle = { axis = "z" }
        tool = { tip_mm = [0.0, 0.0, -90.0] }
    "#;

    /// A circle in the plane of X and Y about (20, -10), with a bar whose length is off by a few waves.
    fn circle(machine: &Machine) -> Observations {
        let mut text = String::from(
            "# radius_mm = 100.0\n# unit = \"um\"\n# plane = \"XY\"\n# at = { X = 20.0, Y = -10.0, Z = 0.0 }\nangle,ccw,cw\n",
        );
        for angle in (0..360).step_by(9) {
            let at = f64::from(angle).to_radians();
            let [ccw, cw] = [3.0, 5.0].map(|k| 2.0 * libm::sin(k * at) + libm::cos(2.0 * at));
            let _ = writeln!(text, "{angle},{ccw:.6},{cw:.6}");
        }
        observations::read(&text, "circle.csv", machine).unwrap()
    }

    #[test]
    fn one_value_of_a_table_moves_what_is_found_by_what_is_said() {
        let machine = Machine::from_toml(MACHINE).unwrap();
        let circle = circle(&machine);
        let parameters = ["EC0Y", "EYY1"].map(|name| Parameter::parse(name).unwrap());
        let table = Table {
            at: vec![-200.0, -60.0, 10.0, 90.0, 200.0],
            positive: vec![0.004, 0.001, 0.0, -0.002, 0.001],
            negative: Some(vec![0.002, 0.001, -0.001, -0.003, 0.001]),
        };
        // Small enough for the second order of errors to be below the rounding of what is compared.
        const U: f64 = 1e-3;
        let solve = |bumped: Option<(usize, bool)>, u: f64| -> Identified {
            let mut table = table.clone();
            match (bumped, &mut table.negative) {
                (Some((value, true)), _) => table.positive[value] += U,
                (Some((value, false)), Some(negative)) => negative[value] += U,
                _ => {}
            }
            let mut base = ErrorModel::perfect(&machine);
            base.tabulate(0, 0, table);
            base.table_uncertainty.insert((0, 0), vec![u; 5]);
            let none = (Probings::default(), Artefact::default());
            let problem = Problem::new(&machine, &none.0, &none.1, &parameters, &base);
            identify(&problem.with(&circle), IdentifyOptions::default()).unwrap()
        };
        let values = |found: &Identified| {
            assert_eq!(found.parameters.len(), 2);
            [0, 1].map(|i| found.parameters[i].value)
        };
        let (exact, uncertain) = (solve(None, 0.0), solve(None, U));
        let mut sum = DMatrix::zeros(2, 2);
        for value in 0..5 {
            for way in [true, false] {
                let moved = values(&solve(Some((value, way)), 0.0));
                let before = values(&exact);
                let change = DVector::from_fn(2, |i, _| moved[i] - before[i]);
                sum += &change * change.transpose();
            }
        }
        let added = &uncertain.covariance - &exact.covariance;
        // Errors of a few µm on levers of 100 mm change derivatives by 1e-4, and the fit of a circle by ten times that.
        assert!(
            (&added - &sum).amax() < 1e-3 * sum.amax(),
            "{added} is not {sum}"
        );
        assert!(sum.amax() > 0.1 * exact.covariance.amax());
    }

    #[test]
    fn a_table_takes_the_place_of_its_motion_but_not_of_locations() {
        let machine = Machine::from_toml(MACHINE).unwrap();
        let mut base = ErrorModel::perfect(&machine);
        let mut table = Table {
            at: vec![-200.0, 200.0],
            positive: vec![0.0, 0.001],
            negative: None,
        };
        base.tabulate(0, 1, table.clone());
        let is_in = |base: &ErrorModel, name: &str| {
            base.is_tabulated(&machine, &Parameter::parse(name).unwrap())
        };
        for (name, expected) in [
            ("EYX0", true),
            ("EYX3", true),
            ("EXX1", false),
            ("EY0X", false),
            ("EC0X", false),
            ("EYXb", false),
        ] {
            assert_eq!(is_in(&base, name), expected, "{name}");
        }
        table.negative = Some(vec![0.0, 0.0]);
        base.tabulate(0, 1, table);
        assert!(is_in(&base, "EYXb"));
    }
}
