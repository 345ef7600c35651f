//! Whether claims hold on machines that have errors outside the model.

use nalgebra::Vector3;
use std::f64::consts::TAU;
use trueaxis_measure::formats::observations::Observations;
use trueaxis_measure::identify::{Identified, Options, automatic, held_out};
use trueaxis_model::errors::{ErrorModel, Parameter, Switches};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_tables::uncertainty::Uncertain;
use trueaxis_tests::probed::Case;
use trueaxis_tests::{Fixed, usual_or_all};

/// Amplitude of waves (mm), number of rows, positions at which the tip is compared.
const WAVE: f64 = 3e-3;
const ROWS: usize = 120;
const POSITIONS: usize = 200;

/// Adds a wave of one to three periods over the travel to each straightness of each linear axis.
fn add_waves(case: &mut Case, random: &mut Fixed) {
    for axis in 0..case.machine.axes.len() {
        let letter = case.machine.axes[axis].letter;
        if letter.is_rotary() {
            continue;
        }
        for component in (0..3).filter(|k| ['X', 'Y', 'Z'][*k] != letter.char()) {
            let (periods, phase) = (random.within(1.0, 3.0), random.within(0.0, TAU));
            case.add_wave((axis, component), WAVE, periods, phase);
        }
    }
}

/// The share of positions in the probed zone at which the tip is within its 95 % band, by the error file.
fn within(case: &Case, model: &str, is_stated: bool, seed: u64) -> f64 {
    let machine = &case.machine;
    let mut measured = case.noisy(seed);
    for row in &mut measured.rows {
        row.sigma = is_stated.then_some(1e-3);
    }
    let (none, options) = (Observations::default(), Options::default());
    let perfect = ErrorModel::perfect(machine);
    let found: Identified = match model {
        "auto" => {
            let chosen = automatic(machine, &measured, &case.artefact, &none, &perfect, options);
            chosen.unwrap().identified
        }
        model => case.found(model, &measured, options),
    };
    let seen: Vec<Parameter> = found.parameters.iter().map(|e| e.parameter).collect();
    let predicted = held_out(
        machine,
        &measured,
        &case.artefact,
        &none,
        &seen,
        &perfect,
        options,
    );
    let errors = case.written(&measured, &found, predicted.as_ref().ok());
    let known = errors.covariance();
    let uncertain = Uncertain::new(machine, &errors, &known);
    let [truth, found] = [&case.errors, &errors].map(|errors| Kinematics::new(machine, errors));
    let mut random = Fixed::new(seed);
    let apart: Vec<(Vector3<f64>, f64)> = (0..POSITIONS)
        .map(|_| {
            let mut q = [0.0; trueaxis_model::machine::MAX_AXES];
            for (q, [low, high]) in q.iter_mut().zip(errors.calibrated) {
                *q = random.within(low.min(high), low.max(high));
            }
            let situation = trueaxis_model::errors::Situation::default();
            let tip = |machine: &Kinematics<'_>| machine.actual(&q, &situation, &Switches::ALL).t;
            (
                tip(&truth) - tip(&found),
                uncertain.leaves(&q, &situation).tip_band(),
            )
        })
        .collect();
    // The zero of the workpiece is set on the part.
    let zero = apart.iter().map(|(off, _)| off).sum::<Vector3<f64>>() / POSITIONS as f64;
    let inside = apart
        .iter()
        .filter(|(off, band)| (off - zero).norm() <= *band);
    inside.count() as f64 / POSITIONS as f64
}

/// `None` if the balls drawn are out of reach.
fn drawn(number: usize, random: &mut Fixed) -> Option<Case> {
    let mut case = Case::of_model_12(number, ROWS, random)?;
    add_waves(&mut case, random);
    case.reached().map(|_| case)
}

#[test]
fn the_tip_is_within_its_band_in_the_probed_zone_whatever_the_model_lacks() {
    // Shares of single machines scatter by 0.1: their mean over 20 by 0.025, over 100 by 0.01. Both are two of these
    // below 95 %.
    let (count, least) = usual_or_all((20, 0.90), (100, 0.93));
    for (model, is_stated) in [("12", true), ("12", false), ("auto", true)] {
        let mut random = Fixed::new(49);
        let cases = (0..).filter_map(|number| Some((number, drawn(number, &mut random)?)));
        let shares = cases
            .take(count)
            .map(|(number, case)| within(&case, model, is_stated, number as u64 + 1));
        let mean = shares.sum::<f64>() / count as f64;
        eprintln!(
            "model {model}, noise stated: {is_stated}: {:.1} % within, {count} machines",
            100.0 * mean
        );
        assert!(mean >= least, "{model}, noise stated: {is_stated}: {mean}");
    }
}
