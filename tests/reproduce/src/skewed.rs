//! Section 6.6: the scheme of Chapter 6 on a machine with A tilted by 45 degrees.

use super::embedded::{Example, Parameters, huron};
use super::validated::{both, options, trigo23};
use super::{Chapter, Compared, Figure, Fixed, ReproduceError};
use rayon::prelude::*;
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Policy;
use trueaxis_model::validate::Runtime;
use trueaxis_report::scheme_comparison::probed::Strategy;
use trueaxis_tables::compile;
use trueaxis_tables::schemes::Scheme;

const RANDOM: usize = 2000;
const SEED: u64 = 1;
/// Range of A (deg): as probed on the document's other machine.
const RANGE: f64 = 55.0;
/// Number of points in a table (section 6.8).
const POINTS: usize = 100;

/// Eliminated part (%).
#[derive(Clone, Copy)]
struct Gone {
    mean: f64,
    max: f64,
    /// For the least compensated parameter.
    least: Option<f64>,
}

/// One of these figures.
type OfGone = fn(&Gone) -> Option<f64>;

fn gone(
    example: &Example,
    errors: &ErrorModel,
    scheme: Scheme,
    policy: Policy,
    points: Option<usize>,
) -> Result<Gone, ReproduceError> {
    let machine = &example.machine;
    let options = options(scheme, policy, points, RANDOM);
    let compiled = compile::compile(machine, errors, &options, &())?;
    let travel = &compiled.verification.travel;
    let [before, after] = [&travel.before, &travel.after].map(|q| q.translation_um);
    let percent = |before: f64, after: f64| 100.0 * (1.0 - after / before);
    let strategy = Strategy::new(machine, errors, SEED)?;
    let runtime = Runtime::load(&compiled.built.blob)?;
    let left = strategy.compensability(machine, errors, &runtime)?;
    let parts = left.parameters.iter().filter_map(|p| Some(p.part()?[0]));
    let least = parts.fold(f64::INFINITY, f64::min);
    Ok(Gone {
        mean: percent(before.mean, after.mean),
        max: percent(before.max, after.max),
        least: least.is_finite().then_some(100.0 * least),
    })
}

const VALUES: &str = "the simulated values, the travels and the number of points are not published: these are the 13 \
    errors of Table 7-2, A within ±55° and 100 points. The printed form (Eq. 44) has nothing for offsets";
const FREE: &str = "with a free LUT₁ (errata of Eq. 45) the figures are reached";
const SMALL: &str =
    "offsets of 1 and 2 µm: what little is left of the others is as large as they are";

pub fn chapter() -> Result<Chapter, ReproduceError> {
    let errors = huron()?.errors(Parameters::Huron13)?;
    let [orientation, direction] = both();
    let all = vec![
        (trigo23(false), orientation, Some(POINTS)),
        (trigo23(true), orientation, Some(POINTS)),
        (Scheme::default(), orientation, None),
        (Scheme::default(), direction, None),
    ];
    let found = all.into_par_iter().map(|(scheme, policy, points)| {
        let example = huron()?.within('A', RANGE);
        gone(&example, &errors, scheme, policy, points)
    });
    let found = found.collect::<Result<Vec<Gone>, ReproduceError>>()?;
    let free = &found[1];
    Ok(Chapter {
        title: "Chapter 6: the machine whose A is tilted",
        source: "section 6.6",
        how: "The Huron with the 13 errors of Table 7-2 over its linear travel. Parameters are identified from simulated \
            probings of six balls all over it.",
        compared: compared(&found),
        tables: Vec::new(),
        fixed: vec![Fixed {
            statement: "23 tables compensate more than 99 % of mean and maximum (with a free LUT₁)"
                .to_owned(),
            found: format!("{:.2} and {:.2} %", free.mean, free.max),
            holds: free.mean > 99.0 && free.max > 99.0,
        }],
        pictures: Vec::new(),
    })
}

/// The part compensated by trigo23 and trigo23:free, beside `exact`.
fn compared(found: &[Gone]) -> Vec<Compared> {
    let rows: [(&str, OfGone, &'static str); 3] = [
        ("mean error that is compensated", |g| Some(g.mean), FREE),
        ("maximum that is compensated", |g| Some(g.max), FREE),
        ("least compensability of a parameter", |g| g.least, SMALL),
    ];
    let mut compared = Vec::new();
    for (what, of, why) in rows {
        let at = |i: usize| of(&found[i]).map_or(Figure::Nothing, |value| Figure::new(value, 2));
        let row = |what: String, i: usize| {
            Compared::plain(what, Figure::Words("> 99".to_owned()), at(i))
                .in_unit("%")
                .beside([at(2), at(3)])
        };
        compared.extend([
            row(format!("{what}: trigo23"), 0).because(VALUES),
            row("… trigo23:free".to_owned(), 1).because(why),
        ]);
    }
    compared
}
