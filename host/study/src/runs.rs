//! Error motions that runs show, which are kept as tables.

use crate::{CountedRows, FoundParameters, StudyRefusal};
use trueaxis_direct::{DirectResult, Measurement, kept, same_tables};
use trueaxis_model::errors::ErrorModel;

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
