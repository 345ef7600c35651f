//! The scheme `subset:N` (§9.2 of the source document): the N tables that remove most of the volumetric error, each
//! of one axis and for one axis, as in the table functions of controllers.
//!
//! The tables are those of `candidates`, and their values are sums of a few functions. They are chosen and fitted
//! together (`search`) to the remaining error at the tool (`remains`), not to the corrections of single axes:
//! without a table for a rotary axis, tables of linear axes do what they can for the tip.

mod candidates;
mod remains;
mod search;
#[cfg(test)]
mod tests;

use crate::schemes::blank::blank;
use crate::schemes::points::{Points, points};
use crate::schemes::products::{Factor, Function, Product, layout, subtracted};
use crate::schemes::{Options, SchemeError, SchemeResult, fik};
use candidates::{Candidate, Functions};
use remains::{LEVER, Remains};
use std::num::NonZeroU8;
use trueaxis::Draft;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Region, random_commands};

/// Number of positions at which the volumetric error is minimized.
const POSITIONS: usize = 1500;
/// Their seed, different from that of the verification.
const SEED: u64 = 0x5b5e7;

/// The best `tables` tables, for any machine with two rotary axes.
///
/// # Errors
/// [`SchemeError`].
pub fn compile(
    machine: &Machine,
    errors: &ErrorModel,
    tables: NonZeroU8,
    options: &Options,
) -> Result<SchemeResult, SchemeError> {
    let rotary = machine.axes.iter().filter(|axis| axis.letter.is_rotary());
    if rotary.count() != 2 {
        return Err(SchemeError::axes(machine, "subset", "two rotary axes"));
    }
    let most = usize::from(tables.get());
    if most > options.target.tables {
        return Err(SchemeError::MoreThanTarget {
            asked: most,
            held: options.target.tables,
        });
    }
    let kinematics = Kinematics::new(machine, errors).with_policy(options.policy);
    let functions = Functions::new(&kinematics);
    let remains = remaining(&kinematics, &functions)?;
    let chosen = search::best(&remains, most);
    let points = points(&kinematics, options.points.unwrap_or(fik::POINTS));
    let numbers = remains.numbers(&chosen);
    let terms = chosen.iter().map(|c| remains.candidates[*c]).zip(numbers);
    let mut products: Vec<Product> = terms
        .map(|(candidate, numbers)| product(machine, &functions, &points, candidate, &numbers))
        .collect();
    products.extend(subtracted(machine, &options.zero(machine, errors)?));
    let (banks, placed) = layout(&products, &points, options.format);
    Ok(SchemeResult {
        draft: Draft {
            banks,
            terms: placed.into_iter().map(|p| p.term).collect(),
            ..blank(&kinematics)
        },
        structure_error: None,
        meets: None,
        is_full: false,
        notes: notes(machine, &remains, &chosen, most),
    })
}

/// The quantity from which the remaining error of every set of tables follows.
fn remaining(kinematics: &Kinematics<'_>, functions: &Functions) -> Result<Remains, SchemeError> {
    let candidates = candidates::candidates(kinematics);
    let commands = random_commands(kinematics, Region::Travel, POSITIONS, SEED)?;
    Ok(Remains::new(kinematics, candidates, functions, &commands)?)
}

/// A term with its tables, which hold sums of functions with the given coefficients (mm, rad).
fn product(
    machine: &Machine,
    functions: &Functions,
    points: &[Points],
    candidate: Candidate,
    numbers: &[f64],
) -> Product {
    let Candidate {
        output,
        lever,
        input,
    } = candidate;
    let table = |input: usize, is_coordinate: bool, value: &dyn Fn(f64) -> f64| Factor {
        function: Function {
            input,
            signed: false,
            values: points[input].at.iter().map(|at| value(*at)).collect(),
        },
        is_coordinate,
    };
    let value = |at: f64| {
        let values = functions.of(input, at);
        let sum: f64 = values.iter().zip(numbers).map(|(v, n)| v * n).sum();
        machine.axes[output].to_command(sum)
    };
    let coordinate = |lever| table(lever, true, &|at| functions.coordinate(lever, at));
    let own = table(input, false, &value);
    Product {
        output,
        weight: 1.0,
        limits: None,
        factors: lever.map(coordinate).into_iter().chain([own]).collect(),
        tag: 0,
    }
}

/// Describes what was chosen, and the remaining error.
fn notes(machine: &Machine, remains: &Remains, chosen: &[usize], most: usize) -> Vec<String> {
    let letter = |i: usize| machine.axes[i].letter;
    let name = |c: &usize| {
        let Candidate {
            output,
            lever,
            input,
        } = remains.candidates[*c];
        let lever = lever.map_or(String::new(), |l| format!("{}·", letter(l)));
        format!("d{} of {lever}{}", letter(output), letter(input))
    };
    let names: Vec<String> = chosen.iter().map(name).collect();
    let left = remains.left(chosen).max(0.0);
    let rms = |square: f64| 1e3 * square.sqrt();
    let mut notes = vec![format!("terms: {}", names.join(", "))];
    if remains.before > 0.0 {
        notes.push(format!(
            "of {:.4} µm (root mean square of what counts at the tip, rotations at {LEVER} mm) {:.4} µm remain",
            rms(remains.before),
            rms(left)
        ));
    }
    let taken = search::size(remains, chosen);
    if taken < most {
        notes.push(format!("{taken} tables do as much as {most} would"));
    }
    notes
}
