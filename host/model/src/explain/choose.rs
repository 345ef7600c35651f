//! Chooses the instrument that shows a parameter best.

use super::bench::{Bench, BenchState};
use super::instrument::{BallPlacement, BenchInstrument, InstrumentReading, REACH, Sense, largest};
use super::single_entry::{Nature, SingleEntry};
use crate::errors::ParameterKind;

/// An instrument intended for a location must show at least this fraction of its size. Below that it is a side
/// effect, and the largest one is taken.
const SHOWS: f64 = 0.2;
/// Effects below this fraction of another one count as zero.
const NOTHING: f64 = 1e-3;

/// The reading that shows a parameter best. `None` only if the machine has no linear axes.
pub fn choose(bench: &Bench<'_>, alone: &SingleEntry<'_>) -> Option<InstrumentReading> {
    let size = match alone.parameter.is_angular() {
        true => alone.size() * REACH,
        false => alone.size(),
    };
    let enough = match alone.nature() {
        Nature::Constant => SHOWS,
        _ => NOTHING,
    };
    let mut best: Option<InstrumentReading> = None;
    for offer in offers(bench, alone) {
        let Some(reading) = offer() else {
            continue;
        };
        if reading.size() >= enough * size {
            return Some(reading);
        }
        best = largest(best.into_iter().chain([reading]));
    }
    best
}

type Offer<'o> = Box<dyn Fn() -> Option<InstrumentReading> + 'o>;

/// Readings that may show it, the usual one first.
fn offers<'o>(bench: &'o Bench<'_>, alone: &'o SingleEntry<'_>) -> Vec<Offer<'o>> {
    let index = alone.index();
    let axis = bench.machine.axes.get(index);
    let rotary = axis.map(|axis| axis.letter.is_rotary());
    let angular = alone.parameter.is_angular();
    let mut offers: Vec<Offer<'o>> = match (alone.nature(), rotary) {
        (Nature::Constant, _) => constant(bench, index, rotary, angular),
        (_, None) => Vec::new(),
        (Nature::Reversal, Some(_)) => vec![Box::new(move || reversal(bench, alone, index))],
        (Nature::Slope | Nature::Curve, Some(true)) => {
            vec![Box::new(move || turning(bench, alone, index))]
        }
        (Nature::Slope | Nature::Curve, Some(false)) => {
            vec![Box::new(move || moving(bench, alone, index))]
        }
    };
    offers.push(Box::new(move || anywhere(bench, alone)));
    offers
}

/// For a location, or a motion with the same value everywhere.
fn constant<'o>(
    bench: &'o Bench<'_>,
    index: usize,
    rotary: Option<bool>,
    angular: bool,
) -> Vec<Offer<'o>> {
    let ball = move |axis: usize| -> Offer<'o> {
        let swing = bench.swing(axis);
        match angular {
            false => Box::new(move || largest(bench.ball(axis, swing, None))),
            true => Box::new(move || tilt(bench, axis, swing)),
        }
    };
    let pairs = move |with: Option<usize>| -> Offer<'o> {
        Box::new(move || {
            let pairs = bench.linear().flat_map(|aligned| {
                let others = bench.linear().filter(move |moved| *moved != aligned);
                others.map(move |moved| (aligned, moved))
            });
            let wanted = pairs.filter(|(aligned, _)| with.is_none_or(|with| with == *aligned));
            let squares = wanted.map(|(a, b)| bench.square(a, b, bench.span(b, bench.travel(b))));
            largest(squares)
        })
    };
    let mut offers: Vec<Offer<'o>> = Vec::new();
    if rotary == Some(true) {
        offers.push(ball(index));
    }
    if angular {
        if rotary == Some(false) {
            offers.push(pairs(Some(index)));
        }
        if rotary.is_some() {
            offers.push(pairs(None));
        }
        offers.push(Box::new(|| largest(bench.tram())));
    }
    offers.extend(bench.rotary().map(ball));
    offers
}

/// For the inclination of a rotary axis: a ball beside it, read along it, because this does not depend on the
/// position of the ball along the axis; otherwise any ball.
fn tilt(bench: &Bench<'_>, axis: usize, swing: [f64; 2]) -> Option<InstrumentReading> {
    // Position of a linear axis along this one.
    let along = |state: &BenchState, linear: usize| {
        let way = bench.way(&state.q, linear);
        way.dot(&bench.about(&state.q, axis)).abs()
    };
    let home = BenchState::at(bench.home());
    let away = bench.linear().map(Some).chain([None]);
    let all: Vec<InstrumentReading> = away
        .flat_map(|away| bench.ball(axis, swing, away))
        .collect();
    let beside = all.iter().filter(|reading| {
        let BenchInstrument::Ball {
            place: BallPlacement::Away(away),
        } = reading.instrument
        else {
            return false;
        };
        let read_along = matches!(reading.sense, Sense::In(i) if along(&reading.to, i) > 0.9);
        read_along && along(&home, away) < 0.1
    });
    let beside = largest(beside.copied());
    let any = largest(all)?;
    Some(
        beside
            .filter(|b| b.size() > SHOWS * any.size())
            .unwrap_or(any),
    )
}

/// Positions at which an axis is read: a single one if the error is proportional to the position, otherwise several
/// along the travel.
fn places(bench: &Bench<'_>, alone: &SingleEntry<'_>, index: usize) -> (BenchState, Vec<f64>) {
    let home = BenchState::at(bench.home());
    let [from, to] = bench.span(index, alone.range);
    let places = match alone.nature() {
        Nature::Slope => vec![to],
        _ => alone.places(),
    };
    (home.with(index, from), places)
}

/// For an error motion of a linear axis.
fn moving(bench: &Bench<'_>, alone: &SingleEntry<'_>, index: usize) -> Option<InstrumentReading> {
    let (from, places) = places(bench, alone, index);
    if alone.parameter.is_angular() {
        let readings = places.iter().flat_map(|place| {
            let to = from.with(index, *place);
            bench.angle(Some(index), from, to)
        });
        return largest(readings);
    }
    let along = largest(places.iter().flat_map(|place| {
        let readings = bench.laser(index, from, from.with(index, *place));
        readings.filter(move |reading| reading.sense == Sense::In(index))
    }));
    let across = || bench.linear().filter(|axis| *axis != index);
    let straight = match alone.nature() {
        Nature::Slope => None,
        _ => largest(bench.straightedge(index, &places)),
    };
    // A straight or nearly straight motion is an inclination.
    let ends = match places[..] {
        [first, .., last] => [first, last],
        _ => bench.span(index, alone.range),
    };
    let leaning = largest(across().map(|axis| bench.square(axis, index, ends)));
    let over = |reading: &InstrumentReading| reading.size() * (ends[1] - ends[0]).abs() / REACH;
    let across = match (straight, leaning) {
        (Some(straight), Some(leaning)) if straight.size() < NOTHING * over(&leaning) => {
            Some(leaning)
        }
        (Some(straight), _) => Some(straight),
        (None, leaning) => leaning,
    };
    largest(along.into_iter().chain(across))
}

/// For an error motion of a rotary axis.
fn turning(bench: &Bench<'_>, alone: &SingleEntry<'_>, index: usize) -> Option<InstrumentReading> {
    let (from, mut places) = places(bench, alone, index);
    // Among positions with equal errors, the nearest.
    places.sort_by(|a, b| a.abs().total_cmp(&b.abs()).then(b.total_cmp(a)));
    let readings = (places.iter()).flat_map(|place| match alone.parameter.is_angular() {
        true => {
            let to = from.with(index, *place);
            bench.angle(Some(index), from, to)
        }
        false => bench.ball(index, [from.q[index], *place], None),
    });
    largest(readings)
}

/// For a reversal error: read after positive travel, set to zero after negative travel.
fn reversal(bench: &Bench<'_>, alone: &SingleEntry<'_>, index: usize) -> Option<InstrumentReading> {
    let home = BenchState::at(bench.home());
    let [from, _] = bench.span(index, alone.range);
    let places = match alone.parameter.kind {
        ParameterKind::Backlash => vec![from],
        _ => alone.places(),
    };
    let readings = places.iter().flat_map(|place| {
        let (mut from, mut to) = (home.with(index, *place), home.with(index, *place));
        from.sign[index] = -1.0;
        to.sign[index] = 1.0;
        match alone.parameter.is_angular() {
            true => bench.angle(Some(index), from, to),
            false => bench.laser(index, from, to).collect(),
        }
    });
    largest(readings)
}

/// Any reading that shows it somewhere: at the tip, or else the rotation of the tool.
fn anywhere(bench: &Bench<'_>, alone: &SingleEntry<'_>) -> Option<InstrumentReading> {
    let home = BenchState::at(bench.home());
    let states = super::nothing::positions(bench.machine, alone);
    let tip = largest((states.iter()).flat_map(|to| bench.probe(home, BenchState::at(*to))));
    let turned = (states.iter()).flat_map(|to| bench.angle(None, home, BenchState::at(*to)));
    let turned = largest(turned);
    match tip {
        Some(tip) if turned.is_none_or(|turned| tip.size() > NOTHING * turned.size()) => Some(tip),
        _ => turned,
    }
}
