//! Section 6.8: the Kolibri calibrated with four balls and validated with one (Tables 6-4 to 6-7), with probings of the
//! document's uncertainty.

use super::embedded::{Example, Parameters, Strategy, kolibri};
use super::validated::{Corrector, Validation, both, built, poly25, trigo23};
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, ReproduceError, Table};
use trueaxis_measure::identify::{Compensated, Identified};
use trueaxis_measure::simulate::Disturbances;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_report::picture::{Chart, Ink, Mark, Scale, Series};
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::schemes::poly25::Objective;

/// Pooled standard deviations of three probings along X, Y and Z (mm), section 5.9.1.
const POOLED: [f64; 3] = [1.8e-3, 2.2e-3, 1.5e-3];
/// Number of points in a table (section 6.8).
const POINTS: usize = 100;
const PROBED: f64 = 55.0;
/// Seeds of the noise in each measurement.
const CALIBRATION: u64 = 1;
const BEFORE: u64 = 2;
const AFTER: u64 = 3;

/// Table 6-6 (%): K-B, 25Poly-T, 23Trigo-T.
const EFFECTIVENESS: [(&str, [f64; 3]); 10] = [
    ("EB0A", [89.0, 26.0, 89.0]),
    ("EC0A", [98.0, 76.0, 98.0]),
    ("EY0C", [99.0, 98.0, 98.0]),
    ("EA0C", [98.0, 98.0, 98.0]),
    ("EB0C", [90.0, 3.0, 88.0]),
    ("EC0X", [93.0, 38.0, 89.0]),
    ("EA0Z", [98.0, 90.0, 94.0]),
    ("EB0Z", [87.0, 27.0, 87.0]),
    ("EYY1", [94.0, 94.0, 94.0]),
    ("EZZ1", [93.0, 81.0, 91.0]),
];
/// Table 6-7 (µm): mean and maximum before, K-B, 25Poly-T, 23Trigo-T.
const NORMS: [[f64; 2]; 4] = [[62.1, 102.8], [3.2, 5.3], [23.3, 38.2], [4.1, 7.2]];
const NAMES: [&str; 6] = [
    "kinematic correction",
    "poly25, corrections",
    "trigo23",
    "exact, orientation",
    "exact, direction",
    "poly25, error",
];

fn noise(seed: u64) -> Disturbances {
    let mean = POOLED.map(|s| s * s).iter().sum::<f64>() / 3.0;
    Disturbances {
        noise: mean.sqrt(),
        seed,
        ..Disturbances::default()
    }
}

fn quiet(_: u64) -> Disturbances {
    Disturbances::default()
}

/// The validation of one machine.
struct Validated {
    before: Identified,
    left: Vec<Compensated>,
}

/// A machine with `actual` errors, corrected for the `known` ones. The document's tables are `fitted` over the range
/// probed in the calibration.
fn validated(
    [fitted, zone]: [&Example; 2],
    validation: &Validation<'_>,
    known: &ErrorModel,
    actual: &ErrorModel,
    noise: &dyn Fn(u64) -> Disturbances,
) -> Result<Validated, ReproduceError> {
    let machine = &zone.machine;
    let before = validation.identified(actual, &Corrector::Nothing, &noise(BEFORE))?;
    let mut left = Vec::new();
    let mut add = |corrector: &Corrector<'_>| {
        left.push(validation.left(actual, corrector, &noise(AFTER), &before.errors)?);
        Ok::<_, ReproduceError>(())
    };
    add(&Corrector::kinematic(machine, known))?;
    let [orientation, direction] = both();
    let fitted = &fitted.machine;
    for (machine, scheme, policy, points) in [
        (
            fitted,
            poly25(Objective::Corrections),
            orientation,
            Some(POINTS),
        ),
        (fitted, trigo23(false), orientation, Some(POINTS)),
        (machine, Scheme::default(), orientation, None),
        (machine, Scheme::default(), direction, None),
        (fitted, poly25(Objective::Error), orientation, Some(POINTS)),
    ] {
        let built = built(machine, known, scheme, policy, points)?;
        add(&Corrector::tables(&built)?)?;
    }
    Ok(Validated { before, left })
}

/// The ten parameters of Table 6-5: the twelve of Table 5-5 without backlash.
fn at_validation(example: &Example, ten: &ErrorModel) -> Result<ErrorModel, ReproduceError> {
    let twelve = example.errors(Parameters::Kolibri12AtValidation)?;
    let mut errors = ErrorModel::perfect(&example.machine);
    for parameter in ten.parameters.keys() {
        let value = twelve.parameters.get(parameter).copied();
        errors.set(&example.machine, *parameter, value.unwrap_or_default());
    }
    Ok(errors)
}

fn part(of: &Compensated, name: &str) -> Option<f64> {
    let parameter = Parameter::parse(name)?;
    let found = of.parameters.iter().find(|p| p.parameter == parameter)?;
    Some(100.0 * found.part()?[0])
}

fn percent(of: &Compensated, name: &str) -> Figure {
    part(of, name).map_or(Figure::Nothing, |part| Figure::new(part, 1))
}

const MOVED: &str = "the machine is taken to have moved from Table 6-4 to Table 6-5 between calibration and validation, as \
    the document found; it must have moved less, for EB0A, 1.09 and 1.29 mrad there, allows no more than 84 %";
const PLACE: &str = "where the ball stood and which of its errors the model does not have is not published; the document \
    itself has 62.1 µm here and 125 µm in Table 5-6, of the same probings";
const OBJECTIVE: &str = "Eq. 41 and section 6.6 make all volumetric errors least (error), Chapter 8 has the corrections \
    simulated by polynomials (corrections). By the first, polynomials compensate far more than the document says, so \
    its tables were hardly made with it; the second has the pattern of its figures. The same data is in Table 5-7";
const OFFSET: &str = "the printed form (Eq. 44) has no term for the offset of a rotary axis; the document's table has 98 % \
    all the same. `trigo23:free` has it, see Table 6-2";

pub fn chapter() -> Result<Chapter, ReproduceError> {
    let example = kolibri()?.tip_at_z();
    let zone = kolibri()?.tip_at_z().within('A', PROBED);
    let ten = example.errors(Parameters::Kolibri10)?;
    let later = at_validation(&example, &ten)?;
    let calibration = Validation::new(&example, Strategy::KolibriCalibration63, &ten)?;
    let validation = Validation::new(&example, Strategy::KolibriValidation63, &ten)?;
    let calibrated = calibration.identified(&ten, &Corrector::Nothing, &noise(CALIBRATION))?;
    let known = &calibrated.errors;
    let probed = calibration.probed(&ten, &Corrector::Nothing, &quiet(CALIBRATION))?;
    let fitted = kolibri()?.tip_at_z().within_probed(&probed);
    let zones = [&fitted, &zone];
    let moved = validated(zones, &validation, known, &later, &noise)?;
    let still = validated(zones, &validation, known, &ten, &noise)?;
    let alone = validated([&zone, &zone], &validation, &ten, &ten, &quiet)?;

    let um = |value: f64| Figure::new(value, 1);
    let tip = |of: &Compensated, which: usize| um(1e3 * of.tip[1][which]);
    let before = |of: &Validated, which: usize| um(1e3 * of.left[0].tip[0][which]);
    let mut compared = Vec::new();
    for (which, what) in [(0, "mean"), (1, "maximum")] {
        compared.push(
            Compared::plain(
                format!("tip, {what}: before"),
                um(NORMS[0][which]),
                before(&moved, which),
            )
            .in_unit("µm")
            .because(PLACE),
        );
        for (scheme, document) in [(0, 1), (1, 2), (5, 2), (2, 3)] {
            compared.push(
                Compared::plain(
                    format!("… {}", NAMES[scheme]),
                    um(NORMS[document][which]),
                    tip(&moved.left[scheme], which),
                )
                .in_unit("µm")
                .beside([3, 4].map(|exact| tip(&moved.left[exact], which)))
                .because(match scheme {
                    0 => MOVED,
                    1 | 5 => OBJECTIVE,
                    _ => OFFSET,
                }),
            );
        }
    }
    for (name, document) in EFFECTIVENESS {
        for (scheme, document) in [
            (0, document[0]),
            (1, document[1]),
            (5, document[1]),
            (2, document[2]),
        ] {
            let what = match scheme {
                0 => format!("compensability of {name}: {}", NAMES[0]),
                _ => format!("… {}", NAMES[scheme]),
            };
            compared.push(
                Compared::plain(
                    what,
                    Figure::new(document, 0),
                    percent(&moved.left[scheme], name),
                )
                .in_unit("%")
                .beside([3, 4].map(|exact| percent(&moved.left[exact], name)))
                .because(match (scheme, name) {
                    (1 | 5, _) => OBJECTIVE,
                    (2, "EY0C") => OFFSET,
                    _ => MOVED,
                }),
            );
        }
    }
    // Small parameters are not known well enough for a statement, and the offset has no term in Eq. 44.
    let small = ["EB0C", "EB0Z", "EC0X", "EA0C", "EZZ1", "EY0C"];
    let least = (EFFECTIVENESS.iter())
        .filter(|(name, _)| !small.contains(name))
        .filter_map(|(name, _)| part(&still.left[2], name))
        .fold(f64::INFINITY, f64::min);
    Ok(Chapter {
        title: "Tables 6-6 and 6-7: calibrated and validated, with noise",
        how: "The Kolibri with the parameters of Table 6-4 is calibrated with 168 probings of four balls (Table 6-3), with \
            1.85 µm of noise in each coordinate, which is what the document pooled (1.8, 2.2 and 1.5 µm). Tables are made \
            of what is identified. Then one ball is probed 60 times, with the same noise, on a machine that has moved to \
            the parameters of Table 6-5, before and with each compensation. Tables of 100 points over the range of every axis that the calibration covers, `exact` over the travel with A within \
            ±55°, the tip in the frame of Z as in Eq. 44.",
        compared,
        tables: vec![
            identified(&calibrated, &moved.before, &ten, &later),
            table(
                &still,
                "the same on a machine that stays as it was calibrated: nothing but noise",
            ),
            table(
                &alone,
                "without noise, on a machine with the ten parameters of Table 6-4; A within ±55°, the whole travel of the others",
            ),
        ],
        arithmetic: vec![Fixed {
            statement: "trigo23: 102.8 to 7.2 µm is a reduction by 93 % (section 6.9 prints 92 %)"
                .to_owned(),
            found: format!("{:.1} %", 100.0 * (1.0 - 7.2 / 102.8)),
            // To a whole per cent, as printed.
            holds: (100.0 * (1.0 - 7.2 / 102.8_f64) - 93.0).abs() < 0.5,
        }],
        fixed: vec![Fixed {
            statement: "on a machine that stays, trigo23 compensates EB0A, EC0A, EA0Z and EYY1 by more than 87 % \
                (Table 6-6)"
                .to_owned(),
            found: format!("by at least {least:.0} %"),
            holds: least > 87.0,
        }],
        pictures: vec![picture(&moved)],
    })
}

fn unit(parameter: Parameter) -> f64 {
    // µm, µrad, µm/m.
    match parameter.to_string().as_str() {
        "EY0C" => 1e3,
        _ => 1e6,
    }
}

fn identified(
    calibrated: &Identified,
    before: &Identified,
    ten: &ErrorModel,
    later: &ErrorModel,
) -> Table {
    let found = |of: &Identified, parameter: Parameter| {
        let one = of.parameters.iter().find(|e| e.parameter == parameter);
        one.map_or([Figure::Nothing, Figure::Nothing], |e| {
            [e.value, e.uncertainty].map(|v| Figure::new(v * unit(parameter), 1))
        })
    };
    let names = EFFECTIVENESS
        .iter()
        .filter_map(|(name, _)| Parameter::parse(name));
    let rows = names.map(|p| {
        let value = |of: &ErrorModel| {
            let value = of.parameters.get(&p).copied().unwrap_or_default();
            Figure::new(value * unit(p), 1)
        };
        let [a, ua] = found(calibrated, p);
        let [b, ub] = found(before, p);
        (p.to_string(), vec![value(ten), a, ua, value(later), b, ub])
    });
    Table {
        title: "Tables 6-4 and 6-5: what is identified with noise (µm, µrad, µm/m)".to_owned(),
        of: "parameter",
        columns: [
            "Table 6-4",
            "identified",
            "standard",
            "Table 6-5",
            "identified",
            "standard",
        ]
        .iter()
        .enumerate()
        .map(|(i, name)| match i {
            1 | 2 => format!("{name}, calibration"),
            4 | 5 => format!("{name}, validation"),
            _ => (*name).to_owned(),
        })
        .collect(),
        rows: rows.collect(),
    }
}

fn table(still: &Validated, title: &str) -> Table {
    let mut rows: Vec<(String, Vec<Figure>)> = (EFFECTIVENESS.iter())
        .map(|(name, _)| {
            let figures = still.left.iter().map(|of| percent(of, name));
            (format!("{name} (%)"), figures.collect())
        })
        .collect();
    for (which, what) in [(0, "tip, mean (µm)"), (1, "tip, maximum (µm)")] {
        let figures = still
            .left
            .iter()
            .map(|of| Figure::new(1e3 * of.tip[1][which], 2));
        rows.push((what.to_owned(), figures.collect()));
    }
    Table {
        title: title.to_owned(),
        of: "what",
        columns: NAMES.map(str::to_owned).to_vec(),
        rows,
    }
}

fn picture(moved: &Validated) -> Picture {
    let title =
        "Table 6-6: compensability of the ten parameters; −20 % and less at the bottom".to_owned();
    let of = |name: &str, ink, scheme: usize| Series {
        name: name.to_owned(),
        ink,
        mark: Mark::Points,
        points: (EFFECTIVENESS.iter().enumerate())
            .filter_map(|(i, (name, _))| Some([i as f64 + 1.0, part(&moved.left[scheme], name)?]))
            // Results worse than before are drawn at the lower end.
            .map(|[x, y]| [x, y.max(-20.0)])
            .collect(),
    };
    let series = vec![
        of("poly25, corrections", Ink::Other, 1),
        of("trigo23", Ink::Accent, 2),
        of("exact, orientation", Ink::After, 3),
    ];
    Picture {
        name: "reproduced-6-6",
        drawn: Drawn::Chart(Chart {
            title: title.clone(),
            x: Scale::exact("parameter, in the order of Table 6-4", [0.5, 10.5]),
            y: Scale::exact("compensability (%)", [-22.0, 102.0]),
            shaded: Vec::new(),
            series,
        }),
        title,
    }
}
