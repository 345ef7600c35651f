//! Every example that has a plan finds its own errors again.

use nalgebra::DVector;
use std::fs;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_identify::{Identified, IdentifyOptions, Problem, identify};
use trueaxis_model::errors::{ErrorModel, Parameter, ParameterKind};
use trueaxis_tests::probed::Case;

/// The error files of the examples that have a plan, each with its machine, artefact and plan.
fn examples() -> Vec<(String, Case)> {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples");
    let entries = |path: &str| -> Vec<String> {
        let names = fs::read_dir(path).unwrap();
        let mut names: Vec<String> = names
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    let mut all = Vec::new();
    for folder in entries(root) {
        let path = format!("{root}/{folder}");
        if !fs::exists(format!("{path}/plan.csv")).unwrap() {
            continue;
        }
        for errors in entries(&path) {
            if errors.starts_with("errors-") {
                all.push((format!("{folder}/{errors}"), Case::new(&folder, &errors)));
            }
        }
    }
    all
}

/// The parameters of an example: all but backlash, because the plans do not say from which side the axes came.
fn parameters(case: &Case) -> Vec<Parameter> {
    let all = case.errors.parameters.keys().copied();
    all.filter(|p| p.kind != ParameterKind::Backlash).collect()
}

fn micrometre(seed: u64) -> Disturbances {
    Disturbances {
        noise: 1e-3,
        seed,
        ..Disturbances::default()
    }
}

fn found(case: &Case, disturbances: &Disturbances) -> Identified {
    let measured = case.measured(disturbances);
    let perfect = ErrorModel::perfect(&case.machine);
    let parameters = parameters(case);
    let (machine, artefact) = (&case.machine, &case.artefact);
    let problem = Problem::new(machine, &measured, artefact, &parameters, &perfect);
    identify(&problem, IdentifyOptions::default()).unwrap()
}

#[test]
fn without_noise_every_example_finds_its_own_errors() {
    let examples = examples();
    for (name, case) in &examples {
        let found = found(case, &Disturbances::default());
        assert_eq!(found.parameters.len(), parameters(case).len(), "{name}");
        // What a micrometre of noise would do to each.
        let noisy = self::found(case, &micrometre(1));
        let mut worst = (0.0, String::new());
        for (e, noisy) in found.parameters.iter().zip(&noisy.parameters) {
            let truth = case.truth(e.parameter);
            // Relative; and a millionth of a micrometre, because the solution ends with steps of 1e-9 mm.
            let most = 1e-9 * truth.abs() + 1e-6 * noisy.uncertainty;
            let off = (e.value - truth).abs() / most;
            if off > worst.0 {
                worst = (off, e.parameter.to_string());
            }
        }
        println!(
            "{name}: {worst:?} of what is allowed, condition {}",
            found.condition
        );
        assert!(worst.0 < 1.0, "{name}: {worst:?}");
    }
    assert!(examples.len() >= 6, "{}", examples.len());
}

/// Probability of a failure by chance, with other seeds, of each of the three judgements below.
const LEVEL: f64 = 1e-3;

/// Probability that a normally distributed value is at least this many standard deviations off, on either side.
fn beyond(deviations: f64) -> f64 {
    libm::erfc(deviations.abs() / std::f64::consts::SQRT_2)
}

/// Probability of a sum of squares as far from its mean, on either side, with these degrees of freedom (Wilson and
/// Hilferty: the cube root of χ² over its degrees of freedom is normally distributed).
fn of_squares(sum: f64, freedom: f64) -> f64 {
    let part = 2.0 / (9.0 * freedom);
    beyond(((sum / freedom).cbrt() - (1.0 - part)) / part.sqrt())
}

#[test]
fn with_a_micrometre_of_noise_every_example_is_within_its_uncertainty() {
    let mut singly: Vec<(f64, String)> = Vec::new();
    let mut jointly: Vec<(f64, String)> = Vec::new();
    let mut noises: Vec<(f64, String)> = Vec::new();
    for (name, case) in &examples() {
        for seed in 1..=5 {
            let disturbances = micrometre(seed);
            let found = found(case, &disturbances);
            // With the noise that was simulated in the place of the estimated one, which is judged by itself: then
            // deviations are normally distributed, and their sum of squares is χ².
            let scale = found.noise / disturbances.noise;
            let off = found
                .parameters
                .iter()
                .map(|e| e.value - case.truth(e.parameter));
            let off = DVector::from_iterator(found.parameters.len(), off);
            for (e, off) in found.parameters.iter().zip(&off) {
                let place = format!("{name}, seed {seed}: {}", e.parameter);
                singly.push((beyond(off / e.uncertainty * scale), place));
            }
            let factor = found
                .covariance
                .clone()
                .cholesky()
                .expect("positive definite");
            let squares = off.dot(&factor.solve(&off)) * scale.powi(2);
            let place =
                |squares: f64, freedom: f64| format!("{name}, seed {seed}: {squares} of {freedom}");
            let freedom = off.len() as f64;
            jointly.push((of_squares(squares, freedom), place(squares, freedom)));
            let freedom = found.freedom as f64;
            let squares = freedom * scale.powi(2);
            noises.push((of_squares(squares, freedom), place(squares, freedom)));
        }
    }
    // Bonferroni: of n judgements, none is less probable than a part of the level, 1/n.
    for all in [singly, jointly, noises] {
        let least = all
            .iter()
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .expect("judgements");
        println!("{least:?} is the least probable of {}", all.len());
        assert!(least.0 > LEVEL / all.len() as f64, "{least:?}");
    }
}
