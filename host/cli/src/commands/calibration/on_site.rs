//! The machine at a site: moved and compensated as the calibration decides, with its files.

use super::{CalibrationFiles, Errand, POSES_FILE, Site};
use crate::commands::bad_input::BadInput;
use crate::commands::compile;
use crate::commands::files::{self, MachineFiles};
use crate::commands::identify;
use crate::commands::output;
use crate::commands::probing::asked;
use crate::commands::target;
use std::path::Path;
use trueaxis_identify::Model;
use trueaxis_identify::formats::artefact::Artefact;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_model::errors::ErrorModel;
use trueaxis_study::StudyOutcome;
use trueaxis_study::calibration::{
    CalibratedMachine, CalibrationRefusal, CalibrationStep, ProbedRows, Question, Validated,
};

/// The machine at a site, and the files of its calibration.
pub struct OnSite<'a, 's> {
    pub files: &'a CalibrationFiles<'a>,
    pub site: &'a mut Site<'s>,
}

impl CalibratedMachine for OnSite<'_, '_> {
    type Error = BadInput;

    fn refused(&self, refusal: CalibrationRefusal) -> BadInput {
        let files = self.files;
        match refusal {
            CalibrationRefusal::Study(refusal) => BadInput::new(
                format!("{}: {refusal}", files.text("probings.csv")),
                refusal.remedy(),
            ),
            CalibrationRefusal::Errors(error) => BadInput::new(
                format!("{}: {error}", files.text("errors.toml")),
                "identify the errors again: --from identify",
            ),
        }
    }

    fn probe(&mut self) -> Result<bool, BadInput> {
        let (files, site) = (self.files, &mut *self.site);
        let before = files.errand("validation.csv", "before.csv")?;
        let plan = files.errand("plan.csv", "touches.csv")?;
        let qualifies = files.options.qualify.is_some();
        let ball = qualifies.then(|| files.errand(POSES_FILE, "ball.csv"));
        let ball = ball.transpose()?;
        let all: Vec<&Errand<'_>> = ball.iter().chain([&before, &plan]).collect();
        let yes = files.options.yes;
        if !site.is_ready(&all, yes)? {
            return Ok(false);
        }
        if let Some(ball) = &ball {
            site.touch(ball)?;
            files.qualify()?;
        }
        site.touch(&before)?;
        let question = "May the corrections be switched off, and the plan be probed without them?";
        if !yes && !asked(question)? {
            return Ok(false);
        }
        site.switch(false)?;
        site.touch(&plan)?;
        Ok(true)
    }

    fn artefact(&mut self) -> Result<Artefact, BadInput> {
        self.files.probed_artefact()
    }

    fn probed(&mut self, rows: ProbedRows) -> Result<Probings, BadInput> {
        let files = self.files;
        match rows {
            ProbedRows::Plan if files.options.from <= CalibrationStep::Identify => files.probings(),
            ProbedRows::Plan => files.measured(),
            ProbedRows::Before => Ok(files.touched("validation.csv", "before.csv")?.probings),
            ProbedRows::After => Ok(files.touched("validation.csv", "after.csv")?.probings),
        }
    }

    fn identified(&mut self, found: &StudyOutcome<'_>) -> Result<(), BadInput> {
        let errors = identify::write(found, &self.files.file("errors.toml"))?;
        identify::show(found, &errors, false)?;
        identify::warn(found);
        Ok(())
    }

    fn errors(&mut self) -> Result<ErrorModel, BadInput> {
        files::read_known_errors(&self.files.file("errors.toml"), &self.files.machine)
    }

    fn agrees(&mut self, question: Question<'_>) -> Result<bool, BadInput> {
        let (files, yes) = (self.files, self.files.options.yes);
        match question {
            Question::Unmeasured(parameters) => {
                let names = Model::Named(parameters.to_vec());
                output::print(&format!(
                    "\nnot measured: {names}. A machine that has them is worse than any limit that is printed here\n"
                ))?;
                let accepts = files.options.accept_missing;
                Ok(accepts || !yes && asked("May it go on without them?")?)
            }
            Question::Load => {
                let blob = files.file("machine.trax");
                output::print("\n")?;
                let question = format!("May {} be loaded and switched on?", blob.display());
                Ok(yes || asked(&question)?)
            }
            Question::Validate => {
                let question = "May it be validated by probing with the corrections on?";
                let is_taken = files.options.from <= CalibrationStep::Probe;
                let agrees = (yes || asked(question)?) && (is_taken || self.site.take_over(yes)?);
                if !agrees {
                    output::print("you did not want it probed\n")?;
                }
                Ok(agrees)
            }
        }
    }

    fn compile(&mut self) -> Result<bool, BadInput> {
        let files = self.files;
        let target = self.site.target(&files.file("board.toml"))?;
        let (errors, blob) = (files.word("errors.toml"), files.word("machine.trax"));
        let words = format!("{errors} --target {} -o {blob}", output::quoted(&target));
        files.show("compile", &words)?;
        let inputs = MachineFiles {
            machine: files.options.machine.clone(),
            errors: files.file("errors.toml"),
        };
        let blob = files.file("machine.trax");
        let compiled = compile::usual(&inputs, blob, target::read(&target)?)?;
        compiled.show()?;
        Ok(compiled.made.is_right())
    }

    fn load(&mut self) -> Result<(), BadInput> {
        if let Some(active) = self.site.file().filter(|active| active.exists()) {
            self.files.keep_previous(active)?;
        }
        self.site.load(&self.files.file("machine.trax"))?;
        self.site.switch(true)
    }

    fn probe_again(&mut self) -> Result<(), BadInput> {
        let errand = self.files.errand("validation.csv", "after.csv")?;
        // An older one was made with another compensation, and would count as this one's.
        removed(&errand.log)?;
        self.site.touch(&errand)
    }

    fn validated(&mut self, found: &Validated) -> Result<(), BadInput> {
        let files = self.files;
        let json = output::json(&found.validation)?;
        output::write(&files.file("validation.json"), json.as_bytes())?;
        output::print(&table(found, &files.text("errors.toml")))
    }

    fn keep(&mut self) -> Result<(), BadInput> {
        self.site.keep()
    }

    fn undo(&mut self) -> Result<(), BadInput> {
        self.site.undo()
    }
}

/// The figures of a validation.
fn table(found: &Validated, errors: &str) -> String {
    let validation = &found.validation;
    let predicted = match validation.unseen.is_empty() {
        true => "predicted, at most",
        false => "predicted from the measured errors",
    };
    let (before, after) = (validation.before, validation.after);
    let mut text = format!(
        "\nvalidation at {} other positions    rms (µm)   largest\n  \
         before                           {:>9.2} {:>9.2}\n  \
         after                            {:>9.2} {:>9.2}\n  \
         {predicted:<32} {:>9.2}\n",
        validation.probings,
        before.rms_um,
        before.largest_um,
        after.rms_um,
        after.largest_um,
        validation.expected_um
    );
    if !validation.unseen.is_empty() {
        text += &format!(
            "not measured, and not in the prediction: {}; {errors} says what would show each\n",
            validation.unseen.join(", ")
        );
    }
    if let Some(why) = found.objection() {
        text += &format!("{why}\n");
    }
    text
}

/// Removes a file, if there is one.
fn removed(path: &Path) -> Result<(), BadInput> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(BadInput::new(
            format!("{}: cannot be removed: {error}", path.display()),
            "remove it, then start again with --from load",
        )),
        _ => Ok(()),
    }
}
