//! Section 7.4: the tables of the closed form, and their effect on the Huron (Table 7-2, the 79 %).

use super::embedded::{Example, Parameters, huron};
use super::validated::{both, built, fik};
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, Quantity, ReproduceError};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::numbers::normal;
use trueaxis_model::validate::{Command, Region, Runtime, Statistics, random_commands};
use trueaxis_report::picture::{Bars, ChartBar, Ink};
use trueaxis_tables::compile::Built;
use trueaxis_tables::schemes::Scheme;

const RANDOM: usize = 2000;
const SEED: u64 = 7;
/// Number of machines drawn, and number of positions on each.
const MACHINES: u64 = 200;
const POSITIONS: usize = 200;

/// Number of tables of each output (section 7.4.1).
const COUNTS: [(char, usize); 5] = [('X', 13), ('Y', 11), ('Z', 14), ('A', 1), ('C', 1)];
/// Table 7-2: mean volumetric error due to each parameter before and after (µm).
const EFFECTS: [(&str, [f64; 2]); 13] = [
    ("EZ0S", [55.6, 7.3]),
    ("EA0Z", [17.2, 1.8]),
    ("EZZ1", [11.3, 1.8]),
    ("EB0A", [8.6, 1.7]),
    ("EA0C", [7.9, 4.7]),
    ("EC0X", [3.7, 2.3]),
    ("EB0Z", [3.6, 6.3]),
    ("EB0C", [3.5, 3.0]),
    ("EXX1", [3.0, 0.3]),
    ("EX0S", [2.1, 11.0]),
    ("EYY1", [1.8, 0.3]),
    ("EC0A", [1.2, 2.0]),
    ("EY0C", [1.0, 3.9]),
];

/// Parameters whose effects show the zone.
const FITTED: [&str; 4] = ["EXX1", "EYY1", "EZZ1", "EA0Z"];

/// Mean movement of the tip due to errors at commands (µm), with or without tables.
fn mean(
    example: &Example,
    errors: &ErrorModel,
    commands: &[Command],
    runtime: Option<&Runtime<'_>>,
) -> f64 {
    let machine = &example.machine;
    let kinematics = Kinematics::new(machine, errors);
    let left = commands.iter().map(|command| {
        let (q, situation) = command.kinematic(machine);
        let correction =
            runtime.map(|runtime| machine.to_kinematic(&runtime.evaluate(command).map(f64::from)));
        let correction = correction.unwrap_or_default();
        1e3 * kinematics
            .volumetric_error(&q, &correction, &situation)
            .t
            .norm()
    });
    Statistics::of(left).mean
}

fn alone(example: &Example, errors: &ErrorModel, name: &str) -> ErrorModel {
    let mut one = ErrorModel::perfect(&example.machine);
    if let Some(parameter) = Parameter::parse(name) {
        let value = errors.parameters.get(&parameter).copied();
        one.set(&example.machine, parameter, value.unwrap_or_default());
    }
    one
}

/// A machine whose parameters deviate from the known ones by their standard uncertainties: half of the U stated in
/// Table 7-2.
fn drawn(example: &Example, known: &ErrorModel, seed: u64) -> ErrorModel {
    let mut random = Pcg64Mcg::seed_from_u64(SEED ^ (seed << 8));
    let mut machine = ErrorModel::perfect(&example.machine);
    for (parameter, value) in &known.parameters {
        let stated = known.standard_uncertainty.get(parameter).copied();
        let off = stated.unwrap_or_default() * normal(&mut random);
        machine.set(&example.machine, *parameter, value + off);
    }
    machine
}

/// Travels (mm) of the tables in Figure 7.3.
const TRAVELS: [(char, f64); 3] = [('X', 650.0), ('Y', 700.0), ('Z', 450.0)];

/// Where the Huron was probed, inferred from the effects before compensation of four parameters of Table 7-2 and the
/// travels of Figure 7.3.
struct Zone {
    /// Middle of Z in the frame of Eq. 59 (mm).
    height: f64,
    /// Half of the range of X, Y and Z (mm).
    halves: [f64; 3],
    /// Part of the travels that these are.
    part: f64,
    /// Length of the tool (mm).
    tool: f64,
}

impl Zone {
    fn inferred(errors: &ErrorModel) -> Self {
        // The mean lever is the effect of a parameter over its value.
        let lever = |name: &str| {
            let printed = EFFECTS.iter().find(|(n, _)| *n == name);
            let value = Parameter::parse(name).and_then(|p| errors.parameters.get(&p));
            let of = |(_, [before, _]): &(&str, [f64; 2])| 1e-3 * before;
            printed.map_or(f64::NAN, of) / value.copied().unwrap_or(f64::NAN).abs()
        };
        let [x, y, height, above] = FITTED.map(lever);
        // Positions scatter evenly around the middle of X and Y: the mean distance from there is half of the largest.
        let [x, y] = [2.0 * x, 2.0 * y];
        let [of_x, of_y, of_z] = TRAVELS.map(|(_, travel)| travel);
        let part = x / of_x + y / of_y;
        Self {
            height,
            halves: [x, y, 0.5 * part * of_z],
            part,
            // EA0Z has the lever Z − t, which is positive everywhere.
            tool: height - above,
        }
    }

    fn of(&self, example: Example) -> Example {
        let [x, y, z] = self.halves;
        let zone = [
            ('X', [-x, x]),
            ('Y', [-y, y]),
            ('Z', [self.height - z, self.height + z]),
        ];
        example.with_zone(&zone, self.tool)
    }
}

const INFERRED: &str = "from these four the zone was inferred: X, Y and Z − t are evenly spread, X and Y around the rotary axes. X and Y reach over the same part of the travels of Figure 7.3, which Z was given, too";
const PREDICTED: &str = "2000 random positions of the zone, where the document has 10";
const OFFSETS: &str = "the same for every place: an offset of the spindle or of an axis moves the tip by as much as it is";
const AFTER: &str =
    "predicted by the parameters of Table 7-2 with the document's tables on, in the same zone";
const DRAWN: &str = "the closed form itself leaves 0.01 µm: what the document left is the machine, whose parameters had changed. By half of the U that Table 7-2 states for them alone so much would be left, in the mean of 200 machines (EX0S is -11.0 µm after and -2.1 before, where 4.9 are stated)";

/// The machine in its zone with the errors before and after, and its tables.
struct HuronInZone {
    example: Example,
    before: ErrorModel,
    after: ErrorModel,
    commands: Vec<Command>,
    /// `fik`, and `exact` under *orientation* and *direction*.
    built: [Built; 3],
}

impl HuronInZone {
    fn new(zone: &Zone) -> Result<Self, ReproduceError> {
        let example = zone.of(huron()?);
        let machine = &example.machine;
        let before = example.errors(Parameters::Huron13)?;
        let perfect = ErrorModel::perfect(machine);
        let kinematics = Kinematics::new(machine, &perfect);
        let [orientation, direction] = both();
        let exact = |policy| built(machine, &before, Scheme::default(), policy, None);
        Ok(Self {
            commands: random_commands(&kinematics, Region::Travel, RANDOM, SEED)?,
            built: [
                built(machine, &before, fik(), orientation, None)?,
                exact(orientation)?,
                exact(direction)?,
            ],
            after: example.errors(Parameters::Huron13After)?,
            before,
            example,
        })
    }

    /// Mean error (µm) without tables.
    fn mean(&self, errors: &ErrorModel) -> f64 {
        mean(&self.example, errors, &self.commands, None)
    }

    /// Mean errors (µm) before and after by each parameter.
    fn effects(&self) -> Vec<(&'static str, [f64; 2])> {
        let alone = |errors, name| self.mean(&alone(&self.example, errors, name));
        let of = |name| [&self.before, &self.after].map(|errors| alone(errors, name));
        EFFECTS.iter().map(|(name, _)| (*name, of(name))).collect()
    }

    /// Mean error (µm) that tables leave of the machine that they know.
    fn left_by(&self, built: &Built) -> Result<f64, ReproduceError> {
        let runtime = Runtime::load(&built.blob)?;
        Ok(mean(
            &self.example,
            &self.before,
            &self.commands,
            Some(&runtime),
        ))
    }

    /// Mean error (µm) that tables leave of machines that deviate from it.
    fn left_of_drawn(&self, built: &Built) -> Result<f64, ReproduceError> {
        let few = &self.commands[..POSITIONS];
        let one = |seed| -> Result<f64, ReproduceError> {
            let runtime = Runtime::load(&built.blob)?;
            let errors = drawn(&self.example, &self.before, seed);
            Ok(mean(&self.example, &errors, few, Some(&runtime)))
        };
        let all: Result<Vec<f64>, ReproduceError> =
            (0..MACHINES).into_par_iter().map(one).collect();
        Ok(Statistics::of(all?.into_iter()).mean)
    }

    /// Numbers of tables.
    fn sizes(&self, counts: &[Vec<(char, usize)>; 3]) -> Vec<Compared> {
        let mut rows = Vec::new();
        for (axis, printed) in COUNTS {
            let [ours, exact @ ..] = counts.each_ref().map(|of| Figure::count(used(of, axis)));
            let what = format!("tables that {axis} reads");
            rows.push(
                Compared::plain(what, Figure::count(printed), ours)
                    .from("section 7.4.1")
                    .beside(exact),
            );
        }
        let [ours, exact @ ..] = self.built.each_ref().map(|b| Figure::count(b.size.tables));
        rows.push(
            Compared::plain("tables in all", Figure::count(40), ours)
                .from("section 7.4.1")
                .beside(exact)
                .because("tables of `exact` serve several axes, where the document's controller has one output for each"),
        );
        rows
    }

    /// The mean error of all parameters together, and what is left of it.
    fn together(&self) -> Result<[Compared; 6], ReproduceError> {
        let of = [&self.before, &self.after].map(|errors| self.mean(errors));
        let all = |left: fn(&Self, &Built) -> Result<f64, ReproduceError>| {
            let [a, b, c] = &self.built;
            Ok::<_, ReproduceError>([left(self, a)?, left(self, b)?, left(self, c)?])
        };
        let still = all(Self::left_by)?;
        let moving = all(Self::left_of_drawn)?;
        let percent = |left: f64| 100.0 * (1.0 - left / of[0]);
        let row = |what, document, ours| Compared::numbers(what, [document, ours], 1);
        let exact = |[_, exact @ ..]: [f64; 3], decimals| exact.map(|v| Figure::new(v, decimals));
        let nothing_but = "… after, nothing but the 13 errors";
        Ok([
            row("mean error: before", 44.0, of[0])
                .of(Quantity::Raw)
                .because(PREDICTED),
            row("… after, by the parameters of Table 7-2", 9.1, of[1])
                .of(Quantity::Raw)
                .because(AFTER),
            row("… compensated", 79.0, percent(of[1]))
                .in_unit("%")
                .because(AFTER),
            row("… after, parameters as uncertain as stated", 9.1, moving[0])
                .of(Quantity::Raw)
                .beside(exact(moving, 1))
                .because(DRAWN),
            row("… compensated", 79.0, percent(moving[0]))
                .in_unit("%")
                .beside(exact(moving.map(percent), 1))
                .because(DRAWN),
            Compared::plain(nothing_but, Figure::new(9.1, 1), Figure::new(still[0], 3))
                .of(Quantity::Raw)
                .beside(exact(still, 3))
                .because(DRAWN),
        ])
    }
}

/// Where the Huron was probed.
fn of_zone(zone: &Zone) -> [Compared; 3] {
    let [x, y, z] = zone.halves;
    let words = format!("±{x:.0}, ±{y:.0}, {:.0} ± {z:.0}", zone.height);
    let row = |what, ours| Compared::plain(what, Figure::Nothing, ours).because(INFERRED);
    [
        row("zone of the probings: X, Y, Z", Figure::Words(words))
            .from("-")
            .in_unit("mm"),
        row("… part of the travels", Figure::new(100.0 * zone.part, 0))
            .from("Figure 7.3")
            .in_unit("%"),
        row("… tool", Figure::new(zone.tool, 0))
            .from("-")
            .in_unit("mm"),
    ]
}

/// The mean errors by each parameter.
fn by_parameter(found: &[(&str, [f64; 2])]) -> Vec<Compared> {
    let mut rows = Vec::new();
    for ((name, found), (_, printed)) in found.iter().zip(EFFECTS) {
        let is_offset = matches!(*name, "EZ0S" | "EX0S" | "EY0C");
        let before = match is_offset {
            true => OFFSETS,
            false if FITTED.contains(name) => INFERRED,
            false => PREDICTED,
        };
        let after = if is_offset { OFFSETS } else { AFTER };
        let what = format!("mean error by {name}, before");
        for (k, (what, why)) in [(what, before), ("… after".to_owned(), after)]
            .into_iter()
            .enumerate()
        {
            let row = Compared::numbers(what, [printed[k], found[k]], 1);
            rows.push(row.of(Quantity::Raw).because(why));
        }
    }
    rows
}

pub fn chapter() -> Result<Chapter, ReproduceError> {
    let known = huron()?.errors(Parameters::Huron13)?;
    let zone = Zone::inferred(&known);
    let huron = HuronInZone::new(&zone)?;
    let [a, b, c] = &huron.built;
    let counts = [output_counts(a)?, output_counts(b)?, output_counts(c)?];
    let effects = huron.effects();
    let mut compared = huron.sizes(&counts);
    compared.extend(of_zone(&zone));
    compared.extend(by_parameter(&effects));
    compared.extend(huron.together()?);
    let [counts, ..] = counts;
    let tables = a.size.tables;
    let each = COUNTS.map(|(axis, _)| used(&counts, axis).to_string());
    let fixed = Fixed {
        statement: "13, 11, 14, 1 and 1 tables for X, Y, Z, A and C, 40 in all (section 7.4.1)"
            .to_owned(),
        found: format!("{}, {tables} in all", each.join(", ")),
        holds: tables == 40 && COUNTS.iter().all(|count| counts.contains(count)),
    };
    Ok(Chapter {
        title: "Chapter 7: tables of the closed form",
        source: "Table 7-2",
        how: "The Huron with the 13 errors of Table 7-2, before and after the document's tables. The closed form is \
            `fik`, with 101 points. Positions, travels and tool are not published: they are inferred from four rows of \
            Table 7-2, and the others are predicted.",
        compared,
        tables: Vec::new(),
        fixed: vec![fixed],
        pictures: vec![picture(&effects)],
    })
}

/// Number of tables that an axis reads.
fn used(counts: &[(char, usize)], axis: char) -> usize {
    let found = counts.iter().find(|(a, _)| *a == axis);
    found.map_or(0, |(_, n)| *n)
}

/// Number of tables that each output reads.
fn output_counts(built: &Built) -> Result<Vec<(char, usize)>, ReproduceError> {
    let runtime = Runtime::load(&built.blob)?;
    let compensation = runtime.compensation();
    let axes = compensation.axes();
    let mut counts = Vec::new();
    for (index, axis) in axes.iter().enumerate() {
        let terms = compensation.terms();
        let mut tables: Vec<usize> = terms
            .filter(|term| usize::from(term.output) == index)
            .flat_map(|term| {
                term.factors
                    .iter()
                    .map(|t| usize::from(*t))
                    .collect::<Vec<_>>()
            })
            .collect();
        tables.sort_unstable();
        tables.dedup();
        counts.push((char::from(axis.name), tables.len()));
    }
    Ok(counts)
}

fn picture(found: &[(&str, [f64; 2])]) -> Picture {
    let title = "Figure 7.6: the tip by each parameter, before and after".to_owned();
    let bars = found.iter().map(|(name, [before, after])| ChartBar {
        name: (*name).to_owned(),
        mean: *after,
        max: *before,
        uncertainty: None,
    });
    Picture {
        name: "reproduced-7-6",
        drawn: Drawn::Bars(Bars {
            title: title.clone(),
            label: "mean over the zone (µm)".to_owned(),
            legend: ["after", "before", ""].map(str::to_owned),
            ink: Ink::Accent,
            bars: bars.collect(),
        }),
        title,
    }
}
