//! The side of the servo interrupt: one [`tick`](ServoSide::tick) per servo period.

use trueaxis::link::{CostUnit, MOST_ROWS, Rails};
use trueaxis::{
    AUXILIARIES, AuxiliaryKind, Conditions, Correction, Inputs, PATIENCE, Refused, Room, Row,
    Status, WeightError, Weights,
};

use super::board::{Clock, Command, CorrectionSink, Enabling, PositionSource, Regularity};
use crate::double_buffer::{BufferedServo, Loaded};

/// Conditions that are a fault: the corrections are not what they should be.
pub const FAULTS: Conditions = Conditions(
    Conditions::BAD_INPUT.0 | Conditions::BAD_PERIOD.0 | Conditions::HELD.0 | Conditions::FROZEN.0,
);

/// What has been counted since start.
#[derive(Clone, Copy, Debug)]
pub struct Counters<C: Room> {
    /// Servo updates.
    pub updates: u32,
    /// Periods without a command, of a source that has given commands before: nothing new has come
    /// for longer than is tolerated.
    pub missed: u32,
    /// How regularly the source of the board gives commands.
    pub regularity: Regularity,
    /// Periods that the one before had not left time for.
    pub overruns: u32,
    /// In how many periods the guard rails of each axis have acted.
    pub rails: C::Axes<Rails>,
    /// Cost of the last update.
    pub cost: u32,
    /// Cost of the most expensive update.
    pub worst_cost: u32,
    /// Unit of both.
    pub cost_unit: CostUnit,
}

/// How things are after a period.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot<C: Room> {
    /// The correction.
    pub last: Correction<C::Axes<f32>>,
    /// The last finite commanded positions, mm or degrees.
    pub positions: C::Axes<f32>,
    /// Auxiliary inputs, mm and K.
    pub auxiliaries: [f32; AUXILIARIES],
    /// Auxiliaries that have lost their sensor, bit 0 for the first.
    pub sensors_lost: u8,
    /// Weights that are wanted.
    pub weights: Weights,
    /// Corrections are wanted.
    pub enabled: bool,
    /// A dry run is wanted.
    pub dry_run: bool,
    /// Updates are stopped.
    pub suspended: bool,
    /// Mask of referenced axes.
    pub referenced: u16,
    /// Common factor, 0…1.
    pub factor: f32,
    /// What has been counted since start.
    pub counters: Counters<C>,
}

/// Commanded positions from the link, and what the servo gave for them.
struct Batch<C: Room> {
    commands: [C::Axes<f32>; MOST_ROWS],
    results: [Correction<C::Axes<f32>>; MOST_ROWS],
    given: usize,
    done: usize,
}

impl<C: Room> Batch<C> {
    /// The next command that waits.
    fn next(&self) -> Option<C::Axes<f32>> {
        let waits = self.done < self.given;
        self.commands.get(self.done).filter(|_| waits).copied()
    }

    /// What the servo gave for it.
    fn put(&mut self, correction: Correction<C::Axes<f32>>) {
        if let Some(result) = self.results.get_mut(self.done) {
            *result = correction;
            self.done += 1;
        }
    }
}

/// The servo, its inputs, and what it reports. In an interrupt, shared with the main loop through
/// [`ServoAccess`].
pub struct ServoSide<C: Room> {
    servo: BufferedServo<C>,
    /// Nominal period, s.
    period: f32,
    /// What the host wants; `None` if it has said nothing since start.
    host: Option<bool>,
    /// What the motion side wants, as it has said last.
    enabling: Enabling,
    /// What follows from both.
    enabled: bool,
    /// The main loop has found a fault.
    faulty: bool,
    dry_run: bool,
    /// The corrections are to be zero whatever is enabled.
    to_zero: bool,
    /// No updates: the flash is or may become busy.
    suspended: bool,
    referenced: u16,
    auxiliaries: [f32; AUXILIARIES],
    sensors_lost: u8,
    /// Of the host, and of the motion side.
    tool_length: Option<f32>,
    given_length: Option<f32>,
    last: Correction<C::Axes<f32>>,
    positions: C::Axes<f32>,
    /// For how long the source of the board has been silent, s; `None` before its first command.
    silent: Option<f32>,
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
    /// Calls `f` while no tick can run. What `f` does here is short: nothing in it depends on the
    /// size of a table.
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
    /// Disabled, no axis referenced. `period`: the nominal servo period, s.
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
            silent: None,
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
                rails: C::Axes::<Rails>::all(Rails::default()),
                cost: 0,
                worst_cost: 0,
                cost_unit: CostUnit::None,
            },
            seconds: 0,
            periods: 0,
            // At least one, also of a period that is none.
            rate: ((1.0 / period) as u32).max(1),
        }
    }

    /// Stops: gives back what it was made with.
    #[must_use]
    pub fn into_servo(self) -> BufferedServo<C> {
        self.servo
    }

    /// One servo period: takes a command, updates the servo, gives the correction.
    ///
    /// Commands of `source` come before those of the link. A source that has given commands and
    /// then gives none is a fault: the correction is held, and after
    /// [`PATIENCE`] ramped to zero. Before its first command, and with the
    /// link alone, a period without a command does not count: the one who commands is the clock.
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
            self.silent = Some(0.0);
            self.heed(command);
        }
        if self.suspended {
            // Nothing is computed, but where the machine is remains known.
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
        } else if let Some(silent) = &mut self.silent {
            *silent += self.period;
            self.counters.missed = self.counters.missed.wrapping_add(1);
            // Not a number: the servo holds, and ramps to zero if that lasts.
            self.update(C::Axes::<f32>::all(f32::NAN), clock);
        } else if self.wants_zero() {
            // Nobody commands, so nobody minds that time goes on where the machine is.
            self.update(self.positions, clock);
        } else {
            return;
        }
        sink.give(&self.last, self.is_healthy());
    }

    // Inlined it becomes a move that might overlap: 1.5 kB of `memmove` that nothing else calls.
    #[inline(never)]
    fn note(&mut self, regularity: &Regularity) {
        self.counters.regularity = *regularity;
    }

    /// What a command says beside the positions.
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

    /// Neither host nor motion side lets corrections in that the other has taken out.
    fn settle_enabled(&mut self) {
        self.enabled = match self.enabling {
            Enabling::Host => self.host == Some(true),
            Enabling::On => self.host != Some(false),
            Enabling::Off => false,
        };
        self.servo.enable(self.enabled && !self.to_zero);
    }

    /// There is no fault: commands come regularly, the corrections that are wanted are what they
    /// should be, and the main loop has not reported one. This is what the fault pin shows.
    #[must_use]
    pub fn is_healthy(&self) -> bool {
        let wrong = self.last.status.conditions.0 & FAULTS.0 != 0;
        // While none are wanted nothing is held that matters.
        !(self.faulty || self.counters.regularity.fault || self.enabled && wrong)
    }

    /// Reports how many periods the one before had not left time for.
    pub fn set_overruns(&mut self, count: u32) {
        self.counters.overruns = count;
    }

    /// Reports what only the main loop knows: a fault of the slots.
    pub fn set_faulty(&mut self, on: bool) {
        self.faulty = on;
    }

    /// Something waits for corrections that are zero, or for nothing but an update at zero.
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
            for (k, rails) in counters.rails.as_mut().iter_mut().enumerate() {
                let acts = |mask: u16| u32::from((mask >> k) & 1);
                rails.value = rails.value.saturating_add(acts(status.saturated));
                rails.rate = rails.rate.saturating_add(acts(status.rate_limited));
                rails.travel = rails.travel.saturating_add(acts(status.travel_limited));
            }
        }
    }

    /// What the host wants: lets the corrections in or takes them out. Where the motion side says
    /// something too, they are in only if neither has taken them out ([`Enabling`]).
    pub fn enable(&mut self, on: bool) {
        self.host = Some(on);
        self.settle_enabled();
    }

    /// Starts or ends a dry run.
    pub fn dry_run(&mut self, on: bool) {
        self.dry_run = on;
        self.servo.dry_run(on);
    }

    /// Sets the mask of referenced axes; commands of the board's source bring their own.
    pub fn set_referenced(&mut self, mask: u16) {
        self.referenced = mask;
    }

    /// Sets the tool length of the host, mm: it counts while the motion side gives none. Without
    /// either it is not a number: where tables depend on it, a fault.
    pub fn set_tool_length(&mut self, length: f32) {
        self.tool_length = Some(length);
        self.place_tool_length();
    }

    /// Sets an auxiliary input: a temperature as K difference to its reference.
    pub fn set_auxiliary(&mut self, index: usize, value: f32) {
        if let Some(auxiliary) = self.auxiliaries.get_mut(index) {
            *auxiliary = value;
        }
    }

    /// Reports which auxiliaries have lost their sensor, bit 0 for the first.
    pub fn set_sensors_lost(&mut self, mask: u8) {
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

    /// Takes a compensation with other axes or auxiliaries, at zero. Settings stay; auxiliaries
    /// are not numbers until they are set again, but for the tool length; no axis is referenced.
    ///
    /// # Errors
    /// [`Refused::Busy`] while a correction is not zero or a change is under way.
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
        self.counters.rails = C::Axes::<Rails>::all(Rails::default());
        Ok(())
    }

    /// Takes the corrections to zero and keeps them there (`true`), whatever is enabled.
    pub fn keep_at_zero(&mut self, on: bool) {
        self.to_zero = on;
        self.servo.enable(self.enabled && !on);
    }

    /// Stops the updates (`true`), only at zero; nothing is read from the slots any more.
    pub fn suspend(&mut self, on: bool) {
        self.suspended = on;
    }

    /// All corrections are zero, and the common factor rests at zero: nothing that happens to the
    /// compensation is felt.
    #[must_use]
    pub fn is_at_zero(&self) -> bool {
        let ramping = self.last.status.is(Conditions::RAMPING);
        self.servo.factor() == 0.0 && !ramping && self.last.dq.as_ref().iter().all(|dq| *dq == 0.0)
    }

    /// Begins a batch of commands from the link; what was left of the one before is dropped.
    ///
    /// False while the source of the board commands.
    pub fn begin_batch(&mut self) -> bool {
        self.end_batch();
        self.silent.is_none_or(|silent| silent > PATIENCE)
    }

    /// Drops what is left of the batch.
    pub fn end_batch(&mut self) {
        (self.batch.given, self.batch.done) = (0, 0);
    }

    /// Appends a command to the batch: one servo period will take it. False if it is full.
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

    /// What the servo gave for a command of the batch, once its period has come.
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

    /// Seconds since start, of nominal periods; periods that a busy flash swallows are not counted.
    #[must_use]
    pub fn seconds(&self) -> u32 {
        self.seconds
    }

    /// What has been counted since start.
    #[must_use]
    pub fn counters(&self) -> &Counters<C> {
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

    /// Whether corrections are wanted.
    #[must_use]
    pub fn is_enabled(&self) -> bool {
        self.enabled
    }

    /// Whether updates are stopped.
    #[must_use]
    pub fn is_suspended(&self) -> bool {
        self.suspended
    }

    /// How things are after the last period: a copy, so that the interrupt waits only for that.
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
