//! Reading a blob into a [`Compensation`], with every check that evaluation relies on.
//!
//! **Panic contract.** Any bytes at all are either loaded or refused with a [`LoadError`]; no
//! input makes this module panic, loop for longer than the blob is long, or allocate. The layout
//! is specified in `docs/src/format.md`.
//!
//! The description is decoded item by item straight into its place: deserialising a whole
//! compensation by value would cost twice its size in stack.

use serde::Deserialize;

use crate::compensation::Compensation;
use crate::description::{
    AUXILIARIES, Auxiliary, AuxiliaryKind, Axis, Bank, Direction, FACTORS, GRID_INPUTS,
    GRID_OUTPUTS, Grid, GridAxis, Interpolation, Policy, SampleFormat,
};
use crate::header::{self, ALIGNMENT, HEADER, Held};
use crate::load_error::{Capacity, LoadError, Part};
use crate::lookup::{BankLookup, FIXED, GridLookup, PLAIN_WIDTH, PackedTerm, Span};
use crate::room::{List, Room, Usual};
use crate::work;

/// Bounds of axes lie between this …
const LEAST_BOUND: f32 = 1e-9;
/// … and this, so that what is computed from them is finite.
const LARGEST_BOUND: f32 = 1e9;
/// Scales are normal numbers whose products with an i16 stay far below [`MAGNITUDE`](crate::magnitude::MAGNITUDE).
const LEAST_SCALE: f32 = 1e-30;

/// Walks through the description.
struct Reader<'a> {
    rest: &'a [u8],
    /// Why the rest is not read.
    error: Option<LoadError>,
}

/// The reader says why. The error itself, handed through every item, would be a third of the code.
struct Damaged;

impl<'a> Reader<'a> {
    fn refuse<T>(&mut self, error: LoadError) -> Result<T, Damaged> {
        self.error = Some(error);
        Err(Damaged)
    }

    /// What others have found.
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

    /// The variant of an enumeration, out of those that version 1 knows.
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

/// `count` as the index type of errors; nothing that passes the capacity checks exceeds it.
fn index(count: u32) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

fn bounded(value: f32, least: f32) -> bool {
    value >= least && value <= LARGEST_BOUND
}

impl<'a, C: Room> Compensation<'a, C> {
    /// Reads a file: `blob` has exactly the stated length and starts at a multiple of 4 bytes.
    ///
    /// The samples are used where they are. On error `self` is left [empty](Self::empty).
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn load(&mut self, blob: &'a [u8]) -> Result<(), LoadError> {
        self.load_held(blob, Held::Exactly)
    }

    /// Like [`load`](Self::load), from a flash slot: bytes after the stated length are ignored.
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn load_slot(&mut self, slot: &'a [u8]) -> Result<(), LoadError> {
        self.load_held(slot, Held::AtLeast)
    }

    /// Like [`load`](Self::load), by value: convenient where the stack is large, for it takes twice the size
    /// of a compensation. [`empty`](Self::empty) and `load` take nothing but the place itself.
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn from_blob(blob: &'a [u8]) -> Result<Self, LoadError> {
        let mut compensation = Self::empty();
        match compensation.load(blob) {
            Ok(()) => Ok(compensation),
            Err(error) => Err(error),
        }
    }

    fn load_held(&mut self, bytes: &'a [u8], held: Held) -> Result<(), LoadError> {
        self.clear();
        let result = header::open(bytes, held).and_then(|blob| {
            self.read(blob)?;
            self.measure()?;
            self.finish();
            Ok(())
        });
        if result.is_err() {
            self.clear();
        }
        result
    }

    fn read(&mut self, blob: &'a [u8]) -> Result<(), LoadError> {
        let mut reader = Reader {
            rest: &blob[HEADER..],
            error: None,
        };
        let counts = self.read_description(&mut reader);
        match (counts, reader.error) {
            (Ok([floats, shorts]), None) => {
                let described = blob.len() - reader.rest.len();
                self.place_samples(blob, described, floats, shorts)
            }
            // There is one wherever reading ends early.
            (_, error) => Err(error.unwrap_or(LoadError::UnusedSamples)),
        }
    }

    /// All but the samples; how many there are of each format.
    fn read_description(&mut self, r: &mut Reader<'a>) -> Result<[u32; 2], Damaged> {
        self.machine = Some(r.take(Part::Machine)?);
        self.policy = r.policy()?;
        let held = [r.take(Part::SampleCounts)?, r.take(Part::SampleCounts)?];
        self.read_axes(r)?;
        self.read_auxiliaries(r)?;
        let mut used = [0_u32; 2];
        self.read_banks(r, held, &mut used)?;
        self.read_terms(r)?;
        self.read_grids(r, held, &mut used)?;
        if used == held {
            Ok(held)
        } else {
            r.refuse(LoadError::UnusedSamples)
        }
    }

    /// Finds the two sample sections and takes them as they lie.
    fn place_samples(
        &mut self,
        blob: &'a [u8],
        described: usize,
        floats: u32,
        shorts: u32,
    ) -> Result<(), LoadError> {
        let start = described.next_multiple_of(ALIGNMENT);
        let computed = start as u64 + 4 * u64::from(floats) + 2 * u64::from(shorts);
        if computed != blob.len() as u64 {
            return Err(LoadError::SectionLength {
                stated: blob.len() as u32,
                computed,
            });
        }
        if blob[described..start].iter().any(|&byte| byte != 0) {
            return Err(LoadError::PaddingNotZero);
        }
        if !(blob.as_ptr() as usize).is_multiple_of(4) {
            return Err(LoadError::Misaligned);
        }
        let split = start + 4 * floats as usize;
        let misaligned = |_| LoadError::Misaligned;
        let (floats, shorts) = (&blob[start..split], &blob[split..]);
        self.floats = Some(bytemuck::try_cast_slice(floats).map_err(misaligned)?);
        self.shorts = Some(bytemuck::try_cast_slice(shorts).map_err(misaligned)?);
        self.length = blob.len() as u32;
        Ok(())
    }

    fn read_axes(&mut self, r: &mut Reader<'a>) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Axes)?;
        if count == 0 {
            return r.refuse(LoadError::NoAxes);
        }
        if count as usize > C::AXES {
            return r.refuse(LoadError::TooSmall {
                capacity: Capacity::Axes,
                needed: count,
                held: C::AXES as u32,
            });
        }
        for axis in 0..index(count) {
            let part = Part::Axis(axis);
            let found = Axis {
                name: r.take(part)?,
                travel: r.take(part)?,
                period: r.take(part)?,
                value_bound: r.take(part)?,
                rate_bound: r.take(part)?,
                hysteresis: r.take(part)?,
                ramp_rate: r.take(part)?,
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
            if !bounded(found.hysteresis, 0.0) {
                return r.refuse(LoadError::Hysteresis { axis });
            }
            if !bounded(found.ramp_rate, LEAST_BOUND) {
                return r.refuse(LoadError::RampRate { axis });
            }
            self.axes.append(found);
        }
        Ok(())
    }

    fn read_auxiliaries(&mut self, r: &mut Reader<'a>) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Auxiliaries)?;
        if count as usize > AUXILIARIES {
            return r.refuse(LoadError::TooManyAuxiliaries { found: count });
        }
        for auxiliary in 0..index(count) {
            let part = Part::Auxiliary(auxiliary);
            let found = Auxiliary {
                kind: r.variant(
                    part,
                    &[AuxiliaryKind::ToolLength, AuxiliaryKind::Temperature],
                )?,
                name: r.take(part)?,
                reference: r.take(part)?,
            };
            if !found.reference.is_finite() {
                return r.refuse(LoadError::Reference { auxiliary });
            }
            let _ = self.auxiliaries.push(found);
        }
        Ok(())
    }

    /// Place of an input within [`Inputs`](crate::Inputs) read as one array.
    fn slot(&self, part: Part, input: u8) -> Result<u8, LoadError> {
        let number = usize::from(input);
        if number < self.axes.len() {
            Ok(input)
        } else if number < self.axes.len() + self.auxiliaries.len() {
            Ok((C::AXES + number - self.axes.len()) as u8)
        } else {
            Err(LoadError::Input { part, input })
        }
    }

    /// Whether a modulo input of a bank or grid is the same after a turn of its axis.
    fn closes(&self, part: Part, input: u8, span: &Span) -> Result<(), LoadError> {
        // What rounding may take from the step, the product and the quotient.
        const ROUNDING: f32 = 1.0 / 4_194_304.0;
        let period = self.axes.get(usize::from(input)).map_or(0.0, |a| a.period);
        if span.is_modulo() && period > 0.0 {
            let times = period / span.period;
            let whole = (times + 0.5) as u32 as f32;
            let off = if times > whole {
                times - whole
            } else {
                whole - times
            };
            if off > ROUNDING * whole {
                return Err(LoadError::PeriodMismatch { part });
            }
        }
        Ok(())
    }

    fn read_banks(
        &mut self,
        r: &mut Reader<'a>,
        held: [u32; 2],
        used: &mut [u32; 2],
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Banks)?;
        // Counted on beyond the capacity, so that the error says how much is needed.
        let mut tables = 0_u32;
        for bank in 0..count {
            let number = index(bank);
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
            if found.tables == 0 {
                return r.refuse(LoadError::EmptyBank { bank: number });
            }
            let slot = r.checked(self.slot(part, found.input))?;
            let span = r.checked(Span::new(
                part,
                slot,
                found.start,
                found.step,
                found.points,
                found.modulo,
            ))?;
            r.checked(self.closes(part, found.input, &span))?;
            if found.direction != Direction::Both && usize::from(slot) >= C::AXES {
                return r.refuse(LoadError::DirectionOfAuxiliary { bank: number });
            }
            let scales: u32 = r.take(part)?;
            let integer = found.format == SampleFormat::I16;
            if scales != if integer { u32::from(found.tables) } else { 0 } {
                return r.refuse(LoadError::ScaleCount {
                    part,
                    found: scales,
                });
            }
            let before = tables as usize;
            tables = tables.saturating_add(u32::from(found.tables));
            if integer {
                for table in 0..found.tables {
                    let scale = r.take(part)?;
                    if !bounded(scale, LEAST_SCALE) {
                        return r.refuse(LoadError::Scale { part, index: table });
                    }
                    self.scales.append(scale);
                }
            } else {
                // Those that there is room for, not those that are claimed.
                let room = C::TABLES - self.scales.len();
                for _ in 0..room.min(usize::from(found.tables)) {
                    work::count(1);
                    self.scales.append(1.0);
                }
            }
            let samples = u64::from(found.points) * u64::from(found.tables);
            r.checked(take_samples(
                part,
                integer,
                found.first,
                samples,
                held,
                used,
            ))?;
            // Beyond their capacity they are counted only.
            self.banks.append(found);
            let first = before.min(C::TABLES) as u16;
            self.lookups
                .append(BankLookup::new(&found, span, integer, first));
        }
        if tables > 255 {
            return r.refuse(LoadError::TooManyTables { found: tables });
        }
        if tables as usize > C::TABLES {
            return r.refuse(LoadError::TooSmall {
                capacity: Capacity::Tables,
                needed: tables,
                held: C::TABLES as u32,
            });
        }
        if count as usize > C::BANKS {
            return r.refuse(LoadError::TooSmall {
                capacity: Capacity::Banks,
                needed: count,
                held: C::BANKS as u32,
            });
        }
        self.tables = tables as u16;
        Ok(())
    }

    fn read_terms(&mut self, r: &mut Reader<'a>) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Terms)?;
        if count as usize > C::TERMS {
            return r.refuse(LoadError::TooSmall {
                capacity: Capacity::Terms,
                needed: count,
                held: C::TERMS as u32,
            });
        }
        for term in 0..index(count) {
            let part = Part::Term(term);
            let output: u8 = r.take(part)?;
            let weight: f32 = r.take(part)?;
            let limits: Option<[f32; 2]> = r.take(part)?;
            if usize::from(output) >= self.axes.len() {
                return r.refuse(LoadError::TermOutput { term });
            }
            if !weight.is_finite() {
                return r.refuse(LoadError::Weight { term });
            }
            let place = match limits {
                None => FIXED,
                Some([low, high]) => {
                    if !(low.is_finite() && high.is_finite() && low <= high) {
                        return r.refuse(LoadError::Limits { term });
                    }
                    if !(weight >= low && weight <= high) {
                        return r.refuse(LoadError::WeightOutsideLimits { term });
                    }
                    match self.weights.push(term, weight, [low, high]) {
                        Some(place) => place,
                        None => return r.refuse(LoadError::TooManyAdjustable { term }),
                    }
                }
            };
            let found: u32 = r.take(part)?;
            if found as usize > FACTORS {
                return r.refuse(LoadError::TooManyFactors { term, found });
            }
            let mut factors = [C::TABLES as u8; FACTORS];
            for factor in &mut factors[..found as usize] {
                let table: u8 = r.take(part)?;
                if u16::from(table) >= self.tables {
                    return r.refuse(LoadError::Factor { term, table });
                }
                *factor = table;
            }
            self.terms.append(PackedTerm {
                weight,
                factors,
                run: 0,
                output,
                count: found as u8,
                most: 0,
                place,
            });
        }
        Ok(())
    }

    fn read_grids(
        &mut self,
        r: &mut Reader<'a>,
        held: [u32; 2],
        used: &mut [u32; 2],
    ) -> Result<(), Damaged> {
        let count: u32 = r.take(Part::Grids)?;
        if count as usize > C::GRIDS {
            return r.refuse(LoadError::TooSmall {
                capacity: Capacity::Grids,
                needed: count,
                held: C::GRIDS as u32,
            });
        }
        for grid in 0..index(count) {
            self.read_grid(r, grid, held, used)?;
        }
        Ok(())
    }

    fn read_grid(
        &mut self,
        r: &mut Reader<'a>,
        grid: u16,
        held: [u32; 2],
        used: &mut [u32; 2],
    ) -> Result<(), Damaged> {
        let part = Part::Grid(grid);
        let mut axes = heapless::Vec::<GridAxis, GRID_INPUTS>::new();
        // Missing inputs come first, so that the last input of every grid varies fastest.
        let mut spans = [Span::EMPTY; GRID_INPUTS];
        let inputs: u32 = r.take(part)?;
        if inputs == 0 || inputs as usize > GRID_INPUTS {
            return r.refuse(LoadError::GridInputs {
                grid,
                found: inputs,
            });
        }
        for span in &mut spans[GRID_INPUTS - inputs as usize..] {
            let axis = GridAxis {
                input: r.take(part)?,
                start: r.take(part)?,
                step: r.take(part)?,
                points: r.take(part)?,
                modulo: r.take(part)?,
            };
            let slot = r.checked(self.slot(part, axis.input))?;
            *span = r.checked(Span::new(
                part,
                slot,
                axis.start,
                axis.step,
                axis.points,
                axis.modulo,
            ))?;
            r.checked(self.closes(part, axis.input, span))?;
            let _ = axes.push(axis);
        }
        let width: u32 = r.take(part)?;
        if width == 0 || width as usize > GRID_OUTPUTS {
            return r.refuse(LoadError::GridOutputs { grid });
        }
        let mut list = heapless::Vec::<u8, GRID_OUTPUTS>::new();
        let mut outputs = [0; GRID_OUTPUTS];
        for output in &mut outputs[..width as usize] {
            *output = r.take(part)?;
            if usize::from(*output) >= self.axes.len() || list.contains(output) {
                return r.refuse(LoadError::GridOutputs { grid });
            }
            let _ = list.push(*output);
        }
        let format = r.format(part)?;
        let integer = format == SampleFormat::I16;
        let found: u32 = r.take(part)?;
        if found != if integer { width } else { 0 } {
            return r.refuse(LoadError::ScaleCount { part, found });
        }
        let mut stored = heapless::Vec::new();
        let mut scales = [1.0; GRID_OUTPUTS];
        for (number, scale) in scales[..found as usize].iter_mut().enumerate() {
            *scale = r.take(part)?;
            if !bounded(*scale, LEAST_SCALE) {
                return r.refuse(LoadError::Scale {
                    part,
                    index: number as u16,
                });
            }
            let _ = stored.push(*scale);
        }
        let found = Grid {
            axes,
            outputs: list,
            format,
            scales: stored,
            first: r.take(part)?,
        };
        let samples = found.nodes().saturating_mul(u64::from(width));
        r.checked(take_samples(
            part,
            integer,
            found.first,
            samples,
            held,
            used,
        ))?;
        // Every stride is at most the sample count, which was just found to be a u32.
        let mut strides = [width; GRID_INPUTS];
        for i in (0..GRID_INPUTS - 1).rev() {
            strides[i] = strides[i + 1] * (spans[i + 1].last + 1);
        }
        self.grid_lookups.append(GridLookup {
            spans,
            strides,
            first: found.first,
            scales,
            outputs,
            width: width as u8,
            integer,
            plain: inputs as usize == GRID_INPUTS
                && !integer
                && width as usize == PLAIN_WIDTH
                && !spans.iter().any(Span::is_modulo),
        });
        self.grids.append(found);
        Ok(())
    }
}

impl<'a> Compensation<'a, Usual> {
    /// [Empty](Self::empty), with the capacities that hold unless told otherwise.
    #[must_use]
    pub const fn new() -> Self {
        Self::empty()
    }

    /// Reads a file by value, with the capacities that hold unless told otherwise: see
    /// [`from_blob`](Self::from_blob).
    ///
    /// # Errors
    /// See [`LoadError`].
    pub fn decode(blob: &'a [u8]) -> Result<Self, LoadError> {
        Self::from_blob(blob)
    }
}

/// Samples lie in the order of banks, then grids, without gaps: this also keeps them apart.
fn take_samples(
    part: Part,
    integer: bool,
    first: u32,
    samples: u64,
    held: [u32; 2],
    used: &mut [u32; 2],
) -> Result<(), LoadError> {
    let section = usize::from(integer);
    if first != used[section] {
        return Err(LoadError::SamplesMisplaced { part });
    }
    let end = u64::from(first).saturating_add(samples);
    if end > u64::from(held[section]) {
        return Err(LoadError::SamplesOutside { part });
    }
    used[section] = end as u32;
    Ok(())
}

#[cfg(all(test, feature = "encode"))]
mod tests;
