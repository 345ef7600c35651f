//! `trueaxis ballbar analyse`

use super::super::Outcome;
use super::super::bad_input::BadInput;
use super::super::files::Text;
use super::answer::{BallbarAnswer, bad_circle, bad_sphere};
use clap::Args;
use std::path::PathBuf;
use trueaxis_direct::ballbar::{CircleRecord, SphereRecord};
use trueaxis_direct::formats::radii::{self, RadiusReadings};

/// Evaluate readings: size and form of a sphere, or G, F and H
///
/// G, F and H are those of circles (ISO 230-4).
#[derive(Args)]
#[command(after_help = "Example:\n  trueaxis ballbar analyse readings.csv\n\n\
A file begins with the length of the bar and the unit of the readings; then come the columns, on a circle the\n\
angle (degrees, from the first axis towards the second) and a reading for each direction of turning:\n  \
# radius_mm = 100.0\n  # plane = \"XY\"\n  # unit = \"um\"\n  angle,ccw,cw\n  0,1.2,-0.4\n  1,1.3,-0.3\n\n\
on a sphere the position from its centre in mm:\n  X,Y,Z,radial\n  150,0,0,1.2")]
pub struct Analyse {
    /// Readings (CSV), measured or simulated
    #[arg(value_name = "READINGS.csv")]
    readings: PathBuf,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// A gap (degrees) between readings that hides a part of the circle: half a lobe of four.
const WIDE: f64 = 45.0;

impl Analyse {
    pub fn run(&self) -> Result<Outcome, BadInput> {
        let text = Text::read(&self.readings)?;
        let found = radii::read(&text.text).map_err(|e| text.bad(e))?;
        let mut answer = BallbarAnswer::default();
        match &found.readings {
            RadiusReadings::Sphere(readings) => {
                let directions = readings.iter();
                let directions: Vec<_> = directions
                    .map(|(place, radial)| (place.normalize(), *radial))
                    .collect();
                let record = SphereRecord::of(found.radius, &directions);
                answer.measured = Some(record.map_err(bad_sphere)?);
            }
            RadiusReadings::Circle(turns) => {
                let record = CircleRecord::of(found.radius, found.plane.as_deref(), turns);
                answer.circle = Some(record.map_err(bad_circle)?);
                let gap = turns.widest_gap().to_degrees();
                if gap > WIDE {
                    eprintln!(
                        "warning: {}: no readings over {gap:.0}° of a turn: G, F, H and the centre say nothing of that part, and ISO 230-4 has whole circles",
                        text.name
                    );
                }
            }
        }
        answer.print(self.json)?;
        Ok(Outcome::Done)
    }
}
