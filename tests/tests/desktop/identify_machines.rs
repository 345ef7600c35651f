//! Identification on every machine, with repetitions.

use trueaxis_identify::formats::observations::Observations;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_identify::{
    Identified, IdentifyError, IdentifyOptions, Model, NotKnown, Problem, Trial, error_file,
    identify, monte_carlo,
};
use trueaxis_model::errors::covariance;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::machine::Machine;
use trueaxis_tests::probed::{Case, worst};
use trueaxis_tests::{Fixed, errors, machine, random_machines, usual_or_all};

/// Machines in examples/, with errors.
const EXAMPLES: [(&str, &str); 9] = [
    ("five-axis-30", "errors-30.toml"),
    ("fork-head", "errors-13.toml"),
    ("hu40", "errors-84.toml"),
    ("huron-k2x8", "errors-13.toml"),
    ("kolibri", "errors-81.toml"),
    ("linuxcnc-xyzac-trt", "errors-11.toml"),
    ("mill-21", "errors-21.toml"),
    ("router", "errors-10.toml"),
    ("table-head", "errors-13.toml"),
];

/// Identifies from probings without noise; `None` if a ball cannot be reached.
fn found(case: &Case, parameters: &[Parameter]) -> Option<Result<Identified, IdentifyError>> {
    let measured = case.reached()?;
    let perfect = ErrorModel::perfect(&case.machine);
    let (machine, artefact) = (&case.machine, &case.artefact);
    let problem = Problem::new(machine, &measured, artefact, parameters, &perfect);
    Some(identify(&problem, IdentifyOptions::default()))
}

/// Like `found`, with a machine that has only errors identifiable from these probings: other parameters are removed until
/// none is left.
fn seen_alone(
    mut case: Case,
    mut parameters: Vec<Parameter>,
) -> Option<Result<Identified, IdentifyError>> {
    loop {
        let identified = match found(&case, &parameters)? {
            Ok(identified) if identified.parameters.len() < parameters.len() => identified,
            other => return Some(other),
        };
        parameters = identified.parameters.iter().map(|e| e.parameter).collect();
        case = case.only(&parameters);
    }
}

/// Number of rows.
const ROWS: usize = 120;

#[test]
fn without_noise_every_model_comes_back_on_every_example() {
    let (mut tried, mut blind) = (Vec::new(), Vec::new());
    let mut random = Fixed::new(7);
    for (folder, own) in EXAMPLES {
        let machine = machine(&format!("examples/{folder}/machine.toml"));
        let own = errors(&format!("examples/{folder}/{own}"), &machine);
        let own: Vec<Parameter> = own.parameters.keys().copied().collect();
        let models = [
            Model::Ten,
            Model::Twelve,
            Model::Thirteen,
            Model::EightyOne,
            Model::EightyFour,
        ];
        let lists = models.map(|model| {
            let parameters = model.parameters(&machine, 0, &[]).ok()?;
            Some((model.to_string(), parameters))
        });
        // The thirty motions of one example are tabulated.
        let own = Some(("own".to_owned(), own)).filter(|(_, own)| !own.is_empty());
        for (model, parameters) in lists.into_iter().chain([own]).flatten() {
            let case = Case::drawn(&machine, &parameters, ROWS, &mut random);
            match case.and_then(|case| found(&case, &parameters)) {
                Some(Ok(identified)) => {
                    let left = worst(&identified);
                    // 0.001 µm.
                    assert!(left < 1e-6, "{folder} {model}: {left}");
                    let seen = identified.parameters.len();
                    tried.push(format!("{folder} {model}: {seen} of {}", parameters.len()));
                }
                Some(Err(IdentifyError::NothingSeen)) => blind.push(folder),
                other => panic!("{folder} {model}: {other:?}"),
            }
        }
    }
    println!("{tried:#?}");
    // Balls reveal nothing on a machine without rotary axes: each is in one place.
    assert_eq!(blind, ["mill-21", "router"]);
    assert_eq!(tried.len(), 31);
}

#[test]
fn without_noise_errors_come_back_on_a_hundred_random_machines() {
    let (mut seen, mut not_reached, mut blind) = (0, 0, Vec::new());
    for seed in 0.. {
        let Some(case) = random_machines::case(seed) else {
            continue;
        };
        let rotary = case.machine.axes.iter().filter(|a| a.letter.is_rotary());
        if rotary.count() == 0 {
            continue;
        }
        let mut random = Fixed::new(seed);
        let all = Model::Auto.parameters(&case.machine, 1, &[]).unwrap();
        let Some(case) = Case::drawn(&case.machine, &all, ROWS, &mut random) else {
            not_reached += 1;
            continue;
        };
        match seen_alone(case, all) {
            None => not_reached += 1,
            Some(Ok(identified)) => {
                let left = worst(&identified);
                assert!(left < 1e-6, "seed {seed}: {left}");
                seen += 1;
            }
            Some(Err(error)) => blind.push(format!("{seed}: {error}")),
        }
        if seen == 100 {
            break;
        }
    }
    println!("{not_reached} out of reach, blind: {blind:#?}");
    // Balls in the middle of the travel cannot be reached in enough positions; or parameters are almost
    // indistinguishable, so that the iteration does not end.
    assert!(
        not_reached <= 15 && blind.len() <= 3,
        "{not_reached} {blind:#?}"
    );
}

/// A machine with two rotary axes in a table on two linear ones (`wCBXYFZ`, or with X and Y exchanged), at random
/// places.
fn table_on_two_slides(random: &mut Fixed) -> Machine {
    let mut place = |size: f64| [(); 3].map(|()| random.within(-size, size));
    let [b, c, tip] = [place(200.0), place(200.0), place(150.0)];
    let half = 60.0 + place(40.0)[0];
    let slides = if place(1.0)[0] > 0.0 {
        ["Y", "X"]
    } else {
        ["X", "Y"]
    };
    let linear = |name: &str, branch: &str| {
        format!("[[axis]]\nname = \"{name}\"\nbranch = \"{branch}\"\nrange = [-900.0, 900.0]\n")
    };
    let text = format!(
        "name = \"drawn\"\n{}{}\
         [[axis]]\nname = \"B\"\nbranch = \"workpiece\"\norigin_mm = {b:?}\nrange = [-{half}, {half}]\n\
         [[axis]]\nname = \"C\"\nbranch = \"workpiece\"\norigin_mm = {c:?}\nrange = [-180.0, 180.0]\n\
         {}[spindle]\naxis = \"z\"\n[tool]\ntip_mm = {tip:?}\n",
        linear(slides[0], "workpiece"),
        linear(slides[1], "workpiece"),
        linear("Z", "tool"),
    );
    Machine::from_toml(&text).expect("a machine")
}

#[test]
fn what_is_not_seen_does_not_depend_on_noise() {
    let mut random = Fixed::new(33);
    for drawn in 0..usual_or_all(8, 24) {
        let machine = table_on_two_slides(&mut random);
        // Every location and scale has an error, whether a model includes it or not.
        let all = Model::Auto.parameters(&machine, 0, &[]).unwrap();
        let case = Case::drawn(&machine, &all, 60, &mut random).expect("balls in reach");
        for model in [Model::Ten, Model::Twelve, Model::Thirteen, Model::Auto] {
            let parameters = model.parameters(&machine, 1, &[false; 5]).unwrap();
            let mut first = None;
            for noise in [0.0, 1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2] {
                let measured = case.measured(&Disturbances {
                    noise,
                    seed: drawn,
                    ..Disturbances::default()
                });
                let perfect = ErrorModel::perfect(&machine);
                let problem =
                    Problem::new(&machine, &measured, &case.artefact, &parameters, &perfect);
                let found = identify(&problem, IdentifyOptions::default());
                let found = found.unwrap_or_else(|e| panic!("{drawn} {model} {noise}: {e}"));
                let unseen: Vec<String> = found.unseen.iter().map(|u| u.sentence()).collect();
                assert_eq!(
                    *first.get_or_insert_with(|| unseen.clone()),
                    unseen,
                    "{drawn} {model} {noise}"
                );
                // The written file can be read.
                let none = Observations::default();
                let file = error_file(
                    &machine,
                    &measured,
                    &none,
                    &found,
                    &NotKnown::default(),
                    "covariance.csv",
                );
                let covariance = covariance::write(&found.known);
                let read =
                    ErrorModel::with_files(&file, &machine, &|_: &str| Ok(covariance.clone()));
                assert!(read.is_ok(), "{drawn} {model} {noise}: {:?}", read.err());
            }
        }
    }
}

#[test]
fn uncertainties_and_bands_are_what_noise_does() {
    for (folder, errors, model, count) in [
        ("kolibri", "errors-10.toml", "10", 10),
        // With a bar known to 0.6 µm, and an indexed spindle.
        ("hu40", "errors-13.toml", "13", 13),
        ("kolibri", "errors-81.toml", "81", 79),
    ] {
        let case = Case::new(folder, errors);
        let model: Model = model.parse().unwrap();
        let trial = Trial {
            machine: &case.machine,
            errors: &case.errors,
            artefact: &case.artefact,
            plan: &case.plan,
            model: &model,
            noise: 1e-3,
        };
        let seeds = 200;
        let found = monte_carlo(&trial, seeds, &|| {}).unwrap();
        assert_eq!(found.parameters.len(), count);
        assert_eq!(found.positions, 100 * seeds);
        for p in &found.parameters {
            // The standard deviation of 200 draws is known to 5 %, a mean to 7 %: four and a half times that, which
            // chance exceeds once in 150 000.
            assert!((0.775..1.225).contains(&p.deviation), "{p:?}");
            assert!(p.mean.abs() < 0.32, "{p:?}");
        }
        // Errors of one identification at 100 positions are correlated: as if 200 to 2000 positions were drawn, with a
        // standard deviation of the fraction of at most 1.5 %.
        for inside in [found.tips_inside, found.directions_inside] {
            let part = inside as f64 / found.positions as f64;
            assert!((0.91..0.99).contains(&part), "{part}");
        }
        // 58 000 coordinates and more: 0.3 %.
        assert!((found.noise - 1e-3).abs() < 1e-5, "{}", found.noise);
    }
}

#[test]
fn one_factorisation_serves_as_well_as_one_for_each() {
    let case = Case::new("kolibri", "errors-10.toml");
    let mut squares = [0.0; 10];
    let seeds = 40;
    for seed in 1..=seeds {
        let identified = case.found("10", &case.noisy(seed), IdentifyOptions::default());
        for (square, e) in squares.iter_mut().zip(&identified.parameters) {
            *square += ((e.value - case.truth(e.parameter)) / e.uncertainty).powi(2);
        }
    }
    let trial = Trial {
        machine: &case.machine,
        errors: &case.errors,
        artefact: &case.artefact,
        plan: &case.plan,
        model: &Model::Ten,
        noise: 1e-3,
    };
    let found = monte_carlo(&trial, seeds as usize, &|| {}).unwrap();
    for (square, p) in squares.iter().zip(&found.parameters) {
        let count = seeds as f64;
        let own = p.deviation.powi(2) * (count - 1.0) + count * p.mean.powi(2);
        // The same noise: derivatives change by at most the size of the errors, 1e-3.
        assert!(
            (own / square - 1.0).abs() < 5e-3,
            "{}: {own} {square}",
            p.parameter
        );
    }
}
