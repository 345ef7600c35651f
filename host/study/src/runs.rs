//! Error motions that runs show, which are kept as tables.

use crate::{CountedRows, FoundParameters, StudyRefusal};
use trueaxis_direct::{DirectResult, Measurement, kept, same_tables};
use trueaxis_identify::{Identified, IdentifyError, Measured, identify, turned};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};

/// Levers of angular motions, which are small, change tables by less in each round.
const ROUNDS: usize = 6;

impl CountedRows<'_, '_> {
    /// Identifies with the tables that runs show on a machine with what is identified: again and again until both agree.
    pub(crate) fn with_tables(&mut self) -> Result<FoundParameters, StudyRefusal> {
        let known = self.study.base;
        if self.study.runs.is_empty() {
            let (identified, chosen) = self.found(known)?;
            return Ok(FoundParameters {
                base: known.clone(),
                identified,
                chosen,
                kept: None,
            });
        }
        let (mut base, _) = self.tables(known)?;
        let (mut identified, mut chosen) = self.found(&base)?;
        for _ in 0..ROUNDS {
            let (next, solved) = self.tables(&identified.errors)?;
            if same_tables(&base, &next) {
                return Ok(FoundParameters {
                    base,
                    identified,
                    chosen,
                    kept: Some(solved),
                });
            }
            (identified, chosen) = self.found(&next)?;
            base = next;
        }
        Err(StudyRefusal::Unsettled { rounds: ROUNDS })
    }

    /// Refuses a file of runs that agrees with the others only if its readings count the other way. Models with more than
    /// locations, scales and backlash bend until both fit.
    pub(crate) fn senses(
        &self,
        measured: &Measured<'_>,
        identified: &Identified,
        kept: Option<&DirectResult>,
    ) -> Result<(), StudyRefusal> {
        let Some(kept) = kept else {
            return Ok(());
        };
        let looked_for = identified.looked_for.iter().copied();
        let straight: Vec<Parameter> = looked_for
            .filter(|p| {
                matches!(p.kind, ParameterKind::Inter | ParameterKind::Backlash)
                    || *p == Parameter::scale(p.axis)
            })
            .collect();
        let problem = measured.problem(&straight);
        let motions = kept.motions.iter();
        let runs = motions.map(|m| (self.study.runs[m.from].name.as_str(), m.axis, m.component));
        let mut runs: Vec<_> = runs.collect();
        runs.sort_unstable();
        // What such a model does not fit at all says nothing.
        let Ok(found) = identify(&problem, self.options) else {
            return Ok(());
        };
        match turned(&problem, &found, &runs) {
            Some(mistake) => Err(IdentifyError::Mistake(mistake).into()),
            None => Ok(()),
        }
    }

    fn tables(&self, found: &ErrorModel) -> Result<(ErrorModel, DirectResult), StudyRefusal> {
        let (machine, runs) = (self.study.machine, self.study.runs);
        kept(machine, runs, self.study.base, found).map_err(|error| {
            let name = |number: usize| runs[number].name.clone();
            StudyRefusal::Runs {
                files: error.files.iter().copied().map(name).collect(),
                error,
            }
        })
    }
}

/// What else shows in runs, with the file that each is about.
pub(crate) fn doubts(runs: &[Measurement], kept: &DirectResult) -> Vec<String> {
    let said = kept.doubts.iter().map(|doubt| {
        let file = doubt.file.map_or("", |file| &runs[file].name);
        format!("{file}: {doubt}: {}", doubt.remedy)
    });
    said.collect()
}
