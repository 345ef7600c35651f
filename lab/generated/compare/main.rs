//! Generated code beside the general evaluation: every bit but the sign of a zero, and a servo with either, in Rust and
//! behind the C interface.

mod c_servo;

use trueaxis::*;

type Room = capacities!(axes: 16, banks: 255, tables: 255, terms: 4096, grids: 8);
type Whole<'a> = Compensation<'a, Room>;
/// The function for a servo.
type Corrections =
    fn(&Inputs<[f32; 16]>, &Travelling<[Travel; 16]>, &Weights, &mut [f32; 16]);
/// What a C function is given.
struct Given {
    inputs: [f32; 24],
    travel: [i8; 16],
    weights: Vec<f32>,
}
type C<'a> = (&'a str, &'a (dyn Fn(&Given, &mut [f32; 16]) + Sync));

/// Numbers that look random, the same in every run.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as u32 ^ (self.0 >> 20) as u32
    }
    fn below(&mut self, end: u32) -> u32 {
        (u64::from(self.bits()) * u64::from(end) >> 32) as u32
    }
    fn part(&mut self) -> f32 {
        self.below(1 << 24) as f32 / (1 << 24) as f32
    }
}

/// Start, step and points of what reads each input.
fn places(c: &Whole<'_>) -> Vec<Vec<[f32; 3]>> {
    let mut places = vec![Vec::new(); c.axes().len() + c.auxiliaries().len()];
    for bank in c.banks() {
        places[usize::from(bank.input)].push([bank.start, bank.step, bank.points as f32]);
    }
    for axis in c.grids().iter().flat_map(|grid| &grid.axes) {
        places[usize::from(axis.input)].push([axis.start, axis.step, axis.points as f32]);
    }
    places
}

/// Inside tables, at points and beside them, at ends and beyond.
fn position(random: &mut Random, places: &[[f32; 3]]) -> f32 {
    if places.is_empty() {
        return random.part() * 2000.0 - 1000.0;
    }
    let [start, step, points] = places[random.below(places.len() as u32) as usize];
    let point = start + random.below(points as u32 + 1) as f32 * step;
    match random.below(16) {
        0 | 1 => point,
        2 => point.next_up(),
        3 => point.next_down(),
        4 => start - random.part() * step * points,
        5 => start + (1.0 + random.part()) * step * points,
        6 => [1e9, -1e9, f32::MAX, f32::MIN, f32::INFINITY, f32::NEG_INFINITY][random.below(6) as usize],
        _ => start + random.part() * step * points,
    }
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || (a == 0.0 && b == 0.0)
}

fn compare(
    name: &str,
    blob: &[u8],
    facts: &[u8],
    (rust, check): (Corrections, fn() -> bool),
    checks: &[i32],
    c: &[C<'_>],
    behind: &trueaxis_capi::Generated,
    count: u32,
) -> bool {
    if checks.iter().any(|check| *check != 1) {
        println!("{name}: a check refuses what C computes: {checks:?}");
        return false;
    }
    let blob = AlignedBlob::from_bytes(blob);
    let halves = std::thread::scope(|scope| {
        let half = |seed| scope.spawn({
            let blob = &blob;
            move || evaluations(name, blob, rust, c, count / 2, seed)
        });
        [half(1), half(2)].map(|half| half.join().unwrap_or(false))
    });
    let (whole, _) = loaded(&blob);
    let machine = c_servo::Machine { axes: whole.axes(), auxiliaries: whole.auxiliaries() };
    let servo = servos(name, &blob, facts, (rust, check)) & c_servo::compare(name, &machine, &blob, behind);
    let good = halves == [true, true] && servo;
    println!(
        "{name:<18} {} at {count} inputs in Rust and {} ways in C; servos of Rust and C with either: {}",
        if halves == [true, true] { "the same bits" } else { "DIFFERS" },
        c.len(),
        if servo { "the same bits" } else { "DIFFERS" }
    );
    good
}

/// A compensation, and where the terms are whose weights can be set.
fn loaded<'a>(blob: &'a [u8]) -> (Box<Whole<'a>>, Vec<(usize, [f32; 2])>) {
    let mut whole = Box::new(Whole::empty());
    whole.load(blob).expect("a blob that was just compiled");
    let adjustable = whole.terms().enumerate().filter_map(|(k, t)| Some((k, t.limits?))).collect();
    (whole, adjustable)
}

fn evaluations(name: &str, blob: &[u8], rust: Corrections, c: &[C<'_>], count: u32, seed: u64) -> bool {
    let (whole, adjustable) = loaded(blob);
    let axes = whole.axes().len();
    let places = places(&whole);
    let mut weights = whole.weights();
    let mut random = Random(seed);
    let mut inputs = Inputs::at([0.0; 16]);
    let mut travel = Travelling([Travel::Unknown; 16]);
    let mut given = Given { inputs: [0.0; 24], travel: [0; 16], weights: Vec::new() };
    for _ in 0..count {
        for (k, places) in places.iter().enumerate() {
            given.inputs[k] = position(&mut random, places);
        }
        inputs.axes[..axes].copy_from_slice(&given.inputs[..axes]);
        inputs.auxiliaries.copy_from_slice(&given.inputs[axes..axes + 8]);
        for (sign, travel) in given.travel.iter_mut().zip(&mut travel.0) {
            (*sign, *travel) =
                [(0, Travel::Unknown), (1, Travel::Positive), (-1, Travel::Negative)][random.below(3) as usize];
        }
        for (term, [low, high]) in &adjustable {
            weights.set(*term, low + (high - low) * random.part()).expect("within its limits");
        }
        given.weights.clear();
        given.weights.extend(weights.iter().map(|(_, value)| value));
        let right = whole.evaluate(&inputs, &travel, &weights);
        let is_right = |kind: &str, found: &[f32; 16]| {
            let same = found.iter().zip(&right).take(axes).all(|(a, b)| same(*a, *b));
            if !same {
                println!("{name}: {kind} at {:?}: {found:?}, not {right:?}", given.inputs);
            }
            same
        };
        let mut found = [0.0; 16];
        rust(&inputs, &travel, &weights, &mut found);
        let c_is_right = |(kind, evaluate): &C<'_>| {
            let mut found = [0.0; 16];
            evaluate(&given, &mut found);
            is_right(kind, &found)
        };
        if !is_right("Rust", &found) || !c.iter().all(c_is_right) {
            return false;
        }
    }
    true
}

/// Periods of servos that are compared.
const PERIODS: u32 = 200_000;

/// Positions of axes on moves that begin anew every 977 periods.
#[derive(Default)]
struct Moves {
    at: [f32; 16],
    speed: [f32; 16],
}

impl Moves {
    fn advance(&mut self, axes: &[Axis], period: u32, random: &mut Random) {
        for ((axis, speed), q) in axes.iter().zip(&mut self.speed).zip(&mut self.at) {
            let [low, high] = axis.travel;
            if period % 977 == 0 {
                *speed = (random.part() - 0.5) * (high.min(1e3) - low.max(-1e3)) * 1e-3;
            }
            *q = (*q + *speed).clamp(low.max(-1e4), high.min(1e4));
        }
    }

    /// The inputs of a servo; now and then one is not a number.
    fn shown(&self, random: &mut Random) -> [f32; 16] {
        let mut shown = self.at;
        if random.below(5000) == 0 {
            shown[0] = f32::NAN;
        }
        shown
    }
}

/// Two servos over the same moves, one with tables and one with code: every correction and condition.
fn servos(name: &str, blob: &[u8], facts: &[u8], (rust, check): (Corrections, fn() -> bool)) -> bool {
    let (whole, adjustable) = loaded(blob);
    let mut small = Box::new(Whole::empty());
    small.load(facts).expect("the facts that were just generated");
    let auxiliaries: Vec<f32> = whole.auxiliaries().iter().map(|a| a.reference).collect();
    let mut tables = Box::new(Servo::new(&*whole));
    let mut code = Box::new(Servo::new(Generated::new(&*small, rust, check).expect("the bits of the compensation")));
    let mut random = Random(3);
    let mut inputs = Inputs::at([0.0; 16]);
    inputs.auxiliaries[..auxiliaries.len()].copy_from_slice(&auxiliaries);
    let mut moves = Moves::default();
    let all = ((1_u32 << whole.axes().len()) - 1) as u16;
    for period in 0..PERIODS {
        moves.advance(whole.axes(), period, &mut random);
        match random.below(4000) {
            0 => (tables.disable(), code.disable()),
            1..8 => (tables.enable(), code.enable()),
            8 => (tables.dry_run(true), code.dry_run(true)),
            9..12 => (tables.dry_run(false), code.dry_run(false)),
            12..20 if !adjustable.is_empty() => {
                let (term, [low, high]) = adjustable[random.below(adjustable.len() as u32) as usize];
                let value = low + (high - low) * random.part();
                (tables.set_weight(term, value).expect("in limits"), code.set_weight(term, value).expect("in limits"))
            }
            20..24 if !auxiliaries.is_empty() => {
                inputs.auxiliaries[0] = auxiliaries[0] + random.part() * 10.0;
                ((), ())
            }
            _ => ((), ()),
        };
        inputs.axes = moves.shown(&mut random);
        let mask = if random.below(3000) == 0 { all >> 1 } else { all };
        let a = tables.update(&inputs, mask, 0.001);
        let b = code.update(&inputs, mask, 0.001);
        let alike = a.dq.iter().zip(&b.dq).all(|(a, b)| same(*a, *b)) && a.status == b.status;
        if !alike {
            println!("{name}: a servo in period {period}: {:?}, not {:?}", b, a);
            return false;
        }
    }
    true
}
