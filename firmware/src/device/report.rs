//! What hello and status tell.

use trueaxis::link::{Capacities, Hello, Report, Slot, SlotReport, short_name};

use super::{Device, Machine, ServoAccess};
use crate::slots::TableFlash;

/// A number of the type in which it is told; the largest of those if it does not fit.
fn told<T: TryFrom<usize>>(number: usize, largest: T) -> T {
    T::try_from(number).unwrap_or(largest)
}

impl<F, S, M, const AXES: usize, const TABLES: usize, const TERMS: usize, const GRIDS: usize>
    Device<F, S, M, AXES, TABLES, TERMS, GRIDS>
where
    F: TableFlash,
    S: ServoAccess<AXES, TABLES, TERMS, GRIDS>,
    M: Machine,
{
    pub(super) fn identify(&self, session: u32) -> Hello<'_> {
        let compensation = self.loader.current();
        Hello {
            session,
            firmware: self.identity.firmware,
            board: self.identity.board,
            formats: [trueaxis::VERSION; 2],
            capacities: Capacities {
                axes: told(AXES, u8::MAX),
                tables: told(TABLES, u16::MAX),
                terms: told(TERMS, u16::MAX),
                grids: told(GRIDS, u16::MAX),
                slot: self.slots.capacity(),
            },
            period: self.identity.period,
            while_busy: self.slots.flash().while_busy(),
            machine: short_name(compensation.machine()),
            axes: compensation
                .axes()
                .iter()
                .map(|axis| char::from(axis.name))
                .collect(),
            auxiliaries: told(compensation.auxiliaries().len(), u8::MAX),
            active: self.slots.active(),
            slots: Slot::BOTH.map(|slot| SlotReport {
                state: self.slots.state(slot),
                erased: self.slots.wear(slot),
            }),
            fault: self.fault(),
        }
    }

    /// How things are.
    pub fn report(&mut self) -> Report {
        let (activation, upload, fault) = (self.activation(), self.upload_state(), self.fault());
        self.servo.with(|side| {
            let driven = side.driven();
            let compensation = driven.compensation();
            let axes = compensation.axes().len();
            let first = |values: &[f32; AXES]| values.iter().take(axes).copied().collect();
            let (last, counters) = (side.last(), side.counters());
            Report {
                positions: first(side.positions()),
                dq: first(&last.dq),
                computed: first(&last.computed),
                auxiliaries: side
                    .auxiliaries()
                    .iter()
                    .take(compensation.auxiliaries().len())
                    .copied()
                    .collect(),
                sensors_lost: side.sensors_lost(),
                weights: driven
                    .wanted_weights()
                    .iter()
                    .map(|(term, weight)| (told(term, u16::MAX), weight))
                    .collect(),
                enabled: side.is_enabled(),
                dry_run: side.is_dry_run(),
                suspended: side.is_suspended(),
                referenced: side.referenced(),
                factor: driven.factor(),
                conditions: last.status.conditions.0,
                saturated: last.status.saturated,
                rate_limited: last.status.rate_limited,
                travel_limited: last.status.travel_limited,
                rails: counters.rails.iter().take(axes).copied().collect(),
                updates: counters.updates,
                missed: counters.missed,
                cost: counters.cost,
                worst_cost: counters.worst_cost,
                cost_unit: counters.cost_unit,
                activation,
                upload,
                fault,
            }
        })
    }
}
