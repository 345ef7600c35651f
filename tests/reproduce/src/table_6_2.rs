//! Section 6.6: ten machines with one error each (Table 6-2), and their corrections (Figs. 6.6, 6.7).

use super::ball::Ball;
use super::embedded::{Example, Parameters, Strategy, kolibri};
use super::validated::{Corrector, Validation, both, built, poly25, trigo23};
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, Quantity, ReproduceError, Table};
use rayon::prelude::*;
use trueaxis_identify::simulate::Disturbances;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_report::picture::{Chart, Ink, Mark, Scale, Series};
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::schemes::poly25::Objective;

/// Table 6-2: the errors of the ten case studies, each alone (rad, mm, mm/mm).
pub const CASES: [(&str, f64); 10] = [
    ("EB0A", 0.4e-3),
    ("EC0A", 0.4e-3),
    ("EY0C", 10e-3),
    ("EA0C", 0.4e-3),
    ("EB0C", 0.4e-3),
    ("EC0X", 0.4e-3),
    ("EA0Z", 0.4e-3),
    ("EB0Z", 0.4e-3),
    ("EYY1", 0.04e-3),
    ("EZZ1", 0.04e-3),
];
/// The document's polynomials eliminate these completely (Fig. 6.6).
pub const LINEAR: [&str; 5] = ["EY0C", "EA0C", "EA0Z", "EYY1", "EZZ1"];
/// Number of points in the document's tables (section 6.5.3).
const PRINTED_POINTS: usize = 10;
/// Range of A (deg) where it was probed (section 6.7).
const PROBED: f64 = 55.0;

/// The corrections, in this order.
const SCHEMES: [&str; 7] = [
    "kinematic correction",
    "poly25, corrections",
    "trigo23",
    "trigo23:free",
    "exact, orientation",
    "exact, direction",
    "poly25, error",
];

fn alone(example: &Example, (name, value): (&str, f64)) -> ErrorModel {
    let mut errors = ErrorModel::perfect(&example.machine);
    if let Some(parameter) = Parameter::parse(name) {
        errors.set(&example.machine, parameter, value);
    }
    errors
}

/// Result of one case with one correction.
#[derive(Clone, Copy)]
struct Left {
    /// Mean and largest movement of the tip at the probings (µm).
    tip: [f64; 2],
}

struct OfCase {
    before: [f64; 2],
    left: Vec<Left>,
}

/// Tables are made for the `zone` in which A was probed.
fn probed(example: &Example, zone: &Example, case: (&str, f64)) -> Result<OfCase, ReproduceError> {
    let machine = &zone.machine;
    let errors = alone(example, case);
    let ten = example.errors(Parameters::Kolibri10)?;
    let validation = Validation::new(example, Strategy::KolibriValidation63, &ten)?;
    let mut found = OfCase {
        before: [0.0; 2],
        left: Vec::new(),
    };
    let mut add = |corrector: &Corrector<'_>| {
        let left = validation.left(&errors, corrector, &Disturbances::default(), &errors)?;
        let [before, after] = left.tip.map(|tip| tip.map(|mm| 1e3 * mm));
        found.before = before;
        found.left.push(Left { tip: after });
        Ok::<_, ReproduceError>(())
    };
    add(&Corrector::kinematic(machine, &errors))?;
    let printed = Some(PRINTED_POINTS);
    let [orientation, direction] = both();
    for (scheme, policy, points) in [
        (poly25(Objective::Corrections), orientation, printed),
        (trigo23(false), orientation, printed),
        (trigo23(true), orientation, printed),
        (Scheme::default(), orientation, None),
        (Scheme::default(), direction, None),
        (poly25(Objective::Error), orientation, printed),
    ] {
        let built = built(machine, &errors, scheme, policy, points)?;
        add(&Corrector::tables(&built)?)?;
    }
    Ok(found)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

const PLACE: &str = "0.4 mrad times the distance of the ball from the rotary axis, predicted with the ball that Table 5-5 \
    shows (see Chapter 5)";
const OBJECTIVE: &str = "Eq. 41 and section 6.6 make all volumetric errors least (error), Chapter 8 has the corrections \
    simulated by polynomials (corrections); here A within ±55°, C within ±360°. The document's pattern is that of the \
    second";
const PRINTED: &str = "the printed form has no term for the offset of a rotary axis (EY0C); without it the figure is \
    that of the next row";
const POINTS_TOO_FEW: &str =
    "ten points of ±55° miss a sine of twice the angle by 2.3 %: more points leave less";

pub fn chapter(balls: &[Ball; 2]) -> Result<Chapter, ReproduceError> {
    let example = kolibri()?.with_ball(balls[1].place).tip_at_z();
    let zone = kolibri()?.tip_at_z().within('A', PROBED);
    let cases = CASES.par_iter().map(|case| probed(&example, &zone, *case));
    let cases = cases.collect::<Result<Vec<OfCase>, ReproduceError>>()?;
    Ok(Chapter {
        title: "Chapter 6: Table 6-2, one error at a time",
        source: "Figure 6.7",
        how: "The Kolibri with one error of Table 6-2 at a time. It is probed with the 60 positions of the validation \
            (Table 6-3) while it is corrected, and the ten parameters are identified once more. Tables are \
            made for A within ±55°, with ten points and the tip in the frame of Z as in Eq. 44, policy *orientation* but where another is named.",
        compared: compared(&cases),
        tables: vec![at_probings(&cases)],
        fixed: fixed(&cases),
        pictures: vec![picture(&cases)],
    })
}

/// The ten cases together, and the one that Figure 6.6 shows.
fn compared(cases: &[OfCase]) -> Vec<Compared> {
    let of = |scheme: usize, which: usize, counts: &dyn Fn(&str) -> bool| {
        let counted = cases.iter().zip(CASES);
        let counted = counted.filter(|(_, (name, _))| counts(name));
        largest(counted.map(|(case, _)| case.left[scheme].tip[which]))
    };
    let exact = |which: usize, counts: &dyn Fn(&str) -> bool| {
        [4, 5].map(|scheme| Figure::new(of(scheme, which, counts), 3))
    };
    let all = |_: &str| true;
    let first = |name: &str| name == "EB0A";
    let no_offset = |name: &str| name != "EY0C";
    let um = |value: f64| Figure::new(value, 2);
    let before = |which: usize| largest(cases.iter().map(|case| case.before[which]));
    let poly25 = |what, document: f64, scheme: usize, which: usize| {
        Compared::numbers(what, [document, of(scheme, which, &first)], 2)
            .beside(exact(which, &first))
            .because(OBJECTIVE)
    };
    let trigo23 = |what, scheme: usize, counts: &dyn Fn(&str) -> bool| {
        let document = Figure::Words("< 1".to_owned());
        Compared::plain(what, document, um(of(scheme, 1, counts))).beside(exact(1, counts))
    };
    let initial = "largest of the ten, before: mean at the probings";
    let kinematic = "kinematic correction, largest of the ten: maximum";
    let rows = [
        Compared::numbers(initial, [35.0, before(0)], 2).because(PLACE),
        Compared::numbers("… maximum", [38.0, before(1)], 2).because(PLACE),
        Compared::numbers(kinematic, [0.0, of(0, 1, &all)], 2).beside(exact(1, &all)),
        poly25("poly25, corrections, EB0A: mean", 13.0, 1, 0),
        poly25("… maximum", 23.0, 1, 1),
        poly25("poly25, error, EB0A: mean", 13.0, 6, 0),
        poly25("… maximum", 23.0, 6, 1),
        trigo23("trigo23, largest of the ten: maximum", 2, &all).because(PRINTED),
        trigo23("… of the nine without EY0C", 2, &no_offset).because(POINTS_TOO_FEW),
        trigo23("trigo23:free, largest of the ten: maximum", 3, &all).because(POINTS_TOO_FEW),
    ];
    rows.map(|row| row.of(Quantity::Raw)).to_vec()
}

/// Mean at the probings, by error and correction.
fn at_probings(cases: &[OfCase]) -> Table {
    let rows = cases.iter().zip(CASES).map(|(case, (name, _))| {
        let left = case.left.iter().map(|left| Figure::new(left.tip[0], 3));
        let before = Figure::new(case.before[0], 2);
        (name.to_owned(), [before].into_iter().chain(left).collect())
    });
    Table {
        title: "tip at the probings, raw, mean (µm), Figure 6.7".to_owned(),
        of: "error",
        columns: ["before"]
            .into_iter()
            .chain(SCHEMES)
            .map(str::to_owned)
            .collect(),
        rows: rows.collect(),
    }
}

fn fixed(cases: &[OfCase]) -> Vec<Fixed> {
    let named = |name: &str| CASES.iter().position(|(n, _)| *n == name);
    let ratio = |name: &str| {
        let case = &cases[named(name).unwrap_or_default()];
        case.left[1].tip[0] / case.before[0]
    };
    let linear = largest(LINEAR.into_iter().map(ratio));
    let others = CASES.iter().map(|(name, _)| *name);
    let others = others.filter(|name| !LINEAR.contains(name)).map(ratio);
    let least = others.fold(f64::INFINITY, f64::min);
    let nine = cases
        .iter()
        .zip(CASES)
        .filter(|(_, (name, _))| *name != "EY0C");
    let nine = largest(nine.map(|(case, _)| case.left[2].tip[1]));
    vec![
        Fixed {
            statement: "trigo23 leaves less than 1 µm of every error but EY0C (Figure 6.7)"
                .to_owned(),
            found: format!("{nine:.2} µm at most"),
            holds: nine < 1.0,
        },
        Fixed {
            statement:
                "poly25, corrections compensates EA0C, EY0C, EA0Z, EYY1 and EZZ1 (Figure 6.6)"
                    .to_owned(),
            found: format!("at most {:.1} % of the mean is left", 100.0 * linear),
            // Ten points miss a sine over ±55° by 0.6 %, and a cubic polynomial a cosine by 0.4 %.
            holds: linear < 0.01,
        },
        Fixed {
            statement:
                "poly25, corrections leaves much of EB0A, EC0A, EB0C, EC0X and EB0Z (Figure 6.6)"
                    .to_owned(),
            found: format!("at least {:.0} % of the mean is left", 100.0 * least),
            holds: least > 0.1,
        },
    ]
}

fn picture(cases: &[OfCase]) -> Picture {
    let title = "Figure 6.7: the tip after one error at a time was compensated".to_owned();
    let points = |name: &str, ink, of: &dyn Fn(&OfCase) -> f64| Series {
        name: name.to_owned(),
        ink,
        mark: Mark::Points,
        points: (cases.iter().enumerate())
            .map(|(i, case)| [i as f64 + 1.0, of(case)])
            .collect(),
    };
    let series = vec![
        points("before", Ink::Before, &|case| case.before[0]),
        points("poly25, corrections", Ink::Other, &|case| {
            case.left[1].tip[0]
        }),
        points("trigo23", Ink::Accent, &|case| case.left[2].tip[0]),
        points("exact, orientation", Ink::After, &|case| {
            case.left[4].tip[0]
        }),
    ];
    let values = series.iter().flat_map(|s| s.points.iter().map(|p| p[1]));
    let drawn = Drawn::Chart(Chart {
        title: title.clone(),
        x: Scale::exact("case study of Table 6-2", [0.5, 10.5]),
        y: Scale::around("mean at the probings (µm)", values),
        shaded: Vec::new(),
        series,
    });
    Picture {
        name: "reproduced-6-7",
        title,
        drawn,
    }
}
