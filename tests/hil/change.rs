//! A change of compensation during streaming commands: no step, and the same bits as on the desktop throughout.

use crate::board::{Board, Setup};
use crate::cases;
use crate::same::Twin;
use crate::{Failure, Seen};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use trueaxis::link::{Activation, Refusal, Request, Slot};
use trueaxis::{Compensation, Conditions, Correction};
use trueaxis_link::{Client, LinkError, Tcp};

/// Number of servo periods between two queries.
const STRETCH: usize = 500;
/// Maximum number of stretches in a fade or ramp: about 10 s.
const STRETCHES: usize = 80;
/// Rounding of the difference between two corrections of up to 1.
const ROUNDING: f32 = 1.2e-7;

pub fn run(setup: &Setup<'_>) -> Seen {
    let (old, new) = (
        cases::compile(setup, "kolibri-10")?,
        cases::compile(setup, "kolibri-12")?,
    );
    let (before, after) = (old.load()?, new.load()?);
    let mut board = setup.board("change")?;
    board.start()?;
    board.flash(&old.path, &["--activate"])?;

    let (mut client, controller) = board.connect()?;
    let mut twin = Twin::new(&mut client, &before, controller.period)?;
    let path = cases::tool_path(&before, STRETCH * (2 * STRETCHES + 20));
    let mut stretches = path.chunks_exact(STRETCH);
    let mut stretch = || stretches.next().ok_or("the path is too short");
    for _ in 0..12 {
        twin.follow(&mut client, stretch()?)?;
    }
    if twin.servo.factor() != 1.0 {
        return Err("the corrections have not come in".into());
    }

    // The flash stalls the processor, so nothing begins while the machine moves.
    match client.upload(&Request::Begin {
        length: 1000,
        crc: 1,
    }) {
        Err(LinkError::Refused(Refusal::NotStandstill)) => {}
        other => return Err(format!("begin while moving: {other:?}").into()),
    }
    // Nothing is left on the line of a closed client.
    drop(client);
    std::thread::sleep(Duration::from_millis(400));
    board.flash(&new.path, &[])?;
    // The upload has ramped the corrections to zero, at the last command, and in again.
    let last = twin.inputs.axes;
    twin.servo.disable();
    while twin.servo.factor() != 0.0
        || twin.last.status.is(Conditions::RAMPING)
        || twin.last.dq != [0.0; 8]
    {
        twin.update(&last);
    }
    twin.servo.enable();
    let (mut client, _) = board.connect()?;
    for _ in 0..12 {
        twin.follow(&mut client, stretch()?)?;
    }

    // The change itself, with streaming commands.
    let garbled = garbled(&mut client)?;
    let mut dq = twin.last;
    match client.activate(Slot::B, false)? {
        Activation::Fading(Slot::B) => {}
        other => return Err(format!("activation: {other:?}").into()),
    }
    twin.servo.swap(&after).map_err(|refused| refused.why)?;
    let mut fades = 0;
    let mut steepest = 0.0_f32;
    while twin.servo.is_swapping() {
        if fades == STRETCHES {
            return Err("the fade does not end".into());
        }
        fades += 1;
        for next in twin.follow(&mut client, stretch()?)? {
            steepest = steepest.max(step(&before, &after, &dq, &next, controller.period)?);
            dq = next;
        }
    }
    twin.follow(&mut client, stretch()?)?;
    if self::garbled(&mut client)? != garbled {
        return Err("bytes were lost while commands streamed in a fade".into());
    }
    match client.activate(Slot::B, false)? {
        Activation::Active(Some(Slot::B)) => {}
        other => return Err(format!("after the fade: {other:?}").into()),
    }

    drop(client);
    rollback(&mut board)?;

    // Another machine is refused, unless forced.
    let other = cases::compile(setup, "router-10")?;
    std::thread::sleep(Duration::from_millis(400));
    if board.flash(&other.path, &[]).is_ok() {
        return Err("a compensation of another machine is taken".into());
    }
    board.flash(&other.path, &["--force"])?;
    Ok(format!(
        "a fade of {} periods with the desktop's bits; steepest step {:.0} % of the rate bound",
        fades * STRETCH,
        100.0 * steepest
    ))
}

/// Number of frames that lost bytes on their way to the controller.
fn garbled(client: &mut Client<Tcp>) -> Result<u32, Failure> {
    Ok(client.health()?.ok_or("health is not known")?.garbled)
}

/// Back to A, with corrections enabled at start: both with the real command, and still in effect after a power cut.
fn rollback(board: &mut Board<'_>) -> Result<(), Failure> {
    // The choice of B is stored once the machine has stood still for two seconds.
    let stored = |board: &Board<'_>| {
        Ok::<_, Failure>(board.control(&["show"])?["at_start"]["storing"] == "stored")
    };
    let end = Instant::now() + Duration::from_secs(20);
    while !stored(board)? && Instant::now() < end {
        std::thread::sleep(Duration::from_millis(100));
    }
    let expect = |found: &Value, expected: [(&str, Value); 2]| {
        let wrong = expected
            .iter()
            .find(|(field, value)| found[field] != *value);
        match wrong {
            None => Ok(()),
            Some((field, value)) => Err(format!("{field} is not {value}: {found}")),
        }
    };
    let stored = |slot: &str, before: &str, enable: bool| {
        let waiting = Value::Null;
        let stored = json!({"in_use": slot, "before": before, "waiting": waiting, "enable": enable, "storing": "stored"});
        ("at_start", stored)
    };
    let after = board.control(&["disable"])?;
    expect(&after, [("enabled", json!(false)), stored("B", "A", false)])?;
    let after = board.control(&["rollback"])?;
    expect(&after, [("active", json!("A")), stored("A", "B", false)])?;
    let after = board.control(&["enable-at-start", "on"])?;
    expect(&after, [("enabled", json!(false)), stored("A", "B", true)])?;
    board.stop();
    board.start()?;
    let after = board.control(&["show"])?;
    expect(&after, [("active", json!("A")), stored("A", "B", true)])?;
    expect(&after, [("enabled", json!(true)), ("fault", Value::Null)])?;
    let after = board.control(&["enable-at-start", "off"])?;
    Ok(expect(
        &after,
        [("enabled", json!(true)), stored("A", "B", false)],
    )?)
}

/// The largest change of a correction in one period, as a fraction of that permitted by its rate bound.
fn step(
    before: &Compensation<'_>,
    after: &Compensation<'_>,
    last: &Correction<[f32; 8]>,
    next: &Correction<[f32; 8]>,
    period: f32,
) -> Result<f32, Failure> {
    let mut most = 0.0_f32;
    for (k, (a, b)) in before.axes().iter().zip(after.axes()).enumerate() {
        let allowed = a.rate_bound.max(b.rate_bound) * period;
        let change = (next.dq[k] - last.dq[k]).abs();
        if change > allowed + ROUNDING {
            return Err(format!("axis {k} changes by {change} in one period").into());
        }
        most = most.max(change / allowed);
    }
    Ok(most)
}
