//! Measurements of a machine, as an instrument gives them.
//!
//! *Points*: a camera or an R-test on the table gives the place of the tip in a frame of its own, with a short and a long
//! tool. *Balls*: a touch probe finds balls on the table at many positions of the rotary axes.

use crate::class::Class;
use nalgebra::Vector3;
use std::fmt::Write;
use trueaxis_identify::Problem;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::{self, Observations};
use trueaxis_identify::formats::probings::{self, Probings};
use trueaxis_identify::simulate::{self, Disturbances};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_tests::Fixed;
use trueaxis_tests::observed::{Strategy, observed};
use trueaxis_tests::probed::Case;

/// Part of the travel in which points are measured.
const PART: f64 = 0.98;
/// Standard uncertainty of each coordinate of a reading (µm).
const SIGMA: f64 = 1.0;
/// Number of balls, and of probings.
const BALLS: usize = 4;
const PROBINGS: usize = 120;
/// How often balls are placed anew if too few positions reach them.
const TRIES: usize = 5;

/// Measurements as files.
#[derive(Clone, Debug, PartialEq)]
pub enum Measured {
    /// `points.csv`.
    Points(String),
    /// `probings.csv` and `artefact.toml`.
    Balls {
        /// Positions of the axes with the stylus on each ball.
        probings: String,
        /// Where the balls are, to 1 mm.
        artefact: String,
    },
}

/// Measurements as read.
#[derive(Clone, Debug, Default)]
pub struct Readings {
    probings: Probings,
    artefact: Artefact,
    /// Points.
    pub observations: Observations,
}

impl Measured {
    /// Names and contents of the files.
    #[must_use]
    pub fn files(&self) -> Vec<(&'static str, &str)> {
        match self {
            Self::Points(points) => vec![("points.csv", points)],
            Self::Balls { probings, artefact } => {
                vec![("probings.csv", probings), ("artefact.toml", artefact)]
            }
        }
    }

    /// What is in the files.
    ///
    /// # Panics
    /// If they cannot be read: a mistake in the arena.
    #[must_use]
    pub fn read(&self, machine: &Machine) -> Readings {
        match self {
            Self::Points(points) => Readings {
                observations: observations::read(points, "points.csv", machine)
                    .expect("a file of the arena"),
                ..Readings::default()
            },
            Self::Balls { probings, artefact } => Readings {
                probings: probings::read(probings, machine, true).expect("a file of the arena"),
                artefact: Artefact::from_toml(artefact, machine.tool_axis)
                    .expect("a file of the arena"),
                ..Readings::default()
            },
        }
    }
}

impl Readings {
    /// The problem to find some parameters from them.
    #[must_use]
    pub fn problem<'a>(
        &'a self,
        machine: &'a Machine,
        parameters: &[Parameter],
        base: &'a ErrorModel,
    ) -> Problem<'a> {
        let problem = Problem::new(machine, &self.probings, &self.artefact, parameters, base);
        problem.with(&self.observations)
    }
}

/// Where a machine is measured.
pub enum Places<'a> {
    /// Points, and where the instrument really is in each set-up.
    Points(Strategy<'a>, String),
    /// Balls, and the positions of the rotary axes.
    Balls(Box<Case>),
}

impl<'a> Places<'a> {
    /// Draws them; `None` if the machine cannot be measured like this.
    pub fn draw(
        class: Class,
        machine: &'a Machine,
        random: &mut Fixed,
        of_setups: &mut Fixed,
    ) -> Option<Self> {
        if class != Class::TwoRotary {
            let plan = plan(class, machine, random);
            return Some(Self::Points(plan, setups(machine, of_setups)));
        }
        let case = (0..TRIES).find_map(|_| Case::spread(machine, &[], BALLS, PROBINGS, random));
        case.map(|case| Self::Balls(Box::new(case)))
    }

    /// The measurements of the machine with these errors; `None` if an axis would leave its travel.
    pub fn read(&self, machine: &Machine, errors: &ErrorModel, noise: u64) -> Option<Measured> {
        match self {
            Self::Points(plan, setups) => {
                let read = observed(machine, errors, plan, setups, 1.0, noise);
                Some(Measured::Points(observations::write(&read, machine)))
            }
            Self::Balls(case) => {
                let disturbances = Disturbances {
                    noise: SIGMA * 1e-3,
                    seed: noise,
                    ..Disturbances::default()
                };
                let kinematics = Kinematics::new(machine, errors);
                let (artefact, plan) = (&case.artefact, &case.plan);
                let probed = simulate::probings(&kinematics, artefact, plan, &disturbances);
                Some(Measured::Balls {
                    probings: probings::write(&probed.ok()?, machine),
                    artefact: artefact_file(artefact),
                })
            }
        }
    }
}

/// The balls where one would find them with a rule.
fn artefact_file(artefact: &Artefact) -> String {
    let ball = |ball: &trueaxis_identify::formats::artefact::Ball| {
        let place: Vector3<f64> = ball.nominal.unwrap_or_default();
        let [x, y, z] = [place.x, place.y, place.z].map(f64::round);
        format!(
            "[[ball]]\nname = \"{}\"\nnominal_mm = [{x:?}, {y:?}, {z:?}]\n",
            ball.name
        )
    };
    artefact
        .balls
        .iter()
        .map(ball)
        .collect::<Vec<_>>()
        .join("\n")
}

/// Length of the second tool beyond the first (mm): with two, errors of the tool direction are measured, too.
const LONGER: f64 = 100.0;

fn long_tool(machine: &Machine) -> [f64; 3] {
    let mut place = machine.tip;
    place[machine.tool_axis] += LONGER.copysign(place[machine.tool_axis]);
    place
}

/// Where points are measured, with two tools.
fn plan<'a>(class: Class, machine: &'a Machine, random: &mut Fixed) -> Strategy<'a> {
    let heading = format!("# [setup.long]\n# tool_mm = {:?}\n", long_tool(machine));
    let mut plan = Strategy::new(machine, &heading);
    let rows = match class {
        Class::ThreeAxis => 80,
        Class::Rich => 250,
        _ => 120,
    };
    for setup in ["short", "long"] {
        for _ in 0..rows {
            let position = plan.anywhere(PART, random);
            plan.add("point", setup, &position, "", SIGMA);
        }
    }
    plan
}

/// Where the instrument really is in each set-up.
fn setups(machine: &Machine, random: &mut Fixed) -> String {
    let mut text = String::new();
    for (name, tool) in [("short", machine.tip), ("long", long_tool(machine))] {
        let place: [f64; 3] = std::array::from_fn(|_| random.within(-300.0, 300.0));
        let turned: [f64; 3] = std::array::from_fn(|_| random.within(-20.0, 20.0));
        let _ = write!(
            text,
            "# [setup.{name}]\n# place_mm = {place:?}\n# orientation_deg = {turned:?}\n# tool_mm = {tool:?}\n"
        );
    }
    text
}
