//! Probes a plan in a LinuxCNC that is running, touch by touch.

use super::bad_input::BadInput;
use super::files;
use super::number::positive;
use super::output;
use super::plan::{collides, not_reached};
use super::progress::ProgressBarOnScreen;
use super::touch_options::TouchOptions;
use clap::Args;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_linuxcnc::{AxisPositions, LinuxCncSession, SessionError};
use trueaxis_model::machine::{Machine, PerAxis};
use trueaxis_probing::plan::{AxisTargets, ProbingStep, Setup, collision, steps};
use trueaxis_probing::probe::{
    Contact, ProbeError, Prober, Speeds, TouchRecord, duration, header, probe, resume,
};
use trueaxis_tables::compile::Progress;

/// Feed rates and what is logged beside the positions.
#[derive(Args)]
pub struct SpeedOptions {
    /// Feed rate of the touches that count
    #[arg(long, value_name = "MM/MIN", default_value_t = 30.0, value_parser = positive)]
    feed: f64,
    /// Feed rate of the touches before them, which look for the surface
    #[arg(long, value_name = "MM/MIN", default_value_t = 200.0, value_parser = positive)]
    first: f64,
    /// Distance from the surface at which the second touch begins
    #[arg(long, value_name = "MM", default_value_t = 0.3, value_parser = positive)]
    retreat: f64,
    /// Feed rate near the balls
    #[arg(long, value_name = "MM/MIN", default_value_t = 1000.0, value_parser = positive)]
    approach: f64,
    /// A HAL pin with the temperature of the machine (°C), for the log
    #[arg(long, value_name = "PIN")]
    temperature: Option<String>,
}

/// The question before the first move.
pub const CLEAR: &str = "Is the stylus clear of everything, and may the machine move?";

/// Connects to LinuxCNC, homed; `None` if the operator does not want it homed.
pub fn started(may_home: bool, yes: bool) -> Result<Option<LinuxCncSession>, BadInput> {
    let (mut session, state) = LinuxCncSession::start().map_err(bad)?;
    #[cfg(unix)]
    stop_on_signals(&session)?;
    if !state.is_on {
        return Err(BadInput::new(
            "LinuxCNC: the machine is off",
            "leave the emergency stop and switch it on",
        ));
    }
    if !state.homed {
        if !may_home {
            return Err(BadInput::new(
                "LinuxCNC: the joints are not homed",
                "home them, or give --home",
            ));
        }
        if !yes && !asked("Is the way clear, and may all joints be homed?")? {
            return Ok(None);
        }
        session.home(HOMING).map_err(bad)?;
    }
    Ok(Some(session))
}

/// From now on Ctrl-C, SIGTERM and the end of the terminal stop the machine, also if they were ignored when this program
/// began, as in scripts; the program ends when the machine stands and everything is as it was.
#[cfg(unix)]
fn stop_on_signals(session: &LinuxCncSession) -> Result<(), BadInput> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let signals = signal_hook::iterator::Signals::new([SIGHUP, SIGINT, SIGTERM]);
    let mut signals = signals.map_err(|error| {
        BadInput::new(
            format!("signals cannot be handled: {error}"),
            "start it from a shell",
        )
    })?;
    let stopper = session.stopper();
    std::thread::spawn(move || {
        let mut signals = signals.forever();
        let Some(signal) = signals.next() else {
            return;
        };
        let end = move || std::process::exit(128 + signal);
        std::thread::spawn(move || {
            stopper.stop();
            say("stopped: the machine stands; the log has the touches");
            end()
        });
        say("\nstopping: the machine stops; kinematics, compensation and enable are restored");
        // Once more: the end of this program stops the machine, too.
        if signals.next().is_some() {
            end();
        }
    });
    Ok(())
}

/// Says something on a terminal that may be gone.
#[cfg(unix)]
fn say(text: &str) {
    use std::io::Write;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Takes the machine over, with kinematics in which each joint is an axis; false if the operator does not want them
/// switched.
pub fn take_over(session: &mut LinuxCncSession, yes: bool) -> Result<bool, BadInput> {
    session.begin().map_err(bad)?;
    if let Some(line) = session.joints_by().map_err(bad)? {
        let question =
            format!("May the kinematics be switched to identity ({line}) until the end?");
        if !yes && !asked(&question)? {
            return Ok(false);
        }
    }
    if let Some(line) = session.joints().map_err(bad)? {
        output::print(&format!("kinematics: identity ({line}) until the end\n"))?;
    }
    Ok(true)
}

/// Longest time for homing (s).
const HOMING: f64 = 300.0;

/// Asks on the terminal; whoever cannot answer has not agreed.
pub fn asked(question: &str) -> Result<bool, BadInput> {
    output::print(&format!("{question} [y/N] "))?;
    let mut answer = String::new();
    let read = std::io::stdin().read_line(&mut answer);
    Ok(read.is_ok() && matches!(answer.trim(), "y" | "Y" | "yes"))
}

/// An error of LinuxCNC.
pub fn bad(error: SessionError) -> BadInput {
    BadInput::new(format!("LinuxCNC: {}", error.error), error.remedy)
}

/// A plan on its way into a log.
pub struct Work<'a> {
    machine: &'a Machine,
    plan: Probings,
    /// Rows that are not in the log yet.
    rest: Probings,
    steps: Vec<ProbingStep>,
    speeds: &'a SpeedOptions,
    log: &'a Path,
}

impl<'a> Work<'a> {
    /// What is left of a plan; cuts a log that was stopped early after its last whole row.
    pub fn new(
        machine: &'a Machine,
        artefact: &Artefact,
        plan: Probings,
        touching: &TouchOptions,
        speeds: &'a SpeedOptions,
        log: &'a Path,
    ) -> Result<Self, BadInput> {
        let head = header(machine, speeds.temperature.is_some());
        let probe = touching.stated()?;
        let rest = match log.exists() {
            true => rest_of(log, &head, &plan, probe.per_ball())?,
            false => plan.clone(),
        };
        let setup = Setup {
            machine,
            artefact,
            balls: plan.balls.clone(),
            probe,
            sigma: 1e-3,
            observations: None,
        };
        let steps = steps(&setup, &rest).map_err(|why| not_reached(*why, &plan))?;
        if let Some(collision) = collision(&setup, &rest, &steps) {
            return Err(collides(&collision));
        }
        if !log.exists() {
            output::write(log, head.as_bytes())?;
        }
        Ok(Self {
            machine,
            plan,
            rest,
            steps,
            speeds,
            log,
        })
    }

    /// What will be done.
    pub fn announced(&self) -> String {
        let done = self.plan.rows.len() - self.rest.rows.len();
        let before = match done {
            0 => String::new(),
            rows => format!(", {rows} rows are in the log already"),
        };
        format!(
            "{} touches of {} rows{before}\n",
            self.touches(),
            self.rest.rows.len()
        )
    }

    fn touches(&self) -> usize {
        let touches = |step: &&ProbingStep| matches!(step, ProbingStep::Touch { .. });
        self.steps.iter().filter(touches).count()
    }

    /// About how long it takes (s), where a rapid move takes this long.
    pub fn seconds(&self, rapid: f64) -> f64 {
        duration(&self.steps, self.speeds(), rapid)
    }

    fn speeds(&self) -> Speeds {
        Speeds {
            near: self.speeds.approach,
            first: self.speeds.first,
            second: self.speeds.feed,
            retreat: self.speeds.retreat,
        }
    }

    /// What can be wrong if a ball is not where it is expected in a row.
    fn outliers(&self, line: Option<usize>) -> String {
        let rows = self.plan.rows.iter();
        let row = rows.clone().find(|row| Some(row.line) == line);
        let axes = self.machine.axes.iter().enumerate();
        let turned = axes.filter(|(i, axis)| {
            axis.letter.is_rotary() && row.is_none_or(|row| row.position[*i] != 0.0)
        });
        let turned: Vec<String> = turned.map(|(_, axis)| axis.letter.to_string()).collect();
        let way = match &turned[..] {
            [] => String::new(),
            [one] => format!(", whether {one} counts the other way in the machine file"),
            several => format!(
                ", whether one of {} counts the other way in the machine file",
                several.join(" ")
            ),
        };
        format!(
            "check the length of the stylus (tip_mm), where the ball is (nominal_mm){way}, and the probe's input; then start again"
        )
    }

    /// Probes, with a session that has begun; returns the number of touches.
    pub fn probe(&self, session: &mut LinuxCncSession) -> Result<usize, BadInput> {
        let log = OpenOptions::new().append(true).open(self.log);
        let mut log: File = log.map_err(|error| {
            BadInput::new(
                format!("{}: cannot be written: {error}", self.log.display()),
                "make the file writable",
            )
        })?;
        let bar = ProgressBarOnScreen::new();
        bar.stage("touches", self.touches());
        let mut prober = Driven {
            machine: self.machine,
            session,
            temperature: self.speeds.temperature.as_deref(),
        };
        let mut touches = 0;
        let mut take = |record: &TouchRecord<'_>| {
            touches += 1;
            bar.step();
            log.write_all(record.line(self.machine, &self.rest).as_bytes())?;
            log.sync_data()
        };
        let done = probe(
            &self.rest,
            &self.steps,
            self.speeds(),
            &mut prober,
            &mut take,
        );
        drop(bar);
        match done {
            Ok(()) => Ok(touches),
            Err(error) => Err(self.stopped(error, touches)),
        }
    }

    /// Why probing has stopped after this many touches.
    fn stopped(&self, error: ProbeError<SessionError>, touches: usize) -> BadInput {
        let so_far = format!("{touches} touches are in {}", self.log.display());
        match error {
            ProbeError::Machine(error) => {
                let remedy = match error.error.contains(TRIPPED) {
                    true => self.outliers(None),
                    false => error.remedy,
                };
                BadInput::new(format!("LinuxCNC: {}; {so_far}", error.error), remedy)
            }
            ProbeError::NoContact { line, .. } => {
                BadInput::new(format!("{error}; {so_far}"), self.outliers(Some(line)))
            }
            ProbeError::Log(_) => {
                BadInput::new(format!("{error}; {so_far}"), "make room, then start again")
            }
        }
    }
}

/// What LinuxCNC says if the stylus meets something on its way.
const TRIPPED: &str = "Probe tripped";

/// LinuxCNC as a machine with a probe.
struct Driven<'a> {
    machine: &'a Machine,
    session: &'a mut LinuxCncSession,
    temperature: Option<&'a str>,
}

impl Driven<'_> {
    fn positions(&self, target: &AxisTargets) -> AxisPositions {
        let letter = |i: usize| self.machine.axes[i].letter.char();
        target.iter().map(|(i, at)| (letter(*i), *at)).collect()
    }
}

impl Prober for Driven<'_> {
    type Error = SessionError;

    fn rapid(&mut self, to: &AxisTargets) -> Result<(), SessionError> {
        let to = self.positions(to);
        self.session.move_to(&to, None)
    }

    fn near(&mut self, to: &AxisTargets, feed: f64) -> Result<(), SessionError> {
        let to = self.positions(to);
        self.session.move_to(&to, Some(feed))
    }

    fn retreat(&mut self, to: &AxisTargets, feed: f64) -> Result<(), SessionError> {
        let to = self.positions(to);
        self.session.retreat(&to, feed)
    }

    fn touch(&mut self, end: &AxisTargets, feed: f64) -> Result<Option<Contact>, SessionError> {
        let end = self.positions(end);
        let contact = self.session.touch(&end, feed)?;
        if !contact.tripped {
            return Ok(None);
        }
        let mut position = PerAxis::default();
        for (at, axis) in position.iter_mut().zip(&self.machine.axes) {
            let letter = axis.letter.char();
            *at = *contact.position.get(&letter).ok_or_else(|| SessionError {
                error: format!("LinuxCNC has no axis {letter}"),
                remedy: "give the machine file of this machine".to_owned(),
            })?;
        }
        let temperature = match self.temperature {
            Some(pin) => {
                let value = self.session.pins(&[pin])?[0];
                Some(value.ok_or_else(|| SessionError {
                    error: format!("{pin}: there is no such pin, or it has no number"),
                    remedy: "give --temperature a pin that `halcmd show pin` lists".to_owned(),
                })?)
            }
            None => None,
        };
        Ok(Some(Contact {
            position,
            time: contact.time,
            temperature,
        }))
    }

    fn orient(&mut self, angle: f64) -> Result<(), SessionError> {
        self.session.run(&format!("M19 R{angle} Q30"))
    }
}

/// What a log has not of a plan; cuts it after its last whole row.
fn rest_of(log: &Path, head: &str, plan: &Probings, per_ball: usize) -> Result<Probings, BadInput> {
    let text = files::Text::read(log)?.text;
    let (kept, rest) = resume(&text, head, plan, per_ball).ok_or_else(|| {
        BadInput::new(
            format!("{} exists, and is no log of this plan", log.display()),
            "give -o another name",
        )
    })?;
    if kept != text {
        output::write(log, kept.as_bytes())?;
    }
    Ok(rest)
}
