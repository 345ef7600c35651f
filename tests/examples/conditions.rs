//! The condition number of the Jacobian of the source document's strategies, under every possible definition: `cargo
//! run --release -p trueaxis-tests --example conditions`.

use nalgebra::{DMatrix, Matrix3, Vector3};
use trueaxis_identify::IdentifyOptions;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_tests::probed::Case;

fn main() {
    println!(
        "{:<34}{:>14}{:>14}{:>14}{:>14}{:>14}",
        "", "Kolibri 10", "Kolibri 12", "Kolibri 81", "HU40 13", "HU40 84"
    );
    let cases = [
        ("kolibri", "errors-10.toml", "10"),
        ("kolibri", "errors-12.toml", "12"),
        ("kolibri", "errors-81.toml", "81"),
        ("hu40", "errors-13.toml", "13"),
        ("hu40", "errors-84.toml", "84"),
    ];
    let parts: Vec<Parts> = cases
        .map(|(folder, errors, model)| Parts::of(folder, errors, model))
        .into();
    let row = |name: &str, of: &dyn Fn(&Parts) -> DMatrix<f64>| {
        print!("{name:<34}");
        for parts in &parts {
            print!("{:>14.0}", condition(of(parts)));
        }
        println!();
    };
    row("all, columns of length 1", &|p| unit(p.all()));
    row("all, largest entry 1", &|p| largest(p.all()));
    row("all, mm and rad", &|p| p.all());
    row("all, m and rad", &|p| p.metres(p.all()));
    row("without stylus, length 1", &|p| {
        unit(p.join(&[&p.parameters, &p.balls]))
    });
    row("without stylus, mm and rad", &|p| {
        p.join(&[&p.parameters, &p.balls])
    });
    row("parameters alone, length 1", &|p| {
        unit(p.parameters.clone())
    });
    row("parameters alone, mm and rad", &|p| p.parameters.clone());
    row("parameters, setup eliminated, 1", &|p| {
        unit(p.eliminated(false))
    });
    row("same, then length 1 before", &|p| p.eliminated(true));
    row("JᵀJ of all, length 1", &|p| {
        let j = unit(p.all());
        j.tr_mul(&j)
    });
    row("JᵀJ of parameters alone, length 1", &|p| {
        let j = unit(p.parameters.clone());
        j.tr_mul(&j)
    });
    row("JᵀJ, setup eliminated, length 1", &|p| {
        let j = unit(p.eliminated(false));
        j.tr_mul(&j)
    });
}

/// Columns of the Jacobian: of identifiable parameters, of the stylus, of balls.
struct Parts {
    parameters: DMatrix<f64>,
    stylus: DMatrix<f64>,
    balls: DMatrix<f64>,
    /// True for a length per mm or an angle: its column is in mm.
    angular: Vec<bool>,
}

impl Parts {
    fn of(folder: &str, errors: &str, model: &str) -> Self {
        let mut case = Case::new(folder, errors);
        // The approach directions of the axes are not published: they alternate, so that backlash is visible.
        for (k, row) in case.plan.rows.iter_mut().enumerate() {
            for direction in &mut row.direction {
                *direction = if k % 2 == 0 { 1.0 } else { -1.0 };
            }
        }
        let measured = case.noisy(1);
        let identified = case.found(model, &measured, IdentifyOptions::default());
        let seen: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
        let angular = seen
            .iter()
            .map(|p| p.is_angular() || matches!(p.kind, ParameterKind::Degree(1)))
            .collect();
        let [parameters, stylus, balls] = columns(&case, &measured, &seen);
        Self {
            parameters,
            stylus,
            balls,
            angular,
        }
    }

    fn join(&self, parts: &[&DMatrix<f64>]) -> DMatrix<f64> {
        let columns: Vec<_> = parts.iter().flat_map(|p| p.column_iter()).collect();
        DMatrix::from_columns(&columns)
    }

    fn all(&self) -> DMatrix<f64> {
        self.join(&[&self.parameters, &self.stylus, &self.balls])
    }

    /// With lengths in metres: a column of an angle becomes a thousandth.
    fn metres(&self, mut all: DMatrix<f64>) -> DMatrix<f64> {
        for (mut column, is_angular) in all.column_iter_mut().zip(&self.angular) {
            column *= if *is_angular { 1e-3 } else { 1.0 };
        }
        all
    }

    /// The part that balls and stylus cannot absorb.
    fn eliminated(&self, unit_before: bool) -> DMatrix<f64> {
        let parameters = match unit_before {
            true => unit(self.parameters.clone()),
            false => self.parameters.clone(),
        };
        let setup = self.join(&[&self.stylus, &self.balls]);
        let svd = setup.svd(true, false);
        let u = svd.u.expect("asked for");
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|i| svd.singular_values[*i] > 1e-9 * svd.singular_values.max())
            .collect();
        let q = u.select_columns(&kept);
        let made_up = &q * q.tr_mul(&parameters);
        parameters - made_up
    }
}

fn columns(case: &Case, measured: &Probings, seen: &[Parameter]) -> [DMatrix<f64>; 3] {
    let perfect = ErrorModel::perfect(&case.machine);
    let kinematics = Kinematics::new(&case.machine, &perfect);
    let tip = Vector3::from(case.machine.tip);
    let rows = 3 * measured.rows.len();
    let mut parts = [seen.len(), 3, 3 * measured.balls.len()].map(|n| DMatrix::zeros(rows, n));
    for (i, row) in measured.rows.iter().enumerate() {
        let q = case.machine.to_kinematic(&row.position);
        let situation = Situation {
            sign: row.direction,
            ..Situation::default()
        };
        let found = kinematics.sensitivity(&q, &situation, &tip);
        for (k, parameter) in seen.iter().enumerate() {
            let per_unit = perfect.per_unit(&case.machine, *parameter, &q, &situation);
            let spindle = case.machine.axes.len();
            let axis = case.machine.index(parameter.axis).unwrap_or(spindle);
            let columns = match parameter.kind {
                ParameterKind::Inter => &found.by_inter[axis],
                _ => &found.by_intra[axis],
            };
            let column = columns.column(parameter.component) * per_unit.unwrap_or(0.0);
            parts[0].view_mut((3 * i, k), (3, 1)).copy_from(&column);
        }
        parts[1]
            .view_mut((3 * i, 0), (3, 3))
            .copy_from(&found.by_tool);
        let ball = -Matrix3::identity();
        parts[2]
            .view_mut((3 * i, 3 * row.ball), (3, 3))
            .copy_from(&ball);
    }
    parts
}

fn unit(mut j: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in j.column_iter_mut() {
        let length = column.norm();
        column /= if length > 0.0 { length } else { 1.0 };
    }
    j
}

fn largest(mut j: DMatrix<f64>) -> DMatrix<f64> {
    for mut column in j.column_iter_mut() {
        let length = column.amax();
        column /= if length > 0.0 { length } else { 1.0 };
    }
    j
}

/// Of the identifiable part: singular values due to rounding are ignored.
fn condition(j: DMatrix<f64>) -> f64 {
    let values = j.singular_values();
    let most = values.max();
    let least = values.iter().copied().filter(|v| *v > 1e-11 * most);
    most / least.fold(f64::INFINITY, f64::min)
}
