//! Items being added to a plan. Their types enforce the order of the calls.

use super::Filling;
use crate::description::{
    FACTORS, GRID_INPUTS, GRID_OUTPUTS, GridAxis, Interpolation, SampleFormat,
};
use crate::load_error::{LoadError, Part};
use crate::plan::lookup::{BankLookup, GridLookup, PLAIN_WIDTH};
use crate::plan::span::Span;
use crate::plan::terms::{FIXED, PackedTerm};
use crate::room::{List, Room};
use crate::work;

/// A bank being added.
pub(crate) struct OpenBank<'f, 'p, 'a, C: Room> {
    pub(super) lookup: BankLookup,
    pub(super) part: Part,
    pub(super) filling: &'f mut Filling<'p, 'a, C>,
}

impl<C: Room> OpenBank<'_, '_, '_, C> {
    /// Points.
    pub(crate) fn span(&self) -> &Span {
        &self.lookup.span
    }

    /// States the number of scales that follow: one per table of integers.
    pub(crate) fn scales(&mut self, found: u32) -> Result<(), LoadError> {
        let tables = u32::from(self.lookup.tables);
        if found == if self.lookup.integer { tables } else { 0 } {
            Ok(())
        } else {
            let part = self.part;
            Err(LoadError::ScaleCount { part, found })
        }
    }

    /// Adds the scale of the next table.
    pub(crate) fn scale(&mut self, scale: f32) {
        self.filling.plan.scales.append(scale);
    }

    /// Adds the bank if it and its tables fit; otherwise only counts them.
    pub(crate) fn end(self) -> Result<(), LoadError> {
        let Self {
            mut lookup,
            part,
            filling,
        } = self;
        let samples = lookup.span.points() * u64::from(lookup.tables);
        filling.take_samples(part, lookup.integer, lookup.first, samples)?;
        filling.needed.banks = filling.needed.banks.saturating_add(1);
        let before = filling.needed.tables;
        filling.needed.tables = before.saturating_add(u32::from(lookup.tables));
        let tables = filling.needed.tables as usize;
        // As many as fit, not as many as claimed.
        while filling.plan.scales.len() < tables.min(C::TABLES) {
            work::count(1);
            filling.plan.scales.append(1.0);
        }
        if tables <= C::TABLES {
            lookup.table = before as u16;
            filling.plan.banks.append(lookup);
        }
        Ok(())
    }
}

/// A term being added.
pub(crate) struct OpenTerm<'f, 'p, 'a, C: Room> {
    pub(super) packed: PackedTerm,
    /// Limits of an adjustable weight.
    pub(super) limits: Option<[f32; 2]>,
    pub(super) term: u16,
    pub(super) filling: &'f mut Filling<'p, 'a, C>,
}

impl<C: Room> OpenTerm<'_, '_, '_, C> {
    /// States the number of factors that follow.
    pub(crate) fn factors(&self, found: u32) -> Result<(), LoadError> {
        if found as usize > FACTORS {
            let term = self.term;
            return Err(LoadError::TooManyFactors { term, found });
        }
        Ok(())
    }

    /// Adds a table as the next factor.
    pub(crate) fn factor(&mut self, table: u8) -> Result<(), LoadError> {
        let term = self.term;
        if u16::from(table) >= self.filling.plan.tables {
            return Err(LoadError::Factor { term, table });
        }
        let PackedTerm { factors, count, .. } = &mut self.packed;
        let Some(factor) = factors.get_mut(usize::from(*count)) else {
            let found = u32::from(*count) + 1;
            return Err(LoadError::TooManyFactors { term, found });
        };
        *factor = table;
        *count += 1;
        Ok(())
    }

    /// Adds the term if it fits; otherwise only counts it.
    pub(crate) fn end(mut self) {
        let terms = &mut self.filling.needed.terms;
        *terms = terms.saturating_add(1);
        let plan = &mut *self.filling.plan;
        if let Some(limits) = self.limits {
            let place = plan.weights.push(self.term, self.packed.weight, limits);
            self.packed.place = place.unwrap_or(FIXED);
        }
        plan.terms.append(self.packed);
    }
}

/// A grid being added.
pub(crate) struct OpenGrid<'f, 'p, 'a, C: Room> {
    pub(super) lookup: GridLookup,
    /// Index of the next input.
    pub(super) next: usize,
    pub(super) inputs: usize,
    pub(super) grid: u16,
    pub(super) filling: &'f mut Filling<'p, 'a, C>,
}

impl<C: Room> OpenGrid<'_, '_, '_, C> {
    /// Adds the next input; returns the points along it.
    pub(crate) fn input(&mut self, axis: &GridAxis) -> Result<&Span, LoadError> {
        let (part, grid) = (Part::Grid(self.grid), self.grid);
        let slot = self.filling.slot(part, axis.input)?;
        let Some(span) = self.lookup.spans.get_mut(self.next) else {
            let found = self.inputs as u32 + 1;
            return Err(LoadError::GridInputs { grid, found });
        };
        let linear = Interpolation::Linear;
        *span = Span::new(
            part,
            slot,
            axis.start,
            axis.step,
            axis.points,
            axis.modulo,
            linear,
        )?;
        self.next += 1;
        Ok(span)
    }

    /// States the number of outputs that follow.
    pub(crate) fn outputs(&self, width: u32) -> Result<(), LoadError> {
        if width == 0 || width as usize > GRID_OUTPUTS {
            return Err(LoadError::GridOutputs { grid: self.grid });
        }
        Ok(())
    }

    /// Adds the next output.
    pub(crate) fn output(&mut self, output: u8) -> Result<(), LoadError> {
        let refused = LoadError::GridOutputs { grid: self.grid };
        let GridLookup { outputs, width, .. } = &mut self.lookup;
        let (taken, free) = outputs.split_at_mut(usize::from(*width));
        if usize::from(output) >= self.filling.axes || taken.contains(&output) {
            return Err(refused);
        }
        *free.first_mut().ok_or(refused)? = output;
        *width += 1;
        Ok(())
    }

    /// States the format of the samples and the number of scales that follow: one per output of integers.
    pub(crate) fn format(&mut self, format: SampleFormat, scales: u32) -> Result<(), LoadError> {
        let integer = format == SampleFormat::I16;
        self.lookup.integer = integer;
        let width = u32::from(self.lookup.width);
        if scales == if integer { width } else { 0 } {
            Ok(())
        } else {
            let part = Part::Grid(self.grid);
            let found = scales;
            Err(LoadError::ScaleCount { part, found })
        }
    }

    /// Sets the scale of the output at index `place`.
    pub(crate) fn scale(&mut self, place: usize, scale: f32) {
        if let Some(held) = self.lookup.scales.get_mut(place) {
            *held = scale;
        }
    }

    /// Adds the grid if it fits, otherwise only counts it; `first` is the index of its first sample.
    #[inline(always)]
    pub(crate) fn end(mut self, first: u32) -> Result<(), LoadError> {
        let (lookup, grid) = (&mut self.lookup, self.grid);
        if self.next != GRID_INPUTS {
            let found = (self.next + self.inputs - GRID_INPUTS) as u32;
            return Err(LoadError::GridInputs { grid, found });
        }
        if lookup.width == 0 {
            return Err(LoadError::GridOutputs { grid });
        }
        lookup.first = first;
        if !lookup.integer {
            lookup.scales = [1.0; GRID_OUTPUTS];
        }
        // Every stride is at most the sample count, which is checked to fit a u32 before any stride is used.
        let mut samples = u64::from(lookup.width);
        for (span, stride) in lookup.spans.iter().zip(&mut lookup.strides).rev() {
            *stride = samples as u32;
            samples = samples.saturating_mul(span.points());
        }
        let part = Part::Grid(grid);
        self.filling
            .take_samples(part, lookup.integer, first, samples)?;
        let plain = self.inputs == GRID_INPUTS
            && !lookup.integer
            && usize::from(lookup.width) == PLAIN_WIDTH;
        if !plain {
            lookup.spans.iter_mut().for_each(|span| span.direct = 0.0);
        }
        let grids = &mut self.filling.needed.grids;
        *grids = grids.saturating_add(1);
        self.filling.plan.grids.append(*lookup);
        Ok(())
    }
}
