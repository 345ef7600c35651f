//! From everything that was measured on a machine to its errors in one call: what decides which parameters it has, what
//! is refused, and what is warned of; and a calibration, which is that on a machine that answers.
//!
//! Everything begins with a [`Study`] or a [`calibration`]. Builds on `trueaxis-model`, `trueaxis-direct`,
//! `trueaxis-identify` and `trueaxis-probing`.

// Modules, most of which use only those before them: `runs` (what is kept of them) · `outcome`, `refusal`, `warnings` ·
// `identification` (an outcome as a record) · `validation` (what a compensation does, as a file) · `calibration`.

#![forbid(unsafe_code)]

pub mod calibration;
mod identification;
mod outcome;
mod refusal;
mod runs;
pub mod validation;
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

use trueaxis_direct::{DirectResult, Measurement};
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::formats::temperatures;
use trueaxis_identify::{
    Chosen, Compensated, Identified, IdentifyOptions, Measured, Model, NotKnown, Outlier, Problem,
    Stated, Warmed, automatic, compensability, drifting, held_out, honesty, identify, lacking,
    misplaced, published, snoop, stated, thermal, unseen_senses, without,
};
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_model::validate::{Command, Runtime};
use trueaxis_probing::plan::would_show;

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
    /// True if balls and stylus may be farther than [`PLACES`](trueaxis_identify::PLACES) from where they are stated.
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
            let left = without(study.machine, &rows.probings, &rows.observations, what);
            (rows.probings, rows.observations) = left.map_err(StudyRefusal::Without)?;
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

    /// Adds the corrections of a compensation to the axis positions.
    fn undo(&mut self, runtime: &Runtime<'_>) {
        for row in &mut self.probings.rows {
            let command = Command::coming(self.study.machine, &row.position, &row.direction);
            for (position, correction) in row.position.iter_mut().zip(runtime.evaluate(&command)) {
                *position += f64::from(correction);
            }
        }
    }

    /// The rows that count, over errors known beforehand.
    fn measured<'m>(&'m self, base: &'m ErrorModel) -> Measured<'m> {
        Measured {
            machine: self.study.machine,
            probings: &self.probings,
            artefact: self.study.artefact,
            observations: &self.observations,
            base,
        }
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
            let chosen = automatic(&self.measured(base), self.options)?;
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
        let steady = self.measured(base).problem(&parameters);
        let identified = identify(&steady, self.options)?;
        self.observations.drift = drifting(&steady, &identified);
        if self.observations.drift.is_empty() {
            return Ok((identified, None));
        }
        let drifts = self.measured(base).problem(&parameters);
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
        let steady = self.measured(&found.base).problem(&looked_for);
        found.identified = identify(&steady, self.options)?;
        let warmed = thermal(&steady, &found.identified, log, &candidates)
            .map_err(StudyRefusal::Temperatures)?;
        if !warmed.model.terms.is_empty() {
            self.observations.thermal = Some(warmed.model.clone());
            let changing = self.measured(&found.base).problem(&looked_for);
            found.identified = identify(&changing, self.options)?;
        }
        Ok(Some(warmed))
    }

    /// Balls and stylus, found and as stated, unless they are too far apart.
    fn places(
        &self,
        problem: &Problem<'_>,
        identified: &Identified,
    ) -> Result<Vec<Stated>, StudyRefusal> {
        let places = stated(problem, identified);
        if !self.request.accept_places
            && let Some(mistake) = misplaced(problem, &places)
        {
            return Err(StudyRefusal::Misplaced(mistake));
        }
        Ok(places)
    }

    /// Comparison with the errors before a compensation, if they are given.
    fn compared(
        &self,
        problem: &Problem<'_>,
        identified: &Identified,
    ) -> Result<Option<Compensated>, StudyRefusal> {
        let before = self.request.before;
        match before.map(|before| compensability(problem, identified, before)) {
            Some(all) if all.parameters.is_empty() => Err(StudyRefusal::Uncompared),
            compared => Ok(compared),
        }
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
        let measured = self.measured(&base);
        let problem = measured.problem(&identified.looked_for);
        let places = self.places(&problem, &identified)?;
        self.senses(&measured, &identified, kept.as_ref())?;
        let outliers: Vec<(Outlier, String)> = (snoop(&problem, &identified).into_iter())
            .map(|outlier| {
                let sentence = outlier.sentence(&problem);
                (outlier, sentence)
            })
            .collect();
        let compared = self.compared(&problem, &identified)?;
        let honesty = honesty(&problem, &self.probings, &identified);
        let seen: Vec<Parameter> = identified.parameters.iter().map(|e| e.parameter).collect();
        let (probings, observations) = (&self.probings, &self.observations);
        let held_out = held_out(&measured, &seen, self.options);
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
