//! The program as Rust.

use crate::program::{Program, Samples, Statement};
use crate::text::{Syntax, checks, helpers, lines_of_bytes, rows};
use crate::{ForServo, Head};

/// The whole file.
pub fn print(program: &Program, head: &Head<'_>) -> String {
    // No inner attributes, so that the file can be a module as well as be included in one.
    let mut text = head.comment("// ");
    text += "\n";
    text += "/// The axes, in the order of inputs and corrections.\n";
    let letters: Vec<String> = head.axes.iter().map(|a| format!("'{a}'")).collect();
    text += &format!(
        "#[allow(dead_code)]\npub const AXES: [char; {}] = [{}];\n",
        program.axes,
        letters.join(", ")
    );
    text += "/// The checksum of the compensation that this code evaluates.\n";
    text += &format!(
        "#[allow(dead_code)]\npub const CHECKSUM: u32 = {:#010X};\n\n",
        head.checksum
    );
    text += &body(program, head);
    text += &check(program, head);
    if let Some(servo) = &head.servo {
        text += &for_servo(program, servo);
    }
    for array in &program.arrays {
        let of_row = array.points.iter().rev().fold(
            format!("[{}; {}]", element(&array.samples), array.columns),
            |inner, points| format!("[{inner}; {points}]"),
        );
        text += &format!(
            "\n/// {}\n#[rustfmt::skip]\n#[allow(clippy::all, clippy::pedantic)]\nstatic {}: {of_row} = ",
            array.about, array.name
        );
        text += &rows(array, ['[', ']'], RUST.float);
        text += ";\n";
    }
    text += &helpers(program, [HELD, CIRCULAR, LINE, BY_TRAVEL]);
    text
}

/// The function that tells whether the code was compiled as it stands.
fn check(program: &Program, head: &Head<'_>) -> String {
    let (inputs, axes, weights) = (program.inputs, program.axes, program.weights);
    let mut kinds = vec![format!("[f32; {inputs}]")];
    let mut names = vec!["inputs"];
    if program.is_directional {
        kinds.push(format!("[i8; {axes}]"));
        names.push("travel");
    }
    if weights > 0 {
        kinds.push(format!("[f32; {weights}]"));
        names.push("weights");
    }
    kinds.push(format!("[f32; {axes}]"));
    let arguments: Vec<String> = names.iter().map(|n| format!("black_box({n})")).collect();
    format!(
        "
/// Whether this build gives the bits of the compensation: false if operations were fused, reordered or rounded otherwise.
#[must_use]
#[rustfmt::skip]
#[allow(dead_code, clippy::all, clippy::pedantic)]
pub fn check() -> bool {{
    // So that no corrections are computed by the compiler.
    use core::hint::black_box;
    CHECKS.iter().all(|({names}, corrections)| evaluate({arguments}) == *corrections)
}}

/// At these inputs, operations that are fused with others or done in another order change a bit.
#[rustfmt::skip]
#[allow(dead_code, clippy::all, clippy::pedantic)]
static CHECKS: [({kinds}); {count}] = [
{lines}];
",
        names = names.join(", "),
        arguments = arguments.join(", "),
        kinds = kinds.join(", "),
        count = head.checks.len(),
        lines = checks(program, head.checks, ['[', ']'], ['(', ')'], RUST.float),
    )
}

/// What `trueaxis::Generated` takes.
fn for_servo(program: &Program, servo: &ForServo) -> String {
    let arguments = arguments_for_servo(program, servo);
    let axes = program.axes;
    let sign = if program.is_directional { SIGN } else { "" };
    format!(
        "
/// Axes, bounds, auxiliaries and weights as a compensation without samples: what a servo needs beside the code.
#[rustfmt::skip]
#[allow(dead_code)]
pub static FACTS: trueaxis::Aligned<[u8; {}]> = trueaxis::Aligned([
{}]);

/// For `trueaxis::Generated::new(&facts, corrections, check)`, where `facts` is a compensation loaded from [`FACTS`].
#[inline]
#[rustfmt::skip]
#[allow(dead_code)]
pub fn corrections<const N: usize>(
    inputs: &trueaxis::Inputs<[f32; N]>,
    travel: &trueaxis::Travelling<[trueaxis::Travel; N]>,
    weights: &trueaxis::Weights,
    corrections: &mut [f32; N],
) {{
    const {{ assert!(N >= {axes}, \"capacities for fewer axes than the machine has\") }};
    let _ = (travel, weights);
    let values = evaluate({arguments});
    corrections[..{axes}].copy_from_slice(&values);
}}
{sign}",
        servo.facts.len(),
        lines_of_bytes(&servo.facts)
    )
}

/// What a servo passes to the code.
fn arguments_for_servo(program: &Program, servo: &ForServo) -> String {
    let list = |count: usize, each: &dyn Fn(usize) -> String| {
        (0..count).map(each).collect::<Vec<_>>().join(", ")
    };
    let inputs = list(program.inputs, &|k| match k.checked_sub(program.axes) {
        None => format!("inputs.axes[{k}]"),
        Some(auxiliary) => format!("inputs.auxiliaries[{auxiliary}]"),
    });
    let mut arguments = format!("&[{inputs}]");
    if program.is_directional {
        let travel = list(program.axes, &|k| format!("sign(travel.0[{k}])"));
        arguments += &format!(", &[{travel}]");
    }
    if program.weights > 0 {
        let adjustable = servo.adjustable.iter();
        let weights = adjustable.map(|term| format!("weights.get({term}).unwrap_or_default()"));
        arguments += &format!(", &[{}]", weights.collect::<Vec<_>>().join(", "));
    }
    arguments
}

const SIGN: &str = "
fn sign(travel: trueaxis::Travel) -> i8 {
    match travel {
        trueaxis::Travel::Positive => 1,
        trueaxis::Travel::Negative => -1,
        trueaxis::Travel::Unknown => 0,
    }
}
";

fn element(samples: &Samples) -> &'static str {
    match samples {
        Samples::Floats(_) => "f32",
        Samples::Shorts(_) => "i16",
    }
}

fn body(program: &Program, head: &Head<'_>) -> String {
    let mut text =
        "/// The corrections to add to the commanded positions, in mm and degrees.\n///\n"
            .to_owned();
    text += &format!("/// `inputs`: {}.\n", head.inputs());
    let mut arguments = vec![format!("inputs: &[f32; {}]", program.inputs)];
    if program.is_directional {
        text += "///\n/// `travel`: the direction in which each axis last moved: 1, -1, or 0 if unknown.\n";
        arguments.push(format!("travel: &[i8; {}]", program.axes));
    }
    if program.weights > 0 {
        text += "///\n/// `weights`: those of the adjustable terms, in their order.\n";
        arguments.push(format!("weights: &[f32; {}]", program.weights));
    }
    let arguments = arguments.join(", ");
    text += &format!(
        "#[inline]\n#[must_use]\n#[rustfmt::skip]\n#[allow(clippy::all, clippy::pedantic)]\npub fn evaluate({arguments}) -> [f32; {}] {{\n",
        program.axes
    );
    let mut corrections = Vec::new();
    for one in &program.statements {
        text += &format!("    {}\n", statement(program, one));
        if let Statement::Correction(axis, _) = one {
            corrections.push(format!("d{axis}"));
        }
    }
    text += &format!("    [{}]\n}}\n", corrections.join(", "));
    text
}

fn statement(program: &Program, statement: &Statement) -> String {
    match statement {
        Statement::Comment(comment) => format!("// {comment}"),
        Statement::Let(local, value) => {
            let value = RUST.show(program, value);
            format!("let {} = {value};", program.name(*local))
        }
        Statement::Interval {
            index,
            fraction,
            steps,
            count,
            is_circular,
        } => {
            let (index, fraction) = (program.name(*index), program.name(*fraction));
            let function = if *is_circular { "circular" } else { "held" };
            let steps = RUST.show(program, steps);
            format!("let ({index}, {fraction}) = {function}({steps}, {count});")
        }
        Statement::Next {
            index,
            of,
            last,
            wraps,
        } => {
            let (index, of) = (program.name(*index), program.name(*of));
            let beyond = if *wraps { 0 } else { *last };
            format!("let {index} = if {of} < {last} {{ {of} + 1 }} else {{ {beyond} }};")
        }
        Statement::Correction(axis, value) => {
            format!("let d{axis} = {};", RUST.show(program, value))
        }
    }
}

const RUST: Syntax = Syntax {
    float: "",
    integer: "",
    short: ["f32::from(", ")"],
    has_every_bracket: false,
    helper: "",
};

const HELD: &str = "
/// The interval that lies so many steps from the first point, at most `intervals`, and the fraction in it.
#[inline(always)]
fn held(steps: f32, intervals: u32) -> (usize, f32) {
    // From 0 on, numbers are in the order of their bits; negative ones and not-a-number have larger bits.
    if steps.to_bits() < (intervals as f32).to_bits() {
        let index = (steps as u32).min(intervals);
        (index as usize, steps - index as f32)
    } else if steps > 0.0 {
        (intervals as usize, 0.0)
    } else {
        (0, 0.0)
    }
}
";
const CIRCULAR: &str = "
/// The interval that lies so many steps from the first of the points on a circle, and the fraction in it.
#[inline(always)]
fn circular(steps: f32, points: u32) -> (usize, f32) {
    if steps.to_bits() < (points as f32).to_bits() {
        let index = (steps as u32).min(points - 1);
        (index as usize, steps - index as f32)
    } else {
        (0, 0.0)
    }
}

/// A distance without its whole periods.
#[inline(always)]
fn reduced(distance: f32, period: f32, inverse: f32) -> f32 {
    let p = distance * inverse;
    let p = if p < 4194304.0 { p } else { 4194304.0 };
    let p = if p > -4194304.0 { p } else { -4194304.0 };
    let whole = p as i32 as f32;
    let floor = if whole > p { whole - 1.0 } else { whole };
    distance - floor * period
}
";
const LINE: &str = "
/// A straight line from `first` over one step; beyond, its ends hold.
#[inline(always)]
fn line(steps: f32, first: f32, change: f32, last: f32) -> f32 {
    // From 0 on, numbers are in the order of their bits; negative ones and not-a-number have larger bits.
    if steps.to_bits() < 1.0_f32.to_bits() {
        first + change * steps
    } else if steps > 0.0 {
        last
    } else {
        first
    }
}
";
const BY_TRAVEL: &str = "
/// One value after positive, another one after negative travel, 0 while the direction is not known.
#[inline(always)]
fn by_travel(travel: i8, positive: f32, negative: f32) -> f32 {
    if travel > 0 {
        positive
    } else if travel < 0 {
        negative
    } else {
        0.0
    }
}
";
