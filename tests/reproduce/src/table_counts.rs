//! Section 7.4: the tables of the closed form, and their effect on the Huron (Table 7-2, the 79 %).

use super::embedded::{Example, Parameters, huron};
use super::validated::{both, built, fik};
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, Quantity, ReproduceError};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use trueaxis_measure::simulate::normal;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_report::picture::{Bars, ChartBar, Ink};
use trueaxis_tables::compile::Built;
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::validate::{Command, Region, Runtime, Statistics, random_commands};

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

const INFERRED: &str = "from these four the zone was inferred: X, Y and Z − t are evenly spread, X and Y around the rotary     axes. X and Y reach over the same part of the travels of Figure 7.3, which Z was given, too";
const PREDICTED: &str = "2000 random positions of the zone, where the document has 10";
const OFFSETS: &str = "the same for every place: an offset of the spindle or of an axis moves the tip by as much as it is";
const AFTER: &str =
    "predicted by the parameters of Table 7-2 with the document's tables on, in the same zone";
const DRAWN: &str = "the closed form itself leaves 0.01 µm: what the document left is the machine, whose parameters had     changed. By half of the U that Table 7-2 states for them alone so much would be left, in the mean of 200 machines (EX0S     is -11.0 µm after and -2.1 before, where 4.9 are stated)";

pub fn chapter() -> Result<Chapter, ReproduceError> {
    let known = huron()?.errors(Parameters::Huron13)?;
    let zone = Zone::inferred(&known);
    let example = zone.of(huron()?);
    let machine = &example.machine;
    let before = example.errors(Parameters::Huron13)?;
    let after = example.errors(Parameters::Huron13After)?;
    let perfect = ErrorModel::perfect(machine);
    let kinematics = Kinematics::new(machine, &perfect);
    let commands = random_commands(&kinematics, Region::Travel, RANDOM, SEED)?;
    let [orientation, direction] = both();
    let tables = built(machine, &before, fik(), orientation, None)?;
    let exact = [orientation, direction]
        .map(|policy| built(machine, &before, Scheme::default(), policy, None));
    let [exact_o, exact_d] = exact;
    let exact = [exact_o?, exact_d?];

    let mut compared = Vec::new();
    let counts = output_counts(&tables)?;
    let of_exact = [output_counts(&exact[0])?, output_counts(&exact[1])?];
    for (axis, printed) in COUNTS {
        let used = |of: &[(char, usize)]| {
            let found = of.iter().find(|(a, _)| *a == axis);
            Figure::count(found.map_or(0, |(_, n)| *n))
        };
        compared.push(
            Compared::plain(
                format!("tables that {axis} reads"),
                Figure::count(printed),
                used(&counts),
            )
            .from("section 7.4.1")
            .beside([used(&of_exact[0]), used(&of_exact[1])]),
        );
    }
    compared.push(
        Compared::plain("tables in all", Figure::count(40), Figure::count(tables.size.tables))
            .from("section 7.4.1")
            .beside([0, 1].map(|i| Figure::count(exact[i].size.tables)))
            .because("tables of `exact` serve several axes, where the document's controller has one output for each"),
    );
    let mm = |value: f64| Figure::new(value, 0);
    let [x, y, z] = zone.halves;
    let words = format!("±{x:.0}, ±{y:.0}, {:.0} ± {z:.0}", zone.height);
    compared.extend([
        Compared::plain(
            "zone of the probings: X, Y, Z",
            Figure::Nothing,
            Figure::Words(words),
        )
        .from("-")
        .in_unit("mm")
        .because(INFERRED),
        Compared::plain(
            "… part of the travels",
            Figure::Nothing,
            mm(100.0 * zone.part),
        )
        .from("Figure 7.3")
        .in_unit("%")
        .because(INFERRED),
        Compared::plain("… tool", Figure::Nothing, mm(zone.tool))
            .from("-")
            .in_unit("mm")
            .because(INFERRED),
    ]);
    let um = |value: f64| Figure::new(value, 1);
    let mut bars = Vec::new();
    for (name, printed) in EFFECTS {
        let found = [&before, &after]
            .map(|errors| mean(&example, &alone(&example, errors, name), &commands, None));
        let is_offset = matches!(name, "EZ0S" | "EX0S" | "EY0C");
        bars.push((name, found));
        for (k, when) in ["before", "after"].into_iter().enumerate() {
            let what = match k {
                0 => format!("mean error by {name}, {when}"),
                _ => format!("… {when}"),
            };
            compared.push(
                Compared::plain(what, um(printed[k]), um(found[k]))
                    .of(Quantity::Raw)
                    .in_unit("µm")
                    .because(match (is_offset, k) {
                        (true, _) => OFFSETS,
                        (_, 0) if FITTED.contains(&name) => INFERRED,
                        (_, 0) => PREDICTED,
                        _ => AFTER,
                    }),
            );
        }
    }
    let of = [&before, &after].map(|errors| mean(&example, errors, &commands, None));
    let percent = |left: f64| Figure::new(100.0 * (1.0 - left / of[0]), 1);
    let left_by = |built: &Built| -> Result<f64, ReproduceError> {
        let runtime = Runtime::load(&built.blob)?;
        Ok(mean(&example, &before, &commands, Some(&runtime)))
    };
    let drawn_by = |built: &Built| -> Result<f64, ReproduceError> {
        let few = &commands[..POSITIONS];
        let all: Result<Vec<f64>, ReproduceError> = (0..MACHINES)
            .into_par_iter()
            .map(|seed| {
                let runtime = Runtime::load(&built.blob)?;
                Ok(mean(
                    &example,
                    &drawn(&example, &before, seed),
                    few,
                    Some(&runtime),
                ))
            })
            .collect();
        Ok(Statistics::of(all?.into_iter()).mean)
    };
    let still = [left_by(&tables)?, left_by(&exact[0])?, left_by(&exact[1])?];
    let moving = [
        drawn_by(&tables)?,
        drawn_by(&exact[0])?,
        drawn_by(&exact[1])?,
    ];
    compared.extend([
        Compared::plain("mean error: before", um(44.0), um(of[0]))
            .of(Quantity::Raw)
            .in_unit("µm")
            .because(PREDICTED),
        Compared::plain(
            "… after, by the parameters of Table 7-2",
            um(9.1),
            um(of[1]),
        )
        .of(Quantity::Raw)
        .in_unit("µm")
        .because(AFTER),
        Compared::plain("… compensated", Figure::new(79.0, 1), percent(of[1]))
            .in_unit("%")
            .because(AFTER),
        Compared::plain(
            "… after, parameters as uncertain as stated",
            um(9.1),
            um(moving[0]),
        )
        .of(Quantity::Raw)
        .in_unit("µm")
        .beside([um(moving[1]), um(moving[2])])
        .because(DRAWN),
        Compared::plain("… compensated", Figure::new(79.0, 1), percent(moving[0]))
            .in_unit("%")
            .beside([percent(moving[1]), percent(moving[2])])
            .because(DRAWN),
        Compared::plain(
            "… after, nothing but the 13 errors",
            um(9.1),
            Figure::new(still[0], 3),
        )
        .of(Quantity::Raw)
        .in_unit("µm")
        .beside([Figure::new(still[1], 3), Figure::new(still[2], 3)])
        .because(DRAWN),
    ]);
    let fixed: Vec<Fixed> = vec![Fixed {
        statement: "13, 11, 14, 1 and 1 tables for X, Y, Z, A and C, 40 in all (section 7.4.1)"
            .to_owned(),
        found: {
            let of = |axis| {
                counts
                    .iter()
                    .find(|(a, _)| *a == axis)
                    .map_or(0, |(_, n)| *n)
            };
            let all: Vec<String> = COUNTS
                .iter()
                .map(|(axis, _)| of(*axis).to_string())
                .collect();
            format!("{}, {} in all", all.join(", "), tables.size.tables)
        },
        holds: tables.size.tables == 40 && COUNTS.iter().all(|count| counts.contains(count)),
    }];
    Ok(Chapter {
        title: "Chapter 7: tables of the closed form",
        source: "Table 7-2",
        how: "The Huron with the 13 errors of Table 7-2, before and after the document's tables. The closed form is \
            `fik`, with 101 points. Positions, travels and tool are not published: they are inferred from four rows of \
            Table 7-2, and the others are predicted.",
        compared,
        tables: Vec::new(),
        fixed,
        pictures: vec![picture(&bars)],
    })
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
