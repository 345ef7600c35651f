//! Sections 4.6.2 and 4.7: the ball-bar on a hemisphere before and after compensation (Table 4-4).

use super::embedded::{Example, Parameters, hu40};
use super::grids::Tables;
use super::{Chapter, Compared, Drawn, Figure, Fixed, Picture, ReproduceError};
use rayon::prelude::*;
use trueaxis_direct::ballbar::{BallBar, Hemisphere, PathPoint, ReadOut, Sphere};
use trueaxis_model::errors::ErrorModel;
use trueaxis_model::explain::Bench;
use trueaxis_model::machine::Axis;
use trueaxis_model::validate::Runtime;
use trueaxis_report::picture::{Chart, Ink, Mark, Scale, Series};
use trueaxis_tables::compile::Built;

/// Every n-th reading is drawn.
const DRAWN: usize = 25;

/// Figures derived from the bar (µm).
#[derive(Clone, Copy)]
struct Told {
    range: f64,
    deviation: f64,
    size: f64,
    /// Range of the readings without the setup errors.
    readings: f64,
}

impl Told {
    /// The four, in the order in which the document prints them, without the sign of the size.
    fn all(&self) -> [f64; 4] {
        [self.range, self.deviation, self.size.abs(), self.readings]
    }

    /// Relative differences from the document's figures before compensation.
    fn off(&self) -> [f64; 4] {
        let mut off = self.all();
        for (off, (_, [before, ..], _)) in off.iter_mut().zip(ROWS) {
            *off = *off / before - 1.0;
        }
        off
    }

    fn misfit(&self) -> f64 {
        (self.off().iter().map(|o| o * o).sum::<f64>() / 4.0).sqrt()
    }
}

/// Name and figures of Table 4-4 and section 4.7 (µm): before, with 13 errors, with 84 coefficients.
const ROWS: [(&str, [f64; 3], OfTold); 4] = [
    (
        "form, largest less smallest residual",
        [14.1, 1.7, 1.3],
        |t| t.range,
    ),
    ("form, standard deviation", [4.1, 1.1, 0.7], |t| t.deviation),
    ("size", [19.3, 3.8, 2.6], |t| t.size),
    ("largest less smallest reading", [33.6, 6.3, 5.8], |t| {
        t.readings
    }),
];

/// One of these figures.
type OfTold = fn(&Told) -> f64;

/// Readings of a machine with or without a correction.
fn read(
    example: &Example,
    errors: &ErrorModel,
    path: &[PathPoint],
    centre: [f64; 3],
    with: Option<&Built>,
) -> Result<Vec<ReadOut>, ReproduceError> {
    let machine = &example.machine;
    let bench = Bench::new(machine, errors, Default::default());
    let axes = BallBar::axes(machine).ok_or_else(|| ReproduceError::NoBar {
        machine: machine.name.clone(),
    })?;
    let mut at = vec![0.0; machine.axes.len()];
    for (axis, centre) in axes.into_iter().zip(centre) {
        at[axis] = centre;
    }
    let bar = BallBar::new(&bench, axes, at);
    let runtime = with.map(|built| Runtime::load(&built.blob)).transpose()?;
    Ok(bar.read(path, runtime.as_ref()))
}

fn told(radius: f64, read: &[ReadOut]) -> Result<(Told, Vec<f64>), ReproduceError> {
    let readings: Vec<_> = read.iter().map(|r| (r.direction, r.deviation)).collect();
    let found = Sphere::of(radius, &readings)?;
    let left = &found.without_setup;
    let (low, high) = left
        .iter()
        .fold((f64::MAX, f64::MIN), |(l, h), r| (l.min(*r), h.max(*r)));
    let told = Told {
        range: 1e3 * found.fitted.range(),
        deviation: 1e3 * found.fitted.deviation(),
        size: 1e3 * found.size,
        readings: 1e3 * (high - low),
    };
    Ok((told, left.iter().map(|r| 1e3 * r).collect()))
}

/// Steps of half a meridian while the centre is searched for.
const COARSE: u32 = 60;
/// Number of places tried along X, Y and Z from −L + r to L − r, and the last step of the search after them (mm).
const PLACES: [usize; 3] = [21, 21, 11];
const LAST: f64 = 1.0;
/// A place explains the table if each figure is as near as this.
const NEAR: f64 = 0.15;

/// The centre of the bar that explains the four figures before compensation best.
struct Centre {
    place: [f64; 3],
    misfit: f64,
    /// Number of places tried that explain them, and whether X, Y and Z of all of these are positive.
    near: usize,
    positive: bool,
}

/// What the bar shows of the machine with the 84 coefficients around each of its places.
struct CentreSearch<'a> {
    example: &'a Example,
    errors: ErrorModel,
    path: Vec<PathPoint>,
    radius: f64,
    /// Length of the travel of X, Y and Z (mm).
    lengths: [f64; 3],
}

impl<'a> CentreSearch<'a> {
    fn new(example: &'a Example) -> Result<Self, ReproduceError> {
        let mut errors = hu40()?.errors(Parameters::Hu40Of84)?;
        // The coefficients hold on both sides of zero: where the travel begins is what is looked for.
        let axes = &example.machine.axes;
        let length = |axis: &Axis| axis.travel[1] - axis.travel[0];
        let of = |letter| {
            example
                .machine
                .index(letter)
                .map_or(0.0, |i| length(&axes[i]))
        };
        for (calibrated, axis) in errors.calibrated.iter_mut().zip(axes) {
            if !axis.letter.is_rotary() {
                *calibrated = [-length(axis), length(axis)];
            }
        }
        let hemisphere = Hemisphere {
            steps: COARSE,
            ..Hemisphere::default()
        };
        Ok(Self {
            example,
            errors,
            path: hemisphere.path()?,
            radius: hemisphere.radius,
            lengths: ['X', 'Y', 'Z'].map(of),
        })
    }

    fn at(&self, place: [f64; 3]) -> Result<Told, ReproduceError> {
        let read = read(self.example, &self.errors, &self.path, place, None)?;
        Ok(told(self.radius, &read)?.0)
    }

    /// Places all over the travels, and what the bar shows there.
    fn everywhere(&self) -> Result<Vec<([f64; 3], Told)>, ReproduceError> {
        let along = |k: usize, i: usize| {
            let reach = self.lengths[k] - self.radius;
            -reach + 2.0 * reach * i as f64 / (PLACES[k] - 1) as f64
        };
        let places = (0..PLACES.iter().product()).into_par_iter().map(|i| {
            let [_, y, z] = PLACES;
            let place = [along(0, i / (y * z)), along(1, i / z % y), along(2, i % z)];
            Ok((place, self.at(place)?))
        });
        places.collect()
    }

    /// The best place from here, along each axis in turn with ever smaller steps.
    fn descended(
        &self,
        (mut place, mut misfit): ([f64; 3], f64),
    ) -> Result<([f64; 3], f64), ReproduceError> {
        let mut step = 32.0;
        while step >= LAST {
            let mut moved = false;
            for k in 0..3 {
                for sign in [-1.0, 1.0] {
                    let mut there = place;
                    there[k] += sign * step;
                    let found = self.at(there)?.misfit();
                    if there[k].abs() <= self.lengths[k] - self.radius && found < misfit {
                        (place, misfit, moved) = (there, found, true);
                    }
                }
            }
            if !moved {
                step /= 2.0;
            }
        }
        Ok((place, misfit))
    }
}

fn centre(example: &Example) -> Result<Centre, ReproduceError> {
    let search = CentreSearch::new(example)?;
    let all = search.everywhere()?;
    let near: Vec<[f64; 3]> = (all.iter())
        .filter(|(_, told)| told.off().iter().all(|off| off.abs() < NEAR))
        .map(|(place, _)| *place)
        .collect();
    let misfits = all.iter().map(|(place, told)| (*place, told.misfit()));
    let best = misfits.min_by(|a, b| a.1.total_cmp(&b.1));
    let (place, misfit) = search.descended(best.unwrap_or(([0.0; 3], f64::MAX)))?;
    Ok(Centre {
        place: place.map(f64::round),
        misfit,
        near: near.len(),
        positive: near.iter().flatten().all(|q| *q > 0.0),
    })
}

const CENTRE: &str = "the centre was inferred from the four figures of Table 4-4 and section 4.7 before compensation, without \
    the sign of the size. Every place that explains them lies at positive X, Y and Z: the travels run from 0";
const SIGN: &str = "by Table 4-2 the sphere is smaller, where the bar found it larger; why is open";
const MODELS: &str = "of a machine with the 84 coefficients: tables of the 13 errors leave what Table 4-3 and Table 4-2 have \
    apart, where the document's machine left about the same with both";
const NOTHING_ELSE: &str = "here the machine has the errors that the tables know and no others, no backlash, and nothing \
    moves between calibration and test";
const SMALLER: &str = "Table 4-3 alone makes it smaller too, by less";
const MEAN: &str =
    "81.25 and 82.74 % of the readings' range, with 13 errors and with 84 coefficients";

pub fn chapter(tables: &Tables) -> Result<Chapter, ReproduceError> {
    let example = &tables.example;
    let hemisphere = Hemisphere::default();
    let path = hemisphere.path()?;
    let centre = centre(example)?;
    let [thirteen, many] = &tables.errors;
    let built = tables.built.iter().flatten().map(Some);
    let with: Vec<Option<&Built>> = [None].into_iter().chain(built).collect();
    let at = |errors: &ErrorModel, with: Option<&Built>| {
        let read = read(example, errors, &path, centre.place, with)?;
        told(hemisphere.radius, &read)
    };
    let actual = with.par_iter().map(|with| at(many, *with));
    let actual = actual.collect::<Result<Vec<(Told, Vec<f64>)>, ReproduceError>>()?;
    let mut compared = of_centre(&centre).to_vec();
    compared.extend(by_grid(&actual));
    compared.extend(of_both(&actual, at(thirteen, None)?.0.size));
    Ok(Chapter {
        title: "Chapter 4: the ball-bar",
        source: "Table 4-4",
        how: "A bar of 150 mm on the HU40 and the hemispherical path of Figure 4.11. The machine is taken to have the 84 \
            coefficients of Table 4-2.",
        compared,
        tables: Vec::new(),
        fixed: vec![Fixed {
            statement: "the travels run from 0: X, Y and Z of every centre within 15 % of each figure are positive".to_owned(),
            found: format!("of {} centres of {}", centre.near, PLACES.iter().product::<usize>()),
            holds: centre.near > 0 && centre.positive,
        }],
        pictures: vec![picture(&actual)],
    })
}

/// The inferred place.
fn of_centre(centre: &Centre) -> [Compared; 2] {
    let [x, y, z] = centre.place;
    let row = |what, ours| Compared::plain(what, Figure::Nothing, ours).because(CENTRE);
    let place = Figure::Words(format!("{x:.0}, {y:.0}, {z:.0}"));
    let misfit = Figure::new(100.0 * centre.misfit, 0);
    [
        row("centre: X, Y, Z", place).from("-").in_unit("mm"),
        row("misfit of the four figures", misfit).in_unit("%"),
    ]
}

/// Figures of the bar before, and with each grid.
fn by_grid(actual: &[(Told, Vec<f64>)]) -> Vec<Compared> {
    let mut rows = Vec::new();
    for (what, [before, with_few, with_many], of) in ROWS {
        let at = |index: usize| of(&actual[index].0);
        let exact = |of: [usize; 2]| of.map(|index| Figure::new(at(index), 1));
        let source = match what {
            "largest less smallest reading" => "section 4.7",
            _ => "Table 4-4",
        };
        let row = |what: String, document, index| {
            Compared::numbers(what, [document, at(index)], 1)
                .from(source)
                .in_unit("µm")
        };
        let why = if what == "size" { SIGN } else { CENTRE };
        rows.extend([
            row(format!("{what}: before"), before, 0).because(why),
            row("… with the grid of 13 errors".to_owned(), with_few, 1)
                .beside(exact([2, 3]))
                .because(MODELS),
            row(
                "… with the grid of 84 coefficients".to_owned(),
                with_many,
                4,
            )
            .beside(exact([5, 6]))
            .because(NOTHING_ELSE),
        ]);
    }
    rows
}

/// The size (µm) of a machine with the 13 errors, and what both corrections compensate.
fn of_both(actual: &[(Told, Vec<f64>)], size: f64) -> [Compared; 2] {
    let gone = |index: usize| 100.0 * (1.0 - actual[index].0.readings / actual[0].0.readings);
    let both = |a: usize, b: usize| 0.5 * (gone(a) + gone(b));
    [
        Compared::numbers(
            "size of a machine with the 13 errors: before",
            [19.3, size],
            1,
        )
        .in_unit("µm")
        .because(SMALLER),
        Compared::numbers(
            "range of the readings that both compensate, mean",
            [82.0, both(1, 4)],
            0,
        )
        .from("abstract")
        .in_unit("%")
        .beside([both(2, 5), both(3, 6)].map(|part| Figure::new(part, 0)))
        .because(MEAN),
    ]
}

fn picture(found: &[(Told, Vec<f64>)]) -> Picture {
    let title = "Figures 4.12, 4.13: radial error along the path".to_owned();
    let line = |name: &str, ink, index: usize| {
        let readings: &Vec<f64> = &found[index].1;
        let points = readings.iter().enumerate().step_by(DRAWN);
        Series {
            name: name.to_owned(),
            ink,
            mark: Mark::Line,
            points: points.map(|(i, r)| [i as f64 / 1000.0, *r]).collect(),
        }
    };
    let series = vec![
        line("before", Ink::Before, 0),
        line("grid of 13 errors", Ink::Other, 1),
        line("grid of 84 coefficients", Ink::After, 4),
    ];
    let values = series.iter().flat_map(|s| s.points.iter().map(|p| p[1]));
    Picture {
        name: "reproduced-4-13",
        drawn: Drawn::Chart(Chart {
            title: title.clone(),
            x: Scale::exact("reading (thousands)", [0.0, 19.8]),
            y: Scale::around("radial error (µm)", values),
            shaded: Vec::new(),
            series,
        }),
        title,
    }
}
