//! Groups the runs of one axis with the error motions that they show.

use crate::direct_error::DirectError;
use crate::measurement::AxisRuns;
use crate::motion::name;
use nalgebra::DMatrix;
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Machine;

/// Errors (mm, rad) used to measure gains: far above rounding, with second-order effects far below 1.
const SMALL: [f64; 2] = [1e-4, 1e-7];
/// A motion that shows with at least this fraction of its size is solved for, together with others that do. One that
/// shows with less is a side effect, which is included if it is known.
const SHOWS: f64 = 0.3;

/// Runs, and the same number of motions that show in them and in no others.
pub struct RunBlock {
    /// The axis.
    pub axis: usize,
    /// Lines (by index).
    pub lines: Vec<usize>,
    /// Components that are looked for.
    pub components: Vec<usize>,
    /// For each target, the matrix from readings to motions.
    pub inverse: Vec<DMatrix<f64>>,
}

/// The reading of a line at every target per unit of a motion of its axis (mm or rad per mm or rad).
pub fn gains(machine: &Machine, line: &AxisRuns, component: usize) -> Option<Vec<f64>> {
    let small = SMALL[usize::from(component >= 3)];
    let mut errors = ErrorModel::perfect(machine);
    // The only error that differs from its value where the instrument is set to zero.
    let parameter = Parameter {
        component,
        axis: machine.axes[line.setup.moved].letter.char(),
        kind: ParameterKind::Backlash,
    };
    errors.set(machine, parameter, small);
    let bench = Bench::new(machine, &errors, Default::default());
    let point = line.setup.point(&bench);
    let gain = |q: &f64| {
        let [from, to] = [-1.0, 1.0].map(|direction| line.setup.state(&bench, *q, direction));
        let (from, to) = (from?, to?);
        let deviation = bench.deviation_of(&point, &from, &to);
        Some(bench.reads(line.setup.sense, &deviation, &to.q) / (2.0 * small))
    };
    line.positions(machine).iter().map(gain).collect()
}

/// Components that an instrument measures: angles or displacements.
fn components(line: &AxisRuns) -> std::ops::Range<usize> {
    match line.setup.is_angular() {
        true => 3..6,
        false => 0..3,
    }
}

/// Finds which motions show in which runs.
pub fn blocks(
    machine: &Machine,
    lines: &[(usize, &AxisRuns)],
) -> Result<Vec<RunBlock>, DirectError> {
    let mut blocks: Vec<RunBlock> = Vec::new();
    let mut all_gains = Vec::new();
    for (k, (file, line)) in lines.iter().enumerate() {
        let gains: Option<Vec<Vec<f64>>> =
            components(line).map(|c| gains(machine, line, c)).collect();
        let gains = gains.ok_or_else(|| {
            DirectError::new(
                vec![*file],
                "the linear axes cannot follow a ball",
                "the ball is kept on the indicator by linear axes, which this machine lacks",
            )
        })?;
        let largest = |g: &Vec<f64>| g.iter().fold(0.0, |most: f64, g| most.max(g.abs()));
        let shown = components(line).zip(&gains);
        let shown = shown.filter(|(_, g)| largest(g) > SHOWS);
        let block = RunBlock {
            axis: line.setup.moved,
            lines: vec![k],
            components: shown.map(|(c, _)| c).collect(),
            inverse: Vec::new(),
        };
        all_gains.push(gains);
        blocks = block.merged(blocks);
    }
    for block in &mut blocks {
        block.invert(machine, lines, &all_gains)?;
    }
    // Angles first, because displacements depend on them.
    blocks.sort_by_key(|block| block.components.first().is_some_and(|c| *c < 3));
    Ok(blocks)
}

impl RunBlock {
    /// These blocks, and this one merged with those that share a component with it.
    fn merged(mut self, blocks: Vec<Self>) -> Vec<Self> {
        let mut apart = Vec::new();
        for other in blocks {
            let common = |c: &usize| self.components.contains(c);
            if other.axis == self.axis && other.components.iter().any(common) {
                self.lines.splice(0..0, other.lines);
                self.components.extend(other.components);
            } else {
                apart.push(other);
            }
        }
        self.components.sort_unstable();
        self.components.dedup();
        apart.push(self);
        apart
    }

    fn invert(
        &mut self,
        machine: &Machine,
        lines: &[(usize, &AxisRuns)],
        gains: &[Vec<Vec<f64>>],
    ) -> Result<(), DirectError> {
        let (files, own): (Vec<usize>, Vec<&AxisRuns>) = (self.lines.iter())
            .map(|k| (lines[*k].0, lines[*k].1))
            .unzip();
        let names = self.components.iter().map(|c| name(machine, self.axis, *c));
        let motions = names.collect::<Vec<String>>().join(", ");
        let size = self.components.len();
        match own.len() {
            n if n < size || size == 0 => return Err(DirectError::mixed(files, &motions)),
            n if n > size => return Err(DirectError::twice(files, &motions)),
            _ => {}
        }
        let directions = |line: &AxisRuns| line.means().directions();
        let alike = |line: &&AxisRuns| {
            line.targets == own[0].targets && directions(line) == directions(own[0])
        };
        if let Some(k) = own.iter().position(|line| !alike(line)) {
            return Err(DirectError::new(
                vec![files[0], files[k]],
                "the targets or directions of travel are not the same",
                "measure them at the same targets and in the same directions, for they are looked for together",
            ));
        }
        let inverse = (0..own[0].targets.len()).map(|target| {
            let gain = DMatrix::from_fn(size, size, |row, column| {
                let first = components(own[row]).start;
                gains[self.lines[row]][self.components[column] - first][target]
            });
            // For three directions in a plane the determinant is 0; for well-separated ones it is near 1.
            let can_be_told = gain.determinant().abs() > SHOWS * SHOWS * SHOWS;
            let inverse = gain.try_inverse().filter(|_| can_be_told);
            inverse.ok_or_else(|| DirectError::mixed(files.clone(), &motions))
        });
        self.inverse = inverse.collect::<Result<_, _>>()?;
        Ok(())
    }
}
