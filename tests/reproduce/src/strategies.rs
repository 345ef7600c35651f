//! Counts and times that follow from the published strategies.

use super::embedded::{Example, Parameters, Strategy, hu40, kolibri};
use super::validated::{Corrector, Validation};
use super::{Chapter, Compared, Figure, ReproduceError};
use trueaxis_direct::ballbar::Hemisphere;
use trueaxis_identify::Model;
use trueaxis_identify::formats::probings::Probings;
use trueaxis_identify::simulate::Disturbances;

/// Duration of a probing (s; section 5.8).
const SECONDS: f64 = 110.0;

/// Number of different positions of rotary axes and spindle.
fn positions(strategy: &Probings) -> usize {
    let key = |row: &trueaxis_identify::formats::probings::Probing| {
        let mut key: Vec<u64> = row.position.iter().map(|p| p.to_bits()).collect();
        key.push(row.spindle.to_bits());
        key
    };
    let mut all: Vec<Vec<u64>> = strategy.rows.iter().map(key).collect();
    all.sort_unstable();
    all.dedup();
    all.len()
}

/// Number of unknowns of ball and stylus: three coordinates of each.
fn setup(strategy: &Probings) -> usize {
    3 * (strategy.balls.len() + 1)
}

const BALLS: &str = "the balls that Table 4-1 lists for each position are 109; the text says that each test measured 123 \
    positions";
const CONDITION: &str = "which columns the document counted and where its balls stood is not published: see \
    [condition numbers](../src/identification-reference.md#condition-numbers)";
const APPROACH: &str = "five half meridians both ways and the arcs between them in steps of 0.1° are 19 801 positions; the 8 \
    of approach and feed-in were chosen to make up the rest";
const SAGITTA: &str = "r·(1 − cos 0.05°) of 150 mm; the document's figure is 400 times less";

pub fn chapter() -> Result<Chapter, ReproduceError> {
    let kolibri = kolibri()?;
    let mut compared = counts(&kolibri)?;
    compared.extend(conditions(&kolibri)?);
    compared.extend(of_bar()?);
    Ok(Chapter {
        title: "Strategies: counts and times",
        source: "section 5.8",
        how: "From the published lists of positions (Tables 4-1, 5-3 and 5-4), which are the strategies of the \
            examples, and the sets of [`trueaxis plan --set`](../src/planning-reference.md#position-sets).",
        compared,
        tables: Vec::new(),
        fixed: Vec::new(),
        pictures: Vec::new(),
    })
}

/// A count of the document, and ours.
fn counted(what: &str, document: usize, ours: usize) -> Compared {
    Compared::plain(what, Figure::count(document), Figure::count(ours))
}

/// Numbers of positions and unknowns, and times.
fn counts(kolibri: &Example) -> Result<Vec<Compared>, ReproduceError> {
    let calibration = kolibri.strategy(Strategy::KolibriCalibration)?;
    let validation = kolibri.strategy(Strategy::KolibriValidation)?;
    let samba = hu40()?.strategy(Strategy::Hu40)?;
    let pairs = calibration.rows.len() / calibration.balls.len();
    let minutes = |what, document, probings: usize| {
        let ours = Figure::new(probings as f64 * SECONDS / 60.0, 0);
        Compared::plain(what, Figure::count(document), ours).in_unit("min")
    };
    let number_of = |model: Model| {
        let parameters = model.parameters(&kolibri.machine, 0, &[]);
        parameters.map_or(0, |parameters| parameters.len()) + setup(&calibration)
    };
    let twelve = number_of(Model::Twelve);
    Ok(vec![
        counted("pairs of A and C, calibration", 42, pairs).from("Table 5-3"),
        counted("… validation", 60, positions(&validation)).from("Table 5-4"),
        minutes("… time for one ball, calibration", 77, pairs),
        minutes("… validation", 110, validation.rows.len()),
        counted("positions of S, B and C", 32, positions(&samba)).from("Table 4-1"),
        counted("… probings", 123, samba.rows.len())
            .from("section 4.6.1")
            .because(BALLS),
        counted("unknowns, 12 errors and four balls", 27, twelve),
        counted("… 81 coefficients", 96, number_of(Model::EightyOne)),
    ])
}

/// Condition numbers of the identifications.
fn conditions(kolibri: &Example) -> Result<Vec<Compared>, ReproduceError> {
    use Parameters::{Kolibri10, Kolibri12, Kolibri81};
    use Strategy::{KolibriCalibration, KolibriValidation};
    type Row = (&'static str, usize, &'static str, Strategy, Parameters);
    let row = |(what, document, source, strategy, parameters): Row| {
        let errors = kolibri.errors(parameters)?;
        let problem = Validation::new(kolibri, strategy, &errors)?;
        let found = problem.identified(&errors, &Corrector::Nothing, &Disturbances::default())?;
        let (document, ours) = (Figure::count(document), Figure::new(found.condition, 0));
        let row = Compared::plain(what, document, ours);
        Ok(row.from(source).because(CONDITION))
    };
    let calibration = "condition, ten errors, calibration";
    let (twelve, many) = (
        "… twelve errors, calibration",
        "… 81 coefficients, calibration",
    );
    let rows = [
        (
            calibration,
            206,
            "section 6.8",
            KolibriCalibration,
            Kolibri10,
        ),
        (
            "… validation",
            216,
            "section 6.8",
            KolibriValidation,
            Kolibri10,
        ),
        (twelve, 200, "section 5.9.1", KolibriCalibration, Kolibri12),
        (many, 3900, "section 5.9.1", KolibriCalibration, Kolibri81),
    ];
    rows.into_iter().map(row).collect()
}

/// The path of the ball-bar.
fn of_bar() -> Result<[Compared; 2], ReproduceError> {
    let hemisphere = Hemisphere::default();
    let half_step = (90.0 / f64::from(hemisphere.steps)).to_radians();
    let sagitta = 1e3 * hemisphere.radius * (1.0 - half_step.cos());
    let circle = "… from the circle between two of them";
    Ok([
        counted(
            "positions of the ball-bar",
            19_809,
            hemisphere.path()?.len(),
        )
        .from("section 4.6.2")
        .because(APPROACH),
        Compared::numbers(circle, [0.000_14, sagitta], 5)
            .in_unit("µm")
            .from("section 4.6.2")
            .because(SAGITTA),
    ])
}
