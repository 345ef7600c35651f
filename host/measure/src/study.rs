//! One identification from everything that was measured: what decides which parameters a machine has, what is refused,
//! and what is warned of.

mod identification;
mod outcome;
mod refusal;
mod runs;
mod warnings;

pub use identification::{
    BallRecord, BarRecord, ChangeRecord, CheckRecord, Compared, CycleRecord, DriftRecord,
    EstimateRecord, HeldOutRecord, Identification, LevelRecord, NoiseRecord, NotSeen,
    ObservedRecord, PartStated, PlaceRecord, Probed, PublishedRecord, ReadingRecord, RepeatsRecord,
    RowRecord, SetupPartRecord, SetupRecord, StatedOutlier, TemperaturesRecord, ThermalRecord,
};
pub use outcome::StudyOutcome;
pub use refusal::{RefusedInput, StudyRefusal};
pub use warnings::{StudyWarning, WarningKind};

use crate::direct::{DirectResult, Measurement};
use crate::formats::artefact::Artefact;
use crate::formats::observations::Observations;
use crate::formats::probings::Probings;
use crate::formats::temperatures;
use crate::identify::{
    Chosen, Identified, IdentifyOptions, Model, NotKnown, Outlier, Problem, Warmed, automatic,
    compensability, drifting, held_out, honesty, identify, lacking, misplaced, published, snoop,
    stated, thermal, unseen_senses, without,
};
use crate::plan::would_show;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_tables::validate::{Command, Runtime};

/// What was measured on a machine.
#[derive(Clone, Copy)]
pub struct Study<'a> {
    /// The nominal machine.
    pub machine: &'a Machine,
    /// Balls as they were probed, if any were.
    pub probings: &'a Probings,
    /// What is known about balls, bars and stylus.
    pub artefact: &'a Artefact,
    /// Readings of instruments that are fitted together with the probings.
    pub observations: &'a Observations,
    /// Runs whose error motions are kept as tables.
    pub runs: &'a [Measurement],
    /// Errors that were known before.
    pub base: &'a ErrorModel,
}

/// What is to be found.
pub struct StudyRequest<'a> {
    /// The parameters to look for.
    pub model: Model,
    /// True if rows that fit badly count less.
    pub robust: bool,
    /// Rows to leave out: `line 17`, `ball 3`, `C = 90`, `S = 180`, `setup bar`, `bar.csv line 12`.
    pub without: Vec<String>,
    /// True if balls and stylus may be farther than [`PLACES`](crate::identify::PLACES) from where they are stated.
    pub accept_places: bool,
    /// The compensation that was on while probing, whose effect is undone.
    pub active: Option<&'a Runtime<'a>>,
    /// Temperatures over time that parameters may change with.
    pub temperatures: Option<&'a temperatures::Temperatures>,
    /// The parameters that may change with temperature; all that are looked for if nothing is said.
    pub thermal: Option<Model>,
    /// Errors before the compensation that was on while probing, to compare with.
    pub before: Option<&'a ErrorModel>,
}

impl StudyRequest<'_> {
    /// These parameters, and nothing else said.
    #[must_use]
    pub fn of(model: Model) -> Self {
        Self {
            model,
            robust: false,
            without: Vec::new(),
            accept_places: false,
            active: None,
            temperatures: None,
            thermal: None,
            before: None,
        }
    }
}

impl<'a> Study<'a> {
    /// Identifies, and judges what was found.
    ///
    /// # Errors
    /// [`StudyRefusal`], with what it is about and what to do.
    pub fn identify(&self, request: &StudyRequest<'_>) -> Result<StudyOutcome<'a>, StudyRefusal> {
        CountedRows::new(self, request)?.identify()
    }
}

/// The rows that count, and what they are asked for.
struct CountedRows<'r, 'a> {
    study: &'r Study<'a>,
    request: &'r StudyRequest<'r>,
    options: IdentifyOptions,
    probings: Probings,
    /// With the drift and the temperatures that have been found so far.
    observations: Observations,
}

/// The parameters, and how they came about.
struct FoundParameters {
    /// The errors known beforehand, with the tables of runs.
    base: ErrorModel,
    identified: Identified,
    /// The choice, if the model is `auto`.
    chosen: Option<Chosen>,
    /// The motions that are kept as tables, if there are runs.
    kept: Option<DirectResult>,
}

impl<'r, 'a> CountedRows<'r, 'a> {
    fn new(study: &'r Study<'a>, request: &'r StudyRequest<'r>) -> Result<Self, StudyRefusal> {
        let mut rows = Self {
            study,
            request,
            options: IdentifyOptions {
                robust: request.robust,
                ..IdentifyOptions::default()
            },
            probings: study.probings.clone(),
            observations: study.observations.clone(),
        };
        rows.forget();
        for what in &request.without {
            rows.leave_out(what)?;
        }
        if let Some(runtime) = request.active {
            rows.undo(runtime);
        }
        Ok(rows)
    }

    /// Drops what was found about time.
    fn forget(&mut self) {
        self.observations.drift.clear();
        self.observations.thermal = None;
    }

    fn leave_out(&mut self, what: &str) -> Result<(), StudyRefusal> {
        let machine = self.study.machine;
        let observed = self.observations.without(machine, what);
        match without(machine, &self.probings, what) {
            Ok(left) => self.probings = left,
            Err(reason) if observed.is_none() => return Err(StudyRefusal::Without(reason)),
            Err(_) => {}
        }
        if let Some(left) = observed {
            self.observations = left;
        }
        Ok(())
    }

    /// Adds the corrections of a compensation to the axis positions.
    fn undo(&mut self, runtime: &Runtime<'_>) {
        for row in &mut self.probings.rows {
            let command = Command::coming(self.study.machine, &row.position, &row.direction);
            for (position, correction) in row.position.iter_mut().zip(runtime.evaluate(&command)) {
                *position += f64::from(correction);
            }
        }
    }

    /// The equations of these parameters, over errors known beforehand.
    fn problem(&self, parameters: &[Parameter], base: &ErrorModel) -> Problem<'a> {
        let Study {
            machine, artefact, ..
        } = *self.study;
        Problem::new(machine, &self.probings, artefact, parameters, base).with(&self.observations)
    }

    fn identify(mut self) -> Result<StudyOutcome<'a>, StudyRefusal> {
        if let Some(before) = self.request.before {
            let mut motions = before.motions.iter().flatten();
            if motions.any(|m| m.table.is_some() || !m.thermal.is_empty())
                || !before.inter_thermal.is_empty()
            {
                return Err(StudyRefusal::Incomparable);
            }
        }
        let mut found = self.with_tables()?;
        let warmed = self.warmed(&mut found)?;
        self.judged(found, warmed)
    }

    /// Identifies over errors known beforehand, together with the drift that shows.
    fn found(&mut self, base: &ErrorModel) -> Result<(Identified, Option<Chosen>), StudyRefusal> {
        self.observations.drift.clear();
        let (machine, model) = (self.study.machine, &self.request.model);
        if *model == Model::Auto {
            let (probings, artefact) = (&self.probings, self.study.artefact);
            let observations = &self.observations;
            let chosen = automatic(
                machine,
                probings,
                artefact,
                observations,
                base,
                self.options,
            )?;
            self.observations.drift.clone_from(&chosen.drift);
            return Ok((chosen.identified.clone(), Some(chosen)));
        }
        let parameters = model
            .parameters(machine, 0, &[])
            .map_err(StudyRefusal::Model)?;
        let twice = parameters.iter().find(|p| base.is_tabulated(machine, p));
        if let (Model::Named(_), Some(parameter)) = (model, twice) {
            let parameter = *parameter;
            return Err(StudyRefusal::Tabulated { parameter });
        }
        let steady = self.problem(&parameters, base);
        let identified = identify(&steady, self.options)?;
        self.observations.drift = drifting(&steady, &identified);
        if self.observations.drift.is_empty() {
            return Ok((identified, None));
        }
        let drifts = self.problem(&parameters, base);
        Ok((identify(&drifts, self.options)?, None))
    }

    /// Replaces what was found by what temperatures explain better.
    fn warmed(&mut self, found: &mut FoundParameters) -> Result<Option<Warmed>, StudyRefusal> {
        let Some(log) = self.request.temperatures else {
            return Ok(None);
        };
        let looked_for = found.identified.looked_for.clone();
        let candidates = match &self.request.thermal {
            None => looked_for.clone(),
            Some(model) => {
                (model.parameters(self.study.machine, 0, &[])).map_err(StudyRefusal::Thermal)?
            }
        };
        // What moves with temperature is not taken for drift with time.
        self.observations.drift.clear();
        let steady = self.problem(&looked_for, &found.base);
        found.identified = identify(&steady, self.options)?;
        let warmed = thermal(&steady, &found.identified, log, &candidates)
            .map_err(StudyRefusal::Temperatures)?;
        if !warmed.model.terms.is_empty() {
            self.observations.thermal = Some(warmed.model.clone());
            let changing = self.problem(&looked_for, &found.base);
            found.identified = identify(&changing, self.options)?;
        }
        Ok(Some(warmed))
    }

    /// Everything that is said of what was found.
    fn judged(
        self,
        found: FoundParameters,
        warmed: Option<Warmed>,
    ) -> Result<StudyOutcome<'a>, StudyRefusal> {
        let FoundParameters {
            base,
            identified,
            chosen,
            kept,
        } = found;
        let Study {
            machine,
            artefact,
            runs,
            ..
        } = *self.study;
        let problem = self.problem(&identified.looked_for, &base);
        let places = stated(&problem, &identified);
        if !self.request.accept_places
            && let Some(mistake) = misplaced(&problem, &places)
        {
            return Err(StudyRefusal::Misplaced(mistake));
        }
        let outliers: Vec<(Outlier, String)> = (snoop(&problem, &identified).into_iter())
            .map(|outlier| {
                let sentence = outlier.sentence(&problem);
                (outlier, sentence)
            })
            .collect();
        let before = self.request.before;
        let compared = before.map(|before| compensability(&problem, &identified, before));
        if compared
            .as_ref()
            .is_some_and(|all| all.parameters.is_empty())
        {
            return Err(StudyRefusal::Uncompared);
        }
        let honesty = honesty(&problem, &self.probings, &identified);
        let seen: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
        let (probings, observations) = (&self.probings, &self.observations);
        let held_out = held_out(
            machine,
            probings,
            artefact,
            observations,
            &seen,
            &base,
            self.options,
        );
        let not_known = NotKnown::of(&problem, &identified, &honesty, held_out.as_ref().ok())?;
        let remedies = would_show(
            machine,
            probings,
            artefact,
            observations,
            &base,
            &identified,
        );
        Ok(StudyOutcome {
            machine,
            artefact,
            runs,
            published: chosen
                .as_ref()
                .and_then(|chosen| published(machine, chosen)),
            levels: chosen.map_or(Vec::new(), |chosen| chosen.levels),
            lacking: lacking(&problem, &identified),
            missing: problem.missing()?,
            unseen_senses: unseen_senses(&problem),
            probings: self.probings,
            observations: self.observations,
            identified,
            warmed,
            compared,
            honesty,
            held_out,
            remedies,
            places,
            outliers,
            not_known,
            kept,
        })
    }
}
