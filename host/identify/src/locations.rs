//! The location errors that distinguish a machine from its nominal one, given which axis carries which.

use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{Branch, MAX_AXES, Machine};

/// A column adds something if at least this fraction is outside the span of the others. Positions are random here,
/// and dependent columns are dependent to rounding, 1e-13.
const OUTSIDE: f64 = 1e-4;
/// Rounding: less than 1 nm for 1 mm or 1 rad.
const NOTHING: f64 = 1e-6;
/// Number of positions; gives enough equations for about 30 location errors.
const POSITIONS: usize = 60;
/// Range of axes: the size of a machine (mm), a turn (rad).
const MOVES: [f64; 2] = [300.0, std::f64::consts::PI];

/// The span of a set of columns.
#[derive(Clone, Debug, Default)]
pub(crate) struct ColumnSpan {
    /// Orthonormal.
    basis: Vec<DVector<f64>>,
}

impl ColumnSpan {
    pub fn of(columns: &DMatrix<f64>) -> Self {
        let mut span = Self::default();
        for column in columns.column_iter() {
            span.add(column.into_owned(), NOTHING);
        }
        span
    }

    /// True if more than `least` of the column was outside; the column is then added.
    pub fn add(&mut self, mut column: DVector<f64>, least: f64) -> bool {
        let length = column.norm();
        // Twice, to remove rounding errors.
        for unit in self.basis.iter().chain(&self.basis) {
            column.axpy(-unit.dot(&column), unit, 1.0);
        }
        let is_outside = column.norm() > (OUTSIDE * length).max(least);
        if is_outside {
            self.basis.push(column.normalize());
        }
        is_outside
    }
}

/// All location errors in order of preference where several have the same effect: spindle position, positions and
/// tilts of rotary axes starting at the workpiece, then tilts of linear axes starting at the tool (squareness).
pub(crate) fn in_order_of_preference(machine: &Machine) -> Vec<Parameter> {
    let (rotary, linear): (Vec<char>, Vec<char>) =
        chain(machine).into_iter().partition(|l| "ABC".contains(*l));
    let linear: Vec<char> = linear.into_iter().rev().collect();
    let all = |axes: &[char], components: std::ops::Range<usize>| -> Vec<Parameter> {
        let pairs = (axes.iter()).flat_map(|axis| components.clone().map(move |k| (k, *axis)));
        pairs
            .map(|(component, axis)| inter(component, axis))
            .collect()
    };
    let (places, tilts) = (0..3, 3..6);
    let rotary = rotary.iter().map(|axis| all(&[*axis], 0..6));
    [
        all(&['S'], places.clone()),
        rotary.flatten().collect(),
        all(&linear, tilts.clone()),
        all(&linear, places),
        all(&['S'], tilts),
    ]
    .concat()
}

/// The smallest set of location errors that covers every tip error that all of them together can cause, except for
/// the positions of workpiece and stylus: of each group with the same effect, the first in
/// [`in_order_of_preference`]. Sorted like the source document's lists: rotary axes towards the workpiece, then
/// linear ones towards the tool.
pub(crate) fn minimal(machine: &Machine) -> Vec<Parameter> {
    let mut found = independent(machine, true, &[]);
    let chain = chain(machine);
    found.sort_by_key(|p| {
        let place = chain.iter().position(|l| *l == p.axis).unwrap_or(MAX_AXES);
        match "ABC".contains(p.axis) {
            true => (0, MAX_AXES - place, p.component),
            false => (1, place, p.component),
        }
    });
    found
}

/// All location errors: first the [`minimal`] set, then those that a known stylus also reveals, then the rest.
pub(crate) fn all(machine: &Machine) -> Vec<Parameter> {
    let mut all = minimal(machine);
    all.extend(independent(machine, false, &all));
    for parameter in in_order_of_preference(machine) {
        if !all.contains(&parameter) {
            all.push(parameter);
        }
    }
    all
}

/// The location errors, in order of preference, with an effect on the tip that those before and `known` ones do not have,
/// nor the position of the workpiece, nor (if it is free) that of the stylus.
fn independent(machine: &Machine, has_free_stylus: bool, known: &[Parameter]) -> Vec<Parameter> {
    let mut all = known.to_vec();
    all.extend(
        in_order_of_preference(machine)
            .iter()
            .filter(|p| !known.contains(p)),
    );
    let columns = shifts(machine, &all);
    let fixed = if has_free_stylus { SETUP } else { SETUP - 3 };
    let mut span = ColumnSpan::of(&columns.columns(0, fixed).into_owned());
    let adds =
        |(column, _): &(usize, &Parameter)| span.add(columns.column(*column).into_owned(), NOTHING);
    let found = (SETUP..).zip(&all).filter(adds).map(|(_, p)| *p);
    found.filter(|p| !known.contains(p)).collect()
}

/// Translations and rotations of the workpiece, and the stylus.
const SETUP: usize = 9;

/// How the tip moves at random positions with the set-up, then with each parameter.
fn shifts(machine: &Machine, all: &[Parameter]) -> DMatrix<f64> {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let tip = Vector3::from(machine.tip);
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let mut columns = DMatrix::zeros(3 * POSITIONS, SETUP + all.len());
    for row in 0..POSITIONS {
        let mut q = [0.0; MAX_AXES];
        for (q, axis) in q.iter_mut().zip(&machine.axes) {
            *q = random.random_range(-1.0..1.0) * MOVES[usize::from(axis.letter.is_rotary())];
        }
        let at = kinematics.nominal(&q, None).t;
        let found = kinematics.sensitivity(&q, &Situation::default(), &tip);
        for k in 0..3 {
            let unit = Vector3::ith(k, 1.0);
            let stylus: Vector3<f64> = found.by_tool.column(k).into();
            for (column, effect) in [(k, unit), (3 + k, unit.cross(&at)), (6 + k, stylus)] {
                columns
                    .fixed_view_mut::<3, 1>(3 * row, column)
                    .copy_from(&effect);
            }
        }
        for (column, parameter) in (SETUP..).zip(all) {
            let axis = machine.index(parameter.axis).unwrap_or(machine.axes.len());
            let effect = found.by_inter[axis].column(parameter.component);
            columns
                .fixed_view_mut::<3, 1>(3 * row, column)
                .copy_from(&effect);
        }
    }
    columns
}

/// Largest variation over the travel of the tip displacement by a location error of 1 (mm or rad), in mm; of an error
/// motion, the largest displacement, because the motion itself varies.
#[must_use]
pub fn effect_over_travel(machine: &Machine, parameter: Parameter) -> f64 {
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let tip = Vector3::from(machine.tip);
    let axis = machine.index(parameter.axis).unwrap_or(machine.axes.len());
    // Every axis at its ends and in the middle.
    let count = 3_usize.pow(machine.axes.len() as u32);
    let effect = |number: usize| -> Vector3<f64> {
        let mut command = [0.0; MAX_AXES];
        for (i, axis) in machine.axes.iter().enumerate() {
            let [low, high] = match axis.travel {
                // Half a turn shows as much as a longer range.
                [low, high] if axis.letter.is_rotary() && high - low > 180.0 => [low, low + 180.0],
                travel => travel,
            };
            let place = number / 3_usize.pow(i as u32) % 3;
            command[i] = low + (high - low) * place as f64 / 2.0;
        }
        let q = machine.to_kinematic(&command);
        let found = kinematics.sensitivity(&q, &Situation::default(), &tip);
        let by = match parameter.kind {
            ParameterKind::Inter => &found.by_inter[axis],
            _ => &found.by_intra[axis],
        };
        by.column(parameter.component).into()
    };
    let effects: Vec<Vector3<f64>> = (0..count).map(effect).collect();
    if parameter.kind != ParameterKind::Inter {
        return effects.iter().map(Vector3::norm).fold(0.0, f64::max);
    }
    let pairs = (effects.iter()).flat_map(|a| effects.iter().map(move |b| (a - b).norm()));
    pairs.fold(0.0, f64::max)
}

/// The letters of the axes from the workpiece to the tool.
pub(crate) fn chain(machine: &Machine) -> Vec<char> {
    let of = |branch| {
        let axes = machine.axes.iter().filter(move |a| a.branch == branch);
        axes.map(|a| a.letter.char())
    };
    let mut workpiece: Vec<char> = of(Branch::Workpiece).collect();
    workpiece.reverse();
    workpiece.into_iter().chain(of(Branch::Tool)).collect()
}

fn inter(component: usize, axis: char) -> Parameter {
    Parameter {
        component,
        axis,
        kind: ParameterKind::Inter,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::artefact::Artefact;
    use crate::formats::probings::{Probing, Probings};
    use crate::simulate::{Disturbances, probings};
    use crate::{IdentifyOptions, Model, Problem, Unknown, identify};
    use rand::seq::SliceRandom;

    const ARTEFACT: &str = r#"
        ball = [
            { name = "1", nominal_mm = [90.0, 10.0, 40.0] },
            { name = "2", nominal_mm = [-70.0, 60.0, 70.0] },
            { name = "3", nominal_mm = [-30.0, -80.0, 100.0] },
            { name = "4", nominal_mm = [40.0, 70.0, 130.0] },
        ]
        bar = [{ balls = ["1", "2"], length_mm = 170.29386365926, standard_uncertainty_mm = 1e-3 }]
    "#;
    /// Standard deviation of a coordinate (mm), and of location errors (mm and rad).
    const NOISE: f64 = 1e-3;
    const ERRORS: [f64; 2] = [0.05, 1e-4];

    fn examples() -> Vec<Machine> {
        let folders = std::fs::read_dir("../../examples").unwrap();
        let files = folders.flat_map(|folder| std::fs::read_dir(folder.unwrap().path()).unwrap());
        let mut paths: Vec<_> = files.map(|file| file.unwrap().path()).collect();
        paths.sort();
        let is_machine = |p: &&std::path::PathBuf| {
            let name = p.file_name().unwrap().to_string_lossy();
            name.starts_with("machine") && name.ends_with(".toml")
        };
        let read = |p: &std::path::PathBuf| std::fs::read_to_string(p).unwrap();
        let texts = paths.iter().filter(is_machine).map(read);
        texts
            .map(|text| Machine::from_toml(&text).unwrap())
            .collect()
    }

    /// X, Y, Z and two rotary axes in random order, on either branch.
    fn random_machine(random: &mut Pcg64Mcg) -> Machine {
        let mut axes = [
            ['X', 'Y', 'Z', 'A', 'B'],
            ['X', 'Y', 'Z', 'A', 'C'],
            ['X', 'Y', 'Z', 'B', 'C'],
        ][random.random_range(0..3)];
        axes.shuffle(random);
        let split = random.random_range(0..=5);
        let mut text = String::from(
            "name = \"random\"\nspindle = { axis = \"z\" }\ntool = { tip_mm = [0.0, 0.0, -90.0] }\n",
        );
        let mut axis = |letter: char, branch: &str| {
            let range = if "ABC".contains(letter) { 80.0 } else { 3000.0 };
            let [x, y, z] = [(); 3].map(|()| random.random_range(-60.0..60.0));
            text += &format!(
                "[[axis]]\nname = \"{letter}\"\nbranch = \"{branch}\"\nrange = [-{range:?}, {range:?}]\norigin_mm = [{x:.1}, {y:.1}, {z:.1}]\n"
            );
        };
        axes[..split]
            .iter()
            .rev()
            .for_each(|l| axis(*l, "workpiece"));
        axes[split..].iter().for_each(|l| axis(*l, "tool"));
        // With a rotary axis between linear ones, the linear axes may not span space.
        Machine::from_toml(&text).unwrap_or_else(|_| random_machine(random))
    }

    /// Every ball at as many random rotary positions as the unknowns require.
    fn plan(machine: &Machine, rows: usize, spindle: bool, random: &mut Pcg64Mcg) -> Probings {
        let row = |i: usize| {
            let mut position = [0.0; MAX_AXES];
            for (position, axis) in position.iter_mut().zip(&machine.axes) {
                if axis.letter.is_rotary() {
                    let [low, high] = match axis.modulo {
                        true => [0.0, 360.0],
                        false => axis.travel,
                    };
                    *position = random.random_range(low..high);
                }
            }
            Probing {
                ball: i % 4,
                position,
                direction: [0.0; MAX_AXES].map(|_| if random.random() { 1.0 } else { -1.0 }),
                spindle: if spindle {
                    random.random_range(0.0..360.0)
                } else {
                    0.0
                },
                line: i + 2,
                ..Probing::default()
            }
        };
        Probings {
            balls: ["1", "2", "3", "4"].map(String::from).to_vec(),
            rows: (0..rows).map(row).collect(),
        }
    }

    /// Ratio of the noise that a model leaves to that of the probings, on a machine with every location error;
    /// `None` if some of its unknowns cannot be identified.
    fn left(machine: &Machine, model: &Model, spindle: bool, random: &mut Pcg64Mcg) -> Option<f64> {
        let directions = vec![true; machine.axes.len()];
        let parameters = model.parameters(machine, 0, &directions).unwrap();
        // The probings are within the machine's travel, but the positions touched here need not be.
        let mut wide = machine.clone();
        for axis in &mut wide.axes {
            if !axis.letter.is_rotary() {
                axis.travel = [-1e4, 1e4];
            }
        }
        let artefact = Artefact::from_toml(ARTEFACT, machine.tool_axis).unwrap();
        let mut truth = ErrorModel::perfect(machine);
        for parameter in in_order_of_preference(machine) {
            let size = ERRORS[usize::from(parameter.is_angular())];
            truth.set(machine, parameter, size * random.random_range(-1.0..1.0));
        }
        let plan = plan(machine, 120, spindle, random);
        let disturbances = Disturbances {
            noise: NOISE,
            seed: random.random(),
            ..Disturbances::default()
        };
        let kinematics = Kinematics::new(&wide, &truth);
        let measured = probings(&kinematics, &artefact, &plan, &disturbances).unwrap();
        let perfect = ErrorModel::perfect(machine);
        let problem = Problem::new(machine, &measured, &artefact, &parameters, &perfect);
        assert_eq!(problem.missing(), Ok(Vec::new()), "{}", machine.topology());
        let found = identify(&problem, IdentifyOptions::default()).unwrap();
        let is_parameter = |u: &crate::Unseen| matches!(u.unknown, Unknown::Parameter(_));
        (!found.unseen.iter().any(is_parameter)).then_some(found.noise / NOISE)
    }

    #[test]
    fn what_models_leave_of_a_machine_with_every_location_error_is_noise() {
        let mut random = Pcg64Mcg::seed_from_u64(33);
        let mut machines = examples();
        machines.extend((0..30).map(|_| random_machine(&mut random)));
        let mut tried = 0;
        for machine in &machines {
            for (model, spindle) in [("10", false), ("12", false), ("13", true)] {
                let model: Model = model.parse().unwrap();
                if model.parameters(machine, 0, &[]).is_err() {
                    continue;
                }
                let left = left(machine, &model, spindle, &mut random);
                // 120 rows determine it to 4 %; five times that.
                let is_noise = left.is_some_and(|left| (left - 1.0).abs() < 0.2);
                assert!(
                    is_noise,
                    "{} {} {model}: {left:?}",
                    machine.name,
                    machine.topology()
                );
                tried += 1;
            }
        }
        assert!(tried >= 3 * 30, "{tried}");
    }

    #[test]
    fn sets_are_those_of_the_source_document_and_follow_which_axis_carries_which() {
        let set = |topology: &str| {
            let machines = examples();
            let machine = machines.iter().find(|m| m.topology() == topology).unwrap();
            Model::Named(minimal(machine)).to_string()
        };
        assert_eq!(set("wCAYFXZSt"), "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z");
        assert_eq!(set("wCBXFZYSt"), "EA0B,EC0B,EX0C,EA0C,EB0C,EB0Z,EA0Y,EC0Y");
        // Y carries X, so X is the axis that is not square to it.
        assert_eq!(set("wCAXYFZSt"), "EB0A,EC0A,EY0C,EA0C,EB0C,EC0X,EA0Z,EB0Z");
    }
}
