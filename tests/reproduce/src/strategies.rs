//! Counts and times that follow from the published strategies.

use super::embedded::{Parameters, Strategy, hu40, kolibri};
use super::validated::{Corrector, Validation};
use super::{Chapter, Compared, Figure, ReproduceError};
use trueaxis_measure::ballbar::Hemisphere;
use trueaxis_measure::formats::probings::Probings;
use trueaxis_measure::identify::Model;
use trueaxis_measure::simulate::Disturbances;

/// Duration of a probing (s; section 5.8).
const SECONDS: f64 = 110.0;

/// Number of different positions of rotary axes and spindle.
fn positions(strategy: &Probings) -> usize {
    let key = |row: &trueaxis_measure::formats::probings::Probing| {
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
    let (kolibri, hu40) = (kolibri()?, hu40()?);
    let calibration = kolibri.strategy(Strategy::KolibriCalibration)?;
    let validation = kolibri.strategy(Strategy::KolibriValidation)?;
    let samba = hu40.strategy(Strategy::Hu40)?;
    let count = |n: usize| Figure::count(n);
    let pairs = calibration.rows.len() / calibration.balls.len();
    let unknowns = |errors: usize| errors + setup(&calibration);
    let minutes = |probings: usize| Figure::new(probings as f64 * SECONDS / 60.0, 0);
    let condition = |strategy, parameters| -> Result<Figure, ReproduceError> {
        let errors = kolibri.errors(parameters)?;
        let problem = Validation::new(&kolibri, strategy, &errors)?;
        let found = problem.identified(&errors, &Corrector::Nothing, &Disturbances::default())?;
        Ok(Figure::new(found.condition, 0))
    };
    let hemisphere = Hemisphere::default();
    let half_step = (90.0 / f64::from(hemisphere.steps)).to_radians();
    let sagitta = 1e3 * hemisphere.radius * (1.0 - half_step.cos());
    let number_of = |model: Model| {
        let parameters = model.parameters(&kolibri.machine, 0, &[]);
        parameters.map_or(0, |parameters| parameters.len())
    };
    let [twelve, many] = [number_of(Model::Twelve), number_of(Model::EightyOne)].map(unknowns);
    Ok(Chapter {
        title: "Strategies: counts and times",
        source: "section 5.8",
        how: "From the published lists of positions (Tables 4-1, 5-3 and 5-4), which are the strategies of the \
            examples, and the sets of [`trueaxis plan --set`](../src/planning-reference.md#position-sets).",
        compared: vec![
            Compared::plain("pairs of A and C, calibration", count(42), count(pairs))
                .from("Table 5-3"),
            Compared::plain("… validation", count(60), count(positions(&validation)))
                .from("Table 5-4"),
            Compared::plain(
                "… time for one ball, calibration",
                count(77),
                minutes(pairs),
            )
            .in_unit("min"),
            Compared::plain("… validation", count(110), minutes(validation.rows.len()))
                .in_unit("min"),
            Compared::plain(
                "positions of S, B and C",
                count(32),
                count(positions(&samba)),
            )
            .from("Table 4-1"),
            Compared::plain("… probings", count(123), count(samba.rows.len()))
                .from("section 4.6.1")
                .because(BALLS),
            Compared::plain(
                "unknowns, 12 errors and four balls",
                count(27),
                count(twelve),
            ),
            Compared::plain("… 81 coefficients", count(96), count(many)),
            Compared::plain(
                "condition, ten errors, calibration",
                count(206),
                condition(Strategy::KolibriCalibration, Parameters::Kolibri10)?,
            )
            .from("section 6.8")
            .because(CONDITION),
            Compared::plain(
                "… validation",
                count(216),
                condition(Strategy::KolibriValidation, Parameters::Kolibri10)?,
            )
            .from("section 6.8")
            .because(CONDITION),
            Compared::plain(
                "… twelve errors, calibration",
                count(200),
                condition(Strategy::KolibriCalibration, Parameters::Kolibri12)?,
            )
            .from("section 5.9.1")
            .because(CONDITION),
            Compared::plain(
                "… 81 coefficients, calibration",
                count(3900),
                condition(Strategy::KolibriCalibration, Parameters::Kolibri81)?,
            )
            .from("section 5.9.1")
            .because(CONDITION),
            Compared::plain(
                "positions of the ball-bar",
                count(19_809),
                count(hemisphere.path()?.len()),
            )
            .from("section 4.6.2")
            .because(APPROACH),
            Compared::plain(
                "… from the circle between two of them",
                Figure::new(0.000_14, 5),
                Figure::new(sagitta, 5),
            )
            .in_unit("µm")
            .from("section 4.6.2")
            .because(SAGITTA),
        ],
        tables: Vec::new(),
        fixed: Vec::new(),
        pictures: Vec::new(),
    })
}
