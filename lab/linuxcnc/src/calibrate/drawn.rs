//! Machines that nobody drew, calibrated, or with a fault that must be reported.

use super::operated::{NO_FILE, OF_BAND, PROBING, left, number, operate, until};
use crate::bench::LinuxCncBench;
use programs::{files, process, trueaxis};
use std::time::Instant;

/// Drift of the balls (µm/h). The tests probe about ten times as fast as a machine: it is 5 µm/h of one.
const DRIFT: f64 = 50.0;
/// The machine on which the probe is qualified first.
const QUALIFIED: u64 = 3;

/// Machines that are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DrawnKind {
    /// Their errors are in the model.
    Plain,
    /// Straightness, backlash and run-out are not.
    Outside,
    /// Their balls drift.
    Drifting,
}

/// What is wrong with a machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MachineFault {
    None,
    /// A ball is pushed aside while it is being probed.
    Ball,
    /// The stylus is 3 mm longer than the machine file says.
    Stylus,
    /// A rotary axis counts the other way in the machine file.
    Sign,
}

impl MachineFault {
    /// What must be said of it.
    fn words(self) -> &'static str {
        match self {
            Self::None => "",
            Self::Ball => "ball one has moved",
            Self::Stylus => "check the length of the stylus",
            Self::Sign => "counts the other way in the machine file",
        }
    }
}

/// A random machine, and what is wrong with it.
#[derive(Clone, Copy)]
pub struct DrawnMachine {
    pub seed: u64,
    pub fault: MachineFault,
    pub kind: DrawnKind,
}

impl DrawnMachine {
    /// Calibrates it, or checks that its fault is reported and nothing is loaded. Returns a line of the table.
    ///
    /// # Errors
    /// The violated condition.
    pub fn calibrate(self, bench: &LinuxCncBench) -> Result<String, String> {
        let bench = bench.apart(&format!("machine-{}", self.seed))?;
        let about = self.draw(&bench)?;
        let lines = [
            self.command(&bench)?,
            format!("{NO_FILE} && test ! -e machine.trax"),
        ];
        let began = Instant::now();
        let (printed, codes) = operate(&bench, "m", "machine.ini", &lines)?;
        let (seed, seconds) = (self.seed, began.elapsed().as_secs());
        let about = format!("{seed:>3}  {about:<60} {seconds:>4} s  ");
        let found = match self.fault {
            MachineFault::None => self.remains(&bench, &printed, &codes),
            fault => fault.told(&printed, &codes),
        };
        // The reason comes last: a summary of many steps shows the last lines.
        match found {
            Ok(found) => Ok(about + &found),
            Err(why) => Err(format!("{printed}\n{about}{why}")),
        }
    }

    /// Writes its files; returns what it is.
    fn draw(self, bench: &LinuxCncBench) -> Result<String, String> {
        let outside = (self.kind == DrawnKind::Outside).then_some("outside");
        let about = process::output(
            trueaxis::example("calibration-machine")
                .arg(self.seed.to_string())
                .arg(bench.file("m"))
                .args(outside),
        )?;
        bench.model("m/machine.toml", "m/errors.toml", "m/machine.model")?;
        Ok(about.trim().to_owned())
    }

    /// The line that brings the fault about and calibrates.
    fn command(self, bench: &LinuxCncBench) -> Result<String, String> {
        let machine = files::read_text(&bench.file("m/machine.toml"))?;
        let drift = match self.kind {
            DrawnKind::Drifting => DRIFT,
            DrawnKind::Plain | DrawnKind::Outside => 0.0,
        };
        let fault = match self.fault {
            MachineFault::None => String::new(),
            MachineFault::Ball => format!(
                "({}; halcmd setp trueaxis-model.moved 0.1) & ",
                until("touches.csv", 60)
            ),
            MachineFault::Stylus => format!(
                "halcmd setp trueaxis-model.tool-length {}; ",
                tool_length(&machine)? + 3.0
            ),
            MachineFault::Sign => {
                bench.write("m/machine.toml", other_sign(&machine))?;
                String::new()
            }
        };
        let qualify = if self.seed == QUALIFIED {
            " --qualify one"
        } else {
            ""
        };
        let trueaxis = bench.program()?;
        Ok(format!(
            "halcmd setp trueaxis-model.drift {drift}; {fault}{trueaxis} linuxcnc calibrate machine.toml \
             --artefact artefact.toml {PROBING} --folder run{qualify}"
        ))
    }

    /// What the calibration of a healthy machine leaves.
    fn remains(
        self,
        bench: &LinuxCncBench,
        printed: &str,
        codes: &[i32],
    ) -> Result<String, String> {
        if self.seed == QUALIFIED {
            qualified(bench)?;
        }
        let is_unsure = printed.contains("nothing is loaded: the compensation might do more harm");
        if is_unsure && codes == [1, 0] {
            let [untreated, treated] = left(bench, "m")?;
            return Ok(format!(
                "tip {untreated:>6.2}, would be {treated:.2} µm: too little is known, nothing is loaded"
            ));
        }
        let validation = files::read_text(&bench.file("m/run/validation.json"))?;
        let band = number(&validation, "coverage_um")?;
        let [untreated, treated] = left(bench, "m")?;
        let before = number(&validation, "before\": {\n    \"rms_um")?;
        let after = number(&validation, "after\": {\n    \"rms_um")?;
        let is_loaded = codes == [0, 1];
        let is_kept = codes == [1, 0];
        let line = format!(
            "tip {untreated:>6.2} → {treated:>5.2} µm, band {band:>5.2}; measured {before:>6.2} → {after:>5.2}; {}",
            if codes[0] == 0 {
                "in use"
            } else {
                "old one kept"
            }
        );
        // Whatever is in use is no worse than before.
        let is_worse = is_loaded && treated > untreated;
        match treated > OF_BAND * band || !(is_loaded || is_kept) || is_worse {
            true => Err(line),
            false => Ok(line),
        }
    }
}

impl MachineFault {
    /// How the fault was reported, without anything being loaded.
    fn told(self, printed: &str, codes: &[i32]) -> Result<String, String> {
        let is_named = |line: &&str| line.starts_with("error:") || line.starts_with("warning:");
        let named = printed.lines().find(is_named).unwrap_or("");
        match codes {
            [1 | 2, 0] if printed.contains(self.words()) => Ok(format!("{self:?}: {named}")),
            _ => Err(format!(
                "{self:?} was not told, or something was loaded: {codes:?}"
            )),
        }
    }
}

/// The radius of the stylus: half of 6 mm less a pre-travel of 5 µm; scales and lobes that do not turn with the stylus
/// are 2 µm.
fn qualified(bench: &LinuxCncBench) -> Result<(), String> {
    let probe = files::read_text(&bench.file("m/run/probe.toml"))?;
    let radius = probe
        .split_once("tip_radius_mm = ")
        .and_then(|(_, rest)| rest.lines().next()?.parse::<f64>().ok());
    match radius.is_some_and(|radius| (radius - 2.995).abs() <= 3e-3) {
        true => Ok(()),
        false => Err(probe),
    }
}

/// The length of the tool in a machine file (mm).
fn tool_length(machine: &str) -> Result<f64, String> {
    let (_, tip) = machine
        .rsplit_once("tip_mm = [")
        .ok_or("no tip_mm in the machine file")?;
    let numbers = tip.split(']').next().unwrap_or("").split(',');
    let numbers: Result<Vec<f64>, _> = numbers.map(|n| n.trim().parse::<f64>()).collect();
    let numbers = numbers.map_err(|e| e.to_string())?;
    Ok(numbers.iter().map(|n| n * n).sum::<f64>().sqrt())
}

/// A machine file whose axis C counts the other way.
fn other_sign(machine: &str) -> String {
    machine.replace("name = \"C\"\n", "name = \"C\"\nreversed = true\n")
}
