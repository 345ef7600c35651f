//! The tables: their curves, terms as formulas, effect on each axis, and cost.

use super::tested::range;
use super::words::is_rotary;
use super::{ReportError, Subject};
use serde::{Deserialize, Serialize};
use trueaxis::{Bank, Interpolation, Largest};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Command, Runtime};
use trueaxis_tables::compile::bounds_of;
use trueaxis_tables::contents::{Contents, GridEntry, TermEntry, contents};
use trueaxis_tables::cost::{CYCLES_PER_INSTRUCTION, instructions};
use trueaxis_tables::size::Size;

/// Number of steps along an axis.
const STEPS: u32 = 120;
/// Clock of the reference board (MHz).
const CLOCK: f64 = 168.0;

/// Contents and effect of a compensation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TablesShown {
    /// Counts and sizes.
    pub size: Size,
    /// Estimated instructions of an evaluation on a Cortex-M4F.
    pub instructions: f64,
    /// Estimated cycles of an evaluation without wait states.
    pub cycles: f64,
    /// Estimated time at 168 MHz.
    pub time_us: f64,
    /// Classification by ISO/TR 16907.
    pub class: Class,
    /// Every table.
    pub curves: Vec<TableCurve>,
    /// Every term.
    pub terms: Vec<Formula>,
    /// The grids, one sentence each.
    pub grids: Vec<String>,
    /// Effect on each axis.
    pub axes: Vec<AxisUse>,
}

/// Types of numerical compensation of ISO/TR 16907.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// The abbreviations that apply, such as `L-VOL+`, `R-ANG`.
    pub names: Vec<String>,
    /// Their meaning.
    pub words: String,
}

/// One table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TableCurve {
    /// `T3`.
    pub name: String,
    /// Input of the table.
    pub input: String,
    /// Unit of its input.
    pub input_unit: String,
    /// Unit of its values: `mm`, `deg`, or `factor` if it is used in products.
    pub unit: String,
    /// `linear` or `cubic`.
    pub interpolation: String,
    /// `both`, `positive`, `negative` or `signed`.
    pub direction: String,
    /// True if its input wraps.
    pub is_endless: bool,
    /// Positions of its points.
    pub at: Vec<f64>,
    /// Values at these.
    pub values: Vec<f64>,
}

/// One term.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Formula {
    /// The corrected axis.
    pub output: char,
    /// `ΔX += 0.5 · T3(A) · T7(Y)`, its weight to four digits.
    pub formula: String,
    /// True if its weight can be changed at run time.
    pub is_adjustable: bool,
}

/// The effect on an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AxisUse {
    /// Letter.
    pub axis: char,
    /// `mm` or `deg`.
    pub unit: String,
    /// Largest correction.
    pub largest: f64,
    /// Bound of the correction.
    pub value_bound: f64,
    /// Largest rate of the correction at top speed of all axes, per second.
    pub largest_rate: f64,
    /// Bound of the rate, per second.
    pub rate_bound: f64,
    /// The axis along which the correction varies most, with all linear axes in the middle and rotary ones at zero;
    /// `None` if it does not vary.
    pub along: Option<CorrectionAlong>,
}

/// A correction along an axis.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CorrectionAlong {
    /// The axis that moves.
    pub axis: char,
    /// Unit of the correction.
    pub unit: String,
    /// Positions of the correction.
    pub at: Vec<f64>,
    /// The correction after positive travel.
    pub positive: Vec<f64>,
    /// The correction after negative travel, if it differs.
    pub negative: Option<Vec<f64>>,
}

/// Evaluates the compensation.
pub fn tables(subject: &Subject<'_>, runtime: &Runtime<'_>) -> Result<TablesShown, ReportError> {
    let machine = subject.machine;
    let contents = contents(runtime);
    let found = bounds_of(machine, runtime, subject.seed, &())?;
    let count = instructions(runtime);
    let cycles = count * CYCLES_PER_INSTRUCTION;
    let largest = subject.compensation.map(|c| &c.verification.travel.largest);
    let axes = contents.axes.iter().zip(&found).enumerate();
    let axes = axes.map(|(i, (axis, found))| AxisUse {
        axis: axis.name,
        unit: axis.unit.to_owned(),
        largest: largest.map_or(found.largest, |largest| found.largest.max(largest[i])),
        value_bound: wide(axis.value_bound),
        largest_rate: found.largest_rate,
        rate_bound: wide(axis.rate_bound),
        along: along(machine, runtime, i),
    });
    let grids = contents.grid_list.iter().enumerate();
    let grids = grids.map(|(k, grid)| format!("G{k}: {}", grid_in_words(grid)));
    Ok(TablesShown {
        size: contents.size,
        instructions: count,
        cycles,
        time_us: cycles / CLOCK,
        class: class(&contents),
        curves: curves(&contents, runtime),
        terms: formulas(&contents),
        grids: grids.collect(),
        axes: axes.collect(),
    })
}

fn grid_in_words(grid: &GridEntry) -> String {
    let inputs = grid.inputs.iter();
    let inputs: Vec<String> = inputs
        .map(|i| format!("{} ({})", i.input, i.points))
        .collect();
    let outputs: Vec<String> = grid.outputs.iter().map(|o| format!("Δ{o}")).collect();
    format!(
        "{} from nodes in {}",
        outputs.join(", "),
        inputs.join(" × ")
    )
}

/// The shortest decimal number that rounds to an f32.
fn wide(value: f32) -> f64 {
    value
        .to_string()
        .parse()
        .unwrap_or_else(|_| f64::from(value))
}

fn unit_of(axis: &str) -> &'static str {
    match axis {
        "A" | "B" | "C" => "deg",
        "X" | "Y" | "Z" | "U" | "V" | "W" | "tool length" => "mm",
        _ => "K",
    }
}

fn formulas(contents: &Contents<'_>) -> Vec<Formula> {
    let inputs = contents.inputs();
    let terms = contents.term_list.iter();
    terms
        .map(|term| {
            let shown = TermEntry {
                weight: four_digits(term.weight),
                ..term.clone()
            };
            let product = shown.product(&inputs).replace('-', "−");
            Formula {
                output: term.output,
                formula: format!("Δ{} += {product}", term.output),
                is_adjustable: term.limits.is_some(),
            }
        })
        .collect()
}

/// A weight as displayed, with four digits.
fn four_digits(weight: f32) -> f32 {
    format!("{weight:.3e}").parse().unwrap_or(weight)
}

/// The values of every table at its points.
fn curves(contents: &Contents<'_>, runtime: &Runtime<'_>) -> Vec<TableCurve> {
    let compensation = runtime.compensation();
    let banks = contents.bank_list.iter().zip(compensation.banks());
    let tables = banks.flat_map(|(entry, bank)| {
        let [first, last] = entry.tables;
        (first..=last).map(move |table| (entry, bank, table))
    });
    tables
        .map(|(entry, bank, table)| {
            let values = values(compensation, bank, table);
            let at = |node: usize| {
                let at = f64::from(bank.start) + node as f64 * f64::from(bank.step);
                wide(at as f32)
            };
            TableCurve {
                name: format!("T{table}"),
                input: entry.input.clone(),
                input_unit: unit_of(&entry.input).to_owned(),
                unit: unit_of_table(contents, table).to_owned(),
                interpolation: entry.interpolation.to_owned(),
                direction: entry.direction.to_owned(),
                is_endless: entry.modulo,
                at: (0..values.len()).map(at).collect(),
                values,
            }
        })
        .collect()
}

/// The values of a table at the nodes of its bank.
fn values(compensation: &Largest<'_>, bank: &Bank, table: usize) -> Vec<f64> {
    let sample = |k: usize| compensation.sample(table, k).map_or(0.0, f64::from);
    let points = bank.points as usize;
    let nodes = match (bank.interpolation, bank.modulo) {
        (Interpolation::Linear, false) => points,
        (Interpolation::Cubic, false) => points - 2,
        // The first point again, at the end of the period.
        (_, true) => points + 1,
    };
    let value = |node: usize| match bank.interpolation {
        Interpolation::Linear => sample(node % points),
        // The uniform cubic B-spline at the start of an interval.
        Interpolation::Cubic => {
            let c = |k: usize| sample((node + k) % points);
            (c(0) + 4.0 * c(1) + c(2)) / 6.0
        }
    };
    (0..nodes).map(|node| wide(value(node) as f32)).collect()
}

/// The unit of a table's values, unless it is a factor of a product or corrects axes of both kinds.
fn unit_of_table(contents: &Contents<'_>, table: usize) -> &'static str {
    let terms = contents.term_list.iter();
    let mut with = terms.filter(|term| term.tables.iter().any(|t| usize::from(*t) == table));
    let Some(first) = with.clone().next().map(|term| is_rotary(term.output)) else {
        return "factor";
    };
    let alone = with.all(|term| term.tables.len() == 1 && is_rotary(term.output) == first);
    match (alone, first) {
        (true, true) => "deg",
        (true, false) => "mm",
        (false, _) => "factor",
    }
}

/// The correction of an axis along the axis with which it varies most.
fn along(machine: &Machine, runtime: &Runtime<'_>, output: usize) -> Option<CorrectionAlong> {
    let middle = |axis: &trueaxis_model::machine::Axis| {
        let [low, high] = axis.travel;
        match axis.letter.is_rotary() {
            true => 0.0_f64.max(low).min(high),
            false => 0.5 * (low + high),
        }
    };
    let centre: Vec<f64> = machine.axes.iter().map(middle).collect();
    let curve = |moved: usize, sign: f64| -> Vec<f64> {
        let [low, high] = machine.axes[moved].travel;
        let mut direction = vec![0.0; machine.axes.len()];
        direction[moved] = sign;
        positions(low, high)
            .map(|q| {
                let mut position = centre.clone();
                position[moved] = q;
                let command = Command::coming(machine, &position, &direction);
                wide(runtime.evaluate(&command)[output])
            })
            .collect()
    };
    let varies = |values: &[f64]| range(values.iter());
    let all = (0..machine.axes.len()).map(|moved| (moved, curve(moved, 1.0)));
    let (moved, positive) = all.max_by(|a, b| varies(&a.1).total_cmp(&varies(&b.1)))?;
    if varies(&positive) == 0.0 {
        return None;
    }
    let negative = curve(moved, -1.0);
    let axis = &machine.axes[moved];
    Some(CorrectionAlong {
        axis: axis.letter.char(),
        unit: axis.unit().to_owned(),
        at: positions(axis.travel[0], axis.travel[1]).collect(),
        negative: (negative != positive).then_some(negative),
        positive,
    })
}

fn positions(low: f64, high: f64) -> impl Iterator<Item = f64> {
    (0..=STEPS).map(move |k| low + (high - low) * f64::from(k) / f64::from(STEPS))
}

/// The types of ISO/TR 16907 that the terms amount to. Corrections of linear axes: by their own position (L-POS); by
/// another axis along a straight line (L-SQR) or a curve (L-STR); by several axes (L-ANG); all of these (L-VOL).
/// Corrections of rotary axes for the tool orientation (FOR; with L-VOL: L-VOL+). Corrections of errors of rotary
/// axes: of position (R-RAX), or with orientation (R-ANG).
fn class(contents: &Contents<'_>) -> Class {
    let straight: Vec<bool> = (contents.bank_list.iter())
        .flat_map(|bank| {
            let tables = bank.tables[1] + 1 - bank.tables[0];
            std::iter::repeat_n(bank.points == 2 && bank.interpolation == "linear", tables)
        })
        .collect();
    let inputs = contents.inputs();
    let mut found = LocatedValue::default();
    for term in &contents.term_list {
        let mut reads: Vec<&str> = (term.tables.iter())
            .map(|t| inputs[usize::from(*t)])
            .filter(|input| input.len() == 1)
            .collect();
        reads.sort_unstable();
        reads.dedup();
        let linear = |t: &&u8| !inputs[usize::from(**t)].chars().all(is_rotary);
        let mut read = term.tables.iter().filter(linear);
        let is_straight = read.all(|t| straight[usize::from(*t)]);
        found.add(term.output, &reads, is_straight);
    }
    for grid in &contents.grid_list {
        let reads: Vec<&str> = grid.inputs.iter().map(|i| i.input.as_str()).collect();
        for output in &grid.outputs {
            found.add(*output, &reads, false);
        }
    }
    found.class()
}

#[derive(Default)]
struct LocatedValue {
    own: bool,
    square: bool,
    straight: bool,
    several: bool,
    turning: bool,
    orientation: bool,
}

impl LocatedValue {
    /// Adds a correction of an axis that depends on given axes.
    fn add(&mut self, output: char, reads: &[&str], is_straight: bool) {
        let (rotary, linear): (Vec<&str>, Vec<&str>) =
            reads.iter().partition(|r| r.chars().all(is_rotary));
        self.turning |= !rotary.is_empty();
        if is_rotary(output) {
            self.orientation = true;
            return;
        }
        match linear[..] {
            [] => {}
            [one] if one.starts_with(output) => self.own = true,
            [_] if is_straight => self.square = true,
            [_] => self.straight = true,
            _ => self.several = true,
        }
    }

    fn class(&self) -> Class {
        let names = self.names();
        let words: Vec<String> = names
            .iter()
            .map(|(name, words)| format!("{name}: {words}"))
            .collect();
        Class {
            names: names.iter().map(|(name, _)| (*name).to_owned()).collect(),
            words: match words.is_empty() {
                true => "nothing that depends on a position".to_owned(),
                false => words.join("; "),
            },
        }
    }

    /// Types with their descriptions.
    fn names(&self) -> Vec<(&'static str, &'static str)> {
        let volume = self.several || (self.own && (self.square || self.straight));
        let mut names = Vec::new();
        if volume {
            names.push(match self.orientation {
                true => (
                    "L-VOL+",
                    "volumetric compensation of linear axes including functional orientation",
                ),
                false => ("L-VOL", "volumetric compensation of linear axes"),
            });
        } else {
            if self.own {
                names.push(("L-POS", "positioning of linear axes"));
            }
            if self.square {
                names.push(("L-SQR", "squareness of linear axes"));
            }
            if self.straight {
                names.push(("L-STR", "straightness of linear axes"));
            }
            if self.orientation {
                names.push(("FOR", "functional orientation"));
            }
        }
        if self.turning {
            names.push(match self.orientation {
                true => ("R-ANG", "position and orientation errors of rotary axes"),
                false => ("R-RAX", "radial and axial errors of rotary axes"),
            });
        }
        names
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The types for terms with these outputs, inputs and straightness.
    fn names(terms: &[(char, &[&str], bool)]) -> Vec<String> {
        let mut found = LocatedValue::default();
        for (output, reads, is_straight) in terms {
            found.add(*output, reads, *is_straight);
        }
        found.class().names
    }

    #[test]
    fn weights_are_shown_to_four_digits() {
        for (weight, shown) in [
            (-0.749_943_44, "-0.7499"),
            (2.0, "2"),
            (0.001_418_677_6, "0.001419"),
        ] {
            assert_eq!(four_digits(weight).to_string(), shown);
        }
    }

    #[test]
    fn compensations_have_the_types_of_iso_tr_16907() {
        assert_eq!(names(&[('X', &["X"], false)]), ["L-POS"]);
        assert_eq!(names(&[('Y', &["X"], true)]), ["L-SQR"]);
        assert_eq!(names(&[('Y', &["X"], false)]), ["L-STR"]);
        let volume: [(char, &[&str], bool); 2] = [('X', &["X"], false), ('Y', &["X"], true)];
        assert_eq!(names(&volume), ["L-VOL"]);
        assert_eq!(names(&[('X', &["Y", "Z"], true)]), ["L-VOL"]);
        assert_eq!(names(&[('X', &["C"], false)]), ["R-RAX"]);
        let whole: [(char, &[&str], bool); 2] =
            [('X', &["C", "X", "Y"], false), ('A', &["C"], false)];
        assert_eq!(names(&whole), ["L-VOL+", "R-ANG"]);
        assert_eq!(names(&[('A', &["X"], false)]), ["FOR"]);
        assert!(names(&[('X', &[], false)]).is_empty());
    }
}
