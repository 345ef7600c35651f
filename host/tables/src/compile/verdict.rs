//! Whether a verified compensation may be written.

use super::Proof;
use serde::Serialize;
use trueaxis_model::kinematics::Policy;
use trueaxis_model::policy::tolerance_urad;

/// A reason not to write a verified compensation, worst first.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Refusal {
    /// Somewhere in the travel, the tables of an axis deviate from its kinematic correction by more than its largest
    /// value: no tables at all would be better.
    #[error(
        "the tables of {axis} do harm: they deviate by up to {deviation:.4} {unit} from the kinematic correction, which is at most {kinematic:.4} {unit}"
    )]
    Harm {
        /// Letter of the axis.
        axis: char,
        /// `µm` or `µrad`.
        unit: &'static str,
        /// Largest deviation over the travel (µm, µrad).
        deviation: f64,
        /// Largest kinematic correction over the travel, minus that of the zero position (µm, µrad).
        kinematic: f64,
    },
    /// The tables deviate from the kinematic correction by more than the tolerance.
    #[error(
        "the tolerance of {} is not met: {reached_um:.4} µm and {reached_urad:.4} µrad were reached",
        wanted(*.policy, *.tolerance_um)
    )]
    Tolerance {
        /// Requested tolerance of linear axes, or at the tip (µm).
        tolerance_um: f64,
        /// Requested tolerance of rotary axes, or of the tool direction (µrad).
        tolerance_urad: f64,
        /// What the rotary axes correct.
        #[serde(skip)]
        policy: Policy,
        /// Value reached for the first (µm).
        reached_um: f64,
        /// Value reached for the second (µrad).
        reached_urad: f64,
    },
}

/// The requirement that a tolerance of `um` µm stands for.
pub(super) fn wanted(policy: Policy, um: f64) -> String {
    match policy {
        Policy::Direction { .. } => format!(
            "{um} µm at the tip and {} µrad of the tool's direction",
            tolerance_urad(policy, um)
        ),
        Policy::Orientation | Policy::Position => format!("{um} µm and µrad"),
    }
}

impl Refusal {
    /// Whether `--best-effort` overrides this. A harmful compensation is never written.
    #[must_use]
    pub const fn yields_to_best_effort(&self) -> bool {
        match self {
            Self::Harm { .. } => false,
            Self::Tolerance { .. } => true,
        }
    }
}

impl Proof {
    /// Reasons not to write the compensation, worst first; empty if all checks pass. `tolerance` is in µm.
    #[must_use]
    pub fn refusals(&self, tolerance: f64) -> Vec<Refusal> {
        let harmful = self
            .travel
            .deviations
            .iter()
            .filter(|found| {
                let allowed = match found.unit {
                    "µm" => tolerance,
                    _ => tolerance_urad(self.travel.policy, tolerance),
                };
                found.deviation > allowed.max(found.kinematic)
            })
            .map(|found| Refusal::Harm {
                axis: found.axis,
                unit: found.unit,
                deviation: found.deviation,
                kinematic: found.kinematic,
            });
        let inside = self.inside();
        let missed = (!self.meets(tolerance)).then_some(Refusal::Tolerance {
            tolerance_um: tolerance,
            tolerance_urad: tolerance_urad(inside.policy, tolerance),
            policy: inside.policy,
            reached_um: inside.difference_um,
            reached_urad: inside.difference_urad,
        });
        harmful.chain(missed).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Refusal;
    use crate::compile::prove;
    use crate::schemes::{self, Scheme};
    use trueaxis_model::errors::{ErrorModel, Parameter};
    use trueaxis_model::machine::Machine;
    use trueaxis_model::validate::Runtime;

    /// Refusals of the tables of a machine with errors of X, where those of Z are multiplied by a factor and the
    /// correction at a position is subtracted.
    fn refusals(factor: f32, zero_at: Option<Vec<f64>>) -> Vec<Refusal> {
        let text = include_str!("../../../../examples/mill-21/machine.toml");
        let machine = Machine::from_toml(text).unwrap();
        let mut errors = ErrorModel::perfect(&machine);
        for (name, value) in [("EXX1", 1e-5), ("EZX1", 2e-5)] {
            assert!(errors.set(&machine, Parameter::parse(name).unwrap(), value));
        }
        let options = schemes::Options {
            zero_at,
            ..schemes::Options::default()
        };
        let found = schemes::find(&machine, &errors, &Scheme::default(), &options).unwrap();
        let mut draft = found.draft;
        let z = machine.index('Z').unwrap();
        for term in &mut draft.terms {
            if usize::from(term.output) == z {
                term.weight *= factor;
            }
        }
        for axis in &mut draft.axes {
            axis.value_bound = 1.0;
        }
        let blob = draft.encode().unwrap();
        let runtime = Runtime::load(&blob).unwrap();
        let zero = options.zero(&machine, &errors).unwrap();
        let verification = prove(&machine, &errors, &runtime, &zero, 300, 1, &()).unwrap();
        verification.refusals(0.05)
    }

    #[test]
    fn tables_that_deviate_by_more_than_the_largest_correction_do_harm() {
        for zero_at in [None, Some(vec![10.0, 20.0, -30.0])] {
            let found = refusals(-1.1, zero_at);
            let [harm, tolerance] = found[..] else {
                panic!("{found:?}");
            };
            let Refusal::Harm {
                axis: 'Z',
                unit: "µm",
                deviation,
                kinematic,
            } = harm
            else {
                panic!("{harm:?}");
            };
            assert!((deviation - 2.1 * kinematic).abs() < 0.05, "{harm}");
            assert!(harm.to_string().starts_with("the tables of Z do harm"));
            assert!(!harm.yields_to_best_effort());
            assert!(matches!(tolerance, Refusal::Tolerance { .. }));
            assert!(tolerance.yields_to_best_effort());
        }
    }

    #[test]
    fn tables_that_deviate_by_less_than_that_are_no_harm_but_miss_the_tolerance() {
        let found = refusals(0.1, None);
        assert!(
            matches!(found[..], [Refusal::Tolerance { .. }]),
            "{found:?}"
        );
        assert_eq!(refusals(1.0, None), []);
    }
}
