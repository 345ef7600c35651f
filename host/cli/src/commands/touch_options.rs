//! Options for touching balls.

use super::bad_input::BadInput;
use super::number::{cone, positive};
use clap::Args;
use trueaxis_probing::plan::Probe;

/// Geometry of the touches.
#[derive(Clone, Args)]
pub struct TouchOptions {
    /// Diameter of the balls; must be given if a probing program is written (plans and simulations assume 20)
    #[arg(long, value_name = "MM", value_parser = positive)]
    ball_diameter: Option<f64>,
    /// Diameter of the stylus tip; must be given if a probing program is written (plans and simulations assume 6)
    #[arg(long, value_name = "MM", value_parser = positive)]
    stylus_diameter: Option<f64>,
    /// Distance from the ball at which a touch begins
    #[arg(long, value_name = "MM", default_value_t = 5.0, value_parser = positive)]
    clearance: f64,
    /// Search distance beyond the nominal surface
    #[arg(long, value_name = "MM", default_value_t = 3.0, value_parser = positive)]
    search: f64,
    /// Largest angle between the stylus and the direction in which a ball stands off the table (default: 60)
    #[arg(long, value_name = "DEG", value_parser = cone)]
    cone: Option<f64>,
    /// Distance that stylus and tool side keep from the solids of machine file and artefact, on every move
    #[arg(long, value_name = "MM", default_value_t = 1.0, value_parser = positive)]
    keep_apart: f64,
    /// Touch each ball this many times around, and half as often farther up, to qualify the probe (trueaxis qualify)
    #[arg(long, value_name = "N", value_parser = around)]
    around: Option<usize>,
    /// Leave out rows whose touches bring the stylus too close to another ball, even if no solids are described
    #[arg(long)]
    keep_clear: bool,
}

/// Diameters of ball and stylus (mm) if nothing is written that moves a machine.
const BALL: f64 = 20.0;
const STYLUS: f64 = 6.0;
/// Default number of touches around a ball that qualify a probe.
const AROUND: usize = 12;
/// Default of the largest angle of the stylus (deg).
const CONE: f64 = 60.0;

/// Enough directions for the lowest orders of lobes.
fn around(text: &str) -> Result<usize, String> {
    let count = text.parse().ok().filter(|count| (6..=100).contains(count));
    count.ok_or_else(|| "give a number from 6 to 100".to_owned())
}

impl TouchOptions {
    /// The options that were given, for another command.
    pub fn words(&self) -> Vec<(&'static str, String)> {
        let given = [
            ("--ball-diameter", self.ball_diameter),
            ("--stylus-diameter", self.stylus_diameter),
            ("--clearance", Some(self.clearance)),
            ("--search", Some(self.search)),
            ("--keep-apart", Some(self.keep_apart)),
            ("--cone", self.cone),
        ];
        let words = given.into_iter();
        words
            .filter_map(|(name, value)| Some((name, value?.to_string())))
            .collect()
    }

    /// True if the touches qualify the probe.
    pub fn qualifies(&self) -> bool {
        self.around.is_some()
    }

    /// The diameter of the balls, if it was given (mm).
    pub fn ball_diameter(&self) -> Option<f64> {
        self.ball_diameter
    }

    /// With five touches of each ball, as a plan has them.
    pub fn five(&self) -> Self {
        Self {
            around: None,
            ..self.clone()
        }
    }

    /// With the touches that qualify a probe.
    pub fn qualifying(&self) -> Self {
        Self {
            around: self.around.or(Some(AROUND)),
            ..self.clone()
        }
    }

    /// The probe for a machine that moves: both diameters are given.
    pub fn stated(&self) -> Result<Probe, BadInput> {
        match (self.ball_diameter, self.stylus_diameter) {
            (Some(_), Some(_)) => self.probe(),
            _ => Err(BadInput::new(
                "the diameters of balls and stylus are not given",
                "give --ball-diameter and --stylus-diameter: the machine moves by them",
            )),
        }
    }

    /// The probe for the library.
    pub fn probe(&self) -> Result<Probe, BadInput> {
        self.probe_within(CONE)
    }

    /// Like `probe`, with another default angle (deg).
    pub fn probe_within(&self, cone: f64) -> Result<Probe, BadInput> {
        let ball = self.ball_diameter.unwrap_or(BALL);
        let stylus = self.stylus_diameter.unwrap_or(STYLUS) / 2.0;
        let radius = ball / 2.0 + stylus;
        if self.search >= radius {
            return Err(BadInput::new(
                format!("--search {} would go through the ball", self.search),
                "give less than half of both diameters",
            ));
        }
        Ok(Probe {
            radius,
            stylus,
            keep: self.keep_apart,
            around: self.around.unwrap_or(0),
            clearance: self.clearance,
            search: self.search,
            cone: self.cone.unwrap_or(cone).to_radians(),
            keeps_clear: self.keep_clear,
        })
    }
}
