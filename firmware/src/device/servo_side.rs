//! The servo interrupt's side: one [`tick`](ServoSide::tick) per servo period.

use trueaxis::link::{CostUnit, LimitCounts, MOST_ROWS};
use trueaxis::{
    AUXILIARIES, AuxiliaryKind, Conditions, Correction, Inputs, Refused, Room, Row, Status,
    WeightError,
};

use super::board::{Clock, Command, CorrectionSink, Enabling, PositionSource, Regularity};
use super::snapshot::{Counters, Snapshot};
use crate::double_buffer::{BufferedServo, Loaded};

/// Conditions that are faults: the corrections are wrong.
pub const FAULTS: Conditions = Conditions(
    Conditions::BAD_INPUT.0 | Conditions::BAD_PERIOD.0 | Conditions::HELD.0 | Conditions::FROZEN.0,
);

/// Commanded positions from the link, and the servo's results for them.
struct Batch<C: Room> {
    commands: [C::Axes<f32>; MOST_ROWS],
    results: [Correction<C::Axes<f32>>; MOST_ROWS],
    given: usize,
    done: usize,
}

impl<C: Room> Batch<C> {
    /// The next pending command.
    fn next(&self) -> Option<C::Axes<f32>> {
        let waits = self.done < self.given;
        self.commands.get(self.done).filter(|_| waits).copied()
    }

    /// Stores the servo's result for it.
    fn put(&mut self, correction: Correction<C::Axes<f32>>) {
        if let Some(result) = self.results.get_mut(self.done) {
            *result = correction;
            self.done += 1;
        }
    }
}

/// The servo, its inputs, and its reports. Runs in an interrupt, and is shared with the main loop through
/// [`ServoAccess`].
pub struct ServoSide<C: Room> {
    servo: BufferedServo<C>,
    /// Nominal period, s.
    period: f32,
    /// The host's request; `None` if there was none since start.
    host: Option<bool>,
    /// The motion side's latest request.
    enabling: Enabling,
    /// The combination of both.
    enabled: bool,
    /// The main loop has reported a fault.
    faulty: bool,
    dry_run: bool,
    /// Corrections must be zero, whatever is enabled.
    to_zero: bool,
    /// No updates: the flash is or may become busy.
    suspended: bool,
    referenced: u16,
    auxiliaries: [f32; AUXILIARIES],
    sensors_lost: u8,
    /// Tool lengths of the host and of the motion side.
    tool_length: Option<f32>,
    given_length: Option<f32>,
    last: Correction<C::Axes<f32>>,
    positions: C::Axes<f32>,
    /// The board's source has commanded: from then on, its silence is a fault, and nothing else commands.
    has_source: bool,
    batch: Batch<C>,
    counters: Counters<C>,
    /// Time since start: whole seconds, and nominal periods since then.
    seconds: u32,
    periods: u32,
    /// Nominal periods in a second.
    rate: u32,
}

/// Access to the servo side from the main loop, with the servo interrupt masked.
pub trait ServoAccess<C: Room> {
    /// Calls `f` while no tick can run. `f` must be short: its duration must not depend on the size of a table.
    fn with<R>(&mut self, f: impl FnOnce(&mut ServoSide<C>) -> R) -> R;
}

fn zero<A: Row<f32>>(conditions: Conditions) -> Correction<A> {
    Correction {
        dq: A::all(0.0),
        computed: A::all(0.0),
        status: Status {
            conditions,
            saturated: 0,
            rate_limited: 0,
            travel_limited: 0,
        },
    }
}

impl<C: Room> ServoSide<C> {
    /// Disabled, with no axis referenced. `period`: the nominal servo period, s.
    #[must_use]
    pub fn new(servo: BufferedServo<C>, period: f32) -> Self {
        let rest = zero(Conditions::DISABLED);
        Self {
            servo,
            period,
            host: None,
            enabling: Enabling::Host,
            enabled: false,
            faulty: false,
            dry_run: false,
            to_zero: false,
            suspended: false,
            referenced: 0,
            auxiliaries: [f32::NAN; AUXILIARIES],
            sensors_lost: 0,
            tool_length: None,
            given_length: None,
            last: rest,
            positions: C::Axes::<f32>::all(0.0),
            has_source: false,
            batch: Batch {
                commands: [C::Axes::<f32>::all(0.0); MOST_ROWS],
                results: [rest; MOST_ROWS],
                given: 0,
                done: 0,
            },
            counters: Counters {
                updates: 0,
                missed: 0,
                regularity: Regularity::NONE,
                overruns: 0,
                limits: C::Axes::<LimitCounts>::all(LimitCounts::default()),
                cost: 0,
                worst_cost: 0,
                cost_unit: CostUnit::None,
            },
            seconds: 0,
            periods: 0,
            // At least one, even if the period is invalid.
            rate: ((1.0 / period) as u32).max(1),
        }
    }

    /// Stops and returns the servo it was made with.
    #[must_use]
    pub fn into_servo(self) -> BufferedServo<C> {
        self.servo
    }

    /// One servo period: takes a command, updates the servo, outputs the correction.
    ///
    /// Commands of `source` take precedence over those of the link. If a source has given commands and then stops, that
    /// is a fault: the correction is held, and ramped to zero after [`PATIENCE`](trueaxis::PATIENCE). Before its first command, and with
    /// the link alone, a period without a command does not count, because the commands set the pace.
    pub fn tick<K: Clock>(
        &mut self,
        source: &mut impl PositionSource<C::Axes<f32>>,
        sink: &mut impl CorrectionSink<C::Axes<f32>>,
        clock: &K,
    ) {
        self.periods += 1;
        if self.periods >= self.rate {
            self.periods = 0;
            self.seconds = self.seconds.wrapping_add(1);
        }
        let command = source.take();
        self.note(&source.regularity());
        if let Some(command) = &command {
            self.has_source = true;
            self.heed(command);
        }
        if self.suspended {
            // Nothing is computed, but the position of the machine is still recorded.
            if let Some(Command { axes, .. }) = command
                && axes.as_ref().iter().all(|q| q.is_finite())
            {
                self.positions = axes;
            }
            sink.give(&self.last, self.is_healthy());
            return;
        }
        if let Some(Command { axes, .. }) = command {
            self.update(axes, clock);
        } else if let Some(axes) = self.batch.next() {
            self.update(axes, clock);
            self.batch.put(self.last);
        } else if self.has_source {
            self.counters.missed = self.counters.missed.wrapping_add(1);
            // NaN: the servo holds, and ramps to zero if this lasts.
            self.update(C::Axes::<f32>::all(f32::NAN), clock);
        } else if self.wants_zero() {
            // There is no source of commands, so time may advance at the current position.
            self.update(self.positions, clock);
        } else {
            return;
        }
        sink.give(&self.last, self.is_healthy());
    }

    // When inlined it becomes a possibly overlapping move, which adds 1.5 kB of otherwise unused `memmove`.
    #[inline(never)]
    fn note(&mut self, regularity: &Regularity) {
        self.counters.regularity = *regularity;
    }

    /// Applies the parts of a command other than its positions.
    fn heed(&mut self, command: &Command<C::Axes<f32>>) {
        self.referenced = command.referenced;
        if self.enabling != command.enabling {
            self.enabling = command.enabling;
            self.settle_enabled();
        }
        let bits = |length: Option<f32>| length.map(f32::to_bits);
        if bits(self.given_length) != bits(command.tool_length) {
            self.given_length = command.tool_length;
            self.place_tool_length();
        }
    }

    /// Corrections are enabled only if neither host nor motion side has disabled them.
    fn settle_enabled(&mut self) {
        self.enabled = match self.enabling {
            Enabling::Host => self.host == Some(true),
            Enabling::On => self.host != Some(false),
            Enabling::Off => false,
        };
        self.servo.enable(self.enabled && !self.to_zero);
    }

    /// No fault: commands arrive regularly, enabled corrections are as they should be, and the main loop has not
    /// reported a fault. The fault pin shows this.
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let wrong = self.last.status.conditions.0 & FAULTS.0 != 0;
        // While corrections are disabled, a hold has no effect.
        !(self.faulty || self.counters.regularity.fault || self.enabled && wrong)
    }

    /// Sets the number of periods for which the previous one left no time.
    pub(crate) fn set_overruns(&mut self, count: u32) {
        self.counters.overruns = count;
    }

    /// Reports a fault of the slots, which only the main loop knows.
    pub(crate) fn set_faulty(&mut self, on: bool) {
        self.faulty = on;
    }

    /// An operation waits for corrections to be zero, or for an update at zero.
    fn wants_zero(&self) -> bool {
        let at_zero = self.is_at_zero();
        (self.to_zero && !at_zero) || (self.servo.is_swapping() && at_zero)
    }

    fn update<K: Clock>(&mut self, axes: C::Axes<f32>, clock: &K) {
        let inputs = Inputs {
            axes,
            auxiliaries: self.auxiliaries,
        };
        let begin = clock.now();
        let correction = self.servo.update(&inputs, self.referenced, self.period);
        let cost = clock.now().wrapping_sub(begin);
        self.last = correction;
        if axes.as_ref().iter().all(|q| q.is_finite()) {
            self.positions = axes;
        }
        let counters = &mut self.counters;
        counters.updates = counters.updates.wrapping_add(1);
        counters.cost = cost;
        counters.cost_unit = K::UNIT;
        if cost > counters.worst_cost {
            counters.worst_cost = cost;
        }
        let status = &correction.status;
        if status.saturated | status.rate_limited | status.travel_limited != 0 {
            for (k, limits) in counters.limits.as_mut().iter_mut().enumerate() {
                let acts = |mask: u16| u32::from((mask >> k) & 1);
                limits.value = limits.value.saturating_add(acts(status.saturated));
                limits.rate = limits.rate.saturating_add(acts(status.rate_limited));
                limits.travel = limits.travel.saturating_add(acts(status.travel_limited));
            }
        }
    }

    /// Enables or disables corrections on behalf of the host. If the motion side has a request too, corrections are on
    /// only if neither has disabled them ([`Enabling`]).
    pub fn enable(&mut self, on: bool) {
        self.host = Some(on);
        self.settle_enabled();
    }

    /// Starts or ends a dry run.
    pub fn dry_run(&mut self, on: bool) {
        self.dry_run = on;
        self.servo.dry_run(on);
    }

    /// Sets the mask of referenced axes; commands of the board's source have their own.
    pub fn set_referenced(&mut self, mask: u16) {
        self.referenced = mask;
    }

    /// Sets the host's tool length, mm, which applies while the motion side gives none. Without either it is NaN, which
    /// is a fault if tables depend on it.
    pub fn set_tool_length(&mut self, length: f32) {
        self.tool_length = Some(length);
        self.place_tool_length();
    }

    /// Sets an auxiliary input; temperatures as differences from their reference in K.
    pub fn set_auxiliary(&mut self, index: usize, value: f32) {
        if let Some(auxiliary) = self.auxiliaries.get_mut(index) {
            *auxiliary = value;
        }
    }

    /// Reports which auxiliaries have a failed sensor, bit 0 for the first.
    pub(crate) fn set_sensors_lost(&mut self, mask: u8) {
        self.sensors_lost = mask;
    }

    /// See [`BufferedServo::set_weight`].
    ///
    /// # Errors
    /// [`WeightError`]; nothing changes.
    pub fn set_weight(&mut self, term: usize, value: f32) -> Result<(), WeightError> {
        self.servo.set_weight(term, value)
    }

    fn place_tool_length(&mut self) {
        let length = self.given_length.or(self.tool_length);
        let auxiliaries = self.servo.compensation().auxiliaries();
        for (value, auxiliary) in self.auxiliaries.iter_mut().zip(auxiliaries) {
            if auxiliary.kind == AuxiliaryKind::ToolLength {
                *value = length.unwrap_or(f32::NAN);
            }
        }
    }

    /// Fades over to another compensation of the same machine.
    ///
    /// # Errors
    /// See [`Servo::swap`](trueaxis::Servo::swap).
    pub fn swap(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        self.servo.swap(loaded)
    }

    /// Adopts a compensation with other axes or auxiliaries, at zero. Settings are kept. Auxiliaries other than the
    /// tool length are NaN until they are set again, and no axis is referenced.
    ///
    /// # Errors
    /// [`Refused::Busy`] while a correction is not zero or a change is in progress.
    pub fn replace(&mut self, loaded: Loaded<'_, C>) -> Result<(), Refused> {
        if !self.is_at_zero() {
            return Err(Refused::Busy);
        }
        self.servo.replace(loaded)?;
        self.servo.enable(self.enabled && !self.to_zero);
        self.servo.dry_run(self.dry_run);
        self.auxiliaries = [f32::NAN; AUXILIARIES];
        self.place_tool_length();
        self.referenced = 0;
        self.last = zero(Conditions::DISABLED);
        self.counters.limits = C::Axes::<LimitCounts>::all(LimitCounts::default());
        Ok(())
    }

    /// Ramps the corrections to zero and keeps them there (`true`), whatever is enabled.
    pub(crate) fn keep_at_zero(&mut self, on: bool) {
        self.to_zero = on;
        self.servo.enable(self.enabled && !on);
    }

    /// Stops the updates (`true`), only at zero; after that nothing is read from the slots.
    pub(crate) fn suspend(&mut self, on: bool) {
        self.suspended = on;
    }

    /// All corrections are zero, and the fade factor rests at zero, so changes of the compensation have no effect on
    /// the output.
    #[must_use]
    pub(crate) fn is_at_zero(&self) -> bool {
        let ramping = self.last.status.is(Conditions::RAMPING);
        self.servo.factor() == 0.0 && !ramping && self.last.dq.as_ref().iter().all(|dq| *dq == 0.0)
    }

    /// Begins a batch of commands from the link and drops what is left of the previous one.
    ///
    /// Returns false once the board's source has commanded.
    pub(crate) fn begin_batch(&mut self) -> bool {
        self.end_batch();
        !self.has_source
    }

    /// Drops the rest of the batch.
    pub(crate) fn end_batch(&mut self) {
        (self.batch.given, self.batch.done) = (0, 0);
    }

    /// Appends a command to the batch, for one servo period. Returns false if the batch is full.
    pub fn push(&mut self, axes: C::Axes<f32>) -> bool {
        match self.batch.commands.get_mut(self.batch.given) {
            Some(place) => {
                *place = axes;
                self.batch.given += 1;
                true
            }
            None => false,
        }
    }

    /// The servo's result for a command of the batch, once its period has passed.
    #[must_use]
    pub fn result(&self, row: usize) -> Option<Correction<C::Axes<f32>>> {
        let done = row < self.batch.done;
        self.batch.results.get(row).filter(|_| done).copied()
    }

    /// See [`BufferedServo`].
    #[must_use]
    pub fn servo(&self) -> &BufferedServo<C> {
        &self.servo
    }

    /// Seconds since start, counted in nominal periods; periods lost while the flash is busy are not counted.
    #[must_use]
    pub fn seconds(&self) -> u32 {
        self.seconds
    }

    /// Counts since start.
    #[must_use]
    pub(crate) fn counters(&self) -> &Counters<C> {
        &self.counters
    }

    /// The correction of the last period.
    #[must_use]
    pub fn last(&self) -> &Correction<C::Axes<f32>> {
        &self.last
    }

    /// The last finite commanded positions, mm or degrees.
    #[must_use]
    pub fn positions(&self) -> &C::Axes<f32> {
        &self.positions
    }

    /// Whether corrections are requested.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Whether updates are stopped.
    #[must_use]
    pub(crate) fn is_suspended(&self) -> bool {
        self.suspended
    }

    /// State after the last period, as a copy, so that the interrupt waits only for copying.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot<C> {
        Snapshot {
            last: self.last,
            positions: self.positions,
            auxiliaries: self.auxiliaries,
            sensors_lost: self.sensors_lost,
            weights: *self.servo.wanted_weights(),
            enabled: self.enabled,
            dry_run: self.dry_run,
            suspended: self.suspended,
            referenced: self.referenced,
            factor: self.servo.factor(),
            counters: self.counters,
        }
    }
}
