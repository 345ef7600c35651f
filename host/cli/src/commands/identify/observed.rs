//! Observations of instruments in the output of `trueaxis identify`.

use super::super::quantity::{EXPANDED, count};
use super::Found;
use serde::Serialize;
use trueaxis_measure::identify::{Component, Contradicted, FoundDrift, contradicted, repeated};
use trueaxis_measure::instrument::Kind;

/// What was measured, in words.
pub fn counts(found: &Found<'_>) -> String {
    let (probed, observed) = (&found.measured.rows, &found.observations.rows);
    let balls = count(found.measured.balls.len(), "ball");
    let mut setups: Vec<usize> = observed.iter().map(|row| row.setup).collect();
    setups.sort_unstable();
    setups.dedup();
    let setups = format!(
        "{} with {}",
        count(observed.len(), "observation"),
        count(setups.len(), "set-up")
    );
    let runs = found.kept.map_or(String::new(), |(runs, _)| {
        format!(
            ", beside {}",
            count(runs.len(), "file of runs").replace("file of runss", "files of runs")
        )
    });
    let counts = match (probed.len(), observed.len()) {
        (probings, 0) => format!("{probings} probings of {balls}"),
        (0, _) => setups,
        (probings, _) => format!("{probings} probings of {balls} and {setups}"),
    };
    counts + &runs
}

/// The noise of each source, if there are others than probings.
pub fn noise(text: &mut String, found: &Found<'_>) {
    if found.observations.rows.is_empty() {
        return;
    }
    *text += "\nsource             rows         noise   of stated   degrees of freedom\n";
    for one in &found.identified.components {
        let factor = one.of_stated.map_or("-".to_owned(), |f| format!("{f:.2}"));
        *text += &format!(
            "  {:<15}{:>6}{:>9.2} {:<4}{factor:>12}{:>21.1}\n",
            one.source.name(),
            one.rows,
            one.noise * 1e3,
            one.source.unit(),
            one.freedom
        );
    }
}

/// Set-ups as found, and drift.
pub fn setups(text: &mut String, found: &Found<'_>) {
    let has_parts = |setup: &&trueaxis_measure::identify::FoundSetup| !setup.parts.is_empty();
    let setups: Vec<_> = found.identified.setups.iter().filter(has_parts).collect();
    if !setups.is_empty() {
        *text += "\nset-up                                    found   expanded (k = 2)\n";
    }
    let number = |v: f64| (v * 1e4).round() / 1e4 + 0.0;
    for setup in setups {
        for part in &setup.parts {
            let (factor, unit) = part.shown();
            let prior = part.prior.map_or(String::new(), |prior| {
                let z = prior.z.map_or("nothing else shows it".to_owned(), |z| {
                    format!("|z| = {:.1}", z.abs())
                });
                let (stated, sigma) = (number(prior.value * factor), prior.sigma * factor);
                format!(", stated as {stated:.4} ± {sigma:.4} ({z})")
            });
            *text += &format!(
                "  {:<14}{:<20}{:>12.4}{:>12.4} {unit}{prior}\n",
                setup.name,
                part.what,
                // Avoids -0.
                number(part.value * factor),
                EXPANDED * part.uncertainty * factor
            );
        }
    }
    if !found.identified.drift.is_empty() {
        *text += "\ndrift, found together with the parameters (k = 2)\n";
    }
    for drift in &found.identified.drift {
        *text += &format!("  {}\n", sentence(drift));
    }
}

fn sentence(drift: &FoundDrift) -> String {
    let what = drift.setup.as_deref().unwrap_or("the artefact");
    let axis = ["x", "y", "z"][drift.component % 3];
    let (way, unit, factor) = match drift.component {
        0..3 => ("along", "µm", 1e3),
        _ => ("about", "µrad", 1e6),
    };
    let course = (drift.lag).map_or(String::new(), |lag| {
        format!(", with a time constant of {lag:.0} s")
    });
    format!(
        "{what} moved {way} {axis} by {:.2} ± {:.2} {unit} in {:.0} s{course}",
        drift.value * factor,
        EXPANDED * drift.uncertainty * factor,
        drift.seconds
    )
}

/// What to check before trusting the parameters.
pub fn warnings(found: &Found<'_>) -> Vec<String> {
    let identified = found.identified;
    let wrong = contradicted(identified);
    let mut warnings: Vec<String> = wrong.iter().map(Contradicted::sentence).collect();
    let copies = repeated(found.observations, identified);
    warnings.extend(copies.iter().map(|one| one.sentence(found.observations)));
    // Wrong readings make the residuals of a whole source larger.
    if found.suspicions.is_empty() {
        let wrong = (identified.components.iter()).filter(|one| one.is_misstated());
        warnings.extend(wrong.map(|one| {
            let name = one.source.name();
            let factor = one.of_stated.unwrap_or(1.0);
            match one.is_refuted {
                true => format!(
                    "the residuals of the {name} are {factor:.2} times the uncertainty that their file states, and chance does not explain that: either the machine has errors that the model lacks, which are not in the uncertainties of its parameters, or the stated uncertainty is too small. Try --model auto, or correct the uncertainty"
                ),
                false => format!(
                    "the residuals of the {name} are {factor:.2} times the uncertainty that their file states, and chance does not explain that: correct the uncertainty of the {name}, or leave it out so that it is found from the residuals"
                ),
            }
        }));
    }
    let suspected = |number: usize| {
        let mut all = found.suspicions.iter();
        all.any(|(suspicion, _)| suspicion.observations.contains(&number))
    };
    let rows = found.observations.rows.iter().zip(&identified.observed);
    let untrusted = rows
        .enumerate()
        .filter(|(number, (_, after))| !after.is_trusted && !suspected(*number));
    let untrusted: Vec<String> = untrusted
        .map(|(_, (row, _))| format!("{} line {}", found.observations.files[row.file], row.line))
        .collect();
    if !untrusted.is_empty() && !found.is_explained() {
        warnings.push(format!(
            "{} of {} observations fit badly ({}): look at their readings, leave them out (--without), or let them count less (--robust)",
            untrusted.len(),
            found.observations.rows.len(),
            untrusted.join(", ")
        ));
    }
    warnings
}

/// The same as JSON.
#[derive(Serialize)]
pub struct Observed<'a> {
    noise: Vec<Noise>,
    setups: Vec<Setup<'a>>,
    drift: Vec<Drift<'a>>,
    rows: Vec<Row<'a>>,
}

/// Noise in µm, or µrad for angles.
#[derive(Serialize)]
struct Noise {
    source: &'static str,
    rows: usize,
    noise: f64,
    unit: &'static str,
    of_stated: Option<f64>,
    degrees_of_freedom: f64,
    is_misstated: bool,
}

#[derive(Serialize)]
struct Setup<'a> {
    name: &'a str,
    kind: &'static str,
    parts: Vec<Part<'a>>,
}

/// In mm or rad.
#[derive(Serialize)]
struct Part<'a> {
    what: &'a str,
    value: f64,
    standard_uncertainty: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    stated: Option<Stated>,
}

/// What was stated beforehand, in the same unit.
#[derive(Serialize)]
struct Stated {
    value: f64,
    standard_uncertainty: f64,
    /// Nothing if no other measurement tells anything about it.
    z: Option<f64>,
}

/// In mm or rad.
#[derive(Serialize)]
struct Drift<'a> {
    /// The set-up, or nothing for the artefact.
    setup: Option<&'a str>,
    component: &'static str,
    value: f64,
    standard_uncertainty: f64,
    over_s: f64,
    /// If it approached its end exponentially.
    time_constant_s: Option<f64>,
    sentence: String,
}

/// Residuals in µm, or µrad for angles.
#[derive(Serialize)]
struct Row<'a> {
    file: &'a str,
    line: usize,
    setup: &'a str,
    kind: &'static str,
    before: Vec<f64>,
    after: Vec<f64>,
    is_trusted: bool,
}

impl<'a> Observed<'a> {
    /// `None` if there are only probings, and no drift.
    pub fn new(found: &'a Found<'_>) -> Option<Self> {
        let (all, identified) = (found.observations, found.identified);
        if all.rows.is_empty() && identified.drift.is_empty() {
            return None;
        }
        let noise = |one: &Component| Noise {
            source: one.source.name(),
            rows: one.rows,
            noise: one.noise * 1e3,
            unit: one.source.unit(),
            of_stated: one.of_stated,
            degrees_of_freedom: one.freedom,
            is_misstated: one.is_misstated(),
        };
        let setups = identified.setups.iter().map(|setup| Setup {
            name: &setup.name,
            kind: setup.kind.name(),
            parts: (setup.parts.iter())
                .map(|part| Part {
                    what: &part.what,
                    value: part.value,
                    standard_uncertainty: part.uncertainty,
                    stated: part.prior.map(|prior| Stated {
                        value: prior.value,
                        standard_uncertainty: prior.sigma,
                        z: prior.z,
                    }),
                })
                .collect(),
        });
        let drift = identified.drift.iter().map(|drift| Drift {
            setup: drift.setup.as_deref(),
            component: ["x", "y", "z", "a", "b", "c"][drift.component],
            value: drift.value,
            standard_uncertainty: drift.uncertainty,
            over_s: drift.seconds,
            time_constant_s: drift.lag,
            sentence: sentence(drift),
        });
        let rows = all.rows.iter().zip(&identified.observed);
        let rows = rows.map(|(row, found)| {
            let setup = &all.setups[row.setup];
            let kind: Kind = setup.kind;
            let left = |mm: &[f64]| mm[..kind.dimension()].iter().map(|v| v * 1e3).collect();
            Row {
                file: &all.files[row.file],
                line: row.line,
                setup: &setup.name,
                kind: kind.name(),
                before: left(found.before.as_slice()),
                after: left(found.after.as_slice()),
                is_trusted: found.is_trusted,
            }
        });
        Some(Self {
            noise: identified.components.iter().map(noise).collect(),
            setups: setups.collect(),
            drift: drift.collect(),
            rows: rows.collect(),
        })
    }
}
