//! Answers to hello and status.

use trueaxis::Room;
use trueaxis::link::{Capacities, Health, Hello, Report, Slot, SlotReport, short_name};

use super::{Device, Machine, ServoAccess};
use crate::slots::TableFlash;

/// Converts a number to a report field; saturates at `largest`.
pub(super) fn told<T: TryFrom<usize>>(number: usize, largest: T) -> T {
    T::try_from(number).unwrap_or(largest)
}

/// Collects as many values as fit, which is the maximum for any compensation.
pub(super) fn held<T, const N: usize>(values: impl Iterator<Item = T>) -> heapless::Vec<T, N> {
    let mut held = heapless::Vec::new();
    for value in values {
        let kept = held.push(value).is_ok();
        debug_assert!(kept, "a reply has room for all that there can be");
    }
    held
}

/// The first `count` values.
fn first_of<T: Copy, const N: usize>(values: &[T], count: usize) -> heapless::Vec<T, N> {
    held(values.iter().take(count).copied())
}

impl<F, S, M, C: Room> Device<F, S, M, C>
where
    F: TableFlash,
    S: ServoAccess<C>,
    M: Machine,
{
    pub(super) fn identify(&self, session: u32) -> Hello<'_> {
        let compensation = self.loader.current();
        let mut axes = heapless::String::new();
        for axis in compensation.axes() {
            let kept = axes.push(char::from(axis.name)).is_ok();
            debug_assert!(
                kept,
                "a name is one byte of ASCII, and there is room for each"
            );
        }
        Hello {
            session,
            firmware: self.identity.firmware,
            board: self.identity.board,
            formats: [trueaxis::VERSION; 2],
            capacities: Capacities {
                axes: told(C::AXES, u8::MAX),
                banks: told(C::BANKS, u16::MAX),
                tables: told(C::TABLES, u16::MAX),
                terms: told(C::TERMS, u16::MAX),
                grids: told(C::GRIDS, u16::MAX),
                slot: self.slots.capacity(),
            },
            period: self.identity.period,
            while_busy: self.slots.flash().while_busy(),
            machine: short_name(compensation.machine()),
            axes,
            auxiliaries: told(compensation.auxiliaries().len(), u8::MAX),
            active: self.slots.active(),
            slots: Slot::BOTH.map(|slot| SlotReport {
                state: self.slots.state(slot),
                erased: self.slots.wear(slot),
            }),
            fault: self.fault(),
        }
    }

    /// State of the controller itself.
    pub fn health(&mut self) -> Health {
        let restart = self.identity.restart;
        self.servo.with(|side| {
            let counters = side.counters();
            let seen = counters.regularity;
            Health {
                healthy: side.is_healthy(),
                restart,
                frames: seen.frames,
                repeated: seen.repeated,
                skipped: seen.skipped,
                damaged: seen.damaged,
                faults: seen.faults,
                overruns: counters.overruns,
                // Filled in by the link.
                garbled: 0,
            }
        })
    }

    /// Current status.
    pub fn report(&mut self) -> Report {
        let now = self.servo.with(|side| side.snapshot());
        let compensation = self.loader.current();
        let axes = compensation.axes().len();
        let auxiliaries = compensation.auxiliaries().len();
        let first = |values: &C::Axes<f32>| first_of(values.as_ref(), axes);
        let weight = |(term, weight)| (told(term, u16::MAX), weight);
        let (status, counters) = (&now.last.status, &now.counters);
        Report {
            positions: first(&now.positions),
            dq: first(&now.last.dq),
            computed: first(&now.last.computed),
            auxiliaries: first_of(&now.auxiliaries, auxiliaries),
            sensors_lost: now.sensors_lost,
            weights: held(now.weights.iter().map(weight)),
            enabled: now.enabled,
            dry_run: now.dry_run,
            suspended: now.suspended,
            referenced: now.referenced,
            factor: now.factor,
            conditions: status.conditions.0,
            saturated: status.saturated,
            rate_limited: status.rate_limited,
            travel_limited: status.travel_limited,
            limits: first_of(counters.limits.as_ref(), axes),
            updates: counters.updates,
            missed: counters.missed,
            cost: counters.cost,
            worst_cost: counters.worst_cost,
            cost_unit: counters.cost_unit,
            activation: self.activation(),
            upload: self.upload_state(),
            fault: self.fault(),
        }
    }
}
