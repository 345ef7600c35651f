//! The runtime alone, on a processor of another kind: a program without the firmware around it, which
//! reads its work from files and writes what it gives into one.

use crate::board::{Setup, text};
use crate::cases::{self, CASES, Case};
use crate::same::bits;
use crate::{Failure, Seen, widths};
use std::fs;
use std::process::{Command, Stdio};
use trueaxis::link::{EvaluateRow, MotionResult, positions, put_positions};
use trueaxis::{Inputs, Servo};
use trueaxis_tests::Fixed;

/// Evaluations of each example at random positions.
const EVALUATIONS: usize = 4_000;
/// Servo periods of its tool path, 1.25 s: longer than the corrections need to come in.
const PERIODS: usize = 5_000;
/// Servo periods at places without any connection.
const JUMPS: usize = 1_000;
/// A servo period, s.
const PERIOD: f32 = 0.00025;

pub fn run(setup: &Setup<'_>) -> Seen {
    let mut seen = 0;
    for (number, (name, ..)) in CASES.iter().enumerate() {
        let case = cases::compile(setup, name)?;
        seen += example(setup, &case, number as u64).map_err(|e| format!("{name}: {e}"))?;
    }
    seen += example(setup, &widths::case(setup)?, 0).map_err(|e| format!("widths: {e}"))?;
    Ok(format!(
        "{} examples and one of every width, {seen} corrections with the desktop's bits",
        CASES.len()
    ))
}

/// Compares what the program gives with what this computer gives; the number of corrections.
fn example(setup: &Setup<'_>, case: &Case, seed: u64) -> Result<usize, Failure> {
    let c = case.load()?;
    let (axes, auxiliaries) = (c.axes().len(), c.auxiliaries().len());
    let mut random = Fixed::new(seed);
    let rows: Vec<_> = (0..EVALUATIONS)
        .map(|_| cases::row(&c, &mut random))
        .collect();
    let mut path = cases::tool_path(&c, PERIODS);
    path.extend((0..JUMPS).map(|_| cases::position(&c, &mut random)));
    // Also what is no position at all: held, then ramped out.
    for k in [100, 300] {
        path[PERIODS + k][0] = f32::NAN;
    }
    for jump in &mut path[PERIODS + 500..PERIODS + 600] {
        jump[1] = f32::INFINITY;
    }
    let values = cases::auxiliaries(&c, &mut random);

    let mut work = (rows.len() as u32).to_le_bytes().to_vec();
    let mut bytes = [0; 256];
    for row in &rows {
        let length = EvaluateRow::bytes(axes, auxiliaries);
        row.put(axes, auxiliaries, &mut bytes).ok_or("a long row")?;
        work.extend(&bytes[..length]);
    }
    let mut floats = |work: &mut Vec<u8>, values: &[f32]| -> Result<(), Failure> {
        put_positions(values, values.len(), &mut bytes).ok_or("a long row")?;
        work.extend(&bytes[..4 * values.len()]);
        Ok(())
    };
    floats(&mut work, &[PERIOD])?;
    floats(&mut work, &values[..auxiliaries])?;
    work.extend((path.len() as u32).to_le_bytes());
    for position in &path {
        floats(&mut work, &position[..axes])?;
    }

    let results = execute(setup, case, &work)?;
    let mut rest = &results[..];
    let weights = c.weights();
    for row in &rows {
        let (found, after) = positions::<[f32; 8]>(rest, axes).ok_or("too few results")?;
        rest = after;
        let ours = c.evaluate(&row.inputs, &row.travelling, &weights);
        if ours.map(f32::to_bits) != found.map(f32::to_bits) {
            return Err(format!("{row:?}: {found:?} instead of {ours:?}").into());
        }
    }
    let mut servo = Servo::new(&c);
    servo.enable();
    for (period, position) in path.iter().enumerate() {
        let (found, after) = MotionResult::get(rest, axes).ok_or("too few results")?;
        rest = after;
        let mut command = [0.0; 8];
        command[..axes].copy_from_slice(&position[..axes]);
        let mut inputs = Inputs::at(command);
        inputs.auxiliaries[..auxiliaries].copy_from_slice(&values[..auxiliaries]);
        let ours = servo.update(&inputs, u16::MAX, PERIOD);
        if bits(&ours) != bits(&found.0) {
            return Err(format!("period {period}: {found:?} instead of {ours:?}").into());
        }
        if period == PERIODS - 1 && servo.factor() != 1.0 {
            return Err("the corrections have not come in".into());
        }
    }
    if !rest.is_empty() {
        return Err("too many results".into());
    }
    Ok(rows.len() + path.len())
}

/// Runs the program; what it has written.
fn execute(setup: &Setup<'_>, case: &Case, work: &[u8]) -> Result<Vec<u8>, Failure> {
    let folder = setup.folder.join(format!("alone-{}", case.name));
    // What an earlier run has left.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;
    fs::copy(&case.path, folder.join("blob.trax"))?;
    fs::write(folder.join("work.bin"), work)?;
    let output = Command::new("qemu-system-riscv32")
        .current_dir(&folder)
        .args(["-machine", &setup.machine, "-bios", "none"])
        .args(["-nographic", "-monitor", "none"])
        .args(["-semihosting-config", "enable=on,target=native"])
        .args(["-kernel", text(&setup.firmware)?])
        .stdin(Stdio::null())
        .output()?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{}: {said}", output.status).into());
    }
    Ok(fs::read(folder.join("results.bin"))?)
}
