//! `trueaxis probings`

use super::Outcome;
use super::bad_input::BadInput;
use super::files::{self, Text};
use super::number::positive;
use super::output;
use clap::Args;
use std::path::{Path, PathBuf};
use trueaxis_identify::formats::probings::{self, Probing};
use trueaxis_identify::simulate::{SimulateError, applied, corrections};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_probing::spheres::{LogContents, read_log, to_probings};
use trueaxis_tables::compile::belongs;

/// Turn the log of a probing program into probings
///
/// Fits a sphere to the five touches of each row of a plan, and writes the axis positions at which the stylus
/// centre is at the ball centre: the input of `trueaxis identify`. With `--apply`, reads probings that were recorded
/// without compensation and writes what they would have been with it.
#[derive(Args)]
#[command(
    after_help = "Examples:\n  trueaxis probings machine.toml touches.log --plan plan.csv -o probings.csv\n  \
trueaxis probings machine.toml before.csv --apply machine.trax -o after.csv\n\n\
The log comes from the program that `trueaxis plan` writes for LinuxCNC: a line of nine numbers for each touch,\n\
X Y Z A B C U V W. Logs of other controllers have a header and commas; machine positions, mm and degrees, five\n\
touches for each row of the plan:\n  X,Y,Z,A,C\n  17.784,-58.539,141.522,15,60"
)]
pub struct Arguments {
    /// Machine description (machine.toml)
    machine: PathBuf,
    /// Log of the touches; with --apply, probings (CSV)
    log: PathBuf,
    /// The plan from which the program was written (CSV)
    #[arg(long, value_name = "FILE.csv", required_unless_present = "apply")]
    plan: Option<PathBuf>,
    /// Convert recorded probings to what they would have been with this compensation on
    #[arg(long, value_name = "FILE.trax", conflicts_with_all = ["plan", "ball_diameter", "stylus_diameter", "errors"])]
    apply: Option<PathBuf>,
    /// Diameter of the balls, to use it instead of fitting it
    #[arg(long, value_name = "MM", value_parser = positive)]
    ball_diameter: Option<f64>,
    /// Qualified diameter of the stylus tip
    #[arg(long, value_name = "MM", requires = "ball_diameter", value_parser = positive)]
    stylus_diameter: Option<f64>,
    /// The probe, qualified: lobing is taken out of the touches, and with --ball-diameter its radius is used (probe.toml)
    #[arg(long, value_name = "PROBE.toml", conflicts_with = "apply")]
    probe: Option<PathBuf>,
    /// Known errors of the machine, from a first identification; errors of scale and squareness distort the fit of
    /// balls that were not touched evenly
    #[arg(long, value_name = "ERRORS.toml")]
    errors: Option<PathBuf>,
    /// Where to write the probings (CSV; default: standard output)
    #[arg(short, long, value_name = "PROBINGS.csv")]
    output: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, BadInput> {
    let mut inputs: Vec<&Path> = vec![&arguments.machine, &arguments.log];
    let others = [
        &arguments.plan,
        &arguments.apply,
        &arguments.errors,
        &arguments.probe,
    ];
    inputs.extend(others.into_iter().filter_map(|path| path.as_deref()));
    if let Some(output) = &arguments.output {
        output::prepare(output, &inputs)?;
    }
    let machine = files::read_machine(&arguments.machine)?;
    let (csv, said) = match (&arguments.apply, &arguments.plan) {
        (Some(blob), _) => arguments.applied(&machine, blob)?,
        (None, Some(plan)) => arguments.fitted(&machine, plan)?,
        (None, None) => {
            return Err(BadInput::new(
                "neither --plan nor --apply is given",
                "give --plan with a log, or --apply with probings",
            ));
        }
    };
    match &arguments.output {
        None => {
            output::print(&csv)?;
            eprint!("{said}");
        }
        Some(path) => {
            output::write(path, csv.as_bytes())?;
            output::print(&format!("{}: {said}", path.display()))?;
        }
    }
    Ok(Outcome::Done)
}

impl Arguments {
    /// Probings from touches, as CSV, and a summary.
    fn fitted(&self, machine: &Machine, plan: &Path) -> Result<(String, String), BadInput> {
        let errors = match &self.errors {
            Some(path) => files::read_errors(path, machine)?,
            None => ErrorModel::perfect(machine),
        };
        let plan = files::read_plan(plan, machine)?;
        let text = Text::read(&self.log)?;
        let log = read_log(&text.text, machine).map_err(|e| text.bad(e))?;
        let probe = self.probe.as_deref();
        let probe = probe
            .map(|path| files::read_probe(path, machine))
            .transpose()?;
        let qualified = probe.as_ref().map(|probe| 2.0 * probe.radius);
        let stylus = self.stylus_diameter.or(qualified);
        if self.ball_diameter.is_some() && stylus.is_none() {
            return Err(BadInput::new(
                "--ball-diameter without the diameter of the stylus tip",
                "give --stylus-diameter, or --probe with a qualified probe",
            ));
        }
        let diameters = self.ball_diameter.zip(stylus);
        let lobing = probe.map(|probe| probe.shape).unwrap_or_default();
        let radius = diameters.map(|(ball, stylus)| (ball + stylus) / 2.0);
        let found = to_probings(machine, &plan, &log, radius, &lobing, &errors);
        let found = found.map_err(|e| text.bad(e))?;
        let csv = probings::write(&found.probings, machine);
        Ok((csv, said(&found, radius.is_some())))
    }

    /// Probings with a compensation on, as CSV, and a summary.
    fn applied(&self, machine: &Machine, path: &Path) -> Result<(String, String), BadInput> {
        let text = Text::read(&self.log)?;
        let recorded = probings::read(&text.text, machine, true).map_err(|e| text.bad(e))?;
        let blob = files::read_blob(path)?;
        let runtime = Runtime::load(&blob).map_err(|e| BadInput::in_blob(e, path))?;
        let perfect = ErrorModel::perfect(machine);
        belongs(machine, &perfect, &runtime).map_err(|e| BadInput::mismatch(&e, path))?;
        let dq = |rows: &[Probing]| Ok(corrections(machine, &runtime, rows));
        let after = applied(machine, &recorded, dq).map_err(|error: SimulateError| {
            BadInput::new(
                format!("{}: {error}", self.log.display()),
                "leave out the row, or correct the range of the axis in the machine file",
            )
        })?;
        let said = format!(
            "{} probings as they would have been with {} on\n",
            after.rows.len(),
            path.display()
        );
        Ok((probings::write(&after, machine), said))
    }
}

/// The summary of a log.
pub fn said(found: &LogContents, is_known: bool) -> String {
    let LogContents {
        probings,
        touches: log,
        missing,
        fitted,
    } = found;
    let mut text = format!(
        "{} probings of {} balls from {} touches\n",
        probings.rows.len(),
        probings.balls.len(),
        log.len()
    );
    if !missing.is_empty() {
        text += &format!(
            "left out, for touches are missing: {}; probe these rows, and append the log\n",
            missing.join(", ")
        );
    }
    if !is_known {
        for (ball, radius) in probings.balls.iter().zip(&fitted.radii) {
            text += &format!("ball {ball}: {radius:.4} mm from its centre to the stylus centre\n");
        }
    }
    text += &format!(
        "noise of a touch {:.2} µm, from the median residual\n",
        fitted.noise * 1e3
    );
    let doubtful = fitted.doubtful.iter();
    text.extend(doubtful.map(|(probing, touches)| doubt(found, *probing, touches)));
    text
}

/// Touches of a probing that do not belong to one ball.
fn doubt(found: &LogContents, probing: usize, touches: &[usize]) -> String {
    let row = &found.probings.rows[probing];
    let left = &found.fitted.left[probing];
    let lines: Vec<String> = touches
        .iter()
        .map(|touch| found.touches[probing * left.len() + touch].line.to_string())
        .collect();
    let off = touches.first().map_or(0.0, |touch| left[*touch]);
    format!(
        "touches of ball {} disagree (line {} of the plan): line {} of the log by {:.1} µm\n",
        found.probings.balls[row.ball],
        row.line,
        lines.join(" or "),
        off.abs() * 1e3
    )
}
