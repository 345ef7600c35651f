//! A simulated machine to calibrate: its errors are known here, and nowhere in the calibration.

use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::simulate::{
    Disturbances, SimulateError, compensated, corrections, probings,
};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::Runtime;
use trueaxis_probing::plan::{Criterion, PlannedRows, Probe, Setup, Task};
use trueaxis_study::StudyOutcome;
use trueaxis_study::calibration::{
    CalibratedMachine, Calibration, CalibrationEnd, CalibrationPlan, CalibrationRefusal,
    CalibrationStep, ProbedRows, Question, Validated, usual_model,
};
use trueaxis_study::validation::Validation;
use trueaxis_tables::compile::{self, Built, CompileError, Options};
use trueaxis_tables::target::Target;

/// The plan of the usual calibration of a machine of which nothing is known: so many rows to calibrate it, chosen among
/// all or some positions of its rotary axes, and to validate that.
///
/// # Panics
/// If there is none.
#[must_use]
pub fn calibration_plan(
    machine: &Machine,
    artefact: &Artefact,
    indexings: Option<&str>,
    [probings, validation]: [usize; 2],
) -> CalibrationPlan {
    let setup = Setup {
        machine,
        artefact,
        balls: artefact.balls.iter().map(|b| b.name.clone()).collect(),
        probe: Probe {
            keeps_clear: true,
            ..Probe::default()
        },
        sigma: 1e-3,
        observations: None,
    };
    let task = Task {
        setup: &setup,
        model: &usual_model(machine, artefact).expect("a model"),
        degree: 1,
        assumed: &ErrorModel::perfect(machine),
        rows: PlannedRows::Best {
            indexings,
            probings: Some(probings),
            criterion: Criterion::default(),
        },
    };
    CalibrationPlan::of(&task, validation, None).expect("a plan")
}

/// What goes wrong while a simulated machine is calibrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mishap {
    /// Nothing.
    None,
    /// The first ball moves by 0.1 mm along each axis while the plan is probed.
    Ball,
    /// The real stylus is longer (mm).
    Stylus(f64),
    /// The corrections that take effect are multiplied by this.
    Corrections(f64),
    /// The machine stops while it is probed again.
    Stops,
    /// This question is answered by no: 0 unmeasured, 1 load, 2 validate.
    Declined(usize),
}

/// Why a simulated machine does not go on.
#[derive(Debug)]
pub enum Failure {
    /// The calibration is refused.
    Refused(CalibrationRefusal),
    /// The machine has stopped.
    Stopped,
    /// A ball cannot be reached.
    NotReached(SimulateError),
    /// There are no tables.
    NoTables(CompileError),
}

/// A machine with errors, its measurements, and what corrects it.
#[derive(Debug)]
pub struct SimulatedMachine<'a> {
    machine: &'a Machine,
    plan: &'a CalibrationPlan,
    /// What its owner says of the balls, and where they are.
    stated: &'a Artefact,
    artefact: &'a Artefact,
    errors: &'a ErrorModel,
    noise: f64,
    mishap: Mishap,
    measured: [Option<Probings>; 3],
    found: Option<ErrorModel>,
    made: Option<Built>,
    /// Whether the compensation corrects the machine.
    pub is_loaded: bool,
    /// Whether it has been kept.
    pub is_kept: bool,
    /// What was probed before and after it was loaded.
    pub validation: Option<Validation>,
}

impl<'a> SimulatedMachine<'a> {
    /// A machine with these errors, whose owner takes the balls of an artefact to be where it says. `noise` is the standard
    /// deviation of each coordinate of a probing (mm).
    #[must_use]
    pub fn new(
        machine: &'a Machine,
        plan: &'a CalibrationPlan,
        artefact: &'a Artefact,
        errors: &'a ErrorModel,
        noise: f64,
    ) -> Self {
        Self {
            machine,
            plan,
            stated: artefact,
            artefact,
            errors,
            noise,
            mishap: Mishap::None,
            measured: [None, None, None],
            found: None,
            made: None,
            is_loaded: false,
            is_kept: false,
            validation: None,
        }
    }

    /// This machine with balls that are where another artefact has them.
    #[must_use]
    pub fn with_balls(self, artefact: &'a Artefact) -> Self {
        Self { artefact, ..self }
    }

    /// This machine with a mishap.
    #[must_use]
    pub fn with(self, mishap: Mishap) -> Self {
        Self { mishap, ..self }
    }

    /// The compensation that was made.
    #[must_use]
    pub fn made(&self) -> Option<&Built> {
        self.made.as_ref()
    }

    /// The usual calibration, from the plan on.
    ///
    /// # Errors
    /// [`Failure`].
    ///
    /// # Panics
    /// If the machine has no usual model.
    pub fn calibrate(&mut self) -> Result<CalibrationEnd, Failure> {
        let calibration = Calibration {
            machine: self.machine,
            model: usual_model(self.machine, self.stated).expect("a model"),
            accept_places: false,
        };
        calibration.run(CalibrationStep::Plan, self)
    }

    /// Probes rows on the real machine, with the compensation that is loaded.
    fn probe_rows(&self, rows: &Probings, seed: u64) -> Result<Probings, Failure> {
        self.probe_balls(self.artefact.clone(), rows, seed)
    }

    /// Probes rows on balls that are where this artefact has them.
    fn probe_balls(
        &self,
        mut artefact: Artefact,
        rows: &Probings,
        seed: u64,
    ) -> Result<Probings, Failure> {
        if let Mishap::Stylus(by) = self.mishap {
            artefact.stylus.tip[2] = artefact.stylus.tip[2].map(|z| z - by);
        }
        let disturbances = Disturbances {
            noise: self.noise,
            seed,
            ..Disturbances::default()
        };
        let kinematics = Kinematics::new(self.machine, self.errors);
        let Some(made) = self.made.as_ref().filter(|_| self.is_loaded) else {
            let measured = probings(&kinematics, &artefact, rows, &disturbances);
            return measured.map_err(Failure::NotReached);
        };
        let runtime = Runtime::load(&made.blob).expect("it was compiled");
        let factor = match self.mishap {
            Mishap::Corrections(factor) => factor,
            _ => 1.0,
        };
        let measured = compensated(&kinematics, &artefact, rows, &disturbances, |rows| {
            let all = corrections(self.machine, &runtime, rows);
            let scaled = all.into_iter().map(|one| one.map(|v| factor * v));
            Ok::<_, SimulateError>(scaled.collect())
        });
        measured.map_err(Failure::NotReached)
    }
}

impl CalibratedMachine for SimulatedMachine<'_> {
    type Error = Failure;

    fn refused(&self, refusal: CalibrationRefusal) -> Failure {
        Failure::Refused(refusal)
    }

    fn probe(&mut self) -> Result<bool, Failure> {
        self.measured[1] = Some(self.probe_rows(&self.plan.validation, 1)?);
        let rows = &self.plan.planned.judgement.plan;
        let mut plan = self.probe_rows(rows, 2)?;
        if self.mishap == Mishap::Ball {
            let mut artefact = self.artefact.clone();
            artefact.balls[0].nominal = artefact.balls[0].nominal.map(|ball| ball.add_scalar(0.1));
            let later = self.probe_balls(artefact, rows, 2)?;
            let half = rows.rows.len() / 2;
            plan.rows[half..].clone_from_slice(&later.rows[half..]);
        }
        self.measured[0] = Some(plan);
        Ok(true)
    }

    fn artefact(&mut self) -> Result<Artefact, Failure> {
        Ok(self.stated.clone())
    }

    fn probed(&mut self, rows: ProbedRows) -> Result<Probings, Failure> {
        let rows = &self.measured[rows as usize];
        Ok(rows.clone().expect("it is asked for after it was probed"))
    }

    fn identified(&mut self, found: &StudyOutcome<'_>) -> Result<(), Failure> {
        self.found = Some(found.errors().expect("it can be read"));
        Ok(())
    }

    fn errors(&mut self) -> Result<ErrorModel, Failure> {
        Ok(self.found.clone().expect("it was identified"))
    }

    fn agrees(&mut self, question: Question<'_>) -> Result<bool, Failure> {
        let number = match question {
            Question::Unmeasured(_) => 0,
            Question::Load => 1,
            Question::Validate => 2,
        };
        Ok(self.mishap != Mishap::Declined(number))
    }

    fn compile(&mut self) -> Result<bool, Failure> {
        let options = Options {
            random: 500,
            ..Options::of(Target::desktop())
        };
        let errors = self.found.as_ref().expect("it was identified");
        let made = compile::compile(self.machine, errors, &options, &());
        self.made = Some(made.map_err(Failure::NoTables)?.built);
        Ok(true)
    }

    fn load(&mut self) -> Result<(), Failure> {
        self.is_loaded = true;
        Ok(())
    }

    fn probe_again(&mut self) -> Result<(), Failure> {
        if self.mishap == Mishap::Stops {
            return Err(Failure::Stopped);
        }
        self.measured[2] = Some(self.probe_rows(&self.plan.validation, 3)?);
        Ok(())
    }

    fn validated(&mut self, found: &Validated) -> Result<(), Failure> {
        self.validation = Some(found.validation.clone());
        Ok(())
    }

    fn keep(&mut self) -> Result<(), Failure> {
        self.is_kept = true;
        Ok(())
    }

    fn undo(&mut self) -> Result<(), Failure> {
        self.is_loaded = false;
        Ok(())
    }
}
