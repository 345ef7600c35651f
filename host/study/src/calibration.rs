//! A calibration: from balls that are probed to a compensation that is in use, on any machine that answers.
//!
//! What is planned: [`CalibrationPlan`]. What decides, step by step, whether the result may be used: [`Calibration::run`].
//! Nothing is loaded that is unclear; what has been loaded is probed again, and stays only if the machine is better, and as
//! good as was predicted.

mod plan;

pub use plan::{CalibrationPlan, CalibrationPlanError, usual_model};

use crate::validation::{Gain, Scatter, Validation};
use crate::{Study, StudyOutcome, StudyRefusal, StudyRequest};
use nalgebra::Vector3;
use std::fmt;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::{Model, Problem, scatters};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::uncertainty::{Benefit, OverTravel, benefit, over_travel};
use trueaxis_model::validate::DrawError;

/// What a calibration needs from outside: a machine that probes, a place for its compensation, and somebody who agrees.
/// LinuxCNC, a board beside another controller, or a simulated machine.
pub trait CalibratedMachine {
    /// Why it does not go on.
    type Error;

    /// Input is wrong.
    fn refused(&self, refusal: CalibrationRefusal) -> Self::Error;

    /// Probes the rows that validate as the machine is found, then those of the plan without corrections. False if
    /// somebody does not want it.
    ///
    /// # Errors
    /// It cannot probe.
    fn probe(&mut self) -> Result<bool, Self::Error>;

    /// What is known about balls, bars and stylus, with the tip as the probe was qualified.
    ///
    /// # Errors
    /// It cannot be read.
    fn artefact(&mut self) -> Result<Artefact, Self::Error>;

    /// What was probed.
    ///
    /// # Errors
    /// It cannot be read.
    fn probed(&mut self, rows: ProbedRows) -> Result<Probings, Self::Error>;

    /// Keeps what was identified.
    ///
    /// # Errors
    /// It cannot be written.
    fn identified(&mut self, found: &StudyOutcome<'_>) -> Result<(), Self::Error>;

    /// The errors as they were kept.
    ///
    /// # Errors
    /// They cannot be read.
    fn errors(&mut self) -> Result<ErrorModel, Self::Error>;

    /// Whether somebody agrees.
    ///
    /// # Errors
    /// Nobody can be asked.
    fn agrees(&mut self, question: Question<'_>) -> Result<bool, Self::Error>;

    /// Makes a compensation of the errors that were kept; false if a tolerance is not met.
    ///
    /// # Errors
    /// It cannot be made.
    fn compile(&mut self) -> Result<bool, Self::Error>;

    /// Puts that compensation in the place of the one in use, and switches it on.
    ///
    /// # Errors
    /// It cannot be loaded.
    fn load(&mut self) -> Result<(), Self::Error>;

    /// Probes the rows that validate again, with it.
    ///
    /// # Errors
    /// It cannot probe.
    fn probe_again(&mut self) -> Result<(), Self::Error>;

    /// Keeps the figures of the validation.
    ///
    /// # Errors
    /// They cannot be written.
    fn validated(&mut self, found: &Validated) -> Result<(), Self::Error>;

    /// What has been loaded and switched stays.
    ///
    /// # Errors
    /// It cannot be stored.
    fn keep(&mut self) -> Result<(), Self::Error>;

    /// Puts back what was in use before [`load`](Self::load).
    ///
    /// # Errors
    /// It cannot: what is in use is then not known.
    fn undo(&mut self) -> Result<(), Self::Error>;
}

/// Rows that a calibration probes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProbedRows {
    /// Those that tell its errors, without corrections.
    Plan,
    /// Those that validate, as the machine was found.
    Before,
    /// Those that validate, with the new compensation.
    After,
}

/// What somebody is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Question<'a> {
    /// Whether it may go on although these are not measured.
    Unmeasured(&'a [Parameter]),
    /// Whether the compensation may be loaded.
    Load,
    /// Whether it may be probed with it.
    Validate,
}

/// The steps, in order. Those before the first one were done earlier.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum CalibrationStep {
    /// Choose what to probe
    Plan,
    /// Probe; a log that was stopped early is continued
    Probe,
    /// Identify the error parameters
    Identify,
    /// Turn them into a compensation
    Compile,
    /// Load it, and validate it
    Load,
}

/// What is calibrated.
#[derive(Clone, Debug)]
pub struct Calibration<'a> {
    /// The nominal machine.
    pub machine: &'a Machine,
    /// The parameters to identify.
    pub model: Model,
    /// Accept balls and stylus where they are found, even if that is far from where they are stated.
    pub accept_places: bool,
}

/// Why a calibration cannot go on: input that is wrong.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationRefusal {
    /// The measurements are refused.
    #[error(transparent)]
    Study(#[from] StudyRefusal),
    /// The errors cannot be judged over the travel.
    #[error(transparent)]
    Errors(#[from] DrawError),
}

/// How a calibration ends.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationEnd {
    /// The new compensation is in use, and switched on.
    InUse,
    /// What was in use before still is.
    Unchanged(Unchanged),
}

/// Why what was in use before a calibration still is.
#[derive(Clone, Debug, PartialEq)]
pub enum Unchanged {
    /// Somebody did not want it probed.
    NotProbed,
    /// Rows do not fit together.
    Doubtful,
    /// The stylus is not where it is stated: found less stated (mm).
    OtherStylus(Vector3<f64>),
    /// Errors that the machine may have are not measured.
    Unmeasured(Vec<Parameter>),
    /// The compensation does not meet its tolerance.
    ToleranceNotMet,
    /// So little is known of the errors that the compensation might do harm where nothing was probed.
    MightHarm(Benefit),
    /// Somebody did not want it loaded.
    NotWanted,
    /// Somebody did not want it validated.
    NotValidated,
    /// The machine is not better than before, or not as good as predicted.
    NotBetter,
}

impl fmt::Display for Unchanged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotProbed => f.write_str("you did not want it probed"),
            Self::Doubtful => {
                f.write_str("the measurements do not fit together: see the warnings above")
            }
            Self::OtherStylus(by) => write!(
                f,
                "the stylus is {:.3} mm (x {:.3}, y {:.3}, z {:.3}) from where machine file and artefact have it: measure it, and correct tip_mm; if it is right as found, say --accept-places",
                by.norm(),
                by.x,
                by.y,
                by.z
            ),
            Self::Unmeasured(parameters) => write!(
                f,
                "{} are not measured: qualify the probe (--qualify or --probe), give the artefact a bar, leave out --model, or say --accept-missing; backlash of linear axes needs an indicator",
                Model::Named(parameters.clone())
            ),
            Self::ToleranceNotMet => f.write_str("the tolerance is not met: see above"),
            Self::MightHarm(_) => f.write_str(
                "the compensation might do more harm than good where nothing was probed: probe more rows, balls that are farther apart, or identify fewer parameters (--model)",
            ),
            Self::NotWanted => f.write_str("you did not want it"),
            Self::NotValidated | Self::NotBetter => f.write_str("the old compensation is back"),
        }
    }
}

/// A validation, and how much smaller the distances of the same rows have become (mm).
#[derive(Clone, Debug, PartialEq)]
pub struct Validated {
    /// The figures.
    pub validation: Validation,
    /// `None` if the rows before and after are not the same, or too few.
    pub gain: Option<Gain>,
}

impl Validated {
    /// Why the compensation is not kept, if it is not.
    #[must_use]
    pub fn objection(&self) -> Option<String> {
        let Validation {
            before,
            after,
            is_kept,
            ..
        } = &self.validation;
        if *is_kept {
            return None;
        }
        Some(match self.gain {
            _ if after.rms_um >= before.rms_um => {
                "the machine is not better than before".to_owned()
            }
            Some(gain) if !gain.is_sure() => format!(
                "the machine is not better with 95 % probability: by {:.2} µm in the mean of the same rows, and by {:.2} or less in one of twenty cases without any change",
                gain.mean * 1e3,
                (gain.mean - gain.least) * 1e3
            ),
            _ => "the machine is better, but not as good as predicted".to_owned(),
        })
    }
}

/// Part of the prediction by which what is measured may exceed it: the scatter of a root mean square of ten rows is a
/// quarter of it (2σ, 20 degrees of freedom).
const SCATTER: f64 = 1.3;
/// A stylus found farther (mm) than this from its stated place is another one, or bent: location errors that it takes up
/// are a few times 10 µm.
const OTHER_STYLUS: f64 = 0.25;
/// Seed of the positions over the travel, as in other commands.
const SEED: u64 = 1;

impl Calibration<'_> {
    /// From a step on, to the end. After anything but [`CalibrationEnd::InUse`], errors included, the machine corrects as
    /// it did before.
    ///
    /// # Errors
    /// Those of the machine, and [`CalibrationRefusal`].
    pub fn run<M: CalibratedMachine>(
        &self,
        from: CalibrationStep,
        machine: &mut M,
    ) -> Result<CalibrationEnd, M::Error> {
        Ok(match self.stopped(from, machine)? {
            Some(why) => CalibrationEnd::Unchanged(why),
            None => CalibrationEnd::InUse,
        })
    }

    fn stopped<M: CalibratedMachine>(
        &self,
        from: CalibrationStep,
        machine: &mut M,
    ) -> Result<Option<Unchanged>, M::Error> {
        if from <= CalibrationStep::Probe && !machine.probe()? {
            return Ok(Some(Unchanged::NotProbed));
        }
        let artefact = machine.artefact()?;
        let study = Study {
            machine: self.machine,
            probings: &machine.probed(ProbedRows::Plan)?,
            artefact: &artefact,
            observations: &Observations::default(),
            runs: &[],
            base: &ErrorModel::perfect(self.machine),
        };
        let request = StudyRequest {
            accept_places: self.accept_places,
            ..StudyRequest::of(self.model.clone())
        };
        let found = study.identify(&request);
        let found = found.map_err(|refusal| machine.refused(refusal.into()))?;
        if from <= CalibrationStep::Identify {
            machine.identified(&found)?;
            if found.is_doubtful() {
                return Ok(Some(Unchanged::Doubtful));
            }
        }
        let judge = Judge::new(self, machine.errors()?, &found);
        if let Some(why) = judge.other_stylus() {
            return Ok(Some(why));
        }
        let missing = judge.missing();
        if !missing.is_empty() && !machine.agrees(Question::Unmeasured(&missing))? {
            return Ok(Some(Unchanged::Unmeasured(missing)));
        }
        if from <= CalibrationStep::Compile && !machine.compile()? {
            return Ok(Some(Unchanged::ToleranceNotMet));
        }
        if let Some(why) = judge
            .harm()
            .map_err(|error| machine.refused(error.into()))?
        {
            return Ok(Some(why));
        }
        if !machine.agrees(Question::Load)? {
            return Ok(Some(Unchanged::NotWanted));
        }
        let tried = Self::on_trial(machine, &judge);
        if !matches!(tried, Ok(None)) {
            machine.undo()?;
        }
        tried
    }

    /// Loads the compensation, and keeps it if the machine is then as good as was predicted.
    fn on_trial<M: CalibratedMachine>(
        machine: &mut M,
        judge: &Judge<'_>,
    ) -> Result<Option<Unchanged>, M::Error> {
        machine.load()?;
        if !machine.agrees(Question::Validate)? {
            return Ok(Some(Unchanged::NotValidated));
        }
        machine.probe_again()?;
        let before = machine.probed(ProbedRows::Before)?;
        let after = machine.probed(ProbedRows::After)?;
        let validated = judge.validated(&before, &after);
        let validated = validated.map_err(|error| machine.refused(error.into()))?;
        machine.validated(&validated)?;
        if !validated.validation.is_kept {
            return Ok(Some(Unchanged::NotBetter));
        }
        machine.keep()?;
        Ok(None)
    }
}

/// Judges what was identified.
struct Judge<'a> {
    calibration: &'a Calibration<'a>,
    errors: ErrorModel,
    /// As uncertain as motions that the model lacks may make them over the travel; `None` if there are too few rows to tell.
    uncertain: Option<ErrorModel>,
    found: &'a StudyOutcome<'a>,
}

impl<'a> Judge<'a> {
    fn new(
        calibration: &'a Calibration<'a>,
        errors: ErrorModel,
        found: &'a StudyOutcome<'a>,
    ) -> Self {
        let machine = calibration.machine;
        let (probings, artefact) = (&found.probings, found.artefact);
        let looked_for = &found.identified.looked_for;
        let perfect = ErrorModel::perfect(machine);
        let problem = Problem::new(machine, probings, artefact, looked_for, &perfect);
        let problem = problem.with(&found.observations);
        let unmodelled = problem.unmodelled(&found.identified);
        Self {
            calibration,
            uncertain: unmodelled.map(|motions| motions.added_to(&errors)),
            errors,
            found,
        }
    }

    fn other_stylus(&self) -> Option<Unchanged> {
        let stylus = self.found.places.iter().find(|one| one.what == "stylus")?;
        let off = stylus.found - stylus.stated?;
        (off.norm() > OTHER_STYLUS && !self.calibration.accept_places)
            .then_some(Unchanged::OtherStylus(off))
    }

    /// Errors that the machine may have and that were not measured.
    fn missing(&self) -> Vec<Parameter> {
        let unseen = self.errors.unseen.keys();
        let others = self.found.missing.iter();
        let others = others.filter(|one| !self.errors.unseen.contains_key(one));
        unseen.chain(others).copied().collect()
    }

    /// That a compensation might do harm over the travel.
    fn harm(&self) -> Result<Option<Unchanged>, DrawError> {
        let machine = self.calibration.machine;
        let known = self.uncertain.as_ref();
        let benefit = benefit(
            &Kinematics::new(machine, known.unwrap_or(&self.errors)),
            SEED,
        )?;
        let is_good = known.is_some() && benefit.is_sure();
        Ok((!is_good).then_some(Unchanged::MightHarm(benefit)))
    }

    /// What is not known of errors (95 %), if anything is not.
    fn coverage(&self, errors: &ErrorModel) -> Result<Option<OverTravel>, DrawError> {
        over_travel(&Kinematics::new(self.calibration.machine, errors), SEED)
    }

    /// What is not known of the errors (µm at the tip, 95 %): the mean over the travel, and where the parameters were fitted.
    /// What the model lacks is there as large as its residuals.
    fn coverages(&self) -> Result<[f64; 2], DrawError> {
        let errors = self.uncertain.as_ref().unwrap_or(&self.errors);
        let travel = self.coverage(errors)?.map(|found| found.travel);
        let mut fitted = errors.clone();
        fitted.misfit = self.errors.misfit;
        let zone = self.coverage(&fitted)?;
        let zone = zone.map(|found| found.zone.unwrap_or(found.travel));
        Ok([travel, zone].map(|of| of.map_or(0.0, |of| of.translation_um.mean)))
    }

    /// Compares the same rows without and with the compensation.
    fn validated(&self, before: &Probings, after: &Probings) -> Result<Validated, DrawError> {
        let (machine, artefact) = (self.calibration.machine, self.found.artefact);
        let perfect = ErrorModel::perfect(machine);
        let stylus = &self.found.identified.stylus;
        let distances = |rows: &Probings| scatters(machine, rows, artefact, &perfect, stylus);
        let balls: Vec<usize> = before.rows.iter().map(|row| row.ball).collect();
        let (before, after) = (distances(before), distances(after));
        let gain = Gain::of(&balls, &before, &after);
        let probing_um = self.found.identified.noise * 1e3 * 3.0_f64.sqrt();
        let [coverage_um, in_zone] = self.coverages()?;
        let expected_um = SCATTER * libm::hypot(probing_um, in_zone);
        let probings = before.len();
        let (before, after) = (Scatter::of(&before), Scatter::of(&after));
        let is_better = after.rms_um < before.rms_um && gain.is_some_and(Gain::is_sure);
        let validation = Validation {
            probings,
            before,
            after,
            probing_um,
            coverage_um,
            expected_um,
            unseen: self.missing().iter().map(Parameter::to_string).collect(),
            is_kept: is_better && after.rms_um <= expected_um,
        };
        Ok(Validated { validation, gain })
    }
}
