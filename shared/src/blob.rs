//! Reads the description of a blob and performs every check that the plan does not do itself.
//!
//! **Panic contract.** Any byte sequence is either loaded or refused with a [`LoadError`]. No input makes this module
//! panic, allocate, or loop longer than the length of the blob. The layout is specified in `docs/src/format.md`.
//!
//! The description is decoded item by item into its final place: deserialising a whole compensation by value would need
//! twice its size in stack.

use serde::Deserialize;

use crate::contents::Contents;
use crate::description::{
    Auxiliary, AuxiliaryKind, Axis, Bank, Direction, Grid, GridAxis, Interpolation, Policy,
    SampleFormat, Sensor,
};
use crate::format::HEADER;
use crate::load_error::{LoadError, Part};
use crate::plan::{Filling, Span};
use crate::room::{List, Room};
use crate::work;

/// Smallest accepted bound of an axis …
const LEAST_BOUND: f32 = 1e-9;
/// … and the largest, which keeps everything computed from them finite.
const LARGEST_BOUND: f32 = 1e9;
/// Scales are normal numbers whose products with an i16 stay far below `MAGNITUDE` in `magnitude.rs`.
const LEAST_SCALE: f32 = 1e-30;

/// Reads through the description.
struct Reader<'a> {
    rest: &'a [u8],
    /// Why reading stopped.
    error: Option<LoadError>,
}

/// The reader holds the error. Passing the error itself through every item would add a third to the code size.
struct Damaged;

impl<'a> Reader<'a> {
    fn refuse<T>(&mut self, error: LoadError) -> Result<T, Damaged> {
        self.error = Some(error);
        Err(Damaged)
    }

    /// Records an error found elsewhere.
    fn checked<T>(&mut self, result: Result<T, LoadError>) -> Result<T, Damaged> {
        result.or_else(|error| self.refuse(error))
    }

    fn take<T: Deserialize<'a>>(&mut self, part: Part) -> Result<T, Damaged> {
        match postcard::take_from_bytes(self.rest) {
            Ok((value, rest)) => {
                work::count(self.rest.len() - rest.len());
                self.rest = rest;
                Ok(value)
            }
            Err(postcard::Error::DeserializeUnexpectedEnd) => {
                self.refuse(LoadError::Truncated { part })
            }
            Err(_) => self.refuse(LoadError::Malformed { part }),
        }
    }

    /// Variant of an enumeration, out of those known to version 1.
    fn variant<T: Copy>(&mut self, part: Part, known: &[T]) -> Result<T, Damaged> {
        let found: u32 = self.take(part)?;
        match known.get(found as usize) {
            Some(&variant) => Ok(variant),
            None => self.refuse(LoadError::UnknownVariant { part, found }),
        }
    }

    fn policy(&mut self) -> Result<Policy, Damaged> {
        let damping = 1.0;
        let known = [
            Policy::Orientation,
            Policy::Direction { damping },
            Policy::Position,
        ];
        match self.variant(Part::Policy, &known)? {
            Policy::Direction { .. } => {
                let damping: f32 = self.take(Part::Policy)?;
                if !(Policy::LEAST_DAMPING..=1.0).contains(&damping) {
                    return self.refuse(LoadError::Damping);
                }
                Ok(Policy::Direction { damping })
            }
            other => Ok(other),
        }
    }

    fn format(&mut self, part: Part) -> Result<SampleFormat, Damaged> {
        self.variant(part, &[SampleFormat::F32, SampleFormat::I16])
    }
}

/// `count` as the index type used in errors; no index that fits a target exceeds it.
fn index(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

#[inline(never)]
fn bounded(value: f32, least: f32) -> bool {
    value >= least && value <= LARGEST_BOUND
}

/// Reads the description of `blob`, whose header has been checked, into the empty `contents` and into the plan being
/// filled. Returns the offset where the description ends.
pub(crate) fn read<'a, C: Room>(
    blob: &'a [u8],
    filling: &mut Filling<'_, 'a, C>,
    contents: &mut Contents<'a, C>,
) -> Result<usize, LoadError> {
    let mut reader = Reader {
        rest: &blob[HEADER..],
        error: None,
    };
    match (contents.read(&mut reader, filling), reader.error) {
        (Ok(()), None) => Ok(blob.len() - reader.rest.len()),
        // Set whenever reading ends early.
        (_, error) => Err(error.unwrap_or(LoadError::UnusedSamples)),
    }
}

impl<'a, C: Room> Contents<'a, C> {
    /// Everything but the samples.
    fn read(&mut self, r: &mut Reader<'a>, to: &mut Filling<'_, 'a, C>) -> Result<(), Damaged> {
        self.machine = Some(r.take(Part::Machine)?);
        self.policy = r.policy()?;
        to.samples([r.take(Part::SampleCounts)?, r.take(Part::SampleCounts)?]);
        self.read_axes(r, to)?;
        self.read_auxiliaries(r, to)?;
        self.read_banks(r, to)?;
        self.read_terms(r, to)?;
        self.read_grids(r, to)
    }

    fn read_axes(
        &mut self,
        r: &mut Reader<'a>,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Axes)?;
        r.checked(to.axes(count))?;
        // Here and below, items beyond the capacity are read too, so that the error can report how much is needed.
        for axis in (0..count).map(index) {
            let part = Part::Axis(axis);
            let found = Axis {
                name: r.take(part)?,
                travel: r.take(part)?,
                period: r.take(part)?,
                value_bound: r.take(part)?,
                rate_bound: r.take(part)?,
                reversal_threshold: r.take(part)?,
                ramp_rate: r.take(part)?,
                reversal_rate: r.take(part)?,
                reversal_acceleration: r.take(part)?,
            };
            if !found.name.is_ascii_alphabetic() {
                return r.refuse(LoadError::AxisName { axis });
            }
            if self.axes.iter().any(|a| a.name == found.name) {
                return r.refuse(LoadError::DuplicateAxis { axis });
            }
            let [low, high] = found.travel;
            if !(low.is_finite() && high.is_finite() && low < high) {
                return r.refuse(LoadError::Travel { axis });
            }
            if found.period != 0.0 {
                if !bounded(found.period, LEAST_BOUND) {
                    return r.refuse(LoadError::AxisPeriod { axis });
                }
                if found.travel != [-f32::MAX, f32::MAX] {
                    return r.refuse(LoadError::EndlessTravel { axis });
                }
            }
            if !bounded(found.value_bound, LEAST_BOUND) {
                return r.refuse(LoadError::ValueBound { axis });
            }
            if !bounded(found.rate_bound, LEAST_BOUND) {
                return r.refuse(LoadError::RateBound { axis });
            }
            if !bounded(found.reversal_threshold, 0.0) {
                return r.refuse(LoadError::ReversalThreshold { axis });
            }
            if !bounded(found.ramp_rate, LEAST_BOUND) {
                return r.refuse(LoadError::RampRate { axis });
            }
            if !bounded(found.reversal_rate, LEAST_BOUND)
                || !bounded(found.reversal_acceleration, LEAST_BOUND)
            {
                return r.refuse(LoadError::Reversal { axis });
            }
            self.axes.append(found);
        }
        Ok(())
    }

    fn read_auxiliaries(
        &mut self,
        r: &mut Reader<'a>,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Auxiliaries)?;
        r.checked(to.auxiliaries(count))?;
        for auxiliary in (0..count).map(index) {
            let part = Part::Auxiliary(auxiliary);
            let kinds = [AuxiliaryKind::ToolLength, AuxiliaryKind::Temperature];
            let kind = r.variant(part, &kinds)?;
            let mut found = Auxiliary {
                kind,
                name: r.take(part)?,
                reference: r.take(part)?,
                sensor: Sensor::USUAL,
            };
            if !found.reference.is_finite() {
                return r.refuse(LoadError::Reference { auxiliary });
            }
            if kind == AuxiliaryKind::Temperature {
                found.sensor = Sensor {
                    lag_rate: r.take(part)?,
                    rate: r.take(part)?,
                    range: r.take(part)?,
                };
                let Sensor {
                    lag_rate,
                    rate,
                    range: [low, high],
                } = found.sensor;
                let lags = (Sensor::SLOWEST_LAG..=Sensor::FASTEST_LAG).contains(&lag_rate);
                if lag_rate != 0.0 && !lags {
                    return r.refuse(LoadError::LagRate { auxiliary });
                }
                let follows = (Sensor::SLOWEST..=Sensor::FASTEST).contains(&rate);
                let most = Sensor::HOTTEST;
                if !(follows
                    && found.reference.abs() <= most
                    && low >= -most
                    && high <= most
                    && low < high)
                {
                    return r.refuse(LoadError::Sensor { auxiliary });
                }
            }
            let _ = self.auxiliaries.push(found);
        }
        Ok(())
    }

    fn read_banks(
        &mut self,
        r: &mut Reader<'a>,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Banks)?;
        for number in (0..count).map(index) {
            let part = Part::Bank(number);
            let found = Bank {
                input: r.take(part)?,
                start: r.take(part)?,
                step: r.take(part)?,
                points: r.take(part)?,
                modulo: r.take(part)?,
                direction: r.variant(
                    part,
                    &[
                        Direction::Both,
                        Direction::Positive,
                        Direction::Negative,
                        Direction::Signed,
                    ],
                )?,
                interpolation: r.variant(part, &[Interpolation::Linear, Interpolation::Cubic])?,
                format: r.format(part)?,
                tables: r.take(part)?,
                first: r.take(part)?,
            };
            let mut put = r.checked(to.bank(number, &found))?;
            r.checked(closes(&self.axes, part, found.input, put.span()))?;
            let scales: u32 = r.take(part)?;
            r.checked(put.scales(scales))?;
            if found.format == SampleFormat::I16 {
                for table in 0..found.tables {
                    let scale = r.take(part)?;
                    if !bounded(scale, LEAST_SCALE) {
                        return r.refuse(LoadError::Scale { part, index: table });
                    }
                    put.scale(scale);
                }
            }
            r.checked(put.end())?;
            self.banks.append(found);
        }
        r.checked(to.end_banks())
    }

    fn read_terms(
        &mut self,
        r: &mut Reader<'a>,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Terms)?;
        for term in (0..count).map(index) {
            let part = Part::Term(term);
            let output: u8 = r.take(part)?;
            let weight: f32 = r.take(part)?;
            let limits: Option<[f32; 2]> = r.take(part)?;
            let mut put = r.checked(to.term(term, output, weight, limits))?;
            let found: u32 = r.take(part)?;
            r.checked(put.factors(found))?;
            for _ in 0..found {
                let table = r.take(part)?;
                r.checked(put.factor(table))?;
            }
            put.end();
        }
        Ok(())
    }

    fn read_grids(
        &mut self,
        r: &mut Reader<'a>,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Grids)?;
        for grid in (0..count).map(index) {
            self.read_grid(r, grid, to)?;
        }
        Ok(())
    }

    fn read_grid(
        &mut self,
        r: &mut Reader<'a>,
        grid: u16,
        to: &mut Filling<'_, 'a, C>,
    ) -> Result<(), Damaged> {
        let part = Part::Grid(grid);
        let mut found = Grid {
            axes: heapless::Vec::new(),
            outputs: heapless::Vec::new(),
            format: SampleFormat::F32,
            scales: heapless::Vec::new(),
            first: 0,
        };
        let inputs: u32 = r.take(part)?;
        let mut put = r.checked(to.grid(grid, inputs))?;
        for _ in 0..inputs {
            let axis = GridAxis {
                input: r.take(part)?,
                start: r.take(part)?,
                step: r.take(part)?,
                points: r.take(part)?,
                modulo: r.take(part)?,
            };
            let span = r.checked(put.input(&axis))?;
            r.checked(closes(&self.axes, part, axis.input, span))?;
            let _ = found.axes.push(axis);
        }
        let width: u32 = r.take(part)?;
        r.checked(put.outputs(width))?;
        for _ in 0..width {
            let output = r.take(part)?;
            r.checked(put.output(output))?;
            let _ = found.outputs.push(output);
        }
        found.format = r.format(part)?;
        let scales: u32 = r.take(part)?;
        r.checked(put.format(found.format, scales))?;
        for place in 0..scales {
            let scale = r.take(part)?;
            if !bounded(scale, LEAST_SCALE) {
                return r.refuse(LoadError::Scale {
                    part,
                    index: place as u16,
                });
            }
            put.scale(place as usize, scale);
            let _ = found.scales.push(scale);
        }
        found.first = r.take(part)?;
        r.checked(put.end(found.first))?;
        self.grids.append(found);
        Ok(())
    }
}

/// Whether one turn of its axis maps a modulo input of a bank or grid onto itself.
fn closes(axes: &[Axis], part: Part, input: u8, span: &Span) -> Result<(), LoadError> {
    // Rounding error allowed in the step, the product and the quotient.
    const ROUNDING: f32 = 1.0 / 4_194_304.0;
    let period = axes.get(usize::from(input)).map_or(0.0, |a| a.period);
    if span.is_modulo() && period > 0.0 {
        let times = period / span.period;
        let whole = (times + 0.5) as u32 as f32;
        if ROUNDING * whole < (times - whole).abs() {
            return Err(LoadError::PeriodMismatch { part });
        }
    }
    Ok(())
}

#[cfg(all(test, feature = "encode"))]
mod tests;
