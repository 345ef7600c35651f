//! Every correction of the firmware equals the desktop's in every bit.

use crate::board::{Board, Setup};
use crate::cases::{self, CASES, Case};
use crate::{Failure, Seen, widths};
use std::sync::atomic::{AtomicUsize, Ordering};
use trueaxis::link::Request;
use trueaxis::{AuxiliaryKind, Compensation, Correction, Inputs, Servo};
use trueaxis_link::{Client, Tcp};
use trueaxis_tests::Fixed;

/// Number of evaluations of each example at random positions.
const EVALUATIONS: usize = 5_000;
/// Number of servo periods of its tool path, 1.25 s: longer than the corrections need to ramp in.
const PERIODS: usize = 5_000;
/// Number of servo periods at unrelated places.
const JUMPS: usize = 1_000;

pub fn run(setup: &Setup<'_>) -> Seen {
    // Two boards at a time, because each sometimes waits for the other end of its line.
    let (next, positions) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let work = || -> Result<(), String> {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some((name, ..)) = CASES.get(number) else {
                return Ok(());
            };
            let seen = cases::compile(setup, name)
                .and_then(|case| example(setup, case, number as u64))
                .map_err(|e| format!("{name}: {e}"))?;
            positions.fetch_add(seen, Ordering::Relaxed);
        }
    };
    let widths = example(setup, widths::case(setup)?, 0)?;
    positions.fetch_add(widths, Ordering::Relaxed);
    std::thread::scope(|scope| {
        let other = scope.spawn(work);
        let own = work();
        own.and(other.join().unwrap_or_else(|_| Err("a panic".to_owned())))
    })?;
    Ok(format!(
        "{} examples and one of every width, {} corrections with the desktop's bits",
        CASES.len(),
        positions.into_inner()
    ))
}

fn example(setup: &Setup<'_>, case: Case, seed: u64) -> Result<usize, Failure> {
    let mut board = setup.board(case.name)?;
    board.start()?;
    one(&board, &case, seed)
}

fn one(board: &Board<'_>, case: &Case, seed: u64) -> Result<usize, Failure> {
    board.flash(&case.path, &["--activate"])?;
    let c = case.load()?;
    let mut random = Fixed::new(seed);
    let (mut client, controller) = board.connect()?;
    evaluations(&mut client, &c, &mut random)?;
    let mut twin = Twin::new(&mut client, &c, controller.period)?;
    twin.follow(&mut client, &cases::tool_path(&c, PERIODS))?;
    if twin.servo.factor() != 1.0 {
        return Err("the corrections have not come in".into());
    }
    let mut jumps: Vec<_> = (0..JUMPS)
        .map(|_| cases::position(&c, &mut random))
        .collect();
    // Includes NaN positions: held, then ramped out.
    for k in [100, 300] {
        jumps[k][0] = f32::NAN;
    }
    for jump in &mut jumps[500..600] {
        jump[1] = f32::INFINITY;
    }
    twin.follow(&mut client, &jumps)?;
    Ok(EVALUATIONS + PERIODS + JUMPS)
}

/// Pure evaluation at random positions.
pub fn evaluations(
    client: &mut Client<Tcp>,
    c: &Compensation<'_>,
    random: &mut Fixed,
) -> Result<(), Failure> {
    let rows: Vec<_> = (0..EVALUATIONS).map(|_| cases::row(c, random)).collect();
    let found = client.evaluate(&rows, c.axes().len(), c.auxiliaries().len())?;
    let weights = c.weights();
    for (row, found) in rows.iter().zip(found) {
        let ours = c.evaluate(&row.inputs, &row.travelling, &weights);
        if ours.map(f32::to_bits) != found.map(f32::to_bits) {
            return Err(format!("{row:?}: {found:?} instead of {ours:?}").into());
        }
    }
    Ok(())
}

/// The desktop's servo, with the same inputs as the firmware's.
pub struct Twin<'c> {
    pub servo: Servo<&'c Compensation<'c>>,
    pub inputs: Inputs<[f32; 8]>,
    axes: usize,
    pub period: f32,
    pub last: Correction<[f32; 8]>,
}

impl<'c> Twin<'c> {
    /// For firmware that has just activated `c`: enables and references it.
    pub fn new(
        client: &mut Client<Tcp>,
        c: &'c Compensation<'c>,
        period: f32,
    ) -> Result<Self, Failure> {
        client.set(&Request::Referenced(u16::MAX))?;
        client.set(&Request::Enable(true))?;
        let mut servo = Servo::new(c);
        servo.enable();
        let mut inputs = Inputs::default();
        for (value, auxiliary) in inputs.auxiliaries.iter_mut().zip(c.auxiliaries()) {
            if auxiliary.kind == AuxiliaryKind::ToolLength {
                *value = auxiliary.reference + 12.5;
                client.set(&Request::ToolLength(*value))?;
            } else {
                // The board has no sensor with this name.
                *value = 0.0;
            }
        }
        let none = Correction {
            dq: [0.0; 8],
            computed: [0.0; 8],
            status: trueaxis::Status::default(),
        };
        Ok(Self {
            servo,
            inputs,
            axes: c.axes().len(),
            period,
            last: none,
        })
    }

    /// One period on the desktop.
    pub fn update(&mut self, position: &[f32; 8]) -> Correction<[f32; 8]> {
        self.inputs.axes = *position;
        self.last = self.servo.update(&self.inputs, u16::MAX, self.period);
        self.last
    }

    /// Commands a path to the firmware and to the desktop; returns the corrections.
    pub fn follow(
        &mut self,
        client: &mut Client<Tcp>,
        path: &[[f32; 8]],
    ) -> Result<Vec<Correction<[f32; 8]>>, Failure> {
        let found = client.motion(path, self.axes)?;
        for (period, (position, found)) in path.iter().zip(&found).enumerate() {
            // Axes that the machine does not have are not sent.
            let mut command = [0.0; 8];
            command[..self.axes].copy_from_slice(&position[..self.axes]);
            let ours = self.update(&command);
            if bits(&ours) != bits(found) {
                return Err(format!("period {period}: {found:?} instead of {ours:?}").into());
            }
        }
        Ok(found)
    }
}

/// All fields of a correction, as integers.
pub fn bits(c: &Correction<[f32; 8]>) -> ([u32; 8], [u32; 8], trueaxis::Status) {
    (
        c.dq.map(f32::to_bits),
        c.computed.map(f32::to_bits),
        c.status,
    )
}
