//! Bounds of tables, products and sums: checked once, so that evaluation cannot overflow.

use core::ops::Range;

use crate::contents::Contents;
use crate::description::{Grid, SampleFormat};
use crate::load_error::LoadError;
use crate::plan::{FIXED, PackedTerm, Plan};
use crate::product;
use crate::room::{List, Room, Row};
use crate::work;

/// No value in an evaluation may exceed this. It is far above any correction, and far enough below `f32::MAX` that
/// neither the difference of two samples nor rounding can overflow: with either interpolation, tables stay within their
/// largest sample, up to rounding.
pub(crate) const MAGNITUDE: f32 = 1e15;

fn within(value: f32) -> bool {
    value <= MAGNITUDE
}

/// Checks every sample and bounds every table, every (partial) product and every sum. Fills the empty `peaks` with the
/// largest magnitude of each table.
pub(crate) fn measure<C: Room>(
    plan: &Plan<'_, C>,
    contents: &Contents<'_, C>,
    peaks: &mut C::TableList<f32>,
) -> Result<(), LoadError> {
    measure_tables(plan, contents, peaks)?;
    let mut row = C::Axes::<f32>::all(0.0);
    let sums = row.as_mut();
    for (number, term) in plan.terms().iter().enumerate() {
        work::count(1 + usize::from(term.count));
        let weight = largest_weight(plan, term);
        let factors = term.factors[..usize::from(term.count)].iter();
        let factors = factors.map(|&table| peaks[usize::from(table)]);
        let sum = &mut sums[usize::from(term.output)];
        let mut largest = 0.0_f32;
        *sum = product::add_seen(*sum, weight, factors, |p| largest = largest.max(p));
        if !within(largest) {
            return Err(LoadError::TermMagnitude {
                term: number as u16,
            });
        }
    }
    measure_grids(plan, &contents.grids, sums)?;
    match sums.iter().position(|&sum| !within(sum)) {
        Some(axis) => Err(LoadError::OutputMagnitude { axis: axis as u16 }),
        None => Ok(()),
    }
}

/// Largest magnitude that the weight of a term can have.
fn largest_weight<C: Room>(plan: &Plan<'_, C>, term: &PackedTerm) -> f32 {
    if term.place == FIXED {
        return term.weight.abs();
    }
    let limits = plan.weights().limits_at(term.place);
    limits.map_or(0.0, |[low, high]| low.abs().max(high.abs()))
}

fn measure_tables<C: Room>(
    plan: &Plan<'_, C>,
    contents: &Contents<'_, C>,
    peaks: &mut C::TableList<f32>,
) -> Result<(), LoadError> {
    let mut table = 0_u16;
    for bank in contents.banks.iter() {
        let tables = usize::from(bank.tables);
        let first = bank.first as usize;
        let count = bank.points as usize * tables;
        work::count(count + tables);
        for column in 0..tables {
            let peak = peak(plan, bank.format, first..first + count, column, tables);
            let mut peak = peak.map_err(|point| LoadError::TableSample { table, point })?;
            if bank.format == SampleFormat::I16 {
                peak *= plan.scales()[usize::from(table)];
            }
            if !within(peak) {
                return Err(LoadError::TableMagnitude { table });
            }
            peaks.append(peak);
            table += 1;
        }
    }
    Ok(())
}

fn measure_grids<C: Room>(
    plan: &Plan<'_, C>,
    grids: &[Grid],
    sums: &mut [f32],
) -> Result<(), LoadError> {
    for (number, grid) in grids.iter().enumerate() {
        let width = grid.outputs.len();
        let first = grid.first as usize;
        let count = grid.nodes() as usize * width;
        work::count(count + width);
        for (place, &output) in grid.outputs.iter().enumerate() {
            let peak = peak(plan, grid.format, first..first + count, place, width);
            let mut peak = peak.map_err(|node| LoadError::GridSample {
                grid: number as u16,
                node,
            })?;
            if grid.format == SampleFormat::I16 {
                peak *= grid.scales[place];
            }
            sums[usize::from(output)] += peak;
        }
    }
    Ok(())
}

/// Largest magnitude, before scaling, of the samples at `place` in rows of `width`, or the index of one that is not
/// finite.
fn peak<C: Room>(
    plan: &Plan<'_, C>,
    format: SampleFormat,
    samples: Range<usize>,
    place: usize,
    width: usize,
) -> Result<f32, u32> {
    let floats = plan.floats().unwrap_or_default();
    let shorts = plan.shorts().unwrap_or_default();
    let mut peak = 0.0_f32;
    let mut row = 0_u32;
    let mut at = samples.start + place;
    while at < samples.end {
        let value = match format {
            SampleFormat::F32 => floats.get(at).copied(),
            SampleFormat::I16 => shorts.get(at).map(|&v| f32::from(v)),
        };
        let value = value.filter(|v| v.is_finite()).ok_or(row)?;
        peak = peak.max(value.abs());
        row += 1;
        at += width;
    }
    Ok(peak)
}
