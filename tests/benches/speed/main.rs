//! Run times compared with rivals, in one run: `cargo xtask bench`.
//!
//! Every figure is the median over many batches, in nanoseconds per call, on one thread. With `--calls WORKLOAD N`
//! nothing is timed: the workload is called N times, for a program that counts instructions.

/// This compensation as `golden::blob("huron-13")`.
#[path = "../../../shared/examples/generated/huron_13.rs"]
mod huron_13;
mod steady;
mod timing;

use interpn::MultilinearRegular;
use std::hint::black_box;
use std::process::ExitCode;
use steady::{Case, Steady};
use timing::{POINTS, per_call};
use trueaxis::{AlignedBlob, Compensation, Inputs, Servo, Travelling};
use trueaxis_tests::{Fixed, golden, machine};

/// Positions in the travel of the Huron, in the order of its blob, and its compensation.
struct Huron {
    blob: AlignedBlob,
    inputs: Vec<Inputs<[f32; 8]>>,
}

impl Huron {
    fn new() -> Self {
        let machine = machine("examples/huron-k2x8/machine.toml");
        let mut random = Fixed::new(1);
        let inputs = (0..POINTS)
            .map(|_| {
                let q = machine.to_command(&random.position(&machine));
                Inputs::at(std::array::from_fn(|i| q.get(i).map_or(0.0, |q| *q as f32)))
            })
            .collect();
        Self {
            blob: golden::blob("huron-13"),
            inputs,
        }
    }

    fn load(&self) -> Compensation<'_> {
        Compensation::decode(&self.blob).expect("a golden blob loads")
    }
}

/// 25³ nodes over X Y Z, three outputs.
struct Cube {
    blob: AlignedBlob,
    columns: [Vec<f32>; 3],
    points: [Vec<f32>; 3],
}

const NODES: usize = 25;
const STEP: f32 = 20.0;

impl Cube {
    fn new() -> Self {
        let draft = golden::cube();
        let values = &draft.grids[0].values;
        let mut random = Fixed::new(3);
        Self {
            blob: draft.encode().expect("a sound draft"),
            columns: std::array::from_fn(|k| values[k..].iter().step_by(3).copied().collect()),
            points: std::array::from_fn(|_| {
                (0..POINTS)
                    .map(|_| random.within(0.0, 480.0) as f32)
                    .collect()
            }),
        }
    }

    fn inputs(&self) -> Vec<Inputs<[f32; 8]>> {
        let at = |i: usize| {
            let mut q = [0.0; 8];
            for (q, points) in q.iter_mut().zip(&self.points) {
                *q = points[i];
            }
            Inputs::at(q)
        };
        (0..POINTS).map(at).collect()
    }
}

fn evaluations(compensation: &Compensation<'_>, inputs: &[Inputs<[f32; 8]>]) {
    let (travel, weights) = (Travelling::default(), compensation.weights());
    for q in inputs {
        black_box(compensation.evaluate(black_box(q), &travel, &weights));
    }
}

fn generated(inputs: &[Inputs<[f32; 8]>]) {
    for q in inputs {
        let [y, a, c, x, z, ..] = black_box(q).axes;
        black_box(huron_13::evaluate(&[y, a, c, x, z]));
    }
}

fn servo_updates(servo: &mut Servo<&Compensation<'_>>, inputs: &[Inputs<[f32; 8]>]) {
    for q in inputs {
        black_box(servo.update(black_box(q), u16::MAX, 0.001));
    }
}

fn verdict(ratio: f64, target: f64) -> String {
    let word = if ratio <= target { "met" } else { "missed" };
    format!("{ratio:.3}   (target {target:.2}: {word})")
}

fn line(what: &str, nanoseconds: f64) {
    println!("  {what:<58} {nanoseconds:>9.1} ns");
}

fn thirteen_errors() {
    println!("thirteen errors of the Huron, five axes, one correction");
    let huron = Huron::new();
    let compensation = huron.load();
    let evaluate = per_call(|| evaluations(&compensation, &huron.inputs));
    line("tables: evaluate", evaluate);
    for q in &huron.inputs {
        let (travel, weights) = (Travelling::default(), compensation.weights());
        let tables = compensation.evaluate(q, &travel, &weights);
        let [y, a, c, x, z, ..] = q.axes;
        assert_eq!(huron_13::evaluate(&[y, a, c, x, z]), tables[..5]);
    }
    let code = per_call(|| generated(&huron.inputs));
    line("generated code: evaluate", code);
    println!("  generated / tables: {}", verdict(code / evaluate, 0.5));
    let mut servo = Servo::new(&compensation);
    servo.enable();
    line(
        "tables: servo update",
        per_call(|| servo_updates(&mut servo, &huron.inputs)),
    );
}

fn steady_updates() {
    println!("servo updates while nothing but positions changes");
    let mut plain = None;
    for case in Case::ALL {
        let blob = steady::blob(case);
        let compensation: Compensation<'_> = Compensation::decode(&blob).expect("loads");
        let mut servo = Steady::new(case, &compensation);
        let time = per_call(|| servo.updates(POINTS));
        line(case.name(), time);
        let plain = *plain.get_or_insert(time);
        if case != Case::Plain {
            println!("  {} / steady: {}", case.name(), verdict(time / plain, 1.2));
        }
    }
}

fn grid() {
    println!("grid of {NODES}×{NODES}×{NODES} nodes, three outputs");
    let cube = Cube::new();
    let compensation = Compensation::decode(&cube.blob).expect("loads");
    let inputs = cube.inputs();
    let ours = per_call(|| evaluations(&compensation, &inputs));
    line("grid: evaluate", ours);
    let rivals = cube.columns.each_ref().map(|column| {
        MultilinearRegular::<f32, 3>::new([NODES; 3], [0.0; 3], [STEP; 3], column).expect("sound")
    });
    let points = cube.points.each_ref().map(Vec::as_slice);
    let mut out = vec![0.0; POINTS];
    let theirs = per_call(|| {
        for rival in &rivals {
            rival.interp(black_box(&points), &mut out).expect("sound");
            black_box(&out);
        }
    });
    line("interpn, three calls on all points, f32", theirs);
    println!("  grid / interpn: {}", verdict(ours / theirs, 0.6));
}

/// Calls a workload `count` times, after the same preparation for any count.
fn calls(workload: &str, count: usize) -> Result<(), String> {
    let huron = Huron::new();
    let cube = Cube::new();
    let (on_huron, on_cube) = (
        huron.load(),
        Compensation::decode(&cube.blob).expect("loads"),
    );
    let cube_inputs = cube.inputs();
    let mut servo = Servo::new(&on_huron);
    servo.enable();
    if let Some(case) = Case::ALL.into_iter().find(|case| case.name() == workload) {
        let blob = steady::blob(case);
        let compensation: Compensation<'_> = Compensation::decode(&blob).expect("loads");
        Steady::new(case, &compensation).updates(count);
        return Ok(());
    }
    match workload {
        "evaluate" => evaluations(&on_huron, &huron.inputs[..count]),
        "generated" => generated(&huron.inputs[..count]),
        "servo" => servo_updates(&mut servo, &huron.inputs[..count]),
        "grid" => evaluations(&on_cube, &cube_inputs[..count]),
        other => return Err(format!("no workload `{other}`")),
    }
    Ok(())
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|a| a != "--bench")
        .collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["--calls", workload, count] => {
            let result = count
                .parse()
                .map_err(|_| format!("`{count}` is not a number"));
            if let Err(message) = result.and_then(|n: usize| calls(workload, n.min(POINTS))) {
                eprintln!("{message}");
                return ExitCode::from(2);
            }
        }
        // `cargo test --benches` starts it as well, but there is nothing to test.
        ["--test"] => {}
        _ => {
            thirteen_errors();
            steady_updates();
            grid();
        }
    }
    ExitCode::SUCCESS
}
