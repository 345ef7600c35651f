//! Fixed evaluations and servo periods, whose corrections are compared bit for bit between builds and processors. Needs
//! only `core`: `firmware/boards/portable` includes this file.

use crate::fixed::Fixed;
use trueaxis::{
    AuxiliaryKind, Compensation, Correction, Inputs, Room, Row, Servo, Travel, Travelling,
};

/// A position slightly beyond ± the travel (endless: 3 turns), with few enough bits to be exact.
fn beyond(random: &mut Fixed, travel: [f32; 2]) -> f32 {
    let half = if travel[1] > 1e6 {
        1080.0
    } else {
        travel[1] * 1.125
    };
    ((random.bits() >> 8) as f32 - 8_388_608.0) * (half / 8_388_608.0)
}

/// A random position in the travel or slightly beyond, and auxiliary values within ±100.
pub fn inputs<C: Room>(random: &mut Fixed, c: &Compensation<'_, C>) -> Inputs<C::Axes<f32>> {
    let mut inputs = Inputs::at(C::Axes::all(0.0));
    for (q, axis) in inputs.axes.as_mut().iter_mut().zip(c.axes()) {
        *q = beyond(random, axis.travel);
    }
    for auxiliary in inputs.auxiliaries.iter_mut().take(c.auxiliaries().len()) {
        *auxiliary = beyond(random, [-100.0, 100.0]);
    }
    inputs
}

/// Evaluates at `count` positions with random directions of travel; `each` gets the corrections of the axes.
pub fn evaluations<C: Room>(c: &Compensation<'_, C>, count: u32, mut each: impl FnMut(&[f32])) {
    let mut random = Fixed::new(1);
    for _ in 0..count {
        let q = inputs(&mut random, c);
        let directions = random.bits();
        let mut travelling = Travelling(C::Axes::all(Travel::Unknown));
        for (i, travel) in travelling.0.as_mut().iter_mut().enumerate() {
            *travel = match directions >> (2 * i) & 3 {
                0 => Travel::Unknown,
                1 => Travel::Positive,
                _ => Travel::Negative,
            };
        }
        let dq = c.evaluate(&q, &travelling, &c.weights());
        each(dq.as_ref().get(..c.axes().len()).unwrap_or_default());
    }
}

/// A servo through `moves` of 100 periods. Before each move an event may occur: corrections are disabled or enabled, an
/// axis loses its reference, the compensations are swapped, weights are set to 0, a dry run begins or ends.
///
/// `None` if a change is refused: the compensations have different axes, or an adjustable term does not permit the
/// weight 0.
pub fn periods<C: Room>(
    both: [&Compensation<'_, C>; 2],
    moves: u32,
    mut each: impl FnMut(&Correction<C::Axes<f32>>),
) -> Option<()> {
    let [c, other] = both;
    let mut random = Fixed::new(2);
    let mut servo = Servo::new(c);
    servo.enable();
    let mut from = inputs(&mut random, c);
    let mut referenced = u16::MAX;
    for _ in 0..moves {
        let mut to = inputs(&mut random, c);
        for (kelvin, auxiliary) in to.auxiliaries.iter_mut().zip(c.auxiliaries()) {
            if auxiliary.kind == AuxiliaryKind::Temperature {
                // Within ±3.6 K: farther would be jumps, which are faults.
                *kelvin *= 0.03125;
            }
        }
        match random.bits() % 8 {
            0 => servo.disable(),
            1 => referenced ^= 1,
            2 if !servo.is_swapping() => {
                let is_first = core::ptr::eq(*servo.handle(), c);
                servo.swap(if is_first { other } else { c }).ok()?;
            }
            3 => {
                for (term, _) in c.weights().iter() {
                    servo.set_weight(term, 0.0).ok()?;
                }
            }
            4 => servo.dry_run(random.bits() & 1 == 0),
            _ => {
                servo.enable();
                referenced = u16::MAX;
            }
        }
        for step in 1..=100_u8 {
            let mut q = to;
            let ends = to.axes.as_ref().iter().zip(from.axes.as_ref());
            for (q, (to, from)) in q.axes.as_mut().iter_mut().zip(ends) {
                *q = from + (to - from) * (f32::from(step) * 0.0078125);
            }
            each(&servo.update(&q, referenced, 0.001));
        }
        from = to;
    }
    Some(())
}

/// A servo at rest whose first command is sometimes NaN or infinite.
pub fn faults<C: Room>(c: &Compensation<'_, C>, mut each: impl FnMut(&Correction<C::Axes<f32>>)) {
    let at = inputs(&mut Fixed::new(4), c);
    let mut servo = Servo::new(c);
    for period in 0..1000 {
        servo.enable();
        let mut q = at;
        if let Some(first) = q.axes.as_mut().first_mut() {
            match period {
                300 | 304 => *first = f32::NAN,
                600..700 => *first = f32::INFINITY,
                _ => {}
            }
        }
        each(&servo.update(&q, u16::MAX, 0.001));
    }
}
