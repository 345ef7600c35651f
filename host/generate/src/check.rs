//! Inputs at which a build that fuses or reorders operations gives itself away.

use crate::interpret::{Given, Machine};
use crate::program::Program;
use crate::proof::places;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use trueaxis::{Largest, Travel};

/// A call of the code, and what it has to give.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    pub inputs: Vec<f32>,
    /// For each axis.
    pub travel: Vec<Travel>,
    pub weights: Vec<f32>,
    pub corrections: Vec<f32>,
}

/// Largest number of checks of a file.
const MOST: usize = 24;
/// Inputs of which the best becomes a check.
const DRAWN: usize = 128;

/// Few calls that show if any single operation was fused with another one, or done in another order. Operations for which
/// none of the last [`DRAWN`] inputs show this are left out: it changes nothing, or next to nothing.
pub fn checks(program: &Program, compensation: &Largest<'_>) -> Vec<Check> {
    let mut random = Pcg64Mcg::seed_from_u64(0);
    let mut machine = Machine::new(program);
    let mut unseen = machine.liberties();
    let mut checks = Vec::new();
    while checks.len() < MOST && (!unseen.is_empty() || checks.is_empty()) {
        let drawn = (0..DRAWN).map(|_| {
            let check = draw(&mut random, &mut machine, program, compensation);
            let mut rest = unseen.clone();
            rest.retain(|liberty| {
                machine.liberty = Some(*liberty);
                check.is_met(&mut machine)
            });
            machine.liberty = None;
            (rest, check)
        });
        let Some((rest, check)) = drawn.min_by_key(|(rest, _)| rest.len()) else {
            break;
        };
        if rest.len() == unseen.len() && !checks.is_empty() {
            break;
        }
        unseen = rest;
        checks.push(check);
    }
    checks
}

impl Check {
    /// Whether the machine gives these corrections; the sign of a zero does not matter.
    pub fn is_met(&self, machine: &mut Machine<'_>) -> bool {
        let mut found = self.corrections.clone();
        machine.run(&self.given(), &mut found);
        found == self.corrections
    }

    fn given(&self) -> Given<'_> {
        Given {
            inputs: &self.inputs,
            travel: &self.travel,
            weights: &self.weights,
        }
    }
}

/// Random inputs within the tables, and what the code computes there.
pub fn draw(
    random: &mut Pcg64Mcg,
    machine: &mut Machine<'_>,
    program: &Program,
    compensation: &Largest<'_>,
) -> Check {
    let mut part = || random.random::<f32>();
    let inputs = places(compensation).into_iter().map(|places| {
        let place = (part() * places.len() as f32) as usize;
        places.get(place).map_or(0.0, |[start, step, points]| {
            // Sometimes beyond, where an endless axis is reduced by whole turns.
            let beyond = if part() < 0.125 {
                3.0 * part() - 1.0
            } else {
                part()
            };
            start + beyond * step * (points - 1.0)
        })
    });
    let inputs = inputs.collect();
    let limits = compensation.terms().filter_map(|term| term.limits);
    let weights = limits.map(|[low, high]| low + (high - low) * part());
    let weights = weights.collect();
    let travel = (0..program.axes).map(|_| match part() < 0.5 {
        true => Travel::Positive,
        false => Travel::Negative,
    });
    let mut check = Check {
        inputs,
        travel: travel.collect(),
        weights,
        corrections: Vec::new(),
    };
    let mut corrections = vec![0.0; program.axes];
    machine.run(&check.given(), &mut corrections);
    check.corrections = corrections;
    check
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lower::lower;
    use trueaxis_model::validate::Runtime;
    use trueaxis_tables::contents::contents;
    use trueaxis_tests::golden;

    /// Each operation alone: compilers fuse or reorder many at once.
    #[test]
    fn an_operation_that_is_fused_or_done_in_another_order_is_noticed() {
        for name in ["huron-13", "router-10", "table-head-13", "everything"] {
            let blob = golden::blob(name);
            let runtime = Runtime::load(&blob).unwrap();
            let compensation = runtime.compensation();
            let program = lower(compensation, &contents(&runtime));
            let checks = checks(&program, compensation);
            let mut machine = Machine::new(&program);
            assert!(checks.iter().all(|check| check.is_met(&mut machine)));
            let mut random = Pcg64Mcg::seed_from_u64(1);
            let others: Vec<Check> = (0..200)
                .map(|_| draw(&mut random, &mut machine, &program, compensation))
                .collect();
            let mut noticed = 0;
            for liberty in machine.liberties() {
                machine.liberty = Some(liberty);
                let differs = |checks: &[Check], machine: &mut Machine<'_>| {
                    checks.iter().filter(|check| !check.is_met(machine)).count()
                };
                let is_noticed = differs(&checks, &mut machine) > 0;
                // What changes a bit less often than that, the choice of checks may not have met.
                let often = differs(&others, &mut machine) * 20 >= others.len();
                assert!(is_noticed || !often, "{name}: {liberty:?}");
                noticed += usize::from(is_noticed);
            }
            assert!(noticed > 10, "{name}: {noticed}");
        }
    }
}
