//! Sections 4.5 and 4.7: the required size of a grid (Fig. 4.5), and its remaining error.

use super::embedded::{Example, Parameters, hu40};
use super::validated::{both, built, exact};
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, ReproduceError};
use std::ops::RangeInclusive;
use trueaxis::Travel;
use trueaxis_model::errors::{ErrorModel, Parameter};
use trueaxis_model::kinematics::{Kinematics, Policy};
use trueaxis_model::validate::{Quality, Region, Runtime, random_commands, verify};
use trueaxis_report::picture::{Chart, Ink, Mark, Scale, Series};
use trueaxis_tables::compile::Built;
use trueaxis_tables::schemes::Scheme;
use trueaxis_tables::schemes::grid3d::{Rms, Wanted, left_by_size};

/// Grid sizes examined.
const SIZES: RangeInclusive<usize> = 2..=25;
/// Random commands (section 4.5.1).
const RANDOM: usize = 2000;
/// The document's threshold (mm).
const THRESHOLD: f64 = 1e-4;

/// The machine of Chapter 4 with 13 or 84 parameters, known over the whole travel: there the zone of the grid is that
/// of the calibration (Fig. 4.8).
pub fn machine(example: &Example, parameters: Parameters) -> Result<ErrorModel, ReproduceError> {
    // The travels of the file, in which its calibrated ranges are.
    let mut errors = hu40()?.errors(parameters)?;
    for (calibrated, axis) in errors.calibrated.iter_mut().zip(&example.machine.axes) {
        *calibrated = axis.travel.map(|t| axis.to_kinematic(t));
    }
    Ok(errors)
}

/// A grid for linear axes only, as in the document.
pub fn grid(
    example: &Example,
    errors: &ErrorModel,
    wanted: Wanted,
) -> Result<Built, ReproduceError> {
    let scheme = Scheme::Grid3d(wanted);
    built(&example.machine, errors, scheme, Policy::Position, None)
}

/// Nodes along each axis.
fn nodes(built: &Built) -> Result<[usize; 3], ReproduceError> {
    let runtime = Runtime::load(&built.blob)?;
    let grids = runtime.compensation().grids();
    let points = |k: usize| {
        let axes = grids.iter().flat_map(|grid| grid.axes.iter());
        axes.map(|axis| axis.points as usize).nth(k).unwrap_or(0)
    };
    Ok([0, 1, 2].map(points))
}

/// The remaining error (µm) at random commands with the rotary axes at zero: before, and with each of these.
fn at_rest<const N: usize>(
    example: &Example,
    errors: &ErrorModel,
    with: [&Built; N],
) -> Result<(Quality, [Quality; N]), ReproduceError> {
    let machine = &example.machine;
    let kinematics = Kinematics::new(machine, errors);
    let mut commands = random_commands(&kinematics, Region::Travel, RANDOM, 12)?;
    for command in &mut commands {
        for (i, axis) in machine.axes.iter().enumerate() {
            if axis.letter.is_rotary() {
                command.axes[i] = 0.0;
                // It does not move, so its backlash does not concern the grid.
                command.travel[i] = Travel::Unknown;
            }
        }
    }
    let mut before = Quality::default();
    let mut after = [Quality::default(); N];
    for (after, built) in after.iter_mut().zip(with) {
        let runtime = Runtime::load(&built.blob)?;
        let zero = Default::default();
        let found = verify(machine, errors, &runtime, &zero, &commands, || ())?;
        (before, *after) = (found.before, found.after);
    }
    Ok((before, after))
}

/// The largest correction of a linear axis (µm).
fn largest(example: &Example, built: &Built) -> f64 {
    ['X', 'Y', 'Z']
        .map(|letter| largest_of(example, built, letter))
        .into_iter()
        .fold(0.0, f64::max)
}

/// The largest correction of one axis (µm).
fn largest_of(example: &Example, built: &Built, letter: char) -> f64 {
    let mut axes = example.machine.axes.iter().zip(&built.bounds);
    let found = axes.find(|(axis, _)| axis.letter.char() == letter);
    1e3 * found.map_or(0.0, |(_, bounds)| bounds.largest)
}

/// Corrections of the HU40: for its 13 and for its 84 parameters.
pub struct Tables {
    pub example: Example,
    /// The machines.
    pub errors: [ErrorModel; 2],
    /// For each the grid, and `exact` under *orientation* and *direction*.
    pub built: [[Built; 3]; 2],
}

impl Tables {
    pub fn new() -> Result<Self, ReproduceError> {
        let example = hu40()?.begun_at_zero();
        let errors = [
            machine(&example, Parameters::Hu40Of13)?,
            machine(&example, Parameters::Hu40Of84)?,
        ];
        let all = |errors: &ErrorModel| -> Result<[Built; 3], ReproduceError> {
            let [orientation, direction] = both();
            let exact = |policy| exact(&example.machine, errors, policy);
            Ok([
                grid(&example, errors, Wanted::default())?,
                exact(orientation)?,
                exact(direction)?,
            ])
        };
        let built = [all(&errors[0])?, all(&errors[1])?];
        Ok(Self {
            example,
            errors,
            built,
        })
    }
}

const SETS: &str = "the document's two simulated sets of 84 coefficients are not published: these are the measured ones of \
    Table 4-2, taken as known over the whole travel";
const BEGIN: &str = "where the travels begin is not published, and decides it. They run from 0 to L here, as the ball-bar shows \
    (below)";
const SEEDS: &str = "the 2000 random commands decide by a node: the range over ten seeds";
const PRINTED: &str = "Eq. 12 is printed with the number of positions outside of the root, which makes it 45 times \
    smaller than the usual root mean square; the document's numbers fit the usual one";
const LARGE: &str = "mainly the constant ECX0 = −3.62 mrad, which leans on other constants where the machine was probed; the \
    ends of the travel add the rest";

/// Number of seeds of the random commands.
const SEEDED: u64 = 10;

/// Nodes along X, Y and Z, as words.
fn size(built: &Built) -> Result<Figure, ReproduceError> {
    let [x, y, z] = nodes(built)?;
    Ok(Figure::Words(format!("{x}×{y}×{z}")))
}

/// The least and the most of numbers of nodes.
fn range(all: &[usize]) -> Figure {
    let (low, high) = (all.iter().min(), all.iter().max());
    Figure::Words(format!("{}…{}", low.unwrap_or(&0), high.unwrap_or(&0)))
}

fn words(text: &str) -> Figure {
    Figure::Words(text.to_owned())
}

/// Sizes of the grids, and what the one for 13 errors leaves.
fn sizes(tables: &Tables) -> Result<Vec<Compared>, ReproduceError> {
    let [[small, few_exact @ ..], [large, many_exact @ ..]] = &tables.built;
    let count = |built: &Built| Figure::Words(format!("{} tables", built.size.tables));
    let counts = || many_exact.each_ref().map(count);
    let of_large = |what, document| -> Result<Compared, ReproduceError> {
        Ok(Compared::plain(what, words(document), size(large)?).beside(counts()))
    };
    let first = "nodes, 84 coefficients, first simulated set";
    Ok(vec![
        Compared::plain("nodes, 13 errors", words("2×2×2"), size(small)?)
            .beside(few_exact.each_ref().map(count)),
        left(tables, 0, words("< 0.1"))?,
        of_large(first, "14×14×14")?.because(SETS),
        of_large("… second simulated set", "19×19×19")?.because(SETS),
        of_large("… as measured", "19×19×19")?
            .from("section 4.7")
            .because(BEGIN),
    ])
}

/// What the tables of a machine leave.
fn left(tables: &Tables, of: usize, document: Figure) -> Result<Compared, ReproduceError> {
    let [a, b, c] = &tables.built[of];
    let (_, found) = at_rest(&tables.example, &tables.errors[of], [a, b, c])?;
    let [ours, exact @ ..] = found.map(|q| Figure::new(q.translation_um.rms, 3));
    let row = Compared::plain("… RMS that is left", document, ours);
    Ok(row.in_unit("µm").beside(exact))
}

/// The size of the larger grid for other commands, places and thresholds.
fn varied(tables: &Tables) -> Result<[Compared; 3], ReproduceError> {
    let many = |wanted: Wanted| grid(&tables.example, &tables.errors[1], wanted);
    let rms = Rms::Printed;
    let printed = many(Wanted {
        rms,
        ..Wanted::default()
    })?;
    let seeded = (1..=SEEDED).map(|seed| {
        let built = many(Wanted {
            seed,
            ..Wanted::default()
        })?;
        Ok(nodes(&built)?[0])
    });
    let seeded: Result<Vec<usize>, ReproduceError> = seeded.collect();
    let anywhere = "… … wherever travels begin";
    Ok([
        Compared::plain("… … over ten seeds", words("19"), range(&seeded?)).because(SEEDS),
        Compared::plain(anywhere, words("19"), range(&placements()?)).because(BEGIN),
        Compared::plain("… with Eq. 12 as printed", Figure::Nothing, size(&printed)?)
            .from("Eq. 12")
            .because(PRINTED),
    ])
}

/// The largest corrections of the grids, and those without a constant.
fn corrections(tables: &Tables) -> Result<Vec<Compared>, ReproduceError> {
    let example = &tables.example;
    let [[small, ..], [large, ..]] = &tables.built;
    let mut errors = tables.errors[1].clone();
    if let Some(parameter) = Parameter::parse("ECX0") {
        errors.set(&example.machine, parameter, 0.0);
    }
    let constant = grid(example, &errors, Wanted::default())?;
    let row = |what: String, um: f64| {
        Compared::plain(what, words("< 100"), Figure::new(um, 1))
            .from("section 4.7")
            .in_unit("µm")
    };
    let mut rows = vec![
        row(
            "largest correction, 13 errors".to_owned(),
            largest(example, small),
        ),
        row("… 84 coefficients".to_owned(), largest(example, large)).because(LARGE),
    ];
    rows.extend(['X', 'Y', 'Z'].map(|letter| {
        let um = largest_of(example, &constant, letter);
        row(format!("… … of {letter} without ECX0"), um).because(LARGE)
    }));
    Ok(rows)
}

pub fn chapter(tables: &Tables) -> Result<Chapter, ReproduceError> {
    let mut compared = sizes(tables)?;
    compared.extend(varied(tables)?);
    compared.push(left(tables, 1, Figure::Nothing)?);
    compared.extend(corrections(tables)?);
    let few = nodes(&tables.built[0][0])?;
    let machine = &tables.example.machine;
    let (default, position) = (Wanted::default(), Policy::Position);
    let meets = |errors| left_by_size(machine, errors, &default, position, SIZES);
    let curves = [meets(&tables.errors[0])?, meets(&tables.errors[1])?];
    Ok(Chapter {
        title: "Chapter 4: the size of a grid",
        source: "section 4.5.1",
        how: "The HU40 with travels from 0 to their length, whose grid corrects its linear axes with B and C at zero. It is \
            the smallest to which one node more along each axis adds less than 0.1 µm (Eqs. 10 to 12, with the usual root \
            mean square).",
        compared,
        tables: Vec::new(),
        fixed: vec![Fixed {
            statement: "2×2×2 nodes are enough for 13 errors (section 4.5.1)".to_owned(),
            found: format!("{}×{}×{}", few[0], few[1], few[2]),
            holds: few == [2; 3],
        }],
        pictures: vec![picture(&curves)],
    })
}

/// The number of nodes along each axis beyond which one more adds less than the threshold.
fn large_enough(curve: &[(usize, f64)]) -> Option<usize> {
    let mut pairs = curve.windows(2);
    let found = pairs.find(|pair| pair[0].1 - pair[1].1 < THRESHOLD)?;
    Some(found[0].0)
}

/// Position of an axis's travel, as fractions of its length.
const PLACES: [[f64; 2]; 3] = [[-1.0, 0.0], [-0.5, 0.5], [0.0, 1.0]];

/// Number of nodes needed for the 84 coefficients, for travels of the same length at all 27 places.
fn placements() -> Result<Vec<usize>, ReproduceError> {
    let mut all = Vec::new();
    for place in 0..PLACES.len().pow(3) {
        let mut example = hu40()?;
        for (letter, place) in [('X', place / 9), ('Y', place / 3 % 3), ('Z', place % 3)] {
            if let Some(index) = example.machine.index(letter) {
                let axis = &mut example.machine.axes[index];
                let length = axis.travel[1] - axis.travel[0];
                axis.travel = PLACES[place].map(|part| part * length);
            }
        }
        let many = machine(&example, Parameters::Hu40Of84)?;
        all.push(nodes(&grid(&example, &many, Wanted::default())?)?[0]);
    }
    Ok(all)
}

fn picture([few, many]: &[Vec<(usize, f64)>; 2]) -> Picture {
    let title = "Figure 4.5: what a grid leaves, by its nodes".to_owned();
    let line = |name: &str, ink, curve: &[(usize, f64)]| Series {
        name: name.to_owned(),
        ink,
        mark: Mark::Line,
        points: curve.iter().map(|(n, mm)| [*n as f64, 1e3 * mm]).collect(),
    };
    // The change from one grid to the next is compared with the threshold.
    let found = large_enough(many);
    let mut series = vec![
        line("84 coefficients", Ink::Accent, many),
        line("13 errors", Ink::After, few),
    ];
    if let Some(nodes) = found {
        let at = many.iter().filter(|(n, _)| *n == nodes);
        series.push(Series {
            name: "large enough".to_owned(),
            ink: Ink::Before,
            mark: Mark::Points,
            points: at.map(|(n, mm)| [*n as f64, 1e3 * mm]).collect(),
        });
    }
    let values = many.iter().map(|(_, mm)| 1e3 * mm);
    Picture {
        name: "reproduced-4-5",
        drawn: Drawn::Chart(Chart {
            title: title.clone(),
            x: Scale::exact("nodes along each axis", [2.0, 25.0]),
            y: Scale::around("norm of the RMS (µm)", values),
            shaded: Vec::new(),
            series,
        }),
        title,
    }
}
