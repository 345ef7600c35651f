//! A machine with known errors that moves behind a controller.

use super::PERIOD;
use std::f64::consts::TAU;
use trueaxis::AuxiliaryKind;
use trueaxis_firmware::desktop::Desktop;
use trueaxis_firmware::device::{Command, LinkOnly, NoClock, PositionSource};
use trueaxis_model::errors::{ErrorModel, Situation};
use trueaxis_model::kinematics::Kinematics;
use trueaxis_model::machine::{MAX_AXES, Machine, PerAxis};

/// The machine.
pub struct SimulatedMachine<'a> {
    machine: &'a Machine,
    kinematics: Kinematics<'a>,
    /// Servo periods since start.
    periods: u64,
    /// Largest errors of the tip (mm) since the last line: with the corrections, and without.
    largest: [f64; 2],
}

/// Periods between two looks at the error.
const LOOK: u64 = 40;
/// Periods between two lines.
const LINE: u64 = 20_000;
/// Part of the travel that is used.
const USED: f64 = 0.9;
/// Shortest time from one end to the other and back (s), and how much longer that of each further axis is: together they
/// reach everything.
const SWING: f64 = 20.0;
const LONGER: f64 = 1.37;

/// The command of one period.
struct Once(Option<Command<[f32; 8]>>);

impl PositionSource<[f32; 8]> for Once {
    fn take(&mut self) -> Option<Command<[f32; 8]>> {
        self.0.take()
    }
}

impl<'a> SimulatedMachine<'a> {
    /// Column heads of the lines.
    pub const HEAD: &'static str =
        "    time   largest error of the tip   without corrections   corrections\n";

    pub fn new(machine: &'a Machine, errors: &'a ErrorModel) -> Self {
        Self {
            machine,
            kinematics: Kinematics::new(machine, errors),
            periods: 0,
            largest: [0.0; 2],
        }
    }

    /// Position (mm, deg) and direction of travel of every axis.
    fn place(&self) -> ([f64; MAX_AXES], PerAxis) {
        let time = self.periods as f64 * f64::from(PERIOD);
        let (mut position, mut sign) = ([0.0; MAX_AXES], [0.0; MAX_AXES]);
        let mut least = SWING;
        for (i, axis) in self.machine.axes.iter().enumerate() {
            let [low, high] = axis.travel;
            let half = USED * (high - low) / 2.0;
            // At most half of its top speed.
            let swing = least.max(2.0 * TAU * half / axis.max_speed);
            let angle = TAU * time / swing;
            position[i] = (low + high) / 2.0 + half * libm::sin(angle);
            sign[i] = libm::cos(angle).signum();
            least *= LONGER;
        }
        (position, sign)
    }

    /// One servo period; returns a line if one is due.
    pub fn step<const W: usize, const E: usize>(
        &mut self,
        desktop: &Desktop<W, E>,
    ) -> Option<String> {
        let (position, sign) = self.place();
        self.periods += 1;
        // The controller has the axes of its compensation, in its order.
        let compensation = desktop.device.compensation();
        let index = |axis: &trueaxis::Axis| self.machine.index(char::from(axis.name));
        let places: Vec<Option<usize>> = compensation.axes().iter().map(index).collect();
        let command = self.command(&places, &position);
        let (last, factor) = desktop.servo.lock(|side| {
            for (k, auxiliary) in compensation.auxiliaries().iter().enumerate() {
                if auxiliary.kind == AuxiliaryKind::Temperature {
                    side.set_auxiliary(k, 0.0);
                }
            }
            side.tick(&mut Once(Some(command)), &mut LinkOnly, &NoClock);
            (side.last().dq, side.snapshot().factor)
        });
        if self.periods.is_multiple_of(LOOK) {
            let mut dq = [0.0; MAX_AXES];
            for (value, place) in last.iter().zip(&places) {
                if let Some(place) = place {
                    dq[*place] = f64::from(*value);
                }
            }
            self.look(&position, sign, &dq);
        }
        let state = match factor {
            _ if places.is_empty() => "no compensation",
            0.0 => "off",
            1.0 => "on",
            _ => "coming or going",
        };
        (self.periods.is_multiple_of(LINE)).then(|| self.line(state))
    }

    /// The command to be at a position.
    fn command(&self, places: &[Option<usize>], position: &PerAxis) -> Command<[f32; 8]> {
        let mut axes = [0.0; 8];
        for (axis, place) in axes.iter_mut().zip(places) {
            *axis = place.map_or(0.0, |place| position[place] as f32);
        }
        let mut command = Command::new(axes, u16::MAX);
        command.tool_length = Some(self.machine.tool_length() as f32);
        command
    }

    /// The largest errors since the last line.
    fn line(&mut self, state: &str) -> String {
        let [with, without] = std::mem::take(&mut self.largest).map(|mm| mm * 1e3);
        let seconds = self.periods as f64 * f64::from(PERIOD);
        format!("{seconds:6.0} s {with:22.1} µm {without:18.1} µm   {state}\n")
    }

    fn look(&mut self, position: &[f64; MAX_AXES], sign: PerAxis, dq: &[f64; MAX_AXES]) {
        let situation = Situation {
            sign,
            length: self
                .machine
                .length_range
                .map(|_| self.machine.tool_length()),
            ..Situation::default()
        };
        let q = self.machine.to_kinematic(position);
        let dq = self.machine.to_kinematic(dq);
        for (largest, dq) in self.largest.iter_mut().zip([dq, [0.0; MAX_AXES]]) {
            let error = self.kinematics.volumetric_error(&q, &dq, &situation);
            *largest = largest.max(error.t.norm());
        }
    }
}
