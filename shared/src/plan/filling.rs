//! Fills a plan item by item and checks each item as it is added.

mod open;

use super::Plan;
use super::lookup::{BankLookup, GridLookup};
use super::span::Span;
use super::terms::{FIXED, PackedTerm, divide};
use crate::description::{AUXILIARIES, Bank, Direction, FACTORS, GRID_INPUTS};
use crate::format::ALIGNMENT;
use crate::load_error::{LoadError, Part};
use crate::room::{Counts, Room};
use open::{OpenBank, OpenGrid, OpenTerm};

/// A plan being filled. If filling does not finish, the plan is left empty.
pub(crate) struct Filling<'p, 'a, C: Room> {
    plan: &'p mut Plan<'a, C>,
    axes: usize,
    /// Number of items added so far, including those that did not fit.
    needed: Counts,
    auxiliaries: usize,
    /// Number of samples, f32 and i16 …
    held: [u32; 2],
    /// … and how many of them the banks and grids added so far use.
    used: [u32; 2],
    finished: bool,
}

impl<C: Room> Drop for Filling<'_, '_, C> {
    fn drop(&mut self) {
        if !self.finished {
            self.plan.clear();
        }
    }
}

impl<'p, 'a, C: Room> Filling<'p, 'a, C> {
    /// `plan` must be empty.
    pub(super) fn new(plan: &'p mut Plan<'a, C>) -> Self {
        Self {
            plan,
            axes: 0,
            needed: Counts::default(),
            auxiliaries: 0,
            held: [0; 2],
            used: [0; 2],
            finished: false,
        }
    }

    /// Sets the number of samples, f32 and i16.
    pub(crate) fn samples(&mut self, held: [u32; 2]) {
        self.held = held;
    }

    /// Sets the number of axes.
    pub(crate) fn axes(&mut self, count: u32) -> Result<(), LoadError> {
        if count == 0 {
            return Err(LoadError::NoAxes);
        }
        self.axes = count as usize;
        self.needed.axes = self.needed.axes.max(count);
        Ok(())
    }

    /// Sets the number of auxiliaries.
    pub(crate) fn auxiliaries(&mut self, count: u32) -> Result<(), LoadError> {
        if count as usize > AUXILIARIES {
            return Err(LoadError::TooManyAuxiliaries { found: count });
        }
        self.auxiliaries = count as usize;
        Ok(())
    }

    /// Index of an input among the auxiliaries; `None` for an axis.
    fn auxiliary(&self, input: u8) -> Option<usize> {
        usize::from(input).checked_sub(self.axes)
    }

    /// Index of an input within [`Inputs`](crate::Inputs), read as one array: guarantee 1.
    fn slot(&self, part: Part, input: u8) -> Result<u8, LoadError> {
        match self.auxiliary(input) {
            None => Ok(input),
            Some(auxiliary) if auxiliary < self.auxiliaries => Ok((C::AXES + auxiliary) as u8),
            Some(_) => Err(LoadError::Input { part, input }),
        }
    }

    /// Samples are stored in the order of banks, then grids, without gaps, so they cannot overlap. Guarantee 3.
    fn take_samples(
        &mut self,
        part: Part,
        integer: bool,
        first: u32,
        samples: u64,
    ) -> Result<(), LoadError> {
        let section = usize::from(integer);
        if first != self.used[section] {
            return Err(LoadError::SamplesMisplaced { part });
        }
        let end = u64::from(first).saturating_add(samples);
        if end > u64::from(self.held[section]) {
            return Err(LoadError::SamplesOutside { part });
        }
        self.used[section] = end as u32;
        Ok(())
    }

    /// Begins the next bank, with index `number`.
    pub(crate) fn bank(
        &mut self,
        number: u16,
        bank: &Bank,
    ) -> Result<OpenBank<'_, 'p, 'a, C>, LoadError> {
        let part = Part::Bank(number);
        if bank.tables == 0 {
            return Err(LoadError::EmptyBank { bank: number });
        }
        let slot = self.slot(part, bank.input)?;
        let span = Span::new(
            part,
            slot,
            bank.start,
            bank.step,
            bank.points,
            bank.modulo,
            bank.interpolation,
        )?;
        if bank.direction != Direction::Both && self.auxiliary(bank.input).is_some() {
            return Err(LoadError::DirectionOfAuxiliary { bank: number });
        }
        Ok(OpenBank {
            lookup: BankLookup::new(bank, span),
            part,
            filling: self,
        })
    }

    /// All banks have been added: guarantee 4. Before this call no term can name a table.
    pub(crate) fn end_banks(&mut self) -> Result<(), LoadError> {
        let found = self.needed.tables;
        if found > 255 {
            return Err(LoadError::TooManyTables { found });
        }
        self.plan.tables = found as u16;
        Ok(())
    }

    /// Begins the next term, with index `term`, whose weight is fixed or has limits.
    pub(crate) fn term(
        &mut self,
        term: u16,
        output: u8,
        weight: f32,
        limits: Option<[f32; 2]>,
    ) -> Result<OpenTerm<'_, 'p, 'a, C>, LoadError> {
        if usize::from(output) >= self.axes {
            return Err(LoadError::TermOutput { term });
        }
        if !weight.is_finite() {
            return Err(LoadError::Weight { term });
        }
        if let Some([low, high]) = limits {
            if !(low.is_finite() && high.is_finite() && low <= high) {
                return Err(LoadError::Limits { term });
            }
            if !(weight >= low && weight <= high) {
                return Err(LoadError::WeightOutsideLimits { term });
            }
            if self.plan.weights.is_full() {
                return Err(LoadError::TooManyAdjustable { term });
            }
        }
        Ok(OpenTerm {
            packed: PackedTerm {
                weight,
                factors: [C::TABLES as u8; FACTORS],
                next: 0,
                output,
                count: 0,
                place: FIXED,
            },
            limits,
            term,
            filling: self,
        })
    }

    /// Begins the next grid, with index `number` and the given number of inputs.
    pub(crate) fn grid(
        &mut self,
        grid: u16,
        inputs: u32,
    ) -> Result<OpenGrid<'_, 'p, 'a, C>, LoadError> {
        if inputs == 0 || inputs as usize > GRID_INPUTS {
            return Err(LoadError::GridInputs {
                grid,
                found: inputs,
            });
        }
        Ok(OpenGrid {
            lookup: GridLookup::EMPTY,
            // Missing inputs come first, so that the last input of every grid varies fastest.
            next: GRID_INPUTS - inputs as usize,
            inputs: inputs as usize,
            grid,
            filling: self,
        })
    }

    /// Locates the two sections of samples and uses them in place: guarantees 3 and 9.
    fn place_samples(&mut self, blob: &'a [u8], described: usize) -> Result<(), LoadError> {
        let [floats, shorts] = self.held;
        let start = described.next_multiple_of(ALIGNMENT);
        let computed = start as u64 + 4 * u64::from(floats) + 2 * u64::from(shorts);
        if computed != blob.len() as u64 {
            return Err(LoadError::SectionLength {
                stated: blob.len() as u32,
                computed: u32::try_from(computed).unwrap_or(u32::MAX),
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
        self.plan.floats = Some(bytemuck::try_cast_slice(floats).map_err(misaligned)?);
        self.plan.shorts = Some(bytemuck::try_cast_slice(shorts).map_err(misaligned)?);
        Ok(())
    }

    /// Last step: locates the samples, each of which must belong to a bank or a grid, and prepares the items for the
    /// kernel. By now the whole blob has been read: what did not fit is refused here, so that the error names every
    /// capacity that is too small.
    pub(super) fn finish(mut self, blob: &'a [u8], described: usize) -> Result<(), LoadError> {
        if self.used != self.held {
            return Err(LoadError::UnusedSamples);
        }
        self.place_samples(blob, described)?;
        let (needed, held) = (self.needed, Counts::of::<C>());
        if !needed.fits(held) {
            return Err(LoadError::TooSmall { needed, held });
        }
        let plan = &mut *self.plan;
        for bank in plan.banks.iter_mut().filter(|bank| bank.straight) {
            let samples = plan.floats.unwrap_or_default().get(bank.first as usize..);
            if let Some(&[a, b, ..]) = samples {
                bank.line = [a, b - a];
            }
        }
        plan.others = divide::<C>(
            self.axes,
            &mut plan.terms,
            &mut plan.sums,
            &mut plan.products,
        );
        self.finished = true;
        Ok(())
    }
}
