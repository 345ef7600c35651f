//! `trueaxis qualify`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use super::number::{positive, size};
use super::output;
use super::quantity::count;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_model::machine::Machine;
use trueaxis_probing::probe_file::ORDERS;
use trueaxis_probing::qualify::{ProbePriors, ProbeUnknown, Qualified, QualifiedRecord, qualify};
use trueaxis_probing::spheres::{Touched, read_log};

/// Qualify a touch probe by touching one ball: tip radius and pre-travel by direction, and where the tip is
///
/// The effective radius of the tip is the distance from ball to tip at which the probe trips, less the radius of the
/// ball. It depends on the direction around the stylus (lobes) and differs at the pole. Directions point from the ball to
/// the tip. Touches at two or more rotary
/// positions, or a ball whose place is known, also tell where the tip is. What the touches do not determine is named.
#[derive(Args)]
#[command(
    after_help = "Example:\n  trueaxis linuxcnc probe machine.toml --artefact artefact.toml --plan poses.csv --around 12 \\\n    \
--ball-diameter 20 --stylus-diameter 6 -o ball.csv\n  \
trueaxis qualify machine.toml ball.csv --ball-diameter 20 --stylus-diameter 6 -o probe.toml\n  \
trueaxis probings machine.toml touches.csv --plan plan.csv --probe probe.toml -o probings.csv\n\n\
All touches are of one ball, with the spindle at 0. poses.csv has a line for each rotary position: ball,A,C"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Log of the touches
    touches: PathBuf,
    /// Diameter of the ball, as calibrated
    #[arg(long, value_name = "MM", value_parser = positive)]
    ball_diameter: f64,
    /// Standard uncertainty of the diameter of the ball
    #[arg(long, value_name = "µm", default_value_t = 0.0, value_parser = size)]
    ball_uncertainty: f64,
    /// Diameter of the stylus tip, as it is stated: shows a wrong diameter of the ball
    #[arg(long, value_name = "MM", value_parser = positive)]
    stylus_diameter: Option<f64>,
    /// Where the ball is (artefact.toml with nominal_mm of this ball), if that is known
    #[arg(
        long,
        value_name = "FILE",
        requires = "ball",
        requires = "place_uncertainty"
    )]
    artefact: Option<PathBuf>,
    /// Name of the ball in the artefact
    #[arg(long, value_name = "NAME", requires = "artefact")]
    ball: Option<String>,
    /// Standard uncertainty of each coordinate of its place
    #[arg(long, value_name = "µm", requires = "artefact", value_parser = positive)]
    place_uncertainty: Option<f64>,
    /// Highest order of the lobes
    #[arg(long, value_name = "N", default_value_t = ORDERS_OF_LOBES, value_parser = orders)]
    orders: usize,
    /// Where to write the probe
    #[arg(short, long, value_name = "PROBE.toml")]
    output: Option<PathBuf>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// Default of the highest order of the lobes.
pub const ORDERS_OF_LOBES: usize = 4;

fn orders(text: &str) -> Result<usize, String> {
    let orders = text
        .parse()
        .ok()
        .filter(|orders| (1..=ORDERS).contains(orders));
    orders.ok_or_else(|| format!("write a number from 1 (none) to {ORDERS}"))
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let mut inputs: Vec<&Path> = vec![&arguments.machine, &arguments.touches];
    inputs.extend(arguments.artefact.as_deref());
    if let Some(output) = &arguments.output {
        output::prepare(output, &inputs)?;
    }
    let machine = files::read_machine(&arguments.machine)?;
    let known = arguments.known(&machine)?;
    let (found, log) = qualified(&machine, &known, &arguments.touches)?;
    if let Some(output) = &arguments.output {
        output::write(output, found.file.to_toml().as_bytes())?;
    }
    match arguments.json {
        true => output::print_json(&QualifiedRecord::of(&found, &log))?,
        false => show(&found, &log, &known, arguments.output.as_deref())?,
    }
    Ok(outcome(&found))
}

/// Qualifies a probe by a log of touches.
pub fn qualified(
    machine: &Machine,
    known: &ProbePriors,
    touches: &Path,
) -> Result<(Qualified, Vec<Touched>), BadInput> {
    let text = Text::read(touches)?;
    let log = read_log(&text.text, machine).map_err(|e| text.bad(e))?;
    let touches: Vec<_> = log.iter().map(|touched| touched.position).collect();
    let found = qualify(machine, known, &touches)
        .map_err(|error| BadInput::new(format!("{}: {error}", text.name), error.remedy))?;
    Ok((found, log))
}

/// Prints what people read.
pub fn show(
    found: &Qualified,
    log: &[Touched],
    known: &ProbePriors,
    written: Option<&Path>,
) -> Result<(), BadInput> {
    let mut said = screen(found, log[found.worst.0].line, known);
    if let Some(output) = written {
        said += &format!("{}: written\n", output.display());
    }
    output::print(&said)?;
    for sentence in found.warnings(log) {
        eprintln!("warning: {sentence}");
    }
    Ok(())
}

fn outcome(found: &Qualified) -> Outcome {
    match found.outliers.is_empty() {
        true => Outcome::Done,
        false => Outcome::CheckFailed,
    }
}

impl Arguments {
    fn known(&self, machine: &Machine) -> Result<ProbePriors, BadInput> {
        let mut known = ProbePriors {
            radius: self.ball_diameter / 2.0,
            radius_uncertainty: self.ball_uncertainty * 0.5e-3,
            place: None,
            tip: machine.tip.into(),
            stylus: self.stylus_diameter.map(|diameter| diameter / 2.0),
            orders: self.orders,
        };
        if let (Some(path), Some(name), Some(uncertainty)) =
            (&self.artefact, &self.ball, self.place_uncertainty)
        {
            let artefact = files::read_artefact(path, machine)?;
            known.tip = artefact.stylus.place(machine);
            let ball = artefact.balls.iter().find(|ball| ball.name == *name);
            let place = ball.and_then(|ball| ball.nominal).ok_or_else(|| {
                BadInput::new(
                    format!(
                        "{}: ball `{name}` is not there, or has no nominal_mm",
                        path.display()
                    ),
                    "write [[ball]] with its name and nominal_mm",
                )
            })?;
            known.place = Some((place, uncertainty * 1e-3));
        }
        Ok(known)
    }
}

fn screen(found: &Qualified, worst: usize, known: &ProbePriors) -> String {
    let mut text = format!(
        "{} touches at {}, noise {:.2} µm; the worst is {:+.2} µm off (line {worst})\n\n{}",
        found.touches,
        count(found.positions, "rotary position"),
        um(found.noise),
        um(found.worst.1),
        effective_tip(found)
    );
    if let Some(apart) = found.apart {
        text += &format!(
            "the centres of the ball at the rotary positions are {:.2} µm apart (rms): errors of the machine, and of the stated tip\n",
            um(apart)
        );
    } else if known.place.is_none() && found.file.tip.iter().any(Option::is_some) {
        text += "where the tip is rests on where the rotary axes are: their errors are not in its uncertainty\n";
    }
    if known.stylus.is_none() {
        text += "the radius rests on --ball-diameter alone: --stylus-diameter would show an error of it\n";
    }
    if !found.undetermined.is_empty() {
        let names: Vec<String> = found.undetermined.iter().map(ToString::to_string).collect();
        text += &format!(
            "not determined: {}; touch at other rotary positions and latitudes, or say where the ball is (--artefact)\n",
            names.join(", ")
        );
    }
    text
}

fn um(mm: f64) -> f64 {
    mm * 1e3
}

/// Radius, shape and place of the tip, each with its uncertainty.
fn effective_tip(found: &Qualified) -> String {
    let file = &found.file;
    let mut text = format!(
        "effective tip                     standard\n  radius        {:>10.4} mm {:>8.2} µm\n",
        file.radius,
        um(file.radius_uncertainty)
    );
    if !found.undetermined.contains(&ProbeUnknown::Pole) {
        text += &format!(
            "  at the pole   {:>+10.2} µm {:>8.2} µm\n",
            um(file.shape.pole),
            um(file.pole_uncertainty)
        );
    }
    for lobe in &file.shape.lobes {
        text += &format!(
            "  order {}       {:>10.2} µm {:>8.2} µm, largest at {:.0}° (from ball to tip)\n",
            lobe.order,
            um(libm::hypot(lobe.cosine, lobe.sine)),
            um(lobe.uncertainty),
            (libm::atan2(lobe.sine, lobe.cosine).to_degrees() / lobe.order as f64)
                .rem_euclid(360.0 / lobe.order as f64)
        );
    }
    for (k, name) in ["x", "y", "z"].iter().enumerate() {
        if let (Some(value), Some(uncertainty)) = (file.tip[k], found.tip_uncertainty[k]) {
            text += &format!(
                "  tip {name}         {value:>10.4} mm {:>8.2} µm\n",
                um(uncertainty)
            );
        }
    }
    text
}
